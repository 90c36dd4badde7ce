"""What helps while one writes: hover, completion, the signature of a call, quick fixes."""

from __future__ import annotations

import pytest
from editing import at_mark
from rows import each_of

from fbvm.analysis.calls import signature
from fbvm.analysis.completion import complete, nearest
from fbvm.analysis.fixes import applied, fixes
from fbvm.analysis.hover import hover

HEAD = """\
TYPE Mode : (Off, Filling); Tank : STRUCT Level : INT; State : Mode; END_STRUCT; END_TYPE
FUNCTION_BLOCK Pump // moves water
VAR_INPUT Level : INT := 5; END_VAR
VAR_OUTPUT Runs : BOOL; END_VAR
VAR hidden : INT; END_VAR
    Runs := Level < hidden; hidden := 0;
END_FUNCTION_BLOCK
PROGRAM Main
VAR
    // the pump at the river
    P1 : Pump;
    T1 : ARRAY [0..3] OF Tank;
    On AT %QX0.0 : BOOL; // lamp
    D AT D200 : ARRAY [0..9] OF INT;
END_VAR
"""


@pytest.mark.slow
@each_of("line, parts", [
    ("‸P1();", ["VAR P1 : Pump", "the pump at the river"]),
    ("P1(Le‸vel := 3);", ["VAR_INPUT Level : INT := 5"]),
    ("O‸n := TRUE;", ["VAR On AT %QX0.0 : BOOL", "lamp", "outputs of portable programs"]),
    ("On := %QX0‸.0;", ["%QX0.0", "VAR On AT"]),
    ("D[1] := AB‸S(-1);", ["ABS(IN : T) : T", "ANY_NUM"]),
    ("T1[0].State := Fil‸ling;", ["Mode#Filling = 1"]),
    ("T1[0].Le‸vel := 1;", ["Tank.Level : INT"]),
    ("On := nobo‸dy;", ["# S0201 unknown name"]),
    ("LADDER\nLD On\nMO‸V #1 D201\nEND_LADDER", ["MOV"]),
])
def test_hover_says_what_stands_there(line: str, parts: list[str]) -> None:
    program, offset = at_mark(HEAD + line + "\nEND_PROGRAM\n")
    shown = hover(program, "pump.st", offset)
    assert shown is not None
    assert [part for part in parts if part not in shown.markdown] == [], shown.markdown


def test_hover_over_a_library_block_shows_its_page() -> None:
    program, offset = at_mark("PROGRAM Main VAR t : T‸ON; END_VAR t(); END_PROGRAM")
    shown = hover(program, "pump.st", offset)
    assert shown is not None and "ET" in shown.markdown and "Library iec" in shown.markdown


@pytest.mark.slow
@each_of("line, first, absent", [
    ("P1.‸", ["Level", "Runs"], ["hidden"]),
    ("T1[2].‸", ["Level", "State"], []),
    ("T1[2].State := Mode#‸", ["Filling", "Off"], []),
    ("P1(‸", ["Level :=", "Runs =>"], []),
    ("P1(Level := 3, ‸", ["Runs =>"], ["Level :="]),
    ("‸", ["D", "On", "P1", "T1"], ["hidden", "END_VAR"]),
    ("LADDER\n‸\nEND_LADDER", ["*", "*B"], ["WHILE"]),
])
def test_completion_offers_what_fits(line: str, first: list[str], absent: list[str]) -> None:
    program, offset = at_mark(HEAD + line + "\nEND_PROGRAM\n")
    offered = [item.label for item in nearest(complete(program, "pump.st", offset))]
    assert offered[:len(first)] == first
    assert not set(absent) & set(offered)


@each_of("line", ["// the pump ‸", "(* the pump ‸", "P1.hidden.‸", "P1.Runs.‸", "nobody.‸"])
def test_completion_offers_nothing_in_a_comment_and_behind_what_has_no_parts(line: str) -> None:
    program, offset = at_mark(HEAD + line + "\nEND_PROGRAM\n")
    assert complete(program, "pump.st", offset) == []


