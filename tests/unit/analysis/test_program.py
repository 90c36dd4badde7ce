"""A program that is being edited: after each change its diagnostics are those of a program that was never edited."""

from __future__ import annotations

import random
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from depth import times
from lang_corpus import programs
from rows import each_of

from fbvm.analysis import parts
from fbvm.analysis.parts import File, spans
from fbvm.analysis.program import Program
from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.code.compiler import compile_sources
from fbvm.syntax.parser import parse
from fbvm.syntax.tree import SourceText

TWO = """\
FUNCTION_BLOCK Pump
VAR_INPUT Level : INT; END_VAR
VAR_OUTPUT Runs : BOOL; END_VAR
    Runs := Level < 200;
END_FUNCTION_BLOCK

PROGRAM Main
VAR P1 : Pump; On AT %QX0.0 : BOOL; END_VAR
    P1(Level := 100);
    On := P1.Runs;
END_PROGRAM
"""


def edited(text: str, *changes: tuple[str, str]) -> Program:
    """A checked program of one file in which texts were then replaced."""
    program = Program()
    program.replace("pump.st", text)
    program.check_all()
    for old, new in changes:
        text = text.replace(old, new, 1)
        program.replace("pump.st", text)
    return program


def codes(program: Program, name: str = "pump.st") -> list[tuple[str, int]]:
    return [(each.code, each.line) for each in program.diagnostics(name)]


def test_a_mistake_in_a_body_is_found_by_checking_that_body_alone() -> None:
    program = edited(TWO, ("Level < 200", "Levl < 200"))
    assert program.check_changes()
    assert codes(program) == [("S0201", 4)]


def test_a_new_pin_concerns_others_and_needs_a_whole_check() -> None:
    program = edited(TWO, ("Level : INT", "Height : INT"))
    assert not program.check_changes()
    program.check_all()
    assert codes(program) == [("S0201", 4), ("S0402", 9)]


FUNCTION = "FUNCTION Twice : INT\nVAR_INPUT x : INT; END_VAR\n    Twice := x * 2;\nEND_FUNCTION\n"


@each_of("text, old, new", [
    (TWO.replace("END_VAR\n    Runs", "END_VAR\nVAR n : INT; END_VAR\n    Runs"), "n : INT", "n : DINT"),
    (FUNCTION, "x * 2", "x * 3"),
    (TWO, "Level := 100", "Level := 101"),
    (TWO + "ACTIONS Main\nACTION Stop: On := FALSE; END_ACTION\nEND_ACTIONS\n", "On := FALSE", "On := TRUE"),
])
def test_a_change_inside_of_a_pou_concerns_nobody_else(text: str, old: str, new: str) -> None:
    assert edited(text, (old, new)).check_changes()


@each_of("text, old, new", [
    (FUNCTION, "Twice : INT", "Twice : DINT"),
    (FUNCTION.replace("x : INT", "x : ANY_INT"), "x * 2", "x * 3"),
    (FUNCTION + FUNCTION.replace("* 2", "* 4"), "x * 4", "x * 5"),
    (TWO + "FUNCTION_BLOCK Big EXTENDS Pump\nEND_FUNCTION_BLOCK\n", "Level < 200", "Level < 300"),
    (TWO.replace("    Runs :=", "METHOD Stop\n    ;\nEND_METHOD\n    Runs :="), "Level < 200", "Level < 300"),
    (TWO + "ACTIONS Main\nACTION Stop: On := FALSE; END_ACTION\nEND_ACTIONS\n", "ACTION Stop", "ACTION Halt"),
    (TWO.replace("%QX0.0", "%Q*") + "CONFIGURATION C\nPROGRAM P : Main;\nVAR_CONFIG P.On AT %QX0.0 : BOOL; END_VAR\n"
     "END_CONFIGURATION\n", "Level < 200", "Level < 300"),
    ("TYPE T : INT; END_TYPE\n" + FUNCTION, "T : INT", "T : DINT"),
])
def test_a_change_that_others_may_notice_needs_a_whole_check(text: str, old: str, new: str) -> None:
    assert not edited(text, (old, new)).check_changes()


