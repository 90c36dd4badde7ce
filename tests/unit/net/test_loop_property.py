"""Whatever a unit asks and a peer does, in whatever order: the network keeps its word, and does the same again."""

from __future__ import annotations

from dataclasses import dataclass

import pytest
from depth import times
from hypothesis import given, settings
from hypothesis import strategies as st

from fbvm.net.faults import Fault
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import Action, Fin, Leave, Reset, Say, ScriptedPeer
from fbvm.wire.link import (
    Broken,
    Close,
    Closed,
    Connect,
    Event,
    Failed,
    Grant,
    Listen,
    Opened,
    Peer,
    PeerClosed,
    Received,
    Request,
    Send,
    Sent,
)

HOSTS = ("10.0.0.1", "10.0.0.2")
STATION = Peer("10.0.0.9", 502)
CHANNELS = (1, 2)

times_ns = st.integers(0, 30)
actions: st.SearchStrategy[Action] = st.one_of(
    st.builds(Say, st.binary(max_size=20), times_ns),
    st.builds(Fin, times_ns),
    st.builds(Leave, times_ns),
    st.builds(Reset, times_ns),
)
scripts = st.lists(st.lists(actions, max_size=3), max_size=4)
faults = st.lists(
    st.builds(
        Fault,
        st.sampled_from([STATION, Peer("10.0.0.2", 0), Peer("0.0.0.0", 0)]),
        latency_ns=st.one_of(st.none(), st.integers(0, 20)),
        silent=st.booleans(),
        error=st.sampled_from(["", "", "EHOSTUNREACH"]),
        segment_bytes=st.integers(0, 7),
        random_cut=st.booleans(),
        gap_ns=st.integers(0, 9),
    ),
    max_size=2,
)
wishes = st.tuples(
    st.sampled_from(["connect", "call", "listen", "send", "send", "grant", "grant", "close", "reset"]),
    st.sampled_from([0, 1]),
    st.sampled_from(CHANNELS),
    st.binary(max_size=30),
    st.integers(0, 15),
)


@dataclass
class Channel:
    """What a unit may expect on one channel."""

    state: str = "free"
    room_bytes: int = 0
    unanswered: int = 0
    fin: bool = False

    def request_of(self, verb: str, number: int, data: bytes, size: int) -> Request | None:
        """The request, if it makes sense now: a unit that has closed waits for the answer."""
        if self.state == "closing":
            return None
        opening: dict[str, Request] = {
            "connect": Connect(number, STATION),
            "call": Connect(number, Peer(HOSTS[1], 502)),
            "listen": Listen(number, 502),
        }
        if verb in opening:
            if self.state != "free":
                return None
            self.state, self.room_bytes, self.fin = "opening", 0, False
            return opening[verb]
        if verb == "grant":
            self.room_bytes = size if self.state != "free" else 0
            return Grant(number, size)
        if verb == "send":
            self.unanswered += 1
            return Send(number, data)
        self.state = "closing"
        return Close(number, reset=verb == "reset")

    def check(self, event: Event) -> None:
        """The event may come now."""
        match event:
            case Opened():
                assert self.state in ("opening", "closing")
                self.state = "open" if self.state == "opening" else "closing"
            case Failed(service="open"):
                assert self.state in ("opening", "closing")
                self.state = "free" if self.state == "opening" else "closing"
            case Failed() | Sent():
                self.unanswered -= 1
                assert self.unanswered >= 0
            case Received(data=data):
                assert self.state == "open"
                assert not self.fin
                assert data
                self.room_bytes -= len(data)
                assert self.room_bytes >= 0
            case PeerClosed():
                assert self.state == "open"
                assert not self.fin
                self.fin = True
            case Broken():
                assert self.state == "open"
                self.state = "broken"
            case Closed():
                assert self.state == "closing"
                self.state, self.unanswered = "free", 0


def play(script: list[list[Action]], table: list[Fault], steps: list[tuple[str, int, int, bytes, int]]) -> list[Event]:
    """Ask for everything that is legal, three nanoseconds apart; check and give back what was told."""
    network = LoopNetwork(7, latency_ns=2, faults=table)
    network.place(STATION, ScriptedPeer(*script))
    links = [network.attach(host) for host in HOSTS]
    models = [{number: Channel() for number in CHANNELS} for _ in HOSTS]
    told: list[Event] = []

    def fetch(now_ns: int) -> None:
        for link, model in zip(links, models, strict=True):
            for event in link.events(now_ns):
                model[event.channel].check(event)
                told.append(event)

    for count, (verb, who, number, data, size) in enumerate(steps):
        request = models[who][number].request_of(verb, number, data, size)
        if request:
            links[who].submit([request], 3 * count)
        if size % 2:
            fetch(3 * count)
    fetch(3 * len(steps) + 1_000)
    fetch(10**15)
    for model in models:
        for channel in model.values():
            assert channel.state != "closing"
    return told


@pytest.mark.slow
@settings(max_examples=times(300), deadline=None)
@given(scripts, faults, st.lists(wishes, max_size=40))
def test_every_order_of_requests(
    script: list[list[Action]], table: list[Fault], steps: list[tuple[str, int, int, bytes, int]]
) -> None:
    assert play(script, table, steps) == play(script, table, steps)


@pytest.mark.slow
@settings(max_examples=times(100), deadline=None)
@given(st.lists(st.binary(max_size=50), max_size=8), st.integers(1, 9), st.integers(0, 5), st.integers(1, 40))
def test_a_stream_arrives_whole_and_in_order(parts: list[bytes], segment: int, gap_ns: int, grant: int) -> None:
    fault = Fault(segment_bytes=segment, random_cut=True, gap_ns=gap_ns, latency_ns=3)
    network = LoopNetwork(segment, faults=[fault])
    server, client = (network.attach(host) for host in HOSTS)
    server.submit([Listen(1, 502)], 0)
    client.submit([Connect(1, Peer(HOSTS[0], 502))], 0)
    client.events(10)
    client.submit([*(Send(1, part) for part in parts), Close(1)], 10)
    got, now_ns, closed = bytearray(), 10, False
    while not closed and now_ns < 10_000:
        now_ns += 1
        server.submit([Grant(1, grant)], now_ns)
        for event in server.events(now_ns):
            closed = closed or isinstance(event, PeerClosed)
            got += event.data if isinstance(event, Received) else b""
    assert closed
    assert bytes(got) == b"".join(parts)
