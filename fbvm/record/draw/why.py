"""Causes of a value: the statement that wrote it, the values that this statement had read, and so on back through scans.

Needs a trace of depth STATEMENTS.  Reads by the conditions around a statement count as reads by the statement.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from itertools import islice
from operator import attrgetter
from typing import Protocol

from fbvm.base.memory import Memory, Snapshot, compare
from fbvm.base.types import fold
from fbvm.code.image import RungPicture, Site
from fbvm.machine.plc import Phase
from fbvm.record.trace.events import Cut, Event, Frame, Read, Return, Statement, Write
from fbvm.record.trace.format import xor
from fbvm.record.trace.recorder import Signal
from fbvm.record.trace.results import Results
from fbvm.watch.names import Names, is_single
from fbvm.watch.paths import Place, find_place
from fbvm.watch.places import dereferenced
from fbvm.watch.values import Value, show_time

DEEPEST = 6
"""The default depth of causes of causes."""
WINDOWS = (100, 1000)
"""Scans that are searched at once, backwards: where a change is known to be, or is likely, and where it may be anywhere."""
ORDER_BITS = 32
"""The number of an event is that of its window's first scan, shifted by so many bits, and its number in the window."""
MOST_FACTS = 32
"""Operands that are kept of a value without a name, and of a condition around a statement."""
PRESENT_VALUES = ("T", "C")
"""The areas that hold how far timers and counters are."""
LARGEST_BYTES = 4096
"""A larger write is kept whole and compressed, not byte by byte."""


class Instant(Protocol):
    """The state of a PLC at a moment of the past."""

    @property
    def memory(self) -> Memory: ...
    @property
    def scans(self) -> int: ...
    @property
    def now_ns(self) -> int: ...
    def read(self, where: str | Place) -> Value: ...


class Follower(Protocol):
    """Receives phases and events."""

    def phase(self, moment: Instant, phase: Phase) -> None: ...
    def event(self, moment: Instant, event: Event) -> None: ...


class Readable(Protocol):
    """Memory whose values can be read by name."""

    @property
    def memory(self) -> Memory: ...
    def read(self, where: str | Place) -> Value: ...


class EventSource(Protocol):
    """A source of events of past scans: a trace, or a stepping session."""

    @property
    def names(self) -> Names: ...
    @property
    def sites(self) -> Sequence[Site]: ...
    @property
    def outer(self) -> Sequence[int]: ...
    @property
    def rungs(self) -> Sequence[RungPicture]: ...
    @property
    def bodies(self) -> Sequence[tuple[str, str]]: ...
    @property
    def results(self) -> Results: ...
    @property
    def scans(self) -> range: ...
    def at(self, scan: int) -> Readable: ...
    def follow(self, follower: Follower, scans: range | None = None) -> None: ...
    def may_change(self, places: Sequence[Place], scans: range) -> range: ...
    def line(self, site: Site) -> str: ...


@dataclass(frozen=True)
class Fact:
    """A read of a place: its value, and the number of the event; `guard` if a condition around the statement has read it.

    `returned` is the assignment of what a method or property has returned."""

    place: Place
    value: str
    order: int
    guard: bool = False
    returned: Change | None = None


@dataclass(frozen=True)
class Change:
    """A change of a value: by a statement of an instance, which had read `facts`, or from outside in a phase."""

    scan: int
    now_ns: int
    order: int
    site: Site | None = None
    instance: str = ""
    facts: tuple[Fact, ...] = ()
    phase: Phase | None = None


@dataclass
class Cause:
    """A value, the change that led to it and its causes.

    `change` is None if there is none since the first scan that there is."""

    place: Place
    value: str
    change: Change | None
    guard: bool = False
    repeated: bool = False
    """True if its causes are listed at another place of the tree."""
    causes: list[Cause] = field(default_factory=list)