@each_of("line, some", [
    ("x : ‸", {"Pump", "Tank", "INT", "TON"}), ("x AT ‸", {"D210", "CIO", "%M"}), ("‸", {"END_VAR"}),
    ("x : ARRAY [0..1] OF ‸", {"Tank", "WORD"}),
])
def test_completion_in_a_section_offers_types_and_free_addresses(line: str, some: set[str]) -> None:
    program, offset = at_mark(HEAD.removesuffix("END_VAR\n") + line + "\nEND_VAR\nEND_PROGRAM\n")
    assert some <= {item.label for item in complete(program, "pump.st", offset)}


@each_of("declared, dialect, free", [
    ("", "standard", []), ("a AT D10 : INT;", "standard", ["D11"]), ("a AT D10 : DINT;", "standard", ["D12"]),
    ("a AT D10 : SINT;", "standard", ["D11"]), ("a AT D10 : ARRAY [0..4] OF SINT;", "standard", ["D13"]),
    ("a AT D4.15 : BOOL;", "standard", ["D5"]), ("a AT D12 : LREAL; b AT D9 : INT;", "standard", ["D16"]),
    ("a AT CIO 5 : WORD; b AT W3 : WORD;", "standard", ["CIO 6", "W4"]), ("a AT T5 : WORD;", "standard", ["T6"]),
    ("a AT TF5 : BOOL;", "standard", ["TF6"]), ("a AT T0008 : BOOL;", "standard", ["TF9"]),
    ("a AT %MW3 : INT;", "standard", ["%MW4"]), ("a AT %MD3 : DINT;", "standard", ["%MW8"]),
    ("a AT %ML1 : LINT;", "standard", ["%MW8"]), ("a AT %MB3 : BYTE;", "standard", ["%MW2"]),
    ("a AT %MB4 : BYTE;", "standard", ["%MW3"]), ("a AT %MW3.9 : BOOL;", "standard", ["%MW4"]),
    ("a AT %QX0.7 : BOOL;", "standard", ["%QW1"]), ("a AT %IX2.0 : BOOL;", "standard", ["%IW2"]),
    ("a AT %MW3 : INT;", "matiec", ["%MW4"]), ("a AT %MD3 : DINT;", "matiec", ["%MD4"]),
    ("a AT %ML1 : LINT;", "matiec", ["%ML2"]), ("a AT %MB3 : BYTE;", "matiec", ["%MB4"]),
    ("a AT %QX1.7 : BOOL; b AT %QB4 : BYTE;", "matiec", ["%QX2", "%QB5"]),
])
def test_the_first_address_behind_the_variables_of_an_area_is_offered(declared: str, dialect: str, free: list[str]) -> None:
    program, offset = at_mark(f"PROGRAM Main VAR {declared} x AT ‸ : INT; END_VAR END_PROGRAM\n", dialect)
    offered = complete(program, "pump.st", offset)
    assert [item.label for item in offered if item.rank == 1] == free
    kind = "place" if dialect == "matiec" else "word"
    assert {item.detail.partition(": ")[0] for item in offered if item.rank == 1} <= {f"the next free {kind}"}


def test_all_areas_are_offered_as_addresses() -> None:
    shared = ["CF", "CIO", "W", "H", "A", "TF", "CNF", "T", "C"]
    sized = [f"%{area}{size}" for area in "IQM" for size in "XBWDL"]
    for dialect, areas in (("standard", [*shared, "%I", "%Q", "%M", "D"]), ("matiec", [*shared, "D", *sized])):
        program, offset = at_mark("PROGRAM Main VAR x AT ‸ : INT; END_VAR END_PROGRAM\n", dialect)
        offered = complete(program, "pump.st", offset)
        assert [(item.label, item.kind, item.rank) for item in offered] == [(area, "address", 2) for area in areas]
        assert offered[1].detail == "inputs, outputs and words of units"


