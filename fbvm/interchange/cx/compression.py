"""The compression of `.cxp` files: one stream of the PKWARE Data Compression Library ("implode" of 1990), without a header.

Byte 0 is the mode of literals, byte 1 the size of the dictionary; behind them stands a stream of bits, the lowest bit of each
byte first.  A 0 begins a literal, a 1 a copy: its length, then its distance.  Length 519 is the end.  There is no checksum.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

from fbvm.base.files import SOURCE_BYTES

MOST_BYTES = SOURCE_BYTES
"""Decompressed bytes beyond which a stream is refused: as many as of a project that is not compressed."""
LONGEST, END = 518, 519
"""The longest copy, and the length that ends the stream."""
_LENGTHS = ((3, 0), (2, 0), (4, 0), (5, 0), (6, 0), (7, 0), (8, 0), (9, 0), (10, 1), (12, 2), (16, 3), (24, 4), (40, 5),
            (72, 6), (136, 7), (264, 8))  # fmt: skip
"""By symbol, the shortest length of a copy and the number of bits that are added to it."""
_LENGTH_BITS = (2, 3, 3, 3, 4, 4, 4, 5, 5, 5, 5, 6, 6, 6, 7, 7)
_DISTANCE_BITS = (2, 4, 4, *[5] * 4, *[6] * 15, *[7] * 26, *[8] * 16)
_LITERALS = {
    4: "20", 5: "45 61 65 69 6C 6E 6F 72-75", 6: "2D 31 41 43 44 49 4C 4E 4F 52-54 62-64 66-68 6D 70",
    7: "0A 0D 28 29 2C 2E 30 32-35 37 38 3D 42 46 4D 50 55 6B 77", 8: "09 22 27 2A 2F 36 39 3A 47 48 57 5B 5F 76 78 79",
    9: "2B 3E 4B 56 58 59 5D", 10: "21 24 26 71 7A", 11: "00 3C 3F 4A 51 5A 5C 6A 7B 7C",
    12: "01-08 0B 0C 0E-19 1B-1F 23 25 3B 40 5E 60 7D-7F B0-DF E1 E5 E9 EE F2-F4",
    13: "1A 80-AF E0 E2-E4 E6-E8 EA-ED EF-F1 F5-FF"}  # fmt: skip
"""Number of bits of the code of a literal -> the bytes that have it, in hexadecimal."""


class CompressionError(Exception):
    """A stream that cannot be decompressed; the message says where and why."""


class _Code(NamedTuple):
    """A prefix code: for each number of bits how many symbols have so many, and the symbols in the order of their codes."""

    counts: tuple[int, ...]
    symbols: tuple[int, ...]


def _code(bits: tuple[int, ...]) -> _Code:
    return _Code(tuple(bits.count(length) for length in range(max(bits) + 1)),
                 tuple(sorted(range(len(bits)), key=lambda symbol: (bits[symbol], symbol))))


@cache
def _codes() -> tuple[_Code, _Code, _Code]:
    """The codes of lengths, distances and literals."""
    literals = [0] * 256
    for length, ranges in _LITERALS.items():
        for part in ranges.split():
            first, _, last = part.partition("-")
            for byte in range(int(first, 16), int(last or first, 16) + 1):
                literals[byte] = length
    return _code(_LENGTH_BITS), _code(_DISTANCE_BITS), _code(tuple(literals))


class _Bits:
    """The bits of a stream, the lowest of each byte first."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, 16

    def take(self, count: int) -> int:
        """The next `count` bits as a number, its lowest bit first.  Raises CompressionError behind the end."""
        value = 0
        for position in range(count):
            byte, bit = divmod(self.at, 8)
            if byte >= len(self.data):
                raise CompressionError(f"the file ends in the middle, at byte {len(self.data)}: it is cut")
            value |= (self.data[byte] >> bit & 1) << position
            self.at += 1
        return value

    def symbol(self, code: _Code) -> int:
        """The next symbol; bits of a code come highest first and inverted.  Raises CompressionError."""
        value = first = index = 0
        for count in code.counts[1:]:
            value = value * 2 + 1 - self.take(1)
            if value - first < count:
                return code.symbols[index + value - first]
            index += count
            first = (first + count) * 2
        raise CompressionError(f"byte {self.at // 8} is damaged")  # codes are complete: no bits are without a symbol


