"""Breakpoints and watches of the language of stepping: lines, POUs, conditions, changes; what each stop prints."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from fbvm.base.types import fold
from fbvm.code.image import Site
from fbvm.machine import breakpoints as machine
from fbvm.machine.breakpoints import BreakpointRows
from fbvm.machine.source_lines import find_lines
from fbvm.record.trace.events import Statement
from fbvm.step.stepping import Stepping
from fbvm.watch.conditions import Condition, ConditionError, parse_condition, split_condition
from fbvm.watch.paths import UnknownPlace

_LINE = re.compile(r".*:\s*\d+|[\w.]+#\d+")
"""FILE:LINE, or a rung."""
Reached = Callable[[Statement | None], bool]
"""Called before each statement, and with None at the end of the program."""


@dataclass(frozen=True)
class Breakpoint:
    """Where one move ends: `reached` returns True there."""

    text: str
    reached: Reached


@dataclass(frozen=True)
class Watched:
    """A variable, address or range that each stop prints, with a condition only where that holds."""

    name: str
    condition: Condition | None = None


def parse_breakpoint(text: str, session: Stepping, here: Site | None) -> Breakpoint:
    """The breakpoint that a text names: `15`, `pump.st:15`, `Pump`, `Main.P1.Start`, `Pump IF Main.Count > 5`, `Main.Count > 5`.

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
            if ":" not in where and not _is_line(where, session):
                raise
        else:
            holds = parse_condition(f"({where}) AND ({when})", session.find) if when else stops
            return Breakpoint(text, lambda statement: holds.holds(session.read))
    found = find_lines(image, where)

    def reached(statement: Statement | None) -> bool:
        return (statement is not None and statement.site in found.sites and found.base in (None, statement.frame.base)
                and (condition is None or condition.holds(session.read)))  # fmt: skip

    return Breakpoint(f"{found.where} IF {when}" if when else found.where, reached)


def any_reached(breakpoints: Sequence[Breakpoint], statement: Statement | None) -> bool:
    """True if one of some breakpoints is reached."""
    return any(each.reached(statement) for each in breakpoints)


def parse_row(text: str, session: Stepping, here: Site | None) -> machine.Breakpoint:
    """A breakpoint: what `parse_breakpoint` takes, a rung (`Main#3`), or what is watched for changes (`D200`, `Main.Count`,
    `D200..D209`); behind IF a condition, behind HITS a hit count.

    Raises ValueError, UnknownPlace or ConditionError."""
    at = text.upper().find(" HITS ")
    front, hits = (text, "") if at < 0 else (text[:at], text[at + len(" HITS ") :])
    where, when = split_condition(front)
    facts = session.facts
    if where.isdecimal():
        where = f"{here.file if here else facts.sites[0].file}:{where}"
    kind = "line"
    if fold(where) not in {fold(body.name) for body in facts.image.bodies}:
        kind = _kind_of(where, session)
    if kind == "condition" and when:
        where, when = f"({where}) AND ({when})", ""
    return BreakpointRows(session.player, facts.image).put(machine.Breakpoint(kind, where, when, hits.strip()))


def _kind_of(where: str, session: Stepping) -> str:
    """"condition" for a condition, "change" for a variable or address that is none, "line" for a line, a rung or an instance."""
    try:
        parse_condition(where, session.find)
    except ConditionError as error:
        if _LINE.fullmatch(where) or _is_line(where, session):
            return "line"
        try:
            session.find(where)
        except UnknownPlace:
            raise error from None
        return "change"
    return "condition"


def _is_line(where: str, session: Stepping) -> bool:
    """Whether a text names statements: a line, a rung, an instance, a method of one."""
    try:
        find_lines(session.facts.image, where)
    except ValueError:
        return False
    return True
