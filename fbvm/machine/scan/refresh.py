"""The units of a PLC on its backplane, and the I/O refresh in which they exchange their words."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

from fbvm.base.memory import Memory
from fbvm.net.journal import Journal
from fbvm.units.contract import ProcessorUnit, Unit
from fbvm.wire.link import Link, Network, Request


@dataclass(frozen=True)
class Attached:
    """A unit on the backplane and its place on a network."""

    unit: Unit
    link: Link
    network: Network

    @cached_property
    def own(self) -> ProcessorUnit | None:
        """The unit, if a processor of its own does what a refresh does, or will when there is something to do."""
        return self.unit if isinstance(self.unit, ProcessorUnit) else None


class IORefresh:
    """I/O refreshes of the units of one PLC; some may be left out, and are counted."""

    def __init__(self, units: Sequence[Attached], memory: Memory) -> None:
        self.units, self.memory = units, memory
        self.skipped = 0
        """How many refreshes were left out since the last one."""
        self.changed_words = False
        """The units changed words in the last refresh, and no scan has come upon it."""

    def refresh(self, now_ns: int, journal: Journal | None = None, seen: Callable[[int], None] | None = None) -> bool:
        """Each unit exchanges its words once and stores what it received; then the networks take what the units ask for.

        `seen` is told the number of each unit whose words have been exchanged.  True if nobody has anything left to do."""
        if self.skipped:
            self.report_skipped()
        memory, changed_words = self.memory, False
        asked: list[list[Request] | None] = []
        """What each unit asks for; None if its program is to be asked."""
        for number, attached in enumerate(self.units):
            unit, link = attached.unit, attached.link
            events = link.events(now_ns)
            if journal:
                journal.told(number, events)
            own = attached.own
            if own is None:
                asked.append(unit.refresh(memory, events, now_ns))
            else:
                asked.append(None if own.exchange(memory, events, now_ns) else [])
            if seen:
                seen(number)
            if own is not None:
                own.move(memory)
        for attached, requests in zip(self.units, asked, strict=True):
            unit, link, own = attached.unit, attached.link, attached.own
            if requests is None and own is not None:
                requests = own.finish()
            if requests:
                link.submit(requests, now_ns)
            changed_words = changed_words or unit.changed_words
        self.changed_words = changed_words
        return self.is_idle(now_ns)

    def report_skipped(self) -> None:
        """Tell the links of refreshes that were left out."""
        for attached in self.units:
            attached.link.pass_by(self.skipped)
        self.skipped = 0

    def is_idle(self, now_ns: int) -> bool:
        """True if a refresh changes nothing unless what the units watch has changed, as far as they say what that is."""
        for attached in self.units:  # noqa: SIM110 - a generator would cost as much as the rest of it
            if attached.unit.wake_ns <= now_ns or not attached.link.is_quiet:
                return False
        return True

    def wake_ns(self, latest_ns: int) -> int:
        """When the units want another scan: at once if the program has not seen yet what they changed."""
        return 0 if self.changed_words else self.unit_ns(latest_ns)

    def unit_ns(self, latest_ns: int) -> int:
        """When a unit changes something by itself, `latest_ns` if none does before."""
        for attached in self.units:
            if (unit_ns := attached.unit.wake_ns) < latest_ns:
                latest_ns = unit_ns
        return latest_ns

    def offset(self, area: str, word: int) -> int:
        """Where a word of an area lies in the memory."""
        return self.memory.areas[area].offset + 2 * word

    @property
    def watched(self) -> list[list[int]] | None:
        """Offsets of what each unit looks at in each refresh; None if one does not say so."""
        groups = [attached.unit.watched for attached in self.units]
        return None if None in groups else [[self.offset(*place) for place in group or ()] for group in groups]
