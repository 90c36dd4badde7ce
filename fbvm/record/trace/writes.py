"""Which statements write a place in a scan, also where they write what was there: for double writes of an output."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from fbvm.code.image import Site
from fbvm.engine.observation import NO_SITE
from fbvm.machine.plc import Phase, Plc
from fbvm.record.trace.events import OUTSIDE, Event, Frame, Write
from fbvm.record.trace.observing import observing
from fbvm.watch.bits import Writer, Written, bits_of, meet, written_bits, written_twice
from fbvm.watch.paths import Place, Span, find


class Writes:
    """The writes of the last scan to some places, to which no reference leads; `sites` are those of the program."""

    def __init__(self, places: Sequence[Place], sites: Sequence[Site]) -> None:
        self.sites = sites
        self.watched = [bits_of(place) for place in places]
        self._seen: dict[Written, None] = {}

    def phase(self, plc: Plc, phase: Phase) -> None:
        """A scan begins when its inputs are there."""
        if phase is Phase.INPUTS:
            self._seen.clear()

    def event(self, plc: Plc, event: Event) -> None:
        """Keeps a write to one of the places."""
        if isinstance(event, Write) and event.site != NO_SITE:
            bits = written_bits(event.offset, len(event.value), event.bit)
            if any(meet(bits, watched) for watched in self.watched):
                self._seen[(*_calls(event.frame), (event.site, 0)), bits] = None

    def twice(self) -> tuple[str, ...]:
        """The places of two statements that have written the same bit in the last scan; empty if there are none.

        It may be one statement in two instances, or called by two others: then the calls are told, too."""
        for (one, _), (other, _) in written_twice(self._seen, self.watched):
            is_same = one[-1] == other[-1]
            return self._words(one, is_same), self._words(other, is_same)
        return ()

    def _words(self, writer: Writer, with_calls: bool) -> str:
        *calls, (site, _) = writer
        callers = [caller for caller, _ in reversed(calls) if caller != NO_SITE] if with_calls else []
        return ", called by ".join(str(self.sites[each]) for each in (site, *callers))


def _calls(frame: Frame) -> Writer:
    """The calls that lead to a frame, that of the program first."""
    found: list[tuple[int, int]] = []
    at: Frame | None = frame
    while at is not None and at is not OUTSIDE:
        found.append((at.site, at.base))
        at = at.caller
    return tuple(reversed(found))


@contextmanager
def noting_writes(plc: Plc, places: Sequence[Place]) -> Iterator[Writes]:
    """Notes the writes of each scan of `plc` to some places inside the `with` block."""
    writes = Writes(places, plc.image.sites)
    with observing(plc, writes):
        yield writes


def double_writes(plc: Plc, *names: str) -> list[str]:
    """Does one scan.  Returns two statements that write the same bit of `names` (variables, addresses, ranges) in it, by their
    places in the source; [] if there are none.  Raises UnknownPlace.

    The later one wins, and the earlier one looks as if it did nothing."""
    places: list[Place] = []
    for name in names:
        found = find(plc.image.symbols, plc.image.layout.areas, name)
        places += found.places if isinstance(found, Span) else [found]
    with noting_writes(plc, places) as writes:
        plc.scan()
    return [*writes.twice()]
