"""Names: where they are declared, where they stand, and how they are renamed."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from editing import at_mark, at_word, check_declaration
from growth import assert_linear
from lang_corpus import programs
from rows import each_of

from fbvm.analysis.declarations import find
from fbvm.analysis.program import Program
from fbvm.analysis.references import Place, Refusal, applied, called, callers, declared_at, references, rename, use_at

PLANT = """\
TYPE
    Mode : (Off, Filling);
    Tank : STRUCT Level : INT; State : Mode; END_STRUCT;
END_TYPE

FUNCTION Twice : INT
VAR_INPUT x : INT; END_VAR
    Twice := x * 2;
END_FUNCTION

FUNCTION_BLOCK Pump
VAR_INPUT Level : INT; END_VAR
VAR_OUTPUT Runs : BOOL; END_VAR
    Runs := LEVEL < 200;
END_FUNCTION_BLOCK

VAR_GLOBAL Total : INT; END_VAR

PROGRAM Main
VAR P1 : Pump; T1 : Tank; hidden : INT; END_VAR
    T1.Level := Twice(x := Total);
    T1.State := Filling;
    P1(Level := T1.Level); hidden := 1;
    IF P1.Runs AND T1.State = Mode#Filling THEN Total := Total + 1; END_IF
END_PROGRAM
"""


def plant(before: str, word: str) -> tuple[Program, int]:
    """The plant, and the place of a word that stands behind a piece of its text."""
    return at_word(PLANT, before, word)


@pytest.mark.slow
@each_of("before, word, line, count", [
    ("P1(Level", "Level", 12, 3),
    ("T1.Level := Twice", "Level", 3, 3),
    ("Twice(x", "Twice", 6, 3),
    ("Twice(x", "x", 7, 3),
    ("P1.Runs", "Runs", 13, 3),
    ("Total := Total", "Total", 17, 4),
    ("State := Filling", "Filling", 2, 3),
    ("Mode#Filling", "Mode", 2, 3),
    ("P1 : Pump", "Pump", 11, 2),
    ("P1 : Pump", "P1", 20, 3),
])
def test_a_name_leads_to_its_declaration_and_to_all_its_places(before: str, word: str, line: int, count: int) -> None:
    check_declaration(PLANT, before, word, line, count)


def test_names_of_a_generic_function_that_nobody_calls_have_declarations() -> None:
    text = PLANT.replace("x : INT", "x, y : ANY_INT").replace("Twice(x := Total)", "1")
    check_declaration(text, "x * 2", "x", 7, 2)


def test_places_know_whether_they_read_or_write() -> None:
    program, offset = plant("Total := Total", "Total")
    used = use_at(program, "pump.st", offset)
    assert used is not None
    assert [place.role for place in references(program, used[1].key)] == ["declared", "read", "written", "read"]


def test_a_pin_of_a_library_leads_into_the_library() -> None:
    program, offset = at_mark("PROGRAM Main VAR t : TON; b : BOOL; END_VAR t(IN := TRUE); b := t.‸Q; END_PROGRAM")
    declared = declared_at(program, "pump.st", offset)
    assert declared is not None
    assert (declared.source.library, declared.name) == ("iec", "Q")


@pytest.mark.slow
@each_of("before, word, new", [
    ("P1(Level", "Level", "Height"), ("T1.Level := Twice", "Level", "Fuellstand"), ("Twice(x", "Twice", "Double"),
    ("Total := Total", "Total", "TOTAL_2"), ("State := Filling", "Filling", "Fill"), ("P1 : Pump", "Pump", "Motor"),
    ("Mode#Filling", "Mode", "Modes"), ("P1 : Pump", "P1", "P2"),
])
def test_a_renamed_program_has_no_errors(before: str, word: str, new: str) -> None:
    program, offset = plant(before, word)
    text = applied(rename(program, "pump.st", offset, new), new)["pump.st"]
    assert new in text
    program.replace("pump.st", text)
    program.check_all()
    assert program.diagnostics("pump.st") == []


def test_all_files_are_renamed() -> None:
    program = Program()
    head, _, main = PLANT.partition("PROGRAM Main")
    program.replace("blocks.st", head)
    program.replace("main.st", "PROGRAM Main" + main)
    program.check_all()
    texts = applied(rename(program, "blocks.st", head.index("Pump"), "Motor"), "Motor")
    assert ("FUNCTION_BLOCK Motor" in texts["blocks.st"], "P1 : Motor" in texts["main.st"]) == (True, True)


@pytest.mark.slow
@each_of("before, word, new, why", [
    ("P1 : Pump", "P1", "T1", "T1 is declared twice in Main"),
    ("P1 : Pump", "P1", "IF", "`IF` is a word of the language"),
    ("P1 : Pump", "P1", "1P", "`1P` is no name"),
    ("P1 : Pump", "P1", "Total", "x is Pump, but INT is needed here"),
    ("Total : INT", "Total", "hidden", "`hidden` means something else in a place"),
    ("T1.State = ", "T1", "INT", "`INT` is a reserved word"),
])
def test_a_name_that_clashes_is_refused(before: str, word: str, new: str, why: str) -> None:
    program, offset = plant(before, word)
    with pytest.raises(Refusal, match=why):
        rename(program, "pump.st", offset, new)


def test_a_name_of_a_library_is_not_renamed() -> None:
    program, offset = at_mark("PROGRAM Main VAR t : ‸TON; END_VAR t(); END_PROGRAM")
    with pytest.raises(Refusal, match="TON belongs to the library iec"):
        rename(program, "pump.st", offset, "Timer")


def test_who_calls_whom() -> None:
    program, _ = plant("P1 : Pump", "P1")
    assert [key for key, _ in callers(program, ("pou", "", "PUMP"))] == [("pou", "", "MAIN")]
    assert sorted(key[2] for key, _ in called(program, ("pou", "", "MAIN"))) == ["PUMP", "TWICE"]


@pytest.mark.slow
def test_every_name_of_the_corpus_has_a_declaration() -> None:
    lost = []
    for each in programs():
        if each.runs:
            program = Program(dialect=each.dialect)
            program.replace(each.path.name, each.text)
            program.check_all()
            assert program.checked is not None
            lost += [(each.name, use.key) for part in program.parts() for use in program.uses(part)
                     if use.key[0] != "standard" and find(program.checked.checker, use.key) is None]
    assert lost == []


def test_a_global_variable_that_its_list_qualifies_has_a_declaration_at_both_places() -> None:
    program, main = Program(dialect="codesys"), "PROGRAM Main VAR x : INT; END_VAR x := GVL.Speed; END_PROGRAM"
    qualified = "{attribute 'qualified_only'}\nVAR_GLOBAL Speed : INT; END_VAR\n"
    program.replace("GVL.st", qualified)
    program.replace("main.st", main)
    program.check_all()
    for name, offset in (("main.st", main.index("Speed")), ("GVL.st", qualified.index("Speed"))):
        declared = declared_at(program, name, offset)
        assert declared is not None and declared.key == ("global", "", "GVL.SPEED")
        assert len(references(program, declared.key)) == 2


def test_an_input_with_an_edge_has_a_declaration() -> None:
    text = ("FUNCTION_BLOCK Count\nVAR_INPUT\n  Level : INT;\n  Up : BOOL R_EDGE;\nEND_VAR\nVAR n : INT; END_VAR\n"
            "IF Up THEN n := n + Level; END_IF;\nEND_FUNCTION_BLOCK\n")
    check_declaration(text, "IF Up", "Up", 4, 2)
    check_declaration(text, "n + Level", "Level", 3, 2)


def test_the_member_of_an_enumeration_behind_its_type_has_a_declaration() -> None:
    program, offset = at_mark("TYPE Mode : (Off, Filling); END_TYPE\n"
                              "PROGRAM Main VAR m : Mode; END_VAR m := Mode.Fil‸ling; END_PROGRAM\n", "codesys")
    declared = declared_at(program, "pump.st", offset)
    assert declared is not None and declared.key == ("member", "", "MODE", "FILLING")
    assert len(references(program, declared.key)) == 2


ACTIONS = """\
FUNCTION_BLOCK Base
VAR n : INT; END_VAR
    Act();
