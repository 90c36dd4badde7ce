"""A PLC with an ETN21 and the server program, and clients at the other end that say any bytes, all in virtual time.

    rig = Rig("Sockets := 2")
    client = rig.client()
    assert client.ask("03 03 E8 00 03") == "03 06 AB 12 56 78 97 13"
"""

from __future__ import annotations

from array import array
from functools import cache
from random import Random

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopLink, LoopNetwork
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.link import Broken, Close, Connect, Event, Failed, Grant, Opened, Peer, PeerClosed, Received, Send
from fbvm.wire.modbus import Adu, Splitter
from fbvm.wire.modbus_server import ModbusServer

SERVER = Peer("192.168.250.1", 502)
CYCLE_NS = 10_000_000
SECOND_NS = 1_000_000_000
COUNTERS = ("W491", "W492", "W493", "W494", "W495")
"""Exceptions, frames received, frames sent, errors of receives, errors of sends."""


@cache
def image_of(text: str) -> Image:
    """The image of a program that has nothing to be said against."""
    made = compile_text(text)
    assert made.image is not None and not made.diagnostics, [message.message for message in made.diagnostics]
    return made.image


BITS = [bytes(byte >> bit & 1 for bit in range(8)) for byte in range(256)]
"""The bits of a byte, lowest first, as a server keeps coils."""
OWN_CIO, OWN_DM = range(1500, 1525), range(30000, 30100)
"""Words of the unit."""
AREAS = ("CIO", "W", "H", "A", "D")


class Rig:
    """One PLC whose program calls the server with these pins, at 192.168.250.1 port 502 of a network in memory."""

    def __init__(
        self, pins: str = "", *, timing: str = "exact", seed: int = 0, network: LoopNetwork | None = None
    ) -> None:
        self.network = network or LoopNetwork(seed)
        self.unit = Etn21(0, SERVER.host, timing=timing, seed=seed)
        text = f"PROGRAM Main VAR Server : ETN_Modbus_Server; END_VAR Server({pins}); END_PROGRAM"
        self.plc = Plc(image_of(text), CYCLE_NS)
        self.plc.attach(self.unit, self.network)
        self._clients = 0

    def scan(self, count: int = 1) -> None:
        for _ in range(count):
            assert self.plc.scan() is None

    def client(self, host: str = "", *, port: int = 0, connected: bool = True) -> Client:
        """A new client, by default one that the server has let in."""
        self._clients += 1
        client = Client(self, self.network.attach(host or f"192.168.251.{self._clients}"), port)
        if connected:
            assert client.connect()
        return client

    def counters(self) -> list[int]:
        return [int(self.plc.read(name)) for name in COUNTERS]  # type: ignore[arg-type]

    def words(self, area: str) -> memoryview:
        return self.plc.memory.words(area)

    def fill(self, seed: int) -> None:
        """Any values in all words that a client can reach, but for those of the unit."""
        dice = Random(seed)
        for area, count, own in (("CIO", 5801, OWN_CIO), ("D", 32768, OWN_DM)):
            words = self.words(area)
            for start, end in ((0, own.start), (own.stop, count)):
                words[start:end] = memoryview(array("H", dice.randbytes(2 * (end - start))))

    def foreign_words(self) -> dict[str, list[int]]:
        """All words that belong neither to the sheet's program nor to the unit nor to the clock."""
        found = {area: self.words(area).tolist() for area in AREAS}
        for area, own in (("CIO", OWN_CIO), ("CIO", range(5801, 6144)), ("W", range(480, 512)), ("D", OWN_DM),
                          ("A", range(2)), ("A", range(200, 201)), ("A", range(262, 266)), ("A", range(351, 355))):  # fmt: skip
            for word in own:
                found[area][word] = 0
        return found


