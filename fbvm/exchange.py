"""The units of a PLC on its backplane, and the I/O refresh, in which each exchanges its words once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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
