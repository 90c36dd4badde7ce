"""Breakpoints of a session: a line of a source, the beginning of a POU, or a condition."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fbvm.base.types import fold
from fbvm.code.image import Site
from fbvm.machine.breakpoints import find_line
from fbvm.record.trace.events import Statement
from fbvm.step.session import Session
from fbvm.watch.conditions import parse_condition


@dataclass(frozen=True)
class Breakpoint:
    """`reached` is called before each statement, and with None at the end of the program; True stops execution."""

    text: str
    reached: Callable[[Statement | None], bool]


def parse_breakpoint(text: str, session: Session, here: Site | None) -> Breakpoint:
    """The breakpoint that a text names: `15`, `pump.st:15`, `Pump`, `Main.Count > 5`.

    `here` is the current statement, in whose file a line number alone is.  Raises ValueError for a line behind the last
    statement, ConditionError for a text that is no condition."""
    image = session.plc.image
    if text.isdecimal():
        text = f"{here.file if here else image.sites[0].file}:{text}"
    if ":" not in text and fold(text) not in {fold(body.name) for body in image.bodies}:
        condition = parse_condition(text, session.find)
        return Breakpoint(text, lambda statement: condition.holds(session.read))
    found, sites = find_line(image, text)
    return Breakpoint(found, lambda statement: statement is not None and statement.site in sites)
