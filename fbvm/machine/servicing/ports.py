"""The communications ports of the CPU unit: what SEND, RECV and CMND ask others by FINS, and the responses.

The ports are rows in the program's memory (fblib/omron/ladder/CX_Network.st), which an instruction fills.  All that there is to
know of one in progress lies there, so that a recording or a journal goes on with it.  W342 3-5 p50, W343 5-3 p90-91.
"""

from __future__ import annotations

from array import array
from collections.abc import Callable
from sys import byteorder
from typing import Any

from fbvm.base.areas import E_NAMES, E_PLC_ADDRESS, E_WORDS, FLAG_AREAS, NEVER, PLC_ADDRESSES
from fbvm.base.memory import STRUCTS, Memory
from fbvm.base.types import fold
from fbvm.code.image import Image
from fbvm.processor.contract import Contract
from fbvm.wire.fins.areas import WORD_CODES
from fbvm.wire.fins.codes import FATAL, NON_FATAL, EndCode
from fbvm.wire.fins.frames import COMMAND, EVERY_NODE, MAX_PARAMETER_BYTES, NO_RESPONSE, Address, Command, Header, Response

Send = Callable[[Command], tuple[int, bytes] | None]
"""Sends a command; the end code and the data of what has ended at once, None if a response is to come."""
PORTS = "CX_Ports"
TENTH_S_NS = 100_000_000
USUAL_LIMIT_NS = 2_000_000_000
"""Of a response, where the control words have 0."""
ENABLED, COMPLETION, ERRORS = 202, 203, 219
"""A202.00 to .07: port free; A203 to A210: end codes; A219.00 to .07: errors.  W340 3-25 p1031, W393 app. C p600."""
ANY_PORT = 1 << 15
"""A202.15: a port is free for automatic allotment."""
_ALL = 0xFF


