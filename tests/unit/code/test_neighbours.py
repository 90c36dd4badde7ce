"""An unknown name that a file beside the compiled one declares: the message names the file."""

from __future__ import annotations

from pathlib import Path

import pytest

from fbvm.code.compiler import compile_files, neighbours

MAIN = "PROGRAM Main VAR p : Pump; n : INT; END_VAR p(); n := Twice(n); END_PROGRAM\n"
PUMP = "(* a pump *)\nFUNCTION_BLOCK Pump VAR x : INT; END_VAR x := x + 1; END_FUNCTION_BLOCK\n"
TWICE = "FUNCTION twice : INT VAR_INPUT a : INT; END_VAR twice := 2 * a; END_FUNCTION\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in (("main.st", MAIN), ("machines.st", PUMP), ("numbers.st", TWICE)):
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def hints(*paths: Path) -> list[str]:
    return [each.hint for each in compile_files(paths).errors]


def test_the_file_that_declares_it_is_named(folder: Path) -> None:
    assert hints(folder / "main.st") == [
        f"{folder / 'machines.st'} declares Pump: it is a source of the program, too",
        f"{folder / 'numbers.st'} declares Twice: it is a source of the program, too",
    ]  # fmt: skip
    assert compile_files([folder / "main.st", folder / "machines.st", folder / "numbers.st"]).image


def test_what_is_given_already_is_no_hint(folder: Path) -> None:
    (hint,) = hints(folder / "main.st", folder / "machines.st")
    assert "numbers.st" in hint


def test_a_name_that_nobody_declares_keeps_its_hint(folder: Path) -> None:
    (folder / "main.st").write_text("PROGRAM Main VAR t : TOM; p : Pump; END_VAR END_PROGRAM\n", encoding="utf-8")
    tom, pump = hints(folder / "main.st")
    assert "declares" not in tom and "machines.st declares Pump" in pump


def test_large_files_devices_and_folders_are_passed_over(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(neighbours, "LARGEST_BYTES", 20)
    (folder / "a.st").mkdir()
    (folder / "b.st").symlink_to("/dev/zero")
    assert not any("declares" in hint for hint in hints(folder / "main.st"))


def test_a_file_that_cannot_be_read_still_ends_the_compilation(folder: Path) -> None:
    (folder / "main.st").write_text("PROGRAM Main END_PROGRAM\n", encoding="utf-8")
    made = compile_files([folder / "main.st", folder / "none.st"])
    assert made.image is None and [each.code for each in made.errors] == ["S0107"]
