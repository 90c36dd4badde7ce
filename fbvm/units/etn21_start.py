"""Starts a request that the checks have passed: what the network is asked for, and the time limit that it gets.

From W421 6-7-4 p117 (parameters), W420 7-3-14 p175 (errno codes of an open), W421 6-9-3 p156 (the held port).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from fbvm.units import etn21_codes as codes
from fbvm.units import etn21_map as at
from fbvm.units.etn21_data import fetch
from fbvm.units.etn21_map import PASSIVE_OPEN, SEND, UDP_OPEN, Parameters
from fbvm.units.etn21_service import Service
from fbvm.units.etn21_socket import Socket
from fbvm.units.unit import AreaMemory
from fbvm.wire.link import Bind, Connect, Listen, Peer, Request

CONNECT_LIMIT_NS = 75_000_000_000  # of the unit's stack; assumed, known of the NJ series (W506 9-7-3)
BROADCAST = "255.255.255.255"
DATAGRAM_LIMIT = 1472  # of a broadcast, W420 7-3-11 p171

TCP_PORTS_OF_THE_UNIT = frozenset({20, 21, 25, 53, 80, 110, 9600})  # W421 6-7-4 p117
UDP_PORTS_OF_THE_UNIT = frozenset({53, 123, 9600})  # W343 6-1 p106


class Surroundings(NamedTuple):
    """What an open may look at."""

    address: str
    """IPv4 address of this unit."""

    held_ports: Mapping[int, int]
    """TCP ports that wait out their TIME WAIT, with the time in ns at which each is free."""

    now_ns: int


def start_transfer(
    service: Service, parameters: Parameters, socket: Socket, memory: AreaMemory, now_ns: int
) -> list[Request]:
    """Begin a send or a receive and return the requests for the network."""
    if service.switch is SEND:
        data = fetch(memory, parameters)
        if socket.protocol == "TCP":
            return socket.begin_send(service, data)
        if parameters.remote.host == BROADCAST and parameters.size_bytes > DATAGRAM_LIMIT:
            return socket.fail(service, codes.ERRNO["EMSGSIZE"])
        return socket.begin_send_to(service, parameters.remote, data)
    _limit(service, parameters.timeout_ns, codes.TIMED_OUT, now_ns)
    return socket.begin_receive(service)


def start_open(service: Service, parameters: Parameters, socket: Socket, around: Surroundings) -> list[Request]:
    """Begin an open and return the requests for the network."""
    channel, port, remote = parameters.socket, parameters.local_port, parameters.remote
    keep_alive = bool(parameters.option & at.KEEP_ALIVE)
    request: Connect | Listen | Bind
    if service.switch is UDP_OPEN:
        request = Bind(channel, port)
    elif service.switch is PASSIVE_OPEN:
        request = Listen(channel, port, remote, keep_alive)
        _limit(service, parameters.timeout_ns, codes.TIMED_OUT, around.now_ns)
    else:
        request = Connect(channel, remote, port, keep_alive)
        _limit(service, CONNECT_LIMIT_NS, codes.ERRNO["ETIMEDOUT"], around.now_ns)
    error = _open_error(request, around)
    socket.prepare_open(service, request)
    return socket.fail(service, codes.ERRNO[error]) if error else socket.begin_open(service, request)


def _limit(service: Service, limit_ns: int, code: int, now_ns: int) -> None:
    """Let the service end with `code` after `limit_ns`; 0 is no limit."""
    if limit_ns:
        service.deadline_ns = now_ns + limit_ns
        service.deadline_code = code


def _open_error(request: Connect | Listen | Bind, around: Surroundings) -> str:
    """The errno that the unit's own stack finds before anything goes out, or ""."""
    port = request.local_port
    if isinstance(request, Bind):
        return "EADDRINUSE" if port in UDP_PORTS_OF_THE_UNIT else ""
    if port and (port in TCP_PORTS_OF_THE_UNIT or around.held_ports.get(port, 0) > around.now_ns):
        return "EADDRINUSE"  # assumed: the only code that fits
    if isinstance(request, Connect):
        if request.remote.host == BROADCAST:
            return "EACCES"
        if request.remote == Peer(around.address, port):
            return "EADDRNOTAVAIL"
    return ""
