"""A project in parts that run apart, each with some of its equal PLCs: for fleets that are too large for one process."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from ipaddress import IPv4Address

from fbvm.run.project import PlcRow, Project


def shards_of(project: Project, count: int) -> list[Project]:
    """A project in so many parts at most: of PLCs with a `count` each has as many as the others, all others are in the first one.

    Names, addresses and seeds are those of the whole project.  A part has the doors of its own units; those of the others it
    reaches where they are on the host, as far as these say an address."""
    parts = [replace(project, plcs=tuple(_rows(project, number, count)), pictures=()) for number in range(count)]
    return [_with_doors(project, part) for part in parts if part.plcs]


def _rows(project: Project, number: int, count: int) -> Iterator[PlcRow]:
    for row in project.plcs:
        if row.count is None:
            if not number:
                yield row
            continue
        first, last = (row.count * bound // count for bound in (number, number + 1))
        if first < last:
            yield replace(row, count=last - first, first=row.first + first)


def addresses_of(row: PlcRow) -> set[str]:
    """The addresses of all units of a row."""
    return {str(IPv4Address(unit.address) + number) for unit in row.units
            for number in range(row.first - 1, row.first - 1 + (row.count or 1))}  # fmt: skip


def _with_doors(project: Project, part: Project) -> Project:
    own = set().union(*map(addresses_of, part.plcs))
    elsewhere = tuple((unit, real) for unit, real in project.doors if unit.host not in own and real[0] != "0.0.0.0" and real[1])
    return replace(part, doors=tuple(door for door in project.doors if door[0].host in own),
                   backlog=frozenset(unit for unit in project.backlog if unit.host in own),
                   servers=project.servers + elsewhere if part.net == "tcp" else project.servers)  # fmt: skip
