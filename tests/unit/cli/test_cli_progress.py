"""What a terminal shows of something that takes long."""

from __future__ import annotations

import io
from collections.abc import Iterator
from itertools import groupby

import pytest
from rich.console import Console

from fbvm import Source, compile_sources
from fbvm.cli.shared.progress import PER_SECOND, QUICK_S, show_progress


def said(terminal: bool, seconds: float) -> str:
    """What stands on the screen after a block that took so long, by a clock of its own."""
    file = io.StringIO()
    times: Iterator[float] = iter([0.0])
    now = [seconds]
    console = Console(file=file, force_terminal=terminal, width=80, get_time=lambda: next(times, now[0]))
    with show_progress("checking long.st", console) as reached:
        reached("read", 30, 120)
        console.print()
    return file.getvalue()


def test_what_is_quick_says_nothing() -> None:
    assert "checking" not in said(True, QUICK_S - 1 / PER_SECOND)


def test_what_takes_long_says_what_it_does() -> None:
    assert "checking long.st: read 25 %" in said(True, QUICK_S)


@pytest.mark.slow
def test_a_compilation_tells_how_far_it_is() -> None:
    text = "".join(f"FUNCTION F{n} : INT F{n} := {n}; END_FUNCTION\n" for n in range(800)) + "PROGRAM Main END_PROGRAM\n"
    told: list[tuple[str, int, int]] = []
    made = compile_sources([Source("long.st", text)], progress=lambda *row: told.append(row))
    assert made.image is not None
    assert [what for what, _ in groupby(told, key=lambda row: row[0])] == ["read", "checked", "compiled"]
    read = [row for row in told if row[0] == "read"]
    assert len(read) > 1 and read == sorted(read) and {known for _, _, known in read} == {len(text)}
    assert told[-1] == ("compiled", 800, 801)


def test_a_pipe_is_told_nothing() -> None:
    assert said(False, 60.0) == "\n"
