"""The commands that the ETN21 itself answers, beside reset and echo: what it is, how it does, its connections.

From W420 7-3 p160-196.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass

from fbvm.units.addresses import words_of
from fbvm.units.etn21.fins.state import BEFORE_CLIENTS, CONNECTIONS, FinsSettings, FinsState
from fbvm.wire.fins.codes import EndCode
from fbvm.wire.link import Peer

MODEL = b"CJ1W-ETN21"
"""As 0502 names it."""
LOG_RECORDS = 64
"""Room of the error log; W420 7-3-7 p165."""
SERVER, CLIENT = 3, 4
"""Services of a FINS/TCP connection."""
CLOSED, LISTENING, SYN_SENT, ESTABLISHED = 0, 1, 2, 4
"""TCP states; W420 7-3-27 p196."""
ERROR_FLAGS = 0xC1DE
"""Bits of n+18 that are flags of 0601, too: 1 to 4, 6 to 8, 14, 15.  W343 11-3-3 p219."""
ANYBODY = Peer("0.0.0.0", 0)
MOST_PACKETS = 0xFFFF_FFFF
"""Where packets are no longer counted; W420 7-3-3 p163."""


class Refused(Exception):
    """A command that ends with a code other than 0000."""

    def __init__(self, end_code: int) -> None:
        super().__init__(end_code)
        self.end_code = end_code


@dataclass(frozen=True)
class Asked:
    """A command's parameters, and all that its answer is made of."""

    settings: FinsSettings
    state: FinsState
    error_status: int
    """What n+18 shows."""
    parameters: bytes

    def number(self, offset: int) -> int:
        """The two bytes at an offset of the parameters."""
        return int.from_bytes(self.parameters[offset : offset + 2], "big")


def _packed(host: str) -> bytes:
    return struct.pack(">HH", *words_of(host))


def unit_data(asked: Asked) -> bytes:
    """0501: model, version, address, subnet mask, UDP port, mode setting, Ethernet address.

    The mask is that of automatic address generation; the mode setting is 0, since the unit setup is not emulated; the Ethernet
    address is one of local administration that holds the unit's own, as in captures."""
    address = _packed(asked.settings.address)
    return struct.pack(">20s20s4s4sHH6s", MODEL.ljust(20), b"fbvm".ljust(20), address, b"\xff\xff\xff\0", asked.settings.port, 0,
                       b"\x02\0" + address)  # fmt: skip


def unit_status(asked: Asked) -> bytes:
    """0601: error flags as n+18 shows them; packets received, of them wrong, sent, of them wrong, collisions.

    Packets are datagrams and blocks of connections; the network below them makes no errors that a unit could count."""
    received, sent = (min(packets, MOST_PACKETS) for packets in (asked.state.received, asked.state.sent))
    return struct.pack(">HIIIII", asked.error_status & ERROR_FLAGS, received, 0, sent, 0, 0)


def read_error_log(asked: Asked) -> bytes:
    """2102: the log is empty; what goes wrong is in n+18 and in the response codes of requests."""
    first, count = asked.number(0), asked.number(2)
    if first >= LOG_RECORDS:
        raise Refused(EndCode.FIRST_ADDRESS)
    if not count:
        raise Refused(EndCode.OTHER_PARAMETER)
    return struct.pack(">HHH", LOG_RECORDS, 0, 0)


def clear_error_log(asked: Asked) -> bytes:
    """2103: the log is empty already."""
    return b""


def change_remote_node(asked: Asked) -> bytes:
    """2730: another server for a connection of which this unit is the client, until the unit restarts.  The service closes the
    connection and opens it to the new server."""
    number, address, port = struct.unpack(">H4sH", asked.parameters)
    if number not in CONNECTIONS or not any(address) or not port:
        raise Refused(EndCode.PARAMETER)
    if number not in asked.settings.clients:
        raise Refused(EndCode.NOT_A_CLIENT)
    server = Peer(".".join(str(byte) for byte in address), port)
    if any(found.is_client and found.remote == server for found in asked.state.connections.values()):
        raise Refused(EndCode.CONNECTION_EXISTS)
    asked.state.changed_servers[number] = server
    return b""


def connection_status(asked: Asked) -> bytes:
    """2731: number, service, endpoints and TCP state of a FINS/TCP connection."""
    number = asked.number(0)
    if number not in CONNECTIONS:
        raise Refused(EndCode.PARAMETER)
    channel = BEFORE_CLIENTS + number
    if number in asked.settings.clients:
        tcp = SYN_SENT if channel in asked.state.busy - asked.state.closing else CLOSED
        service, local_port, remote = CLIENT, 0, asked.state.dialled.get(channel, ANYBODY)
    else:
        service, local_port, remote, tcp = SERVER, asked.settings.port, ANYBODY, LISTENING
    for found in asked.state.connections.values():
        if found.number == number:
            local_port, remote, tcp = found.local_port, found.remote, ESTABLISHED
    return struct.pack(">HH4sH4sHI", number, service, _packed(asked.settings.address), local_port, _packed(remote.host),
                       remote.port, tcp)  # fmt: skip


def address_information(asked: Asked) -> bytes:
    """2765: one pair of node address (two bytes: assumed) and IP address, the unit's own."""
    return struct.pack(">HH4s", 1, asked.settings.own_node, _packed(asked.settings.address))


@dataclass(frozen=True)
class Row:
    """A command: what does it, how many bytes of parameters it has, and whether write protection refuses it."""

    execute: Callable[[Asked], bytes]
    size: int = 0
    changes: bool = False


ROWS: dict[int, Row] = {
    0x0501: Row(unit_data),
    0x0601: Row(unit_status),
    0x2102: Row(read_error_log, 4),
    0x2103: Row(clear_error_log, changes=True),
    0x2730: Row(change_remote_node, 8, changes=True),
    0x2731: Row(connection_status, 2),
    0x2765: Row(address_information),
}


def execute(code: int, asked: Asked) -> tuple[int, bytes]:
    """Executes a command of `ROWS`; end code and data."""
    row = ROWS[code]
    size = len(asked.parameters)
    if size != row.size:
        return EndCode.TOO_SHORT if size < row.size else EndCode.TOO_LONG, b""
    if row.changes and not asked.settings.access.may_write:
        return EndCode.PROTECTED, b""
    try:
        return EndCode.NORMAL, row.execute(asked)
    except Refused as refused:
        return refused.end_code, b""
