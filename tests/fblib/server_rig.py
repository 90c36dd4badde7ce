"""The three server programs, each on a PLC of its own in virtual time, and callers that may do anything on a connection.

    rig = ServerRig("mbp_mstr", engine="native")
    caller = rig.caller()
    caller.dial()
    caller.ask(READ)
    rig.scan(10)
    assert caller.unanswered == []
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopLink, LoopNetwork
from fbvm.net.loop_channels import Connection
from fbvm.units.contract import Unit
from fbvm.units.etn21.unit import Etn21
from fbvm.units.port.noc import Noc
from fbvm.units.port.tianxing import Tianxing
from fbvm.wire.link import Broken, Close, Connect, Failed, Grant, Opened, Peer, PeerClosed, Received, Send
from fbvm.wire.modbus import Adu, Fault, Splitter

ENGINES = ("python", "native")
ROOM = 65536
READ = bytes.fromhex("03 0000 007D")
"""A request whose reply is as long as any."""
SMALL = bytes.fromhex("03 0000 0001")


@dataclass(frozen=True)
class Kind:
    """A server program, which takes `{clients}`; its unit, its functions, and words that requests reach: what is written
    under an address from 0 on can be seen there."""

    program: str
    unit: Callable[[str, int], Unit]
    address: str
    functions: tuple[int, ...]
    registers: str
    has_idle_time: bool
    """Whether it leaves a client that asks nothing for a minute."""


KINDS = {
    "etn_modbus": Kind(
        "PROGRAM Main VAR Server : ETN_Modbus_Server; END_VAR Server(Sockets := {clients}); END_PROGRAM",
        lambda timing, seed: Etn21(0, "192.168.250.1", timing=timing, seed=seed), "192.168.250.1",
        (1, 2, 3, 4, 5, 6, 8, 16), "D0..D199", True),
    "mbp_mstr": Kind(
        "PROGRAM Main VAR Server : MSTR_Server; END_VAR Server(Sessions := {clients}); END_PROGRAM",
        lambda timing, seed: Noc(7, "192.168.250.1"), "192.168.250.1", (3, 6, 16, 23), "%MW1..%MW200", True),
    "mb_tcp_server": Kind(
        "PROGRAM Main VAR Server : MB_TCP_SERVER; Config : TCP_CONNECTCONFIG; Coils : ARRAY[0..99] OF BOOL;"
        " Inputs : ARRAY[0..9] OF BYTE; Holding, Registers : ARRAY[0..199] OF WORD; END_VAR"
        " Server(DISCONNECT := FALSE, CONNECT := Config, COIL_DATAAREA := Coils, DISCRETE_DATAAREA := Inputs,"
        " HOLDING_REG_DATAAREA := Holding, INPUT_REG_DATAAREA := Registers); END_PROGRAM",
        lambda timing, seed: Tianxing("192.168.250.1"), "192.168.250.1", (1, 2, 3, 4, 5, 6, 15, 16), "Main.Holding", False),
}  # fmt: skip


@cache
def image_of(text: str) -> Image:
    """The image of a program that has no errors."""
    made = compile_text(text)
    assert made.image is not None, [message.message for message in made.diagnostics]
    return made.image


class ServerRig:
    """A PLC with the server of this kind at 192.168.250.1 port 502 of a network in memory."""

    def __init__(
        self, kind: str, *, engine: str = "auto", clients: int = 1, timing: str = "exact", seed: int = 0,
        latency_ns: int = 0, cycle_ns: int = 10_000_000,
    ) -> None:  # fmt: skip
        self.kind = KINDS[kind]
        self.network = LoopNetwork(seed, latency_ns=latency_ns)
        self.plc = Plc(image_of(self.kind.program.format(clients=clients)), cycle_ns, engine=engine)
        self.plc.attach(self.kind.unit(timing, seed), self.network)
        self.callers: list[Caller] = []
        self.transaction = 0

    def scan(self, count: int = 1) -> None:
        """So many scans, in which all callers take what has come for them."""
        for _ in range(count):
            trap = self.plc.scan()
            assert trap is None, trap
            for caller in self.callers:
                caller.fetch()

    def caller(self) -> Caller:
        """Somebody else, not connected."""
        link = self.network.attach(f"192.168.251.{len(self.callers) + 1}")
        self.callers.append(Caller(self, link))
        return self.callers[-1]

    def next_transaction(self) -> int:
        """A number that no request has had."""
        self.transaction += 1
        return self.transaction

    def registers(self) -> object:
        """What the words show that a client may write."""
        return self.plc.read(self.kind.registers)


class Caller:
    """A client that may say any bytes, read nothing, and leave in any way."""

    def __init__(self, rig: ServerRig, link: LoopLink) -> None:
        self.rig, self.link = rig, link
        self.reads = True
        self.asked: list[Adu] = []
        """The requests of this connection, in order."""
        self.heard = b""
        """The bytes of this connection, in order."""
        self.is_open = False
        self.end = ""
        """"FIN" or an errno name once the connection has ended or failed."""
        self._at_once: tuple[bytes, ...] = ()

    def call(self, *at_once: bytes, reads: bool = True) -> None:
        """Asks for a connection; says the requests `at_once` as soon as it is open, before the server's next scan."""
        self.hang_up(reset=True)
        self.link.events(self.rig.plc.elapsed_ns)
        self.reads, self.asked, self.heard, self.is_open, self.end = reads, [], b"", False, ""
        self._at_once = at_once
        self._submit(Connect(1, Peer(self.rig.kind.address, 502)))

    def dial(self, *at_once: bytes, reads: bool = True, tries: int = 400) -> Caller:
        """Calls until it is let in."""
        for _ in range(tries):
            self.call(*at_once, reads=reads)
            for _ in range(12):
                if self.is_open or self.end:
                    break
                self.rig.scan()
            if self.is_open:
                return self
        raise AssertionError("nobody is let in")

    def ask(self, *pdus: bytes, unit: int = 1) -> None:
        """Sends requests, all of them together, if there is a connection."""
        if not self.is_open:
            return
        frames = [Adu(self.rig.next_transaction(), unit, pdu) for pdu in pdus]
        self.asked += frames
        self.say(b"".join(frame.to_bytes() for frame in frames))

    def say(self, data: bytes) -> None:
        """Sends any bytes, if there is a connection."""
        if self.is_open:
            self._submit(Send(1, data))

    def read_on(self) -> None:
        """Takes what comes from now on."""
        self.reads = True
        self._submit(Grant(1, ROOM))

    def finish(self) -> None:
        """Sends FIN and goes on receiving, which a unit never does."""
        end = self.link.channels[1]
        assert isinstance(end, Connection) and end._end
        end._end.finish(self.rig.plc.elapsed_ns)

    def hang_up(self, reset: bool = False) -> None:
        """Closes the connection, by RST or by FIN."""
        self.is_open = False
        self._submit(Close(1, reset))

    def fetch(self) -> None:
        """Takes what has come."""
        for event in self.link.events(self.rig.plc.elapsed_ns):
            match event:
                case Opened():
                    self.is_open = True
                    if self.reads:
                        self._submit(Grant(1, ROOM))
                    self.ask(*self._at_once)
                case Received(data=data):
                    self.heard += data
                    if self.reads:
                        self._submit(Grant(1, ROOM))
                case PeerClosed():
                    self.end = self.end or "FIN"
                case Broken(error=error) | Failed(error=error):
                    self.end = self.end or error

    def replies(self) -> list[Adu | Fault]:
        """The frames that have come."""
        return Splitter().feed(self.heard)

    @property
    def unanswered(self) -> list[Adu]:
        """The requests of this connection without a reply.  Fails if a reply belongs to no request of this connection, comes
        out of order, or is followed by bytes that begin no reply."""
        splitter = Splitter()
        replies = splitter.feed(self.heard)
        for request, reply in zip(self.asked, replies, strict=False):
            assert isinstance(reply, Adu), reply
            assert (reply.transaction, reply.unit) == (request.transaction, request.unit), "a reply to somebody else"
            assert reply.pdu[0] | 0x80 == request.pdu[0] | 0x80, "a reply to something else"
        assert len(replies) <= len(self.asked), replies[len(self.asked) :]
        if rest := splitter.pending:
            assert len(replies) < len(self.asked), rest
            next_transaction = self.asked[len(replies)].transaction.to_bytes(2, "big")
            assert rest[:2] == next_transaction[: len(rest)], "the beginning of a reply to somebody else"
        return self.asked[len(replies) :]

    def wait_for_replies(self, scans: int = 400) -> None:
        """Scans until all requests are answered.  Fails if that does not happen, or the connection ends."""
        for _ in range(scans):
            if not self.unanswered or self.end:
                break
            self.rig.scan()
        assert (self.unanswered, self.end) == ([], "")

    def _submit(self, *requests: Connect | Grant | Send | Close) -> None:
        self.link.submit(requests, self.rig.plc.elapsed_ns)