class Client:
    """Somebody who connects to the server and says bytes."""

    def __init__(self, rig: Rig, link: LoopLink, port: int) -> None:
        self.rig = rig
        self.link = link
        self.port = port
        self.transaction = 0
        self.data = b""
        """What has come and was not taken."""
        self.end = ""
        """"FIN" or an errno name when the connection has ended."""
        self.is_open = False

    def connect(self, tries: int = 400) -> bool:
        """Try until it is let in; False if nobody has done so."""
        return any(self.dial() for _ in range(tries))

    def dial(self) -> bool:
        """One try, after leaving what there was."""
        self.leave()
        self.fetch()
        self.data, self.end, self.is_open = b"", "", False
        self.link.submit([Connect(1, SERVER, self.port), Grant(1, 65536)], self.rig.plc.elapsed_ns)
        for _ in range(3):
            self.rig.scan()
            self.fetch()
            if self.is_open or self.end:
                break
        return self.is_open and not self.end

    def fetch(self) -> None:
        for event in self.link.events(self.rig.plc.elapsed_ns):
            self._take(event)

    def _take(self, event: Event) -> None:
        match event:
            case Opened():
                self.is_open = True
            case Received(data=data):
                self.data += data
                self.link.submit([Grant(1, 65536)], self.rig.plc.elapsed_ns)
            case PeerClosed():
                self.end = self.end or "FIN"
            case Broken(error=error) | Failed(error=error):
                self.end = error

    def say(self, data: bytes) -> None:
        self.link.submit([Send(1, data)], self.rig.plc.elapsed_ns)

    def leave(self, reset: bool = False) -> None:
        self.link.submit([Close(1, reset)], self.rig.plc.elapsed_ns)

    def hear(self, scans: int = 60) -> bytes:
        """What comes within so many scans."""
        for _ in range(scans):
            self.rig.scan()
            self.fetch()
        data, self.data = self.data, b""
        return data

    def frames(self, count: int, scans: int = 4000) -> list[Adu]:
        """The next frames; fails if they do not come, or more."""
        splitter = Splitter()
        found = splitter.feed(self.data)
        self.data = b""
        for _ in range(scans):
            if len(found) >= count or self.end:
                break
            self.rig.scan()
            self.fetch()
            found += splitter.feed(self.data)
            self.data = b""
        assert len(found) == count and not splitter.pending, (found, self.end)
        assert all(isinstance(one, Adu) for one in found)
        return found  # type: ignore[return-value]

    def exchange(self, pdu: bytes, unit: int = 255) -> bytes:
        """The reply PDU to a request PDU."""
        self.transaction = (self.transaction + 1) & 0xFFFF
        self.say(Adu(self.transaction, unit, pdu).to_bytes())
        [reply] = self.frames(1)
        assert (reply.transaction, reply.unit) == (self.transaction, unit)
        return reply.pdu

    def ask(self, pdu: str) -> str:
        """The same in hexadecimal."""
        return self.exchange(bytes.fromhex(pdu)).hex(" ").upper()


class Model:
    """What the sheet says, by our own Modbus server: its tables are a copy of the words of a rig, coils and inputs are
    the same bits of CIO, and the address at which 10 begins ends at 17FF."""

    def __init__(self, rig: Rig, *, fn0f: bool = False, full_dm: bool = False) -> None:
        codes = (1, 2, 3, 4, 5, 6, 8, 16, *((15,) if fn0f else ()))
        self.full_dm = full_dm
        self.exceptions = 0
        self.server = ModbusServer(
            discrete_inputs=5120, holding_registers=32768, input_registers=5801, functions=codes
        )
        self.cio = rig.words("CIO").tolist()
        self.server.coils[:65536] = b"".join(BITS[word & 0xFF] + BITS[word >> 8] for word in self.cio[:4096])
        self.server.discrete_inputs[:] = self.server.coils[:5120]
        self.server.input_registers[:] = array("H", self.cio[:5801])
        self.server.holding_registers[:] = array("H", rig.words("D").tobytes())

    def answer(self, pdu: bytes) -> bytes:
        """The reply PDU."""
        reply = self._answer(pdu)
        self.exceptions += reply[0] >> 7
        return reply

    def _answer(self, pdu: bytes) -> bytes:
        registers = self.server.holding_registers
        start = int.from_bytes(pdu[1:3], "big")
        before = registers[start : start + 123]
        if pdu[:2] == b"\x08\x00" and len(pdu) >= 3 and pdu[2]:
            return b"\x88\x01"  # our model knows more than sub-function 0
        reply = self.server.answer_pdu(pdu)
        if pdu[0] == 0x10 and reply[0] == 0x10 and start > 0x17FF and not self.full_dm:
            registers[start : start + 123] = before
            return b"\x90\x02"
        if reply[0] in (0x05, 0x0F):
            count = int.from_bytes(pdu[3:5], "big") if reply[0] == 0x0F else 1
            self._bits_written(start // 16, (start + count - 1) // 16)
        return reply

    def _bits_written(self, first: int, last: int) -> None:
        for word in range(first, last + 1):
            bits = self.server.coils[16 * word : 16 * word + 16]
            self.cio[word] = self.server.input_registers[word] = sum(bit << number for number, bit in enumerate(bits))
            if word < 320:
                self.server.discrete_inputs[16 * word : 16 * word + 16] = bits

    def agrees(self, rig: Rig) -> bool:
        """True if the words of the rig are these, but for those of the unit and of the program."""
        cio, d = rig.words("CIO").tolist(), rig.words("D").tolist()
        registers = self.server.holding_registers.tolist()
        return (
            cio[: OWN_CIO.start] == self.cio[: OWN_CIO.start]
            and cio[OWN_CIO.stop : 5801] == self.cio[OWN_CIO.stop : 5801]
            and d[: OWN_DM.start] == registers[: OWN_DM.start]
            and d[OWN_DM.stop :] == registers[OWN_DM.stop :]
        )