class CommunicationsPorts:
    """The ports of one PLC whose program has network instructions."""

    def __init__(self, image: Image, memory: Memory) -> None:
        contract = Contract(image)
        self._memory = memory
        self._first = contract.offset(PORTS)
        _, self._count, self._size = contract.array(PORTS)
        self._record = contract.record(PORTS)
        self._command, _ = self._record.part("Command")
        states, instructions = self._record.enumeration("State"), self._record.enumeration("Instruction")
        self._free, self._asked, self._sent = (states[name] for name in ("Free", "Asked", "Sent"))
        self._send, self._recv, self._cmnd = (instructions[name] for name in ("SEND", "RECV", "CMND"))
        self._service = contract.offset("CX_Service")

    @property
    def wake_ns(self) -> int:
        """When a port has something to do by itself."""
        found = NEVER
        for port in range(self._count):
            state = self._get(port, "State")
            if state != self._free:
                found = min(found, 0 if state == self._asked else self._get(port, "Deadline"))
        return found

    def serve(self, now_ns: int, send: Send) -> bool:
        """Sends what instructions ask for, and again what got no response in time.  Returns True if a port has ended."""
        has_ended = False
        for port in range(self._count):
            state = self._get(port, "State")
            if state == self._free:  # also of an instruction that a change of mode has ended
                self._memory.words("A")[ENABLED] |= 1 << port | ANY_PORT
            elif state == self._asked:
                has_ended |= self._begin(port, now_ns, send)
            elif state == self._sent and now_ns >= self._get(port, "Deadline"):
                has_ended |= self._repeat(port, now_ns, send)
        return has_ended

    def take_response(self, response: Response) -> bool:
        """Ends the instruction that a response belongs to.  Returns False if there is none."""
        for port in range(self._count):
            if self._get(port, "State") != self._sent or self._get(port, "Service") != response.header.service:
                continue
            sent = self._sent_command(port)
            if sent.code == response.code and sent.header.destination.node == response.header.source.node:
                self._end(port, response.end_code, response.data)
                return True
        return False

    # --- one instruction ----------------------------------------------------------------------------------------------

    def _begin(self, port: int, now_ns: int, send: Send) -> bool:
        """Makes the command of an instruction and sends it.  Returns True if the instruction has ended with that."""
        made = self._made(port)
        if isinstance(made, EndCode):
            self._end(port, made, b"")
            return True
        code, parameters = made
        network, node, unit = (self._get(port, name) for name in ("Network", "Node", "Unit"))
        silent = bool(self._get(port, "Silent"))
        if node == EVERY_NODE and not silent:
            self._end(port, EndCode.HEADER, b"")
            return True
        service = (int.from_bytes(self._memory.u8[self._service : self._service + 2], "little") + 1) & _ALL
        self._memory.u8[self._service : self._service + 2] = service.to_bytes(2, "little")
        icf = COMMAND | (NO_RESPONSE if silent else 0)
        command = Command(Header(Address(network, node, unit), Address(), service, icf), code, parameters)
        data = command.to_bytes()
        begin = self._first + self._size * port + self._command
        self._memory.u8[begin : begin + len(data)] = data
        self._set(port, "Length", len(data))
        self._set(port, "Service", service)
        return self._sends(port, command, now_ns, send)

    def _repeat(self, port: int, now_ns: int, send: Send) -> bool:
        """The time for a response is over: sends the same command again, or ends with 0205."""
        if left := self._get(port, "Retries"):
            self._set(port, "Retries", left - 1)
            return self._sends(port, self._sent_command(port), now_ns, send)
        self._end(port, EndCode.TIMED_OUT, b"")
        return True

    def _sends(self, port: int, command: Command, now_ns: int, send: Send) -> bool:
        ended = send(command)
        if ended is None and not command.header.wants_response:
            ended = EndCode.NORMAL, b""
        if ended is not None:
            self._end(port, *(ended if command.header.wants_response or ended[0] else (EndCode.NORMAL, b"")))
            return True
        self._set(port, "State", self._sent)
        self._set(port, "Deadline", now_ns + (self._get(port, "Limit") * TENTH_S_NS or USUAL_LIMIT_NS))
        return False

    def _made(self, port: int) -> tuple[int, bytes] | EndCode:
        """Code and parameters of an instruction's command; an end code if there is no such address."""
        first, second, size = (self._get(port, name) for name in ("First", "Second", "Size"))
        instruction = self._get(port, "Instruction")
        if instruction == self._cmnd:
            data = self._bytes(first, size)
            return int.from_bytes(data[:2], "big"), data[2:]
        remote = _fins_address(second if instruction == self._send else first)
        if remote is None:
            return EndCode.NO_AREA
        count = size.to_bytes(2, "big")
        if instruction == self._recv:
            return 0x0101, remote + count
        return 0x0102, remote + count + self._bytes(first, 2 * size)

    def _end(self, port: int, end_code: int, data: bytes) -> None:
        """Stores what came back, and frees the port."""
        instruction, error = self._get(port, "Instruction"), end_code & ~(FATAL | NON_FATAL)
        if instruction == self._cmnd:
            error, end_code = self._store_response(port, end_code, data)
        elif instruction == self._recv and not error:
            if len(data) != 2 * self._get(port, "Size"):
                error = end_code = EndCode.COUNT
            else:
                self._store(self._get(port, "Second"), data)
        a, bit = self._memory.words("A"), 1 << port
        a[COMPLETION + port] = end_code
        a[ERRORS] = a[ERRORS] | bit if error else a[ERRORS] & ~bit
        a[ENABLED] |= bit | ANY_PORT
        self._set(port, "State", self._free)

    def _store_response(self, port: int, end_code: int, data: bytes) -> tuple[int, int]:
        """Stores command code, end code and data of a CMND.  Returns what is an error of the instruction itself, W343 p91, and
        the end code of the port."""
        if end_code == EndCode.TIMED_OUT:
            return end_code, end_code
        code = self._sent_command(port).code
        response = code.to_bytes(2, "big") + end_code.to_bytes(2, "big") + data
        if not self._get(port, "Silent"):
            if len(response) > self._get(port, "Most"):
                return EndCode.RESPONSE_TOO_LONG, EndCode.RESPONSE_TOO_LONG
            self._store(self._get(port, "Second"), response)
        too_long = end_code == EndCode.TOO_LONG and self._get(port, "Size") > MAX_PARAMETER_BYTES
        return (end_code if too_long else 0), end_code

    # --- memory -------------------------------------------------------------------------------------------------------

    def _sent_command(self, port: int) -> Command:
        """The command that a port has sent."""
        begin = self._first + self._size * port + self._command
        data = bytes(self._memory.u8[begin : begin + self._get(port, "Length")])
        destination, source = Address(*data[3:6]), Address(*data[6:9])
        return Command(Header(destination, source, data[9], data[0]), int.from_bytes(data[10:12], "big"), data[12:])

    def _get(self, port: int, name: str) -> Any:
        leaf = self._record[name]
        return STRUCTS[leaf.machine].unpack_from(self._memory.u8, self._first + self._size * port + leaf.offset)[0]

    def _set(self, port: int, name: str, value: int) -> None:
        leaf = self._record[name]
        STRUCTS[leaf.machine].pack_into(self._memory.u8, self._first + self._size * port + leaf.offset, value)

    def _bytes(self, address: int, size: int) -> bytes:
        """Bytes of words from a PLC memory address on, the high byte first."""
        area, first = _place(address) or ("D", 0)
        words = array("H", self._memory.words(area)[first : first + (size + 1) // 2].tobytes())
        if byteorder == "little":
            words.byteswap()
        return words.tobytes()[:size]

    def _store(self, address: int, data: bytes) -> None:
        """Writes bytes into words from a PLC memory address on; what is beside an odd last byte stays."""
        area, first = _place(address) or ("D", 0)
        words = self._memory.words(area)
        if len(data) % 2:
            data += bytes((words[first + len(data) // 2] & 0xFF,))
        stored = array("H", data)
        if byteorder == "little":
            stored.byteswap()
        words[first : first + len(stored)] = memoryview(stored)


def ports_of(image: Image, memory: Memory) -> CommunicationsPorts | None:
    """The ports of a program; None if it has no network instruction."""
    return CommunicationsPorts(image, memory) if fold(PORTS) in image.symbols else None


_RANGES = sorted(((first, area) for area, first in (
    PLC_ADDRESSES | {name: E_PLC_ADDRESS + E_WORDS * bank for bank, name in enumerate(E_NAMES)}).items()), reverse=True)


def _place(address: int) -> tuple[str, int] | None:
    """Area and number of the word at a PLC memory address; None for flags, and where nothing lies."""
    for first, area in _RANGES:
        if address >= first:
            return None if area in FLAG_AREAS else (area, address - first)
    return None


def _fins_address(address: int) -> bytes | None:
    """The address in FINS of the word at a PLC memory address."""
    place = _place(address)
    if place is None:
        return None
    code, first = WORD_CODES[place[0]]
    return bytes((code,)) + (first + place[1]).to_bytes(2, "big") + b"\0"
