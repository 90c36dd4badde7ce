"""Reads the file of a recording: the scans of each PLC by its name, also while the file grows.

    with RecordingFile.open("run.fbtrace") as recording:
        recorded = recording["pump"]      its scans, as those of a run in memory: `recorded.follow(listener, range(41, 42))`
        source = FileScans(recorded)      for charts, tables, causes and pages: `source.at(41).read("D200")`

The program of a PLC is in the file as text.  It is compiled here, and executed where that gives the memory that was recorded.
"""

from __future__ import annotations

import gc
import json
from bisect import bisect_right
from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, BinaryIO

from fbvm.base.files import open_file
from fbvm.base.memory import Snapshot
from fbvm.code.image import Image
from fbvm.machine.plc import Plc, Stopped
from fbvm.machine.scan.refresh import Attached
from fbvm.record.recording.chunks import Chunk, ScanInputs
from fbvm.record.recording.container import MAGIC, START, BlockHead, RecordingError, heads, read_block
from fbvm.record.recording.damage import damages
from fbvm.record.recording.file_blocks import ChunkBlocks, PlcBlocks, find_blocks
from fbvm.record.recording.file_writer import FORMAT, fingerprint
from fbvm.record.recording.keyframe_codec import KeyframeReader
from fbvm.record.recording.plain_data import load, number
from fbvm.record.recording.program_text import ProgramText
from fbvm.record.recording.recorded import RecordedPlc
from fbvm.record.recording.replay import RecordedLink, Replay
from fbvm.record.recording.scan_codec import Segment, decode_inputs, decode_scans
from fbvm.record.trace import symbols
from fbvm.record.trace.description import describe
from fbvm.record.trace.scan_source import ScanSource

KEPT_CHUNKS = 4
"""Chunks that are kept unpacked."""


class RecordingFile:
    """A recording in a file that is open for reading: each PLC by its name.

    `libraries` take the place of the folders of libraries that the recording names, `images` are programs by the names of PLCs
    that are used instead of their texts, `version` is that of fbvm here.  Raises RecordingError if the file is no recording."""

    def __init__(self, file: BinaryIO, libraries: Sequence[Path] = (), images: Mapping[str, Image] | None = None,
                 version: str = "") -> None:  # fmt: skip
        self._file, self._libraries, self._images, self._version = file, libraries, images or {}, version
        if file.read(len(MAGIC)) != MAGIC:
            raise RecordingError("this is no recording of fbvm")
        start = next(heads(file), None)
        if start is None or start.kind != START:
            raise RecordingError("the recording has no beginning yet")
        with damages("the recording's beginning is damaged"):
            head = json.loads(read_block(file, start))
            if head["format"] != FORMAT:
                raise RecordingError(f"a recording of format {head['format']}; this version of fbvm reads format {FORMAT}")
            self.version = str(head["fbvm"])
            """The version of fbvm that wrote it."""
            self.about = dict(head["about"])
            """What the writer has said of the run."""
        self._end = file.tell()
        self._blocks: dict[int, PlcBlocks] = {}
        self._plcs: dict[str, FileRecordedPlc] = {}
        self.refresh()

    @classmethod
    def open(cls, path: Path | str, libraries: Sequence[Path] = (), images: Mapping[str, Image] | None = None,
             version: str = "") -> RecordingFile:  # fmt: skip
        """Opens the file of a recording; close it, or use it in a `with` statement.  Raises OSError, RecordingError."""
        file = open_file(path)
        try:
            return cls(file, libraries, images, version)
        except BaseException:
            file.close()
            raise

    def close(self) -> None:
        """Closes the file."""
        self._file.close()

    def __enter__(self) -> RecordingFile:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def refresh(self) -> None:
        """Finds the blocks that have been written to the file since it was opened."""
        self._file.seek(self._end)
        find_blocks(self._file, self._blocks)
        self._end = self._file.tell()
        for blocks in list(self._blocks.values())[len(self._plcs) :]:
            made = FileRecordedPlc(self._file, blocks, self._libraries, self._images, self.version, self._version)
            if made.name in self._plcs:
                raise RecordingError(f"two PLCs are called {made.name}")
            self._plcs[made.name] = made

    def __getitem__(self, name: str) -> FileRecordedPlc:
        return self._plcs[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._plcs)

    @property
    def is_complete(self) -> bool:
        """True if the recording was closed; else it was cut off, or still grows."""
        return bool(self._blocks) and all(blocks.end for blocks in self._blocks.values())