class _Changes:
    """All changes of memory in some scans, by byte and bit."""

    def __init__(self, trace: EventSource, scans: range) -> None:
        self._trace = trace
        self._changes: dict[int, list[tuple[int, Change]]] = {}
        self._large: list[tuple[range, bytes, Change]] = []
        """Writes of more than LARGEST_BYTES: the offsets, the bits that changed as compressed bytes, and the change."""
        self._reads: dict[tuple[Frame, int], dict[object, Fact]] = {}
        """By execution of a body and statement the last read of each place, by its `id`: a loop reads the same time and again.
        What a method returns is known by its body, instance and number."""
        self._nameless: dict[int, tuple[Fact, ...]] = {}
        """By offset the operands of values without a name: conditions of rungs, variables of functions."""
        self._returned: dict[Frame, dict[int, Change]] = {}
        """By execution of a body and offset its last write of bytes without a name: of variables that end with it."""
        self._result_places: dict[int, list[Place]] = {}
        self._pending: list[Fact] = []
        """The operands of a value without a name that was read and not yet written from: the condition of an interlock."""
        self._guards: list[Fact] = []
        """These operands, while the next statement is executed, whose condition they are."""
        self._known: Snapshot | None = None
        self._cut = False
        """Whether the scan has executed statements that are not recorded."""
        self._steps = {site for rung in trace.rungs if not rung.is_text for site, *_ in rung.steps}
        self.order = scans.start << ORDER_BITS
        self._first = scans.start
        trace.follow(self, range(max(trace.scans.start, scans.start - 1), scans.stop))

    def phase(self, moment: Instant, phase: Phase) -> None:
        if moment.scans < self._first:  # the scan before shows what is changed from outside behind it
            self._known = moment.memory.snapshot() if phase is Phase.REFRESH else None
            return
        self.order += 1
        now = moment.memory.snapshot()
        if (phase is not Phase.PROGRAM or self._cut) and self._known is not None:
            change = Change(moment.scans, moment.now_ns, self.order, phase=phase)
            old, new = bytes(self._known), bytes(now)
            for offset, size in compare(self._known, now):
                for at in range(offset, offset + size):
                    self._changes.setdefault(at, []).append((old[at] ^ new[at], change))
        self._known, self._cut = now, False
        if phase is Phase.REFRESH:
            self._reads.clear()

    def event(self, moment: Instant, event: Event) -> None:
        if moment.scans < self._first:
            return
        self.order += 1
        if isinstance(event, Statement):
            if self._shown(event.frame, event.site)[0] is event.frame:
                self._reads[event.frame, event.site] = {}
                self._guards, self._pending = self._pending, []
        elif isinstance(event, Read):
            self._read(moment, event)
        elif isinstance(event, Write):
            self._written(moment, event)
            self._pending = []
        elif isinstance(event, Return):
            self._return(moment, event.frame)
        elif isinstance(event, Cut):
            self._known, self._cut = moment.memory.snapshot(), True

    def _shown(self, frame: Frame, site: int) -> tuple[Frame, int]:
        """The execution and the statement to which something counts: what an instruction of a rung does inside, in a function or
        a block without a name such as `Main.$TIM0`, counts to the rung."""
        outer = frame
        while outer.caller is not None:
            is_inside = "$" in self._trace.names.instance(outer.base) or (
                outer.site in self._steps and self._trace.bodies[outer.body][1] == "FUNCTION")
            if is_inside:
                frame, site = outer.caller, outer.site
            outer = outer.caller
        return frame, site

    def _read(self, moment: Instant, event: Read) -> None:
        place = self._trace.names.at(event.offset, event.bit if event.bit < 8 else None)
        shown = self._shown(event.frame, event.site)
        facts = self._reads.setdefault(shown, {})
        if place is None:
            operands = self._nameless.get(event.offset, ())
            facts.update((id(fact.place), fact) for fact in operands)
            if shown[0] is event.frame:
                self._pending = list(operands)
        elif shown[0] is event.frame or _is_operand(place):
            facts.pop(id(place), None)  # the last read stands last
            text = Signal(place, place.name).text(self._trace.names.read(moment.read, place))
            facts[id(place)] = Fact(place, text, self.order)

    def _written(self, moment: Instant, event: Write) -> None:
        if self._trace.names.at(event.offset, event.bit if event.bit < 8 else None) is None:
            self._nameless[event.offset] = tuple(_once(self._facts(*self._shown(event.frame, event.site))))[:MOST_FACTS]
            if event.frame.body in self._trace.results:
                change = self._change(moment, event, self._nameless[event.offset])
                self._returned.setdefault(event.frame, {})[event.offset] = change
        elif event.old != event.value:
            change = self._change(moment, event, tuple(self._facts(*self._shown(event.frame, event.site))))
            if len(event.value) > LARGEST_BYTES:
                offsets = range(event.offset, event.offset + len(event.value))
                self._large.append((offsets, zlib.compress(xor(event.old, event.value), 1), change))
                return
            for at, (old, new) in enumerate(zip(event.old, event.value, strict=True), event.offset):
                if old != new:
                    bits = 1 << event.bit if event.bit < 8 else old ^ new
                    self._changes.setdefault(at, []).append((bits, change))

    def _change(self, moment: Instant, event: Write, facts: tuple[Fact, ...]) -> Change:
        frame, number = self._shown(event.frame, event.site)
        site = self._trace.sites[number] if number >= 0 else None
        return Change(moment.scans, moment.now_ns, self.order, site, self._trace.names.instance(frame.base), facts)

    def _return(self, moment: Instant, frame: Frame) -> None:
        """Counts what a body returns as read by the statement that has called it: of a method or property the result, of a
        function what its result is made of.

        Of a body with frames on the stack it is all that its variables are made of: no event tells where its frame lies."""
        written = self._returned.pop(frame, None)
        if not written or frame.caller is None:
            return
        name, kind = self._trace.bodies[frame.body]
        path = self._trace.names.instance(frame.base) if kind in ("METHOD", "GET") else ""
        facts = self._reads.setdefault(self._shown(frame.caller, frame.site), {})
        for number, place in enumerate(self._results(frame.body)):
            offsets = range(place.offset, place.offset + max(1, place.type.size))
            changes = [change for offset, change in written.items() if offset in offsets or place.hops]
            if not path or place.hops:
                facts.update((id(fact.place), fact) for change in changes for fact in change.facts)
                continue
            if not changes:
                continue
            change = max(changes, key=attrgetter("order"))
            called = f"{path}.{name.removesuffix('.Get').rpartition('.')[2]}"
            place = replace(place, name=called if place.name == called.rpartition(".")[2] else f"{called}.{place.name}")
            text = Signal(place, place.name).text(self._trace.names.read(moment.read, place))
            key = frame.body, frame.base, number
            facts.pop(key, None)
            facts[key] = Fact(place, text, self.order, returned=change)

    def _results(self, body: int) -> list[Place]:
        """The places of the result and outputs of a body; those on the stack of frames lie behind a reference."""
        if body not in self._result_places:
            fields = self._trace.results[body]
            self._result_places[body] = [find_place({fold(field.name): field}, {}, field.name) for field in fields]
        return self._result_places[body]

    def _facts(self, frame: Frame, site: int) -> Iterator[Fact]:
        """The reads of a statement, then those of the conditions around it."""
        own = self._reads.get((frame, site), {})
        yield from own.values() or (replace(fact, guard=True) for fact in self._guards)
        while site >= 0 and (site := self._trace.outer[site]) >= 0:
            last = list(islice(reversed(self._reads.get((frame, site), {}).values()), MOST_FACTS))
            for fact in reversed(last):
                yield replace(fact, guard=True)

    def last(self, place: Place, before: int) -> Change | None:
        """The last change of a place before the event with number `before`."""
        offsets = range(place.offset, place.offset + max(1, place.type.size))
        mask = 0xFF if place.bit is None else 1 << place.bit
        found = self._last_large(offsets, mask, before)
        for at in offsets:
            for bits, change in reversed(self._changes.get(at, [])):
                if change.order < before and bits & mask:
                    if found is None or change.order > found.order:
                        found = change
                    break
        return found

    def _last_large(self, offsets: range, mask: int, before: int) -> Change | None:
        """The last write of more than LARGEST_BYTES that changed bits of `mask` in some bytes."""
        for written, bits, change in reversed(self._large):
            if change.order < before and offsets.start < written.stop and written.start < offsets.stop:
                first, end = max(offsets.start, written.start), min(offsets.stop, written.stop)
                if any(changed & mask for changed in zlib.decompress(bits)[first - written.start : end - written.start]):
                    return change
        return None