@each_of("changes, expected", [
    ([("Level < 200", "Levl < 200"), ("Level := 100", "Levl := 100")], [("S0201", 4), ("S0402", 9)]),
    ([("Level := 100", "Levl := 100"), ("Level < 200", "Levl < 200")], [("S0201", 4), ("S0402", 9)]),
    ([("Level < 200", "Levl < 200"), ("Levl < 200", "Level < 300")], []),
    ([("Level < 200", "Levl < 200"), ("Level := 100", "Levl := 100"), ("Levl < 200", "Level < 300")], [("S0402", 9)]),
])
def test_keys_that_come_before_a_check_all_count(changes: list[tuple[str, str]], expected: list[tuple[str, int]]) -> None:
    program = edited(TWO, *changes)
    assert program.check_changes() and codes(program) == expected


def test_a_file_that_is_new_needs_a_whole_check() -> None:
    program = edited(TWO)
    program.replace("other.st", "VAR_GLOBAL shared : INT; END_VAR\n")
    assert not program.check_changes()


def test_a_local_variable_of_a_block_concerns_nobody_else() -> None:
    program = edited(TWO, ("    Runs :=", "VAR n : INT; m : TON; END_VAR\n    n := 1.5; Runs :="))
    assert program.check_changes()
    assert codes(program) == [("S0301", 5)]


def test_lines_in_front_move_messages_and_the_line_numbers_in_them() -> None:
    program = edited(TWO.replace("On := P1.Runs;", "IF On THEN"), ("PROGRAM", "// one\n// two\nPROGRAM"))
    program.check_all()
    assert [(each.line, each.message) for each in program.diagnostics("pump.st")] == [
        (13, "END_IF expected before `END_PROGRAM`: the IF of line 12 is still open")]


def test_lines_in_an_earlier_declaration_move_the_line_numbers_in_messages() -> None:
    program = edited(TWO.replace("On := P1.Runs;", "IF On THEN"), ("    Runs :=", "    // one\n    // two\n    Runs :="))
    program.check_all()
    assert [(each.line, each.message) for each in program.diagnostics("pump.st")] == [
        (13, "END_IF expected before `END_PROGRAM`: the IF of line 12 is still open")]


def test_warnings_come_with_the_whole_check() -> None:
    program = edited(TWO, ("Runs := Level < 200;", "Runs := Level < 200; ; RETURN; Runs := TRUE;"))
    assert program.check_changes()
    assert codes(program) == []
    program.check_all()
    assert [code for code, _ in codes(program)] == ["S0592"]


def test_a_suppressed_warning_stays_so_in_all_later_parts() -> None:
    text = TWO.replace("\nPROGRAM", "{warning disable S0290}\nPROGRAM").replace("On AT", "unused : INT; On AT")
    assert codes(edited(text)) == []
    assert codes(edited(text.replace("{warning disable S0290}", "//"))) == [("S0290", 8)]


def test_a_check_that_is_given_up_changes_nothing() -> None:
    program = edited(TWO, ("Level : INT", "Height : INT"))
    steps = program.check()
    next(steps)
    steps.close()
    assert not program.is_current
    assert codes(program) == []
    program.check_all()
    assert codes(program) == [("S0201", 4), ("S0402", 9)]


def test_a_whole_check_that_is_given_up_is_still_needed() -> None:
    program = edited(TWO)
    program.replace("other.st", "VAR_GLOBAL shared : INT; END_VAR\n")
    steps = program.check()
    next(steps)
    steps.close()
    assert not program.is_current and not program.check_changes()


def test_a_check_parses_one_part_in_a_step(monkeypatch: pytest.MonkeyPatch) -> None:
    parsed: list[str] = []

    def parsing(source: Source) -> tuple[SourceText, list[Diagnostic]]:
        parsed.append(source.text.split()[1])
        return parse(source)

    monkeypatch.setattr("fbvm.analysis.parts.parse", parsing)
    program = Program()
    program.replace("pump.st", TWO)
    program.replace("twice.st", "FUNCTION Twice : INT\nEND_FUNCTION\n")
    steps, names = program.check(), ["Pump", "Main", "Twice"]
    for known in range(3):
        next(steps)
        assert parsed == names[:known]
    next(steps)
    assert parsed == names
    steps.close()
    program.check_all()
    assert parsed == names


def test_a_part_whose_messages_name_lines_is_checked_anew_where_it_moves_to() -> None:
    text = TWO.replace("On := P1.Runs;", "On := P1.Run; IF On THEN") + "PROGRAM Last\nEND_PROGRAM\n"
    program = edited(text, ("Level < 200", "Level <\n200"))
    assert program.check_changes()
    fresh_one = edited(text.replace("Level < 200", "Level <\n200"))
    assert [(each.line, each.message) for each in program.diagnostics("pump.st")] == [
        (each.line, each.message) for each in fresh_one.diagnostics("pump.st")]  # fmt: skip
    assert len(program.diagnostics("pump.st")) == 2


