"""What one page looks at: a PLC, names, panels, and perhaps the past."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass, field

from fbvm.live.messages import MOST_NAMES, MessageError
from fbvm.live.plcs import LivePlc
from fbvm.live.program import ScanView
from fbvm.live.workbench import REFUSED, Workbench
from fbvm.machine.plc import Plc
from fbvm.watch.paths import Place, Span

Names = dict[str, tuple[LivePlc, Place | Span]]
"""Names that pages know, each with its PLC and its place."""
BESIDE = "/"
"""Parts the name of another PLC from a name of it: `tank/Main.Level`."""
STEP = 10
"""Names whose places are found in one step."""


@dataclass
class Look:
    """What a page sees.  `names` has the PLC and the place of each; the panels are on or off."""

    live: LivePlc
    names: Names = field(default_factory=dict)
    instance: str = ""
    memory: tuple[str, int] | None = None
    """Area and first word of the memory panel."""
    units: bool = False
    network: bool = False
    pictures: bool = False
    times: bool = False
    plant: bool = False
    past: tuple[int, Plc] | None = None
    """The recorded scan that is looked at, and the PLC as it was at its end."""
    past_view: ScanView | None = None
    other: LivePlc | None = None
    """The PLC in another future, if that is looked at."""

    @property
    def seen(self) -> Plc:
        """The PLC that the page sees: as it is, or as it was."""
        return self.past[1] if self.past else self.live.plc

    def leave_past(self) -> None:
        """The page sees the present again."""
        self.past = self.past_view = self.other = None


def find_names(bench: Workbench, live: LivePlc, names: Sequence[str]) -> Generator[None, None, tuple[Names, dict[str, str]]]:
    """The places of names of a PLC, or of another one in front of a `/`; and why others are none.  Found in short steps."""
    found: Names = {}
    unknown: dict[str, str] = {}
    for number, name in enumerate(names[:MOST_NAMES], 1):
        plc, _, path = name.rpartition(BESIDE)
        try:
            owner = bench.plc(plc) if plc else live
            found[name] = owner, owner.plc.find(path)
        except (MessageError, *REFUSED) as error:
            unknown[name] = str(error)
        if number % STEP == 0:
            yield
    return found, unknown
