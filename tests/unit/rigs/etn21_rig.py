"""A bench for the ETN21: memory words, hand-fed network events and virtual time, one refresh at a call."""

from __future__ import annotations

from array import array

from common_unit_tests import FakeMemory

from fbvm.units.etn21.map import OPEN, Layout, Switch
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.link import Closed, Event, Opened, Peer, Request

SERVER = Peer("192.168.250.7", 502)
D, CIO, W, H, A, E2 = 0x82, 0xB0, 0xB1, 0xB2, 0xB3, 0xA2


class Rig:
    """One unit with its memory and a clock."""

    def __init__(self, unit: Etn21 | None = None, cycle_ms: int = 10) -> None:
        self.unit = unit or Etn21()
        self.memory = FakeMemory()
        self.cio, self.d = self.memory.words("CIO"), self.memory.words("D")
        self.layout: Layout = self.unit.layout
        self.now_ns = 0
        self.cycle_ns = cycle_ms * 1_000_000
        self.unit.reset(self.memory)

    # --- the program's side ------------------------------------------------------------------------------------------

    def parameters(
        self,
        area: int = 1,
        socket: int = 1,
        *,
        option: int = 0,
        local_port: int = 0,
        remote: Peer = SERVER,
        count: int = 0,
        address: tuple[int, int, int] = (D, 1000, 0),
        timeout: int = 0,
    ) -> None:
        """Fill a parameter area; the response code becomes FFFF so that its writing is seen."""
        a, b, c, d = (int(part) for part in remote.host.split("."))
        code, word, bit = address
        row = [option << 8 | socket, local_port, a << 8 | b, c << 8 | d, remote.port, count]
        row += [code << 8 | word >> 8, (word & 0xFF) << 8 | bit, timeout, 0xFFFF]
        first = self.layout.parameters(area)
        self.d[first : first + 10] = memoryview(array("H", row))

    def turn_on(self, switch: Switch, area: int = 1) -> None:
        word, first_bit = self.layout.switches(area)
        self.cio[word] |= 1 << (first_bit + switch)

    def turn_off(self, switch: Switch, area: int = 1) -> None:
        word, first_bit = self.layout.switches(area)
        self.cio[word] &= ~(1 << (first_bit + switch))

    # --- what it sees ------------------------------------------------------------------------------------------------

    def is_on(self, switch: Switch, area: int = 1) -> bool:
        word, first_bit = self.layout.switches(area)
        return bool(self.cio[word] >> (first_bit + switch) & 1)

    def result(self, offset: int, area: int = 1) -> int:
        """Word +offset of a parameter area."""
        return int(self.d[self.layout.parameters(area) + offset])

    def code(self, area: int = 1) -> str:
        return f"{self.result(9, area):04X}"

    def status(self, socket: int = 1, protocol: str = "TCP") -> int:
        return int(self.cio[self.layout.status(protocol, socket)])

    def is_open(self, socket: int = 1, protocol: str = "TCP") -> bool:
        return bool(self.status(socket, protocol) & OPEN)

    def state(self, socket: int = 1) -> int:
        return int(self.d[self.layout.m + 8 + socket])

    def waiting(self, socket: int = 1) -> int:
        """Bytes received, as m+1..m+8 show them."""
        return int(self.d[self.layout.m + socket])

    # --- cycles ------------------------------------------------------------------------------------------------------

    def scan(self, *steps: Switch | Event, area: int = 1) -> list[Request]:
        """One cycle: the program turns switches of `area` ON, then the refresh sees the events."""
        events: list[Event] = []
        for step in steps:
            if isinstance(step, Switch):
                self.turn_on(step, area)
            else:
                events.append(step)
        self.now_ns += self.cycle_ns
        return self.unit.refresh(self.memory, events, self.now_ns)

    def wait(self, seconds: float) -> list[Request]:
        """One refresh after a long cycle."""
        self.now_ns += round(seconds * 1e9) - self.cycle_ns
        return self.scan()

    def open(self, socket: int = 1, area: int = 1, local_port: int = 0, option: int = 0) -> None:
        """An active open that works."""
        self.parameters(area, socket, local_port=local_port, option=option)
        self.scan(Switch.ACTIVE_OPEN, area=area)
        self.scan(Opened(socket, local_port or 49152, SERVER))
        assert self.code(area) == "0000" and self.is_open(socket)

    def close(self, socket: int = 1, area: int = 1) -> None:
        """A close that works."""
        self.scan(Switch.CLOSE, area=area)
        self.scan(Closed(socket))
        assert not self.is_open(socket)

    def ask(self, switch: Switch, *events: Event, area: int = 1, cycles: int = 3) -> str:
        """Turn a switch ON, feed `events` in the next refresh, and return the response code once the switch is OFF."""
        self.scan(switch, area=area)
        self.scan(*events)
        for _ in range(cycles):
            if not self.is_on(switch, area):
                break
            self.scan()
        assert not self.is_on(switch, area)
        return self.code(area)

    def chart(self, *scans: list[Switch | Event]) -> str:
        """Area 1 and TCP socket 1 over some scans, one column a scan, as it stands after the I/O refresh."""
        rows: dict[str, str] = {}
        codes = []
        code_row = ""
        for steps in scans:
            before = self.result(9)
            self.scan(*steps)
            for name, value in self._cells():
                rows[name] = rows.get(name, "") + value
            if self.result(9) != before:
                codes.append(self.code())
            code_row += "*" if self.result(9) != before else "."
        lines = [f"{name:<13} {row}" for name, row in rows.items() if set(row) != {"."}]
        return "\n".join([*lines, f"{'code':<13} {code_row}  {' '.join(codes)}".rstrip()])

    def _cells(self) -> list[tuple[str, str]]:
        cells = [(f"switch {switch.name}"[7:], "#" if self.is_on(switch) else ".") for switch in Switch]
        names = {0: "Opening", 1: "Receiving", 2: "Sending", 3: "Closing", 13: "Data", 15: "Open"}
        cells += [(name, "#" if self.status() >> bit & 1 else ".") for bit, name in names.items()]
        return [*cells, ("state", f"{self.state():X}")]
