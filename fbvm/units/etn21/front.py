"""The front of an ETN21: dials, lamps and sockets, as the words of the unit tell.

Unit number and node number are dials of one and of two hexadecimal digits (W420 2-2).  Which words a lamp follows is assumed:
RUN that the unit is no longer being initialized, ERH the disagreement of address and node, ERC the other errors of n+18."""

from __future__ import annotations

from fbvm.units.addresses import host_of
from fbvm.units.contract import AreaMemory
from fbvm.units.etn21 import map as at
from fbvm.units.etn21.codes import ERRNO, MEANING, NORMAL_END
from fbvm.units.etn21.map import Layout, TcpState
from fbvm.units.etn21.names import ERROR_NAMES, FLAG_NAMES
from fbvm.units.front import Front, Lamp, Socket

DISAGREEMENT = ERROR_NAMES[at.DISAGREEMENT.bit_length() - 1]
_ERRNO = {number: name for name, number in ERRNO.items()}
_STATES = {state.value: state.name for state in TcpState}
_UNDER_WAY = {bit: name.removesuffix(" Flag").lower() for bit, name in FLAG_NAMES.items() if bit <= 3}


def front(layout: Layout, node: int, memory: AreaMemory) -> Front:
    """What stands on the front of the unit with these words, and node number `node`, in a PLC with this memory."""
    cio, data, auxiliary = memory.words("CIO"), memory.words("D"), memory.words("A")
    is_starting = bool(auxiliary[at.INITIALIZING] >> layout.bit & 1)
    errors = [name for bit, name in ERROR_NAMES.items() if cio[layout.n + at.ERROR_STATUS] >> bit & 1]
    own, disagrees = [name for name in errors if name != DISAGREEMENT], DISAGREEMENT in errors
    is_linked = bool(cio[layout.n + at.SERVICE_STATUS] & at.LINK_UP)
    sockets = _sockets(layout, cio, data)
    opened = sum(socket.name.startswith("TCP") and socket.state.startswith(TcpState.ESTABLISHED.name) for socket in sockets)
    return Front(
        settings=(("UNIT No.", f"{layout.bit:X}"), ("NODE No.", f"{node:02X}")),
        lamps=(Lamp("RUN", not is_starting, "being initialized" if is_starting else "works"),
               Lamp("ERC", bool(own), ", ".join(own) or "no error"),
               Lamp("ERH", disagrees, DISAGREEMENT if disagrees else "no error"),
               Lamp("LNK", is_linked, "linked" if is_linked else "no link: the cable is pulled"),
               Lamp("TCP", opened > 0, f"{opened} connected" if opened else "no connection")),
        sockets=tuple(sockets),
        restart=(f"A{at.RESTART}.{layout.bit:02}", "TRUE"),
    )  # fmt: skip


def _sockets(layout: Layout, cio: memoryview, data: memoryview) -> list[Socket]:
    """The sockets that are open, that a service is under way for, or that a parameter area names."""
    found = []
    for number in at.SOCKETS:
        area = next((layout.parameters(area) for area in at.AREAS
                     if data[layout.parameters(area) + at.OPTION_AND_SOCKET] & 0xFF == number), None)  # fmt: skip
        for protocol in ("TCP", "UDP"):
            status = cio[layout.status(protocol, number)]
            state = data[layout.m + at.TCP_STATE + number] if protocol == "TCP" else 0
            if not (status or state or area is not None and protocol == "TCP"):
                continue
            doing = [name for bit, name in _UNDER_WAY.items() if status >> bit & 1]
            named = _STATES.get(state, f"16#{state:X}") if protocol == "TCP" else "OPEN" if status & at.OPEN else "CLOSED"
            found.append(_socket(f"{protocol} {number}", ", ".join([named, *doing]), data, area,
                                 data[layout.m + at.BYTES_RECEIVED + number] if protocol == "TCP" else 0))  # fmt: skip
    return found


def _socket(name: str, state: str, data: memoryview, area: int | None, received: int) -> Socket:
    """A socket with what its parameter area says of it; a program that uses CMND has none."""
    if area is None:
        return Socket(name, state, received=received)
    high, low = data[area + at.REMOTE_HOST : area + at.REMOTE_HOST + 2]
    port, local, code = (data[area + offset] for offset in (at.REMOTE_PORT, at.LOCAL_PORT, at.RESPONSE))
    said = MEANING.get(code) or _ERRNO.get(code, "")
    return Socket(
        name, state, str(local) if local else "", f"{host_of(high, low)}:{port}" if high or low or port else "", received,
        data[area + at.COUNT], "" if code == NORMAL_END else f"{code:04X}" + (f" {said}" if said else ""))  # fmt: skip