def is_compressed(data: bytes) -> bool:
    """Whether bytes begin as a stream does."""
    return data[:1] in (b"\0", b"\1") and data[1:2] in (b"\4", b"\5", b"\6")


def decompress(data: bytes, most_bytes: int = MOST_BYTES) -> bytes:
    """The bytes that a stream stands for.  Raises CompressionError for a stream that is cut, damaged, or longer than
    `most_bytes`."""
    if not is_compressed(data):
        raise CompressionError("the first two bytes are those of no compressed project")
    lengths, distances, literals = _codes()
    bits, coded, dictionary = _Bits(data), data[0] == 1, data[1]
    made = bytearray()
    while True:
        if len(made) > most_bytes:
            raise CompressionError(f"it is longer than {most_bytes} bytes")
        if not bits.take(1):
            made.append(bits.symbol(literals) if coded else bits.take(8))
            continue
        base, extra = _LENGTHS[bits.symbol(lengths)]
        length = base + bits.take(extra)
        if length == END:
            return bytes(made)
        low = 2 if length == 2 else dictionary
        distance = (bits.symbol(distances) << low) + bits.take(low) + 1
        if distance > len(made):
            raise CompressionError(f"byte {bits.at // 8} is damaged: it repeats what stands before the beginning")
        piece = made[len(made) - distance :][:length]
        made += (piece * (length // distance + 1))[:length]


# --- compressing ------------------------------------------------------------------------------------------------------


class _Writer:
    def __init__(self) -> None:
        self.made, self.bits, self.count = bytearray((0, 6)), 0, 0

    def put(self, value: int, count: int) -> None:
        """Append `count` bits of a number, its lowest first."""
        self.bits |= value << self.count
        self.count += count
        while self.count >= 8:
            self.made.append(self.bits & 255)
            self.bits >>= 8
            self.count -= 8

    def put_symbol(self, word: tuple[int, int]) -> None:
        """Append a code with its number of bits: the highest bit first, inverted."""
        code, length = word
        for position in reversed(range(length)):
            self.put(1 - (code >> position & 1), 1)


def _words(code: _Code) -> dict[int, tuple[int, int]]:
    """By symbol, its code and the number of bits."""
    found, value, symbols = {}, 0, iter(code.symbols)
    for length, count in enumerate(code.counts):
        for _ in range(count):
            found[next(symbols)] = value, length
            value += 1
        value *= 2
    return found


def compress(data: bytes) -> bytes:
    """A stream that stands for the bytes: plain literals, a dictionary of 4096 bytes, as CX-Programmer writes it.  Which
    repetitions are used differs from the tool's choice."""
    writer, (lengths, distances, _) = _Writer(), _codes()
    length_words, distance_words = _words(lengths), _words(distances)
    for literal, length, distance in _matches(data):
        if not length:
            writer.put(0, 1)
            writer.put(literal, 8)
            continue
        _put_length(writer, length_words, length)
        writer.put_symbol(distance_words[distance - 1 >> 6])
        writer.put((distance - 1) & (1 << 6) - 1, 6)
    _put_length(writer, length_words, END)
    writer.put(0, 7)  # fills the last byte
    return bytes(writer.made)


def _put_length(writer: _Writer, words: dict[int, tuple[int, int]], length: int) -> None:
    symbol, base, extra = next((symbol, base, extra) for symbol, (base, extra) in enumerate(_LENGTHS)
                               if base <= length < base + (1 << extra))
    writer.put(1, 1)
    writer.put_symbol(words[symbol])
    writer.put(length - base, extra)


def _matches(data: bytes) -> Iterator[tuple[int, int, int]]:
    """(literal, 0, 0) or (0, length, distance), so that all together are the data; the last place of three equal bytes is
    taken."""
    seen: dict[bytes, int] = {}
    at = 0
    while at < len(data):
        place = seen.get(data[at:at + 3], -4097)
        length = 0
        if at - place <= 4096 and at + 3 <= len(data):
            length = 3
            while length < LONGEST and at + length < len(data) and data[place + length] == data[at + length]:
                length += 1
        yield (0, length, at - place) if length else (data[at], 0, 0)
        for behind in range(at, at + max(length, 1)):
            seen[data[behind:behind + 3]] = behind
        at += max(length, 1)
