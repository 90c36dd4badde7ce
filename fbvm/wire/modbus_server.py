"""A Modbus server without any I/O: four tables, and the answer to a frame.  For scripted peers, tests and lessons.

It replies rightly; `net.misdeeds` has servers that misbehave.  The order of checks is that of
the state diagrams of MODBUS Application Protocol V1.1b3 ("AP") 6.1-6.21.
"""

from __future__ import annotations

import struct
from array import array
from collections.abc import Callable, Collection, Mapping
from typing import Any, Protocol

from fbvm.wire import modbus
from fbvm.wire.modbus import Adu, Fault, Message, data_reply, exception_reply

ILLEGAL_FUNCTION, ILLEGAL_ADDRESS, ILLEGAL_VALUE = 1, 2, 3
TARGET_FAILED = 0x0B

IDENTITY: dict[int, str] = {0: "fbvm", 1: "ModbusServer", 2: "1.0"}
"""Objects of the device identification; the three of the basic level (AP 6.21)."""

_COUNTERS = {0x0B: "messages", 0x0C: "", 0x0D: "exceptions", 0x0E: "messages", 0x0F: "", 0x10: "", 0x11: "", 0x12: ""}
"""FC 08 sub-functions that give a counter (AP 6.8): bus and server messages are one here, the others never count."""


class Table(Protocol):
    """One of the four tables: numbers by their addresses, one by one or in slices."""

    def __len__(self) -> int: ...

    def __getitem__(self, place: Any, /) -> Any: ...

    def __setitem__(self, place: Any, value: Any, /) -> None: ...