class _Described(ScanSource):
    """What the file tells of the PLC."""

    scans = range(0)

    def moments(self, scans: range | None = None) -> Iterator[Any]:
        return iter(())

    def follow(self, follower: object, scans: range | None = None) -> None:
        """It has no scans."""


class FileRecordedPlc(RecordedPlc):
    """What the file of a recording has of one PLC."""

    def __init__(self, file: BinaryIO, blocks: PlcBlocks, libraries: Sequence[Path], images: Mapping[str, Image],
                 made_by: str, version: str) -> None:  # fmt: skip
        self._file, self._blocks, self._libraries = file, blocks, libraries
        self.made_by, self.version = made_by, version
        """The versions of fbvm that made the recording, and that reads it."""
        with damages("what the recording tells of a PLC is damaged"):
            self.head: dict[str, Any] = load(read_block(file, blocks.description))
            """What `trace.description` reads."""
            self.name, self._text = str(self.head["name"]), ProgramText.of(self.head["program"])
            self._substituted = tuple(number(body) for body in self.head["substituted"])
            self._fingerprint, self._bodies = str(self.head["image"]), list(self.head["bodies"])
            self._engine = "python" if self.head["engine"] == "python" else "auto"
            self.memory_size = describe(_Described(), self.head)
        self._given = images.get(self.name)
        self._chunks: dict[int, Chunk] = {}
        self._latest: tuple[Chunk | None, int] = None, 0
        """The chunk that was asked for last, and how many there were then."""
        self._differences: dict[tuple[int, int], int | None] = {}

    # --- the program --------------------------------------------------------------------------------------------------

    @cached_property
    def program(self) -> Image | str:
        """The program, whose memory is laid out as in the recording; or a sentence that says why it cannot be executed here."""
        found = self._given or self._text.compiled(self._libraries)
        if not gc.get_freeze_count():  # what compiling has made is old: no scan that is shown next waits for its collection
            gc.freeze()
            gc.unfreeze()
        if isinstance(found, str):
            return found
        if found.fingerprint == self._fingerprint:
            return found
        here = json.loads(json.dumps(symbols.to_data(found.symbols)))
        if found.layout.size != self.memory_size or any(here[key] != self.head[key] for key in here) or (
            [[body.name, body.kind] for body in found.bodies] != self._bodies):  # fmt: skip
            return f"its program is another one here; fbvm {self.made_by} made the recording"
        return found

    @property
    def texts(self) -> dict[str, str]:
        """The sources of the program as they were when it was recorded, by name."""
        return self._text.texts

    @cached_property
    def is_same(self) -> bool:
        """True if the same version of fbvm executes the same program: then no scan comes out differently."""
        same = isinstance(self.program, Image) and self.program.fingerprint == self._fingerprint
        return same and self.made_by == self.version

    @cached_property
    def plc(self) -> Plc:
        """A PLC with the program and the units, before its first scan.  Raises RecordingError if the program is not had."""
        if isinstance(self.program, str):
            raise RecordingError(self.program)
        with damages("what the recording tells of a PLC is damaged"):
            made = Plc(self.program, number(self.head["cycle_ns"]), engine=self._engine)
            if any(body >= len(self.program.bodies) for body in self._substituted):
                raise RecordingError("a body that the program does not have")
        for frame in self.chunk(self.scans.start).units if self._blocks.chunks else ():
            link = RecordedLink(frame.unit.address, None)
            made.units.append(Attached(frame.unit, link, link))
        return made

    @property
    def substituted(self) -> Sequence[int]:
        return self._substituted

    # --- scans --------------------------------------------------------------------------------------------------------

    @property
    def scans(self) -> range:
        chunks = self._blocks.chunks
        return range(chunks[0].first, chunks[-1].end) if chunks else range(0)

    @property
    def begun(self) -> range:
        return range(self.scans.start, self.scans.stop + (self._last is not None))

    @property
    def is_complete(self) -> bool:
        """True if the recording of this PLC was closed."""
        return self._blocks.end is not None

    @property
    def _last(self) -> tuple[int, ScanInputs] | None:
        """Time and inputs of a scan that had begun and not ended."""
        if self._blocks.end is None:
            return None
        with damages("the end of the recording is damaged"):
            begun = load(read_block(self._file, self._blocks.end))["begun"]
            return begun and (number(begun[0]), decode_inputs(begun[1], self.memory_size))

    def keyframe(self, scan: int) -> int:
        """The number of the chunk in which a scan is."""
        return max(bisect_right(self._blocks.chunks.firsts, scan) - 1, 0)

    @property
    def count(self) -> int:
        """How many chunks there are."""
        return len(self._blocks.chunks)

    def chunk_scans(self, row: int) -> range:
        """The scans of a chunk."""
        return range(self._blocks.chunks[row].first, self._blocks.chunks[row].end)

    def chunk(self, scan: int) -> Chunk:
        chunk, count = self._latest
        if chunk and chunk.first <= scan < chunk.times.end and count == len(self._blocks.chunks):
            return chunk
        blocks = self._blocks.chunks[self.keyframe(scan)]
        at = blocks.keyframe.at
        found = self._chunks.get(at)
        if found is None or found.times.end < blocks.end:
            while len(self._chunks) >= KEPT_CHUNKS:
                del self._chunks[next(iter(self._chunks))]
            found = self._chunks[at] = self._read(blocks)
        self._latest = found, len(self._blocks.chunks)
        return found

    def _read(self, blocks: ChunkBlocks) -> Chunk:
        with damages(f"the recording is damaged at scan {blocks.first}"):
            payload = read_block(self._file, blocks.keyframe)
            chunk = self._keyframes.chunk(payload, self._base)
            if chunk.first != blocks.first:
                raise RecordingError(f"the keyframe of scan {blocks.first} says that it is of scan {chunk.first}")
            for segment in self._segments(blocks):
                chunk.add_segment(segment)
            if blocks.cut is not None:
                chunk.cut(blocks.cut)
            return chunk

    def _segments(self, blocks: ChunkBlocks) -> Iterator[Segment]:
        for head in blocks.segments:
            yield decode_scans(read_block(self._file, head), head.first, head.scans)

    @cached_property
    def _keyframes(self) -> KeyframeReader:
        return KeyframeReader(self.memory_size, self.program if isinstance(self.program, Image) else None)

    def _base(self, at: int) -> list[Snapshot]:
        """The memories of the keyframe at a byte of the file."""
        head = self._blocks.keyframes.get(at)
        if head is None:
            raise ValueError(f"no keyframe at byte {at}")
        return self._keyframes.base(read_block(self._file, BlockHead(*head)))

    def inputs(self, scan: int) -> ScanInputs | None:
        chunk = self.chunk(scan)
        if scan >= chunk.times.end and self._last:
            return self._last[1]
        return chunk.inputs_of(scan)

    def now_ns(self, scan: int) -> int:
        chunk = self.chunk(scan)
        last = self._last if scan >= chunk.times.end else None
        return last[0] if last else chunk.times.at(scan)

    def applying(self, scan: int) -> damages:
        return damages(f"the recording is damaged at scan {scan}")

    # --- what comes out differently -----------------------------------------------------------------------------------

    def differs(self, row: int) -> int | None:
        """The first scan of a chunk behind which the memory is not the recorded one, as far as the recording says so; None if
        the chunk comes out the same.  The scan after which that was found out: where fingerprints are rare, it was before."""
        blocks = self._blocks.chunks[row]
        known = blocks.keyframe.at, blocks.end
        if known not in self._differences:
            self._differences[known] = self._first_difference(row)
        return self._differences[known]

    def fingerprints(self, row: int) -> dict[int, int]:
        """The fingerprints of the memory behind scans of a chunk, as far as there are any, by the numbers of the scans."""
        found: dict[int, int] = {}
        with damages(f"the recording is damaged at scan {self._blocks.chunks[row].first}"):
            for segment in self._segments(self._blocks.chunks[row]):
                found.update(enumerate(segment.memories, segment.first))
                found[segment.times.end - 1] = segment.memory
        end = self._blocks.chunks[row].end
        return {scan: memory for scan, memory in found.items() if scan < end}

    @staticmethod
    def fingerprint_of(plc: Plc) -> int:
        """The fingerprint of the memory of a PLC, as recordings have it."""
        return fingerprint(plc.memory.map[:])

    def _first_difference(self, row: int) -> int | None:
        again = Replay(self, self._blocks.chunks[row].first)
        for scan, wanted in self.fingerprints(row).items():
            try:
                again.execute(scan + 1)
            except Stopped:
                return again.plc.scans - 1
            if self.fingerprint_of(again.plc) != wanted:
                return scan
        return None
