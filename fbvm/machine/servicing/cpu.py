"""What FINS commands may see of the CPU unit and do to it, and how they refuse."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from fbvm.base.memory import Memory
from fbvm.machine.scan.refresh import Attached
from fbvm.machine.servicing.registers import Registers
from fbvm.wire.fins.codes import EndCode
from fbvm.wire.fins.frames import Address


class Refused(Exception):
    """A command that is not executed: its end code, and the data that go with that."""

    def __init__(self, end_code: EndCode, data: bytes = b"") -> None:
        super().__init__(end_code)
        self.end_code, self.data = end_code, data


class Machine(Protocol):
    """The PLC behind the CPU unit."""

    @property
    def memory(self) -> Memory: ...

    @property
    def units(self) -> Sequence[Attached]: ...

    @property
    def now_ns(self) -> int: ...

    @property
    def is_running(self) -> bool:
        """True in RUN and MONITOR mode, False in PROGRAM mode."""

    @property
    def forces(self) -> Mapping[str, object]: ...

    def force(self, where: str, value: object) -> None: ...

    def unforce(self, where: str | None = None) -> None: ...

    def servicing_changes_mode(self, running: bool) -> None:
        """Another mode from the next scan on."""


@dataclass(frozen=True)
class Asked:
    """A command on its way through the CPU unit: who asks, and the parameters.

    `machine` is the PLC, `registers` are those of its memory."""

    machine: Machine
    registers: Registers
    source: Address
    parameters: bytes

    def number(self, at: int) -> int:
        """Two bytes of the parameters as a number."""
        return int.from_bytes(self.parameters[at : at + 2], "big")
