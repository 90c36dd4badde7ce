"""A client of a server PLC on a network in memory: says any bytes, and Modbus requests among them."""

from __future__ import annotations

from collections.abc import Callable

from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopLink
from fbvm.wire.link import Broken, Close, Connect, Event, Failed, Grant, Opened, Peer, PeerClosed, Received, Send
from fbvm.wire.modbus import Adu, Splitter


class Client:
    """Somebody who connects to a server and says bytes; `scan` lets its PLC do one."""

    def __init__(self, scan: Callable[[], None], plc: Plc, link: LoopLink, server: Peer) -> None:
        self.scan, self.plc, self.link, self.server = scan, plc, link, server
        self.data = b""
        self.end = ""
        self.transaction = 0
        self.is_open = False

    def connect(self) -> Client:
        for _ in range(20):
            self.end, self.data, self.is_open = "", b"", False
            self.submit(Close(1))
            self.step()
            self.end = ""
            self.submit(Connect(1, self.server), Grant(1, 65536))
            self.step(3)
            if self.is_open and not self.end:
                return self
        raise AssertionError("nobody opens")

    def submit(self, *requests: Connect | Grant | Send | Close) -> None:
        self.link.submit(requests, self.plc.elapsed_ns)

    def step(self, count: int = 1) -> None:
        for _ in range(count):
            self.scan()
            for event in self.link.events(self.plc.elapsed_ns):
                self._take(event)

    def _take(self, event: Event) -> None:
        match event:
            case Opened():
                self.is_open = True
            case Received(data=data):
                self.data += data
                self.submit(Grant(1, 65536))
            case PeerClosed():
                self.end = self.end or "FIN"
            case Broken(error=error) | Failed(error=error):
                self.end = error

    def exchange(self, pdu: bytes, unit: int = 0) -> bytes:
        self.transaction += 1
        self.submit(Send(1, Adu(self.transaction, unit, pdu).to_bytes()))
        splitter = Splitter()
        for _ in range(40):
            self.step()
            found = splitter.feed(self.data)
            self.data = b""
            if found:
                [reply] = found
                assert isinstance(reply, Adu) and (reply.transaction, reply.unit) == (self.transaction, unit)
                return reply.pdu
        raise AssertionError("no reply")

    def ask(self, pdu: str, unit: int = 0) -> str:
        return self.exchange(bytes.fromhex(pdu), unit).hex(" ").upper()
