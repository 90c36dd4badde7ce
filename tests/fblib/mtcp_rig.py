"""A PLC with an ETN21, the MTCP_ETN blocks in one program, and a peer at the other end, all in virtual time.

A rig is told its blocks as the program calls them, without the pins that it drives itself:

    Rig(rd="Fn03(Register_Address := 1000, Register_Qty := 3, RespData_DM := 200)")

gives the program an instance `rd` with EN from `conn.ENO AND rd_EN` and its command from `rd_Cmd`.  Numbers on pins
become variables (`rd_Register_Qty`), so that rigs which differ in numbers share one image.
"""

from __future__ import annotations

import re
from array import array
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from textwrap import dedent

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import Action, ModbusPeer, Say, Station
from fbvm.record.draw.chart import chart
from fbvm.units.etn21.map import Layout
from fbvm.units.etn21.names import descriptions
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.link import Peer

SERVER = Peer("192.168.250.2", 502)
CYCLE_NS = 10_000_000
SECOND_NS = 1_000_000_000
OWN = (range(30000, 30100), range(32500, 32643))
"""D words of the unit and of the blocks: the sheet's two areas, and the gap between them for long requests."""
WRITERS = ("05", "06", "0F", "10")

NUMBER = re.compile(r"(\w+) := (\d+|TRUE|FALSE)(?=, |$)")

CONNECT = "IP_Address1 := Octet1, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 2, Connect := Connect"


@cache
def image_of(text: str) -> Image:
    """The image of a program that has no errors."""
    made = compile_text(text)
    assert made.image is not None, [message.message for message in made.diagnostics]
    return made.image


def program(
    blocks: dict[str, str], *, any_order: bool = False, wired: bool = True, more: str = "", more_variables: str = ""
) -> tuple[str, dict[str, int]]:
    """The text of a program with `conn` and these blocks, called in this order, and the values of its variables.

    `wired`: EN comes from `conn.ENO`.  `any_order`: calls follow `Order`, in which 0 is `conn`, 1 the first block."""
    variables = ["conn : MTCP_ETN_Connect; conn_EN, Connect : BOOL := TRUE; Octet1 : UINT := 192;", more_variables]
    calls = [f"conn(EN := conn_EN, {CONNECT});"]
    pin_variables: list[str] = []
    values: dict[str, int] = {}
    for name, call in blocks.items():
        block, pins = re.fullmatch(r"(\w+)\((.*)\)", call).groups()  # type: ignore[union-attr]
        for pin, number in NUMBER.findall(pins):
            kind = "BOOL" if number in ("TRUE", "FALSE") else "WORD" if pin == "SlaveID" else "UINT"
            pin_variables.append(f"{name}_{pin} : {kind};")
            values[f"{name}_{pin}"] = number == "TRUE" if kind == "BOOL" else int(number)
        pins = NUMBER.sub(rf"\1 := {name}_\1", pins)
        command = "Cmd_Write" if block[2:] in WRITERS else "Cmd_Read"
        enable = f"conn.ENO AND {name}_EN" if wired else f"{name}_EN"
        variables.append(f"{name} : MTCP_ETN_{block}; {name}_EN : BOOL := TRUE; {name}_Cmd : BOOL;")
        calls.append(f"{name}(EN := {enable}, {pins}, {command} := {name}_Cmd);")
    if any_order:
        pin_variables.append(f"Order : ARRAY[0..{len(blocks)}] OF INT;")
        variables.append("Place : INT;")
        cases = [f"{number}: {call}" for number, call in enumerate(calls)]
        calls = [f"FOR Place := 0 TO {len(blocks)} DO CASE Order[Place] OF", *cases, "END_CASE; END_FOR;"]
    sections = ["VAR RETAIN", *pin_variables, "END_VAR", "VAR", *variables, "END_VAR"]
    return "\n".join(["PROGRAM Main", *sections, *calls, more, "END_PROGRAM"]), values