class ModbusServer:
    """Coils, discrete inputs, input and holding registers, as plain Python sequences that a test reads and writes.

    The arguments are the sizes of the tables.  `unit_ids` are the unit ids that are answered, None for all; others get
    exception 0B.  `functions` are the supported function codes.  `refusals` maps function codes to exception codes that
    are always answered.  `identity` are the objects of the device identification by id."""

    def __init__(
        self,
        *,
        coils: int = 65536,
        discrete_inputs: int = 65536,
        holding_registers: int = 65536,
        input_registers: int = 65536,
        unit_ids: Collection[int] | None = None,
        functions: Collection[int] = tuple(modbus.FUNCTIONS),
        refusals: Mapping[int, int] | None = None,
        identity: Mapping[int, str] | None = None,
    ) -> None:
        self.coils: Table = bytearray(coils)
        self.discrete_inputs: Table = bytearray(discrete_inputs)
        self.holding_registers: Table = array("H", bytes(2 * holding_registers))
        self.input_registers: Table = array("H", bytes(2 * input_registers))
        self.unit_ids = unit_ids
        self.functions = frozenset(functions)
        self.refusals = dict(refusals or {})
        self.identity = dict(IDENTITY if identity is None else identity)
        self.counts = {"messages": 0, "exceptions": 0}

    def answer(self, adu: bytes) -> bytes | None:
        """The reply to one frame; None for another protocol and for bytes that are not one complete frame."""
        request = modbus.parse_adu(adu)
        if isinstance(request, Fault):
            return None
        return Adu(request.transaction, request.unit, self.answer_pdu(request.pdu, request.unit)).to_bytes()

    def answer_pdu(self, pdu: bytes, unit: int = 255) -> bytes:
        """The reply PDU to a request PDU."""
        self.counts["messages"] = self.counts["messages"] + 1 & 0xFFFF
        reply = self._answer(pdu, unit)
        if reply[0] & 0x80:
            self.counts["exceptions"] = self.counts["exceptions"] + 1 & 0xFFFF
        return reply

    def _answer(self, pdu: bytes, unit: int) -> bytes:
        code = pdu[0]
        if self.unit_ids is not None and unit not in self.unit_ids:
            return exception_reply(code, TARGET_FAILED)
        serve = _SERVE.get(code) if code in self.functions else None
        if serve is None:
            return exception_reply(code, ILLEGAL_FUNCTION)
        if code in self.refusals:
            return exception_reply(code, self.refusals[code])
        asked = modbus.decode_request(pdu)
        if asked.fault:
            return exception_reply(code, ILLEGAL_VALUE)
        result = serve(self, asked)
        return exception_reply(code, result) if isinstance(result, int) else result

    # One method for each kind of request.  Each gives the reply PDU or an exception code.

    def _read_bits(self, asked: Message) -> bytes | int:
        table = self.coils if asked.function == 0x01 else self.discrete_inputs
        start, quantity = asked.fields["address"], asked.fields["quantity"]
        fault = _range_fault(asked.function, quantity, start, len(table))
        return fault or data_reply(asked.function, modbus.pack_bits(table[start : start + quantity]))

    def _read_registers(self, asked: Message) -> bytes | int:
        table = self.holding_registers if asked.function == 0x03 else self.input_registers
        start, quantity = asked.fields["address"], asked.fields["quantity"]
        fault = _range_fault(asked.function, quantity, start, len(table))
        return fault or data_reply(asked.function, modbus.pack_registers(table[start : start + quantity]))

    def _write_coil(self, asked: Message) -> bytes | int:
        address, value = asked.fields["address"], asked.fields["value"]
        if value not in (modbus.COIL_ON, modbus.COIL_OFF):
            return ILLEGAL_VALUE
        if address >= len(self.coils):
            return ILLEGAL_ADDRESS
        self.coils[address] = value == modbus.COIL_ON
        return modbus.write_coil(address, value == modbus.COIL_ON)

    def _write_register(self, asked: Message) -> bytes | int:
        address, value = asked.fields["address"], asked.fields["value"]
        if address >= len(self.holding_registers):
            return ILLEGAL_ADDRESS
        self.holding_registers[address] = value
        return modbus.write_register(address, value)

    def _write_many(self, asked: Message) -> bytes | int:
        start, quantity = asked.fields["address"], asked.fields["quantity"]
        bits = asked.function == 0x0F
        size = len(self.coils) if bits else len(self.holding_registers)
        fault = _range_fault(asked.function, quantity, start, size, len(asked.data))
        if fault:
            return fault
        if bits:
            self.coils[start : start + quantity] = bytes(modbus.unpack_bits(asked.data, quantity))
        else:
            self.holding_registers[start : start + quantity] = array("H", modbus.unpack_registers(asked.data))
        return struct.pack(">BHH", asked.function, start, quantity)

    def _mask_write(self, asked: Message) -> bytes | int:
        address, and_mask, or_mask = asked.fields["address"], asked.fields["and_mask"], asked.fields["or_mask"]
        if address >= len(self.holding_registers):
            return ILLEGAL_ADDRESS
        old = self.holding_registers[address]
        self.holding_registers[address] = old & and_mask | or_mask & ~and_mask & 0xFFFF
        return modbus.mask_write(address, and_mask, or_mask)

    def _read_write(self, asked: Message) -> bytes | int:
        layout, table, given = modbus.FUNCTIONS[0x17], self.holding_registers, asked.fields
        start, quantity = given["read_address"], given["read_quantity"]
        write_start, write_quantity = given["write_address"], given["write_quantity"]
        if not (1 <= quantity <= layout.read_max and 1 <= write_quantity <= layout.write_max):
            return ILLEGAL_VALUE
        if len(asked.data) != 2 * write_quantity:
            return ILLEGAL_VALUE
        if max(start + quantity, write_start + write_quantity) > len(table):
            return ILLEGAL_ADDRESS
        table[write_start : write_start + write_quantity] = array("H", modbus.unpack_registers(asked.data))
        return data_reply(0x17, modbus.pack_registers(table[start : start + quantity]))

    def _diagnose(self, asked: Message) -> bytes | int:
        sub, data = asked.fields["sub_function"], asked.data
        if sub == 0x0000:
            return modbus.loop_back(data) if data and len(data) % 2 == 0 else ILLEGAL_VALUE
        if sub not in (0x0A, *_COUNTERS):
            return ILLEGAL_FUNCTION
        if data != b"\0\0":
            return ILLEGAL_VALUE
        if sub == 0x0A:
            self.counts = dict.fromkeys(self.counts, 0)
            return struct.pack(">BHH", 0x08, sub, 0)
        return struct.pack(">BHH", 0x08, sub, self.counts.get(_COUNTERS[sub], 0))

    def _identify(self, asked: Message) -> bytes | int:
        """Device identification, AP 6.21.  The order of object id before code is recalled, assumed."""
        if asked.data[:1] != b"\x0e":
            return ILLEGAL_FUNCTION
        if len(asked.data) != 3:
            return ILLEGAL_VALUE
        code, first = asked.data[1], asked.data[2]
        if code == 0x04 and first not in self.identity:
            return ILLEGAL_ADDRESS
        if not 1 <= code <= 4:
            return ILLEGAL_VALUE
        level = 3 if any(number >= 0x80 for number in self.identity) else 2 if max(self.identity, default=0) > 2 else 1
        last = {1: 0x02, 2: 0x7F, 3: 0xFF, 4: first}[code]
        start = first if first in self.identity else 0
        wanted = [number for number in sorted(self.identity) if start <= number <= last]
        return self._identity_reply(code, 0x80 | level, wanted)

    def _identity_reply(self, code: int, conformity: int, wanted: list[int]) -> bytes:
        objects, count, following = b"", 0, 0
        for number in wanted:
            text = self.identity[number].encode("ascii", "replace")[:244]
            if 7 + len(objects) + 2 + len(text) > modbus.MAX_PDU_BYTES:
                following = number
                break
            objects += bytes((number, len(text))) + text
            count += 1
        return bytes((0x2B, 0x0E, code, conformity, 0xFF if following else 0, following, count)) + objects


def _range_fault(function: int, quantity: int, start: int, size: int, data_bytes: int | None = None) -> int:
    """Exception code for quantity and byte count (03), then for the range (02); 0 if both are right."""
    layout = modbus.FUNCTIONS[function]
    if not 1 <= quantity <= (layout.read_max or layout.write_max):
        return ILLEGAL_VALUE
    if data_bytes is not None and data_bytes != modbus.data_size_bytes(layout.item, quantity):
        return ILLEGAL_VALUE
    return ILLEGAL_ADDRESS if start + quantity > size else 0


_SERVE: dict[int, Callable[[ModbusServer, Message], bytes | int]] = {
    0x01: ModbusServer._read_bits,
    0x02: ModbusServer._read_bits,
    0x03: ModbusServer._read_registers,
    0x04: ModbusServer._read_registers,
    0x05: ModbusServer._write_coil,
    0x06: ModbusServer._write_register,
    0x08: ModbusServer._diagnose,
    0x0F: ModbusServer._write_many,
    0x10: ModbusServer._write_many,
    0x16: ModbusServer._mask_write,
    0x17: ModbusServer._read_write,
    0x2B: ModbusServer._identify,
}