def why(trace: EventSource, place: Place, scan: int, deepest: int = DEEPEST) -> Cause:
    """The causes of the value of a place at the end of a scan.

    `deepest` limits the depth of the tree.  Raises ValueError for a scan that is not recorded."""
    then = trace.at(scan)
    value = Signal(place, place.name).text(trace.names.read(then.read, place))
    place = _dereferenced(trace.names, then.memory, place)
    search, left, window = _Search(trace), range(trace.scans.start, scan + 1), WINDOWS[0]
    while True:
        search.begin(left[-window:])
        cause = search.explain(place, value, (scan + 1) << ORDER_BITS, deepest, set())
        before = left[:-window]
        if not before or not (wanted := list(dict.fromkeys(_open(cause)))):
            return cause
        left = trace.may_change(wanted, before)
        if not left:
            return cause
        window = WINDOWS[left == before]


def _dereferenced(names: Names, memory: Memory, place: Place) -> Place:
    """The place with its references followed; its name says also the variable that it is."""
    found = dereferenced(memory, place) if place.hops else None
    if found is None:
        return place
    owner = names.at(found.offset, found.bit) if is_single(found) else None
    return replace(found, name=f"{place.name} ({owner.name})") if owner else found


def _is_operand(place: Place) -> bool:
    """Whether a place that an instruction reads inside may be an operand of it: no variable or flag of its own.

    A timer or counter reads its present value to count on."""
    return place.area not in ("", *PRESENT_VALUES) or "." in place.name and not place.is_generated


