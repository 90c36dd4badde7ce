"""A run that is done again from its beginning: the same inputs, and after each scan the same memory, to the bit."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

from fbvm.machine.goal import Goal
from fbvm.machine.plc import Plc, Stopped
from fbvm.record.recording.container import RecordingError
from fbvm.record.recording.file_reader import FileRecordedPlc
from fbvm.record.recording.replay import Replay


class RepeatedRun(ABC):
    """A run that is done again: `plc` is as it was after the scan that was done last."""

    plc: Plc
    differs: int | None = None
    """Number of the first scan after which the memory was not the recorded one; None if there is none."""
    complete = False
    """True when the end of what was recorded was reached.  A file that was cut off has none."""

    @abstractmethod
    def step(self) -> bool:
        """Does everything up to the end of the next scan again.  Returns False at the end of what was recorded."""

    def run(self, *, scans: int | None = None, until: str | Callable[[Plc], bool] | None = None) -> str:
        """Does scans again up to a bound of `Plc.run`, the end of what was recorded, or the first scan with another memory.

        Returns "scans", "until", "end" or "differs"."""
        never = scans is None and until is None
        goal = Goal(self.plc, scans=1 << 62 if never else scans, until=until)
        while not (reason := goal.reached()) or reason == "trap":
            if not self.step():
                return "end"
            if self.differs is not None:
                return "differs"
        return reason


class RepeatedRecording(RepeatedRun):
    """The run of one PLC of a recording's file, from the first scan that it has.  Raises RecordingError if the file does not have
    the program, or is damaged."""

    def __init__(self, recorded: FileRecordedPlc) -> None:
        self._recorded = recorded
        if not recorded.scans:
            raise RecordingError("the recording has no scans yet")
        self._again = Replay(recorded, recorded.scans.start)
        self.plc = self._again.plc
        self._row = -1
        self._expected: dict[int, int] = {}
        """Fingerprints behind scans of the present chunk."""

    def step(self) -> bool:
        """Does the next scan again, and compares the memory if the recording has its fingerprint."""
        scan, recorded = self.plc.scans, self._recorded
        if scan >= recorded.scans.stop:
            self.complete = recorded.is_complete
            return False
        if (row := recorded.keyframe(scan)) != self._row:
            self._row, self._expected = row, recorded.fingerprints(row)
        try:
            self._again.scan()
        except Stopped:
            self.differs = self.differs if self.differs is not None else scan - 1
            return False
        wanted = self._expected.get(scan)
        if wanted is not None and self.differs is None and recorded.fingerprint_of(self.plc) != wanted:
            self.differs = scan
        return True
