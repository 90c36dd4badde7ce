"""Where to go: a line of a source, the beginning of a POU, or a condition that becomes true."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from fbvm.base.types import fold
from fbvm.code.image import Image, Site
from fbvm.record.branches import statements
from fbvm.record.inside import Statement
from fbvm.step.session import Session
from fbvm.watch.conditions import parse_condition

_LINE = re.compile(r"(?:(.+?):)?(\d+)")


@dataclass(frozen=True)
class Target:
    """`reached` is asked before each statement, and at the end of the program with None."""

    text: str
    reached: Callable[[Statement | None], bool]


def target(text: str, session: Session, here: Site | None) -> Target:
    """The target that a text names; a line without a file is one of the file where the program stands.

    Raises ValueError for a line that holds no statement, ConditionError and UnknownPlace for what is no condition."""
    image = session.plc.image
    if match := _LINE.fullmatch(text):
        return _line(image, match[1] or (here.file if here else ""), int(match[2]))
    for body in image.bodies:
        if fold(body.name) == fold(text):
            return _first(image, body.name)
    condition = parse_condition(text, session.find)
    return Target(text, lambda statement: condition.holds(session.read))


def _first(image: Image, pou: str) -> Target:
    """The first statement of a POU."""
    mine = [site for site in statements(image) if image.sites[site].pou == pou]
    if not mine:
        raise ValueError(f"{pou} has no statement")
    first = min(mine, key=lambda site: (image.sites[site].line, image.sites[site].column))
    return Target(pou, lambda statement: statement is not None and statement.site == first)


def _line(image: Image, file: str, line: int) -> Target:
    rows = {number: site for number in statements(image) if (site := image.sites[number])
            and (not file or site.file == file or site.file.endswith(f"/{file}"))}  # fmt: skip
    if not rows:
        raise ValueError(f"no statement stands in a file {file}")
    chosen = {number for number, site in rows.items() if site.line == line}
    if not chosen:
        nearest = min((site.line for site in rows.values()), key=lambda other: (abs(other - line), other))
        raise ValueError(f"no statement begins on line {line} of {file}; one does on line {nearest}")
    name = next(iter(rows.values())).file.rpartition("/")[2]
    return Target(f"{name}:{line}", lambda statement: statement is not None and statement.site in chosen)
