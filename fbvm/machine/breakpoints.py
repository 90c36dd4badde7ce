"""Breakpoints of one PLC: at a line, at a change of a variable or an address, where a condition holds.

A scan that meets one stands still there, with the memory as it is at that moment; the next `Plc.scan` or `Plc.run` goes
on.  Runs keep the speed of machine code, which looks into a table; only the scan that stops is done again in Python."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol, cast

from fbvm.base.digits import whole_number
from fbvm.base.memory import Memory
from fbvm.base.types import fold
from fbvm.code.image import Image, Site
from fbvm.code.shapes import statements
from fbvm.engine.choice.stoppable import STATEMENTS, StoppableEngine
from fbvm.engine.choice.tiers import Engine, choice_of, substitutes_of
from fbvm.engine.observation import NO_SITE
from fbvm.engine.stops import LineStop, StopTable, Test, Watchpoint
from fbvm.engine.trap import Trap
from fbvm.watch.changes import changed
from fbvm.watch.conditions import Condition, parse_condition
from fbvm.watch.names import Names
from fbvm.watch.paths import Place, Span
from fbvm.watch.values import Value, show


class Stoppable(Protocol):
    """What breakpoints see of their PLC; a `Plc` has it."""

    image: Image
    memory: Memory
    engine: Engine
    scans: int

    def find(self, text: str) -> Place | Span: ...

    def read(self, where: str | Place | Span) -> Value: ...


@dataclass(frozen=True)
class Breakpoint:
    """What stops a scan: a line of a source, a change of a variable or address, or a condition; `when` is a further condition."""

    kind: str
    """"line", "change" or "condition"."""
    where: str
    """The line ("main.st:12"), the variable or address, or the condition."""
    when: str = ""
    """A further condition, such as "D100 > 5"; "" for none."""

    def __str__(self) -> str:
        return self.where + (f" when {self.when}" if self.when else "")


@dataclass(frozen=True)
class Frame:
    """The execution of one body in a scan that stands at a breakpoint."""

    pou: str
    """The name of the program, function block or function."""
    base: int
    """Byte of the memory at which its instance begins."""
    site: Site | None
    """The statement that it is at; None at its end."""


@dataclass(frozen=True, eq=False)
class Halt:
    """A scan that stands still at a breakpoint."""

    scan: int
    """The number of the scan, counted from 0 since power-on."""
    site: Site | None
    """The statement before or in which it stands; None at the end of a program."""
    reasons: tuple[str, ...]
    """Why it stands, one line for each of `breakpoints`."""
    breakpoints: tuple[Breakpoint, ...]
    """The breakpoints that stopped it, in the order in which they were set."""
    frames: tuple[Frame, ...]
    """The bodies in execution, the innermost first."""

    def __str__(self) -> str:
        place = str(self.site) if self.site else f"end of {self.frames[-1].pou}"
        return f"{place}, scan {self.scan}: {'; '.join(self.reasons)}"


class Breakpoints:
    """The breakpoints of a PLC, in the order in which they were set."""

    def __init__(self, plc: Stoppable) -> None:
        self._plc = plc
        self._rows: dict[Breakpoint, LineStop | Watchpoint] = {}
        self._stops = StopTable(plc.memory, len(plc.image.sites))
        self._stoppable: StoppableEngine | None = None
        self._stands_in: tuple[object, object] = None, None
        self.halted: Halt | None = None
        """Where the scan stands, if one does."""

    def __iter__(self) -> Iterator[Breakpoint]:
        return iter(self._rows)

    def __len__(self) -> int:
        return len(self._rows)

    @property
    def armed(self) -> bool:
        """True if a scan could stop, or stands."""
        return bool(self._rows) or self.halted is not None

    # --- setting ------------------------------------------------------------------------------------------------------

    def line(self, where: str, when: str = "") -> Breakpoint:
        """Stops before a statement.

        `where` is `pump.st:12` (the next statement if that line has none) or the name of a POU (its first statement); `when` is
        a condition as `Plc.run` takes it.  Raises ValueError if there is no such line or POU, or if the PLC is observed."""
        found, sites = find_line(self._plc.image, where)
        condition = self._condition(when)
        return self._put(Breakpoint("line", found, when), LineStop(sites, self._test(condition)))

    def change(self, where: str, when: str = "") -> Breakpoint:
        """Stops behind the statement that changed a variable, an address or a range of addresses (as `Plc.find` takes them).

        A change between two scans is found at the first statement of the second.  Raises UnknownPlace, ValueError for what
        lies behind a reference or if the PLC is observed."""
        found = self._plc.find(where)
        condition = self._condition(when)
        extents, mask = _extents(found)
        row = Watchpoint(extents, mask, test=self._test(condition), read=lambda: self._plc.read(found))
        return self._put(Breakpoint("change", where, when), row)

    def condition(self, when: str) -> Breakpoint:
        """Stops behind the statement that makes a condition TRUE: `n > 5 AND D100 = 0`.  Raises ValueError as `change` does."""
        condition = self._condition(when)
        assert condition is not None
        extents: list[tuple[int, int]] = [run for place in condition.places for run in _extents(place)[0]]
        return self._put(Breakpoint("condition", when), Watchpoint(extents, test=self._test(condition), edge=True))

    def remove(self, breakpoint: Breakpoint) -> None:
        """Removes a breakpoint.  Raises KeyError if it is not set."""
        del self._rows[breakpoint]
        self._stops.put(self._rows.values())

    def clear(self) -> None:
        """Removes all breakpoints; a scan that stands goes on all the same with the next `Plc.scan`."""
        self._rows.clear()
        self._stops.put(())

    def _put(self, breakpoint: Breakpoint, row: LineStop | Watchpoint) -> Breakpoint:
        choice_of(self._plc.engine)
        self._rows[breakpoint] = row
        self._stops.put(self._rows.values())
        return breakpoint

    def _condition(self, text: str) -> Condition | None:
        return parse_condition(text, self._plc.find) if text else None

    def _test(self, condition: Condition | None) -> Test | None:
        return (lambda: condition.holds(self._plc.read)) if condition else None

    # --- running, for the PLC -----------------------------------------------------------------------------------------

    def run(self, task_index: int, engine: Engine) -> Trap | None:
        """Executes a task as `engine` would, or goes on with a task that stands, up to its end, a trap or a stop (`halted`)."""
        if self.halted and self._stoppable:
            self.halted = None
            stoppable = self._stoppable
            trap = stoppable.go_on()
        else:
            stoppable = self.stoppable(engine)
            stoppable.allow(engine.allowance)
            trap = stoppable.run(task_index)
        if stoppable.seen:
            self.halted = self._halt(stoppable, stoppable.seen.site)
        return trap

    def stoppable(self, engine: Engine) -> StoppableEngine:
        """The engine with breakpoints that runs in place of `engine`."""
        substitutes = substitutes_of(engine)
        if self._stoppable is None or self._stands_in != (engine, substitutes):
            plc = self._plc
            self._stoppable = StoppableEngine(plc.image, plc.memory, self._stops, choice_of(engine), substitutes)
            self._stands_in = engine, dict(substitutes)
        return self._stoppable

    def leave(self) -> None:
        """Gives up the scan that stands."""
        self.halted = None

    def _halt(self, stoppable: StoppableEngine, site: int) -> Halt:
        image = self._plc.image
        frames, at = [], site
        for call in reversed(stoppable.calls):
            frames.append(Frame(image.bodies[call.body].name, call.base, None if at == NO_SITE else image.sites[at]))
            at = call.site
        rows = [(said, row) for said, row in self._rows.items() if row in self._stops.reasons]
        reasons = [self._reason(said, row) for said, row in rows]
        return Halt(self._plc.scans, frames[0].site, tuple(reasons), tuple(said for said, _ in rows), tuple(frames))

    def _reason(self, said: Breakpoint, row: LineStop | Watchpoint) -> str:
        if isinstance(row, Watchpoint) and said.kind == "change":
            whole = self._plc.find(said.where)
            found, before, after = changed(whole, cast(Value, row.before), cast(Value, row.value))
            name = said.where if found is whole else found.name
            return f"{name} was {self._shown(found, before)}, is {self._shown(found, after)}"
        return f"{said.where} holds" if said.kind == "condition" else f"breakpoint {said}"

    def _shown(self, found: Place | Span, value: Value) -> str:
        image = self._plc.image
        names = Names.of(image, self._plc.memory.areas)
        return show(found.type, names.name_references(found.type, value)) if isinstance(found, Place) else str(value)


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


def _extents(found: Place | Span) -> tuple[list[tuple[int, int]], int]:
    """The (offset, size) of what is watched, and the mask if that is a bit.  Raises ValueError behind a reference."""
    places = found.places if isinstance(found, Span) else (found,)
    for place in places:
        if place.hops:
            raise ValueError(f"{place.name} lies behind a reference, which may change: watch what it points to")
    if isinstance(found, Place) and found.bit is not None:
        return [(found.offset, 1)], 1 << found.bit
    return [(place.offset, max(1, place.type.size)) for place in places], 0
