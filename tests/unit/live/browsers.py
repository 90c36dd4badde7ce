"""A browser for tests of the live page, without sockets: bytes of requests and frames, and a page's session with its PLC."""

from __future__ import annotations

import json
from typing import Any

from fbvm import LoopNetwork, ModbusPeer, Peer, Plc, Recording, compile_text
from fbvm.live.connection import Connection
from fbvm.live.guard import Guard
from fbvm.live.plcs import LivePlc
from fbvm.live.session import Session
from fbvm.live.stops import forget_statement
from fbvm.live.updates import UPDATE_NS
from fbvm.live.workbench import Workbench
from fbvm.machine.backplane import usual_units
from fbvm.run.interactive import Control

PORT, TOKEN = 8123, "a-secret-token"
HOST = f"127.0.0.1:{PORT}"
PUMP = """
PROGRAM Main
VAR
    Level : INT := 20;      (* <script>alert(1)</script> *)
    Pump : BOOL;
    High AT D10 : INT := 90;
    Said : STRING[40] := '<img src=x onerror=alert(1)>';
    Curve : ARRAY[1..3] OF INT;
END_VAR
IF Level >= High THEN Pump := TRUE; ELSIF Level <= 10 THEN Pump := FALSE; END_IF
IF Pump THEN Level := Level - 2; ELSE Level := Level + 1; END_IF
Curve[1] := Level;
END_PROGRAM
"""


def request(path: str = f"/live?token={TOKEN}", host: str | None = HOST, origin: str | None = f"http://{HOST}",
            method: str = "GET", upgrade: bool = True) -> bytes:  # fmt: skip
    """The bytes of an HTTP request, as a browser opens a WebSocket; without `upgrade` as it fetches a file."""
    lines = [f"{method} {path} HTTP/1.1", *([f"Host: {host}"] if host is not None else []),
             *([f"Origin: {origin}"] if origin is not None else [])]  # fmt: skip
    if upgrade:
        lines += ["Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13",
                  "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ=="]  # fmt: skip
    return ("\r\n".join(lines) + "\r\n\r\n").encode()


def frame(data: bytes, opcode: int = 1, fin: bool = True, masked: bool = True) -> bytes:
    """A WebSocket frame of a client (RFC 6455 5.2), masked with zeros."""
    size = len(data)
    width = 0 if size < 126 else 2 if size < 1 << 16 else 8
    length = bytes([size]) if not width else bytes([126 if width == 2 else 127]) + size.to_bytes(width, "big")
    head = bytes([opcode | 0x80 * fin, length[0] | 0x80 * masked]) + length[1:]
    return head + (bytes(4) if masked else b"") + data


def said(connection: Connection) -> bytes:
    """What a connection wants to send; it is sent."""
    out = bytes(connection.output)
    connection.sent(len(out))
    return out


def connected() -> Connection:
    """A connection whose WebSocket is open."""
    made = Connection(Guard(PORT, token=TOKEN))
    made.receive(request())
    assert said(made).startswith(b"HTTP/1.1 101 ")
    return made


def answered(data: bytes, bind: str = "127.0.0.1") -> tuple[int, bytes]:
    """Status and whole answer to a request."""
    made = Connection(Guard(PORT, bind, TOKEN))
    made.receive(data)
    out = said(made)
    return (int(out.split(b" ", 2)[1]) if out else 0), out


class Page:
    """A page's session at a PLC with an ETN21 and a Modbus server in memory, in virtual time; or as if connections were real."""

    def __init__(self, text: str = PUMP, real: bool = False, cycle_ns: int = 10_000_000, **settings: Any) -> None:
        image = compile_text(text).image
        assert image is not None
        self.plc = Plc(image, cycle_ns)
        self.network = LoopNetwork()
        self.network.place(Peer("192.168.250.1", 502), ModbusPeer())
        for unit in usual_units([]):
            self.plc.attach(unit, self.network)
        self.network.virtual_time = not real
        self.recording = Recording()
        file = image.sites[0].file
        self.live = LivePlc("pump", self.plc, self.recording.add("pump", self.plc), {file: text})
        self.control = Control()
        self.bench = Workbench([self.live], self.control, **settings)
        self.session = Session(self.bench)
        self.now_ns = 0

    def ask(self, do: str, **fields: Any) -> dict[str, Any]:
        """The whole reply."""
        text = self.session.answer(json.dumps({"id": 1, "do": do, **fields})) or self.session.update(self.now_ns)
        assert text is not None
        reply: dict[str, Any] = json.loads(text)
        return reply

    def done(self, do: str, **fields: Any) -> dict[str, Any]:
        """What a good reply brings."""
        reply = self.ask(do, **fields)
        assert "error" not in reply, reply
        found: dict[str, Any] = reply["ok"]
        return found

    def scan(self, scans: int = 1) -> None:
        """Scans as the loop of a run does."""
        for _ in range(scans):
            self.live.before_scan()
            self.plc.scan(self.plc.now_ns + self.plc.cycle_ns if self.live.is_real else None)
            self.live.after_scan()

    def run(self, turns: int) -> None:
        """As many scans as the loop of a run would do, up to a breakpoint, at which it pauses."""
        for _ in range(turns):
            if self.control.is_paused:
                return
            self.scan()
            if self.plc.halted:
                forget_statement(self.live)
                self.control.pause()

    def update(self) -> dict[str, Any]:
        """The next update, 100 ms later; {} if there is none."""
        self.now_ns += UPDATE_NS
        text = self.session.update(self.now_ns)
        self.ask("ready")
        found: dict[str, Any] = json.loads(text)["update"] if text else {}
        return found
