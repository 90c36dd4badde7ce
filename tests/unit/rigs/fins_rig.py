"""A PLC whose ETN21 serves FINS on a network in memory, and clients that say bytes to it."""

from __future__ import annotations

from fbvm import Plc, compile_text
from fbvm.net.loop import LoopNetwork
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.fins.frames import Address, Command, Header, Response, parse_frame
from fbvm.wire.fins.tcp import Kind, Message, Splitter, client_node
from fbvm.wire.link import Bind, Broken, Close, Connect, Event, Grant, Opened, Peer, PeerClosed, Received, Send, SendTo

UNIT = "192.168.250.1"
CLIENT = "192.168.250.25"
COUNTING = """
PROGRAM Main
VAR n : UINT; Seen AT D500 : WORD; Given AT D100 : WORD; Out AT %CIO100 : WORD; Bank AT E0_5 : WORD; END_VAR
n := n + 1;
Seen := Given;
END_PROGRAM
"""


def compiled(source: str = COUNTING) -> Plc:
    """A PLC with a program.  Fails if that has errors."""
    compilation = compile_text(source)
    assert compilation.image, [str(found) for found in compilation.diagnostics]
    return Plc(compilation.image)


class FinsRig:
    """`plc` with the ETN21 `unit`, and a client by UDP from node 25; answers come after one scan."""

    def __init__(self, source: str = COUNTING, plc: Plc | None = None, **fins: object) -> None:
        self.network = LoopNetwork()
        self.plc = plc or compiled(source)
        self.unit = Etn21(0, UNIT, fins=True, **fins)  # type: ignore[arg-type]
        self.plc.attach(self.unit, self.network)
        self.client = self.network.attach(CLIENT)
        self.client.submit([Bind(1, 5000)], 0)
        self.plc.run(scans=2)

    def datagrams(self) -> list[bytes]:
        """What has come for the client since the last call."""
        return [event.data for event in self.client.events(self.plc.now_ns) if isinstance(event, Received)]

    def say(self, data: bytes, port: int = 9600) -> None:
        """The client sends a datagram."""
        self.client.submit([SendTo(1, Peer(UNIT, port), data)], self.plc.now_ns)

    def ask_bytes(self, data: bytes) -> bytes:
        """What one datagram is answered after one scan; b"" for silence."""
        self.say(data)
        self.plc.scan()
        answers = self.datagrams()
        assert len(answers) <= 1
        return answers[0] if answers else b""

    def ask(self, text: str) -> str:
        """The same in hexadecimal."""
        return self.ask_bytes(bytes.fromhex(text)).hex(" ").upper()

    def command(self, code: int, parameters: str = "", **header: int) -> tuple[str, str]:
        """End code and data of a command for the CPU unit, in hexadecimal; `header` changes node, unit, network, source, icf."""
        to = Address(header.get("network", 0), header.get("node", 1), header.get("unit", 0))
        by = Address(0, header.get("source", 25), 0)
        made = Header(to, by, 7, header.get("icf", 0x80))
        answer = parse_frame(self.ask_bytes(Command(made, code, bytes.fromhex(parameters)).to_bytes()))
        if not isinstance(answer, Response):
            return "", ""
        assert answer.header == Header(by, to, 7, 0xC0)
        assert answer.code == code
        return f"{answer.end_code:04X}", answer.data.hex(" ").upper()


class TcpClient:
    """A client by FINS/TCP on a rig's network, from an address of its own."""

    def __init__(self, rig: FinsRig, number: int = 100) -> None:
        self.rig = rig
        self.link = rig.network.attach(f"192.168.250.{number}")
        self.link.submit([Connect(1, Peer(UNIT, 9600)), Grant(1, 65_536)], rig.plc.now_ns)
        self.received = b""
        self.ended: list[Event] = []
        self.is_open = False
        self._splitter = Splitter()
        self.messages: list[Message] = []

    def say(self, data: bytes) -> None:
        self.link.submit([Send(1, data)], self.rig.plc.now_ns)

    def hear(self) -> bytes:
        """What has come since the last call; notes how the connection ended."""
        came = b""
        for event in self.link.events(self.rig.plc.now_ns):
            if isinstance(event, Received):
                came += event.data
            elif isinstance(event, PeerClosed | Broken):
                self.ended.append(event)
            elif isinstance(event, Opened):
                self.is_open = True
        self.received += came
        return came

    def ask(self, text: str) -> str:
        """What bytes are answered within three scans, in hexadecimal."""
        self.hear()
        self.say(bytes.fromhex(text))
        answer = b""
        for _ in range(3):
            self.rig.plc.scan()
            answer += self.hear()
        return answer.hex(" ").upper()

    def connect(self, node: int = 0) -> str:
        """Agrees on a node; the answer in hexadecimal."""
        self.rig.plc.run(scans=2)
        return self.ask(client_node(node).to_bytes().hex())

    def frame(self, text: str) -> str:
        """The FINS frame that answers one, without the head of FINS/TCP."""
        answer = bytes.fromhex(self.ask(Message(Kind.FRAME, bytes.fromhex(text)).to_bytes().hex()))
        return answer[16:].hex(" ").upper()

    def leave(self) -> None:
        self.link.submit([Close(1)], self.rig.plc.now_ns)
