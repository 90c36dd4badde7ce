"""The units of a PLC on its backplane, and what they say together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fbvm.base.areas import Area
from fbvm.units.unit import Unit
from fbvm.wire.link import Link, Network


@dataclass(frozen=True)
class Attached:
    """A unit on the backplane and its place on a network."""

    unit: Unit
    link: Link
    network: Network


def wake_ns(units: Sequence[Attached], latest_ns: int) -> int:
    """When a unit changes something by itself, `latest_ns` if none does before."""
    for attached in units:
        if (unit_ns := attached.unit.wake_ns) < latest_ns:
            latest_ns = unit_ns
    return latest_ns


def watched(units: Sequence[Attached], areas: Mapping[str, Area]) -> list[int] | None:
    """Offsets of what the units look at in each refresh; None if one does not say so."""
    found: list[int] = []
    for attached in units:
        if attached.unit.watched is None:
            return None
        found += [areas[area].offset + 2 * word for area, word in attached.unit.watched]
    return found


def is_idle(units: Sequence[Attached], now_ns: int) -> bool:
    """True if a refresh changes nothing unless what the units watch has changed, as far as they say what that is."""
    for attached in units:  # noqa: SIM110 - a generator would cost as much as the rest of it
        if attached.unit.wake_ns <= now_ns or not attached.link.is_quiet:
            return False
    return True


def pass_by(units: Sequence[Attached], refreshes: int) -> None:
    """So many refreshes have taken place in which nobody had anything to do."""
    for attached in units:
        attached.link.pass_by(refreshes)
