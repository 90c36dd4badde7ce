"""The scans of a recording's file for charts, tables, causes and pages.

Where this version of fbvm does not compute the memory that was recorded, or has no program, what happened inside scans is not
shown: values are those of the keyframes then, each until the next one, beside what passed the network."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from fbvm.base.memory import Memory
from fbvm.machine.plc import Phase, Stopped
from fbvm.record.recording.container import RecordingError
from fbvm.record.recording.damage import damages
from fbvm.record.recording.file_reader import FileRecordedPlc
from fbvm.record.recording.scans import RecordedScans
from fbvm.record.trace.description import describe
from fbvm.record.trace.events import NetworkEvent
from fbvm.record.trace.scan_source import Follower, Moment
from fbvm.record.trace.writer import Depth


class FileScans(RecordedScans):
    """The scans of one PLC of a `RecordingFile`.  `depth` is what is told of each scan, that of the recording if not given."""

    def __init__(self, recorded: FileRecordedPlc, depth: Depth | None = None) -> None:
        self._recorded, self._file, self._first = recorded, recorded, 0
        with damages("what the recording tells of a PLC is damaged"):
            describe(self, recorded.head)
        self.depth = depth or self.depth
        self.differs: int | None = None
        """The first scan, of those that were asked for, from which on values are those of keyframes."""

    @property
    def texts(self) -> dict[str, str]:
        """The sources of the program as they were when it was recorded, by name."""
        return self._file.texts

    @property
    def may_differ(self) -> bool:
        """True if scans may come out differently here: another version of fbvm has made the recording, or of another program."""
        return not self._file.is_same and not isinstance(self._file.program, str)

    def begins_to_differ(self, scan: int) -> bool:
        """True for the first scan behind a keyframe whose memory is not the recorded one, as far as the recording says so."""
        return self.may_differ and self._file.differs(self._file.keyframe(scan)) == scan

    @property
    def warning(self) -> str:
        """What a reader has to know about the values that were had; "" if they are those of the run."""
        if self.differs is None:
            return ""
        if isinstance(self._file.program, str):
            return f"{self._file.program}; values are those of the recording's keyframes, each until the next one"
        here = f"fbvm {self._file.version}" if self._file.version else "this version of fbvm"
        return (f"from scan {self.differs} on {here} computes another memory than was recorded (fbvm {self._file.made_by}): "
                "values are those of the recording's keyframes there, each until the next one, without what happened inside")

    def moments(self, scans: range | None = None) -> Iterator[Moment]:
        """The PLC at the end of each scan; the same object for all scans of a keyframe."""
        for part, agrees in self._parts(scans):
            if agrees:
                yield from self._guarded(super().moments(part))
            else:
                yield from self._kept(part)

    def follow(self, follower: Follower, scans: range | None = None) -> None:
        """Executes some scans again, or all, and reports their phases and events to `follower`."""
        self._follow(super().follow, follower, scans)

    def follow_ends(self, follower: Follower, scans: range | None = None) -> None:
        """Reports the ends of some scans, or of all, and what passed the network."""
        self._follow(super().follow_ends, follower, scans)

    def _follow(self, again: Callable[[Follower, range], None], follower: Follower, scans: range | None) -> None:
        for part, agrees in self._parts(scans):
            if agrees:
                try:
                    again(follower, part)
                except Stopped as error:
                    raise self._stopped(error) from None
            else:
                for moment in self._kept(part):
                    self._tell(moment, follower)

    def _tell(self, moment: Moment, follower: Follower) -> None:
        """Reports the end of a scan, and before it what passed the network as it was recorded."""
        with self._file.applying(moment.scans):
            inputs = self._file.inputs(moment.scans)
        if inputs:
            for now_ns, _, event in inputs.traffic:
                follower.event(moment, NetworkEvent(now_ns, event))
        follower.phase(moment, Phase.REFRESH)

    def _guarded(self, moments: Iterator[Moment]) -> Iterator[Moment]:
        try:
            yield from moments
        except Stopped as error:
            raise self._stopped(error) from None

    def _stopped(self, error: Stopped) -> RecordingError:
        return RecordingError(f"the recording has scans behind one that stopped the PLC: {error}")

    def _parts(self, scans: range | None) -> Iterator[tuple[range, bool]]:
        """The scans that are wanted, in pieces that come out the same here, or do not."""
        wanted = self._wanted(scans)
        recorded = self._file
        if wanted and recorded.is_same:
            yield wanted, True
            return
        at = wanted.start
        while at < wanted.stop:
            row = recorded.keyframe(at)
            held = recorded.chunk_scans(row)
            end = wanted.stop if held.stop == recorded.scans.stop else min(held.stop, wanted.stop)
            agrees = not isinstance(recorded.program, str) and recorded.differs(row) is None
            if not agrees and self.differs is None:
                found = None if isinstance(recorded.program, str) else recorded.differs(row)
                self.differs = at if found is None else found
            yield range(at, end), agrees
            at = end

    def _kept(self, scans: range) -> Iterator[Moment]:
        """The PLC at scans of one chunk, with the memory of the keyframe before; at its last scan that of the next one."""
        moment = Moment(self, Memory(self._file.memory_size, self.areas))
        for scan in scans:
            moment.memory.restore(self._file.chunk(min(scan + 1, self._file.scans.stop - 1)).state.memory)
            moment.scans, moment.now_ns = scan, self._file.now_ns(scan)
            yield moment
