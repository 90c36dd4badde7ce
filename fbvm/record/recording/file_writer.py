"""Writes the recording of a run into a file that only grows: each PLC's keyframes and what follows them.

`Recording(file=RecordingWriter(file))` keeps a run in memory and in the file.  `container` says what stands where.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import BinaryIO

from fbvm.base.memory import Snapshot
from fbvm.machine.plc import Plc
from fbvm.record.recording.chunks import Chunk, ScanInputs
from fbvm.record.recording.container import END, KEYFRAME, MAGIC, PLC, SCANS, START, write_block
from fbvm.record.recording.keyframe_codec import encode_keyframe
from fbvm.record.recording.plain_data import dump
from fbvm.record.recording.program_text import ProgramText
from fbvm.record.recording.scan_codec import encode_inputs, encode_scans
from fbvm.record.trace.writer import START as FIRST_BYTE
from fbvm.record.trace.writer import Depth, description

FORMAT = 1
"""The version of the format that is written and read."""
BASE_KEYFRAMES = 64
"""So many keyframes of a PLC have one base."""
PIECE_BYTES = 1 << 18
"""Inputs of this size are written without waiting for the next keyframe."""


def fingerprint(memory: bytes) -> int:
    """A checksum of a memory, without the page of the system."""
    return zlib.crc32(memoryview(memory)[FIRST_BYTE:])


@dataclass(frozen=True)
class Described:
    """What readers are told of a PLC beside its scans: the text of its program, lines with statements, and, for pages, the depth
    and the variables that are meant if none is named."""

    program: ProgramText = field(default_factory=ProgramText)
    lines: Mapping[str, Mapping[int, str]] = field(default_factory=dict)
    depth: Depth = Depth.STATEMENTS
    selected: Sequence[str] = ()


class RecordingWriter:
    """Writes to `file`, a binary file, which stays open.  `version` is that of fbvm, which readers compare with theirs, `about`
    what is said of the run, as JSON writes it.

    `verify` has a fingerprint of the memory behind every scan, which takes about 100 us each; else they stand in front of
    keyframes."""

    def __init__(self, file: BinaryIO, version: str = "", verify: bool = False,
                 about: Mapping[str, object] | None = None) -> None:  # fmt: skip
        self._file, self.verify = file, verify
        self._plcs: list[PlcWriter] = []
        file.write(MAGIC)
        self.at = len(MAGIC)
        """The size of the file in bytes."""
        self.put(START, json.dumps({"format": FORMAT, "fbvm": version, "verify": verify, "about": dict(about or {})}).encode())

    def add(self, name: str, plc: Plc, described: Described) -> PlcWriter:
        """The writer of another PLC."""
        made = PlcWriter(self, len(self._plcs), name, plc, described)
        self._plcs.append(made)
        return made

    def put(self, kind: int, payload: bytes, plc: int = 0, first: int = 0, scans: int = 0) -> None:
        """Writes a block."""
        self.at += write_block(self._file, kind, payload, plc, first, scans)

    def flush(self) -> None:
        """Writes the scans that are still in memory, so that a reader sees them."""
        for written in self._plcs:
            written.flush()


class PlcWriter:
    """Writes what a `PlcRecording` has of one PLC."""

    def __init__(self, writer: RecordingWriter, number: int, name: str, plc: Plc, described: Described) -> None:
        self._writer, self._number, self._name, self._plc, self._described = writer, number, name, plc, described
        self._chunk: Chunk | None = None
        self._written = self._inputs = 0
        """Up to which scan, and how many inputs, the last chunk is written."""
        self._bytes = 0
        """Of the inputs that are written."""
        self.memory: Callable[[], bytes] = bytes
        """Gives the memory behind the last scan."""
        self.wants_each_scan = writer.verify
        """True if `ended` is to be called behind scans without inputs, too."""
        self._settled: int | None = None
        """Its fingerprint, if that memory is not had any more."""
        self._memories: list[int] = []
        """Fingerprints behind scans that are not written yet."""
        self._base: list[Snapshot] = []
        self._base_at = self._since_base = 0
        if writer.verify:
            plc.watchers.append(self._watch)

    def _watch(self, plc: Plc) -> None:
        """Is told of each scan, so that no engine does several of them at once."""

    def began(self, chunk: Chunk, substituted: Sequence[int]) -> None:
        """Writes a new keyframe; what follows the one before is written already."""
        if self._chunk is None:
            self._describe(substituted)
        memories = chunk.memories
        same = [len(known.pages) for known in self._base] == [len(new.pages) for new in memories]
        self._since_base += 1
        has_base = same and self._since_base < BASE_KEYFRAMES
        if not has_base:
            self._base, self._base_at, self._since_base = memories, self._writer.at, 0
        payload = encode_keyframe(chunk, self._base if has_base else (), self._base_at if has_base else 0)
        self._writer.put(KEYFRAME, payload, self._number, chunk.first)
        self._chunk, self._written, self._inputs, self._bytes = chunk, chunk.first, 0, 0
        self._memories.clear()

    def _describe(self, substituted: Sequence[int]) -> None:
        plc, described = self._plc, self._described
        head = description(plc, described.depth, described.selected, described.lines)
        self._writer.put(PLC, dump({
            **head, "name": self._name, "program": described.program.as_data(), "engine": plc.engine_choice,
            "budget": plc.budget, "substituted": list(substituted),
        }), self._number)  # fmt: skip

    def settle(self) -> None:
        """Called before the memory that was told last is overwritten."""
        if self._settled is None:
            self._settled = fingerprint(self.memory())
            self.wants_each_scan = True

    def ended(self) -> None:
        """Called behind scans.  Inputs that take much room are written."""
        self._settled, self.wants_each_scan = None, self._writer.verify
        if self._writer.verify:
            self._memories.append(fingerprint(self.memory()))
        if self._chunk and self._chunk.inputs_bytes - self._bytes > PIECE_BYTES:
            self.flush()

    def flush(self) -> None:
        """Writes the scans behind the last keyframe that are not written yet."""
        chunk, first = self._chunk, self._written
        if chunk is None or (scans := chunk.times.end - first) <= 0:
            return
        if len(self._memories) != scans:
            self._memories.clear()  # not asked for, or scans were broken off
        settled = fingerprint(self.memory()) if self._settled is None else self._settled
        payload = encode_scans(chunk.times.rows(first), chunk.inputs[self._inputs :], chunk.machine,
                               settled, self._memories)  # fmt: skip
        self._writer.put(SCANS, payload, self._number, first, scans)
        self._written, self._inputs, self._bytes = chunk.times.end, len(chunk.inputs), chunk.inputs_bytes
        self._memories.clear()

    def close(self, begun: tuple[int, ScanInputs] | None) -> None:
        """Writes the rest and the end: of a scan that has begun and not ended the time and the inputs."""
        if self._writer.verify:
            self._plc.watchers.remove(self._watch)
        self.flush()
        rest = begun and [begun[0], encode_inputs(begun[1])]
        self._writer.put(END, dump({"scans": self._written, "begun": rest}), self._number)
