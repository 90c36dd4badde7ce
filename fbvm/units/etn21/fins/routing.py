"""Where frames go: which are for this unit, which for its CPU unit, and at which endpoint a node is.  W420 5-2, W343 10-6."""

from __future__ import annotations

from fbvm.units.contract import CpuUnit
from fbvm.units.etn21.fins import unit_commands
from fbvm.units.etn21.fins.state import FinsSettings, FinsState
from fbvm.wire.fins.codes import COMMANDS, FATAL, NON_FATAL, EndCode
from fbvm.wire.fins.frames import (
    ANY_ETHERNET_UNIT,
    CPU_BUS_UNITS,
    CPU_UNIT,
    EVERY_NODE,
    LAST_NODE,
    MAX_DATA_BYTES,
    MAX_FRAME_BYTES,
    Command,
)
from fbvm.wire.link import Peer

MAX_BROADCAST_BYTES = 1473
NOT_SUPPORTED = COMMANDS.keys() & {0x0802, 0x0803, *range(0x2701, 0x2766)}
"""Commands that an ETN21 has, but for those that are served; W343 section 10."""
FATAL_ERRORS, OTHER_ERRORS = 401, 402
"""Words of the auxiliary area."""
ECHO, RESET = 0x0801, 0x0403


def refusal(settings: FinsSettings, command: Command, size_bytes: int) -> int:
    """The end code of a command whose header says that it is not for this PLC, or that is too long; 0000 if it is fine."""
    to = command.header.destination
    if to.network:
        return EndCode.NO_ROUTE
    if to.node not in (0, settings.own_node, EVERY_NODE) and settings.node != 0:
        return EndCode.HEADER
    if to.unit not in (CPU_UNIT, ANY_ETHERNET_UNIT, CPU_BUS_UNITS + settings.unit_number):
        return EndCode.NO_UNIT
    if size_bytes > (MAX_BROADCAST_BYTES if to.node == EVERY_NODE else MAX_FRAME_BYTES):
        return EndCode.TOO_LONG
    return EndCode.NORMAL


def execute(settings: FinsSettings, state: FinsState, error_status: int, command: Command, cpu: CpuUnit) -> tuple[int, bytes]:
    """Lets the CPU unit, or this unit, whose n+18 is `error_status`, execute a command that is for it; end code and data."""
    if command.header.destination.unit == CPU_UNIT:
        return cpu.execute(command, settings.access)
    if command.code == ECHO:
        data = command.parameters
        if not data:
            return EndCode.TOO_SHORT, b""
        return (EndCode.TOO_LONG, b"") if len(data) > MAX_DATA_BYTES else (EndCode.NORMAL, data)
    if command.code == RESET:
        return EndCode.NORMAL if settings.access.may_control else EndCode.PROTECTED, b""
    if command.code in unit_commands.ROWS:
        return unit_commands.execute(command.code, unit_commands.Asked(settings, state, error_status, command.parameters))
    return EndCode.NOT_SUPPORTED if command.code in NOT_SUPPORTED else EndCode.UNDEFINED, b""


def error_flags(cpu: CpuUnit) -> int:
    """What an end code of the CPU unit has beside its number while there is a fatal (A401) or another error (A402) of the PLC;
    W342 5-1-3 p155."""
    a = cpu.memory.words("A")
    return FATAL * bool(a[FATAL_ERRORS]) | NON_FATAL * bool(a[OTHER_ERRORS])


def restarts(command: Command, end_code: int) -> bool:
    """True for a command that restarts this unit."""
    return command.code == RESET and not end_code and command.header.destination.unit != CPU_UNIT


def endpoint_of(settings: FinsSettings, state: FinsState, node: int) -> Peer:
    """The endpoint of a node: that of the IP address table, else the one from which the node has sent, else the one that
    automatic generation makes of the unit's own address and port."""
    network = settings.address.rpartition(".")[0]
    if node == EVERY_NODE:
        return Peer(f"{network}.255", settings.port)
    return settings.nodes.get(node) or state.learned.get(node) or Peer(f"{network}.{node}", settings.port)


def learn(settings: FinsSettings, state: FinsState, node: int, remote: Peer) -> int:
    """Notes from where a node has sent.  Returns end code 2108 for a node of the IP address table at another address.

    A client that uses the unit's own node is answered where it is."""
    if node == settings.own_node:
        return EndCode.NORMAL
    fixed = settings.nodes.get(node)
    if fixed and fixed.host != remote.host:
        return EndCode.CANNOT_CHANGE
    if not fixed and 0 < node <= LAST_NODE:
        state.learned[node] = remote
    return EndCode.NORMAL
