"""A program of the corpus, and of the tables of the standard, fails if it does anything else than its comments say."""

from __future__ import annotations

from pathlib import Path

import pytest
from lang_check import BUDGET, REFERENCE, check
from lang_corpus import read
from rows import each_of, go_through

from fbvm.code.image import Image
from fbvm.machine.plc import Plc

RIGHT = {
    "value": "a := a + 2; // expect a = 2",
    "value of a later scan": "a := a + 2; // expect scan 3: a = 6",
    "value after a write": "a := a + 2; // set scan 2: a = 10 // expect scan 2: a = 12",
    "trap": "a := 1 / a; // trap R0101",
    "error": "a := b; // error S0201: b",
}
WRONG = {
    "another value": ("a := a + 2; // expect a = 3", "a after scan 1 is 2, not 3"),
    "another value in a later scan": ("a := a + 2; // expect scan 3: a = 5", "a after scan 3 is 6, not 5"),
    "another value after a write": ("a := a + 2; // set scan 2: a = 10 // expect scan 2: a = 4", "a after scan 2 is 12, not 4"),
    "no trap": ("a := 1; // trap R0101", "no trap R0101"),
    "another trap": ("a := 1 / a; // trap R0102", "R0101"),
    "a trap that is not expected": ("a := 1 / a; // expect a = 0", "R0101"),
    "no error": ("a := 1; // error S0201", "missing:\n.*S0201"),
    "another error": ("a := b; // error S0302", "not expected:\n.*S0201"),
    "an error with another text": ("a := b; // error S0201: x is", "missing:\n.*S0201 x is"),
    "an error that is not expected": ("a := b; // expect a = 1", "not expected:\n.*S0201"),
    "no warning": ("a := 1; // warning S0906", "missing:\n.*S0906"),
}


def checked(folder: Path, line: str) -> None:
    path = folder / "program.st"
    path.write_text(f"// ---- what it shows\nPROGRAM Main\nVAR a : INT; END_VAR\n{line}\nEND_PROGRAM\n", "utf-8")
    [program] = read(path)
    check(program, REFERENCE)


@each_of("line", RIGHT.values(), ids=RIGHT)
def test_a_program_that_does_what_it_says(tmp_path: Path, line: str) -> None:
    assert checked(tmp_path, line) is None  # type: ignore[func-returns-value]


@pytest.mark.slow
@each_of("line, told", WRONG.values(), ids=WRONG)
def test_a_program_that_does_anything_else_fails(tmp_path: Path, line: str, told: str) -> None:
    with pytest.raises(AssertionError, match=told):
        checked(tmp_path, line)


def test_an_engine_that_leaves_another_memory_fails(tmp_path: Path) -> None:
    def build(image: Image, cycle_ns: int) -> Plc:
        plc = Plc(image, cycle_ns, budget=BUDGET)
        plc.write("Main.a", 1)
        return plc

    path = tmp_path / "program.st"
    path.write_text("// ---- what it shows\nPROGRAM Main\nVAR a : INT; END_VAR\nEND_PROGRAM\n// expect a = 0\n", "utf-8")
    [program] = read(path)
    with pytest.raises(AssertionError, match="other: memory after scan 1"):
        check(program, REFERENCE | {"other": build})


def test_going_through_cases_raises_what_each_of_them_raised() -> None:
    def fail() -> None:
        pytest.fail("no")

    def wrong() -> None:
        raise AssertionError("nor this")

    with pytest.raises(ExceptionGroup, match="2 of 3 rows") as failed:
        go_through([("first", fail), ("second", lambda: None), ("third", wrong)])
    assert [(str(error), error.__notes__) for error in failed.value.exceptions] == [
        ("no", ["row: first"]), ("nor this", ["row: third"])]
    with pytest.raises(AssertionError, match="no case was tried"):
        go_through([])
