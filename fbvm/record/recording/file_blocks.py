"""Where in the file of a recording the blocks of each PLC are, found without unpacking them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, BinaryIO, NamedTuple, overload

from fbvm.record.recording.container import END, KEYFRAME, PLC, SCANS, BlockHead, RecordingError, heads


class ChunkBlocks(NamedTuple):
    """A keyframe and the scans behind it.  `cut` is the number from which on the PLC was put back and went another way."""

    keyframe: BlockHead
    segments: tuple[BlockHead, ...] = ()
    cut: int | None = None

    @property
    def first(self) -> int:
        """The number of the first scan."""
        return self.keyframe.first

    @property
    def end(self) -> int:
        """The number behind the last scan."""
        end = self.segments[-1].first + self.segments[-1].scans if self.segments else self.first
        return end if self.cut is None else min(end, self.cut)


class Chunks(Sequence[ChunkBlocks]):
    """The chunks of a PLC in the order of scans.

    The file of a day has tens of thousands.  They are kept as plain tuples of numbers, which Python's garbage collector does not
    visit: each of its rounds would take longer than to show a scan."""

    def __init__(self) -> None:
        self.firsts: list[int] = []
        """The number of the first scan of each chunk."""
        self._rows: list[tuple[Any, ...]] = []

    @overload
    def __getitem__(self, at: int) -> ChunkBlocks: ...

    @overload
    def __getitem__(self, at: slice) -> list[ChunkBlocks]: ...

    def __getitem__(self, at: int | slice) -> ChunkBlocks | list[ChunkBlocks]:
        if isinstance(at, slice):
            return [self[number] for number in range(*at.indices(len(self)))]
        keyframe, segments, cut = self._rows[at]
        return ChunkBlocks(BlockHead(*keyframe), tuple([BlockHead(*segment) for segment in segments]), cut)

    def __len__(self) -> int:
        return len(self._rows)

    def add(self, keyframe: BlockHead) -> None:
        """Adds a chunk that has no scans yet."""
        self.firsts.append(keyframe.first)
        self._rows.append((tuple(keyframe), (), None))

    def add_scans(self, head: BlockHead) -> None:
        """Adds scans to the last chunk."""
        keyframe, segments, cut = self._rows[-1]
        self._rows[-1] = keyframe, (*segments, tuple(head)), cut

    def cut(self, scan: int) -> None:
        """Forgets this scan and those behind it."""
        while self.firsts and self.firsts[-1] >= scan:
            del self.firsts[-1], self._rows[-1]
        if self.firsts and scan < self[-1].end:
            keyframe, segments, _ = self._rows[-1]
            self._rows[-1] = keyframe, segments, scan

    def clear(self) -> None:
        """Forgets all."""
        self.firsts.clear()
        self._rows.clear()


@dataclass
class PlcBlocks:
    """The blocks of one PLC: its description, its chunks in the order of scans, its end."""

    description: BlockHead
    chunks: Chunks = field(default_factory=Chunks)
    end: BlockHead | None = None
    keyframes: dict[int, tuple[int, ...]] = field(default_factory=dict)
    """The heads of all of them by their byte in the file."""


def find_blocks(file: BinaryIO, plcs: dict[int, PlcBlocks]) -> None:
    """Adds the blocks from the position of the file on to those of their PLCs.

    Raises RecordingError for blocks that do not fit together."""
    for head in heads(file):
        if head.kind == PLC:
            if plcs.setdefault(head.plc, PlcBlocks(head)).description is not head:
                raise RecordingError(f"the file is damaged at byte {head.at}: a second PLC of one number")
            continue
        found = plcs.get(head.plc)
        if head.kind not in (KEYFRAME, SCANS, END):
            continue
        if found is None or (head.kind == SCANS and not _fits(found, head)):
            raise RecordingError(f"the file is damaged at byte {head.at}: what belongs before it is missing")
        if head.kind == END:
            found.end = head
        elif head.kind == SCANS:
            found.chunks.add_scans(head)
        else:
            _begin(found, head)


def _fits(found: PlcBlocks, head: BlockHead) -> bool:
    return bool(found.chunks) and found.chunks[-1].end == head.first and head.scans > 0


def _begin(found: PlcBlocks, head: BlockHead) -> None:
    """A keyframe: scans from its number on that are there already give way to those that follow it."""
    chunks = found.chunks
    chunks.cut(head.first)
    if chunks and head.first > chunks[-1].end:
        chunks.clear()  # scans between them are not recorded
    chunks.add(head)
    found.keyframes[head.at] = tuple(head)
    found.end = None
