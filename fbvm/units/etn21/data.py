"""Moves socket data between PLC memory and bytes by the data address of a parameter area (area code, word, bit).

A word is two bytes of the stream, high byte first; an odd last byte is the high byte of the last word.  From W343
6-2-1 p117 and W421 6-8 p151.
"""

from __future__ import annotations

from array import array
from sys import byteorder

from fbvm.units.contract import AreaMemory

LITTLE_ENDIAN = byteorder == "little"
LOW, HIGH = (0, 1) if LITTLE_ENDIAN else (1, 0)
"""Where the bytes of a word lie in the host's memory."""
AREA_OF_CODE: dict[int, tuple[str, int]] = {  # code: (area, words of it that a data address may name)
    0xB0: ("CIO", 6144),
    0xB1: ("W", 512),  # assumed: absent from W343's list, but the standard FINS code
    0xB2: ("H", 512),
    0xB3: ("A", 960),
    0x82: ("D", 32768),
    0x98: ("E0", 32768),  # current bank, assumed to be bank 0
    **{0xA0 + bank: (f"E{bank:X}", 32768) for bank in range(13)},
}


def lengths(memory: AreaMemory) -> dict[int, int]:
    """How many words a data address may name in this memory, by area code; codes of areas that it lacks are left out."""
    found = {}
    for code, (area, words) in AREA_OF_CODE.items():
        try:
            found[code] = min(words, len(memory.words(area)))
        except KeyError:
            continue
    return found


def fetch(memory: AreaMemory, high: int, low: int, size_bytes: int) -> bytes:
    """The bytes to send, from a data address that the unit has checked."""
    words, begin = memory.words(AREA_OF_CODE[high >> 8][0]), (high & 0xFF) << 8 | low >> 8
    data = array("H", words[begin : begin + (size_bytes + 1) // 2].tobytes())
    if LITTLE_ENDIAN:
        data.byteswap()
    return data.tobytes()[:size_bytes]


def store(memory: AreaMemory, high: int, low: int, data: bytes, odd_filler: int | None) -> None:
    """Write received bytes where a data address says that the unit has checked; words after the last one stay.

    The low byte beside an odd last byte becomes `odd_filler`, or stays if that is None."""
    there = memory.words(AREA_OF_CODE[high >> 8][0]).cast("B")
    begin = ((high & 0xFF) << 8 | low >> 8) * 2
    end = begin + len(data)
    if len(data) % 2:
        data += bytes((there[end + LOW - 1] if odd_filler is None else odd_filler,))
        end += 1
    there[begin + HIGH : end : 2] = data[::2]  # strides cost less than words that are turned
    there[begin + LOW : end : 2] = data[1::2]
