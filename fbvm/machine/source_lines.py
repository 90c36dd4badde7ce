"""The statements that a place in a source means: a line, a POU, a rung of it, one of its instances."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from fbvm.base.digits import whole_number
from fbvm.base.types import Field, StructType, fold
from fbvm.code.image import Image, Site
from fbvm.code.shapes import statements
from fbvm.engine.choice.stoppable import STATEMENTS


class Lines(NamedTuple):
    """Where a breakpoint stops: its line as `FILE:LINE`, the numbers of the sites, and the offset of the only instance that
    counts, None for all."""

    where: str
    sites: frozenset[int]
    base: int | None = None


def find_lines(image: Image, where: str) -> Lines:
    """The statements that `where` means: all that `find_line` takes, `Main#3` for a rung, `Main.P1` for one instance.

    Raises ValueError."""
    pou, mark, number = where.rpartition("#")
    if mark and number.strip().isdecimal():
        return _rung(image, pou.strip(), whole_number(number), where)
    if "." in where and ":" not in where and (found := _instance(image.symbols, where)):
        kind, base = found
        _, sites = find_line(image, kind)
        return Lines(where.strip(), sites, base)
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


def _instance(symbols: Mapping[str, Field], path: str) -> tuple[str, int] | None:
    """The POU and the offset of the instance that a path names, None if it names something else."""
    first, *names = path.strip().split(".")
    field, offset = symbols.get(fold(first)), 0
    for name in names:
        if field is None or not isinstance(field.type, StructType) or field.reference:
            return None
        offset, field = offset + field.offset, field.type.member(name.strip())
    if field is None or field.reference or not isinstance(field.type, StructType) or not field.type.block:
        return None
    return field.type.name, offset + field.offset


def find_line(image: Image, where: str) -> tuple[str, frozenset[int]]:
    """The line that `where` means, as `FILE:LINE`, and the numbers of the sites at which a breakpoint there stops.

    `where` is `FILE:LINE` (the next line with a statement, if that one has none; of the file's path its last parts are enough)
    or the name of a POU (the line of its first statement).  Of several statements on one line the first one counts, in each
    POU that has some there.  Raises ValueError, whose message names the files or POUs that there are."""
    file, colon, number = where.rpartition(":")
    statements = _statements(image)
    if colon and number.strip().isdecimal():
        inside = _of_file(statements, file.strip())
        line = _line_from(inside, whole_number(number), where)
    else:
        inside = _of_pou(statements, where.strip())
        line = min(site.line for site in inside.values())
    sites = _first_of_each_pou({number: site for number, site in inside.items() if site.line == line})
    return f"{image.sites[sites[0]].file}:{line}", frozenset(sites)


def _of_pou(statements: dict[int, Site], name: str) -> dict[int, Site]:
    """The statements of the POU of that name.  Raises ValueError if there are none."""
    inside = {number: site for number, site in statements.items() if fold(site.pou) == fold(name)}
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
    """Of statements on one line the first one of each POU, by the numbers of their sites."""
    columns: dict[tuple[str, str], int] = {}
    for site in statements.values():
        pou = site.file, site.pou
        columns[pou] = min(site.column, columns.get(pou, site.column))
    return [number for number, site in statements.items() if site.column == columns[site.file, site.pou]]


def _statements(image: Image) -> dict[int, Site]:
    """The places of all statements, by the numbers of their sites."""
    return {node[2]: image.sites[node[2]] for body in image.bodies for node in statements(body.code)
            if node[0] == "observe" and node[1] in STATEMENTS}  # fmt: skip


