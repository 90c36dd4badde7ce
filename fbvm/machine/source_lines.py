"""The statements that a place in a source means: a line, a POU, a rung of it, one of its instances, a method of one."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import NamedTuple

from fbvm.base.digits import whole_number
from fbvm.base.types import Field, StructType, fold
from fbvm.code.image import Image, Site
from fbvm.code.shapes import statements
from fbvm.engine.choice.stoppable import STATEMENTS

ACCESSORS = ("", ".Get", ".Set")
"""What follows the name of a POU in that of its statements: nothing, or of a property the accessor."""


class Lines(NamedTuple):
    """Where a breakpoint stops: its line as `FILE:LINE`, the numbers of the sites, and the offset of the only instance that
    counts, None for all."""

    where: str
    sites: frozenset[int]
    base: int | None = None


def find_lines(image: Image, where: str) -> Lines:
    """The statements that `where` means: all that `find_line` takes, `Main#3` for a rung, `Main.P1` for one instance,
    `Main.P1.Start` for a method or property of one instance.

    Raises ValueError."""
    pou, mark, number = where.rpartition("#")
    if mark and number.strip().isdecimal():
        return _rung(image, pou.strip(), whole_number(number), where)
    if "." in where and ":" not in where and (found := _of_instance(image, where.strip())):
        return found
    return Lines(*find_line(image, where))


def _rung(image: Image, pou: str, number: int, where: str) -> Lines:
    """The first statement of a rung, by its number in the POU."""
    mine = [rung for rung in image.rungs if not rung.is_text and fold(image.bodies[rung.body].name) == fold(pou)]
    for rung in mine:
        if rung.number == number:
            site = image.sites[rung.site]
            return Lines(f"{site.file}:{site.line}", frozenset((rung.site,)))
    known = f"rungs of {pou} are {mine[0].number} to {mine[-1].number}" if mine else f"{pou!r} has no rungs"
    raise ValueError(f"{where!r} is no rung; {known}")


def _of_instance(image: Image, where: str) -> Lines | None:
    """The first statements of an instance's own body, or of its method or property, None if a path names something else."""
    if found := _instance(image.symbols, where):
        kind, base = found
        return Lines(where, find_line(image, kind.name)[1], base)
    pous = {fold(site.pou) for site in _statements(image).values()}
    path, member = where, ""
    while "." in path and member.count(".") < 2:
        path, _, last = path.rpartition(".")
        member = f".{last.strip()}{member}"
        owner = _instance(image.symbols, path)
        if owner is not None and (pou := pou_of_member(owner[0], member, pous)):
            return Lines(where, find_line(image, pou)[1], owner[1])
    return None


def pou_of_member(kind: StructType, member: str, pous: Collection[str]) -> str:
    """The POU that an instance executes as its method or property `.Start`, its own or an inherited one; "" if there is none."""
    pou = f"{kind.name}{member}"
    if any(fold(f"{pou}{accessor}") in pous for accessor in ACCESSORS):
        return pou
    return next((found for parent in kind.parents if (found := pou_of_member(parent, member, pous))), "")


def _instance(symbols: Mapping[str, Field], path: str) -> tuple[StructType, int] | None:
    """The type and the offset of the instance that a path names, None if it names something else."""
    first, *names = path.strip().split(".")
    field, offset = symbols.get(fold(first)), 0
    for name in names:
        if field is None or not isinstance(field.type, StructType) or field.reference:
            return None
        offset, field = offset + field.offset, field.type.member(name.strip())
    if field is None or field.reference or not isinstance(field.type, StructType) or not field.type.block:
        return None
    return field.type, offset + field.offset


def find_line(image: Image, where: str) -> tuple[str, frozenset[int]]:
    """The line that `where` means, as `FILE:LINE`, and the numbers of the sites at which a breakpoint there stops.

    `where` is `FILE:LINE` (the next line with a statement, if that one has none; of the file's path its last parts are enough)
    or the name of a POU (the line of its first statement; of a property with two accessors there are two, and its name stands for
    them).  Of several statements on one line the first one counts, in each
    POU that has some there.  Raises ValueError, whose message names the files or POUs that there are."""
    file, colon, number = where.rpartition(":")
    statements = _statements(image)
    if colon and number.strip().isdecimal():
        inside = _of_file(statements, file.strip())
        line = _line_from(inside, whole_number(number), where)
    else:
        inside = _of_pou(statements, where.strip())
        sites = _first_of_each_pou(inside)
        places = {f"{inside[number].file}:{inside[number].line}" for number in sites}
        return places.pop() if len(places) == 1 else where.strip(), frozenset(sites)
    sites = _first_of_each_pou({number: site for number, site in inside.items() if site.line == line})
    return f"{image.sites[sites[0]].file}:{line}", frozenset(sites)


def _of_pou(statements: dict[int, Site], name: str) -> dict[int, Site]:
    """The statements of the POU of that name, or of both accessors of a property.  Raises ValueError if there are none."""
    named = {fold(f"{name}{accessor}") for accessor in ACCESSORS}
    inside = {number: site for number, site in statements.items() if fold(site.pou) in named}
    if not inside:
        pous = ", ".join(sorted({site.pou for site in statements.values() if site.pou}))
        raise ValueError(f"{name!r} is neither FILE:LINE nor a POU with statements; POUs are {pous or 'none'}")
    return inside


def _of_file(statements: dict[int, Site], path: str) -> dict[int, Site]:
    """The statements of the files whose paths end as `path` does, or with which `path` ends.  Raises ValueError."""
    inside = {number: site for number, site in statements.items()
              if f"/{site.file}".endswith(f"/{path}") or f"/{path}".endswith(f"/{site.file}")}  # fmt: skip
    if not inside:
        files = ", ".join(sorted({site.file for site in statements.values()}))
        raise ValueError(f"no statement is in {path!r}; files are {files or 'none'}")
    return inside


def _line_from(statements: dict[int, Site], line: int, where: str) -> int:
    """The first line from `line` on that has a statement.  Raises ValueError behind the last one."""
    lines = {site.line for site in statements.values()}
    following = [other for other in lines if other >= line]
    if not following:
        raise ValueError(f"{where}: the last statement of {where.rpartition(':')[0]} is on line {max(lines)}")
    return min(following)


def _first_of_each_pou(statements: dict[int, Site]) -> list[int]:
    """Of some statements the first one of each POU, by the numbers of their sites."""
    first: dict[tuple[str, str], tuple[int, int]] = {}
    for site in statements.values():
        pou, place = (site.file, site.pou), (site.line, site.column)
        first[pou] = min(place, first.get(pou, place))
    return [number for number, site in statements.items() if (site.line, site.column) == first[site.file, site.pou]]


def _statements(image: Image) -> dict[int, Site]:
    """The places of all statements, by the numbers of their sites."""
    return {node[2]: image.sites[node[2]] for body in image.bodies for node in statements(body.code)
            if node[0] == "observe" and node[1] in STATEMENTS}  # fmt: skip


