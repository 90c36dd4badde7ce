"""Breakpoints of one PLC: at a line, at a change of a variable or an address, where a condition holds.

A scan that meets one stands still there, with the memory as it is at that moment; the next `Plc.scan` or `Plc.run` goes
on.  Runs keep the speed of machine code, which looks into a table; only the scan that stops is done again in Python."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, cast

from fbvm.base.memory import Memory
from fbvm.base.types import Field, StructType, derives, fold
from fbvm.code.image import Image, Site
from fbvm.engine.choice.stoppable import StoppableEngine
from fbvm.engine.choice.tiers import Engine, choice_of, substitutes_of
from fbvm.engine.observation import NO_SITE
from fbvm.engine.stops import LineStop, LineTest, State, StopTable, Test, Told, Watchpoint
from fbvm.engine.trap import Trap
from fbvm.machine.messages import parse_message
from fbvm.machine.passes import parse_passes
from fbvm.machine.source_lines import Lines, find_lines
from fbvm.watch.changes import changed
from fbvm.watch.conditions import Condition, parse_condition
from fbvm.watch.names import Names
from fbvm.watch.paths import Place, Span
from fbvm.watch.scopes import Scope, instances, place_of
from fbvm.watch.values import Value, show


class Inspected(Protocol):
    """What breakpoints see of their PLC; a `Plc` has it, and so has one that is past."""

    memory: Memory

    def find(self, text: str) -> Place | Span: ...

    def read(self, where: str | Place | Span) -> Value: ...


class Stoppable(Inspected, Protocol):
    """A PLC that stops at breakpoints."""

    image: Image
    engine: Engine
    scans: int


@dataclass(frozen=True)
class Breakpoint:
    """What stops a scan: a line of a source, a change of a variable or address, or a condition; `when` is a further condition."""

    kind: str
    """"line", "change", "condition" or "statement"."""
    where: str
    """The line ("main.st:12"), the variable or address, or the condition."""
    when: str = ""
    """A further condition, such as "D100 > 5"; "" for none."""
    hits: str = ""
    """At which passes it stops, as `parse_passes` takes it; "" for all."""
    message: str = ""
    """What a log point tells instead of stopping; "" for a breakpoint."""

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
    task: int = 0
    """The number of the task in the image."""
    statement: int = 0
    """How many statements and rungs this task has begun before in this scan."""

    def __str__(self) -> str:
        place = str(self.site) if self.site else f"end of {self.frames[-1].pou}"
        return f"{place}, scan {self.scan}: {'; '.join(self.reasons)}"


class BreakpointRows:
    """The breakpoints of a PLC with this image, in the order in which they were set, and whether one is reached.

    `plc` is what conditions read."""

    def __init__(self, plc: Inspected, image: Image) -> None:
        self._inspected, self._image = plc, image
        self._rows: dict[Breakpoint, LineStop | Watchpoint] = {}
        self._watched: dict[Breakpoint, Place | Span] = {}
        """What breakpoints of kind "change" watch."""
        self._memory = plc.memory
        self._table: StopTable | None = None

    @property
    def _stops(self) -> StopTable:
        """What machine code looks into: made when it is needed, since most PLCs never have a breakpoint."""
        if self._table is None:
            self._table = StopTable(self._memory, len(self._image.sites))
        return self._table

    @cached_property
    def _names(self) -> Names:
        return Names.of(self._image, self._image.layout.areas)

    def __iter__(self) -> Iterator[Breakpoint]:
        return iter(self._rows)

    def __len__(self) -> int:
        return len(self._rows)

    # --- setting ------------------------------------------------------------------------------------------------------

    def line(self, where: str, when: str = "", hits: str = "", message: str = "") -> Breakpoint:
        """Stops before a statement.

        `where` is `pump.st:12` (the next statement if that line has none), the name of a POU (its first statement), `Main#3` for
        a rung or `Main.P1` for one instance; `when` is a condition as `Plc.run` takes it, in which variables of the POU need no
        path; `hits` says at which passes it stops (see `parse_passes`).  With a `message` such as "n is {n}" it does not stop:
        `take_told` returns what it told.  Raises ValueError if there is no such line or POU, or if the PLC is observed."""
        lines = find_lines(self._image, where)
        test = self._line_test(lines, when)
        if lines.base is not None:
            test = _of_instance(lines.base, test)
        row = LineStop(lines.sites, test, parse_passes(hits), self._message(lines, message))
        return self._put(Breakpoint("line", lines.where, when, hits, message), row)

    def change(self, where: str | Place, when: str = "", hits: str = "") -> Breakpoint:
        """Stops behind the statement that changed a variable, an address or a range of addresses (as `Plc.find` takes them).

        A change between two scans is found at the first statement of the second.  Raises UnknownPlace, ValueError for what
        lies behind a reference or if the PLC is observed."""
        found = self._inspected.find(where) if isinstance(where, str) else where
        condition = self._condition(when)
        extents, mask = _extents(found)
        row = Watchpoint(extents, mask, test=self._test(condition), read=lambda: self._inspected.read(found),
                         wanted=parse_passes(hits))  # fmt: skip
        said = Breakpoint("change", where if isinstance(where, str) else where.name, when, hits)
        self._watched[said] = found
        return self._put(said, row)

    def condition(self, when: str, hits: str = "") -> Breakpoint:
        """Stops behind the statement that makes a condition TRUE: `n > 5 AND D100 = 0`.  Raises ValueError as `change` does."""
        condition = parse_condition(when, self._inspected.find)
        extents: list[tuple[int, int]] = [run for place in condition.places for run in _extents(place)[0]]
        row = Watchpoint(extents, test=self._test(condition), edge=True, wanted=parse_passes(hits))
        return self._put(Breakpoint("condition", when, "", hits), row)

    def statement(self) -> Breakpoint:
        """Stops before every statement and rung of every POU."""
        row = LineStop(frozenset(range(len(self._image.sites))))
        return self._put(Breakpoint("statement", "the next statement"), row)

    def put(self, breakpoint: Breakpoint) -> Breakpoint:
        """Sets the same breakpoint as on another PLC with this image.  Raises as the method for its kind."""
        if breakpoint.kind == "line":
            return self.line(breakpoint.where, breakpoint.when, breakpoint.hits, breakpoint.message)
        if breakpoint.kind == "statement":
            return self.statement()
        if breakpoint.kind == "change":
            return self.change(breakpoint.where, breakpoint.when, breakpoint.hits)
        return self.condition(breakpoint.where, breakpoint.hits)

    def remove(self, breakpoint: Breakpoint) -> None:
        """Removes a breakpoint.  Raises KeyError if it is not set."""
        del self._rows[breakpoint]
        self._watched.pop(breakpoint, None)
        self._stops.put(self._rows.values())

    def clear(self) -> None:
        """Removes all breakpoints; a scan that stands goes on all the same with the next `Plc.scan`."""
        self._rows.clear()
        self._watched.clear()
        if self._table:
            self._table.put(())

    def _put(self, breakpoint: Breakpoint, row: LineStop | Watchpoint) -> Breakpoint:
        self._rows[breakpoint] = row
        self._stops.put(self._rows.values())
        return breakpoint

    def _condition(self, text: str) -> Condition | None:
        return parse_condition(text, self._inspected.find) if text else None

    def _test(self, condition: Condition | None) -> Test | None:
        return (lambda: condition.holds(self._inspected.read)) if condition else None

    # --- names inside a POU -------------------------------------------------------------------------------------------

    def _scope(self, base: int | None, lines: Lines) -> Scope:
        """The names inside the instance that begins at a byte."""
        instance = place_of(self._inspected.find, self._names.instance(base)) if base else None
        return Scope(self._inspected.find, instance, self._local(lines))

    def _local(self, lines: Lines) -> Mapping[str, Field]:
        """The variables that live while the POU of some lines is executed."""
        pous = {fold(self._image.sites[site].pou) for site in lines.sites}
        return self._image.frames.get(next(iter(pous)), {}) if len(pous) == 1 else {}

    def _known_base(self, lines: Lines) -> tuple[bool, int | None]:
        """Whether one instance is known to be meant, and where it begins: 0 for a POU that has none."""
        pous = {self._image.sites[site].pou for site in lines.sites}
        if lines.base is not None:
            return True, lines.base
        if any(self._owner(pou) for pou in pous):
            return False, None
        found = instances(self._image.symbols, next(iter(pous)), 2) if len(pous) == 1 else []
        return len(found) < 2 and len(pous) == 1, found[0].offset if len(found) == 1 else 0

    def _owner(self, pou: str) -> StructType | None:
        """The block that a method, an action or an accessor of a property belongs to, None for other POUs."""
        while "." in pou:
            pou = pou.rpartition(".")[0]
            if isinstance(found := self._image.types.get(fold(pou)), StructType) and found.block:
                return found
        return None

    def _some_instance(self, pou: str) -> Place | None:
        """An instance in which a POU is executed: of its block, or of one that extends this."""
        owner = self._owner(pou)
        kinds = [kind.name for kind in self._image.types.values() if derives(kind, owner)] if owner else [pou]
        return next((place for kind in kinds for place in instances(self._image.symbols, kind, 1)), None)

    def _line_test(self, lines: Lines, when: str) -> LineTest | None:
        """The test of a condition in which variables of the POU need no path."""
        if not when:
            return None
        is_known, only = self._known_base(lines)
        tried = Scope(self._inspected.find, self._some_instance(self._image.sites[min(lines.sites)].pou), self._local(lines))
        parse_condition(when, tried.find)  # says at once what is wrong with it
        parsed: dict[int, Condition] = {}

        def test(base: int | None) -> bool | None:
            at = only if is_known else base
            if at is None:
                return None
            if at not in parsed:
                parsed[at] = parse_condition(when, self._scope(at, lines).find)
            return parsed[at].holds(self._inspected.read)

        return test

    def _message(self, lines: Lines, text: str) -> Callable[[int | None], str | None] | None:
        """A function that says the message of a log point in an instance."""
        if not text:
            return None
        message = parse_message(text)
        is_known, only = self._known_base(lines)

        def said(base: int | None) -> str | None:
            at = only if is_known or not message.names else base
            return None if at is None else message.text(self._scope(at, lines).find, self._inspected.read)

        return said

    # --- looking ------------------------------------------------------------------------------------------------------

    def use(self, memory: Memory) -> None:
        """Looks at another memory of the same program from now on; only where no machine code runs with these breakpoints."""
        self._memory = memory
        if self._table:
            self._table.memory = memory

    def begin(self, passes: Mapping[Breakpoint, int] | None = None) -> None:
        """From now on a change is a difference from what the memory is now; passes count on from `passes`, or from 0."""
        self._stops.begin({self._rows[said]: count for said, count in (passes or {}).items() if said in self._rows})

    @property
    def passes(self) -> dict[Breakpoint, int]:
        """How often each was passed, with its condition TRUE."""
        return {said: row.passes for said, row in self._rows.items()}

    def look(self, site: int, is_statement: bool, base: int | None = None) -> bool:
        """True if one is reached: before a statement or rung, or (`is_statement` False) behind a write; site -1 is the end of a
        program.  `base` is the byte at which the instance of the body begins."""
        return self._stops.hit(site, is_statement, base)

    @property
    def reached(self) -> list[Breakpoint]:
        """Those that were reached at the last look, in the order in which they were set."""
        return [said for said, row in self._rows.items() if row in self._stops.reasons]

    @property
    def reasons(self) -> list[str]:
        """Why, a line for each of `reached`."""
        return [self._reason(said, self._rows[said]) for said in self.reached]

    @property
    def state(self) -> State:
        """What was seen so far, for `restore`, here or with the same breakpoints on another PLC."""
        return self._stops.state

    def restore(self, state: State) -> None:
        """Undoes all looks since a state, because the memory goes back, too."""
        self._stops.back(state)

    def take_told(self) -> list[Told]:
        """What log points told since the last call, the oldest first."""
        told, self._stops.told[:] = self._stops.told[:], []
        return told

    def _reason(self, said: Breakpoint, row: LineStop | Watchpoint) -> str:
        if isinstance(row, Watchpoint) and said.kind == "change":
            whole = self._watched[said]
            found, before, after = changed(whole, cast(Value, row.before), cast(Value, row.value))
            name = said.where if found is whole else found.name
            return f"{name} was {self._shown(found, before)}, is {self._shown(found, after)}"
        return f"{said.where} holds" if said.kind == "condition" else f"breakpoint {said}"

    def _shown(self, found: Place | Span, value: Value) -> str:
        return show(found.type, self._names.name_references(found.type, value)) if isinstance(found, Place) else str(value)


def _of_instance(base: int, test: LineTest | None) -> LineTest:
    """The test that also wants one instance."""

    def of_instance(here: int | None) -> bool | None:
        if here is None:
            return None
        return here == base and (test is None or test(here) is True)

    return of_instance


class Breakpoints(BreakpointRows):
    """The breakpoints of a PLC that runs, at which its scans stand still."""

    def __init__(self, plc: Stoppable) -> None:
        super().__init__(plc, plc.image)
        self._plc = plc
        self._stoppable: StoppableEngine | None = None
        self._stands_in: tuple[object, object] = None, None
        self._task = 0
        self.halted: Halt | None = None
        """Where the scan stands, if one does."""

    @property
    def armed(self) -> bool:
        """True if a scan could stop, or stands."""
        return bool(self._rows) or self.halted is not None

    def _put(self, breakpoint: Breakpoint, row: LineStop | Watchpoint) -> Breakpoint:
        choice_of(self._plc.engine)
        return super()._put(breakpoint, row)

    # --- running, for the PLC -----------------------------------------------------------------------------------------

    def run(self, task_index: int, engine: Engine) -> Trap | None:
        """Executes a task as `engine` would, or goes on with a task that stands, up to its end, a trap or a stop (`halted`)."""
        if self.halted and self._stoppable:
            self.halted = None
            stoppable = self._stoppable
            trap = stoppable.go_on()
        else:
            stoppable, self._task = self.stoppable(engine), task_index
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
        return Halt(self._plc.scans, frames[0].site, tuple(self.reasons), tuple(self.reached), tuple(frames), self._task,
                    stoppable.statement)  # fmt: skip


def _extents(found: Place | Span) -> tuple[list[tuple[int, int]], int]:
    """The (offset, size) of what is watched, and the mask if that is a bit.  Raises ValueError behind a reference."""
    places = found.places if isinstance(found, Span) else (found,)
    for place in places:
        if place.hops:
            raise ValueError(f"{place.name} lies behind a reference, which may change: watch what it points to")
    if isinstance(found, Place) and found.bit is not None:
        return [(found.offset, 1)], 1 << found.bit
    return [(place.offset, max(1, place.type.size)) for place in places], 0
