"""A PLC with an ETN21 and the server program, and clients at the other end that say any bytes, all in virtual time.

    rig = Rig("Sockets := 2")
    client = rig.client()
    assert client.ask("03 03 E8 00 03") == "03 06 AB 12 56 78 97 13"
"""

from __future__ import annotations

from functools import cache

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.net.loop import LoopLink, LoopNetwork
from fbvm.plc import Plc
from fbvm.units.etn21 import Etn21
from fbvm.wire.link import Broken, Close, Connect, Event, Failed, Grant, Opened, Peer, PeerClosed, Received, Send
from fbvm.wire.modbus import Adu, Splitter

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


class Rig:
    """One PLC whose program calls the server with these pins, at 192.168.250.1 port 502 of a network in memory."""

    def __init__(self, pins: str = "", *, timing: str = "exact", seed: int = 0, network: LoopNetwork | None = None) -> None:
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

    def connect(self, scans: int = 400) -> bool:
        """Try until it is let in; False if nobody has done so."""
        for _ in range(scans):
            if self.dial():
                return True
        return False

    def dial(self) -> bool:
        """One try."""
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