def test_files_see_one_another_and_what_is_removed_is_gone() -> None:
    program = Program()
    block, _, main = TWO.partition("PROGRAM")
    program.replace("block.st", block)
    program.replace("main.st", "PROGRAM" + main)
    program.check_all()
    assert codes(program, "main.st") == []
    program.remove("block.st")
    program.check_all()
    assert codes(program, "main.st") == [("S0204", 2)]


@each_of("text, count", [
    ("FUNCTION A : INT\nEND_FUNCTION\nPROGRAM B\nEND_PROGRAM", 2),
    ("PROGRAM A (* END_PROGRAM\n(* *) PROGRAM B *)\nEND_PROGRAM\nPROGRAM C\nEND_PROGRAM", 2),
    ("PROGRAM A\nx := 'END_PROGRAM$'';\nEND_PROGRAM // ;\nTYPE T : INT; END_TYPE;", 2),
    ("FUNCTION_BLOCK A\nACTION B: END_ACTION\nEND_FUNCTION_BLOCK\nACTION C: END_ACTION\nACTIONS A END_ACTIONS\n", 1),
    ("CONFIGURATION C\nPROGRAM P : Main;\nVAR_GLOBAL x : INT; END_VAR\nEND_CONFIGURATION\nVAR_GLOBAL y : INT; END_VAR\n", 2),
    ("FUNCTION_BLOCK open\nVAR END_VAR\nPROGRAM Main\nEND_PROGRAM\nPROGRAM C\nEND_PROGRAM", 2),
    ("PROGRAM A\nLADDER\nLD 'END_PROGRAM\nEND_LADDER\nEND_PROGRAM\nPROGRAM B\nEND_PROGRAM", 2),
    ("NAMESPACE A\nNAMESPACE B\nPROGRAM C\nEND_NAMESPACE\nEND_NAMESPACE\nPROGRAM D\nEND_PROGRAM", 2),
    ("", 1),
])
def test_parts_are_the_declarations_of_a_text(text: str, count: int) -> None:
    found = spans(text)
    assert len(found) == count
    assert "".join(text[start:end] for start, end in found) == text


def test_only_the_changed_part_is_new() -> None:
    file = File("a.st", TWO)
    pairs = file.replace(TWO.replace("200", "300"))
    assert [(old and old.base, new and new.base) for old, new in pairs] == [(0, 0)]
    assert [part.base for part in file.parts] == [0, TWO.index("\nPROGRAM")]


@each_of("old, new, cuts", [
    ("x0 := 0", "x0 := 1", 2), ("x0 := 0", "x0 := 10", 2), ("x25 := 0", "x25 := 1", 3), ("x49 := 0", "", 2),
])
def test_of_a_long_text_only_what_is_around_a_change_is_read_again(old: str, new: str, cuts: int) -> None:
    text = "".join(f"PROGRAM P{each}\n    x{each} := 0;\nEND_PROGRAM\n" for each in range(50))
    file = File("a.st", text)
    found, original = list[tuple[int, int]](), parts._cuts

    def counted(text: str, start: int) -> Iterator[tuple[int, int]]:
        for cut in original(text, start):
            found.append(cut)
            yield cut

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(parts, "_cuts", counted)
        file.replace(text.replace(old, new))
    assert len(found) == cuts


# --- edited = never edited --------------------------------------------------------------------------------------------

PIECES = ("END_FUNCTION_BLOCK\n", "PROGRAM X\n", "END_PROGRAM", "(*", "*)", "'", ";", "x := 1;", "VAR y : INT; END_VAR\n", "\n",
          "FUNCTION F : INT F := 1; END_FUNCTION\n", "// ", "LADDER\n", "END_LADDER\n", "ACTION A: x := 1; END_ACTION\n",
          "TYPE T : INT; END_TYPE\n", "q", "END_VAR", " ")  # fmt: skip
NEEDS_ALL = re.compile(r"S..9|S0408")
"""Codes of messages for which the whole program has to be checked: warnings, and calls that come back."""


def rows(found: list[Diagnostic]) -> list[object]:
    return [(d.code, d.start, d.end, d.message, d.hint, d.related and d.related[1:]) for d in found]


def fresh(text: str, dialect: str) -> list[Diagnostic]:
    program = Program(dialect=dialect)
    program.replace("x.st", text)
    program.check_all()
    return program.diagnostics("x.st")