@each_of("text, offered", [
    ("PROGRAM Other VAR Level : INT; END_VAR END_PROGRAM\n"
     "PROGRAM Main VAR x : INT; END_VAR x := Other.‸ END_PROGRAM\n", ["Level"]),
    ("TYPE S : STRUCT a : INT; END_STRUCT END_TYPE FUNCTION_BLOCK Base VAR deep : S; END_VAR END_FUNCTION_BLOCK\n"
     "FUNCTION_BLOCK Top EXTENDS Base VAR i : INT; END_VAR i := deep.‸ ; END_FUNCTION_BLOCK\n", ["a"]),
    ("TYPE S : STRUCT a : INT; END_STRUCT END_TYPE FUNCTION_BLOCK Base VAR deep : S; i : INT; END_VAR\n"
     "METHOD M i := deep.‸ ; END_METHOD END_FUNCTION_BLOCK\n", ["a"]),
])
def test_completion_knows_the_parts_of_programs_and_of_what_is_inherited(text: str, offered: list[str]) -> None:
    program, offset = at_mark(text, "codesys")
    assert [item.label for item in complete(program, "pump.st", offset)] == offered


def test_what_completion_offers_as_a_type_comes_in_its_order_with_its_kind() -> None:
    program, offset = at_mark("TYPE Own : INT; END_TYPE\nFUNCTION_BLOCK Mine END_FUNCTION_BLOCK\n"
                              "PROGRAM Main\nVAR\n    x : ‸\nEND_VAR\nEND_PROGRAM\n")
    offered = {item.label: (item.kind, item.insert, item.rank) for item in complete(program, "pump.st", offset)}
    wanted = {"Own": ("type", "", 1), "Mine": ("block", "", 1), "INT": ("type", "", 2), "STRING": ("type", "", 2),
              "ARRAY": ("keyword", "ARRAY [${1:0..9}] OF $0", 3), "TON": ("block", "", 4)}
    assert {name: offered[name] for name in wanted} == wanted
    assert "ADSLOGSTR" not in offered, "a function is no type"


def test_what_completion_offers_as_a_statement_comes_in_its_order_with_its_kind() -> None:
    program, offset = at_mark(HEAD + "‸\nEND_PROGRAM\n")
    offered = {item.label: (item.kind, item.insert, item.rank) for item in complete(program, "pump.st", offset)}
    wanted = {"P1": ("variable", "", 2), "Filling": ("enumerator", "", 4), "ABS": ("function", "ABS($0)", 6),
              "ADSLOGSTR": ("function", "ADSLOGSTR($0)", 8)}
    assert {name: offered[name] for name in wanted} == wanted
    assert offered["IF"][0] == "keyword" and offered["IF"][2] == 7 and "TON" not in offered


def test_completion_between_declarations_offers_declarations() -> None:
    program, offset = at_mark("‸")
    assert "FUNCTION_BLOCK" in {item.label for item in complete(program, "pump.st", offset)}


@each_of("line, label, active", [
    ("P1(‸", "Pump(Level := INT, Runs => BOOL)", 0),
    ("P1(Level := (1 + 2), ‸", "Pump(Level := INT, Runs => BOOL)", 1),
    ("P1(Runs => On, Level := ‸", "Pump(Level := INT, Runs => BOOL)", 0),
    ("P1(1, On, ‸", "Pump(Level := INT, Runs => BOOL)", None),
    ("P1(Runs => On, Height := ‸", "Pump(Level := INT, Runs => BOOL)", None),
    ("D[0] := SEL(On, 1, 2, ‸", "SEL(G : BOOL, IN0 : T, IN1 : T) : T  (T: ANY)", 2),
    ("D[0] := SEL(On, ‸1, 2);", "SEL(G : BOOL, IN0 : T, IN1 : T) : T  (T: ANY)", 1),
])
def test_the_signature_of_a_call_marks_the_present_argument(line: str, label: str, active: int | None) -> None:
    program, offset = at_mark(HEAD + line + "\nEND_PROGRAM\n")
    shown = signature(program, "pump.st", offset)
    assert shown is not None
    assert (shown.label, shown.active) == (label, active)


