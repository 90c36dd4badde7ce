"""Response codes that an ETN21 gives to requests on demand: a list in the memory of its processor."""

from __future__ import annotations

from array import array
from collections.abc import Iterable, MutableSequence
from dataclasses import dataclass
from typing import Any, overload

from fbvm.units.contract import Processor
from fbvm.units.etn21.map import Switch

ANY_SWITCH, ANY_SOCKET = 255, 65535
ROW = 3
"""Words of a fault: code, switch, socket."""


@dataclass(frozen=True, slots=True)
class Fault:
    """A response code that the unit gives to the next request that fits, instead of serving it."""

    code: int
    switch: Switch | None = None
    """None fits every switch."""

    socket: int | None = None
    """None fits every socket number."""


class Faults(MutableSequence[Fault]):
    """Those that wait for a request, in order.

    Raises ValueError for more than there is room for (255), and for a code that is no word."""

    def __init__(self, processor: Processor) -> None:
        self._count = processor.view("ETN21_Fault_Count", "u16")
        self._rows = processor.view("ETN21_Faults", "u16")

    @property
    def _all(self) -> list[Fault]:
        rows = self._rows[: ROW * self._count[0]].tolist()
        return [Fault(code, None if switch == ANY_SWITCH else Switch(switch), None if socket == ANY_SOCKET else socket)
                for code, switch, socket in zip(rows[0::ROW], rows[1::ROW], rows[2::ROW], strict=True)]  # fmt: skip

    def _set(self, faults: list[Fault]) -> None:
        most = len(self._rows) // ROW
        if len(faults) > most:
            raise ValueError(f"an ETN21 has room for {most} faults; {len(faults)} were given")
        rows = array("H")
        for fault in faults:
            if not 0 <= fault.code <= 0xFFFF:
                raise ValueError(f"response code {fault.code} is not in 0..65535")
            rows.append(fault.code)
            rows.append(ANY_SWITCH if fault.switch is None else fault.switch)
            rows.append(ANY_SOCKET if fault.socket is None else fault.socket)
        self._rows[: len(rows)] = memoryview(rows)
        self._count[0] = len(faults)

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
