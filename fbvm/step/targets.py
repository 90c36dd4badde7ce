"""Where to go: a line of a source, the beginning of a POU, or a condition that becomes true."""

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
class Target:
    """`reached` is asked before each statement, and at the end of the program with None."""

    text: str
    reached: Callable[[Statement | None], bool]


def target(text: str, session: Session, here: Site | None) -> Target:
    """The target that a text names; a line without a file is one of the file where the program stands.

    Raises ValueError for a line behind the last statement, ConditionError for what is no condition."""
    image = session.plc.image
    if text.isdecimal():
        text = f"{here.file if here else image.sites[0].file}:{text}"
    if ":" not in text and fold(text) not in {fold(body.name) for body in image.bodies}:
        condition = parse_condition(text, session.find)
        return Target(text, lambda statement: condition.holds(session.read))
    found, sites = find_line(image, text)
    return Target(found, lambda statement: statement is not None and statement.site in sites)
