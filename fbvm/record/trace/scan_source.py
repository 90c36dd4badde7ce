"""What charts, tables, causes and pages are made of: scans that are past, with values, events, and what the program is.

A trace in a file is one, a recording in memory another (`record/recording/`)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from fbvm.base.areas import Area
from fbvm.base.memory import Memory
from fbvm.base.types import Field
from fbvm.code.image import RungPicture, SfcPicture, Site
from fbvm.machine.plc import Phase
from fbvm.record.trace.events import Event, NetworkEvent
from fbvm.record.trace.format import TraceError
from fbvm.record.trace.results import Results
from fbvm.record.trace.writer import Depth
from fbvm.watch import places
from fbvm.watch.names import Names
from fbvm.watch.paths import Place, Span, find
from fbvm.watch.values import Value


class Follower(Protocol):
    """Receives the phases and events of past scans, as an `observing.Listener` does of a PLC."""

    def phase(self, moment: Moment, phase: Phase) -> None:
        """Called at the end of a phase; REFRESH is the end of the scan."""

    def event(self, moment: Moment, event: Event) -> None:
        """Called for each event."""


@dataclass
class Moment:
    """The PLC at a moment that is past: its memory, the number of the scan and its time."""

    source: ScanSource
    memory: Memory
    scans: int = 0
    now_ns: int = 0

    def find(self, text: str) -> Place | Span:
        """The place or span of places that `text` names.  Raises UnknownPlace."""
        return self.source.find(text)

    def read(self, where: str | Place | Span) -> Value:
        """The value of a variable, address or range.  Raises UnknownPlace, and TraceError if a reference leads out of memory."""
        place = self.find(where) if isinstance(where, str) else where
        try:
            return places.read_found(self.memory, place)
        except IndexError as error:
            raise TraceError(f"the memory of scan {self.scans} is damaged: {error}") from None


class ScanSource(ABC):
    """Scans that are past, of one PLC."""

    cycle_ns: int
    depth: Depth
    """What there is of each scan."""
    selected: tuple[str, ...]
    """Patterns of the variables that are meant if none is named."""
    symbols: Mapping[str, Field]
    areas: Mapping[str, Area]
    names: Names
    sites: Sequence[Site]
    outer: Sequence[int]
    """For each site the site of the statement around it (`outline.outer_statements`)."""
    bodies: Sequence[tuple[str, str]]
    """Name and kind of each body."""
    results: Results
    """What bodies return; empty in traces that are older than this row."""
    rungs: Sequence[RungPicture]
    charts: Sequence[SfcPicture]
    described: Mapping[str, str]
    """What units call their words and bits, by address."""
    meanings: Mapping[str, Mapping[int, str]]
    """What values of words of units mean, by address."""
    lines: Mapping[str, Mapping[int, str]]
    """Source lines with statements, by file and number."""

    @property
    @abstractmethod
    def scans(self) -> range:
        """Numbers from the first to the last scan that there is."""

    @abstractmethod
    def moments(self, scans: range | None = None) -> Iterator[Moment]:
        """The PLC at the end of each of some scans, or of all; the same object for all scans."""

    @abstractmethod
    def follow(self, follower: Follower, scans: range | None = None) -> None:
        """Reports the phases and events of some scans, or of all, to `follower`."""

    def follow_ends(self, follower: Follower, scans: range | None = None) -> None:
        """Reports to `follower` the end of some scans, or of all, and what passed the network; nothing that happened inside."""
        self.follow(_Ends(follower), scans)

    def may_change(self, places: Sequence[Place], scans: range) -> range:
        """Some scans without those at their end in which none of the places was changed, as far as that is known quickly.

        They are empty if none was changed in any of them.  The places are not behind references."""
        return scans

    def find(self, text: str) -> Place | Span:
        """The place or span of places that `text` names.  Raises UnknownPlace."""
        return find(self.symbols, self.areas, text)

    def line(self, site: Site) -> str:
        """The source line of a statement, "" if it is not known."""
        return self.lines.get(site.file, {}).get(site.line, "")

    def at(self, scan: int) -> Moment:
        """The PLC at the end of a scan.  Raises ValueError if the scan is not recorded."""
        moment = next(self.moments(range(scan, scan + 1)), None)
        if moment is None:
            raise ValueError(f"scan {scan} is not in the trace, which has {_shown(self.scans)}")
        return moment


class _Ends:
    """Passes on the ends of scans and network events only."""

    def __init__(self, follower: Follower) -> None:
        self._follower = follower

    def phase(self, moment: Moment, phase: Phase) -> None:
        """Passes on the end of a scan."""
        if phase is Phase.REFRESH:
            self._follower.phase(moment, phase)

    def event(self, moment: Moment, event: Event) -> None:
        """Passes on what passed the network."""
        if isinstance(event, NetworkEvent):
            self._follower.event(moment, event)


def _shown(scans: Sequence[int]) -> str:
    return f"scans {scans[0]} to {scans[-1]}" if scans else "no scans"
