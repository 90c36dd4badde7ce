"""Faults of real connections: the same rows as in memory, with sockets of the host and a time that the tests tell."""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Iterator

import pytest
from rows import each_of

from fbvm.net.faults import KINDS, Fault, fault
from fbvm.net.tcp import TcpNetwork
from fbvm.net.wires import CONNECT_TIMEOUT_NS
from fbvm.wire.link import (
    Bind,
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
    SendTo,
    Sent,
)
from fbvm.wire.tap import TapKind

BOUND_S = 10.0
MS = 1_000_000
SERVER = Peer("192.168.250.1", 502)
UNIT, DOOR = "192.168.250.2", Peer("192.168.250.2", 502)


class Host:
    """A unit on the host's network, whose scans are 10 ms apart, and a device that listens on the host."""

    def __init__(self, *faults: Fault, seed: int = 0) -> None:
        self.listening = socket.create_server(("127.0.0.1", 0))
        self.listening.settimeout(BOUND_S)
        rows = {SERVER: ("127.0.0.1", self.listening.getsockname()[1]), Peer(UNIT, 0): ("127.0.0.1", 0)}
        self.network = TcpNetwork(rows, faults=faults, seed=seed)
        self.link = self.network.attach(UNIT)
        self.scans = 0
        self.device: socket.socket | None = None
        self.callers: list[socket.socket] = []

    def close(self) -> None:
        self.network.close()
        for sock in (self.listening, self.device, *self.callers):
            if sock:
                sock.close()

    def scan(self, *requests: Request) -> list[Event]:
        """One refresh: events first, then what the unit asks for."""
        now_ns = self.scans * 10 * MS
        events = list(self.link.events(now_ns))
        self.link.submit(requests, now_ns)
        self.scans += 1
        return events

    def until(self, kind: type[Event], most: int = 10_000) -> list[Event]:
        """The events of all scans up to one of that kind."""
        told: list[Event] = []
        while not any(isinstance(event, kind) for event in told):
            told += self.scan()
            most -= 1
            assert most > 0, told
            time.sleep(0.0002)
        return told

    def settle(self, scans: int = 20) -> list[Event]:
        """The events of some scans."""
        return [event for _ in range(scans) for event in self.scan()]

    def open(self) -> socket.socket:
        """Opens channel 1 to the device; returns the device's side."""
        self.scan(Connect(1, SERVER), Grant(1, 4096))
        self.until(Opened)
        self.device, _ = self.listening.accept()
        self.device.settimeout(BOUND_S)
        return self.device

    def call(self) -> socket.socket:
        """Somebody who connects to the unit's port 502."""
        where = self.network.host_endpoint(DOOR)
        caller = socket.create_connection((where.host, where.port), BOUND_S)
        self.callers.append(caller)
        return caller


@pytest.fixture
def host() -> Iterator[Host]:
    there = Host()
    yield there
    there.close()


def arrived(device: socket.socket) -> bytes:
    """What has arrived at a device."""
    device.setblocking(False)
    try:
        return device.recv(65536)
    except BlockingIOError:
        return b""
    finally:
        device.settimeout(BOUND_S)


def data_of(events: list[Event]) -> bytes:
    return b"".join(event.data for event in events if isinstance(event, Received))


# --- what a unit opens --------------------------------------------------------------------------------------------------


def test_the_loop_is_told_when_something_is_due(host: Host) -> None:
    host.network.faults.append(fault("slow", latency_ns=50 * MS))
    host.open()
    host.settle()
    relays = host.network.relays
    assert relays.until_due_s() is None
    host.scan(Send(1, b"ask"))
    due_s = relays.until_due_s()
    assert due_s is not None and 0.02 < due_s <= 0.05
    assert relays.channels_behind == 1
    host.network.close()
    assert (relays.channels_behind, relays.until_due_s()) == (0, None)


