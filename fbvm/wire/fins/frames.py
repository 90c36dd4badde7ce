"""FINS frames: bytes in, frames out.  A header of ten bytes, a command of two, then parameters, or an end code and data.

Received bytes never raise: what is no frame is a `Damaged`.  All fields have the high byte first.  From W421 7-2 p162 and
W342 3-5 p57.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

PORT = 9600
"""Of FINS/UDP and of FINS/TCP, W421 7-1 p160."""
HEADER_BYTES = 10
MIN_COMMAND_BYTES, MIN_RESPONSE_BYTES = 12, 14
MAX_FRAME_BYTES = 2012
MAX_DATA_BYTES = 1998
"""Behind the end code of a response."""
MAX_PARAMETER_BYTES = 2000
"""Behind the code of a command."""

COMMAND, RESPONSE = 0x80, 0xC0
NO_RESPONSE = 0x01
"""Bit of ICF: no response is wanted."""
GATEWAY_COUNT = 0x02

CPU_UNIT = 0x00
"""Unit address DA2 of the CPU unit; W342 3-4-2 p36 has these."""
ANY_ETHERNET_UNIT = 0xFE
"""Unit address of the unit that the frame reached."""
CPU_BUS_UNITS = 0x10
"""Unit address of CPU bus unit 0; unit N has N more."""
EVERY_NODE = 0xFF
"""Node address of a broadcast."""
LAST_NODE = 254

_HEADER = struct.Struct("10B")
_CODE = struct.Struct(">H")


@dataclass(frozen=True, slots=True)
class Address:
    """Where a frame goes or comes from: network (0 the local one), node (0 inside the PLC), unit of the rack."""

    network: int = 0
    node: int = 0
    unit: int = CPU_UNIT

    def __str__(self) -> str:
        return f"{self.network}.{self.node}.{self.unit}"


@dataclass(frozen=True, slots=True)
class Header:
    """The ten bytes: information control field, destination, source, service number, and the gateway count."""

    destination: Address
    source: Address
    service: int = 0
    icf: int = COMMAND
    gateways: int = GATEWAY_COUNT
    reserved: int = 0

    @property
    def is_response(self) -> bool:
        return bool(self.icf & 0x40)

    @property
    def wants_response(self) -> bool:
        """True for a command that is to be answered."""
        return not self.icf & (0x40 | NO_RESPONSE)

    def answer(self) -> Header:
        """The header of the response: destination and source change places, the service number stays."""
        return Header(self.source, self.destination, self.service, RESPONSE)

    def to_bytes(self) -> bytes:
        to, by = self.destination, self.source
        return _HEADER.pack(self.icf, self.reserved, self.gateways, to.network, to.node, to.unit,
                            by.network, by.node, by.unit, self.service)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Command:
    """A command: `code` is MRC and SRC as one number (0101 hex reads memory)."""

    header: Header
    code: int
    parameters: bytes = b""

    def to_bytes(self) -> bytes:
        return self.header.to_bytes() + _CODE.pack(self.code) + self.parameters


@dataclass(frozen=True, slots=True)
class Response:
    """A response: the code of its command, the end code (MRES and SRES), and data."""

    header: Header
    code: int
    end_code: int = 0
    data: bytes = b""

    def to_bytes(self) -> bytes:
        return self.header.to_bytes() + _CODE.pack(self.code) + _CODE.pack(self.end_code) + self.data


@dataclass(frozen=True, slots=True)
class Damaged:
    """Bytes that are no FINS frame, and why."""

    reason: str
    data: bytes


def parse_frame(data: bytes) -> Command | Response | Damaged:
    """The frame of a datagram, or of a FINS/TCP message; also one that is too long.

    >>> frame = parse_frame(bytes.fromhex("8000020001000019000101018200640000 03"))
    >>> frame.code == 0x0101, str(frame.header.source), frame.parameters.hex()
    (True, '0.25.0', '820064000003')
    """
    if len(data) < MIN_COMMAND_BYTES:
        return Damaged(f"{len(data)} bytes are less than the {MIN_COMMAND_BYTES} of the shortest frame", data)
    icf, reserved, gateways, dna, da1, da2, sna, sa1, sa2, service = _HEADER.unpack_from(data)
    if not icf & 0x80 or reserved:
        return Damaged("ICF bit 7 is 0" if reserved == 0 else "RSV is not 00", data)
    header = Header(Address(dna, da1, da2), Address(sna, sa1, sa2), service, icf, gateways, reserved)
    code = _CODE.unpack_from(data, HEADER_BYTES)[0]
    if not header.is_response:
        return Command(header, code, data[MIN_COMMAND_BYTES:])
    if len(data) < MIN_RESPONSE_BYTES:
        return Damaged("a response without an end code", data)
    return Response(header, code, _CODE.unpack_from(data, MIN_COMMAND_BYTES)[0], data[MIN_RESPONSE_BYTES:])
