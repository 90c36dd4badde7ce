"""A line of text about a FINS frame or a FINS/TCP message, as a decoder shows it."""

from __future__ import annotations

import struct
from collections.abc import Callable

from fbvm.wire.fins.areas import place_of
from fbvm.wire.fins.codes import command_name, meaning_of
from fbvm.wire.fins.frames import Command, Damaged, Response, parse_frame
from fbvm.wire.fins.tcp import ERRORS, Error, Kind, Message

ADDRESS_BYTES = 4
_FORCES = {0: "OFF", 1: "ON", 0x8000: "released to OFF", 0x8001: "released to ON", 0xFFFF: "released"}


def described(frame: Command | Response | Damaged) -> str:
    """What a frame says.

    >>> described(parse_frame(bytes.fromhex("800002000100001900010101820064000003")))
    'FINS 25 -> 1, service 1: memory area read, D100, 3 elements'
    """
    if isinstance(frame, Damaged):
        return f"no FINS: {frame.reason}"
    header = frame.header
    way = f"FINS {header.source.node} -> {header.destination.node}, service {header.service}: {command_name(frame.code)}"
    if isinstance(frame, Command):
        more = told(frame)
        return way + (f", {more}" if more else "") + ("" if header.wants_response else ", no response wanted")
    data = f", {len(frame.data)} bytes" if frame.data else ""
    return f"{way}: {meaning_of(frame.end_code)}{data}"


def told(command: Command) -> str:
    """What the parameters of a command say; "" for a command without any, or with others than expected."""
    details = _DETAILS.get(command.code)
    return details(command.parameters) if details else ""


def described_message(message: Message) -> str:
    """What a FINS/TCP message says."""
    if message.kind == Kind.FRAME:
        return described(parse_frame(message.body))
    error = f": {ERRORS[Error(message.error)]}" if message.error in list(Error) and message.error else ""
    if message.kind == Kind.CLIENT_NODE and not message.is_wrong:
        return f"FINS/TCP: client node {message.node}" if message.node else "FINS/TCP: asks for a node"
    if message.kind == Kind.SERVER_NODE and not message.is_wrong:
        nodes = struct.unpack(">II", message.body)
        return f"FINS/TCP: client node {nodes[0]}, server node {nodes[1]}{error}"
    names = {Kind.ERROR: "error notification", Kind.CONFIRMATION: "connection confirmation"}
    return f"FINS/TCP: {names.get(Kind(message.kind), 'command') if message.kind in list(Kind) else message.kind}{error}"


def _place(data: bytes) -> str:
    """The PLC's address of the four bytes of a memory address."""
    code, number, bit = data[0], data[1] << 8 | data[2], data[3]
    found = place_of(code, number, bit)
    return f"area {code:02X} {number}.{bit:02}" if found is None else str(found[0].address(found[1]))


def _elements(parameters: bytes) -> str:
    """An address and a count."""
    if len(parameters) < ADDRESS_BYTES + 2:
        return ""
    count = parameters[4] << 8 | parameters[5]
    return f"{_place(parameters)}, {count} element{'s' * (count != 1)}"


def _values(parameters: bytes) -> str:
    """An address, a count, and what is written."""
    shown = _elements(parameters)
    return f"{shown}: {parameters[6:22].hex(' ').upper()}{' ..' * (len(parameters) > 22)}" if shown else ""


def _several(parameters: bytes) -> str:
    return ", ".join(_place(parameters[at : at + 4]) for at in range(0, len(parameters) - 3, 4))


def _transfer(parameters: bytes) -> str:
    if len(parameters) < 2 * ADDRESS_BYTES + 2:
        return ""
    return f"{_place(parameters)} to {_elements(parameters[4:])}"


def _mode(parameters: bytes) -> str:
    return {2: "MONITOR", 4: "RUN"}.get(parameters[2], f"mode {parameters[2]:02X}") if len(parameters) > 2 else ""


def _forced(parameters: bytes) -> str:
    rows = (parameters[at : at + 6] for at in range(2, len(parameters) - 5, 6))
    return ", ".join(f"{_place(row[2:])} {_FORCES.get(row[0] << 8 | row[1], row[:2].hex())}" for row in rows)


def _date(parameters: bytes) -> str:
    return parameters.hex(" ")


_DETAILS: dict[int, Callable[[bytes], str]] = {
    0x0101: _elements, 0x0102: _values, 0x0103: _values, 0x0104: _several, 0x0105: _transfer, 0x0401: _mode, 0x0702: _date,
    0x2301: _forced,
}  # fmt: skip


