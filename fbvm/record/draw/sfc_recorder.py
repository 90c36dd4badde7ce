"""Records the calls of charts: their active steps and evaluated transitions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from fbvm.base.types import BOOL
from fbvm.code.image import SfcPicture
from fbvm.machine.plc import Phase
from fbvm.record.draw.sfc_text import ChartState
from fbvm.record.draw.table import ScanState
from fbvm.record.trace.events import Contact, Event, Statement
from fbvm.watch.paths import Place


@dataclass(eq=False)
class ChartCall:
    """One call of a chart: the offset of its instance, the values of evaluated conditions, and the steps that were active
    when the programs of the scan had ended."""

    scan: int
    base: int
    picture: SfcPicture
    tested: dict[int, bool] = field(default_factory=dict)
    active: frozenset[int] = frozenset()

    @property
    def state(self) -> ChartState:
        return ChartState(self.active, self.tested)


def active_steps(picture: SfcPicture, base: int, plc: ScanState) -> frozenset[int]:
    """The numbers of the active steps of the instance at offset `base`."""
    return frozenset(number for number, (name, _, flag, _) in enumerate(picture.steps)
                     if plc.read(Place(name, BOOL, base + flag)))


class ChartRecorder:
    """A listener that keeps the calls of `charts` in the scans for which `wanted` returns True, in order."""

    def __init__(self, charts: Sequence[SfcPicture], wanted: Callable[[int], bool]) -> None:
        self.calls: list[ChartCall] = []
        self._wanted = wanted
        self._charts = {chart.site: chart for chart in charts}
        self._transitions = {row[0]: (chart.site, number) for chart in charts
                             for number, row in enumerate(chart.transitions)}  # fmt: skip
        self._latest: dict[tuple[int, int], ChartCall] = {}

    def phase(self, plc: ScanState, phase: Phase) -> None:
        """Reads the active steps at the end of a phase, and forgets the calls of the scan before."""
        for called in self._latest.values():
            called.active = active_steps(called.picture, called.base, plc)
        if phase is Phase.INPUTS:
            self._latest.clear()

    def event(self, plc: ScanState, event: Event) -> None:
        """Records the call of a chart, and the value of a condition."""
        if not self._wanted(plc.scans):
            return
        if isinstance(event, Statement) and event.site in self._charts:
            made = ChartCall(plc.scans, event.frame.base, self._charts[event.site])
            self._latest[event.frame.base, event.site] = made
            self.calls.append(made)
        elif isinstance(event, Contact) and event.site in self._transitions:
            chart, number = self._transitions[event.site]
            if here := self._latest.get((event.frame.base, chart)):
                here.tested[number] = event.value