def check_edits(seed: int) -> None:
    """Edit a text of three programs of the corpus at random; compare after each edit."""
    chosen = random.Random(seed)
    some = chosen.sample(list(programs()), 3)
    text, dialect = "\n".join(each.text.strip() for each in some), some[0].dialect
    program = Program(dialect=dialect)
    program.replace("x.st", text)
    program.check_all()
    for _ in range(8):
        at = chosen.randrange(len(text) + 1)
        if chosen.random() < 0.5:
            text = text[:at] + chosen.choice(PIECES) + text[at:]
        else:
            text = text[:at] + text[at + chosen.randrange(1, 12):]
        program.replace("x.st", text)
        wanted = fresh(text, dialect)
        if program.check_changes():
            errors = [[d for d in found if not NEEDS_ALL.match(d.code)] for found in (program.diagnostics("x.st"), wanted)]
            assert rows(errors[0]) == rows(errors[1])
        program.check_all()
        assert rows(program.diagnostics("x.st")) == rows(wanted)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(times(12)))
def test_after_any_edits_the_diagnostics_are_those_of_a_fresh_program(seed: int) -> None:
    check_edits(seed)


@pytest.mark.slow
def test_diagnostics_are_those_of_the_compiler() -> None:
    texts = [(each.text, each.dialect) for each in programs()]
    texts += [(path.read_text(encoding="utf-8"), "standard") for path in (Path(__file__).parents[2] / "golden").rglob("*.st")]
    for text, dialect in texts:
        wanted = compile_sources([Source("x.st", text)], dialect=dialect).diagnostics
        assert rows(fresh(text, dialect)) == rows(wanted), text


def test_a_bit_of_a_word_changes_what_addresses_mean_everywhere() -> None:
    text = "PROGRAM Main\nVAR b : BOOL; END_VAR\n    b := %IX0.3;\nEND_PROGRAM\n"
    program = Program(dialect="codesys")
    program.replace("words.st", text)
    program.check_all()
    program.replace("words.st", text.replace("0.3", "0.13"))
    assert not program.check_changes()
    program.check_all()
    assert codes(program, "words.st") == [("S0193", 3)]


@each_of("text", [
    "FUNCTION_BLOK B\nVAR_INPUT a : INT; END_VAR\nEND_FUNCTION_BLOCK\nPROGRAM Main VAR b : B; END_VAR b(a := 1); END_PROGRAM",
    "FUNCTION_BLOCK B\nVAR_INPUT 1a : INT; END_VAR\nEND_FUNCTION_BLOCK\nPROGRAM Main VAR b : B; END_VAR b(a := 1); END_PROGRAM",
    "TYPE T : STRUCT a ; b : INT; END_STRUCT END_TYPE\nPROGRAM Main VAR t : T; END_VAR t.a := 1; t.c := 2; END_PROGRAM",
])
def test_what_follows_from_a_mistake_elsewhere_is_not_told(text: str) -> None:
    program = Program()
    program.replace("a.st", text)
    program.check_all()
    assert [message.code for message in program.diagnostics("a.st")] == ["S0101"]


def test_a_type_that_becomes_a_program_and_back_needs_a_whole_check() -> None:
    program = Program()
    for text in ("TYPE T : INT; END_TYPE", "PROGRAM Main END_PROGRAM", "TYPE T : INT; END_TYPE"):
        program.replace("a.st", text)
        assert not program.check_changes()
        program.check_all()
        assert program.diagnostics("a.st") == []


def test_errors_of_a_library_are_told_apart(tmp_path: Path) -> None:
    folder = tmp_path / "lib" / "mine"
    folder.mkdir(parents=True)
    (folder / "Wrong.st").write_text("FUNCTION_BLOCK Wrong VAR n : INT; END_VAR n := m; END_FUNCTION_BLOCK", encoding="utf-8")
    program = Program(libraries=[tmp_path / "lib"])
    program.replace("a.st", "PROGRAM Main VAR w : Wrong; END_VAR w(); END_PROGRAM")
    assert program.library_errors() == []
    program.check_all()
    assert [message.code for message in program.library_errors()] == ["S0201"]


def test_whether_a_file_has_another_text_is_told() -> None:
    program = Program()
    assert [program.replace("a.st", text) for text in ("", "PROGRAM Main END_PROGRAM", "PROGRAM Main END_PROGRAM", "")] == [
        True, True, False, True]
