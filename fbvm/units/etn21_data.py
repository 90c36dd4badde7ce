"""Moves socket data between PLC memory and bytes by the data address of a parameter area (area code, word, bit).

A word is two bytes of the stream, high byte first; an odd last byte is the high byte of the last word.  From W343
6-2-1 p117 and W421 6-8 p151.
"""

from __future__ import annotations

from array import array
from sys import byteorder

from fbvm.units import etn21_codes as codes
from fbvm.units.etn21_map import Parameters
from fbvm.units.unit import AreaMemory

AREA_OF_CODE: dict[int, tuple[str, int, int]] = {  # code: (area, first word, last word)
    0xB0: ("CIO", 0, 6143),
    0xB1: ("W", 0, 511),  # assumed: absent from W343's list, but the standard FINS code
    0xB2: ("H", 0, 511),
    0xB3: ("A", 448, 959),  # A000..A447 are read-only
    0x82: ("D", 0, 32767),
    0x98: ("E0", 0, 32767),  # current bank, assumed to be bank 0
    **{0xA0 + bank: (f"E{bank:X}", 0, 32767) for bank in range(13)},
}


def check_address(memory: AreaMemory, parameters: Parameters) -> int:
    """0000, or the code that the data address deserves: 1101 or 1103.

    A block that runs past the end of its area is 1101, assumed, because no table of the switches has 1104."""
    found = AREA_OF_CODE.get(parameters.address_high >> 8)
    if found is None:
        return codes.AREA_CODE
    area, first, last = found
    try:
        length = len(memory.words(area))
    except KeyError:
        return codes.AREA_CODE
    begin = _first_word(parameters)
    end = begin + ((parameters.size_bytes + 1) // 2 or 1)
    if begin < first or end > last + 1 or end > length:
        return codes.AREA_CODE
    return codes.BIT_NUMBER if parameters.address_low & 0xFF else codes.NORMAL_END


def fetch(memory: AreaMemory, parameters: Parameters) -> bytes:
    """The `count` bytes to send, from an address that `check_address` has passed."""
    words, begin, size_bytes = _area(memory, parameters), _first_word(parameters), parameters.size_bytes
    data = array("H", words[begin : begin + (size_bytes + 1) // 2].tobytes())
    if byteorder == "little":
        data.byteswap()
    return data.tobytes()[:size_bytes]


def store(memory: AreaMemory, parameters: Parameters, data: bytes, odd_filler: int | None) -> None:
    """Write received bytes; words after the last one stay.

    The low byte beside an odd last byte becomes `odd_filler`, or stays if that is None."""
    if not data:
        return
    there, begin = _area(memory, parameters), _first_word(parameters)
    end = begin + (len(data) + 1) // 2
    if len(data) % 2:
        data += bytes((there[end - 1] & 0xFF if odd_filler is None else odd_filler,))
    words = array("H", data)
    if byteorder == "little":
        words.byteswap()
    there[begin:end] = memoryview(words)


def _area(memory: AreaMemory, parameters: Parameters) -> memoryview:
    """The words of the area that the data address names."""
    return memory.words(AREA_OF_CODE[parameters.address_high >> 8][0])


def _first_word(parameters: Parameters) -> int:
    """The address in that area."""
    return (parameters.address_high & 0xFF) << 8 | parameters.address_low >> 8