def test_a_wait_ends_when_something_is_due(host: Host, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the news that there is something, though no socket is ready."""
    host.network.faults.append(fault("slow", latency_ns=50 * MS))
    host.open()
    host.settle()
    host.scan(Send(1, b"ask"))
    assert host.scan() == [Sent(1, 3)]
    due_s, asked = host.network.relays.until_due_s(), list[float]()
    monkeypatch.setattr(host.network, "_wait", asked.append)
    assert host.network.wait(BOUND_S) is True
    assert not host.network.wait(0.001)
    assert asked == [due_s, 0.001]


@each_of(("row", "quiet"), [
    (Fault(silent=True, from_scan=3), False), (Fault(silent=True, until_scan=3), False), (Fault(silent=True, from_ns=3), True)])
def test_a_fault_that_counts_scans_needs_every_scan(row: Fault, quiet: bool) -> None:
    """A link that is asked for its events in no scan would not count them."""
    host = Host()
    try:
        host.network.driven = True
        assert (list(host.link.events(0)), host.link.is_quiet) == ([], True)
        host.network.faults.append(row)
        host.network.serve(0)
        assert host.link.is_quiet is quiet
    finally:
        host.close()


def test_a_link_with_events_of_a_connection_under_faults_is_not_quiet() -> None:
    host = Host(fault("slow", latency_ns=MS))
    try:
        host.network.driven = True
        link = host.link
        link.submit([Connect(1, SERVER)], 0)
        said = []
        for now_ns in range(0, 200 * MS, MS):
            link.is_quiet = True
            said += [link.is_quiet for woken in host.network.serve(now_ns) if woken is link]
            if link.pending:
                break
            time.sleep(0.0005)
        assert said == [False] and [type(event) for event in link.events(0)] == [Opened]
        assert link.is_quiet
    finally:
        host.close()


def test_an_open_may_be_the_first_thing_of_all() -> None:
    host = Host(fault("refused"))
    try:
        host.link.submit([Connect(1, SERVER)], 0)
        assert host.until(Failed) == [Failed(1, "open", "ECONNREFUSED")]
    finally:
        host.close()


@pytest.mark.slow
def test_a_send_that_waits_when_a_fault_comes_is_answered(host: Host) -> None:
    """The host has not taken all of it yet; the unit is told as soon as it has."""
    device = host.open()
    host.scan(Send(1, bytes(16 << 20)))
    assert host.settle() == [], "the device reads nothing"
    host.network.faults.append(fault("slow", latency_ns=20 * MS))
    assert host.settle() == []
    device.setblocking(False)
    told: list[Event] = []
    for _ in range(20_000):
        arrived(device)
        told += host.scan()
        if told:
            break
    assert told == [Sent(1, 16 << 20)]


def test_sends_of_one_size_are_answered_on_both_sides_of_a_fault(host: Host) -> None:
    """The window of the relay opens again for each, so that more goes through than it holds at a time."""
    device, block, got = host.open(), bytes(16_384), 0
    for number in range(12):
        if number == 2:
            host.network.faults.append(fault("slow", latency_ns=1))
        host.scan(Send(1, block))
        assert host.until(Sent) == [Sent(1, len(block))]
        for _ in range(100):
            host.scan()
            got += len(arrived(device))
            if got == (number + 1) * len(block):
                break
        assert got == (number + 1) * len(block)


def test_latency_is_each_way(host: Host) -> None:
    host.network.faults.append(fault("slow", latency_ns=50 * MS))
    host.scan(Connect(1, SERVER), Grant(1, 4096))
    began = host.scans
    host.until(Opened)
    assert host.scans - began >= 10, "the way there and the way back"
    device, _ = host.listening.accept()
    host.scan(Send(1, b"ask"))
    assert host.scan() == [Sent(1, 3)], "the unit's stack has taken it"
    assert arrived(device) == b""
    host.settle(6)
    assert arrived(device) == b"ask"
    device.sendall(b"reply")
    began = host.scans
    assert data_of(host.until(Received)) == b"reply"
    assert host.scans - began >= 5
    device.close()


def test_bytes_drip(host: Host) -> None:
    host.network.faults.append(KINDS["dripping"])
    device = host.open()
    host.scan(Send(1, b"abc"))
    seen = []
    for _ in range(6):
        host.scan()
        seen.append(arrived(device))
    assert [piece for piece in seen if piece] == [b"a", b"b", b"c"]
    device.sendall(b"xyz")
    pieces = [event.data for event in host.settle(300) if isinstance(event, Received)]
    assert pieces == [b"x", b"y", b"z"]


def test_nothing_passes_while_it_is_silent(host: Host) -> None:
    device = host.open()
    host.network.faults.append(fault("silent"))
    host.scan(Send(1, b"ask"))
    device.sendall(b"said")
    assert host.settle() == [Sent(1, 3)]
    assert arrived(device) == b""
    host.network.faults.clear()
    assert data_of(host.until(Received)) == b"said"
    host.settle(150)  # what was sent is transmitted again after a second
    assert arrived(device) == b"ask"


@pytest.mark.slow
def test_a_connection_dies_in_long_silence(host: Host) -> None:
    device = host.open()
    host.network.faults.append(fault("silent"))
    host.scan(Send(1, b"ask"))
    assert host.settle(7700)[-1] == Broken(1, "ETIMEDOUT")
    with pytest.raises(ConnectionResetError):
        device.recv(1)
    host.scan(Close(1))
    assert host.scan() == [Closed(1)]


def test_nothing_is_kept_of_a_connection_that_the_peer_has_reset(host: Host) -> None:
    host.network.faults.append(fault("slow", latency_ns=10 * MS))
    device = host.open()
    assert host.network.relays.channels_behind == 1
    device.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    device.close()
    assert host.until(Broken) == [Broken(1, "ECONNRESET")]
    host.scan(Close(1))
    host.settle(3)
    assert (host.network.relays.channels_behind, host.network.relays.carried) == (0, {})


@pytest.mark.slow
def test_nobody_answers_an_open_in_silence(host: Host) -> None:
    host.network.faults.append(fault("silent"))
    host.scan(Connect(1, SERVER))
    assert host.settle(CONNECT_TIMEOUT_NS // (10 * MS)) == [Failed(1, "open", "ETIMEDOUT")]
    host.network.faults.clear()
    assert host.open()


@each_of("name, error", [("refused", "ECONNREFUSED"), ("unreachable", "EHOSTUNREACH")])
def test_an_open_fails_at_once(name: str, error: str) -> None:
    host = Host(fault(name))
    host.scan(Connect(1, SERVER))
    assert host.scan() == [Failed(1, "open", error)]
    host.listening.setblocking(False)
    with pytest.raises(BlockingIOError):
        host.listening.accept()
    host.close()


def test_what_is_open_breaks(host: Host) -> None:
    device = host.open()
    host.network.faults.append(fault("reset"))
    assert host.until(Broken) == [Broken(1, "ECONNRESET")]
    with pytest.raises(ConnectionResetError):
        device.recv(1)


def test_what_is_said_is_lost_or_doubled(host: Host) -> None:
    device = host.open()
    host.network.faults.append(fault("lossy", lose_percent=100))
    host.scan(Send(1, b"lost"))
    device.sendall(b"lost")
    assert host.settle() == [Sent(1, 4)]
    host.network.faults[:] = [fault("doubled", duplicate_percent=100)]
    host.scan(Send(1, b"ab"))
    host.settle()
    assert arrived(device) == b"abab"
    device.sendall(b"xy")
    assert data_of(host.settle()) == b"xyxy"


def test_it_breaks_in_the_middle(host: Host) -> None:
    host.network.faults.append(fault("interrupted", reset_after_bytes=5))
    device = host.open()
    host.scan(Send(1, b"abc"))
    host.settle(3)
    assert arrived(device) == b"abc"
    device.sendall(b"xyz")
    told = host.until(Broken)
    assert (data_of(told), told[-1]) == (b"xy", Broken(1, "ECONNRESET"))
    with pytest.raises(ConnectionResetError):
        device.recv(1)


def test_a_row_holds_during_some_scans_and_for_one_peer() -> None:
    elsewhere = fault("refused", peer=Peer("192.168.250.9", 502))
    host = Host(elsewhere, fault("refused", from_scan=3, until_scan=5))
    told = [host.scan(Connect(scan + 1, SERVER)) for scan in range(7)]
    failed = [event.channel for events in told for event in events if isinstance(event, Failed)]
    assert failed == [4, 5]
    host.close()


@pytest.mark.slow
def test_faults_are_switched_while_data_flow(host: Host) -> None:
    """No byte is lost or changed by the way from the host's connection to wires, nor when there is no fault any more."""
    device = host.open()
    sent, received, seen = b"", b"", b""
    for number in range(60):
        if number % 10 == 0:
            host.network.faults[:] = [fault("cut", segment_bytes=3), KINDS["dripping"]][number // 10 % 2 :] if number % 20 else []
        data = bytes([number]) * 7
        sent += data
        device.sendall(data)
        received += data_of(host.scan(Send(1, data)))
        seen += arrived(device)
    host.network.faults.clear()
    for _ in range(700):
        received += data_of(host.scan())
        seen += arrived(device)
    assert received == sent
    assert seen == sent
    host.scan(Close(1))
    host.settle(3)
    assert device.recv(1) == b""


def test_the_peers_end_comes_through_wires(host: Host) -> None:
    host.network.faults.append(fault("slow", latency_ns=20 * MS))
    device = host.open()
    device.sendall(b"last")
    device.shutdown(socket.SHUT_WR)
    assert host.until(PeerClosed) == [Received(1, b"last"), PeerClosed(1)]
    host.scan(Send(1, b"bye"))
    host.scan(Close(1))
    host.settle()
    assert device.recv(9) == b"bye"
    assert device.recv(9) == b""
    assert host.network.relays.carried == {}


def test_the_tap_sees_what_the_unit_sees(host: Host) -> None:
    kinds: list[tuple[TapKind, bool, bytes]] = []
    host.network.tap = lambda now_ns, unit, event: kinds.append((event.kind, event.out, event.data))
    host.network.faults.append(fault("doubled", duplicate_percent=100))
    device = host.open()
    device.sendall(b"a")
    host.settle()
    assert kinds == [(TapKind.SYN, True, b""), (TapKind.OPEN, True, b""), *[(TapKind.DATA, False, b"a")] * 2]


# --- doors --------------------------------------------------------------------------------------------------------------


def test_a_door_is_really_shut(host: Host) -> None:
    host.scan(Listen(5, 502), Grant(5, 100))
    host.scan()
    host.network.faults.append(fault("refused", peer=DOOR))
    host.scan()
    with pytest.raises(ConnectionRefusedError):
        host.call()
    host.network.faults.clear()
    host.scan()
    host.call().sendall(b"hello")
    assert data_of(host.until(Received)) == b"hello"


def test_a_listener_that_opens_while_callers_are_refused_leaves_its_door_shut(host: Host) -> None:
    host.network.faults.append(fault("refused", peer=DOOR))
    host.scan()
    host.scan(Listen(5, 502), Grant(5, 100))
    with pytest.raises(ConnectionRefusedError):
        host.call()
    host.network.faults.clear()
    host.scan()
    host.call().sendall(b"hello")
    assert data_of(host.until(Received)) == b"hello"


def test_a_door_that_is_kept_for_callers_is_shut_too() -> None:
    network = TcpNetwork({DOOR: ("127.0.0.1", 0)}, backlog=True)
    link = network.attach(UNIT)
    real = network.host_endpoint(DOOR)
    try:
        link.submit([Listen(5, 502)], 0)
        link.submit([Close(5)], 0)
        socket.create_connection((real.host, real.port), BOUND_S).close()
        network.faults.append(fault("refused", peer=DOOR))
        link.events(0)
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection((real.host, real.port), BOUND_S)
        link.submit([Listen(5, 502)], 0)
        network.faults.clear()
        link.events(0)
        socket.create_connection((real.host, real.port), BOUND_S).close()
    finally:
        network.close()


def test_a_silent_door_leaves_callers_waiting(host: Host) -> None:
    host.scan(Listen(5, 502), Grant(5, 100))
    host.network.faults.append(fault("silent", peer=DOOR))
    host.scan()
    host.call().sendall(b"hello")
    assert host.settle() == []
    host.network.faults.clear()
    told = host.until(Received)
    assert isinstance(told[0], Opened)
    assert data_of(told) == b"hello"


def test_a_caller_is_under_the_faults_of_the_door(host: Host) -> None:
    host.scan(Listen(5, 502), Grant(5, 100))
    host.network.faults.append(fault("dripping", peer=DOOR))
    host.scan()
    caller = host.call()
    host.until(Opened)
    caller.sendall(b"xyz")
    assert [event.data for event in host.settle(200) if isinstance(event, Received)] == [b"x", b"y", b"z"]
    host.network.faults[:] = [fault("reset", peer=DOOR)]
    assert host.until(Broken) == [Broken(5, "ECONNRESET")]
    with pytest.raises(ConnectionResetError):
        caller.recv(1)


def test_a_port_that_is_given_away_meanwhile_fails_the_open(host: Host) -> None:
    """A door that a fault shuts is opened again; if somebody else has its port by then, the unit is told."""
    where = host.network.host_endpoint(Peer(UNIT, 503))
    host.scan(Listen(5, 503))
    host.network.faults.append(fault("refused"))
    host.scan()
    with socket.socket() as thief:
        thief.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        thief.bind((where.host, where.port))
        thief.listen()
        host.network.faults.clear()
        assert host.until(Failed) == [Failed(5, "open", "EADDRINUSE")]


# --- datagrams, and units among themselves --------------------------------------------------------------------------------


def test_datagrams_are_lost_late_and_doubled(host: Host) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as device:
        device.bind(("127.0.0.1", 0))
        device.settimeout(BOUND_S)
        remote = Peer(*device.getsockname())
        host.scan(Bind(3, 9600))
        host.until(Opened)
        where = host.network.host_endpoint(Peer(UNIT, 9600), "udp")
        host.network.faults.append(fault("silent"))
        host.scan()
        host.scan(SendTo(3, remote, b"lost"))
        device.sendto(b"lost", (where.host, where.port))
        assert host.settle() == [Sent(3, 4)]
        assert arrived(device) == b""
        host.network.faults[:] = [fault("doubled", duplicate_percent=100, latency_ns=30 * MS)]
        host.scan(SendTo(3, remote, b"twice"))
        assert arrived(device) == b""
        host.settle(4)
        assert (arrived(device), arrived(device), arrived(device)) == (b"twice", b"twice", b"")
        device.sendto(b"here", (where.host, where.port))
        assert host.settle() == [Received(3, b"here", remote)] * 2
        host.scan(Close(3))
        assert host.scan() == [Closed(3)]
        assert host.settle() == []


def test_two_units_of_a_network_meet_a_fault_once(host: Host) -> None:
    other = host.network.attach("192.168.250.3")
    host.network.faults.append(fault("doubled", duplicate_percent=100))
    host.scan(Listen(5, 502), Grant(5, 100))
    other.submit([Connect(1, DOOR), Grant(1, 99)], 0)
    told: list[Event] = []
    while not told:
        host.settle(1)
        told += other.events(host.scans * 10 * MS)
    assert [type(event) for event in told] == [Opened]
    host.scan(Send(5, b"q"))
    for _ in range(50):
        host.scan()
        told += other.events(host.scans * 10 * MS)
    assert data_of(told) == b"qq"


@pytest.mark.slow
@each_of("kind", KINDS)
def test_after_each_kind_all_is_well(kind: str) -> None:
    host = Host(KINDS[kind])
    host.scan(Connect(1, SERVER), Grant(1, 4096))
    for _ in range(40):
        host.scan(Send(1, b"ask"))
    host.network.faults.clear()
    host.settle(300)
    host.scan(Close(1, reset=True))
    host.settle(150)
    host.listening.setblocking(False)
    for _ in range(3):
        try:
            host.listening.accept()[0].close()
        except BlockingIOError:
            break
    host.listening.settimeout(BOUND_S)
    host.scan(Connect(2, SERVER), Grant(2, 4096))
    assert isinstance(host.until(Opened)[-1], Opened)
    host.device, _ = host.listening.accept()
    host.device.sendall(b"reply")
    assert data_of(host.until(Received)) == b"reply"
    assert kind in ("silent", "unreachable") or host.network.relays.carried == {}
    assert host.network.relays.channels_behind <= (kind in ("silent", "unreachable"))
    host.close()
