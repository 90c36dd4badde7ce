"""Dialects: each is a row of data, every switch has its question, and all ways to choose one lead to the same.

`FBVM_REWRITE=1 pytest` of this file writes `dialects.txt` anew, which has a line for each question: read the difference."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import fields
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


KEPT = Path(__file__).with_name("dialects.txt")


def answers() -> Iterator[str]:
    """A line for each field: which dialects have another value than the standard, and which one that is."""
    standard = DIALECTS["standard"]
    for field in fields(standard):
        if field.name not in ("name", "for_whom"):
            usual = getattr(standard, field.name)
            others = [(name, getattr(row, field.name)) for name, row in DIALECTS.items()]
            said = [name if value is True else f"{name}={_in_words(value)}" for name, value in others if value != usual]
            yield f"{field.name}: {', '.join(said)}"


def _in_words(value: object) -> str:
    names = sorted(value) if isinstance(value, frozenset) else value
    return " ".join(names) if isinstance(names, list | tuple) else str(value)


def test_which_dialects_answer_otherwise() -> None:
    text = "\n".join(answers()) + "\n"
    if os.environ.get("FBVM_REWRITE"):
        KEPT.write_text(text, encoding="utf-8")
    assert text == KEPT.read_text(encoding="utf-8")


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
