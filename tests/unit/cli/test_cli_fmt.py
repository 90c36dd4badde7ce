"""`fbvm fmt`: which files are rewritten, what is printed, and the status."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from fbvm.cli.main import main

WILD = "program p var a:int; end_var a:=1; end_program"
CANONICAL = "PROGRAM p\nVAR\n    a : INT;\nEND_VAR\n    a := 1;\nEND_PROGRAM\n"
WRONG = "PROGRAM p\n    a := ;\nEND_PROGRAM\n"


@pytest.fixture(autouse=True)
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in {"wild.st": WILD, "good.st": CANONICAL, "wrong.st": WRONG, "deep/in/wild.ST": WILD,
                       "deep/notes.txt": "a"}.items():
        Path(name).parent.mkdir(parents=True, exist_ok=True)
        Path(name).write_text(text, encoding="utf-8")


def fmt(*arguments: str, given: str | None = None) -> Result:
    result = CliRunner().invoke(main, ("fmt", *arguments), input=given)
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result


def text(name: str) -> str:
    return Path(name).read_text(encoding="utf-8")


def test_files_that_change_are_rewritten_and_named() -> None:
    result = fmt("wild.st", "good.st")
    assert (result.exit_code, result.stdout, result.stderr) == (0, "wild.st\n", "")
    assert text("wild.st") == text("good.st") == CANONICAL
    assert fmt("wild.st", "good.st").stdout == ""
    assert not list(Path().glob("*.part"))


def test_a_folder_stands_for_the_sources_in_it() -> None:
    result = fmt("deep", "deep/in/wild.ST")
    assert (result.exit_code, result.stdout) == (0, str(Path("deep/in/wild.ST")) + "\n")
    assert text("deep/in/wild.ST") == CANONICAL and text("deep/notes.txt") == "a"


def test_a_folder_without_sources_is_told_of() -> None:
    Path("none").mkdir()
    result = fmt("none")
    assert result.exit_code == 0 and result.stderr == "none: no file in this folder ends in .st\n"


def test_check_writes_nothing() -> None:
    result = fmt("--check", "wild.st", "good.st")
    assert (result.exit_code, result.stdout) == (1, "wild.st\n")
    assert text("wild.st") == WILD
    assert fmt("--check", "good.st").exit_code == 0


def test_diff_shows_what_would_change() -> None:
    result = fmt("--diff", "wild.st", "good.st")
    assert result.exit_code == 0 and text("wild.st") == WILD
    assert result.stdout.startswith("--- wild.st\n+++ wild.st\n")
    assert "-program p var" in result.stdout and "+    a := 1;\n" in result.stdout
    assert "\\ No newline at end of file" in result.stdout and "good.st" not in result.stdout


def test_a_file_with_syntax_errors_is_left_alone() -> None:
    result = fmt("wrong.st", "wild.st")
    assert result.exit_code == 3 and text("wrong.st") == WRONG and text("wild.st") == CANONICAL
    assert "wrong.st:2:10: error S0101" in result.stderr
    assert result.stderr.endswith("wrong.st is left as it is: one syntax error\n")


def test_what_is_no_text_is_left_alone() -> None:
    Path("odd.st").write_bytes(bytes(range(256)) * 4)
    before = Path("odd.st").read_bytes()
    result = fmt("odd.st")
    assert result.exit_code == 3 and Path("odd.st").read_bytes() == before
    assert "odd.st is left as it is" in result.stderr


def test_the_standard_input_goes_to_the_standard_output() -> None:
    assert fmt("-", given=WILD).stdout == CANONICAL
    assert fmt("-", "--check", given=WILD).exit_code == 1
    wrong = fmt("-", given=WRONG)
    assert (wrong.exit_code, wrong.stdout) == (3, "")
    assert "stdin:2:10: error S0101" in wrong.stderr


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16"])
def test_a_file_keeps_its_encoding(encoding: str) -> None:
    Path("wild.st").write_bytes(f"// \N{DEGREE SIGN}\N{LATIN SMALL LETTER U WITH DIAERESIS}\n{WILD}".encode(encoding))
    assert fmt("wild.st").exit_code == 0
    assert Path("wild.st").read_text(encoding) == "// \N{DEGREE SIGN}\N{LATIN SMALL LETTER U WITH DIAERESIS}\n" + CANONICAL


def test_lines_that_end_with_cr_alone_become_lines() -> None:
    Path("wild.st").write_bytes(f"// \N{DEGREE SIGN}\r{WILD}\r\x1a".encode("cp1252"))
    assert fmt("wild.st").exit_code == 0
    assert Path("wild.st").read_bytes() == f"// \N{DEGREE SIGN}\n{CANONICAL}".encode("cp1252")


def test_names_of_standard_functions_are_capitals_whatever_they_ask() -> None:
    body = "    n := add_int(sizeof(n), dint_to_int(n));\n    t := add_tod_time(t, t#1s);\n    n := ini(adr);\n"
    given = f"PROGRAM p\nVAR\n    n, adr : INT;\n    t      : TOD;\nEND_VAR\n{body}END_PROGRAM\n"
    wanted = given.replace("t#", "T#")
    for name in ("add_int", "sizeof", "dint_to_int", "add_tod_time"):
        wanted = wanted.replace(name, name.upper())
    assert fmt("-", given=given).stdout == wanted, "ini is none of these"


RUNGS = """FUNCTION_BLOCK Lamp
VAR_INPUT
    On : BOOL;
