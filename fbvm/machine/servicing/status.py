"""The commands about the CPU unit itself: mode, data, status, cycle time, clock, access right, errors.  W342 5-3 p189-209."""

from __future__ import annotations

import struct
from datetime import datetime, timedelta

from fbvm.base.areas import E_NAMES
from fbvm.machine.scan.clock_words import EPOCH, bcd
from fbvm.machine.servicing.cpu import Asked, Refused
from fbvm.wire.fins.codes import EndCode
from fbvm.wire.fins.frames import CPU_BUS_UNITS, Address

MODEL = b"CJ2M-CPU33-FBVM"
"""Nobody takes it for the device."""
PROGRAM_MODE, MONITOR_MODE, RUN_MODE = 0x00, 0x02, 0x04
WHOLE_PROGRAM = (0xFFFF, 0x0000)
"""Program numbers that mean the program."""
TENTH_MS_NS = 100_000
LOG_RECORDS = 20
BCD_LAST = 0x99
_UNITS = 16
PRESENT = 0x8000
"""Bit of a CPU bus unit that is there; the numbers of models beside it are not known."""


# --- operating mode ---------------------------------------------------------------------------------------------------


def run(asked: Asked) -> bytes:
    """0401: to RUN (mode 04), or MONITOR (02; assumed where no mode is named)."""
    _check_program(asked)
    if len(asked.parameters) not in (0, 2, 3):
        raise Refused(EndCode.TOO_LONG if len(asked.parameters) > 3 else EndCode.TOO_SHORT)
    mode = asked.parameters[2] if len(asked.parameters) > 2 else MONITOR_MODE
    if mode not in (MONITOR_MODE, RUN_MODE):
        raise Refused(EndCode.OTHER_PARAMETER)
    asked.registers.is_monitor = mode == MONITOR_MODE
    if not asked.machine.is_running:
        asked.registers.forget_cycle_times()
        asked.machine.servicing_changes_mode(True)
    return b""


def stop(asked: Asked) -> bytes:
    """0402: to PROGRAM."""
    _check_program(asked)
    if len(asked.parameters) == 1:
        raise Refused(EndCode.TOO_SHORT)
    if asked.machine.is_running:
        asked.machine.servicing_changes_mode(False)
    return b""


def _check_program(asked: Asked) -> None:
    if len(asked.parameters) >= 2 and asked.number(0) not in WHOLE_PROGRAM:
        raise Refused(EndCode.NO_PROGRAM)


# --- what it is, and how it does ---------------------------------------------------------------------------------------


def unit_data(asked: Asked) -> bytes:
    """0501: model, version, sizes of areas (part 00), units (part 01), both without a parameter."""
    part = asked.parameters[0] if asked.parameters else None
    if part not in (None, 0, 1):
        raise Refused(EndCode.OTHER_PARAMETER)
    banks = sum(name in asked.machine.memory.areas for name in E_NAMES)
    system = bytes((0, max(banks - 1, 0))) + bytes(38)
    areas = struct.pack(">HBHBBBBH", 10, 23, 0x8000, 8, banks, 0, 0, 0) + b"\0"
    first = MODEL.ljust(20) + b"fbvm".ljust(20, b"\0") + system + areas
    units = bytearray(2 * _UNITS)
    for number in _cpu_bus_units(asked):
        units[2 * number : 2 * number + 2] = struct.pack(">H", PRESENT)
    second = bytes(units) + bytes(32) + b"\0\0\1"
    return (first if part != 1 else b"") + (second if part != 0 else b"")


def connections(asked: Asked) -> bytes:
    """0502: CPU bus units from a unit address on, each with its model."""
    address = asked.parameters[0]
    most = asked.parameters[1] if len(asked.parameters) > 1 else 25
    found = [number for number in sorted(_cpu_bus_units(asked)) if CPU_BUS_UNITS + number >= address]
    shown = found[:most]
    last = 0x80 if len(shown) == len(found) else 0
    return bytes((last | len(shown),)) + b"".join(
        bytes((CPU_BUS_UNITS + number,)) + b"CJ1W-ETN21".ljust(20) for number in shown)


