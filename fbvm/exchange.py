"""The units of a PLC on its backplane, and the I/O refresh, in which each exchanges its words once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fbvm.base.areas import Area
from fbvm.base.memory import Memory
from fbvm.net.journal import Journal
from fbvm.units.unit import Unit
from fbvm.wire.link import Link, Network


@dataclass(frozen=True)
class Attached:
    """A unit on the backplane and its place on a network."""

    unit: Unit
    link: Link
    network: Network


def refresh(units: Sequence[Attached], memory: Memory, now_ns: int, journal: Journal | None) -> None:
    """Each unit exchanges its words once, the networks take what the units ask for."""
    for number, attached in enumerate(units):
        link = attached.link
        events = link.events(now_ns)
        if journal:
            journal.told(number, events)
        requests = attached.unit.refresh(memory, events, now_ns)
        if requests:
            link.submit(requests, now_ns)


def wake_ns(units: Sequence[Attached], latest_ns: int) -> int:
    """When a unit changes something by itself, `latest_ns` if none does before."""
    for attached in units:
        if (unit_ns := attached.unit.wake_ns) < latest_ns:
            latest_ns = unit_ns
    return latest_ns


def watched(units: Sequence[Attached], areas: Mapping[str, Area]) -> list[int]:
    """Offsets of what the units look at in each refresh, as far as they say so."""
    return [areas[area].offset + 2 * word for attached in units for area, word in attached.unit.watched or ()]


def is_idle(units: Sequence[Attached], now_ns: int) -> bool:
    """True if the next refresh will change nothing unless what the units watch changes or one of them wakes."""
    for attached in units:
        if attached.unit.wake_ns <= now_ns or not attached.link.is_quiet or attached.unit.watched is None:
            return False
    return True


def pass_by(units: Sequence[Attached], refreshes: int) -> None:
    """So many refreshes have taken place in which nobody had anything to do."""
    for attached in units:
        attached.link.pass_by(refreshes)
