"""Peripheral servicing: the end of a scan, in which FINS commands are executed and network instructions go on.

It comes behind the I/O refresh (W393 p447-448): the program sees a write between two executions, never inside one."""

from __future__ import annotations

from fbvm.base.areas import NEVER
from fbvm.base.memory import Memory
from fbvm.code.image import Image
from fbvm.machine.scan.clock_words import CYCLE_TIME, FIRST_CYCLE, TENTH_MS_NS
from fbvm.machine.scan.refresh import Attached
from fbvm.machine.servicing import commands
from fbvm.machine.servicing.clock_setting import clock_setting_of
from fbvm.machine.servicing.cpu import Machine
from fbvm.machine.servicing.ports import ports_of
from fbvm.machine.servicing.registers import Registers
from fbvm.units.contract import FinsAccess, FinsUnit, serves_fins
from fbvm.wire.fins.codes import EndCode
from fbvm.wire.fins.frames import CPU_UNIT, Command, Response


class PeripheralServicing:
    """The peripheral servicing of one PLC; the CPU unit that its units meet (`CpuUnit`)."""

    def __init__(self, machine: Machine, image: Image) -> None:
        self._machine = machine
        self.registers = Registers(machine.memory)
        self._known: list[Attached] = []
        self._units: list[tuple[FinsUnit, Attached]] = []
        self._ports = ports_of(image, machine.memory)
        self._setting = clock_setting_of(image, machine.memory)
        self._has_changed = False

    @property
    def is_needed(self) -> bool:
        """True if a unit serves FINS, or the program has network instructions or DATE, so that each scan has to end with
        `serve`."""
        if self._known != self._machine.units:
            self._known = list(self._machine.units)
            self._units = [(row.unit, row) for row in self._known if serves_fins(row.unit) and row.unit.has_fins]
        return bool(self._units) or self._ports is not None or self._setting is not None

    @property
    def wake_ns(self) -> int:
        """When a network instruction wants another scan; NEVER if none is waiting."""
        return self._ports.wake_ns if self._ports else NEVER

    @property
    def clock_ns(self) -> int:
        """The PLC's clock at power-on, which FINS and DATE set: ns since 2000-01-01 00:00.  Setting it is an input."""
        return self.registers.clock_ns

    @clock_ns.setter
    def clock_ns(self, date_ns: int) -> None:
        self.registers.clock_ns = date_ns

    def serve(self, now_ns: int) -> bool:
        """The servicing of one scan.  Returns True if the program should see something soon."""
        self._has_changed = False
        self._measure()
        if self._ports and self._ports.serve(now_ns, self._send):
            self._has_changed = True
        if self._setting and self._setting.serve(self.registers, now_ns):
            self._has_changed = True
        for unit, attached in self._units:
            if requests := unit.serve(self, now_ns):
                attached.link.submit(requests, now_ns)
            self._has_changed = self._has_changed or unit.changed_words
        return self._has_changed

    def _measure(self) -> None:
        """Notes the time of the cycle before, for 0620."""
        a, (word, bit) = self.memory.words("A"), FIRST_CYCLE
        if self._machine.is_running and not a[word] >> bit & 1:
            self.registers.measure((a[CYCLE_TIME] | a[CYCLE_TIME + 1] << 16) * TENTH_MS_NS)

    # --- called by units ----------------------------------------------------------------------------------------------

    @property
    def memory(self) -> Memory:
        """The PLC's memory."""
        return self._machine.memory

    def execute(self, command: Command, access: FinsAccess) -> tuple[int, bytes]:
        """Executes a command for the CPU unit; its end code and data."""
        end_code, data = commands.execute(self._machine, self.registers, command, access)
        self._has_changed = self._has_changed or (end_code == 0 and commands.changes(command.code))
        return end_code, data

    def take_response(self, response: Response) -> None:
        """Takes the response to a command of a network instruction; others are thrown away."""
        if self._ports and self._ports.take_response(response):
            self._has_changed = True

    # --- network instructions -----------------------------------------------------------------------------------------

    def _send(self, command: Command) -> tuple[int, bytes] | None:
        """Lets this PLC execute a command that is for itself, or a unit send it.  There are no routing tables: the first unit
        with FINS is on the local network."""
        to = command.header.destination
        unit = self._units[0][0] if self._units else None
        if to.network:
            return EndCode.NO_ROUTE, b""
        if to.node == 0 or (unit and to.node == unit.node):
            if to.unit == CPU_UNIT:
                return self.execute(command, FinsAccess())
            return unit.execute(command, self) if unit else (EndCode.NO_UNIT, b"")
        if unit is None:
            return EndCode.NOT_IN_NETWORK, b""
        end_code = unit.send(command)
        return (end_code, b"") if end_code else None

