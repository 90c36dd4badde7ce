"""Replays a journal: the same program, the same inputs, and after each scan the same memory, to the bit.

The time is that of the journal, so that an hour on real connections takes seconds.  Nothing is sent.  `fbvm run` writes
recordings; journals are those of `Plc(image, journal=...)` and of fbvm 0.1.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from fbvm.code.image import Image
from fbvm.engine.allowance import WHOLE_BUDGET, Allowance
from fbvm.machine.backplane import UNITS
from fbvm.machine.plc import Mode, Plc, Stopped
from fbvm.net.journal import Act, End, Entry, Fingerprint, Header, JournalError, Scan
from fbvm.record.recording.repeated_run import RepeatedRun
from fbvm.record.recording.replay import RecordedLink
from fbvm.units.contract import Unit


class Replay(RepeatedRun):
    """A replay in progress: `plc` is as it was after the scan that was replayed last.

    `header` and `entries` come from `open_journal`; `image` is the program that ran, `units` make the units by class
    name, and `engine` need not be that of the first time.  Raises JournalError if another program wrote the journal,
    and later if the file is damaged."""

    def __init__(
        self,
        header: Header,
        entries: Iterator[Entry],
        image: Image,
        *,
        units: Mapping[str, Callable[..., Unit]] = UNITS,
        observed: bool = False,
        engine: str = "auto",
    ) -> None:
        if image.fingerprint != header.image:
            raise JournalError("the journal was written by another program, or by another version of fbvm")
        self._entries = entries
        self.plc = Plc(image, header.cycle_ns, budget=header.budget, observed=observed, engine=engine)
        self._units = units
        self._links: list[RecordedLink] = []
        self._fingerprint = Fingerprint(self.plc.memory)

    def step(self) -> bool:
        """Replays everything up to the end of the next scan.  Returns False at the end of the journal."""
        for entry in self._entries:
            try:
                if isinstance(entry, Scan):
                    self._scan(entry)
                    return True
                if isinstance(entry, Act):
                    self._act(entry)
            except (ArithmeticError, LookupError, TypeError, ValueError, Stopped) as error:
                raise JournalError(f"scan {self.plc.scans} cannot be done again: {error}") from error
            self.complete = isinstance(entry, End)
        return False

    def _act(self, act: Act) -> None:
        self._write(act.writes)
        if act.what == "mode":
            self.plc.mode = Mode(act.value)
        elif act.what == "unit":
            self._attach(act.value)
        elif act.value == "warm":
            self.plc.warm_start()
        else:
            self.plc.cold_start()
        self._fingerprint.settle()

    def _attach(self, described: Mapping[str, Any]) -> None:
        make = self._units.get(described["class"])
        if make is None:
            raise JournalError(f"nothing here makes a unit of class {described['class']}")
        unit = make(**described["with"])
        link = RecordedLink(unit.address, None)
        unit.settings = described["settings"]
        self.plc.attach(unit, link)
        self._links.append(link)

    def _scan(self, scan: Scan) -> None:
        plc = self.plc
        for number, settings in scan.settings.items():
            plc.units[number].unit.settings = settings
        if scan.forced or scan.unforced:
            self._force(scan)
        if scan.budget is not None:
            plc.budget = scan.budget
        self._write(scan.writes)
        for number, events in scan.events.items():
            self._links[number].told = list(events)
        if scan.watch is not None:
            steps, plc.watch_cycle.time_ns = scan.watch
            plc.engine.allowance = Allowance(max(0, plc.budget - steps + 1))
        plc.scan(scan.now_ns)
        plc.engine.allowance = WHOLE_BUDGET
        if self._fingerprint.settle() != scan.fingerprint and self.differs is None:
            self.differs = scan.number

    def _force(self, scan: Scan) -> None:
        """Changes what is forced, but not the memory: what a force wrote at once is among the journal's writes."""
        before = self.plc.memory.snapshot()
        for name, value in scan.forced.items():
            self.plc.force(name, value)
        for name in scan.unforced:
            self.plc.unforce(name)
        self.plc.memory.restore(before)

    def _write(self, writes: Iterable[tuple[int, bytes]]) -> None:
        for offset, data in writes:
            if offset < 0 or offset + len(data) > self.plc.memory.size:
                raise JournalError(f"{len(data)} bytes at {offset} are outside the memory")
            self.plc.memory.u8[offset : offset + len(data)] = data