class _Search:
    """Searches causes in windows, one before the other: what one has not, the one before may have."""

    def __init__(self, trace: EventSource) -> None:
        self._trace = trace
        self._past: _Changes | None = None
        self._found: dict[tuple[Place, int], Change] = {}
        """The changes that led to values of places at events, as far as they are known."""

    def begin(self, scans: range) -> None:
        """Goes on with the scans in front of those before."""
        self._past = None  # which frees its memory first
        self._past = _Changes(self._trace, scans)

    def _last(self, place: Place, before: int) -> Change | None:
        key = place, before
        if key not in self._found and self._past and (change := self._past.last(place, before)):
            self._found[key] = change
        return self._found.get(key)

    def explain(self, place: Place, value: str, before: int, deepest: int, known: set[object],
                returned: Change | None = None) -> Cause:  # fmt: skip
        """The causes of a value at event `before`, as far as they are known; `returned` made it if a method has returned it."""
        change = returned or self._last(place, before)
        cause = Cause(place, value, change)
        key = place, change.order if change else -1
        if key in known:
            cause.repeated = bool(change and change.facts)
            return cause
        known.add(key)
        for fact in _once(change.facts) if change and deepest else ():
            inner = self.explain(fact.place, fact.value, fact.order, deepest - 1, known, fact.returned)
            inner.guard = fact.guard
            cause.causes.append(inner)
        return cause


def _once(facts: Iterable[Fact]) -> Iterator[Fact]:
    seen: set[Place] = set()
    for fact in facts:
        if fact.place not in seen:
            seen.add(fact.place)
            yield fact


def _open(cause: Cause) -> Iterator[Place]:
    """The places without a change, which an earlier scan may have; of one behind a reference the reference."""
    if cause.change is None:
        yield replace(cause.place, hops=())
    for inner in cause.causes:
        yield from _open(inner)


# --- as text ----------------------------------------------------------------------------------------------------------


def cause_text(trace: EventSource, cause: Cause) -> str:
    """The causes as a tree of lines."""
    return "\n".join(_lines(trace, cause, "", ""))


def _lines(trace: EventSource, cause: Cause, first: str, rest: str) -> Iterator[str]:
    yield f"{first}{'if ' if cause.guard else ''}{cause.place.name} = {cause.value}{_since(trace, cause)}"
    for number, inner in enumerate(cause.causes):
        last = number == len(cause.causes) - 1
        yield from _lines(trace, inner, rest + ("└ " if last else "├ "), rest + ("  " if last else "│ "))


def _since(trace: EventSource, cause: Cause) -> str:
    change = cause.change
    if change is None:
        start = trace.scans.start
        return f" since before scan {start}, the first of the trace" if start else " since power-on"
    when = f" since scan {change.scan} ({show_time(change.now_ns).removeprefix('T#')})"
    if change.phase is Phase.REFRESH:
        return f"{when}, by a unit in the I/O refresh"
    if change.phase is Phase.PROGRAM:
        return f"{when}, by a statement that is not recorded: there were too many in this scan"
    if change.phase is not None:
        return f"{when}, from outside the program"
    if change.site is None:
        return f"{when}, by a stub"
    line = trace.line(change.site)
    where = f"{change.site.file}:{change.site.line}" + (f" in {change.instance}" if change.instance else "")
    return f"{when}, by {where}" + (f":  {line}" if line else "") + ("  (see above)" if cause.repeated else "")
