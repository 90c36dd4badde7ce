"""Response codes that an ETN21 gives to requests on demand: a list in the memory of its processor."""

from __future__ import annotations

from collections.abc import Iterable, MutableSequence
from dataclasses import dataclass
from typing import Any, overload

from fbvm.units.contract import Processor
from fbvm.units.etn21.map import Switch

FIELDS = ("code", "switch", "socket")
"""Of a row of ETN21_Faults."""


@dataclass(frozen=True, slots=True)
class Fault:
    """A response code that the unit gives to the next request that fits, instead of serving it."""

    code: int
    switch: Switch | None = None
    """None fits every switch."""

    socket: int | None = None
    """None fits every socket number."""


class Faults(MutableSequence[Fault]):
    """The faults that wait for a request, in order: a list whose rows lie in the processor's memory.

    Raises ValueError for more than the program has room for (255), and for a code that is no word."""

    def __init__(self, processor: Processor) -> None:
        contract = processor.contract
        self._count, self._rows = processor.view("ETN21_Fault_Count"), processor.view("ETN21_Faults")
        row = contract.record("ETN21_Faults")
        row.require(FIELDS, __name__)
        self._most, self._size = contract.array("ETN21_Faults")[1:]
        self._pack, self._read = row.packer(*FIELDS), row.rows(*FIELDS)
        self.times_set = 0
        """How often the list has been changed from outside the program."""
        self._any_switch, self._any_socket = map(contract.constant, ("ETN21_ANY_SWITCH", "ETN21_ANY_SOCKET"))

    @property
    def _all(self) -> list[Fault]:
        rows = self._read(self._rows[: self._size * self._count[0]])
        return [Fault(code, None if switch == self._any_switch else Switch(switch),
                      None if socket == self._any_socket else socket) for code, switch, socket in rows]  # fmt: skip

    def _set(self, faults: list[Fault]) -> None:
        if len(faults) > self._most:
            raise ValueError(f"an ETN21 has room for {self._most} faults; {len(faults)} were given")
        for fault in faults:
            if not 0 <= fault.code <= 0xFFFF:
                raise ValueError(f"response code {fault.code} is not in 0..65535")
        rows = bytearray(self._size * len(faults))
        for number, fault in enumerate(faults):
            self._pack(rows, self._size * number, fault.code,
                       self._any_switch if fault.switch is None else fault.switch,
                       self._any_socket if fault.socket is None else fault.socket)  # fmt: skip
        self._rows[: len(rows)] = rows
        self._count[0] = len(faults)
        self.times_set += 1

    def __len__(self) -> int:
        return int(self._count[0])

    @overload
    def __getitem__(self, index: int) -> Fault: ...
    @overload
    def __getitem__(self, index: slice) -> list[Fault]: ...
    def __getitem__(self, index: int | slice) -> Fault | list[Fault]:
        return self._all[index]

    @overload
    def __setitem__(self, index: int, value: Fault) -> None: ...
    @overload
    def __setitem__(self, index: slice, value: Iterable[Fault]) -> None: ...
    def __setitem__(self, index: Any, value: Any) -> None:
        faults = self._all
        faults[index] = value
        self._set(faults)

    def __delitem__(self, index: int | slice) -> None:
        faults = self._all
        del faults[index]
        self._set(faults)

    def insert(self, index: int, value: Fault) -> None:
        faults = self._all
        faults.insert(index, value)
        self._set(faults)

    def __eq__(self, other: object) -> bool:
        return self._all == other

    __hash__ = None  # type: ignore[assignment]  # as of any list

    def __repr__(self) -> str:
        return repr(self._all)
