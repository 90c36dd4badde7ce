"""The FINS service alone: what the network tells in, what it asks of the network out, beside `fins_service.txt`.

A line of the file is a servicing at a time, or a restart: what came, an arrow, the requests, and what is known behind it.
`FBVM_REWRITE=1 pytest` of this file writes it anew: read the difference before you keep it."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, cast

from fbvm.base.areas import NEVER
from fbvm.units.contract import CpuUnit
from fbvm.units.etn21.fins.service import FinsService
from fbvm.units.etn21.fins.state import TCP_CHANNELS, UDP_CHANNEL, FinsSettings, FinsState
from fbvm.wire.fins import tcp
from fbvm.wire.fins.frames import Address, Command, Header
from fbvm.wire.link import (
    Broken,
    Close,
    Closed,
    Connect,
    Event,
    Failed,
    Listen,
    Opened,
    Peer,
    PeerClosed,
    Received,
    Request,
    Send,
    SendTo,
)

OWN, SERVER, CLIENT = "192.168.250.5", Peer("192.168.250.7", 9600), Peer("192.168.250.9", 5000)
FIRST, SECOND, DIALLED = TCP_CHANNELS[0], TCP_CHANNELS[1], 133
MS = 1_000_000


def short(what: Event | Request) -> str:
    """An event or a request in a few words."""
    name = type(what).__name__
    said = [str(what.channel)]
    if isinstance(what, Send | Received) and what.data[:4] == tcp.MAGIC and len(what.data) > 15:
        message = tcp.Splitter().feed(what.data)[0]
        assert isinstance(message, tcp.Message)
        kind = tcp.Kind(message.kind).name if message.kind in list(tcp.Kind) else str(message.kind)
        said += [f"{kind} {message.body.hex()}".strip(), *([f"error {message.error:02X}"] if message.error else [])]
    elif isinstance(what, Send | SendTo | Received):
        said.append(what.data.hex())
    if isinstance(what, Connect | SendTo):
        said.append(str(what.remote))
    said += [str(getattr(what, field)) for field in ("service", "error") if hasattr(what, field)]
    if isinstance(what, Close) and what.reset:
        said.append("reset")
    return f"{name}({', '.join(said)})"


class Script:
    """A service, and the lines of what it did."""

    def __init__(self, name: str, **settings: Any) -> None:
        self.lines = [f"# {name}"]
        self._given = FinsSettings(OWN, **settings)
        self.service = FinsService(self._given)
        self.now_ms = 0

    def __call__(self, *events: Event, at_ms: int | None = None) -> None:
        """A servicing behind some events, 10 ms later than the one before."""
        self.now_ms = self.now_ms + 10 if at_ms is None else at_ms
        others = self.service.take(events)
        requests = self.service.serve(cast(CpuUnit, None), self.now_ms * MS)
        self._told(f"{self.now_ms}: ", events, requests)
        assert [short(each) for each in others] == [short(each) for each in events if each.channel < 100]
        self.service = FinsService(self._given, FinsState.of(self.service.state.plain))  # as a recording keeps it

    def restart(self, *events: Event) -> None:
        """A restart behind some events that are not served yet."""
        self.service.take(events)
        self._told("restart: ", events, self.service.reset())

    def _told(self, head: str, events: tuple[Event, ...], requests: list[Request]) -> None:
        state, wake_ns = self.service.state, self.service.wake_ns
        parts = [", ".join(short(each) for each in events) or "nothing", "→", ", ".join(_few(requests)) or "nothing"]
        known = {"busy": _span(state.busy), "closing": _span(state.closing), "failed": _span(state.failed),
                 "open": " ".join(f"{channel}:{found.number}:{found.node}{'+' * bool(found.held)}"
                                  for channel, found in state.connections.items()),
                 "udp": state.udp_open or "", "waits": len(state.outgoing) or "", "heard": state.received or "",
                 "said": state.sent or "", "wakes": "" if wake_ns == NEVER else wake_ns // MS}  # fmt: skip
        self.lines.append(head + " ".join(parts) + "".join(f"; {name} {said}" for name, said in known.items() if said != ""))


def _few(requests: list[Request]) -> Iterator[str]:
    """Requests; listens are told as one."""
    listens = [each.channel for each in requests if isinstance(each, Listen)]
    for each in requests:
        if not isinstance(each, Listen):
            yield short(each)
        elif each.channel == listens[0]:
            yield f"Listen({_span(listens)})"


def _span(channels: Iterable[int]) -> str:
    """Numbers, those that follow one another as `101..120`."""
    runs: list[list[int]] = []
    for channel in sorted(channels):
        if runs and runs[-1][-1] == channel - 1:
            runs[-1].append(channel)
        else:
            runs.append([channel])
    return " ".join(f"{run[0]}..{run[-1]}" if len(run) > 1 else str(run[0]) for run in runs)


def message(kind: int, body: bytes = b"", error: int = 0) -> bytes:
    return tcp.Message(kind, body, error).to_bytes()


def hello(node: int) -> bytes:
    return tcp.client_node(node).to_bytes()


def servers() -> Iterator[Script]:
    on = Script("a server: the port cannot be opened, clients come, say hello, go")
    on(at_ms=0)
    on(Opened(UDP_CHANNEL, 9600, CLIENT), Failed(SECOND, "open", "EADDRINUSE"))
    on(Opened(FIRST, 9600, CLIENT), Opened(5, 9600, CLIENT))
    on(Received(FIRST, hello(9)[:7]))
    on(Received(FIRST, hello(9)[7:]))
    on(Received(FIRST, hello(9)))
    on(Closed(FIRST))
    on(Opened(FIRST, 9600, CLIENT))
    on(Received(FIRST, message(tcp.Kind.CONFIRMATION)))
    on(Closed(FIRST), Opened(103, 9600, CLIENT))
    on(at_ms=10_099)
    on(at_ms=10_100)
    on(Closed(103))
    yield on

    on = Script("nodes that clients ask for")
    on(at_ms=0)
    on(*(Opened(channel, 9600, CLIENT) for channel in range(101, 109)))
    on(Received(101, hello(0)))
    on(Received(102, hello(255)), Received(103, hello(5)), Received(104, hello(239)))
    on(Received(105, message(tcp.Kind.CLIENT_NODE, b"\0\0")), Received(106, message(tcp.Kind.ERROR)))
    on(Received(107, b"GET /"), Received(108, message(7)))
    on(Received(101, message(tcp.Kind.FRAME, b"123")), *(Closed(channel) for channel in (102, 103)))
    on(PeerClosed(104), Broken(109, "ECONNRESET"), Failed(101, "send", "EPIPE"))
    on.restart(Closed(101), Opened(110, 9600, CLIENT), Failed(111, "open", "EADDRINUSE"), Failed(112, "send", "EPIPE"))
    on(at_ms=200)
    yield on

    on = Script("permitted addresses, and a service for which no port is left", permitted=("192.168.250.8",))
    on(at_ms=0)
    on(Opened(FIRST, 9600, CLIENT), Opened(SECOND, 9600, Peer("192.168.250.8", 5000)))
    on(Received(FIRST, hello(9)), Received(SECOND, hello(8)))
    on(*(Failed(channel, "open", "EADDRINUSE") for channel in (UDP_CHANNEL, *TCP_CHANNELS[2:])))
    on(Closed(FIRST))
    yield on

    on = Script("more clients than connections")
    on(at_ms=0)
    on(*(Opened(channel, 9600, CLIENT) for channel in TCP_CHANNELS[:17]))
    on(Received(TCP_CHANNELS[16], hello(0)), Received(TCP_CHANNELS[15], hello(0)))
    yield on


def clients() -> Iterator[Script]:
    on = Script("a client of connection 3: its server is away, comes, says a node, goes", clients={3: SERVER})
    on(at_ms=0)
    on(Failed(DIALLED, "open", "ECONNREFUSED"))
    on(at_ms=3_009)
    on(at_ms=3_010)
    on(Opened(DIALLED, 4000, SERVER))
    on(Received(DIALLED, message(tcp.Kind.CONFIRMATION)))
    on(Received(DIALLED, tcp.server_node(5, 7).to_bytes()))
    on(Received(DIALLED, tcp.server_node(5, 8).to_bytes()))
    on(Closed(DIALLED), at_ms=4_000)
    on(at_ms=6_999)
    on(at_ms=7_000)
    on(Opened(DIALLED, 4001, SERVER))
    for answer in (tcp.server_node(5, 0), tcp.server_node(5, 255), tcp.server_node(5, 5), tcp.server_node(5, 7, 0x20)):
        on(Received(DIALLED, answer.to_bytes()))
        on(Closed(DIALLED))
        on(at_ms=on.now_ms + 3_000)
        on(Opened(DIALLED, 4002, SERVER))
    on(at_ms=on.now_ms + 10_000)
    on(Closed(DIALLED))
    yield on

    on = Script("another server is given to connection 3", clients={3: SERVER})
    on(at_ms=0)
    on(Opened(DIALLED, 4000, SERVER))
    on.service.state.changed_servers[3] = Peer("192.168.250.8", 9600)
    on()
    on(Closed(DIALLED))
    on.service.state.changed_servers[3] = SERVER
    on()
    on(Failed(DIALLED, "open", "ECONNREFUSED"), Closed(DIALLED))
    on(PeerClosed(DIALLED))
    on(Closed(DIALLED))
    on.restart()
    on(Closed(DIALLED), at_ms=400)
    yield on


def senders() -> Iterator[Script]:
    header = Header(source=Address(0, 5, 0), destination=Address(0, 9, 0))
    on = Script("what network instructions send: by a connection, by UDP once it is open, to a node with an endpoint",
                nodes={4: Peer("10.0.0.4", 9601)})  # fmt: skip
    command = Command(header, 0x0501, b"")
    on(at_ms=0)
    on.lines.append(f"send: {on.service.send(command):04X}")
    on()
    on(Opened(UDP_CHANNEL, 9600, CLIENT), Opened(FIRST, 9600, CLIENT))
    on(Received(FIRST, hello(9)))
    on.lines.append(f"send: {on.service.send(command):04X}")
    on()
    named = Command(Header(source=header.source, destination=Address(0, 4, 0)), 0x0501, b"")
    on.lines.append(f"send to node 4: {on.service.send(named):04X}")
    on(Broken(FIRST, "ECONNRESET"))
    on.lines.append(f"send: {on.service.send(command):04X}")
    on(Closed(FIRST))
    yield on

    on = Script("nothing is sent where the port cannot be opened")
    on(at_ms=0)
    on.lines.append(f"send: {on.service.send(command):04X}")
    on(Failed(UDP_CHANNEL, "open", "EADDRINUSE"))
    on.lines.append(f"send: {on.service.send(command):04X}")
    on()
    yield on


def test_the_service_goes_as_it_is_kept() -> None:
    file = Path(__file__).with_name("fins_service.txt")
    came = "".join(f"{line}\n" for make in (servers, clients, senders) for script in make() for line in script.lines)
    if os.environ.get("FBVM_REWRITE"):
        file.write_text(came, encoding="utf-8")
    assert came == file.read_text(encoding="utf-8")
