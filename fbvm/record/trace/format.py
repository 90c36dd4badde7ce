"""The format of trace files, which `trace.writer` writes and `trace.reader` reads.

A file is `MAGIC` and chunks: kind (1 byte), size (4 bytes), CRC-32 of the payload (4 bytes), number of the first scan (8)
and of scans (4), payload compressed by zlib.  The first chunk is the HEADER, JSON.  Each BLOCK holds some scans and can
be read without those before it: it begins with LINES, the memory before its first scan.  A chunk that is cut off ends
the file, so it can be read while it grows.

Records follow: a tag, then unsigned numbers of 7 bits a byte, the lowest first, the top bit set if more follow.

    PHASE      phase, then LINES         memory changed since the last PHASE by something other than a recorded write
    SCAN       number, time ns           a scan begins; both as the difference from the scan before in the block
    FRAME      body, base, site + 1, caller + 1     a body began; frames are numbered from 0 in each scan
    END        frame                     a body ended
    STATEMENT  frame, site               is about to be executed
    READ       frame, site + 1, offset, bit, size, bytes
    WRITE      frame, site + 1, offset, bit, size, old bytes, new bytes
    CONTACT    frame, site, value, JSON of the element (its size, bytes)
    CUT                                  the scan has executed more statements, of which nothing is recorded
    NETWORK    JSON of an event of the network (its size, bytes), before the PHASE of the I/O refresh: time ns, kind, local
               host and port, remote host and port, 1 if the unit sent it, 1 if it is mirrored, hexadecimal data

LINES are a count, then for each line of LINE bytes of memory that changed: the difference of its number from the one
before, and the exclusive or of its old and new bytes.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO

from fbvm.machine.plc import Phase

MAGIC = b"FBVMTRC1"
HEADER, BLOCK = 1, 2
LINE = 32
"""Bytes of memory that are compared and written together."""
PHASE, SCAN, FRAME, END, STATEMENT, READ, WRITE, CONTACT, NETWORK, CUT = range(10)
PHASES = (Phase.INPUTS, Phase.PROGRAM, Phase.REFRESH)
_CHUNK = struct.Struct("<BIIQI")
LARGEST_BYTES = 1 << 29
LARGEST_HEADER_BYTES = 1 << 26
"""Most bytes of a block and of the header, unpacked."""
LONGEST_SHIFT = 140
"""No number in a block takes more than 20 bytes."""


class TraceError(ValueError):
    """The file is no trace or is damaged; the message says in which way."""


@dataclass(frozen=True)
class Chunk:
    """The position of a chunk in the file, its first scan and the number of its scans."""

    kind: int
    at: int
    first: int
    scans: int


def write_chunk(file: BinaryIO, kind: int, payload: bytes, first: int = 0, scans: int = 0) -> int:
    """Writes a chunk and flushes the file; returns the size of the chunk in bytes."""
    packed = zlib.compress(payload, 6)
    file.write(_CHUNK.pack(kind, len(packed), zlib.crc32(packed), first, scans) + packed)
    file.flush()
    return _CHUNK.size + len(packed)


def chunks(file: BinaryIO) -> Iterator[Chunk]:
    """The complete chunks from the position of the file on, which is then behind the last one."""
    at = file.tell()
    while len(head := file.read(_CHUNK.size)) == _CHUNK.size:
        kind, size, _, first, scans = _CHUNK.unpack(head)
        file.seek(size, 1)
        if size and not _is_there(file):
            break
        chunk, at = Chunk(kind, at, first, scans), file.tell()
        yield chunk
        file.seek(at)
    file.seek(at)


def _is_there(file: BinaryIO) -> bool:
    """True if the byte before this place exists."""
    file.seek(-1, 1)
    return len(file.read(1)) == 1


def read_chunk(file: BinaryIO, at: int) -> bytes:
    """The payload of the chunk at a position.  Raises TraceError if it is damaged."""
    file.seek(at)
    kind, size, check, *_ = _CHUNK.unpack(file.read(_CHUNK.size))
    if size > LARGEST_BYTES:
        raise TraceError(f"the chunk at byte {at} is too large")
    packed = file.read(size)
    if zlib.crc32(packed) != check:
        raise TraceError(f"the chunk at byte {at} is damaged")
    engine = zlib.decompressobj()
    payload = engine.decompress(packed, LARGEST_HEADER_BYTES if kind == HEADER else LARGEST_BYTES)
    if not engine.eof:
        raise TraceError(f"the chunk at byte {at} does not end, or is too large")
    return payload


def put(out: bytearray, *numbers: int) -> None:
    """Appends unsigned numbers."""
    for number in numbers:
        while number > 0x7F:
            out.append(number & 0x7F | 0x80)
            number >>= 7
        out.append(number)


class Cursor:
    """Reads numbers and bytes from a block.  Raises IndexError behind its end."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, 0

    @property
    def more(self) -> bool:
        return self.at < len(self.data)

    def number(self) -> int:
        value, shift = 0, 0
        while True:
            byte = self.data[self.at]
            self.at += 1
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                return value
            shift += 7
            if shift > LONGEST_SHIFT:
                raise IndexError("a number is too large")

    def bytes(self, size: int) -> bytes:
        self.at += size
        if self.at > len(self.data):
            raise IndexError("the block ends too early")
        return self.data[self.at - size : self.at]


def xor(a: bytes | bytearray, b: bytes) -> bytes:
    """Exclusive or of two runs of bytes of one length."""
    return (int.from_bytes(a, "little") ^ int.from_bytes(b, "little")).to_bytes(len(a), "little")
