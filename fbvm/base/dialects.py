"""Dialects: the answers to questions in which compilers disagree, as switches.  Data only; the compiler reads the switches.

The default is the third edition where it speaks, and what CODESYS users see where it is silent.  A dialect never makes a
correct program of the standard mean something else but where its switches say so.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace


@dataclass(frozen=True)
class Dialect:
    """One set of answers."""

    name: str
    for_whom: str
    libraries: tuple[str, ...] = ()
    """Libraries whose blocks stand in place of the standard ones."""
    refused: frozenset[str] = frozenset()
    """Forms that the tool does not take: POINTER TO, REFERENCE TO, REF_TO, WSTRING, alias, and those of objects."""
    warned: frozenset[str] = frozenset()
    """The same, of which it is only warned."""
    last_of_mux: bool = False
    lenient_positions: bool = False
    seconds: bool = False
    dates_in_nanoseconds: bool = False
    hexadecimal_bits: bool = False
    real_bits_by_value: bool = False
    reals_of_other_widths: bool = False
    loop_ends_each_pass: bool = False
    loop_counters_wrap: bool = False
    arithmetic_of_bits: bool = False
    integers_and_bits: bool = False
    numbers_of_enumerations: bool = False
    members_as_numbers: bool = False
    number_times_duration: bool = False
    integers_are_nanoseconds: bool = False
    mixed_arguments: bool = False
    pointers_count_elements: bool = False
    pragmas_act: bool = False
    bare_actions: bool = False
    locals_are_read: bool = False
    written_out: bool = False
    programs_are_written: bool = False
    locals_are_written: bool = False
    initial_variables: bool = False
    round_arrays: bool = False
    nested_repetitions: bool = False
    lenient_texts: str = ""  # how a text that is no literal is converted: "leading", "whole", or "" for a trap
    whole_powers: bool = False
    no_open_inputs: bool = False
    instances_are_values: bool = False
    action_inputs: bool = False
    subranges_unchecked: bool = False
    padding_is_written: bool = False
    large_memory: bool = False
    unsigned_ltime: bool = False
    empty_bodies: bool = False
    in_outs_are_read: bool = False
    in_outs_are_written: bool = False
    narrowing: bool = False
    sums_in_dint: bool = False
    reals_saturate: bool = False
    reals_wrap: bool = False
    ties_away: bool = False
    comments_end_at_once: bool = False
    pragmas_of_c: bool = False
    zero_durations: bool = False
    bare_construction: bool = False
    first_label_counts: bool = False
    idle_statements: bool = False
    idle_constants: bool = False
    outputs_with_assign: bool = False
    fixed_counters: bool = False
    names_of_edition_2: bool = False
    constants_wrap: bool = False
    signs_are_lost: bool = False
    short_circuits: bool = False
    joined_words: bool = False
    spaced_durations: bool = False
    ampersand_refers: bool = False
    bits_by_name: bool = False
    generic_functions: bool = False
    generic_constants: bool = False
    outputs_are_passed: bool = False
    own_in_outs: bool = False
    places_for_all: bool = False
    wrong_bcd_is_zero: bool = False
    negative_is_zero: bool = False
    any_width_at: bool = False
    bits_of_words: bool = False
    whole_characters: bool = False
    short_references: bool = False
    doubled_quotes: bool = False
    steps_apart: bool = False
    times_are_numbers: bool = False
    short_addresses: bool = False
    dates_take_durations: bool = False
    callables_apart: bool = False
    sizes_apart: bool = False
    integers_are_conditions: bool = False
    short_names: bool = False
    own_time: bool = False
    short_circuit_words: bool = False
    jumps_in_text: bool = False
    exceptions: bool = False
    raises_exceptions: bool = False
    glued_words: bool = False
    assignments_are_values: bool = False
    texts_have_addresses: bool = False
    conditional_returns: bool = False
    empty_structures: bool = False
    bounds_are_not_compared: bool = False
    persistent_parameters: bool = False
    constant_inputs_are_written: bool = False
    constant_in_outs_take_texts: bool = False
    functions_have_inputs: bool = False
    plain_names: bool = False
    locals_hide_results: bool = False
    selects_at_first: bool = False
    plain_en: bool = False
    dynamic_memory: str = ""  # __NEW and __DELETE: "marked" if they want an attribute at what is made, "free" if not, "" if none
    offered: bool = True  # whether hints for sources of any tool name it


QUESTIONS = {
    "last_of_mux": ("MUX with K out of range", "stops the program (R0107)", "the last input"),
    "lenient_positions": ("a length below 0 or a position below 1 in LEFT, MID, DELETE ...", "stops the program (R0108)",
                          "0, and position 1"),
    "seconds": ("TIME_TO_REAL(T#5s), INT_TO_TIME(5000): the unit", "milliseconds", "seconds"),
    "dates_in_nanoseconds": ("ULINT_TO_DT(n), TOD_TO_LINT(t), LINT_TO_DATE(n): the unit",
                             "seconds; of a time of day milliseconds", "nanoseconds"),
    "hexadecimal_bits": ("DWORD_TO_STRING(255)", "'255'", "'16#ff'"),
    "real_bits_by_value": ("REAL_TO_DWORD(2.0), DWORD_TO_REAL(2), LREAL_TO_LWORD, LWORD_TO_LREAL",
                           "the bits stay: 16#40000000, 2.8E-45", "the value: 2, 2.0"),
    "reals_of_other_widths": ("WORD_TO_REAL(7), REAL_TO_BYTE, LREAL_TO_DWORD: a bit string of another width than the real",
                              "an error", "the value, rounded"),
    "loop_ends_each_pass": ("end and step of FOR", "worked out once, in front of the loop",
                            "worked out on every pass, the end in front of it, the step behind it"),
    "loop_counters_wrap": ("FOR i := 120 TO 127, where i is a SINT: what i is behind it", "127: the next one does not fit",
                           "-128: the next one, wrapped"),
    "arithmetic_of_bits": ("+ - * / MOD of BYTE, WORD, DWORD, LWORD", "an error", "as unsigned numbers"),
    "integers_and_bits": ("WORD where INT is needed, INT where UINT is, LREAL where REAL is, DINT where REAL is; AND, OR, XOR, "
                          "NOT of integers",
                          "an error that names the conversion", "converted as it stands if the width suffices; on their bits"),
    "numbers_of_enumerations": ("an enumeration as a number, < and > between its members", "an error", "its value"),
    "members_as_numbers": ("TO_STRING of an enumeration", "the name of its member",
                           "its number; the name where {attribute 'to_string'} stands in front of the type"),
    "number_times_duration": ("2 * T#5s", "an error: the TIME stands in front", "T#10s"),
    "integers_are_nanoseconds": ("T#1s + 5, T#1s - n: an integer beside a duration", "an error", "nanoseconds"),
    "mixed_arguments": ("F(1, b := 2): some arguments named, some not", "an error",
                        "those without a name are for the parameters that none names, in order"),
    "pointers_count_elements": ("p + 1, where p is POINTER TO INT, or REF_TO INT", "the next byte; REF_TO is not moved",
                                "the next INT; ADR(x) + 1 is the next byte"),
    "pragmas_act": ("VAR_INPUT {ref}; {external} in front of a POU", "the pragmas have no effect (S0190)",
                         "passed by reference, as VAR_IN_OUT; refused, as its body is in another language (S0901)"),
    "bare_actions": ("Reset; where Reset is an ACTION", "an error", "a call of it"),
    "written_out": ("a := [1, 2, 3], F((x := 1, y := 2)): arrays and structures written out in statements", "an error (S0903)",
                    "taken; what is left out has the first value of its type"),
    "locals_are_read": ("a VAR of a function block, read through an instance", "an error", "its value"),
    "programs_are_written": ("Prog.count := 0, where count is a VAR of the PROGRAM", "an error", "written"),
    "locals_are_written": ("instance.count := 0, where count is a VAR of the block", "an error", "written"),
    "lenient_texts": ("STRING_TO_INT('12 pcs'), STRING_TO_REAL('none')", "stops the program (R0111)",
                      "the number that the text begins with, else 0; under rusty 0 unless the whole text is one, a real without "
                      "its fraction"),
    "initial_variables": ("VAR x : INT := y, where y is a variable", "an error",
                          "the value that y begins with; in a FUNCTION, and for VAR_TEMP, what y has when the body starts"),
    "round_arrays": ("VAR a : ARRAY[0..3] OF INT := (1, 2, 3, 4): an array in parentheses", "an error", "[1, 2, 3, 4]"),
    "nested_repetitions": ("[20(5(1))]: a repetition in a repetition", "an error", "100 values: row by row"),
    "whole_powers": ("2 ** 3, EXPT(2, 10) of constants, where an integer is needed", "an error that names the conversion",
                     "8, 1024: the value if it is whole; under codesys with a warning (S0793)"),
    "no_open_inputs": ("ARRAY [*] as VAR_INPUT of a FUNCTION",
                       "taken: the function reads the argument where it lies, without a copy, and cannot write it",
                       "refused (S0903); VAR_IN_OUT takes it"),
    "instances_are_values": ("VAR_INPUT t : TON of a FUNCTION_BLOCK or PROGRAM: an instance as an input; a := b of instances; "
                             "an instance as a result",
                             "read where the argument lies: its outputs are read, it is not called; an error",
                             "an instance of the block's own, which may be called; an argument is copied into it in front of "
                             "the body; all variables are copied"),
    "in_outs_are_read": ("an in-out of a function block, read through an instance", "an error",
                         "the variable that the last call passed; in front of the first call the program stops (R0110)"),
    "action_inputs": ("motor.Stop(now := TRUE): an ACTION of an instance, called with its parameters", "an error",
                      "inputs and in-outs are written, the action is called, outputs are read"),
    "subranges_unchecked": ("a variable of INT(1..10) gets 0", "stops the program (R0103); of a constant it is an error (S0702)",
                            "it is 0: CODESYS checks nothing unless a project has CheckRangeSigned"),
    "unsigned_ltime": ("LTIME#213503d, LTIME_TO_STRING", "an error (S0108): LTIME has a sign, and ends at 106,751 days; 'LT#1d'",
                       "LTIME has all 64 bits for days; 'LTIME#1d'; sums and comparisons are those of LTIME with a sign"),
    "padding_is_written": ("p[10] := 0, where p points at an ARRAY[0..9] OF BYTE that a method or function declares",
                           "stops the program (R0110)",
                           "written: arrays, structures and texts there are padded to 8 bytes; what lies behind that stops the "
                           "program"),
    "large_memory": ("a variable, structure or instance of 100 MiB", "an error (S0603): more than 64 MiB, or 256 MiB together",
                     "taken: up to 128 MiB, and 1 GiB together"),
    "empty_bodies": ("the call of a block that EXTENDS another and has no statement", "runs the body of its base",
                     "runs nothing"),
    "in_outs_are_written": ("motor.speed := n; motor();, where speed is an in-out of the block", "errors",
                            "n is copied into the instance, as for an input, and a call without the in-out works on that copy"),
    "narrowing": ("DINT where INT is needed, REAL where DINT is, BOOL where a number is, a reference to another type",
                  "an error that names the conversion",
                  "cut to the width; without its fraction, the nearest number that there is; 1 and 0; as it is"),
    "sums_in_dint": ("+ - * / MOD of INT, SINT, UINT, USINT: 30000 + 30000, USINT#0 - 1", "in their own type, which wraps",
                     "as DINT"),
    "reals_saturate": ("REAL_TO_INT(70000.0), TRUNC of what does not fit", "stops the program (R0105)",
                       "the nearest number that there is; 0 for NAN"),
    "reals_wrap": ("REAL_TO_INT(70000.0), TRUNC: the width of the result", "must suffice (R0105)",
                   "4464: cut to it, as integers are; what 64 bits do not hold is 16#8000_0000_0000_0000 first"),
    "ties_away": ("REAL_TO_INT(2.5), REAL_TO_INT(50.5); REAL_TO_BYTE(-1.0)",
                  "2, 50: to the nearest, ties to even; bit strings have no negative ones",
                  "3, 51: to the nearest, ties away from 0; bit strings take the low bits, 16#FF"),
    "comments_end_at_once": ("(* a (* b *): a comment inside a comment", "comments nest: each (* needs its *)",
                             "the first *) ends the comment"),
    "pragmas_of_c": ("{{ text of C }}, {disable code generation}, {#include}: pragmas of the generator of matiec",
                     "{{ }} is an error, the others have no effect (S0190)",
                     "{{ }} is passed over with a warning (S0190); the others are refused by name (S0901)"),
    "bare_construction": ("METHOD FB_init without inputs", "an error (S1011): it has bInitRetains and bInCopyCode",
                          "called for each instance as it begins, the one of the base first"),
    "zero_durations": ("t = 0, where t is a TIME", "an error", "T#0s"),
    "first_label_counts": ("CASE n OF 1..5: .. 3: ..: a label twice", "an error", "the first one counts, with a warning (S0193)"),
    "idle_statements": ("a + 1; as a statement", "an error", "worked out, with a warning (S0193)"),
    "idle_constants": ("VAR CONSTANT k : INT; without a value", "an error", "the first value of its type, as S0193 says"),
    "outputs_with_assign": ("instance(Q := x), where Q is an output", "an error", "as Q => x"),
    "fixed_counters": ("FOR i := 1 TO 9 DO i := i + 1; END_FOR", "taken, with a warning (S0590)", "an error (S0504)"),
    "names_of_edition_2": ("LTIME, LDT, LTOD, LDATE, CHAR, WCHAR as names", "an error", "taken, with a warning (S0193)"),
    "constants_wrap": ("x : INT := 40000; UDINT_TO_LINT(-1)", "an error", "-25536, cut to the width, with a warning (S0791)"),
    "signs_are_lost": ("x : UINT := -1, b : BYTE := -128: a negative constant where an unsigned type of its width is needed",
                       "an error", "65535, 128: its bits, with a warning (S0791)"),
    "short_circuits": ("a AND f(x), a OR f(x) of BOOL", "both sides are worked out",
                       "as AND_THEN and OR_ELSE: the right side only if the left one leaves the result open"),
    "joined_words": ("FUNCTIONBLOCK, END_FUNCTIONBLOCK", "an error", "FUNCTION_BLOCK, END_FUNCTION_BLOCK"),
    "spaced_durations": ("T# 30s, TIME# 5ms", "an error", "T#30s, with a warning (S0193)"),
    "ampersand_refers": ("p := &x", "an error", "REF(x)"),
    "bits_by_name": ("w.%Xk, where k is a CONSTANT", "an error", "the bit k"),
    "generic_functions": ("FUNCTION f<T : ANY_NUM> : T", "an error (S0901)", "T is ANY_NUM in the function"),
    "generic_constants": ("VAR_GENERIC CONSTANT size : INT of a FUNCTION_BLOCK, b : Buffer<100>", "an error (S0901)",
                          "a block of its own for each size; behind VAR_GENERIC may stand EXTENDS and IMPLEMENTS"),
    "outputs_are_passed": ("move(target := axis.position), where position is an output of axis and target is an in-out",
                           "an error (S0501)", "taken, with a warning (S0193): the output is read and written where it lies"),
    "own_in_outs": ("VAR_IN_OUT of a PROGRAM to which nothing is connected", "an error",
                    "a variable of the program, with a warning (S0193)"),
    "places_for_all": ("VAR_CONFIG p.count AT %MW0 : INT, where count is not declared AT %M*", "an error",
                       "count lies there, with a warning (S0193)"),
    "times_are_numbers": ("a TOD gets T#25s, a DT a TIME, a LINT a TOD: a duration, a date, a moment or an integer where another "
                          "of these is needed", "an error that names the conversion", "its nanoseconds"),
    "short_addresses": ("dword := p; p < dword; p := dword, where p is a POINTER TO: a pointer where DWORD or UDINT is needed or "
                        "the other way round, or compared with one", "an error",
                        "its address: the number of the byte in the memory of the PLC, 0 for a null pointer"),
    "dates_take_durations": ("D#2024-12-31 + T#1d: a DATE and a TIME", "an error",
                             "the DATE so much later or earlier, which may have hours in it"),
    "integers_are_conditions": ("IF n THEN, WHILE n DO, UNTIL n, where n is an integer or a bit string", "an error: n <> 0",
                                "TRUE unless n is 0, with a warning (S0193)"),
    "sizes_apart": ("a AT %QX0.0 beside b AT %QW0: addresses of two sizes", "a is a bit of b: one memory for all sizes",
                    "a is no part of b: each of %QX, %QB, %QW, %QD and %QL has memory of its own, as on a PLC of OpenPLC or "
                    "Beremiz, and so have those of %I and %M"),
    "callables_apart": ("DAY_OF_MONTH(d), where a variable that is no instance has the name of the function", "an error",
                        "the function"),
    "short_names": ("DT, TOD, LDT, LTOD as names", "an error", "taken, with a warning (S0193)"),
    "own_time": ("FUNCTION TIME : TIME", "an error", "taken, with a warning (S0193)"),
    "short_circuit_words": ("a AND_THEN b, a OR_ELSE b", "taken, with a warning (S0195)", "taken"),
    "jumps_in_text": ("JMP in Structured Text", "taken, with a warning (S0195)", "taken"),
    "persistent_parameters": ("VAR_OUTPUT RETAIN PERSISTENT, VAR_INPUT CONSTANT PERSISTENT of a FUNCTION_BLOCK",
                              "an error (S0206)", "taken"),
    "constant_inputs_are_written": ("VAR_INPUT CONSTANT of a block, written in its body or through an instance",
                                    "an error (S0501)", "written, as any other input"),
    "bounds_are_not_compared": ("a := b, where a is ARRAY[0..9] and b is ARRAY[1..10] of the same type", "an error (S0301)",
                                "the elements are copied in their order"),
    "empty_structures": ("p : Point := ()", "an error (S0101)", "as without an initial value"),
    "conditional_returns": ("RETURN(done); with parentheses around the whole value", "the result is done, and the POU is left",
                            "the POU is left if done is TRUE, with the result that it has"),
    "constant_in_outs_take_texts": ("F('abc'), where F declares VAR_IN_OUT CONSTANT s : STRING", "an error (S0407)",
                                    "a copy is passed; so it is with a text of another length"),
    "exceptions": ("__TRY .. __CATCH(code) .. __ENDTRY", "taken, with a warning (S0195)", "taken"),
    "texts_have_addresses": ("ADR('abc'), ADR(CONCAT('a', 'b')): of a constant text that is no variable", "an error (S0407)",
                             "points at the text, which lies in memory as long as the program"),
    "assignments_are_values": ("IF (ready := level > 5) THEN, RETURN(done := TRUE): an assignment in parentheses as a value",
                               "an error (S0101)", "assigns, and has the value of the variable, with a warning (S0193)"),
    "glued_words": ("FOR i := 9 TO 1 BY -1DO: no blank between a number and the word behind it", "an error (S0105)", "taken"),
    "raises_exceptions": ("F_RaiseException(code)", "an error (S0401)",
                          "stops the program (R0122), or goes on behind __CATCH(code), which gets the code"),
    "functions_have_inputs": ("FUNCTION f : INT without an input", "taken", "taken, with a warning (S0195)"),
    "plain_names": ("names that begin with _ or P_", "taken", "taken, with a warning (S0195)"),
    "any_width_at": ("x AT %IW4 : DINT, x AT %ML2 : DWORD: an address of another size than the type", "an error",
                     "x begins there, with a warning (S0193)"),
    "bits_of_words": ("%IX0.15: a bit above 7", "an error (S0601): bytes are counted behind %IX, %QX and %MX",
                      "bit 15 of word 0, which is %IX1.7, with a warning (S0193); a project that names such a bit counts words "
                      "behind all %IX, %QX and %MX, as devices with word addressing do"),
    "whole_characters": ("LEN, LEFT, MID, FIND ... of a WSTRING with a character beyond 16#FFFF",
                         "count units of UTF-16, of which it has two", "count characters"),
    "short_references": ("REF(x), where x is a variable of a FUNCTION or METHOD, or an in-out",
                         "an error (S0407): x ends with the call; ADR(x) and REF= are taken, and stop the program (R0110) if "
                         "they are followed later", "taken as ADR(x) is"),
    "doubled_quotes": ("'it''s': a quote that is doubled", "an error: $' is one", "one quote of the text"),
    "negative_is_zero": ("REAL_TO_UINT(-1.0), REAL_TO_WORD(-1.0)", "stops the program (R0105), or 65535 where the result wraps",
                         "0"),
    "wrong_bcd_is_zero": ("BCD_TO_UINT(16#9A): a digit above 9", "stops the program (R0105)", "0"),
    "steps_apart": ("a step and a variable of one name: Init", "an error",
                    "Init is the variable, Init.X and Init.T are the flags of the step, with a warning (S0193)"),
    "locals_hide_results": ("FUNCTION Test with VAR Test: a local variable named as the function", "an error",
                            "the variable, and the function returns the first value of its type, with a warning (S0193)"),
    "selects_at_first": ("SEL(p <> 0, 0, p^.n): the input that is not chosen", "worked out, too: a null pointer stops it",
                         "not worked out"),
    "plain_en": ("EN declared as VAR_INPUT, and FALSE in a call", "nothing of the call happens: EN is that of the standard",
                 "the body is executed: EN is an input as any other, FALSE where nothing is passed"),
    "dynamic_memory": ("p := __NEW(Motor); __DELETE(p);", "an error (S0903)",
                       "make and end variables while the program runs: with {attribute 'enable_dynamic_creation'} at blocks "
                       "and types of no library, under strucpp without it"),
    "libraries": ("blocks that begin or end another way; final scans of actions; SFCInit, SFCReset and their like in charts; "
                  "REAL_TO_STRING(100.0), TIME_TO_STRING(T#1s); functions beyond the standard",
                  "as the standard's bodies compute it; '100.0', 'T#1s'; none",
                  "blocks and functions of its own; under matiec '100', 'T#0d0h0m1s'; LEFT_EXT and its like and ROUND "
                  "under rusty, TIME_TO_US, TIME_TO_S ... under strucpp"),
    "refused": ("POINTER TO, REFERENCE TO, REF_TO, WSTRING, another name for a type, CLASS, INTERFACE, METHOD, PROPERTY, "
                "EXTENDS, IMPLEMENTS", "taken", "refused (S0903)"),
    "warned": ("POINTER TO, REFERENCE TO, CLASS, INTERFACE, METHOD, PROPERTY, EXTENDS, IMPLEMENTS", "taken",
               "taken, with a warning (S0195)"),
}
"""For each switch: what compilers disagree about, the answer without it, and with it."""

OBJECTS = frozenset(("CLASS", "INTERFACE", "METHOD", "PROPERTY", "EXTENDS", "IMPLEMENTS"))
"""Forms of objects, which tools of the second edition do not have."""
STANDARD = Dialect("standard", "the third edition, and CODESYS's answer where it is silent")
_CODESYS = Dialect("codesys", "programs for CODESYS and the tools that are made of it", ("codesys/blocks",), last_of_mux=True,
                   lenient_positions=True, real_bits_by_value=True, reals_of_other_widths=True, arithmetic_of_bits=True,
                   integers_and_bits=True, numbers_of_enumerations=True, members_as_numbers=True, number_times_duration=True,
                   mixed_arguments=True, bare_actions=True, locals_are_read=True, programs_are_written=True,
                   lenient_texts="leading", initial_variables=True, reals_wrap=True, ties_away=True, whole_powers=True,
                   no_open_inputs=True, instances_are_values=True, action_inputs=True, empty_bodies=True, zero_durations=True,
                   idle_statements=True, idle_constants=True, names_of_edition_2=True, joined_words=True,
                   subranges_unchecked=True, padding_is_written=True, steps_apart=True, locals_hide_results=True,
                   any_width_at=True, own_time=True, bits_of_words=True, short_circuit_words=True, jumps_in_text=True,
                   exceptions=True, conditional_returns=True, constant_in_outs_take_texts=True, persistent_parameters=True,
                   bounds_are_not_compared=True, empty_structures=True, texts_have_addresses=True, assignments_are_values=True,
                   signs_are_lost=True, generic_constants=True, outputs_are_passed=True, short_addresses=True,
                   dates_take_durations=True, dynamic_memory="marked", selects_at_first=True, plain_en=True)
_ROWS = (
    STANDARD,
    _CODESYS,
    replace(_CODESYS, name="twincat", for_whom="programs for TwinCAT 3, whose compiler answers as that of CODESYS does",
            libraries=("codesys/blocks", "twincat/blocks", "twincat/tcunit", "twincat/write_protected",
                       "twincat/motion"), unsigned_ltime=True, constant_inputs_are_written=True,
            raises_exceptions=True,
            large_memory=True, bits_of_words=False),
    replace(_CODESYS, name="codesys2", for_whom="programs for CODESYS 2.3 and TwinCAT 2",
            libraries=("codesys/blocks", "codesys/version2"), offered=False, narrowing=True, callables_apart=True,
            glued_words=True, dynamic_memory="", generic_constants=False, outputs_are_passed=False),
    Dialect("matiec", "programs for matiec, OpenPLC and Beremiz", ("matiec/blocks", "matiec/additional", "matiec/beremiz"),
            seconds=True, hexadecimal_bits=True, real_bits_by_value=True, reals_of_other_widths=True, lenient_texts="leading",
            no_open_inputs=True, instances_are_values=True, in_outs_are_read=True, in_outs_are_written=True, locals_are_read=True,
            locals_are_written=True, comments_end_at_once=True, pragmas_of_c=True, first_label_counts=True, idle_constants=True,
            fixed_counters=True, names_of_edition_2=True, spaced_durations=True, own_in_outs=True,
            wrong_bcd_is_zero=True, reals_wrap=True, negative_is_zero=True, functions_have_inputs=True,
            sizes_apart=True, short_references=True, warned=OBJECTS | {"POINTER TO", "REFERENCE TO"}),
    Dialect("strucpp", "programs for STruC++, the compiler of the newer OpenPLC editors",
            ("codesys/blocks", "matiec/additional", "strucpp"),
            last_of_mux=True, real_bits_by_value=True, reals_of_other_widths=True, arithmetic_of_bits=True,
            integers_and_bits=True, narrowing=True, whole_powers=True, lenient_texts="leading", ties_away=True,
            constants_wrap=True, short_names=True, locals_are_read=True, locals_are_written=True,
            sizes_apart=True, short_references=True, doubled_quotes=True, dynamic_memory="free"),
    Dialect("rusty", "programs for RuSTy", ("rusty",), reals_of_other_widths=True, loop_ends_each_pass=True,
            integers_are_conditions=True, loop_counters_wrap=True,
            arithmetic_of_bits=True, integers_and_bits=True, numbers_of_enumerations=True, number_times_duration=True,
            integers_are_nanoseconds=True, mixed_arguments=True, locals_are_read=True, programs_are_written=True,
            pointers_count_elements=True, pragmas_act=True, initial_variables=True, locals_are_written=True,
            narrowing=True, sums_in_dint=True, reals_saturate=True, lenient_texts="whole", written_out=True, ties_away=True,
            whole_powers=True, idle_statements=True, idle_constants=True, outputs_with_assign=True, constants_wrap=True,
            short_circuits=True, ampersand_refers=True, bare_construction=True, bits_by_name=True, zero_durations=True,
            generic_functions=True, times_are_numbers=True, places_for_all=True, own_time=True,
            round_arrays=True, nested_repetitions=True, dates_in_nanoseconds=True, whole_characters=True, short_references=True),
    Dialect("omron", "programs that shall run in Sysmac Studio", reals_of_other_widths=True, no_open_inputs=True,
            comments_end_at_once=True, plain_names=True,
            refused=OBJECTS | {"POINTER TO", "REFERENCE TO", "REF_TO", "WSTRING", "alias"}),
)
DIALECTS: dict[str, Dialect] = {row.name: row for row in _ROWS}
SWITCHES = tuple(f.name for f in fields(Dialect) if f.name not in ("name", "for_whom", "offered"))


def dialect(name: str) -> Dialect:
    """The dialect of that name.  Raises ValueError if there is none."""
    if name.lower() not in DIALECTS:
        raise ValueError(f"there is no dialect {name}; there are {', '.join(DIALECTS)}")
    return DIALECTS[name.lower()]


def takers(switch: str, value: bool = True, other: str = "") -> str:
    """The option for a dialect with a switch, or the other one, set, or not set: `--dialect codesys, twincat or rusty`."""
    return option(row for row in DIALECTS.values() if bool(getattr(row, switch) or other and getattr(row, other)) is value)


def option(rows: Iterable[Dialect]) -> str:
    """The option for one of some dialects, for hints; those that are not offered are named if there is no other."""
    found = [*rows]
    *names, last = [row.name for row in found if row.offered] or [row.name for row in found]
    return f"--dialect {', '.join(names)} or {last}" if names else f"--dialect {last}"


def page() -> str:
    """The page about dialects: whose programs each is for, and its answer to each question."""
    lines = ["# Dialects", "", "Where compilers disagree, a dialect says which answer is taken: `--dialect NAME`, `dialect = "
             '"NAME"` under a', "[plc] of fbvm.toml, or `dialect=` of the compile functions and test rigs.", ""]
    lines += [f"- {row.name}: {row.for_whom}." for row in DIALECTS.values()]
    for switch in SWITCHES:
        what, without, with_it = QUESTIONS[switch]
        names = [row.name for row in DIALECTS.values() if getattr(row, switch)]
        lines += ["", f"## {what}", "", f"- {without}", f"- {', '.join(names)}: {with_it}"]
    lines += ["", *(f"## {what}\n\n{answer}\n" for what, answer in ALIKE)]
    return "\n".join(lines).rstrip()


ALIKE = (
    ("When a chart tests its transitions", "At the beginning of a call, in front of the actions; CODESYS tests them behind "
     "the actions: the same steps, with inputs that are one call older."),
    ("REAL_TO_INT(50.7)", "51 in every dialect: to the nearest; TRUNC cuts."),
    ("Division by zero, a subscript outside, a null or ended pointer", "The program stops with its line and values."),
    ("Integer overflow, ABS(-32768), -(-32768)", "Wraps, in every dialect."),
    ("FOR whose limit is the last value of its type", "Ends."),
    ("TIME_TO_DWORD, DWORD_TO_TIME", "Milliseconds modulo 2**32; in seconds under matiec."),
    ("UDINT_TO_DATE(90061)", "D#1970-01-02 with an hour, a minute and a second in it, as in CODESYS and TwinCAT: they count in "
     "comparisons and in DATE_TO_DT, and only the day is shown. DT_TO_DATE cuts them off."),
    ("A number that TIME or DATE cannot hold; DT + TIME past 2262-04-11", "The program stops (R0105); TIME + TIME wraps."),
    ("SIZEOF of ten INT", "20: the bytes that they fill."),
    ("TON, TOF, TP when ET = PT exactly", "The time is over."),
    ("THIS^() and THIS^.m() in a method that a derived block inherits", "Executes what the instance's own type has, as in "
     "CODESYS; RuSTy executes what the block has in which the method stands."),
    ("THIS.x, SUPER.x", "The same as THIS^.x and SUPER^.x, with a method or a variable behind the dot; RuSTy wants the ^."),
    ("SUPER^.m()", "What the nearest base has, whatever the instance is."),
    ("A call of an interface that refers to nothing", "The program stops at its line (R0110)."),
    ("VAR_OUTPUT of a METHOD or FUNCTION when its call begins", "Its initial value; in RuSTy the value of the variable that the "
     "call names for it, where that is an array, a structure or a text."),
    ("m(x => v), where x is VAR_IN_OUT", "An error (S0402): := passes an in-out; RuSTy takes => as well."),
    ("A value, as a property gives it, for VAR_INPUT {ref}", "An error (S0407) where {ref} has an effect, which is under rusty: "
     "assign it to a variable first; RuSTy passes a hidden one."),
    ("PROPERTY whose GET and SET have no statement", "Keeps nothing: GET gives the first value of its type. The first RuSTy "
     "with properties kept what was assigned."),
    ("VAR a AT b, where b is a variable; VAR x AT %MB0 in a METHOD", "Errors (S0101, S0604): REFERENCE TO gives a variable "
     "another name, and the block declares what has an address. RuSTy takes both."),
    ("__FPOINTER, __VOID, __vtable, POINTER TO Block.Method, REF_TO Function, Table#(p^) of RuSTy", "Errors: RuSTy makes "
     "calls of methods from them inside; a program calls a method through a base or an interface instead."),
    ("-2 ** 2, -x ** 2", "4: the sign belongs to the base, with a warning (S0392); some compilers give -4."),
    ("1.0 / 0.0 as a constant", "Infinity, as at run time, with a warning (S0792)."),
    ("ET of a timer in the scan in which IN rises", "0; ladder-logic-editor and truST have one period at once, so that Q comes a "
     "scan earlier."),
    ("ET of TP behind the pulse, when IN is FALSE", "0; IronPLC keeps PT."),
    ("FOR i := 1 TO 5: i behind the loop", "6: the first value beyond the limit."),
    ("CASE 10..1", "An error (S0503)."),
    ("WHILE and REPEAT that never end", "The program stops when its step budget is spent (R0104)."),
    ("A coil behind a coil in a drawing, with two wires into the first", "OR, as it is drawn; older OpenPLC makes AND of it."),
    ("TON with PT = T#0s, in the scan in which IN rises", "Q is TRUE at once; in the scan after it under matiec."),
)
"""What users ask about, and every dialect answers alike."""
