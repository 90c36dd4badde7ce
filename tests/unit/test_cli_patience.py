"""What a terminal shows of something that takes long."""

from __future__ import annotations

import io
from collections.abc import Iterator

from rich.console import Console

from fbvm.cli.patience import PER_SECOND, QUICK_S, patience


def said(terminal: bool, seconds: float) -> str:
    """What stands on the screen after a block that took so long, by a clock of its own."""
    file = io.StringIO()
    times: Iterator[float] = iter([0.0])
    now = [seconds]
    console = Console(file=file, force_terminal=terminal, width=80, get_time=lambda: next(times, now[0]))
    with patience("checking long.st", console):
        console.print()
    return file.getvalue()


def test_what_is_quick_says_nothing() -> None:
    assert "checking" not in said(True, QUICK_S - 1 / PER_SECOND)


def test_what_takes_long_says_what_it_does() -> None:
    assert "checking long.st" in said(True, QUICK_S)


def test_a_pipe_is_told_nothing() -> None:
    assert said(False, 60.0) == "\n"
