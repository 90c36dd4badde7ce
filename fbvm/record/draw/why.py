"""Why a variable has its value: the statement that gave it, what that statement read, and so on back through scans.

Needs a trace of statements.  What the conditions around a statement read counts as read by it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

from fbvm.base.memory import Memory, Snapshot, compare
from fbvm.code.image import Site
from fbvm.machine.plc import Phase
from fbvm.record.trace.events import Event, Frame, Read, Statement, Write
from fbvm.record.trace.recorder import Signal
from fbvm.watch.names import Names, is_single
from fbvm.watch.paths import Place
from fbvm.watch.places import dereferenced
from fbvm.watch.values import Value, show_time

DEEPEST = 6
"""Causes of causes that are looked for if nobody says how deep."""
WINDOWS = (100, 2000)
"""Scans that are read at first, and if they do not suffice; then all."""
MOST_FACTS = 32
"""Places of which a value without a name is remembered to have been made."""
LARGEST_BYTES = 4096
"""What copies at once is not followed byte by byte if it is larger."""


class Instant(Protocol):
    """A PLC at some moment of what happened."""

    @property
    def memory(self) -> Memory: ...
    @property
    def scans(self) -> int: ...
    @property
    def now_ns(self) -> int: ...
    def read(self, where: str | Place) -> Value: ...


class Follower(Protocol):
    """Who is told what happened."""

    def phase(self, moment: Instant, phase: Phase) -> None: ...
    def event(self, moment: Instant, event: Event) -> None: ...


class Readable(Protocol):
    """Whose values can be read."""

    @property
    def memory(self) -> Memory: ...
    def read(self, where: str | Place) -> Value: ...


class Past(Protocol):
    """What happened, to be gone through again: a trace, or a session of stepping."""

    @property
    def names(self) -> Names: ...
    @property
    def sites(self) -> Sequence[Site]: ...
    @property
    def outer(self) -> Sequence[int]: ...
    @property
    def scans(self) -> range: ...
    def at(self, scan: int) -> Readable: ...
    def follow(self, follower: Follower, scans: range | None = None) -> None: ...
    def line(self, site: Site) -> str: ...


@dataclass(frozen=True)
class Fact:
    """A place was read at some moment, and what it held; `guard` if a condition around the statement read it."""

    place: Place
    value: str
    order: int
    guard: bool = False


@dataclass(frozen=True)
class Change:
    """A value changed: by a statement of an instance that had read `facts`, or from outside in a phase."""

    scan: int
    now_ns: int
    order: int
    site: Site | None = None
    instance: str = ""
    facts: tuple[Fact, ...] = ()
    phase: Phase | None = None


@dataclass
class Cause:
    """A value and what gave it; `change` is None if nothing did in what was read."""

    place: Place
    value: str
    change: Change | None
    guard: bool = False
    repeated: bool = False
    """It is explained at another place of the answer."""
    causes: list[Cause] = field(default_factory=list)


class _Changes:
    """Every change in some scans, by byte and bit."""

    def __init__(self, trace: Past, scans: range) -> None:
        self._trace = trace
        self._changes: dict[int, list[tuple[int, Change]]] = {}
        self._reads: dict[tuple[Frame, int], list[Fact]] = {}
        self._nameless: dict[int, tuple[Fact, ...]] = {}
        """What was read for the bytes that no name has: conditions of rungs, variables of functions."""
        self._asked: list[Fact] = []
        """What was read for a nameless value that nothing was written of since: an interlock asks so whether it holds."""
        self._guards: list[Fact] = []
        """Those facts, while the statement behind them is executed."""
        self._known: Snapshot | None = None
        self.order = 0
        trace.follow(self, scans)

    def phase(self, moment: Instant, phase: Phase) -> None:
        self.order += 1
        now = moment.memory.snapshot()
        if phase is not Phase.PROGRAM and self._known is not None:
            change = Change(moment.scans, moment.now_ns, self.order, phase=phase)
            old, new = bytes(self._known), bytes(now)
            for offset, size in compare(self._known, now):
                for at in range(offset, offset + size):
                    self._changes.setdefault(at, []).append((old[at] ^ new[at], change))
        self._known = now
        if phase is Phase.REFRESH:
            self._reads.clear()

    def event(self, moment: Instant, event: Event) -> None:
        self.order += 1
        if isinstance(event, Statement):
            self._reads[event.frame, event.site] = []
            self._guards, self._asked = self._asked, []
        elif isinstance(event, Read):
            place = self._trace.names.at(event.offset, event.bit if event.bit < 8 else None)
            facts = self._reads.setdefault((event.frame, event.site), [])
            if place is None:
                self._asked = list(self._nameless.get(event.offset, ()))
                facts += self._asked
            else:
                facts.append(Fact(place, Signal(place, place.name).text(self._trace.names.read(moment.read, place)), self.order))
        elif isinstance(event, Write):
            self._written(moment, event)
            self._asked = []

    def _written(self, moment: Instant, event: Write) -> None:
        if self._trace.names.at(event.offset, event.bit if event.bit < 8 else None) is None:
            self._nameless[event.offset] = tuple(_once(self._facts(event.frame, event.site)))[:MOST_FACTS]
        elif event.old != event.value and len(event.value) <= LARGEST_BYTES:
            site = self._trace.sites[event.site] if event.site >= 0 else None
            change = Change(moment.scans, moment.now_ns, self.order, site, self._trace.names.instance(event.frame.base),
                            tuple(self._facts(event.frame, event.site)))  # fmt: skip
            for at, (old, new) in enumerate(zip(event.old, event.value, strict=True), event.offset):
                if old != new:
                    bits = 1 << event.bit if event.bit < 8 else old ^ new
                    self._changes.setdefault(at, []).append((bits, change))

    def _facts(self, frame: Frame, site: int) -> Iterator[Fact]:
        """What a statement read, then what the conditions around it did."""
        own = self._reads.get((frame, site), ())
        yield from own or (replace(fact, guard=True) for fact in self._guards)
        while site >= 0 and (site := self._trace.outer[site]) >= 0:
            for fact in self._reads.get((frame, site), ()):
                yield Fact(fact.place, fact.value, fact.order, True)

    def last(self, place: Place, before: int) -> Change | None:
        """The last change of a place before some moment."""
        found: Change | None = None
        for at in range(place.offset, place.offset + max(1, place.type.size)):
            mask = 0xFF if place.bit is None else 1 << place.bit
            for bits, change in reversed(self._changes.get(at, [])):
                if change.order < before and bits & mask:
                    if found is None or change.order > found.order:
                        found = change
                    break
        return found


def why(trace: Past, place: Place, scan: int, deepest: int = DEEPEST) -> Cause:
    """What gave a place its value at the end of a scan.  Raises ValueError for a scan that is not recorded."""
    then = trace.at(scan)
    value = Signal(place, place.name).text(trace.names.read(then.read, place))
    place = _settled(trace.names, then.memory, place)
    start = trace.scans.start
    for window in (*WINDOWS, scan - start + 1):
        first = max(start, scan - window + 1)
        past = _Changes(trace, range(first, scan + 1))
        cause = _explain(past, place, value, past.order + 1, deepest, set())
        if first == start or not _open(cause):
            break
    return cause


def _settled(names: Names, memory: Memory, place: Place) -> Place:
    """Where what is asked for lies; behind a reference it has the name of its owner, too."""
    found = dereferenced(memory, place) if place.hops else None
    if found is None:
        return place
    owner = names.at(found.offset, found.bit) if is_single(found) else None
    return replace(found, name=f"{place.name} ({owner.name})") if owner else found


def _explain(past: _Changes, place: Place, value: str, before: int, deepest: int, known: set[object]) -> Cause:
    change = past.last(place, before)
    cause = Cause(place, value, change)
    key = place, change.order if change else -1
    if key in known:
        cause.repeated = bool(change and change.facts)
        return cause
    known.add(key)
    for fact in _once(change.facts) if change and deepest else ():
        inner = _explain(past, fact.place, fact.value, fact.order, deepest - 1, known)
        inner.guard = fact.guard
        cause.causes.append(inner)
    return cause


def _once(facts: Iterable[Fact]) -> Iterator[Fact]:
    seen: set[Place] = set()
    for fact in facts:
        if fact.place not in seen:
            seen.add(fact.place)
            yield fact


def _open(cause: Cause) -> bool:
    """True if somewhere nothing was found that an earlier scan may hold."""
    return cause.change is None or any(_open(inner) for inner in cause.causes)


# --- as text ----------------------------------------------------------------------------------------------------------


def cause_text(trace: Past, cause: Cause) -> str:
    """The answer as a tree of lines."""
    return "\n".join(_lines(trace, cause, "", ""))


def _lines(trace: Past, cause: Cause, first: str, rest: str) -> Iterator[str]:
    yield f"{first}{'if ' if cause.guard else ''}{cause.place.name} = {cause.value}{_since(trace, cause)}"
    for number, inner in enumerate(cause.causes):
        last = number == len(cause.causes) - 1
        yield from _lines(trace, inner, rest + ("└ " if last else "├ "), rest + ("  " if last else "│ "))


def _since(trace: Past, cause: Cause) -> str:
    change = cause.change
    if change is None:
        return " since the trace begins" if trace.scans.start else " since power-on"
    when = f" since scan {change.scan} ({show_time(change.now_ns).removeprefix('T#')})"
    if change.phase is Phase.REFRESH:
        return f"{when}, by a unit in the I/O refresh"
    if change.phase is not None:
        return f"{when}, from outside the program"
    if change.site is None:
        return f"{when}, by a stub"
    line = trace.line(change.site)
    where = f"{change.site.file}:{change.site.line}" + (f" in {change.instance}" if change.instance else "")
    return f"{when}, by {where}" + (f":  {line}" if line else "") + ("  (see above)" if cause.repeated else "")