def _cpu_bus_units(asked: Asked) -> set[int]:
    numbers = (getattr(attached.unit, "unit_number", None) for attached in asked.machine.units)
    return {number for number in numbers if number is not None}


def status(asked: Asked) -> bytes:
    """0601: status, mode, errors; the error bits are those of A401 and A402 (assumed).  Of the status byte only bit 0 is ever ON:
    some clients take it as a whole."""
    a = asked.machine.memory.words("A")
    running = asked.machine.is_running
    mode = (MONITOR_MODE if asked.registers.is_monitor else RUN_MODE) if running else PROGRAM_MODE
    return struct.pack(">BBHHHH", running, mode, a[401], a[402], 0, a[400]) + b" " * 16


def cycle_time(asked: Asked) -> bytes:
    """0620: begins to measure anew (00), or average, longest and least cycle time in 0.1 ms (01).  Not in PROGRAM mode."""
    if not asked.machine.is_running:
        raise Refused(EndCode.IN_PROGRAM)
    if asked.parameters[0] == 0:
        asked.registers.forget_cycle_times()
        return b""
    if asked.parameters[0] != 1:
        raise Refused(EndCode.OTHER_PARAMETER)
    return struct.pack(">III", *(time_ns // TENTH_MS_NS for time_ns in asked.registers.cycle_times_ns))


# --- clock ------------------------------------------------------------------------------------------------------------


def read_clock(asked: Asked) -> bytes:
    """0701: year, month, day, hour, minute, second, day of the week (00 is Sunday), in BCD."""
    now = EPOCH + timedelta(microseconds=(asked.registers.clock_ns + asked.machine.now_ns) // 1000)
    fields = (now.year % 100, now.month, now.day, now.hour, now.minute, now.second, now.isoweekday() % 7)
    return bytes(map(bcd, fields))


def set_clock(asked: Asked) -> bytes:
    """0702: the same without seconds, with them, or with the day of the week, too, which is not looked at."""
    if any(byte > BCD_LAST or byte & 0xF > 9 for byte in asked.parameters):
        raise Refused(EndCode.PARAMETER)
    year, month, day, hour, minute, *more = ((byte >> 4) * 10 + (byte & 0xF) for byte in asked.parameters)
    try:
        date = datetime(2000 + year, month, day, hour, minute, more[0] if more else 0)
    except ValueError:
        raise Refused(EndCode.PARAMETER) from None
    if len(more) > 1 and more[1] > 6:
        raise Refused(EndCode.PARAMETER)
    asked.registers.clock_ns = int((date - EPOCH).total_seconds()) * 1_000_000_000 - asked.machine.now_ns
    return b""


# --- access right -----------------------------------------------------------------------------------------------------


def acquire(asked: Asked) -> bytes:
    """0C01: takes the access right, unless another device has it."""
    _check_right(asked)
    holder = asked.registers.right
    if holder not in (None, asked.source):
        raise Refused(EndCode.ACCESS_RIGHT, held_by(holder))
    asked.registers.right = asked.source
    return b""


def take_over(asked: Asked) -> bytes:
    """0C02: takes the access right from whoever has it."""
    _check_right(asked)
    asked.registers.right = asked.source
    return b""


def release(asked: Asked) -> bytes:
    """0C03: gives the access right back, whoever has it."""
    _check_right(asked)
    asked.registers.right = None
    return b""


def held_by(holder: Address | None) -> bytes:
    """Unit, node and network of the holder (in this order: assumed)."""
    return bytes((holder.unit, holder.node, holder.network)) if holder else b""


def _check_right(asked: Asked) -> None:
    if asked.number(0) not in WHOLE_PROGRAM:
        raise Refused(EndCode.NO_PROGRAM)


# --- errors -----------------------------------------------------------------------------------------------------------


def clear_error(asked: Asked) -> bytes:
    """2101: there is no error to clear but those of FAL, which the program clears itself."""
    return b""


def read_error_log(asked: Asked) -> bytes:
    """2102: the log is empty."""
    return struct.pack(">HHH", LOG_RECORDS, 0, 0) if asked.number(0) == 0 else b""


def clear_error_log(asked: Asked) -> bytes:
    """2103: the log is empty already."""
    return b""
