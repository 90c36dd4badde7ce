"""Where in the file of a recording the blocks of each PLC are, found without unpacking them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import BinaryIO

from fbvm.record.recording.container import END, KEYFRAME, PLC, SCANS, BlockHead, RecordingError, heads


@dataclass
class ChunkBlocks:
    """A keyframe and the scans behind it.  `cut` is the number from which on the PLC was put back and went another way."""

    keyframe: BlockHead
    segments: list[BlockHead] = field(default_factory=list)
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


@dataclass
class PlcBlocks:
    """The blocks of one PLC: its description, its chunks in the order of scans, its end."""

    description: BlockHead
    chunks: list[ChunkBlocks] = field(default_factory=list)
    end: BlockHead | None = None
    keyframes: dict[int, BlockHead] = field(default_factory=dict)
    """All of them by their byte in the file."""


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
            found.chunks[-1].segments.append(head)
        else:
            _begin(found, head)


def _fits(found: PlcBlocks, head: BlockHead) -> bool:
    return bool(found.chunks) and found.chunks[-1].end == head.first and head.scans > 0


def _begin(found: PlcBlocks, head: BlockHead) -> None:
    """A keyframe: scans from its number on that are there already give way to those that follow it."""
    chunks = found.chunks
    while chunks and chunks[-1].first >= head.first:
        chunks.pop()
    if chunks and head.first < chunks[-1].end:
        chunks[-1].cut = head.first
    if chunks and head.first > chunks[-1].end:
        chunks.clear()  # scans between them are not recorded
    chunks.append(ChunkBlocks(head))
    found.keyframes[head.at] = head
    found.end = None
