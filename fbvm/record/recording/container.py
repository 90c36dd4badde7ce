"""The blocks of a recording's file, which `file_writer` writes and `file_reader` reads.

A file is `MAGIC` and blocks, and only grows.  A block is its head and its payload, compressed by zlib.  The head is kind
(1 byte), size of the payload (4), CRC-32 of payload and of the other fields (4), number of the PLC (2), first scan (8), number
of scans (4), the lowest byte first.  A block that is cut off ends the file, so it can be read while it grows.

    START      JSON: the format, the version of fbvm that wrote it
    PLC        JSON: name, program and description of a PLC
    KEYFRAME   a PLC and its units before a scan (`codec`)
    SCANS      times, inputs and fingerprints of scans behind a keyframe (`codec`)
    END        JSON: the recording was closed; the inputs of a scan that had begun
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from typing import BinaryIO, NamedTuple

MAGIC = b"FBVMREC1"
START, PLC, KEYFRAME, SCANS, END = 1, 2, 3, 4, 5
LARGEST_BYTES = 1 << 29
"""Most bytes of a payload, unpacked."""
LARGEST_JSON_BYTES = 1 << 26
"""Most bytes of one that is JSON."""
MOST_SCANS = 1 << 31
"""More than a block ever has."""
MOST_PLCS = 1 << 16
LEVEL = 1
"""Of compression: a higher one takes three times as long for a tenth less."""
_HEAD = struct.Struct("<BIIHQI")
_CHECKED = struct.Struct("<BHQI")


class RecordingError(ValueError):
    """The file is no recording or is damaged; the message says in which way."""


class BlockHead(NamedTuple):
    """What the head of a block says, and where in the file the block begins."""

    kind: int
    at: int
    plc: int
    first: int
    scans: int


def write_block(file: BinaryIO, kind: int, payload: bytes, plc: int, first: int, scans: int) -> int:
    """Writes a block and flushes the file; returns the size of the block in bytes."""
    packed = zlib.compress(payload, LEVEL)
    file.write(_HEAD.pack(kind, len(packed), _checksum(packed, kind, plc, first, scans), plc, first, scans) + packed)
    file.flush()
    return _HEAD.size + len(packed)


def _checksum(packed: bytes, kind: int, plc: int, first: int, scans: int) -> int:
    return zlib.crc32(_CHECKED.pack(kind, plc, first, scans), zlib.crc32(packed))


def heads(file: BinaryIO) -> Iterator[BlockHead]:
    """The heads of the complete blocks from the position of the file on, which is then behind the last one.

    Raises RecordingError where no block begins."""
    at = file.tell()
    end = file.seek(0, 2)
    file.seek(at)
    while len(read := file.read(_HEAD.size)) == _HEAD.size:
        kind, size, _, plc, first, scans = _HEAD.unpack(read)
        if kind not in (START, PLC, KEYFRAME, SCANS, END) or scans > MOST_SCANS:
            raise RecordingError(f"the file is damaged at byte {at}")
        behind = at + _HEAD.size + size
        if behind > end:
            break
        head, at = BlockHead(kind, at, plc, first, scans), behind
        yield head
        file.seek(at)
    file.seek(at)


def read_block(file: BinaryIO, head: BlockHead) -> bytes:
    """The payload of a block.  Raises RecordingError if it is damaged."""
    file.seek(head.at)
    kind, size, check, plc, first, scans = _HEAD.unpack(file.read(_HEAD.size))
    if size > LARGEST_BYTES:
        raise RecordingError(f"the block at byte {head.at} is too large")
    packed = file.read(size)
    if (kind, plc, first, scans) != (head.kind, head.plc, head.first, head.scans) or (
        _checksum(packed, kind, plc, first, scans) != check):  # fmt: skip
        raise RecordingError(f"the block at byte {head.at} is damaged")
    engine, most = zlib.decompressobj(), LARGEST_BYTES if kind in (KEYFRAME, SCANS) else LARGEST_JSON_BYTES
    try:
        payload = engine.decompress(packed, most)
    except zlib.error:
        raise RecordingError(f"the block at byte {head.at} is damaged") from None
    if not engine.eof:
        raise RecordingError(f"the block at byte {head.at} does not end, or is too large")
    return payload
