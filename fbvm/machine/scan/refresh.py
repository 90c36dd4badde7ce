"""The units of a PLC on its backplane, and the I/O refresh in which they exchange their words."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

from fbvm.base.memory import Memory
from fbvm.machine.scan.inputs import InputRecorder
from fbvm.net.journal import Journal
from fbvm.units.contract import ProcessorUnit, Unit, has_processor
from fbvm.wire.link import Link, Network, Request


@dataclass(frozen=True)
class Attached:
    """A unit on the backplane, its link, and the network of the link."""

    unit: Unit
    link: Link
    network: Network

    @cached_property
    def own(self) -> ProcessorUnit | None:
        """The unit, if it has a processor of its own, switched on or not; None for any other."""
        return self.unit if has_processor(self.unit) else None


class IORefresh:
    """The I/O refresh of the units of one PLC.  Fast paths leave refreshes out that would change nothing, and count them here."""

    def __init__(self, units: Sequence[Attached], memory: Memory) -> None:
        self.units, self.memory = units, memory
        self.skipped = 0
        """How many refreshes were left out of which the links have not been told."""
        self.changed_words = False
        """True if the units changed words in the last refresh: the program should see them soon."""
        self.recorder: InputRecorder | None = None
        """Is told the events of the networks."""

    def refresh(self, now_ns: int, journal: Journal | None = None, seen: Callable[[int], None] | None = None) -> bool:
        """One refresh at `now_ns`: each unit exchanges its words and stores what it received; then the networks take the requests
        of all units.

        `journal` is told the events; `seen` is called with the number of each unit whose words have been exchanged.  Returns
        True if no unit has anything left to do (`is_idle`)."""
        if self.skipped:
            self.report_skipped()
        memory, changed_words, recorder = self.memory, False, self.recorder
        if recorder:
            recorder.refresh_begins()
        asked: list[list[Request] | None] = []
        """The requests of each unit; None if its program ran and `finish` has them."""
        for number, attached in enumerate(self.units):
            unit, link = attached.unit, attached.link
            events = link.events(now_ns)
            if journal:
                journal.told(number, events)
            if recorder and events:
                recorder.received(number, events)
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
        if recorder:
            recorder.refresh_ended()
        return self.is_idle(now_ns)

    def report_skipped(self) -> None:
        """Tells the links of the refreshes that were left out."""
        for attached in self.units:
            attached.link.pass_by(self.skipped)
        self.skipped = 0

    def is_idle(self, now_ns: int) -> bool:
        """True if a refresh at `now_ns` would change nothing as long as the words that the units watch stay as they are."""
        for attached in self.units:  # noqa: SIM110 - a generator would cost as much as the rest of it
            if attached.unit.wake_ns <= now_ns or not attached.link.is_quiet:
                return False
        return True

    def wake_ns(self, latest_ns: int) -> int:
        """When the units want another scan: 0 if the program has not seen words that they changed, else as `unit_ns`."""
        return 0 if self.changed_words else self.unit_ns(latest_ns)

    def unit_ns(self, latest_ns: int) -> int:
        """When the first unit changes something by itself; `latest_ns` if none does before."""
        for attached in self.units:
            if (unit_ns := attached.unit.wake_ns) < latest_ns:
                latest_ns = unit_ns
        return latest_ns

    def offset(self, area: str, word: int) -> int:
        """The offset of a word of an area, in bytes of the memory."""
        return self.memory.areas[area].offset + 2 * word

    @property
    def watched(self) -> list[list[int]] | None:
        """For each unit the offsets of the eight bytes each that it watches; None if a unit does not say what it watches."""
        groups = [attached.unit.watched for attached in self.units]
        return None if None in groups else [[self.offset(*place) for place in group or ()] for group in groups]
