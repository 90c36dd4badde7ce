"""One contract, two networks: the same requests are told the same events in memory and over the host."""

from __future__ import annotations

import time
from dataclasses import replace

import pytest
from rows import each_of

from fbvm.net.loop import LoopNetwork
from fbvm.net.tcp import TcpNetwork
from fbvm.wire.link import (
    Bind,
    Broken,
    Close,
    Connect,
    Event,
    Failed,
    Grant,
    Listen,
    Opened,
    Peer,
    Received,
    Request,
    Send,
    SendTo,
)

BOUND_S = 10.0
HOSTS = {"a": "10.0.0.1", "b": "10.0.0.2"}
A, B = Peer("10.0.0.1", 502), Peer("10.0.0.2", 502)

Step = tuple[str, list[Request]]
OPEN: list[Step] = [("b", [Listen(5, 502), Grant(5, 100)]), ("a", [Connect(1, B), Grant(1, 100)])]

SCENARIOS: dict[str, list[Step]] = {
    "nobody listens": [("a", [Connect(1, B)]), ("a", [Connect(1, B)])],
    "refused endpoints": [
        ("a", [Connect(1, Peer("255.255.255.255", 1)), Connect(2, Peer("0.0.0.0", 1)), Connect(3, Peer("10.0.0.2", 0))])
    ],
    "open and close": [*OPEN, ("a", [Close(1)]), ("b", [Close(5)])],
    "open again": [*OPEN, ("a", [Close(1)]), ("b", [Close(5)]), *OPEN, ("b", [Close(5)])],
    "both ways": [*OPEN, ("a", [Send(1, b"ping")]), ("b", [Send(5, b"pong"), Send(5, b"!")]), ("a", [Send(1, b"")])],
    "both close at once": [*OPEN, ("ab", [Close(1), Close(5)])],
    "reset": [*OPEN, ("a", [Close(1, reset=True)]), ("b", [Send(5, b"x")]), ("b", [Close(5)])],
    "data, then reset": [*OPEN, ("a", [Send(1, b"last")]), ("a", [Close(1, reset=True)])],
    "to who has left": [*OPEN, ("a", [Close(1)]), ("b", [Send(5, b"x")]), ("b", [Send(5, b"y")]), ("b", [Close(5)])],
    "little room": [
        *OPEN,
        ("b", [Grant(5, 3)]),
        ("a", [Send(1, b"abcdefgh"), Close(1)]),
        ("b", [Grant(5, 3)]),
        ("b", [Grant(5, 3)]),
    ],
    "no room, then fin": [*OPEN, ("b", [Grant(5, 0)]), ("a", [Close(1)])],
    "no room, then reset": [
        *OPEN, ("b", [Grant(5, 0)]), ("a", [Send(1, b"data")]), ("a", [Close(1, reset=True)])
    ],
    "unfetched at the close": [*OPEN, ("b", [Grant(5, 0)]), ("a", [Send(1, b"data")]), ("b", [Close(5)])],
    "a door for a": [("b", [Listen(5, 502, Peer("10.0.0.1", 0))]), ("a", [Connect(1, B)])],
    "one door, two wishes": [("b", [Listen(5, 502)]), ("a", [Connect(1, B)]), ("a", [Connect(2, B)])],
    "one port, three doors": [
        ("b", [Listen(6, 502), Listen(4, 502), Listen(5, 502)]),
        *[("a", [Connect(number, B)]) for number in (1, 2, 3, 4)],
        ("b", [Send(4, b"four"), Close(5), Send(6, b"six")]),
        ("a", [Grant(1, 9), Grant(3, 9)]),
    ],
    "one port, a door for each": [
        ("b", [Listen(4, 502, Peer("10.0.0.9", 0)), Listen(5, 502, A), Listen(6, 502, Peer("10.0.0.1", 0))]),
        ("a", [Connect(1, B)]),
        ("a", [Connect(2, B, local_port=502)]),
    ],
    "one port, doors that close": [
        ("b", [Listen(4, 502), Listen(5, 502), Listen(6, 502)]),
        ("b", [Close(4), Listen(4, 502, Peer("10.0.0.9", 0)), Close(5)]),
        ("a", [Connect(1, B)]),
        ("b", [Close(4)]),
        ("a", [Connect(2, B)]),
        ("b", [Listen(4, 502)]),
        ("a", [Connect(2, B)]),
    ],
    "a port that is bound": [("b", [Bind(5, 502), Bind(6, 502)]), ("b", [Close(5), Close(6)])],
    "fixed ports": [("b", [Listen(5, 502, A)]), ("a", [Connect(1, B, local_port=502)]), ("a", [Send(1, b"x")])],
    "a withdrawn door": [("b", [Listen(5, 502)]), ("b", [Close(5)]), ("a", [Connect(1, B)])],
    "not open": [("a", [Send(1, b"x"), SendTo(1, B, b"x"), Grant(1, 1), Close(1)])],
    "of the other kind": [
        *OPEN, ("a", [SendTo(1, B, b"x"), Bind(2, 7), Send(2, b"x"), Listen(3, 7), Send(3, b"x")])
    ],
    "datagrams": [
        ("a", [Bind(1, 9600), Bind(2, 9600)]),
        ("b", [Bind(1, 9601)]),
        ("a", [SendTo(1, Peer("10.0.0.2", 9601), b"one"), SendTo(1, Peer("10.0.0.2", 9601), b"")]),
        ("a", [SendTo(1, Peer("10.0.0.2", 7), b"lost"), SendTo(1, Peer("0.0.0.0", 7), b"")]),
        ("b", [SendTo(1, Peer("10.0.0.1", 9600), bytes(5000)), SendTo(1, A, bytes(65_508)), Close(1)]),
    ],
}  # fmt: skip