@pytest.mark.slow
@each_of("line, mended", [
    ("On := P1.‸Run;", "On := P1.Runs;"),
    ("On := TRUE‸", "On := TRUE;"),
    ("On ‸= TRUE;", "On := TRUE;"),
    ("‸Onn := TRUE;", "On := TRUE;"),
    ("IF On ‸== TRUE THEN On := FALSE; END_IF", "IF On = TRUE THEN On := FALSE; END_IF"),
    ("D[0] := ‸1.5;", None),
    ("IF On THEN On := FALSE;‸", "IF On THEN On := FALSE;\nEND_IF;"),
])
def test_a_hint_becomes_a_quick_fix_that_helps(line: str, mended: str | None) -> None:
    program, offset = at_mark(HEAD + line + "\nEND_PROGRAM\n")
    assert len(program.diagnostics("pump.st")) > 0
    found = fixes(program, "pump.st", offset, offset + 1)
    texts = [applied(program.files["pump.st"].text, fix.edits) for fix in found]
    if mended is None:
        assert texts == []
    else:
        assert HEAD + mended + "\nEND_PROGRAM\n" in texts, [fix.title for fix in found]


def test_completion_offers_own_variables_before_those_of_all() -> None:
    program, offset = at_mark("VAR_GLOBAL a : INT; END_VAR\nPROGRAM Main VAR b : INT; END_VAR b := 1;\n‸\nEND_PROGRAM\n")
    labels = [item.label for item in nearest(complete(program, "pump.st", offset))]
    assert labels.index("b") < labels.index("a")


def test_completion_goes_through_pointers_and_knows_enumerators() -> None:
    head = HEAD.replace("    D AT", "    R1 : REF_TO Tank;\n    D AT")
    program, offset = at_mark(head + "D[0] := R1^.‸\nEND_PROGRAM\n", "codesys")
    assert [item.label for item in nearest(complete(program, "pump.st", offset))] == ["Level", "State"]
    program, offset = at_mark(head + "‸\nEND_PROGRAM\n", "codesys")
    kinds = {item.label: item.kind for item in complete(program, "pump.st", offset)}
    assert kinds["Filling"] == "enumerator"


def test_an_unknown_name_is_declared_on_a_line_of_its_own_or_beside() -> None:
    for text, mended in (
        ("PROGRAM Main\nVAR\n    n : INT;\nEND_VAR\nn := ‸m;\nEND_PROGRAM\n", "    n : INT;\n    m : INT;\nEND_VAR"),
        ("PROGRAM Main VAR n : INT; END_VAR n := ‸m; END_PROGRAM\n", "VAR n : INT; m : INT; END_VAR"),
    ):
        program, offset = at_mark(text)
        [fix] = fixes(program, "pump.st", offset, offset)
        assert mended in applied(program.files["pump.st"].text, fix.edits)


def test_an_unknown_name_is_declared_with_a_type_that_fits() -> None:
    program, offset = at_mark(HEAD + "D[0] := ‸speed;\nEND_PROGRAM\n")
    assert [fix.title for fix in fixes(program, "pump.st", offset, offset)] == ["Declare speed : INT"]


@each_of("written, kind", [
    ("‸n := 1;", "INT"), ("‸n := 0;", "INT"), ("‸n := 16#FF;", "INT"), ("‸n := 100_000;", "DINT"), ("‸n := 1.5;", "REAL"),
    ("‸n := TRUE;", "BOOL"), ("IF ‸n THEN END_IF", "BOOL"), ("b := b AND ‸n;", "BOOL"), ("b := NOT ‸n;", "BOOL"),
    ("‸n := T#1s;", "TIME"), ("‸n := w;", "WORD"), ("‸n := 'a';", "STRING"), ("‸n := l;", "LREAL"),
    ("FOR ‸n := 0 TO 1 DO END_FOR", "INT"),
])
def test_the_type_of_an_unknown_name_is_the_usual_one(written: str, kind: str) -> None:
    program, offset = at_mark(f"PROGRAM Main VAR b : BOOL; w : WORD; l : LREAL; END_VAR {written} END_PROGRAM\n")
    assert [fix.title for fix in fixes(program, "pump.st", offset, offset)] == [f"Declare n : {kind}"]


