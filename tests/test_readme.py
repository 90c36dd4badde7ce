"""Programs and charts of the README and of guides, one by one and quickly; `test_docs` runs whole pages."""

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


def page(name: str) -> str:
    return (HOUSE / name).read_text(encoding="utf-8")


def block(name: str, language: str, part: str = "") -> str:
    """The first block of a page that contains a text."""
    return next(text for text in re.findall(rf"^```{language}\n(.*?)^```", page(name), re.M | re.S) if part in text)


def test_the_first_program_draws_that_chart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("pump.st").write_text(block("README.md", "iecst"), encoding="utf-8")
    text, _, shown = block("README.md", "console", "--chart").removeprefix("$ fbvm ").replace("\\\n", "").partition("\n")
    result = CliRunner().invoke(main, shlex.split(text))
    assert result.output == shown


@pytest.mark.slow
def test_the_crossing_is_drawn_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    Path("crossing.st").write_text(block("docs/howto/sfc.md", "iecst"), encoding="utf-8")
    text, _, shown = block("docs/howto/sfc.md", "console").removeprefix("$ fbvm ").replace("\\\n", "").partition("\n")
    result = CliRunner().invoke(main, shlex.split(text))
    assert result.output == shown


@pytest.mark.slow
def test_stepping_says_that(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    guide = page("docs/howto/stepping.md")
    Path("pump.st").write_text(block("docs/howto/stepping.md", "iecst"), encoding="utf-8")
    found = re.search(r"^\$ printf '(.*)' \| fbvm (.*)\n", guide, re.M)
    assert found
    shown = guide[found.end() : guide.index("```", found.end())]
    result = CliRunner().invoke(main, shlex.split(found[2]), input=found[1].replace("\\n", "\n"))
    assert result.output == shown


@pytest.mark.slow
def test_the_python_example_prints_that(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(HOUSE)
    output = io.StringIO()
    with contextlib.redirect_stdout(output):
        exec(block("docs/howto/python.md", "python"), {})
    assert "CIO1519.02  ..#" in output.getvalue()
    assert output.getvalue().endswith("[7, 0]\n")


def test_the_test_example_passes() -> None:
    names: dict[str, object] = {"chart": chart}
    exec(block("docs/howto/python.md", "python", "def test_the_pump_waits"), names)
    plc = Plc(compile_text(block("docs/howto/run.md", "iecst")).image)  # type: ignore[arg-type]
    names["test_the_pump_waits"](plc)  # type: ignore[operator]
    assert plc.scans == 8


def test_a_rung_may_be_drawn() -> None:
    plc = Plc(compile_text(block("docs/howto/ladder.md", "iecst", "|--| |--+---|/|")).image)  # type: ignore[arg-type]
    plc.write("Main.Start", True)
    plc.run(scans=1)
    plc.write("Main.Start", False)
    plc.run(scans=1)
    assert plc.read("Main.Motor") is True


def test_words_are_read_and_written_by_number() -> None:
    text = f"PROGRAM Main\n{block('docs/howto/memory.md', 'iecst', 'DM[Number]')}END_PROGRAM\n"
    plc = Plc(compile_text(text).image)  # type: ignore[arg-type]
    plc.write("D201", 5)
    plc.run(scans=1)
    assert plc.read("D200") == 5
