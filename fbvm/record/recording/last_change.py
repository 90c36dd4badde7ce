"""Finds the last change of a value in a long recording at the speed of the engine: by breakpoints, with nothing observed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fbvm.base.memory import Memory
from fbvm.record.recording.recorded import RecordedPlc
from fbvm.record.recording.replay import Replay
from fbvm.watch.paths import Place

FIRST_STRETCH = 32
"""Scans that a search backwards looks at first; then at twice as many, and so on."""
WINDOW = 100
"""The scans of which the one with the change is not looked for."""


def may_change(recorded: RecordedPlc, places: Sequence[Place], scans: range) -> range:
    """Some scans without those at their end in which none of the places was changed; empty if there is no change.

    A change is in one of the last WINDOW of them.  The places are not behind references."""
    held = recorded.begun
    for stretch in stretches(max(held.start, scans.start), min(held.stop, scans.stop)):
        if (last := _last_in(recorded, places, stretch)) is not None:
            return range(scans.start, last + 1)
    return range(scans.start, scans.start)


def stretches(first: int, end: int) -> Iterator[range]:
    """The scans from `first` to before `end` in stretches that grow, the latest first."""
    size = FIRST_STRETCH
    while end > first:
        start = max(first, end - size)
        yield range(start, end)
        end, size = start, size * 2


def _last_in(recorded: RecordedPlc, places: Sequence[Place], scans: range) -> int | None:
    """A scan with the last change in one of the WINDOW scans up to it.

    Searches by halves, so that a run is not stopped at each of a million changes."""
    first = _first_in(recorded, places, scans) if scans else None
    if first is None or scans.stop - first <= WINDOW:
        return None if first is None else scans.stop - 1
    middle = (first + 1 + scans.stop) // 2
    for half in (range(middle, scans.stop), range(first + 1, middle)):
        if (found := _last_in(recorded, places, half)) is not None:
            return found
    return first


def _first_in(recorded: RecordedPlc, places: Sequence[Place], scans: range) -> int | None:
    """The scan with the first change.

    What a unit or somebody outside has changed is seen at the statement behind it, which is one of the next scan."""
    again = Replay(recorded, scans.start)
    again.advance(scans.start)
    plc = again.plc
    known = _seen(plc.memory, places)
    for place in places:
        plc.breakpoints.change(place)
    while plc.scans < scans.stop and not plc.trap:
        if not again.many(scans.stop):
            again.scan()
        if plc.halted:
            return plc.halted.scan
    return None if _seen(plc.memory, places) == known else scans.stop - 1


def _seen(memory: Memory, places: Sequence[Place]) -> list[bytes | int]:
    """The bytes of the places, of bits the bit."""
    return [bytes(memory.u8[place.offset : place.offset + max(1, place.type.size)]) if place.bit is None
            else memory.u8[place.offset] >> place.bit & 1 for place in places]  # fmt: skip
