"""A PLC with an Ethernet module and MBP_MSTR blocks in one program, and peers at the other end, all in virtual time.

    rig = Rig()
    rig.control(2, 0, 3, 1, 0x0700, *SERVER_IP)
    assert rig.operate() == 0
    rig.databuf(3)

A program has blocks `m1`, `m2` ..., each with its ENABLE and ABORT in variables such as `m1_ENABLE`, its CONTROL in
`m1_CONTROL` and its DATABUF in `m1_DATABUF`.
"""

from __future__ import annotations

from functools import cache

import noc_words

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import ModbusPeer, Station
from fbvm.record.draw.chart import chart
from fbvm.units.port.noc import Noc
from fbvm.wire.link import Peer
from fbvm.wire.modbus_server import ModbusServer

SERVER = Peer("192.168.250.2", 502)
SERVER_IP = (192, 168, 250, 2)
CYCLE_NS = 10_000_000
SECOND_NS = 1_000_000_000
WITH_17 = (1, 2, 3, 4, 5, 6, 8, 15, 16, 22, 23)


@cache
def image_of(text: str) -> Image:
    """The image of a program that has nothing to be said against."""
    made = compile_text(text)
    assert made.image is not None and not made.diagnostics, [message.message for message in made.diagnostics]
    return made.image


def program(blocks: int, options: str, arrays: tuple[str, str], more: str = "") -> str:
    """The text of a program with so many blocks; `options` initialises each, `arrays` are the types of their arrays."""
    variables, calls = [], []
    for number in range(1, blocks + 1):
        name = f"m{number}"
        given = f" := ({options})" if options else ""
        variables.append(f"{name} : MBP_MSTR{given}; {name}_ENABLE, {name}_ABORT : BOOL;")
        variables.append(f"{name}_CONTROL : {arrays[0]}; {name}_DATABUF : {arrays[1]};")
        calls.append(f"{name}(ENABLE := {name}_ENABLE, ABORT := {name}_ABORT, "
                     f"CONTROL := {name}_CONTROL, DATABUF := {name}_DATABUF);")  # fmt: skip
    return "\n".join(["PROGRAM Main", "VAR", *variables, "END_VAR", *calls, more, "END_PROGRAM"])


class Rig:
    """One PLC with a module in slot 7 at 192.168.250.22, one network, one peer at 192.168.250.2 port 502 (None: nobody)."""

    def __init__(
        self,
        peer: Station | None = None,
        *,
        blocks: int = 1,
        options: str = "",
        control: str = "ARRAY[1..11] OF WORD",
        databuf: str = "ARRAY[1..125] OF WORD",
        more: str = "",
        text: str = "",
        noc: Noc | None = None,
        network: LoopNetwork | None = None,
        refused: bool = False,
    ) -> None:
        self.peer = peer if isinstance(peer, ModbusPeer) else ModbusPeer(ModbusServer(functions=WITH_17))
        self.server = self.peer.server
        self.network = network or LoopNetwork()
        if not refused:
            self.network.place(SERVER, peer or self.peer)
        self.noc = noc or Noc(restart_ns=5 * CYCLE_NS)
        self.plc = Plc(image_of(text or program(blocks, options, (control, databuf), more)), CYCLE_NS)
        self.plc.attach(self.noc, self.network)

    # --- running ------------------------------------------------------------------------------------------------------

    def scan(self, count: int = 1) -> None:
        for _ in range(count):
            trap = self.plc.scan()
            assert trap is None, trap

    def set(self, name: str, value: object) -> None:
        self.plc.write(f"Main.{name}", value)

    def get(self, name: str) -> object:
        return self.plc.read(f"Main.{name}")

    def control(self, *words: int, block: int = 1) -> None:
        """Write CONTROL from its first word on; CONTROL[2] only if it is given."""
        for number, word in enumerate(words, self.lower(f"m{block}_CONTROL")):
            self.set(f"m{block}_CONTROL[{number}]", self._fitting(f"m{block}_CONTROL", word))

    def fill(self, words: list[int], block: int = 1) -> None:
        """Write DATABUF from its first word on."""
        for number, word in enumerate(words, self.lower(f"m{block}_DATABUF")):
            self.set(f"m{block}_DATABUF[{number}]", self._fitting(f"m{block}_DATABUF", word))

    def databuf(self, count: int, block: int = 1) -> list[int]:
        first = self.lower(f"m{block}_DATABUF")
        return [self._word(f"m{block}_DATABUF[{number}]") for number in range(first, first + count)]

    def status(self, block: int = 1) -> str:
        """CONTROL[2] in hexadecimal."""
        name = f"m{block}_CONTROL"
        return f"{self._word(f'{name}[{self.lower(name) + 1}]'):04X}"

    def outputs(self, block: int = 1) -> str:
        """A, S, E for what is TRUE of ACTIVE, SUCCESS and ERROR."""
        pins = ("ACTIVE", "SUCCESS", "ERROR")
        return "".join(pin[0] for pin in pins if self.get(f"m{block}.{pin}"))

    def operate(self, *control: int, block: int = 1, max_s: float = 60) -> str:
        """One operation from ENABLE to its end; CONTROL[2] in hexadecimal.  ENABLE is FALSE for a scan afterwards."""
        if control:
            self.control(*control, block=block)
        self.set(f"m{block}_ENABLE", True)
        end_ns = self.plc.now_ns + int(max_s * SECOND_NS)
        while True:
            self.scan()
            outputs = self.outputs(block)
            if outputs in ("S", "E"):
                break
            assert self.plc.now_ns < end_ns, outputs
        status = self.status(block)
        assert (outputs == "S") == (status == "0000")
        self.set(f"m{block}_ENABLE", False)
        self.scan()
        assert self.outputs(block) == ""
        assert self.status(block) == status
        return status

    def chart(self, scans: int, *signals: str) -> str:
        """The signals at the end of each scan."""
        return chart(self.plc, scans, [f"Main.{signal}" for signal in signals])

    # --- values -------------------------------------------------------------------------------------------------------

    def lower(self, name: str) -> int:
        """The lower bound of an array."""
        kind = self.plc.find(f"Main.{name}").type  # type: ignore[union-attr]
        return int(kind.bounds[0][0])  # type: ignore[attr-defined]

    def _fitting(self, name: str, word: int) -> int:
        kind = self.plc.find(f"Main.{name}").type.element  # type: ignore[union-attr, attr-defined]
        return word - 0x10000 if kind.name == "INT" and word > 0x7FFF else word

    def _word(self, name: str) -> int:
        value = self.get(name)
        assert isinstance(value, int)
        return value & 0xFFFF

    def module(self, word: int, place: int = 7) -> int:
        """A word of the head of a module."""
        return self.plc.memory.words(noc_words.AREA)[place * noc_words.HEAD_WORDS + word]

    def heard(self) -> list[str]:
        """The frames that the peer was sent."""
        return [frame.hex(" ").upper() for frame in self.peer.received]
