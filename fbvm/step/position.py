"""Where a run stands: the scan, and how many statements of it have been executed."""

from __future__ import annotations

from dataclasses import dataclass

from fbvm.machine.breakpoints import Breakpoint


@dataclass(frozen=True, order=True)
class Position:
    """The position before a statement: the number of the scan, and of statements of this scan that have been executed."""

    scan: int = 0
    step: int = 0


@dataclass(frozen=True)
class Reached:
    """Breakpoints that were reached, and where: the PLC, the position, and the site of the statement that stopped or wrote.

    The site is NO_SITE for none.  `reasons` has a line for each of `breakpoints`, or one for something else that stopped the run,
    whose `kind` is then the name of an exception filter."""

    plc: str
    position: Position
    site: int
    breakpoints: tuple[Breakpoint, ...]
    reasons: tuple[str, ...]
    kind: str = ""


@dataclass(frozen=True)
class Said:
    """What a log point said: the PLC, the site of its statement, number and time of the scan."""

    plc: str
    site: int
    scan: int
    now_ns: int
    text: str
