"""Dialects: each is a row of data, every switch has its question, and all ways to choose one lead to the same."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner

from fbvm.base.dialects import DIALECTS, QUESTIONS, SWITCHES, dialect, page
from fbvm.cli.main import main
from fbvm.code.compiler import compile_files, compile_text
from fbvm.machine.plc import Plc

TEXT = "PROGRAM Main VAR w : WORD; i : INT; END_VAR w := w + 1; i := w; END_PROGRAM"


def test_every_switch_has_its_question_and_somebody_who_turns_it() -> None:
    assert set(QUESTIONS) == set(SWITCHES)
    for switch in SWITCHES:
        assert not getattr(DIALECTS["standard"], switch)
        assert any(getattr(row, switch) for row in DIALECTS.values()), switch
        assert QUESTIONS[switch][0] in page()


def test_the_page_says_whose_programs_each_dialect_is_for() -> None:
    assert [line for line in page().splitlines() if line.startswith("- ")][:len(DIALECTS)] == [
        f"- {row.name}: {row.for_whom}." for row in DIALECTS.values()]


def test_a_name_that_there_is_not() -> None:
    assert dialect("CODESYS").name == "codesys"
    with pytest.raises(ValueError, match="there is no dialect siemens"):
        compile_text(TEXT, dialect="siemens")


def test_the_argument() -> None:
    assert compile_text(TEXT).image is None
    image = compile_text(TEXT, dialect="codesys").image
    assert image is not None
    plc = Plc(image)
    plc.scan()
    assert plc.read("Main.i") == 1


def test_the_option_and_the_page(tmp_path: Path) -> None:
    file = tmp_path / "bits.st"
    file.write_text(TEXT, encoding="utf-8")
    run = CliRunner().invoke
    assert run(main, ["check", str(file)]).exit_code == 3
    assert run(main, ["check", str(file), "--dialect", "codesys", "--no-warn", "all"]).exit_code == 0
    assert run(main, ["run", str(file), "--dialect", "codesys", "--for", "10ms"]).exit_code == 0
    assert run(main, ["check", str(file), "--dialect", "siemens"]).exit_code == 2
    shown = run(main, ["explain", "dialects"]).output
    assert "MUX with K out of range" in shown and "codesys" in shown


def test_what_was_compiled_is_kept_for_its_dialect(tmp_path: Path) -> None:
    file = tmp_path / "kept.st"
    file.write_text("PROGRAM Main VAR f : F_TRIG; END_VAR f(CLK := FALSE); END_PROGRAM", encoding="utf-8")
    for name, first in (("standard", True), ("codesys", False), ("standard", True), ("codesys", False)):
        image = compile_files([file], dialect=name).image
        assert image is not None
        plc = Plc(image)
        plc.scan()
        assert plc.read("Main.f.Q") is first
