"""The commands for I/O memory: read, write, fill, several, transfer (W342 5-3 p170-178), forced set and reset.

A command is checked as a whole before its first element is touched."""

from __future__ import annotations

from array import array
from sys import byteorder

from fbvm.base.memory import Memory
from fbvm.machine.servicing.cpu import Asked, Refused
from fbvm.wire.fins.areas import Span, place_of, spans_of
from fbvm.wire.fins.codes import EndCode
from fbvm.wire.fins.frames import MAX_DATA_BYTES

ADDRESS_BYTES = 4
MOST_SEVERAL = 167
"""Elements of one multiple read, W342 p177."""
READ_ONLY = {"A": 448, "TF": 4096, "CNF": 4096}
"""How many elements at the beginning of an area nobody writes by FINS; that completion flags are such is assumed."""
FORCES = {0x0000: False, 0x0001: True}
"""Specifications of forces, as wireshark and fins-driver have them."""
RELEASES = {0x8000: False, 0x8001: True, 0xFFFF: None}
"""Specifications that end a force, and the value that the bit gets."""


def read(asked: Asked) -> bytes:
    """0101: elements from an address on."""
    memory, count = asked.machine.memory, asked.number(4)
    span, first = _range(memory, asked.parameters, count)
    if count * span.size > MAX_DATA_BYTES:
        raise Refused(EndCode.RESPONSE_TOO_LONG)
    return fetch(memory, span, first, count)


def write(asked: Asked) -> bytes:
    """0102: writes elements from an address on."""
    memory, count, data = asked.machine.memory, asked.number(4), asked.parameters[6:]
    span, first = _writable(memory, asked.parameters, count)
    if len(data) != count * span.size:
        raise Refused(EndCode.COUNT)
    store(memory, span, first, data)
    return b""


def fill(asked: Asked) -> bytes:
    """0103: writes one word into all from an address on."""
    memory, count = asked.machine.memory, asked.number(4)
    span, first = _writable(memory, asked.parameters, count)
    _needs_words(span)
    store(memory, span, first, asked.parameters[6:8] * count)
    return b""


def read_several(asked: Asked) -> bytes:
    """0104: single elements from anywhere, each behind its area code."""
    memory, parameters = asked.machine.memory, asked.parameters
    if len(parameters) % ADDRESS_BYTES:
        raise Refused(EndCode.TOO_SHORT)
    if len(parameters) > ADDRESS_BYTES * MOST_SEVERAL:
        raise Refused(EndCode.TOO_LONG)
    found = [_range(memory, parameters[at : at + ADDRESS_BYTES], 1) for at in range(0, len(parameters), ADDRESS_BYTES)]
    return b"".join(bytes((span.code,)) + fetch(memory, span, first, 1) for span, first in found)


def transfer(asked: Asked) -> bytes:
    """0105: copies words; ranges that overlap are copied as if through a buffer (assumed)."""
    memory, count = asked.machine.memory, asked.number(8)
    source, first = _range(memory, asked.parameters, count)
    target, begin = _writable(memory, asked.parameters[ADDRESS_BYTES:], count)
    _needs_words(source)
    _needs_words(target)
    store(memory, target, begin, fetch(memory, source, first, count))
    return b""


def force(asked: Asked) -> bytes:
    """2301: forces bits ON or OFF, or ends that.  In RUN mode it is refused (assumed)."""
    machine, parameters, count = asked.machine, asked.parameters, asked.number(0)
    if machine.is_running and not asked.registers.is_monitor:
        raise Refused(EndCode.IN_RUN)
    if len(parameters) != 2 + 6 * count:
        raise Refused(EndCode.COUNT)
    rows: list[tuple[int, str]] = []
    for at in range(2, len(parameters), 6):
        specification = asked.number(at)
        if specification not in FORCES and specification not in RELEASES:
            raise Refused(EndCode.PARAMETER)
        span, first = _range(machine.memory, parameters[at + 2 : at + 6], 1)
        if span.size != 1:
            raise Refused(EndCode.NO_AREA)
        address = str(span.address(first))
        rows.append((specification, span.area + str(first) if span.area in ("TF", "CNF") else address))
    for specification, place in rows:
        if specification in FORCES:
            machine.force(place, FORCES[specification])
        elif (value := RELEASES[specification]) is None:
            machine.unforce(place)
        else:
            machine.force(place, value)
            machine.unforce(place)
    return b""


def end_forces(asked: Asked) -> bytes:
    """2302: ends all forces."""
    if asked.machine.is_running and not asked.registers.is_monitor:
        raise Refused(EndCode.IN_RUN)
    asked.machine.unforce()
    return b""


# --- elements ---------------------------------------------------------------------------------------------------------


def fetch(memory: Memory, span: Span, first: int, count: int) -> bytes:
    """Elements as FINS has them: a word is two bytes, high byte first, a bit or a flag one."""
    if span.size == 2:
        words = array("H", memory.words(span.area)[first : first + count].tobytes())
        if byteorder == "little":
            words.byteswap()
        return words.tobytes()
    data, offset = memory.u8, 8 * memory.areas[span.area].offset + first
    return bytes(data[at >> 3] >> (at & 7) & 1 for at in range(offset, offset + count))


def store(memory: Memory, span: Span, first: int, data: bytes) -> None:
    """Writes elements from their form in FINS; of a bit's byte, bit 0 counts."""
    if span.size == 2:
        words = array("H", data)
        if byteorder == "little":
            words.byteswap()
        memory.words(span.area)[first : first + len(words)] = memoryview(words)
        return
    there, offset = memory.u8, 8 * memory.areas[span.area].offset + first
    for at, value in enumerate(data, offset):
        there[at >> 3] = there[at >> 3] & ~(1 << (at & 7)) | (value & 1) << (at & 7)


def _range(memory: Memory, address: bytes, count: int) -> tuple[Span, int]:
    """The span of an address and its first element.  Raises Refused if the area is not there, or `count` elements do not fit."""
    code, number, bit = address[0], address[1] << 8 | address[2], address[3]
    if not any(span.area in memory.areas for span in spans_of(code)):
        raise Refused(EndCode.NO_AREA)
    found = place_of(code, number, bit)
    if found is None:
        raise Refused(EndCode.FIRST_ADDRESS)
    span, first = found
    if first + count > span.elements:
        raise Refused(EndCode.ADDRESS_RANGE)
    return found


def _writable(memory: Memory, address: bytes, count: int) -> tuple[Span, int]:
    """As `_range`, for elements that are written."""
    span, first = _range(memory, address, count)
    protected = READ_ONLY.get(span.area, 0)
    if count and (first // 16 if span.has_bits else first) < protected:
        raise Refused(EndCode.READ_ONLY)
    return span, first


def _needs_words(span: Span) -> None:
    """Raises Refused for bits and flags: fill and transfer take words (assumed)."""
    if span.size != 2:
        raise Refused(EndCode.NO_AREA)