@each_of("text, mended", [
    ("PROGRAM Main\nVAR\n    x : INT;\nx := 1;\nEND_PROGRAM\n", "    x : INT;\nEND_VAR\nx := 1;"),
    ("TYPE T : STRUCT a : INT; END_STRUCT\nPROGRAM Main\nEND_PROGRAM\n", "END_STRUCT\nEND_TYPE\nPROGRAM"),
    ("PROGRAM Main\nVAR x : INT;\n  IF x = 1 THEN x := 2; END_IF\nEND_PROGRAM\n", "x : INT;\n  END_VAR\n  IF x"),
    ("PROGRAM Main VAR x : INT; END_VAR\n  IF x = 1 THEN x := 2;\nEND_PROGRAM\n", "x := 2;\nEND_IF;\nEND_PROGRAM"),
])
def test_the_end_that_is_missing_gets_a_line_of_its_own(text: str, mended: str) -> None:
    program, _ = at_mark("‸" + text)
    [fix] = fixes(program, "pump.st", 0, len(text))
    assert fix.title.startswith("Insert END_") and mended in applied(text, fix.edits)


def test_a_warning_can_be_mended_or_suppressed() -> None:
    text = "PROGRAM Main\nVAR\n    ‸unused : INT;\n    b AT %QX0.0 : BOOL;\nEND_VAR\nb := TRUE;\nEND_PROGRAM\n"
    program, offset = at_mark(text)
    found = fixes(program, "pump.st", offset, offset)
    assert [fix.title for fix in found] == ["Remove unused", "Suppress S0290 on this line"]
    for fix in found:
        program, _ = at_mark(text)
        program.replace("pump.st", applied(program.files["pump.st"].text, fix.edits))
        program.check_all()
        assert program.diagnostics("pump.st") == []


@each_of("declared, left", [
    ("VAR\n    ‸u : INT;\n    b : BOOL;\nEND_VAR", "VAR\n    b : BOOL;\nEND_VAR"),
    ("VAR\n    b : BOOL;\n    ‸u : INT;  \n\nEND_VAR", "VAR\n    b : BOOL;\n\nEND_VAR"),
    ("VAR\n\n    ‸u : INT;\n  b : BOOL;\nEND_VAR", "VAR\n\n  b : BOOL;\nEND_VAR"),
    ("VAR ‸u : INT; b : BOOL; END_VAR", "VAR b : BOOL; END_VAR"),
    ("VAR b : BOOL; ‸u : INT; END_VAR", "VAR b : BOOL; END_VAR"),
    ("VAR b : BOOL;\n    ‸u : INT; END_VAR", "VAR b : BOOL;\n    END_VAR"),
    ("VAR ‸u : INT;\n    b : BOOL;\nEND_VAR", "VAR \n    b : BOOL;\nEND_VAR"),
    ("VAR\n    b : BOOL; ‸u : INT;\nEND_VAR", "VAR\n    b : BOOL; \nEND_VAR"),
    ("VAR\n    b : BOOL;\n    ‸u : INT ; // said\nEND_VAR", "VAR\n    b : BOOL;\n    // said\nEND_VAR"),
    ("VAR\n    ‸u, v : INT;\n    b : BOOL;\nEND_VAR", None),
])
def test_a_declaration_that_nobody_uses_is_removed_with_its_line_if_it_has_one(declared: str, left: str | None) -> None:
    program, offset = at_mark(f"PROGRAM Main\n{declared}\nb := NOT b;\nEND_PROGRAM\n")
    found = [fix for fix in fixes(program, "pump.st", offset, offset) if not fix.title.startswith("Suppress")]
    assert [(fix.title, fix.best, applied(program.files["pump.st"].text, fix.edits)) for fix in found] == \
        ([] if left is None else [("Remove u", True, f"PROGRAM Main\n{left}\nb := NOT b;\nEND_PROGRAM\n")])


@each_of("line, made", [
    ("b := TRUE‸\nn := 1;", [("Insert ;", True, "b := TRUE;\nn := 1;")]),
    ("n := (1 + 2‸;", [("Insert )", True, "n := (1 + 2);")]),
    ("IF b THEN\n  n := 1;\n  ‸END_PROGRAM\nPROGRAM Next", [
        ("Insert END_IF", True, "IF b THEN\n  n := 1;\n  END_IF;\n  END_PROGRAM\nPROGRAM Next"),
        ]),
    ("‸n = 1;", [("Write :=", True, "n := 1;")]), ("b ‸== TRUE;", [("Write =", True, "b = TRUE;")]),
])
def test_what_is_expected_is_written_where_it_is_missing(line: str, made: list[tuple[str, bool, str]]) -> None:
    head = "PROGRAM Main\nVAR b AT %QX0.0 : BOOL; n AT %QW1 : INT; END_VAR\n"
    program, offset = at_mark(f"{head}{line}\nEND_PROGRAM\n")
    found = fixes(program, "pump.st", offset, offset)
    assert [(fix.title, fix.best, applied(program.files["pump.st"].text, fix.edits)) for fix in found] == [
        (title, best, f"{head}{text}\nEND_PROGRAM\n") for title, best, text in made]


