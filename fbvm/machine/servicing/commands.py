"""Which FINS commands the CPU unit answers, and what has to be so before one is executed.  W342 5-3 p202-203."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fbvm.machine.servicing import elements, status
from fbvm.machine.servicing.cpu import Asked, Machine, Refused
from fbvm.machine.servicing.registers import Registers
from fbvm.units.contract import FinsAccess
from fbvm.wire.fins.codes import COMMANDS, EndCode
from fbvm.wire.fins.frames import MAX_PARAMETER_BYTES, Command


@dataclass(frozen=True)
class Row:
    """A command: what does it, how many bytes of parameters it takes, and who may.

    `shared`: also while another device has the access right; `changes`: refused under write protection; `controls`: changes the
    operating mode."""

    execute: Callable[[Asked], bytes]
    least: int
    most: int
    shared: bool = True
    changes: bool = False
    controls: bool = False


ROWS: dict[int, Row] = {
    0x0101: Row(elements.read, 6, 6),
    0x0102: Row(elements.write, 6, MAX_PARAMETER_BYTES, changes=True),
    0x0103: Row(elements.fill, 8, 8, changes=True),
    0x0104: Row(elements.read_several, 0, MAX_PARAMETER_BYTES),
    0x0105: Row(elements.transfer, 10, 10, changes=True),
    0x0401: Row(status.run, 0, 3, shared=False, changes=True, controls=True),
    0x0402: Row(status.stop, 0, 2, shared=False, changes=True, controls=True),
    0x0501: Row(status.unit_data, 0, 1),
    0x0502: Row(status.connections, 1, 2),
    0x0601: Row(status.status, 0, 0),
    0x0620: Row(status.cycle_time, 1, 1),
    0x0701: Row(status.read_clock, 0, 0),
    0x0702: Row(status.set_clock, 5, 7, shared=False, changes=True),
    0x0C01: Row(status.acquire, 2, 2),
    0x0C02: Row(status.take_over, 2, 2),
    0x0C03: Row(status.release, 2, 2),
    0x2101: Row(status.clear_error, 2, 2, shared=False, changes=True),
    0x2102: Row(status.read_error_log, 4, 4),
    0x2103: Row(status.clear_error_log, 0, 0, shared=False, changes=True),
    0x2301: Row(elements.force, 2, MAX_PARAMETER_BYTES, changes=True),
    0x2302: Row(elements.end_forces, 0, 0, changes=True),
}
"""The commands that are served.  "right", "RUN/MON/PRG" and "net" of W342 are the last three fields."""
OTHER_UNITS = range(0x2701, 0x2766)
NOT_OF_THE_CPU_UNIT = {0x0403, 0x0801, 0x0802, 0x0803, *OTHER_UNITS}
"""Commands that communication units answer: to the CPU unit they are unknown."""


def execute(machine: Machine, registers: Registers, command: Command, access: FinsAccess) -> tuple[int, bytes]:
    """Executes a command in one piece; returns its end code and data."""
    row = ROWS.get(command.code)
    if row is None:
        known = command.code in COMMANDS and command.code not in NOT_OF_THE_CPU_UNIT
        return EndCode.NOT_SUPPORTED if known else EndCode.UNDEFINED, b""
    size = len(command.parameters)
    if not row.least <= size <= row.most:
        return EndCode.TOO_SHORT if size < row.least else EndCode.TOO_LONG, b""
    holder = registers.right
    if not row.shared and holder not in (None, command.header.source):
        return EndCode.ACCESS_RIGHT, status.held_by(holder)
    if row.changes and not access.may_write or row.controls and not access.may_control:
        return EndCode.PROTECTED, b""
    try:
        return EndCode.NORMAL, row.execute(Asked(machine, registers, command.header.source, command.parameters))
    except Refused as refused:
        return refused.end_code, refused.data


def changes(code: int) -> bool:
    """True for a command that changes something in the PLC."""
    return code in ROWS and ROWS[code].changes
