"""What the host does seldom: it refuses under faults, has no room for a datagram, breaks while something is read or accepted."""

from __future__ import annotations

import errno
import socket
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from rows import each_of
from test_faults_on_the_host import DOOR, MS, SERVER, UNIT, Host
from test_stream import CLIENT, Carrier, Owner
from test_stream import SERVER as OTHER

from fbvm.net.connections import Connection
from fbvm.net.faults import fault
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import Conversation, ModbusPeer, Station, Wake
from fbvm.net.stream import End
from fbvm.net.tcp import TcpNetwork
from fbvm.net.waiting import WaitingCallers
from fbvm.wire.link import (
    Bind,
    Broken,
    Close,
    Closed,
    Connect,
    Failed,
    Grant,
    Listen,
    Opened,
    Peer,
    PeerClosed,
    Received,
    Send,
    SendTo,
    Sent,
)
from fbvm.wire.tap import TapKind


@pytest.fixture
def host() -> Iterator[Host]:
    made = Host()
    yield made
    made.close()


def test_a_host_that_refuses_under_a_latency_is_told_after_it_and_tapped(monkeypatch: pytest.MonkeyPatch) -> None:
    host = Host(fault("slow", latency_ns=30 * MS))
    told: list[tuple[int, TapKind, bool]] = []
    host.network.tap = lambda now_ns, unit, event: told.append((now_ns // MS, event.kind, event.out))
    try:
        host.listening.close()
        host.scan(Connect(1, SERVER))
        [failed] = host.until(Failed)
        assert failed == Failed(1, "open", "ECONNREFUSED") and (host.scans - 1) * 10 >= 60
        assert [row[1:] for row in told] == [(TapKind.SYN, True), (TapKind.RST, False)] and told[1][0] - told[0][0] >= 60
        monkeypatch.setattr(Connection, "open", lambda self, now_ns: raised(OSError(errno.EHOSTUNREACH, "no way")))
        host.scan(Connect(1, SERVER))
        assert host.until(Failed) == [Failed(1, "open", "EHOSTUNREACH")]
        assert [row[1:] for row in told[2:]] == [(TapKind.SYN, True)] and host.network.relays.carried == {}
    finally:
        host.close()


@each_of(("error", "said"), [(BlockingIOError(), "ENOBUFS"), (OSError(errno.ENETDOWN, "down"), "ENETDOWN"), (None, "")])
def test_a_datagram_that_the_host_does_not_take_fails(error: OSError | None, said: str) -> None:
    network = TcpNetwork({Peer(UNIT, 0): ("127.0.0.1", 0)})
    tapped: list[bytes] = []
    network.tap = lambda now_ns, unit, event: tapped.append(event.data)
    try:
        link = network.attach(UNIT)
        link.submit([Bind(1, 5000)], 0)
        assert [type(event) for event in link.events(0)] == [Opened]
        port: Any = link.channels[1]
        real, port.sock = port.sock, SimpleNamespace(sendto=lambda data, where: raised(error))
        link.submit([SendTo(1, Peer("127.0.0.1", 9), b"abc")], 0)
        port.sock = real
        assert list(link.events(0)) == ([Failed(1, "send", said)] if said else [Sent(1, 3)])
        assert tapped == ([] if said else [b"abc"])
        link.submit([SendTo(1, Peer("127.0.0.1", 0), b"abc")], 0)
        assert [(type(event), event.service) for event in link.events(0) if isinstance(event, Failed)] == [(Failed, "send")]
    finally:
        network.close()


def raised(error: OSError | None) -> None:
    if error is not None:
        raise error


def test_a_datagram_that_cannot_be_delivered_fails_under_faults_too() -> None:
    network = TcpNetwork({Peer(UNIT, 0): ("127.0.0.1", 0)}, faults=[fault("slow", latency_ns=MS)])
    try:
        link = network.attach(UNIT)
        link.submit([Bind(1, 5000)], 0)
        link.events(0)
        link.submit([SendTo(1, Peer("127.0.0.1", 0), b"abc"), SendTo(1, Peer("127.0.0.1", 9), bytes(70_000))], 0)
        assert [type(event) for event in link.events(0)] == [Failed, Failed]
    finally:
        network.close()


@each_of(("error", "wanted"), [
    (BlockingIOError(), []), (ConnectionResetError(errno.ECONNRESET, "reset"), [Broken(1, "ECONNRESET")]),
    (TimeoutError(errno.ETIMEDOUT, "timed out"), [Broken(1, "ETIMEDOUT")]),
])  # fmt: skip
def test_a_connection_that_breaks_while_it_is_read_is_told(error: OSError, wanted: list[Broken]) -> None:
    host = Host()
    try:
        host.open()
        made: Any = host.link.channels[1]
        assert isinstance(made, Connection)
        real = made.sock
        made.sock = SimpleNamespace(recv=lambda *size: raised(error), fileno=real.fileno, close=lambda: None,
                                    getsockopt=lambda *what: 0, setsockopt=lambda *what: None)
        made.fetch(0)
        assert list(host.link.pending) == wanted
        if not wanted:
            made.sock = real
        else:
            real.close()
    finally:
        host.close()


@each_of(("error", "wanted"), [
    (BlockingIOError(), []), (ConnectionAbortedError(), []), (OSError(errno.EMFILE, "too many"), [Failed(1, "open", "EMFILE")])])
def test_a_door_that_cannot_accept_fails_unless_the_caller_has_gone(
    monkeypatch: pytest.MonkeyPatch, error: OSError, wanted: list[Failed]
) -> None:
    network = TcpNetwork({Peer(UNIT, 0): ("127.0.0.1", 0)})
    try:
        link = network.attach(UNIT)
        link.submit([Listen(1, 502)], 0)
        door: Any = link.channels[1]
        real = door.sock
        door.sock = SimpleNamespace(accept=lambda: raised(error), fileno=real.fileno, close=real.close)
        door.ready(1, 0)
        assert [event for event in link.events(0) if isinstance(event, Failed)] == wanted
        if 1 in link.channels:
            door.sock = real
    finally:
        network.close()


def test_a_fault_at_a_port_with_two_listeners_shuts_its_door_and_opens_it_again() -> None:
    host = Host()
    try:
        host.scan(Listen(1, 502), Listen(2, 502))
        real = host.network.host_endpoint(DOOR)
        host.network.faults = [fault("refused", peer=DOOR)]
        host.settle()
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection((real.host, real.port), 5)
        host.network.faults = []
        host.settle()
        host.call()
        assert [event.channel for event in host.until(Opened)] == [1]
    finally:
        host.close()
    assert host.network.faults == []


def test_callers_who_are_held_are_let_go_when_the_network_is_closed() -> None:
    closed: list[str] = []
    waiting: Any = WaitingCallers(SimpleNamespace(), True)
    conns = [(SimpleNamespace(close=lambda name=name: closed.append(name)), CLIENT) for name in "abc"]
    waiting.held = {OTHER: conns[:2], CLIENT: conns[2:]}
    waiting.close()
    assert sorted(closed) == ["a", "b", "c"] and waiting.held == {}


def test_an_end_breaks_once() -> None:
    net, owner = Carrier(), Owner()
    end = End(net, CLIENT, OTHER, CLIENT.host, owner)
    for error in ("ETIMEDOUT", "ECONNRESET"):
        end._break(error, 0)
    assert (end.error, owner.told) == ("ETIMEDOUT", ["ETIMEDOUT 0"])


class Sleeper(Conversation):
    """Says nothing but when it is woken."""

    def connected(self, now_ns: int) -> list[Wake]:
        return [Wake(now_ns + 50 * MS)]


class Sleepers(Station):
    """Takes every caller, and says nothing."""

    def accept(self, caller: Peer) -> Conversation | None:
        return Sleeper()


def test_a_peer_that_says_nothing_is_woken_and_heard_without_a_word() -> None:
    network = LoopNetwork()
    network.place(SERVER, Sleepers())
    link = network.attach(UNIT)
    link.submit([Connect(1, SERVER), Grant(1, 100)], 0)
    assert [type(event) for now_ms in (0, 10, 60) for event in link.events(now_ms * MS)] == [Opened]
    link.submit([Send(1, b"x")], 70 * MS)
    assert list(link.events(80 * MS)) == [Sent(1, 1)]
    assert [type(event) for event in link.events(90 * MS)] == []


def test_a_modbus_server_leaves_whoever_does_not_speak_modbus() -> None:
    network, peer = LoopNetwork(), ModbusPeer()
    network.place(SERVER, peer)
    link = network.attach(UNIT)
    link.submit([Connect(1, SERVER), Grant(1, 100)], 0)
    list(link.events(0))
    read = bytes.fromhex("0001 0000 0006 01 03 0000 0001")
    link.submit([Send(1, read + b"\0\2\0\1GET / HTTP/1.1\r\n\r\n")], 10 * MS)
    events = [event for now_ms in (20, 30, 40) for event in link.events(now_ms * MS)]
    assert [type(event) for event in events] == [Sent, Received, PeerClosed]
    assert isinstance(events[1], Received) and events[1].data == bytes.fromhex("0001 0000 0005 01 03 02 0000")
    assert len(peer.received) == 2
    link.submit([Close(1)], 50 * MS)


def test_a_connection_that_breaks_while_bytes_wait_loses_them(host: Host) -> None:
    host.open()
    made: Any = host.link.channels[1]
    real, answers = made.sock, [2, OSError(errno.EPIPE, "broken pipe")]

    def send(data: bytes) -> int:
        answer = answers.pop(0)
        if isinstance(answer, OSError):
            raise answer
        return answer

    tapped: list[TapKind] = []
    host.network.tap = lambda now_ns, unit, event: tapped.append(event.kind)
    made.sock = SimpleNamespace(send=send, fileno=real.fileno, close=real.close, getsockopt=lambda *what: 0,
                                setsockopt=lambda *what: None)  # fmt: skip
    assert host.network.connections == 1
    host.scan(Send(1, b"abcde"), Send(1, b"f"))
    found = host.settle(1)
    assert found == [Failed(1, "send", "EPIPE"), Broken(1, "ECONNRESET"), Failed(1, "send", "EPIPE")]
    assert tapped == [TapKind.DATA, TapKind.RST]
    made.fetch(0)
    assert made.sock is None and host.settle(1) == []
    host.scan(Close(1))
    assert host.settle(1) == [Closed(1)] and host.network.connections == 0


def test_a_station_that_hears_no_datagrams_and_takes_no_connections_answers_nothing() -> None:
    network = LoopNetwork()
    network.place(SERVER, Station())
    link = network.attach(UNIT)
    link.submit([Bind(2, 9600), SendTo(2, SERVER, b"?"), Connect(1, SERVER)], 0)
    assert link.events(0) == [Opened(2, 9600, Peer("0.0.0.0", 0)), Sent(2, 1), Failed(1, "open", "ECONNREFUSED")]


def test_a_network_that_is_closed_has_nothing_open_and_nothing_left() -> None:
    listening, second = (socket.create_server(("127.0.0.1", 0)) for _ in range(2))
    other = Peer("192.168.250.8", 502)
    rows = {SERVER: ("127.0.0.1", listening.getsockname()[1]), other: ("127.0.0.1", second.getsockname()[1]),
            Peer(UNIT, 0): ("127.0.0.1", 0)}  # fmt: skip
    network = TcpNetwork(rows, faults=[fault("slow", latency_ns=MS, peer=other)])
    link: Any = network.attach(UNIT)
    closed: list[str] = []
    try:
        link.submit([Listen(1, 502), Bind(2, 9600), Connect(3, SERVER), Connect(4, SERVER), Connect(5, other)], 0)
        opened, now_ns = set[int](), 0
        while opened < {2, 3, 4, 5}:
            now_ns += MS
            assert now_ns < 10_000 * MS, opened
            opened |= {event.channel for event in link.events(now_ns) if isinstance(event, Opened)}
        socks = {number: channel.sock for number, channel in link.channels.items() if hasattr(channel, "sock")}
        link.submit([Close(4)], now_ns)
        kept = network.host_endpoint(Peer(UNIT, 777))
        keeper: Any = SimpleNamespace(close=lambda: closed.append("keeper"))
        network._reserved["tcp", Peer(UNIT, 778)] = kept, keeper
        network.waiting.held[Peer(UNIT, 502)] = [(SimpleNamespace(close=lambda: closed.append("caller")), CLIENT)]  # type: ignore
        behind = next(iter(network.relays._behind.values()))
        relayed = [channel.sock for channel in behind.channels.values()]  # type: ignore[attr-defined]
        network.relays.at(now_ns + MS, lambda now_ns: None)
    finally:
        network.close()
        listening.close()
        second.close()
    assert sorted(closed) == ["caller", "keeper"] and set(socks) == {1, 3, 4}
    assert [sock.fileno() for sock in (*socks.values(), *relayed)] == [-1] * 5
    assert (network.links, link.channels, behind.channels, list(network._orphans), network._reserved, network.closed) == (
        {}, {}, {}, [], {}, True)  # fmt: skip
    assert (network.relays.carried, network.relays._behind, network.relays.next_due_ns()) == ({}, {}, None)
    assert network._selector.get_map() is None and network.waiting.held == {}
    link.submit([Connect(9, SERVER)], now_ns)
    assert link.pending[-1] == Failed(9, "open", "ENETDOWN")


def test_a_network_in_memory_that_is_closed_forgets_all() -> None:
    network = LoopNetwork()
    network.place(SERVER, Sleepers())
    link = network.attach(UNIT)
    link.submit([Connect(1, SERVER)], 0)
    network.place(Peer("10.0.0.1", 1), Station())
    network.remove(Peer("10.0.0.1", 1))
    network.remove(Peer("10.0.0.1", 1))
    network.at(50 * MS, lambda now_ns: None)
    assert list(network._stations) == [SERVER] and network.next_due_ns() is not None
    network.close()
    assert (network._stations, network._links, network.next_due_ns()) == ({}, {}, None)
    network.attach(UNIT)
