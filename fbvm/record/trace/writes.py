"""Which statements write a place in a scan, also where they write what was there: for double writes of an output."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from fbvm.engine.observation import NO_SITE
from fbvm.machine.plc import Phase, Plc
from fbvm.record.trace.events import Event, Write
from fbvm.record.trace.observing import observing
from fbvm.watch.bits import Written, bits_of, meet, written_bits, written_twice
from fbvm.watch.paths import Place, Span, find


class Writes:
    """The writes of the last scan to some places, to which no reference leads."""

    def __init__(self, places: Sequence[Place]) -> None:
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
                self._seen[event.site, bits] = None

    def twice(self) -> tuple[int, ...]:
        """The sites of two statements that have written the same bit in the last scan; empty if there are none."""
        for (one, _), (other, _) in written_twice(self._seen, self.watched):
            return one, other
        return ()


@contextmanager
def noting_writes(plc: Plc, places: Sequence[Place]) -> Iterator[Writes]:
    """Notes the writes of each scan of `plc` to some places inside the `with` block."""
    writes = Writes(places)
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
    return [str(plc.image.sites[site]) for site in writes.twice()]
