"""Which warnings are wanted: pragmas, codes, and warnings that count as errors, through the API."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from rows import each_of

from fbvm import Source, compile_files, compile_sources, compile_text
from fbvm.base.diagnostics import errors
from fbvm.check.lint.suppression import Wanted

TEXT = """PROGRAM Main
VAR r : REAL; q : BOOL; idle : INT; END_VAR
    q := r = 1.0;
END_PROGRAM
"""


def codes(text: str, **wanted: object) -> list[str]:
    return [d.code for d in compile_text(text, **wanted).diagnostics]  # type: ignore[arg-type]


def test_codes_are_left_out() -> None:
    assert codes(TEXT) == ["S0290", "S0390"]
    assert codes(TEXT, no_warn=["S0290"]) == codes(TEXT, no_warn=[" s0290 "]) == ["S0390"]
    assert codes(TEXT, no_warn=["all"]) == codes(TEXT, lint=False) == []


@each_of("code", ["S0201", "S0999", "R0101", "", "C0195"])
def test_what_is_no_code_of_a_warning_is_misuse(code: str) -> None:
    with pytest.raises(ValueError, match="is no code of a warning; there are S0190"):
        Wanted.of([code], False)


def test_warnings_can_forbid_running() -> None:
    made = compile_text(TEXT, warnings_as_errors=True)
    assert made.image is None and made.errors == made.diagnostics and len(made.errors) == 2
    assert made.errors[0].render().startswith("text.st:2:25: error S0290: ")
    assert compile_text(TEXT, warnings_as_errors=True, no_warn=["all"]).image is not None
    assert compile_text(TEXT).image is not None


def test_a_text_with_errors_is_not_looked_at_further() -> None:
    assert codes(TEXT.replace("1.0", "TRUE")) == ["S0302"]


def test_a_pragma_speaks_of_its_own_text_only() -> None:
    other = TEXT.replace("Main", "Other")
    made = compile_sources([Source("a.st", "{warning disable S0390, S0290}\n" + TEXT), Source("b.st", other)])
    assert [(d.source.name, d.code) for d in made.diagnostics] == [("b.st", "S0290"), ("b.st", "S0390")]


def test_a_pragma_speaks_of_what_stands_directly_behind_it() -> None:
    text = "PROGRAM Main\nVAR {warning disable S0290}idle : INT; {warning restore S0290}lazy : INT; END_VAR\nEND_PROGRAM\n"
    assert [d.render().splitlines()[0] for d in compile_text(text).diagnostics] == [
        "text.st:2:63: warning S0290: lazy is never used"]


def test_libraries_are_not_looked_at(tmp_path: Path) -> None:
    (tmp_path / "Slack.st").write_text("FUNCTION_BLOCK Slack\nVAR idle : INT; END_VAR\nEND_FUNCTION_BLOCK\n", encoding="utf-8")
    main = tmp_path / "main" / "main.st"
    main.parent.mkdir()
    main.write_text("PROGRAM Main\nVAR s : Slack; END_VAR\n    s();\nEND_PROGRAM\n", encoding="utf-8")
    assert compile_files([main], libraries=[tmp_path]).diagnostics == []
    own = compile_files([main, tmp_path / "Slack.st"])
    assert [d.code for d in own.diagnostics] == ["S0290"] and errors(own.diagnostics) == []


HOUSE = Path(__file__).resolve().parents[3]


LIBRARIES = {path.parent for path in (HOUSE / "fblib").rglob("library.toml")}
OWN = [*(sorted(file for file in folder.rglob("*.st") if next(one for one in file.parents if one in LIBRARIES) == folder)
         for folder in sorted(LIBRARIES)),
       *([path] for path in sorted((HOUSE / "examples").glob("*.st"))), sorted((HOUSE / "examples/project/src").glob("*.st"))]


FLAGS = re.compile(r"\b(P_(ER|GT|EQ|N|OF|UF|CY)|CX_(Failure|Stopped)) +:=")
"""Only a library may write condition flags and the words of failures."""


MEANT = {"ladder": ["S0390"], "twincat": ["S0195"], "tcunit": ["S0195"], "version2": ["S0293"]}
"""Warnings by folder: equality of reals is what an instruction asks; AND_THEN is a word of TwinCAT; where no socket is ever open,
nobody reads the inputs."""


@pytest.mark.slow
@each_of("files", OWN, ids=lambda files: files[0].parent.name + "/" + files[0].stem)
def test_what_fbvm_brings_is_clean(files: list[Path]) -> None:
    ordinary = [path for path in files if not FLAGS.search(path.read_text(encoding="utf-8"))]
    compilation = compile_files(ordinary, libraries=[files[0].parent], no_warn=MEANT.get(files[0].parent.name, []))
    assert compilation.diagnostics == [], "\n".join(d.render() for d in compilation.diagnostics)
