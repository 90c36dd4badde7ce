"""Modbus TCP frames for decoders, peers, tests and OpenPLC's server: bytes in, frames out, and every layout as a row of a table.

No other unit uses this; a unit sends the bytes that the program gives it.  Received bytes never raise: an invalid frame is a
`Fault`, an invalid PDU a `Message` whose `fault` describes the error.
From MODBUS Application Protocol V1.1b3 ("AP") and MODBUS Messaging on TCP/IP Implementation Guide V1.0b ("IG").
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

PORT = 502
MBAP_SIZE_BYTES = 7
MAX_PDU_BYTES = 253
MAX_ADU_BYTES = MBAP_SIZE_BYTES + MAX_PDU_BYTES
MIN_LENGTH, MAX_LENGTH = 2, 1 + MAX_PDU_BYTES
"""Limits of the MBAP length field, which counts unit id and PDU."""
COIL_ON, COIL_OFF = 0xFF00, 0x0000

EXCEPTIONS: dict[int, str] = {  # AP 7
    0x01: "illegal function",
    0x02: "illegal data address",
    0x03: "illegal data value",
    0x04: "server device failure",
    0x05: "acknowledge",
    0x06: "server device busy",
    0x08: "memory parity error",
    0x0A: "gateway path unavailable",
    0x0B: "gateway target device failed to respond",
}


# --- ADU: the frame ------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Adu:
    """One frame: transaction id, unit id and PDU (protocol id is always 0, the length follows from the PDU)."""

    transaction: int
    unit: int
    pdu: bytes

    def to_bytes(self) -> bytes:
        """The frame as it goes over the wire.  Raises struct.error if an id does not fit its field."""
        return struct.pack(">HHHB", self.transaction, 0, 1 + len(self.pdu), self.unit) + self.pdu


@dataclass(frozen=True, slots=True)
class Fault:
    """Bytes of the stream that are no Modbus frame, and why.

    `fatal`: the beginning of the next frame is unknown, so the connection has to be closed."""

    reason: str
    data: bytes
    fatal: bool


class Splitter:
    """Cuts a TCP stream into frames, wherever TCP cut or joined it.  One for each direction of a connection.

    A frame with a wrong protocol id is skipped by its length and returned as a `Fault`.  After an impossible length the
    stream is `broken`, and all later bytes are dropped; the caller has to close the connection.  IG 3.1.3 p5-6."""

    def __init__(self) -> None:
        self._held = bytearray()
        self.broken = False

    @property
    def pending(self) -> bytes:
        """The bytes of an incomplete frame."""
        return bytes(self._held)

    def feed(self, data: bytes) -> list[Adu | Fault]:
        """Appends bytes of the stream; returns the frames that they complete, in order.

        >>> Splitter().feed(bytes.fromhex("0001 0000 0006 01 03 0064 0002"))
        [Adu(transaction=1, unit=1, pdu=b'\\x03\\x00d\\x00\\x02')]
        """
        found: list[Adu | Fault] = []
        if self.broken:
            return found
        self._held += data
        while len(self._held) >= 6:
            transaction, protocol, length = struct.unpack_from(">HHH", self._held)
            if not MIN_LENGTH <= length <= MAX_LENGTH:
                found.append(Fault(f"length {length} outside {MIN_LENGTH}..{MAX_LENGTH}", self.pending, True))
                self.broken = True
                self._held.clear()
                break
            if len(self._held) < 6 + length:
                break
            frame = bytes(self._held[: 6 + length])
            del self._held[: 6 + length]
            if protocol:
                found.append(Fault(f"protocol id {protocol} is not 0", frame, False))
            else:
                found.append(Adu(transaction, frame[6], frame[MBAP_SIZE_BYTES:]))
        return found


def parse_adu(frame: bytes) -> Adu | Fault:
    """The frame of some bytes; a `Fault` for an incomplete frame, several frames, or another protocol."""
    splitter = Splitter()
    found = splitter.feed(frame)
    if len(found) == 1 and not splitter.pending:
        return found[0]
    return Fault("more than one frame" if found else "incomplete frame", frame, False)


# --- PDU: the layouts ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Layout:
    """One function code: its 16-bit fields in order, and what follows them.

    `counted`: a byte count and that many data bytes; `rest`: data without count up to the end.  `read_max` and
    `write_max` limit the quantity of `item`s (bits or registers) in one request, 0 if it has no such quantity."""

    name: str
    request: tuple[str, ...] = ()
    reply: tuple[str, ...] = ()
    request_tail: str = ""
    reply_tail: str = ""
    item: str = ""
    read_max: int = 0
    write_max: int = 0


_RANGE = ("address", "quantity")
_VALUE = ("address", "value")
_MASKS = ("address", "and_mask", "or_mask")
_TWO_RANGES = ("read_address", "read_quantity", "write_address", "write_quantity")

FUNCTIONS: dict[int, Layout] = {  # AP 6.1-6.21; limits from the same sections
    0x01: Layout("read coils", _RANGE, (), "", "counted", "bit", 2000),
    0x02: Layout("read discrete inputs", _RANGE, (), "", "counted", "bit", 2000),
    0x03: Layout("read holding registers", _RANGE, (), "", "counted", "register", 125),
    0x04: Layout("read input registers", _RANGE, (), "", "counted", "register", 125),
    0x05: Layout("write single coil", _VALUE, _VALUE),
    0x06: Layout("write single register", _VALUE, _VALUE),
    0x08: Layout("diagnostics", ("sub_function",), ("sub_function",), "rest", "rest"),
    0x0F: Layout("write multiple coils", _RANGE, _RANGE, "counted", "", "bit", 0, 1968),
    0x10: Layout("write multiple registers", _RANGE, _RANGE, "counted", "", "register", 0, 123),
    0x16: Layout("mask write register", _MASKS, _MASKS),
    0x17: Layout("read/write multiple registers", _TWO_RANGES, (), "counted", "counted", "register", 125, 121),
    0x2B: Layout("encapsulated interface transport", (), (), "rest", "rest"),
}


@dataclass(frozen=True, slots=True)
class Message:
    """A PDU taken apart.  `fields` are its 16-bit numbers by name, `data` its data bytes without the byte count.

    `exception` is the code of an exception reply, else 0.  `fault` says why the PDU is not well formed, else ""."""

    function: int
    fields: dict[str, int] = field(default_factory=dict)
    data: bytes = b""
    exception: int = 0
    fault: str = ""

    def __str__(self) -> str:
        layout = FUNCTIONS.get(self.function)
        words = [f"{self.function:02X} {layout.name if layout else 'unknown function'}"]
        if self.exception:
            words.append(f"exception {self.exception:02X} {EXCEPTIONS.get(self.exception, 'unknown')}")
        words += [f"{name} {number}" for name, number in self.fields.items()]
        if self.data:
            words.append("data " + self.data.hex(" ").upper())
        if self.fault:
            words.append(f"({self.fault})")
        return ", ".join(words)


def decode_request(pdu: bytes) -> Message:
    """A request PDU as a `Message`.  Only the structure is checked; servers check quantities and addresses.

    >>> str(decode_request(read(3, 100, 2)))
    '03 read holding registers, address 100, quantity 2'
    """
    if not pdu:
        return Message(0, fault="no function code")
    layout = FUNCTIONS.get(pdu[0])
    if layout is None:
        return Message(pdu[0], data=pdu[1:], fault="function code not known")
    return _take_apart(pdu, layout.request, layout.request_tail)


def decode_reply(pdu: bytes) -> Message:
    """A reply PDU as a `Message`; the function of an exception reply is the requested one (without the high bit)."""
    if not pdu:
        return Message(0, fault="no function code")
    if pdu[0] & 0x80:
        fault = "" if len(pdu) == 2 and pdu[1] else "exception reply without code" if len(pdu) < 2 else "wrong length"
        return Message(pdu[0] & 0x7F, exception=pdu[1] if len(pdu) > 1 else 0, fault=fault)
    layout = FUNCTIONS.get(pdu[0])
    if layout is None:
        return Message(pdu[0], data=pdu[1:], fault="function code not known")
    return _take_apart(pdu, layout.reply, layout.reply_tail)


def _take_apart(pdu: bytes, names: tuple[str, ...], tail: str) -> Message:
    fixed = 1 + 2 * len(names)
    if len(pdu) < fixed + (tail == "counted"):
        return Message(pdu[0], data=pdu[1:], fault="too short")
    fields = dict(zip(names, struct.unpack_from(f">{len(names)}H", pdu, 1), strict=True))
    rest = pdu[fixed:]
    if not tail:
        return Message(pdu[0], fields, b"", fault=f"{len(rest)} bytes too many" if rest else "")
    if tail == "rest":
        return Message(pdu[0], fields, rest)
    count, data = rest[0], rest[1:]
    return Message(pdu[0], fields, data, fault="" if count == len(data) else f"byte count {count}, {len(data)} follow")


def mismatch(request: bytes, reply: bytes) -> str:
    """The reason why the PDU `reply` is no reply to the PDU `request`; "" if it may be one, as any exception reply."""
    asked, got = decode_request(request), decode_reply(reply)
    if got.fault:
        return got.fault
    if got.function != asked.function:
        return f"function code {got.function:02X} instead of {asked.function:02X}"
    if got.exception:
        return ""
    for name, number in got.fields.items():
        if asked.fields.get(name) != number:
            return f"{name} {number} instead of {asked.fields.get(name)}"
    if asked.fields.get("sub_function") == 0 and got.data != asked.data:
        return "data not echoed"
    layout = FUNCTIONS[asked.function]
    if layout.read_max:
        quantity = asked.fields.get("quantity", asked.fields.get("read_quantity", 0))
        size_bytes = data_size_bytes(layout.item, quantity)
        if len(got.data) != size_bytes:
            return f"{len(got.data)} data bytes instead of {size_bytes}"
    return ""


# --- PDU: building -------------------------------------------------------------------------------------------------


def data_size_bytes(item: str, quantity: int) -> int:
    """Bytes that `quantity` items ("bit" or "register") take."""
    return (quantity + 7) // 8 if item == "bit" else 2 * quantity


def pack_bits(states: Iterable[bool | int]) -> bytes:
    """States as data bytes: first state in bit 0 of the first byte, unused bits 0 (AP 6.1)."""
    packed = bytearray()
    for number, state in enumerate(states):
        if number % 8 == 0:
            packed.append(0)
        if state:
            packed[-1] |= 1 << number % 8
    return bytes(packed)


def unpack_bits(data: bytes, quantity: int) -> list[bool]:
    """The first `quantity` states of data bytes."""
    return [bool(data[number // 8] >> number % 8 & 1) for number in range(quantity)]


def pack_registers(values: Sequence[int]) -> bytes:
    """Register values as data bytes, high byte first."""
    return struct.pack(f">{len(values)}H", *values)


def unpack_registers(data: bytes) -> list[int]:
    """Register values of data bytes; an odd last byte is left out."""
    return list(struct.unpack_from(f">{len(data) // 2}H", data))


def read(function: int, address: int, quantity: int) -> bytes:
    """Request PDU of function 01 to 04."""
    return struct.pack(">BHH", function, address, quantity)


def write_coil(address: int, state: bool) -> bytes:
    """PDU of function 05, request and reply."""
    return struct.pack(">BHH", 0x05, address, COIL_ON if state else COIL_OFF)


def write_register(address: int, value: int) -> bytes:
    """PDU of function 06, request and reply."""
    return struct.pack(">BHH", 0x06, address, value)


def loop_back(data: bytes) -> bytes:
    """PDU of function 08 sub-function 0000, request and reply."""
    return b"\x08\x00\x00" + data


def write_coils(address: int, states: Sequence[bool | int]) -> bytes:
    """Request PDU of function 0F."""
    data = pack_bits(states)
    return struct.pack(">BHHB", 0x0F, address, len(states), len(data)) + data


def write_registers(address: int, values: Sequence[int]) -> bytes:
    """Request PDU of function 10."""
    return struct.pack(">BHHB", 0x10, address, len(values), 2 * len(values)) + pack_registers(values)


def mask_write(address: int, and_mask: int, or_mask: int) -> bytes:
    """PDU of function 16, request and reply."""
    return struct.pack(">BHHH", 0x16, address, and_mask, or_mask)


def read_write(read_address: int, quantity: int, write_address: int, values: Sequence[int]) -> bytes:
    """Request PDU of function 17; the server writes first."""
    head = struct.pack(">BHHHHB", 0x17, read_address, quantity, write_address, len(values), 2 * len(values))
    return head + pack_registers(values)


def identify(code: int = 0x01, object_id: int = 0) -> bytes:
    """Request PDU of function 2B, MEI type 0E (device identification)."""
    return bytes((0x2B, 0x0E, code, object_id))


def data_reply(function: int, data: bytes) -> bytes:
    """Reply PDU of the reading functions 01 to 04 and 17."""
    return bytes((function, len(data))) + data


def exception_reply(function: int, code: int) -> bytes:
    """Exception reply PDU."""
    return bytes((function | 0x80, code))