METHOD Go
    Act(); THIS^.Act();
END_METHOD
ACTION Act:
    n := 1;
END_ACTION
END_FUNCTION_BLOCK
FUNCTION_BLOCK Fast EXTENDS Base
    Act();
METHOD Also
    Act(); SUPER^.Act();
END_METHOD
END_FUNCTION_BLOCK
PROGRAM Main
VAR f : ARRAY [0..1] OF Fast; b : Base; END_VAR
    f[0].Act(); b.Act(); b.Go(); f[1].Also();
END_PROGRAM
"""


@each_of("before, word", [("ACTION Act", "Act"), ("THIS^.Act", "Act"), ("Act(); THIS", "Act"), ("Act(); SUPER", "Act"),
                          ("SUPER^.Act", "Act"), ("f[0].Act", "Act"), ("b.Act", "Act"), ("EXTENDS Base\n    Act", "Act")])
def test_an_action_is_found_where_it_is_called_in_methods_and_in_blocks_that_extend_its_block(before: str, word: str) -> None:
    check_declaration(ACTIONS, before, word, 7, 9, "codesys")


def test_an_action_is_renamed_wherever_it_is_called() -> None:
    program, offset = at_word(ACTIONS, "ACTION Act", "Act", "codesys")
    assert program.diagnostics("pump.st") == []
    assert applied(rename(program, "pump.st", offset, "Run"), "Run") == {"pump.st": ACTIONS.replace("Act", "Run")}


@pytest.mark.slow
def test_the_time_of_mistakes_grows_with_the_files_of_a_program() -> None:
    def prepared(files: int) -> Callable[[], object]:
        made = Program()
        for number in range(files):
            made.replace(f"F{number}.st", f"FUNCTION F{number} : INT\nF{number} := 1\nEND_FUNCTION\n")
        made.check_all()

        def work() -> None:
            made.revision += 1  # as after a key
            assert all(made.diagnostics(name) for name in made.files)
        return work

    assert_linear(prepared, 400)


@pytest.mark.slow
def test_the_time_of_a_new_name_grows_with_the_places_in_a_file() -> None:
    def prepared(lines: int) -> Callable[[], object]:
        made = Program()
        made.replace("a.st", "a := a;\n" * lines)
        places = [Place(made.files["a.st"], at, at + 1) for line in range(lines) for at in (8 * line, 8 * line + 5)]
        return lambda: applied(places, "bb")["a.st"].index("bb := bb;\n" * lines)

    assert_linear(prepared, 16_000)


CONSTRUCTED = """\
FUNCTION_BLOCK FB
VAR_OUTPUT n : INT; END_VAR
METHOD FB_init : BOOL
VAR_INPUT bInitRetains, bInCopyCode : BOOL; x : INT; END_VAR
    n := n + x;
END_METHOD
END_FUNCTION_BLOCK
FUNCTION_BLOCK H
METHOD M : INT
VAR a : ARRAY[0..2] OF FB(x := 4); END_VAR
    M := a[0].n;
END_METHOD
END_FUNCTION_BLOCK
"""


@each_of("before, word, line, count", [("M := a", "M", 9, 2), ("OD M :", "M", 9, 2), ("a[0]", "a", 10, 2), ("VAR a", "a", 10, 2)])
def test_a_method_with_instances_that_are_constructed_has_its_names(before: str, word: str, line: int, count: int) -> None:
    check_declaration(CONSTRUCTED, before, word, line, count, "codesys")
