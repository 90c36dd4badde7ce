"""The contents of the servers of `fbvm peer`, `fbvm demo` and `--map IP:PORT=peer`: values that show their addresses."""

from __future__ import annotations

from array import array
from functools import cache

from fbvm.wire.modbus_server import ModbusServer

COUNT = 65536


def coils() -> list[bool]:
    """Every second coil is ON, 0 first."""
    return [number % 2 == 0 for number in range(COUNT)]


def discrete_inputs() -> list[bool]:
    """Every third discrete input is ON, 0 first."""
    return [number % 3 == 0 for number in range(COUNT)]


def holding_registers() -> list[int]:
    """Holding register i holds 1000 + i, modulo 65536."""
    return [1000 + number & 0xFFFF for number in range(COUNT)]


def input_registers() -> list[int]:
    """Input register i holds 2000 + i, modulo 65536."""
    return [2000 + number & 0xFFFF for number in range(COUNT)]


@cache
def _contents() -> tuple[bytes, bytes, array[int], array[int]]:
    return (bytes(coils()), bytes(discrete_inputs()), array("H", holding_registers()), array("H", input_registers()))


def server() -> ModbusServer:
    """A server in memory with these contents."""
    made = ModbusServer()
    made.coils[:], made.discrete_inputs[:], made.holding_registers[:], made.input_registers[:] = _contents()
    return made