END_VAR
VAR_OUTPUT
    Light : BOOL;
END_VAR
    Light := On;  // as ever
    LADDER
    RUNG 7 it shines
        ' a note
        LD      On   // from outside
        OR      Light
        OUT     Light
    RUNG
        LD      On
        OUT     100.00
        OR      Light
        OUT     100.01
    END_LADDER
END_FUNCTION_BLOCK

PROGRAM Main
VAR
    Lamp1 : Lamp;
END_VAR
    LADDER
        LD      0.00
        FBCALL  Lamp Lamp1 On:=* Light=>*
        OUT     100.02

        LD      0.01
        CNT     5 #3
    END_LADDER
END_PROGRAM
"""
DRAWN = """    RUNG 7 it shines
        ' a note
        // from outside
        │   On           Light  │
        ├┬──┤ ├──┬────────( )───┤
        ││ Light │              │
        │└──┤ ├──┘              │
    RUNG
        LD      On
        OUT     100.00
        OR      Light
        OUT     100.01
"""


@pytest.mark.slow
def test_rungs_are_drawn_and_written_as_instructions_again() -> None:
    given = RUNGS.replace("    CNT     5 #3", "    OUT     100.03")
    Path("rungs.st").write_text(given, encoding="utf-8")
    result = fmt("rungs.st", "--drawing")
    assert (result.exit_code, result.stdout) == (0, "rungs.st\n")
    assert result.stderr == "rungs.st:15: this rung cannot be written as a drawing\n", "an OR stands behind an output"
    drawn = text("rungs.st")
    assert DRAWN in drawn and "├──┤ ├───┤On         Light├──────────( )───┤" in drawn
    assert drawn.startswith(RUNGS[:RUNGS.index("    RUNG 7")]), "Structured Text stays"
    assert fmt("rungs.st", "--drawing", "--check").exit_code == 0
    assert fmt("rungs.st", "--check").exit_code == 0
    assert fmt("rungs.st", "--mnemonics").stderr == ""
    moved = given.replace("LD      On   // from outside", "LD      On").replace("' a note", "' a note\n        // from outside")
    wanted = moved.replace("    LADDER\n        LD", "    LADDER\n    RUNG\n        LD")
    wanted = wanted.replace("\n\n        LD", "\n    RUNG\n        LD")
    assert text("rungs.st") == wanted


def test_rungs_with_errors_are_left_in_their_notation() -> None:
    Path("rungs.st").write_text(RUNGS, encoding="utf-8")
    result = fmt("rungs.st", "--drawing")
    assert result.exit_code == 3 and text("rungs.st") == RUNGS
    assert "CNT takes 2 conditions, 1 are there" in result.stderr
