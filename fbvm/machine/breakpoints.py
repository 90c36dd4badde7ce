"""Breakpoints of one PLC: at a line, at a change of a variable or an address, where a condition holds.

A scan that meets one stands still there, with the memory as it is at that moment; the next `Plc.scan` or `Plc.run` goes
on.  Runs keep their speed: machine code looks into a table, and only the scan that stops is done again in Python."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

from fbvm.base.types import fold
from fbvm.code.image import Image, Site
from fbvm.code.shapes import statements
from fbvm.engine.guarded import STATEMENTS, Guarded
from fbvm.engine.python.runtime import NO_SITE
from fbvm.engine.stops import Line, Stops, Test, Watched
from fbvm.engine.tiers import Engine, choice_of, substitutes_of
from fbvm.engine.trap import Trap
from fbvm.watch.changes import changed
from fbvm.watch.conditions import Condition, parse_condition
from fbvm.watch.names import Names
from fbvm.watch.paths import Place, Span
from fbvm.watch.values import Value, show

if TYPE_CHECKING:
    from fbvm.machine.plc import Plc


@dataclass(frozen=True)
class Breakpoint:
    """What may stop a scan: a line of a source, a change of a place, or a condition; `when` is a further condition."""

    kind: str
    """"line", "change" or "condition"."""
    where: str
    when: str = ""

    def __str__(self) -> str:
        return self.where + (f" when {self.when}" if self.when else "")


@dataclass(frozen=True)
class Frame:
    """A body in execution: name of the POU, byte where its instance begins, the statement that it is at."""

    pou: str
    base: int
    site: Site | None


@dataclass(frozen=True, eq=False)
class Halt:
    """A scan that stands still: in which scan, before or in which statement, why, and who called whom.

    `site` is None at the end of a program; in `frames` the innermost body comes first."""

    scan: int
    site: Site | None
    reasons: tuple[str, ...]
    breakpoints: tuple[Breakpoint, ...]
    frames: tuple[Frame, ...]

    def __str__(self) -> str:
        place = str(self.site) if self.site else f"end of {self.frames[-1].pou}"
        return f"{place}, scan {self.scan}: {'; '.join(self.reasons)}"


class Breakpoints:
    """The breakpoints of a PLC, in the order in which they were set."""

    def __init__(self, plc: Plc) -> None:
        self._plc = plc
        self._rows: dict[Breakpoint, Line | Watched] = {}
        self._stops = Stops(plc.memory, len(plc.image.sites))
        self._guarded: Guarded | None = None
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
        """Stops before the statement of a line: `pump.st:12`; the next one if that line has none; or the first
        statement of a POU by its name.  Raises ValueError for what is not there."""
        found, sites = find_line(self._plc.image, where)
        condition = self._condition(when)
        return self._put(Breakpoint("line", found, when), Line(sites, self._test(condition)))

    def change(self, where: str, when: str = "") -> Breakpoint:
        """Stops behind the statement that changed a variable, an address or a range, as `Plc.find` takes them.

        What changed between scans is found at the first statement of the next."""
        found = self._plc.find(where)
        condition = self._condition(when)
        extents, mask = _extents(found)
        row = Watched(extents, mask, test=self._test(condition), read=lambda: self._plc.read(found))
        return self._put(Breakpoint("change", where, when), row)

    def condition(self, when: str) -> Breakpoint:
        """Stops as soon as a condition becomes TRUE: `n > 5 AND D100 = 0`."""
        condition = self._condition(when)
        assert condition is not None
        extents: list[tuple[int, int]] = [run for place in condition.places for run in _extents(place)[0]]
        return self._put(Breakpoint("condition", when), Watched(extents, test=self._test(condition), edge=True))

    def remove(self, breakpoint: Breakpoint) -> None:
        """Takes one away.  Raises KeyError if it is not set."""
        del self._rows[breakpoint]
        self._stops.put(self._rows.values())

    def clear(self) -> None:
        """Takes all away."""
        self._rows.clear()
        self._stops.put(())

    def _put(self, breakpoint: Breakpoint, row: Line | Watched) -> Breakpoint:
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
        """Executes a task in place of an engine, or goes on with it, up to its end, a trap or a stop."""
        if self.halted and self._guarded:
            self.halted = None
            guarded = self._guarded
            trap = guarded.go_on()
        else:
            guarded = self.guarding(engine)
            trap = guarded.run(task_index)
        if guarded.seen:
            self.halted = self._halt(guarded, guarded.seen.site)
        return trap

    def guarding(self, engine: Engine) -> Guarded:
        """What runs in place of an engine."""
        substitutes = substitutes_of(engine)
        if self._guarded is None or self._stands_in != (engine, substitutes):
            plc = self._plc
            self._guarded = Guarded(plc.image, plc.memory, self._stops, choice_of(engine), substitutes)
            self._stands_in = engine, dict(substitutes)
        return self._guarded

    def leave(self) -> None:
        """The scan that stands will not go on."""
        self.halted = None

    def _halt(self, guarded: Guarded, site: int) -> Halt:
        image = self._plc.image
        frames, at = [], site
        for call in reversed(guarded.calls):
            frames.append(Frame(image.bodies[call.body].name, call.base, None if at == NO_SITE else image.sites[at]))
            at = call.site
        rows = [(said, row) for said, row in self._rows.items() if row in self._stops.reasons]
        reasons = [self._reason(said, row) for said, row in rows]
        return Halt(self._plc.scans, frames[0].site, tuple(reasons), tuple(said for said, _ in rows), tuple(frames))

    def _reason(self, said: Breakpoint, row: Line | Watched) -> str:
        if isinstance(row, Watched) and said.kind == "change":
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
    """The line that `FILE:LINE` or the name of a POU means, and the sites of its statements.

    Of several statements on one line the first one counts.  Raises ValueError."""
    file, colon, number = where.rpartition(":")
    rows = _statements(image)
    if not colon or not number.strip().isdecimal():
        inside = {site: place for site, place in rows.items() if fold(place.pou) == fold(where.strip())}
        if not inside:
            pous = ", ".join(sorted({place.pou for place in rows.values() if place.pou}))
            raise ValueError(f"{where!r} is neither FILE:LINE nor a POU with statements; POUs are {pous or 'none'}")
        rows, line = inside, min(place.line for place in inside.values())
    else:
        named = {place.file for place in rows.values() if f"/{place.file}".endswith(f"/{file.strip()}")
                 or f"/{file.strip()}".endswith(f"/{place.file}")}  # fmt: skip
        if not named:
            files = ", ".join(sorted({place.file for place in rows.values()}))
            raise ValueError(f"no statement is in {file!r}; files are {files or 'none'}")
        rows = {site: place for site, place in rows.items() if place.file in named}
        lines = [place.line for place in rows.values() if place.line >= int(number)]
        if not lines:
            last = max(place.line for place in rows.values())
            raise ValueError(f"{where}: the last statement of {file} is on line {last}")
        line = min(lines)
    here = {site: place for site, place in rows.items() if place.line == line}
    first = {(place.file, place.pou): min(other.column for other in here.values()
                                          if (other.file, other.pou) == (place.file, place.pou))
             for place in here.values()}  # fmt: skip
    sites = [site for site, place in here.items() if place.column == first[place.file, place.pou]]
    return f"{image.sites[sites[0]].file}:{line}", frozenset(sites)


def _statements(image: Image) -> dict[int, Site]:
    """The sites at which a statement is observed."""
    return {node[2]: image.sites[node[2]] for body in image.bodies for node in statements(body.code)
            if node[0] == "observe" and node[1] in STATEMENTS}  # fmt: skip


def _extents(found: Place | Span) -> tuple[list[tuple[int, int]], int]:
    """The bytes of what is watched, and of a bit its mask."""
    places = found.places if isinstance(found, Span) else (found,)
    for place in places:
        if place.hops:
            raise ValueError(f"{place.name} lies behind a reference, which may change: watch what it points to")
    if isinstance(found, Place) and found.bit is not None:
        return [(found.offset, 1)], 1 << found.bit
    return [(place.offset, max(1, place.type.size)) for place in places], 0
