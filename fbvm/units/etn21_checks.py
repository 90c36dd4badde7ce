"""Checks a request before the unit accepts it and says which response code it deserves.

Pure: reads, changes nothing.  The order of the checks is assumed, because the manuals give none; what each code means
is from W421 6-7-6 p120-125 and W343 6-2-2 p118.
"""

from __future__ import annotations

from fbvm.units import etn21_codes as codes
from fbvm.units.etn21_data import check_address
from fbvm.units.etn21_map import ACTIVE_OPEN, CLOSE, FLAG_OF, OPENS, PASSIVE_OPEN, SEND, TRANSFERS, UDP_OPEN, Parameters, Switch
from fbvm.units.etn21_service import Area
from fbvm.units.etn21_socket import CLOSED, OPEN, OPENING, SERVICE_LIMIT, Socket
from fbvm.units.unit import AreaMemory
from fbvm.wire.link import Peer

ANY_HOST = "0.0.0.0"
PROTOCOL_OF = {UDP_OPEN: "UDP", PASSIVE_OPEN: "TCP", ACTIVE_OPEN: "TCP"}


def check_request(
    switch: Switch,
    parameters: Parameters,
    area: Area,
    socket: Socket | None,
    memory: AreaMemory,
    cycle: int,
) -> int:
    """0000 if the request can be processed, else the code that refuses it.  `socket` is None if there is no such one."""
    if socket is None:
        return _without_socket(switch, area)
    if FLAG_OF[switch] & TRANSFERS:
        return _check_transfer(switch, parameters, area, socket, cycle) or check_address(memory, parameters)
    return (
        _check_binding(switch, area, socket)
        or _check_open(switch, socket, cycle)
        or _check_ranges(switch, parameters)
    )


def _check_transfer(switch: Switch, parameters: Parameters, area: Area, socket: Socket, cycle: int) -> int:
    if area.bound is not None and area.bound is not socket:
        return codes.OTHER_SOCKET
    if not socket.is_open or cycle <= socket.settled_cycle:
        return codes.NOT_OPEN
    if FLAG_OF[switch] in socket.services:
        return codes.ALREADY_OPEN
    wrong = parameters.size_bytes > SERVICE_LIMIT
    if switch is SEND and socket.protocol == "UDP":
        wrong = wrong or _is_nobody(parameters.remote)
    return codes.PARAMETER_RANGE if wrong else codes.NORMAL_END


def _without_socket(switch: Switch, area: Area) -> int:
    """A close knows no 1100 (W421 p125); assumed that it sees a socket that is not open."""
    if switch is not CLOSE:
        return codes.PARAMETER_RANGE
    return codes.NOT_OPEN if area.bound is None else codes.OTHER_SOCKET


def _check_binding(switch: Switch, area: Area, socket: Socket) -> int:
    protocol = PROTOCOL_OF.get(switch, socket.protocol)
    if area.bound is not None and (area.bound is not socket or protocol != socket.protocol):
        return codes.OTHER_SOCKET
    if protocol != socket.protocol and socket.phase is not CLOSED:
        return codes.OTHER_PROTOCOL
    return codes.NORMAL_END


def _check_open(switch: Switch, socket: Socket, cycle: int) -> int:
    """Open or not is what bit 15 has shown for a cycle at least: nobody can know it earlier."""
    if switch is CLOSE:
        return codes.NORMAL_END if socket.phase in (OPENING, OPEN) else codes.NOT_OPEN
    free = socket.phase is CLOSED and not socket.services and cycle > socket.settled_cycle
    return codes.NORMAL_END if free else codes.ALREADY_OPEN


def _check_ranges(switch: Switch, parameters: Parameters) -> int:
    if switch is ACTIVE_OPEN:
        wrong = _is_nobody(parameters.remote)
    else:
        wrong = switch in OPENS and not parameters.local_port
    return codes.PARAMETER_RANGE if wrong else codes.NORMAL_END


def _is_nobody(remote: Peer) -> bool:
    return remote.host == ANY_HOST or not remote.port
