"""What the README shows is what happens."""

from __future__ import annotations

import contextlib
import io
import re
import shlex
from pathlib import Path

import pytest
from click.testing import CliRunner

from fbvm.cli.main import main
from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.record.draw.chart import chart

HOUSE = Path(__file__).resolve().parent.parent
README = (HOUSE / "README.md").read_text(encoding="utf-8")


def block(language: str, number: int = 0) -> str:
    return re.findall(rf"^```{language}\n(.*?)^```", README, re.M | re.S)[number]


def test_the_first_program_draws_that_chart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("pump.st").write_text(block("iecst"), encoding="utf-8")
    text, _, shown = block("console").removeprefix("$ fbvm ").replace("\\\n", "").partition("\n")
    result = CliRunner().invoke(main, shlex.split(text))
    assert result.output == shown


def test_the_crossing_is_drawn_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    Path("crossing.st").write_text(block("iecst", 3), encoding="utf-8")
    text, _, shown = block("console", 1).removeprefix("$ fbvm ").replace("\\\n", "").partition("\n")
    result = CliRunner().invoke(main, shlex.split(text))
    assert result.output == shown


def test_stepping_says_that(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("pump.st").write_text(block("iecst"), encoding="utf-8")
    found = re.search(r"^\$ printf '(.*)' \| fbvm (.*)\n", README, re.M)
    assert found
    shown = README[found.end() : README.index("```", found.end())]
    result = CliRunner().invoke(main, shlex.split(found[2]), input=found[1].replace("\\n", "\n"))
    assert result.output == shown


def test_the_python_example_prints_that(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(HOUSE)
    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        exec(block("python"), {})
    assert "CIO1519.02  ..#" in output.getvalue()
    assert output.getvalue().endswith("[7, 0]\n")


def test_the_test_example_passes() -> None:
    names: dict[str, object] = {"chart": chart}
    exec(block("python", 1), names)
    plc = Plc(compile_text(block("iecst")).image)  # type: ignore[arg-type]
    names["test_the_pump_waits"](plc)  # type: ignore[operator]
    assert plc.scans == 8


def test_a_rung_may_be_drawn() -> None:
    names = "Start AT CIO 0.00 : BOOL; Stop AT CIO 0.01 : BOOL; Motor AT CIO 100.00 : BOOL;"
    plc = Plc(compile_text(f"PROGRAM Main VAR {names} END_VAR\n{block('iecst', 2)}END_PROGRAM\n").image)  # type: ignore[arg-type]
    plc.write("Main.Start", True)
    plc.run(scans=1)
    plc.write("Main.Start", False)
    plc.run(scans=1)
    assert plc.read("Main.Motor") is True


def test_words_are_read_and_written_by_number() -> None:
    text = f"PROGRAM Main\n{block('iecst', 4)}END_PROGRAM\n"
    plc = Plc(compile_text(text).image)  # type: ignore[arg-type]
    plc.write("D201", 5)
    plc.run(scans=1)
    assert plc.read("D200") == 5


def test_every_verb_is_named() -> None:
    for verb in main.list_commands(None):  # type: ignore[arg-type]
        assert f"`fbvm {verb}" in README
