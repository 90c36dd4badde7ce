"""Files with which verbs once ended in a traceback: each gives a message and the exit status for it."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from old_files import write_old_journal
from rows import each_of

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.cli.main import main

DIGITS = "1" * 5000
"""More than Python converts; a row says N0 for them."""
COUNTER = "PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM\n"
PLC = '[plc.One]\nsources = ["counter.st"]\n'
Fbvm = Callable[..., Result]


def long(row: str) -> str:
    """A row with the digits."""
    return row.replace("N0", DIGITS)


@pytest.fixture
def fbvm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Fbvm:
    """Runs the command in a folder with `counter.st`; an exception that it lets through fails the test."""
    monkeypatch.chdir(tmp_path)
    Path("counter.st").write_text(COUNTER, encoding="utf-8")
    return lambda *arguments: CliRunner().invoke(main, arguments, catch_exceptions=False)


# --- sources ----------------------------------------------------------------------------------------------------------


@each_of(("body", "said"), [
    ("LADDER\nLD 0.00\nLD 0.01\nOR LD\nAND LD\nOUT 100.00\nEND_LADDER", "S0110"),
    ("LADDER\nLD 0.00\nOR\nOUT 100.00\nEND_LADDER", "S0110"),
    ("LADDER\nKEEP 100.00\nEND_LADDER", "S0110"),
    ("INITIAL_STEP A: END_STEP\nTRANSITION FROM B TO A := TRUE; END_TRANSITION", "there is no step B"),
    ("INITIAL_STEP A: END_STEP\nTRANSITION FROM A TO B := TRUE; END_TRANSITION", "there is no step B"),
    ("INITIAL_STEP A: END_STEP\nTRANSITION t FROM A TO A:\nEND_TRANSITION", "X0301"),
])
def test_export_of_sources_with_errors(fbvm: Fbvm, body: str, said: str) -> None:
    Path("wrong.st").write_text(f"PROGRAM Main VAR x : BOOL; END_VAR\n{body}\nEND_PROGRAM\n", encoding="utf-8")
    result = fbvm("export", "wrong.st", "-o", "out.xml")
    assert result.exit_code == 3
    assert said in result.output


@each_of("text", ["LD a (* x", "LADDER\nLD a (* x", "PROGRAM Main\nLADDER\nLD a (* x\nOUT b\nEND_LADDER\nEND_PROGRAM\n"])
def test_fmt_of_a_comment_without_an_end(fbvm: Fbvm, text: str) -> None:
    Path("wrong.st").write_text(text, encoding="utf-8")
    result = fbvm("fmt", "wrong.st")
    assert result.exit_code == 3
    assert "wrong.st is left as it is" in result.output
    assert Path("wrong.st").read_text(encoding="utf-8") == text


@pytest.mark.slow
@each_of("declared", [
    "x AT %DN0 : INT;", "x AT %MWN0 : INT;", "x AT %IX0.N0 : BOOL;", "x AT E0_N0 : INT;",
    "x : STRUCT a AT %BN0 : INT; END_STRUCT;", "x : INT := N0;", "x : TIME := T#N0s;", "x : STRING[N0];",
    "x : ARRAY[0..N0] OF INT;", "x : REAL := N0.5;",
])
def test_numbers_of_many_digits_in_declarations(fbvm: Fbvm, declared: str) -> None:
    Path("wrong.st").write_text(f"PROGRAM Main VAR {long(declared)} END_VAR ; END_PROGRAM\n", encoding="utf-8")
    assert fbvm("check", "wrong.st").exit_code == 3


@pytest.mark.slow
@each_of("step", [
    "LD N0.0", "LD DN0", "TIM N0 #5", "TIM TN0 #5", "MOV &N0 D0", "MOV ,IRN0 D0",
    "MOV +N0,IR0 D0", "OUT TRN0", "JMP N0", "FAL N0 #0", "CNR TN0 T1", "MOV(N0) D0 D1",
    "RUNG N0 Many", "MOV x[N0] D0", "TIM \u00b2 #5", "JMP \u00b2", "CNR T\u00b2 T1", "OUT TR\u00b2", "MOV &\u00b2 D0",
])
def test_numbers_of_many_digits_in_rungs(fbvm: Fbvm, step: str) -> None:
    rungs = f"LD P_On\n{long(step)}\n"
    Path("wrong.st").write_text(f"PROGRAM Main VAR x : ARRAY[0..3] OF WORD; END_VAR\nLADDER\n{rungs}END_LADDER\nEND_PROGRAM\n",
                                encoding="utf-8")
    assert fbvm("check", "wrong.st").exit_code == 3
    assert fbvm("export", "wrong.st", "-o", "out.xml").exit_code in (0, 3)


@pytest.mark.slow
@each_of("arguments", [
    ("--show", "DN0"), ("--show", "Main.n.N0"), ("--show", "Main.n[N0]"), ("--set", "Main.n=N0"),
    ("--set", "Main.n=1@N0s"), ("--set", "Main.n=1@1.N0s"), ("--break", "counter.st:N0"), ("--ladder", "N0"),
    ("--map", "1.2.3.N0:502=peer"), ("--map", "1.2.3.4:N0=peer"), ("--break-if", "Main.n > N0"),
])
def test_numbers_of_many_digits_in_options(fbvm: Fbvm, arguments: tuple[str, str]) -> None:
    result = fbvm("run", "counter.st", "--scans", "2", *map(long, arguments))
    assert result.exit_code == 2
    assert "int_max_str_digits" not in result.output


@pytest.mark.slow
def test_numbers_of_many_digits_as_arguments(fbvm: Fbvm) -> None:
    assert fbvm("map", f"D{DIGITS}").exit_code == 2
    assert fbvm("explain", DIGITS).exit_code == 2
    assert fbvm("run", "counter.st", "--scans", "3", "--trace", "run.fbtrace").exit_code == 0
    assert fbvm("chart", "run.fbtrace", "--scans", f"0..{DIGITS}").exit_code == 0
    assert fbvm("chart", "run.fbtrace", "--scans", DIGITS).exit_code == 2


@pytest.mark.slow
def test_a_number_of_many_digits_in_a_journal(fbvm: Fbvm) -> None:
    write_old_journal("run.journal", Path("counter.st").read_text(encoding="utf-8"))
    text = Path("run.journal").read_text(encoding="utf-8")
    for wrong in (text.replace("n : INT;", f"n AT %D{DIGITS} : INT;"), text.replace('"scan":1', f'"scan":{DIGITS}'),
                  text.replace('"scan":1', f'"force":{{"D{DIGITS}":1}},"scan":1')):  # fmt: skip
        assert wrong != text
        Path("wrong.journal").write_text(wrong, encoding="utf-8")
        assert fbvm("replay", "wrong.journal").exit_code in (2, 3)


# --- files in TOML ----------------------------------------------------------------------------------------------------

WRONG_TOML = [
    "x = N0", f"x = 0x{'F' * 5000}", "x = " + "[" * 5000 + "]" * 5000, "x = " + "{a = " * 5000, "x = " + "[" * 5000,
    "[" + ".".join("a" * 5000) + "]", "x = " + "[" * 300 + "]" * 300,
]  # fmt: skip


@pytest.mark.slow
@each_of("line", [*WRONG_TOML, "cycle = N0", 'cycle = "N0ms"', f'program = {"[" * 200}{"]" * 200}'])
def test_a_project_that_python_does_not_read(fbvm: Fbvm, line: str) -> None:
    Path("fbvm.toml").write_text(f"{PLC}{long(line)}\n", encoding="utf-8")
    for verb in ("check", "run", "step"):
        assert fbvm(verb, "fbvm.toml").exit_code == 3
    found = fbvm("check", "fbvm.toml").output
    assert re.search(r"fbvm\.toml:\d+:\d+: error P010[123]", found), found[:300]


@pytest.mark.slow
@each_of("line", WRONG_TOML)
def test_a_library_that_python_does_not_read(fbvm: Fbvm, line: str) -> None:
    Path("own").mkdir(exist_ok=True)
    Path("own/library.toml").write_text(f"{long(line)}\n", encoding="utf-8")
    result = fbvm("check", "counter.st", "--library", "own")
    assert result.exit_code == 3
    assert "library.toml" in result.output


# --- recordings -------------------------------------------------------------------------------------------------------


def test_a_long_field_of_a_table(fbvm: Fbvm) -> None:
    Path("run.csv").write_text(f"scan,time_ms,a\n0,0,{'x' * 200_000}\n", encoding="utf-8")
    result = fbvm("convert", "run.csv", "run.fbtrace")
    assert result.exit_code == 2
    assert "line 2" in result.output


def test_a_source_with_the_name_of_a_place_in_the_page(fbvm: Fbvm) -> None:
    name = "{{script}}{{data}}.st"
    Path(name).write_text(COUNTER, encoding="utf-8")
    assert fbvm("run", name, "--scans", "3", "--html", "{{data}}.html").exit_code == 0
    page = Path("{{data}}.html").read_text(encoding="utf-8")
    assert "<title>{{data}}</title>" in page
    assert len(re.findall("<script", page)) == len(re.findall("</script", page))


def test_a_place_behind_the_end_of_a_text() -> None:
    related = Source("b.st", ""), 7, "nor here"
    diagnostic = Diagnostic("S0101", Source("a.st", "one\ntwo"), 999, 1005, "nothing is here", related=related)
    assert diagnostic.render().startswith("a.st:2:4: error")
    assert diagnostic.as_dict()["end_line"] == 2