def test_instructions_are_offered_with_their_operands_as_places_to_fill_in() -> None:
    program, offset = at_mark("PROGRAM Main\nLADDER\n‸\nEND_LADDER\nEND_PROGRAM\n")
    offered = {item.label: item for item in complete(program, "pump.st", offset)}
    assert [(item.kind, item.insert, item.rank) for item in map(offered.get, ("LD", "MOV", "*", "END")) if item is not None] == [
        ("instruction", "LD ${1:B}", 5), ("instruction", "MOV ${1:S} ${2:D}", 5), ("instruction", "* ${1:Md} ${2:Mr} ${3:R}", 5),
        ("instruction", "END", 5)]
    assert offered["LD"].detail == "Begins a block with a bit."


def test_what_completion_says_of_names_is_how_they_are_declared() -> None:
    program, offset = at_mark(
        "FUNCTION Twice : INT\nVAR_INPUT x : INT; END_VAR\nTwice := x;\nEND_FUNCTION\nTYPE Mode : (Off, Run); END_TYPE\n"
        "VAR_GLOBAL g AT D5 : INT; END_VAR\n"
        "PROGRAM Main\nVAR i : INT; s AT D3 : WORD; END_VAR\n‸\nACTION Go: ; END_ACTION\nEND_PROGRAM\n")
    offered = {item.label: (item.kind, item.detail, item.insert, item.rank) for item in complete(program, "pump.st", offset)}
    wanted = {"Twice": ("function", "FUNCTION Twice : INT", "Twice($0)", 4), "Off": ("enumerator", "Mode", "", 4),
              "g": ("variable", "VAR_GLOBAL INT AT D5", "", 3), "i": ("variable", "VAR INT", "", 2),
              "s": ("variable", "VAR WORD AT D3", "", 2), "Go": ("action", "ACTION", "Go();", 3),
              "ABS": ("function", "ABS(IN : T) : T  (T: ANY_NUM)", "ABS($0)", 6), "AND": ("keyword", "", "", 7)}
    assert {name: offered[name] for name in wanted} == wanted


@each_of("text, said", [
    ("FUNCTION F : INT // doubles\nVAR_INPUT x : INT; END_VAR\nEND_FUNCTION // of F\n", "doubles"),
    ("// above it\nFUNCTION F : INT\nVAR_INPUT x : INT; END_VAR\nEND_FUNCTION // of F\n", "above it"),
    ("FUNCTION F : INT\nVAR_INPUT x : INT; END_VAR\nEND_FUNCTION // of F\n", ""),
])
def test_the_signature_of_a_call_has_the_comment_at_the_head(text: str, said: str) -> None:
    program, offset = at_mark(text + "PROGRAM Main VAR i : INT; END_VAR i := F(‸); END_PROGRAM\n")
    shown, hovered = signature(program, "pump.st", offset), hover(program, "pump.st", offset - 1)
    assert shown is not None and shown.documentation == said
    assert hovered is not None and hovered.markdown.rpartition("```")[2].strip() == said


@each_of("call, parameters", [
    ("P1(‸", ("Level := INT", "Runs => BOOL")), ("D[0] := ABS(‸", ("IN : T",)),
    ("D[0] := SEL(‸", ("G : BOOL", "IN0 : T", "IN1 : T")), ("D[0] := ADD(‸", ("IN1", "IN2")),
])
def test_the_parameters_of_a_call_are_pieces_of_its_label(call: str, parameters: tuple[str, ...]) -> None:
    program, offset = at_mark(f"{HEAD}{call}\nEND_PROGRAM\n")
    shown = signature(program, "pump.st", offset)
    assert shown is not None
    assert shown.parameters == parameters and all(each in shown.label for each in parameters)
    assert shown.documentation == ("moves water" if call.startswith("P1") else "")
