"""Whole sessions of `fbvm step`, word for word, beside `sessions/`: a line behind > is typed, those behind it are printed, a line
behind ! says why a command is refused.  `FBVM_REWRITE=1 pytest` of this file writes them anew: read the difference."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from fbvm.code.compiler import compile_text
from fbvm.machine.backplane import usual_units
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.step.commands import CommandError, Commands
from fbvm.step.session import Session
from fbvm.step.stop_report import StopReport

HERE = Path(__file__).with_name("sessions")

pytestmark = pytest.mark.slow


def commands(text: str) -> Commands:
    image = compile_text(text, lint=False).image
    assert image is not None

    def plc() -> Plc:
        made, network = Plc(image), LoopNetwork()
        for unit in usual_units([]):
            made.attach(unit, network)
        return made

    session = Session.of(plc)
    return Commands(session, StopReport(session, {image.sites[0].file: text}))


def said(made: Commands, typed: str) -> Iterator[str]:
    try:
        for lines in made.run(typed):
            yield from (line.rstrip() for line in lines.split("\n"))
    except CommandError as error:
        yield f"! {error}"


@pytest.mark.parametrize("file", [pytest.param(file, id=file.stem) for file in sorted(HERE.glob("*.txt"))])
def test_a_session_goes_as_it_is_kept(file: Path) -> None:
    kept = file.read_text(encoding="utf-8")
    made = commands((HERE / "press.st").read_text(encoding="utf-8"))
    lines = ["\n".join(made.stop())]
    for typed in [line for line in kept.splitlines() if line.startswith(">")]:
        lines += [typed, *said(made, typed[1:].strip())]
    came = "\n".join(line.rstrip() for line in "\n".join(lines).split("\n")) + f"\n{'ended' if made.ended else 'goes on'}\n"
    if os.environ.get("FBVM_REWRITE"):
        file.write_text(came, encoding="utf-8")
    assert came == kept
