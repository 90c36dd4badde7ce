"""The power flow in rungs: the states of contacts, outputs and blocks in each execution of a rung."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from fbvm.code.image import RungPicture
from fbvm.machine.plc import Phase
from fbvm.record.draw.table import ScanState
from fbvm.record.trace.events import Contact, Event, Read, Statement, Write


@dataclass(eq=False)
class RungExecution:
    """One execution of a rung: the offset of its instance, and the states of each step in the order of evaluation."""

    scan: int
    base: int
    picture: RungPicture
    states: dict[int, list[bool]] = field(default_factory=dict)
    values: dict[tuple[int, int, int | None], str] = field(default_factory=dict)
    """The values that were read and written, as text, by site, offset and bit; empty without `keep`."""


def latest_execution(picture: RungPicture, base: int, scan: int,
                     elements: Mapping[tuple[int, object], bool]) -> RungExecution | None:  # fmt: skip
    """The latest execution of a rung as far as `machine.power` knows it; None if none of its elements was evaluated.

    `elements` are those of the instance that begins at byte `base`, `scan` is the number to show."""
    states = {number: [elements[site, number]] for number, (site, *_) in enumerate(picture.steps) if (site, number) in elements}
    return RungExecution(scan, base, picture, states) if states else None


Keep = Callable[[ScanState, RungExecution, Read | Write], None]
"""Called for each read and write of an execution of a rung."""
Finish = Callable[[ScanState, RungExecution], None]
"""Called for each execution of a rung in a scan when the program has been executed."""


class PowerFlow:
    """A listener that keeps the executions of `rungs` in the scans for which `wanted` returns True, in order.

    `keep` is called for each read and write in them, `finish` for each of them when the program is over."""

    def __init__(self, rungs: Sequence[RungPicture], wanted: Callable[[int], bool], keep: Keep | None = None,
                 finish: Finish | None = None) -> None:  # fmt: skip
        self.executed: list[RungExecution] = []
        self._wanted, self._keep, self._finish = wanted, keep, finish
        self._rungs = {rung.site: rung for rung in rungs}
        self._owners = {place: rung.site for rung in rungs for place, _, _, _ in rung.steps} | {
            rung.site: rung.site for rung in rungs}  # fmt: skip
        self._latest: dict[tuple[int, int], RungExecution] = {}

    def phase(self, plc: ScanState, phase: Phase) -> None:
        """Forgets the executions of the scan before; calls `finish` when the program is over."""
        if phase is Phase.INPUTS:
            self._latest.clear()
        elif phase is Phase.PROGRAM and self._finish:
            for made in self._latest.values():
                self._finish(plc, made)

    def event(self, plc: ScanState, event: Event) -> None:
        """Records the execution of a rung, and the state of a contact."""
        if not self._wanted(plc.scans):
            return
        if isinstance(event, Statement) and event.is_rung:
            made = RungExecution(plc.scans, event.frame.base, self._rungs[event.site])
            self._latest[event.frame.base, event.site] = made
            self.executed.append(made)
        elif isinstance(event, Contact) and isinstance(event.element, int):
            if here := self._rung(event):
                here.states.setdefault(event.element, []).append(event.value)
        elif self._keep and isinstance(event, Read | Write) and (here := self._rung(event)):
            self._keep(plc, here, event)

    def _rung(self, event: Contact | Read | Write) -> RungExecution | None:
        """The latest execution of the rung that an event belongs to."""
        return self._latest.get((event.frame.base, self._owners.get(event.site, -1)))
