"""What was recorded of one PLC, in memory or in a file: ask it for "scan n, observed", and it executes the scan again.

    recorded.follow(listener, range(41, 42))     every phase and event of scan 41, told to an `observing.Listener`
    recorded.at(41)                              a PLC in the state before scan 41
    RecordedScans(recorded, lines).at(41)        the values at the end of scan 41, as charts and tables read them
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext

from fbvm.machine.plc import Plc
from fbvm.machine.state import State
from fbvm.record.recording.chunks import Chunk, ScanInputs
from fbvm.record.recording.replay import Replay
from fbvm.record.trace.observing import Listener, observing


class RecordedPlc(ABC):
    """The scans of one PLC that can be executed again."""

    @property
    @abstractmethod
    def plc(self) -> Plc:
        """A PLC with the program that was recorded, and with its units."""

    @property
    @abstractmethod
    def substituted(self) -> Sequence[int]:
        """The bodies that Python stood in for."""

    @property
    @abstractmethod
    def scans(self) -> range:
        """The scans that can be executed again, without one that has begun and not ended."""

    @property
    @abstractmethod
    def begun(self) -> range:
        """The scans that can be executed again; one that was interrupted is executed to the end that it would have had."""

    @abstractmethod
    def chunk(self, scan: int) -> Chunk:
        """The keyframe before a scan, and what follows up to the next one."""

    @abstractmethod
    def inputs(self, scan: int) -> ScanInputs | None:
        """The inputs of a scan, if there are any."""

    @abstractmethod
    def now_ns(self, scan: int) -> int:
        """The time of a scan."""

    def applying(self, scan: int) -> AbstractContextManager[None]:
        """Is entered while a keyframe is given to a PLC, and in each scan; a file that holds what cannot be says so then."""
        return nullcontext()

    def at(self, scan: int) -> Plc:
        """A new PLC in the state before a scan, to be read or to go on with other inputs; its units ask nothing of a network.

        Raises ValueError if the scan is not recorded."""
        held = self.scans
        if not held.start <= scan <= held.stop or not self.begun:
            raise ValueError(f"scan {scan} is not recorded; recorded are {f'{held.start} to {held.stop}' if held else 'none'}")
        again = Replay(self, scan)
        again.advance(scan)
        again.leave()
        return again.plc

    def states(self, scans: range) -> Iterator[State]:
        """The states before some recorded scans, or behind the last one, in order; without what was written before each."""
        again = Replay(self, scans.start)
        for scan in scans:
            again.advance(scan)
            yield again.plc.snapshot()

    def follow(self, listener: Listener, scans: range) -> None:
        """Executes recorded scans again and reports their phases and events to `listener`."""
        self.follow_with(scans, lambda plc: observing(plc, listener))

    def follow_with(self, scans: range, attached: Callable[[Plc], AbstractContextManager[object]]) -> None:
        """Executes scans of `begun` again on a new PLC, inside the context that `attached` makes for this PLC."""
        scans = range(max(scans.start, self.begun.start), min(scans.stop, self.begun.stop))
        if not scans:
            return
        again = Replay(self, scans.start)
        again.advance(scans.start)
        with attached(again.plc):
            for _ in scans:
                again.scan()

    def again(self, scans: range) -> Iterator[Plc]:
        """Executes scans of `begun` again; yields the PLC after each of them."""
        again = Replay(self, scans.start)
        again.advance(scans.start)
        for _ in scans:
            again.scan()
            yield again.plc
