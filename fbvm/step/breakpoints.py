"""Breakpoints and watches of a session: a line of a source, the beginning of a POU, a condition; what each stop prints."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from fbvm.base.types import fold
from fbvm.code.image import Site
from fbvm.machine.source_lines import find_line
from fbvm.record.trace.events import Statement
from fbvm.step.stepping import Stepping
from fbvm.watch.conditions import Condition, ConditionError, parse_condition, split_condition

Reached = Callable[[Statement | None], bool]
"""Called before each statement, and with None at the end of the program."""


@dataclass(frozen=True)
class Breakpoint:
    """`reached` returns True where execution stops; `is_condition` if that does not depend on the statement."""

    text: str
    reached: Reached
    is_condition: bool = False


@dataclass(frozen=True)
class Watched:
    """A variable, address or range that each stop prints, with a condition only where that holds."""

    name: str
    condition: Condition | None = None


def parse_breakpoint(text: str, session: Stepping, here: Site | None) -> Breakpoint:
    """The breakpoint that a text names: `15`, `pump.st:15`, `Pump`, `Pump IF Main.Count > 5`, `Main.Count > 5`.

    `here` is the current statement, in whose file a line number alone is.  Raises ValueError for a line behind the last
    statement, ConditionError for a text that is no condition."""
    image = session.facts.image
    where, when = split_condition(text)
    if where.isdecimal():
        where = f"{here.file if here else image.sites[0].file}:{where}"
    condition = parse_condition(when, session.find) if when else None
    if fold(where) not in {fold(body.name) for body in image.bodies}:
        try:
            stops = parse_condition(where, session.find)
        except ConditionError:
            if ":" not in where:
                raise
        else:
            holds = parse_condition(f"({where}) AND ({when})", session.find) if when else stops
            return Breakpoint(text, lambda statement: holds.holds(session.read), True)
    found, sites = find_line(image, where)
    if condition is None:
        return Breakpoint(found, lambda statement: statement is not None and statement.site in sites)
    guard = condition
    return Breakpoint(f"{found} IF {when}",
                      lambda statement: statement is not None and statement.site in sites and guard.holds(session.read))


def any_reached(breakpoints: Sequence[Breakpoint], statement: Statement | None) -> bool:
    """True if one of some breakpoints is reached."""
    return any(each.reached(statement) for each in breakpoints)


def first_reached(breakpoints: Sequence[Breakpoint], here: Statement | None) -> Reached:
    """A function for `Session.run` that stops at lines, and where conditions that did not hold before begin to hold.

    `here` is the statement at which the session stands."""
    held = [each.is_condition and each.reached(here) for each in breakpoints]

    def reached(statement: Statement | None) -> bool:
        now = [each.reached(statement) for each in breakpoints]
        stops = any(new and not old for new, old in zip(now, held, strict=True))
        held[:] = [new and each.is_condition for new, each in zip(now, breakpoints, strict=True)]
        return stops

    return reached