def plain(events: list[Event]) -> list[Event]:
    """Without ports that a network chose, and with the pieces of a stream put together."""
    found: list[Event] = []
    for event in events:
        if isinstance(event, Opened):
            event = replace(
                event, local_port=min(event.local_port, 10_000),
                remote=Peer(event.remote.host, min(event.remote.port, 10_000)),
            )  # fmt: skip
        last = found[-1] if found else None
        if isinstance(event, Received) and isinstance(last, Received) and event.remote.port == 0:
            found[-1] = replace(last, data=last.data + event.data)
        else:
            found.append(event)
    return found


class Play:
    """Two units on a network."""

    def __init__(self, network: LoopNetwork | TcpNetwork) -> None:
        self.links = {name: network.attach(host) for name, host in HOSTS.items()}
        self.pending: dict[str, list[Event]] = {"a": [], "b": []}

    def submit(self, step: Step, now_ns: int) -> None:
        names, requests = step
        for name, part in zip(names, [requests] if len(names) == 1 else [[each] for each in requests], strict=True):
            self.links[name].submit(part, now_ns)

    def fetch(self, now_ns: int) -> dict[str, list[Event]]:
        for name, link in self.links.items():
            self.pending[name] += link.events(now_ns)
        return {name: plain(told) for name, told in self.pending.items()}


@pytest.mark.slow
@each_of("name", SCENARIOS)
def test_the_same_is_told(name: str) -> None:
    memory = Play(LoopNetwork())
    network = TcpNetwork({Peer(host, 0): ("127.0.0.1", 0) for host in HOSTS.values()})
    host = Play(network)
    for now_ns, step in enumerate(SCENARIOS[name]):
        memory.submit(step, now_ns)
        for _ in range(3):
            expected = memory.fetch(now_ns)
        host.submit(step, time.monotonic_ns())
        end_s = time.monotonic() + BOUND_S
        told = host.fetch(time.monotonic_ns())
        while told != expected and time.monotonic() < end_s:
            network.wait(0.02)
            told = host.fetch(time.monotonic_ns())
        assert told == expected
    network.wait(0.01)
    assert host.fetch(time.monotonic_ns()) == expected
    network.close()


def test_the_scenarios_see_every_kind_of_event() -> None:
    seen: set[str] = set()
    errors: set[str] = set()
    for steps in SCENARIOS.values():
        play = Play(LoopNetwork())
        for now_ns, step in enumerate(steps):
            play.submit(step, now_ns)
            play.fetch(now_ns)
        for event in [*play.fetch(99)["a"], *play.pending["b"]]:
            seen.add(type(event).__name__)
            if isinstance(event, Failed | Broken):
                errors.add(event.error)
    assert seen == {"Opened", "Failed", "Sent", "Received", "PeerClosed", "Broken", "Closed"}
    assert errors >= {"ECONNREFUSED", "ECONNRESET", "EPIPE", "EADDRINUSE", "EADDRNOTAVAIL", "EACCES", "ENOTCONN"}