class Rig:
    """One PLC, one unit, one network, one peer at 192.168.250.2 port 502 (None: nobody)."""

    def __init__(
        self,
        peer: Station | None = None,
        *,
        timing: str = "exact",
        seed: int = 0,
        text: str = "",
        order: Sequence[str] = (),
        wired: bool = True,
        more: str = "",
        more_variables: str = "",
        refused: bool = False,
        **blocks: str,
    ) -> None:
        made, values = program(blocks, any_order=bool(order), wired=wired, more=more, more_variables=more_variables)
        self.peer = peer if isinstance(peer, ModbusPeer) else ModbusPeer()
        self.server = self.peer.server
        self.network = LoopNetwork(seed)
        if not refused:
            self.network.place(SERVER, peer or self.peer)
        self.unit = Etn21(0, "192.168.250.1", timing=timing, seed=seed)
        self.plc = Plc(image_of(dedent(text or made)), CYCLE_NS)
        self.plc.attach(self.unit, self.network)
        for name, value in () if text else values.items():
            self.set(name, value)
        for place, name in enumerate(order):
            self.set(f"Order[{place}]", ["conn", *blocks].index(name))

    # --- running ------------------------------------------------------------------------------------------------------

    def scan(self, count: int = 1) -> None:
        for _ in range(count):
            assert self.plc.scan() is None

    def run_until(self, condition: str, max_s: float = 60) -> float:
        """Seconds that it took; fails if it took more than `max_s`."""
        start_ns = self.plc.now_ns
        reason = self.plc.run(until=condition, max_ns=int(max_s * SECOND_NS))
        assert reason == "until", f"{condition}: {reason} after {max_s} s"
        return (self.plc.now_ns - start_ns) / SECOND_NS

    def connect(self) -> Rig:
        self.run_until("Main.conn.ENO")
        return self

    def command(self, *names: str, max_s: float = 60) -> bool:
        """Command blocks in the same scan and run until all have ended, one scan at least.

        False if none has begun: the connection was lost in that very scan."""
        for name in names:
            self.set(f"{name}_Cmd", True)
        self.scan()
        busy = " OR ".join(f"Main.{name}.Exchange.State <> 0" for name in names)
        began = any(self.number(f"{name}.Exchange.State") for name in names)
        self.run_until(f"NOT ({busy})", max_s)
        for name in names:
            self.set(f"{name}_Cmd", False)
        self.scan()
        return began

    def chart(self, scans: int, *signals: str) -> str:
        """The signals at the end of each scan."""
        return chart(self.plc, scans, [_named(signal) for signal in signals])

    # --- values -------------------------------------------------------------------------------------------------------

    def set(self, name: str, value: object) -> None:
        self.plc.write(f"Main.{name}", value)

    def get(self, name: str) -> object:
        return self.plc.read(f"Main.{name}")

    def words(self, first: int, count: int) -> list[int]:
        """D words."""
        return self.plc.memory.words("D")[first : first + count].tolist()

    def fill(self, first: int, words: Iterable[int]) -> None:
        data = array("H", words)
        self.plc.memory.words("D")[first : first + len(data)] = memoryview(data)

    def all_words(self) -> list[int]:
        """All D words, those of the unit and of the blocks as 0."""
        words = self.plc.memory.words("D").tolist()
        for area in OWN:
            words[area.start : area.stop] = [0] * len(area)
        return words

    def frame(self, first: int, size: int) -> str:
        """Bytes from a D word on, as hexadecimal text."""
        data = b"".join(word.to_bytes(2, "big") for word in self.words(first, (size + 1) // 2))
        return data[:size].hex(" ").upper()

    def number(self, name: str) -> int:
        """A whole number."""
        value = self.get(name)
        assert isinstance(value, int)
        return value

    def code(self, name: str) -> str:
        """Error_Code of a block in hexadecimal, "" where Error is FALSE."""
        code = self.number(f"{name}.Error_Code")
        assert bool(self.get(f"{name}.Error")) == (code != 0)
        return f"{code:04X}" if code else ""

    def result(self, name: str) -> tuple[int, str]:
        """Rcv_Counter and Error_Code of a block."""
        return self.number(f"{name}.Rcv_Counter"), self.code(name)


NAMES = descriptions(Layout.of(0))


def _named(signal: str) -> str | tuple[str, str]:
    return (signal, NAMES.get(signal, "")) if re.match(r"CIO |D\d", signal) else f"Main.{signal}"


def answering(reply: Callable[[bytes], list[Action]]) -> ModbusPeer:
    """A Modbus server that does with its right replies what a function says."""
    return ModbusPeer(None, reply)


def saying(change: Callable[[bytes], bytes]) -> ModbusPeer:
    """A Modbus server whose replies are changed."""
    return ModbusPeer(None, lambda frame: [Say(change(frame))])
