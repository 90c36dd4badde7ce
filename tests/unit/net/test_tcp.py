"""Real connections on 127.0.0.1: nothing blocks, whatever the other side does."""

from __future__ import annotations

import errno
import socket
import struct
import time
from collections.abc import Callable, Iterator

import pytest
from rows import each_of

from fbvm.net.addresses import AddressMap, why_unusable
from fbvm.net.notices import Notice, NoticeKind
from fbvm.net.switchboard import MAX_ORPHANS, ORPHAN_LIMIT_NS, UDP, Watcher
from fbvm.net.tcp import TcpLink, TcpNetwork
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
    Send,
    SendTo,
    Sent,
)
from fbvm.wire.tap import TapEvent, TapKind

BOUND_S = 10.0
"""Nothing here takes so long; a test that waits in vain ends after it."""
SERVER = Peer("192.168.250.1", 502)
UNIT = "192.168.250.2"
RST_ON_CLOSE = struct.pack("ii", 1, 0)


now_ns = time.monotonic_ns


class Device:
    """The other side: a plain listening socket of the host, served by the test itself."""

    def __init__(self, backlog: int = 5) -> None:
        self.door = socket.create_server(("127.0.0.1", 0), backlog=backlog)
        self.door.settimeout(BOUND_S)
        self.port: int = self.door.getsockname()[1]
        self.lines: list[socket.socket] = []

    def accept(self) -> socket.socket:
        line, _ = self.door.accept()
        line.settimeout(BOUND_S)
        self.lines.append(line)
        return line

    def close(self) -> None:
        for sock in (self.door, *self.lines):
            sock.close()


@pytest.fixture
def device() -> Iterator[Device]:
    device = Device()
    yield device
    device.close()


@pytest.fixture
def network(device: Device) -> Iterator[TcpNetwork]:
    network = TcpNetwork({SERVER: ("127.0.0.1", device.port), Peer("192.168.250.2", 0): ("127.0.0.1", 0)})
    yield network
    network.close()


def until(link: TcpLink, enough: Callable[[list[Event]], bool]) -> list[Event]:
    """Events until there are enough, sleeping in the selector only."""
    events: list[Event] = []
    end_s = time.monotonic() + BOUND_S
    while not enough(events):
        assert time.monotonic() < end_s, events
        link.network.wait(0.05)
        events += link.events(now_ns())
    return events


def until_last(link: TcpLink, kind: type) -> list[Event]:
    return until(link, lambda events: bool(events) and isinstance(events[-1], kind))


def opened(network: TcpNetwork, device: Device, grant: int = 4096) -> tuple[TcpLink, socket.socket]:
    link = network.attach(UNIT)
    link.submit([Connect(1, SERVER), Grant(1, grant)], now_ns())
    [event] = until(link, bool)
    assert isinstance(event, Opened)
    assert event.remote == SERVER
    line = device.accept()
    assert line.getpeername() == ("127.0.0.1", event.local_port)
    return link, line


def data_of(events: list[Event]) -> bytes:
    return b"".join(event.data for event in events if isinstance(event, Received))


def is_reset(line: socket.socket) -> bool:
    return line.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR) != 0


def test_bytes_go_both_ways(network: TcpNetwork, device: Device) -> None:
    link, line = opened(network, device)
    link.submit([Send(1, b"ping")], now_ns())
    assert until(link, bool) == [Sent(1, 4)]
    assert line.recv(100) == b"ping"
    line.sendall(b"pong")
    assert until(link, bool) == [Received(1, b"pong")]
    line.shutdown(socket.SHUT_WR)
    assert until(link, bool) == [PeerClosed(1)]
    link.submit([Send(1, b"still"), Close(1)], now_ns())
    assert until(link, bool) == [Sent(1, 5), Closed(1)]
    assert line.recv(100) == b"still"
    assert line.recv(100) == b""


def test_nobody_listens(network: TcpNetwork, device: Device) -> None:
    device.door.close()
    link = network.attach(UNIT)
    link.submit([Connect(1, SERVER)], now_ns())
    assert until(link, bool) == [Failed(1, "open", "ECONNREFUSED")]


@pytest.mark.parametrize(
    ("remote", "error"),
    [
        (Peer("255.255.255.255", 502), "EACCES"),
        (Peer("0.0.0.0", 502), "EADDRNOTAVAIL"),
        (Peer("localhost", 502), "EADDRNOTAVAIL"),  # a name is never looked up
        (Peer("127.0.0.1", 70000), "EADDRNOTAVAIL"),
    ],
)
def test_endpoints_that_cannot_be(network: TcpNetwork, remote: Peer, error: str) -> None:
    link = network.attach(UNIT)
    link.submit([Connect(1, remote)], now_ns())
    assert link.events(now_ns()) == [Failed(1, "open", error)]


def test_never_more_than_granted(network: TcpNetwork, device: Device) -> None:
    link, line = opened(network, device, grant=0)
    line.sendall(b"abcdefgh")
    line.shutdown(socket.SHUT_WR)
    assert network.wait(BOUND_S)
    assert link.events(now_ns()) == []
    assert not network.wait(0)  # data without a grant do not keep the run awake
    for size, expected in [(3, b"abc"), (2, b"de")]:
        link.submit([Grant(1, 100), Grant(1, size)], now_ns())
        assert until(link, bool) == [Received(1, expected)]
    link.submit([Grant(1, 100)], now_ns())
    assert until_last(link, PeerClosed) == [Received(1, b"fgh"), PeerClosed(1)]
    assert not network.wait(0)


def test_a_grant_may_shrink_while_others_are_served(network: TcpNetwork, device: Device) -> None:
    link, line = opened(network, device, grant=100)
    other = network.attach("192.168.250.3")
    line.sendall(b"abcdefgh")
    assert network.wait(BOUND_S)
    assert other.events(now_ns()) == []
    link.submit([Grant(1, 3)], now_ns())
    assert link.events(now_ns()) == [Received(1, b"abc")]


def test_a_fin_is_noticed_without_a_grant(network: TcpNetwork, device: Device) -> None:
    link, line = opened(network, device, grant=0)
    line.shutdown(socket.SHUT_WR)
    assert until(link, bool) == [PeerClosed(1)]


def test_reset_by_the_peer(network: TcpNetwork, device: Device) -> None:
    link, line = opened(network, device)
    line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RST_ON_CLOSE)
    line.close()
    assert until(link, bool) == [Broken(1, "ECONNRESET")]
    link.submit([Send(1, b"x"), Close(1), Connect(1, SERVER)], now_ns())
    assert until_last(link, Opened)[:2] == [Failed(1, "send", "EPIPE"), Closed(1)]


def test_reset_is_noticed_while_data_wait_for_a_grant(network: TcpNetwork, device: Device) -> None:
    link, line = opened(network, device, grant=0)
    line.sendall(b"data")
    assert network.wait(BOUND_S)
    assert link.events(now_ns()) == []
    line.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RST_ON_CLOSE)
    line.close()
    assert until(link, bool) == [Broken(1, "ECONNRESET")]


def test_sending_to_a_peer_that_left_ends_in_a_reset(network: TcpNetwork, device: Device) -> None:
    link, line = opened(network, device)
    line.close()
    assert until(link, bool) == [PeerClosed(1)]
    link.submit([Send(1, b"x")], now_ns())
    assert until_last(link, Broken) == [Sent(1, 1), Broken(1, "ECONNRESET")]


def test_close_by_fin_and_by_rst(network: TcpNetwork, device: Device) -> None:
    link, line = opened(network, device)
    link.submit([Close(1)], now_ns())
    assert line.recv(10) == b""
    link.submit([Connect(1, SERVER)], now_ns())
    until_last(link, Opened)
    line = device.accept()
    link.submit([Close(1, reset=True)], now_ns())
    with pytest.raises(ConnectionResetError):
        line.recv(10)


@pytest.mark.parametrize("half_closed", [False, True])
def test_a_reset_comes_behind_what_has_been_sent(network: TcpNetwork, device: Device, half_closed: bool) -> None:
    """The host sends no more than ten small segments before the first acknowledgement."""
    link, line = opened(network, device)
    if half_closed:
        line.shutdown(socket.SHUT_WR)
        assert until(link, bool) == [PeerClosed(1)]
    link.submit([*(Send(1, b"reply") for _ in range(100)), Close(1, reset=True)], now_ns())
    until_last(link, Closed)
    until(link, lambda events: is_reset(line))
    assert b"".join(iter(lambda: line.recv(1000), b"")) == 100 * b"reply"


def test_a_reset_comes_behind_what_has_been_sent_also_if_there_is_something_to_read(network: TcpNetwork, device: Device) -> None:
    link, line = opened(network, device)
    network.driven = True
    line.sendall(b"another request")
    assert network.wait(BOUND_S)
    network.serve(now_ns())
    link.submit([*(Send(1, b"reply") for _ in range(100)), Close(1, reset=True)], now_ns())
    network.driven = False
    until(link, lambda events: is_reset(line))
    assert b"".join(iter(lambda: line.recv(1000), b"")) == 100 * b"reply"


def test_unread_data_do_not_turn_the_fin_into_a_reset(network: TcpNetwork, device: Device) -> None:
    link, line = opened(network, device, grant=0)
    line.sendall(b"never fetched")
    assert network.wait(BOUND_S)
    link.submit([Close(1)], now_ns())
    assert line.recv(10) == b""
    line.sendall(b"too late")
    assert until(link, lambda events: is_reset(line)) == [Closed(1)]


def test_a_connection_that_waited_for_a_grant_still_hears_its_peer_after_the_close(network: TcpNetwork, device: Device) -> None:
    link, line = opened(network, device, grant=0)
    line.sendall(b"never granted")
    assert network.wait(BOUND_S)
    at_ns = now_ns()
    assert link.events(at_ns) == []
    link.submit([Close(1)], at_ns)
    assert link.events(at_ns) == [Closed(1)]
    assert line.recv(10) == b""
    line.sendall(b"too late")
    assert network.wait(BOUND_S)
    assert link.events(at_ns) == []
    assert is_reset(line)


def test_a_peer_that_never_reads(network: TcpNetwork, device: Device) -> None:
    link, line = opened(network, device)
    line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    link.submit([Send(1, bytes(60_000))] * 200, now_ns())
    events = link.events(now_ns())
    assert events.count(Sent(1, 60_000)) >= 1
    refused = events.count(Failed(1, "send", "ENOBUFS"))
    assert refused > 100  # what waits here is bounded
    link.submit([Close(1)], now_ns())
    assert link.events(now_ns()) == [Closed(1)]
    link.events(now_ns() + ORPHAN_LIMIT_NS)  # and it does not wait for ever
    with pytest.raises(ConnectionResetError):
        while line.recv(65536):
            pass


def test_a_large_send_is_taken_bit_by_bit(network: TcpNetwork, device: Device) -> None:
    link, line = opened(network, device)
    content = bytes(range(256)) * 900
    link.submit([Send(1, content)], now_ns())
    got = bytearray()
    line.setblocking(False)
    sent: list[Event] = []
    end_s = time.monotonic() + BOUND_S
    while len(got) < len(content) and time.monotonic() < end_s:
        sent += link.events(now_ns())
        try:
            got += line.recv(65536)
        except BlockingIOError:
            network.wait(0.01)
    assert bytes(got) == content
    assert sent + link.events(now_ns()) == [Sent(1, len(content))]


def test_what_waits_at_a_close_still_goes_out(network: TcpNetwork, device: Device) -> None:
    link, line = opened(network, device)
    content = bytes(250_000)
    link.submit([Send(1, content), Close(1)], now_ns())
    got = 0
    line.setblocking(False)
    end_s = time.monotonic() + BOUND_S
    while time.monotonic() < end_s:
        link.events(now_ns())
        try:
            part = line.recv(65536)
        except BlockingIOError:
            network.wait(0.01)
            continue
        got += len(part)
        if not part:
            break
    assert got == len(content)


def test_a_peer_that_never_accepts() -> None:
    device = Device(backlog=0)
    network = TcpNetwork({SERVER: ("127.0.0.1", device.port)})
    link = network.attach(UNIT)
    link.submit([Connect(channel, SERVER) for channel in range(1, 9)], now_ns())
    events = link.events(now_ns())
    link.submit([Close(channel) for channel in range(1, 9)], now_ns())
    assert [event for event in link.events(now_ns()) if isinstance(event, Closed)] == [Closed(n) for n in range(1, 9)]
    assert len(events) < 8  # some stay in the opening for ever, and nothing blocks
    network.close()
    device.close()


def test_orphans_are_bounded(network: TcpNetwork, device: Device) -> None:
    link = network.attach(UNIT)
    for _ in range(MAX_ORPHANS + 2):
        link.submit([Connect(1, SERVER)], now_ns())
        until_last(link, Opened)
        device.accept()
        link.submit([Close(1)], now_ns())
    assert device.lines[-1].recv(1) == b""
    assert [is_reset(line) for line in device.lines] == [True, True] + [False] * MAX_ORPHANS


# --- listening -----------------------------------------------------------------------------------------------------


def call(network: TcpNetwork, endpoint: Peer) -> socket.socket:
    real = network.host_endpoint(endpoint)
    return socket.create_connection((real.host, real.port), timeout=BOUND_S)


def keeps_alive(link: TcpLink, channel: int) -> bool:
    line = link.channels[channel]
    assert isinstance(line, Watcher)
    sock: socket.socket = line.sock  # type: ignore[attr-defined]
    return bool(sock.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE))


@pytest.mark.parametrize("wanted", [False, True])
def test_keep_alive_is_the_hosts_on_either_side(network: TcpNetwork, device: Device, wanted: bool) -> None:
    link = network.attach(UNIT)
    link.submit([Connect(1, SERVER, 0, wanted), Listen(2, 502, keep_alive=wanted)], now_ns())
    until(link, bool)
    with call(network, Peer(UNIT, 502)):
        until(link, bool)
        assert [keeps_alive(link, channel) for channel in (1, 2)] == [wanted, wanted]
        link.submit([Close(1), Close(2)], now_ns())


def test_listening_on_a_port_that_the_system_chose(network: TcpNetwork) -> None:
    link = network.attach(UNIT)
    here = Peer(UNIT, 502)
    assert network.host_endpoint(here).port not in (0, 502)
    with pytest.raises(ConnectionRefusedError):
        call(network, here)
    for _ in range(3):
        link.submit([Listen(1, 502), Grant(1, 100)], now_ns())
        with call(network, here) as caller:
            [event] = until(link, bool)
            assert event == Opened(1, 502, Peer(*caller.getsockname()))
            with pytest.raises(ConnectionRefusedError):
                call(network, here)
            caller.sendall(b"hello")
            assert until(link, bool) == [Received(1, b"hello")]
            link.submit([Send(1, b"and back"), Close(1)], now_ns())
            assert until(link, bool) == [Sent(1, 8), Closed(1)]
            assert caller.recv(100) == b"and back"


def test_a_withdrawn_door_is_shut(network: TcpNetwork) -> None:
    link = network.attach(UNIT)
    link.submit([Listen(2, 502), Listen(1, 502), Close(2), Close(1)], now_ns())
    assert link.events(now_ns()) == [Closed(2), Closed(1)]
    with pytest.raises(ConnectionRefusedError):
        call(network, Peer(UNIT, 502))


def test_a_stranger_is_reset_and_the_door_stays_open(device: Device) -> None:
    network = TcpNetwork({Peer(UNIT, 502): ("127.0.0.1", 0), Peer("10.0.0.7", 0): ("127.0.0.1", 0)})
    link = network.attach(UNIT)
    link.submit([Listen(1, 502, Peer("10.0.0.8", 0))], now_ns())
    with call(network, Peer(UNIT, 502)) as stranger:
        assert network.wait(BOUND_S)
        assert link.events(now_ns()) == []
        with pytest.raises(ConnectionResetError):
            stranger.recv(1)
    link.submit([Close(1), Listen(1, 502, Peer("10.0.0.7", 0))], now_ns())
    with call(network, Peer(UNIT, 502)) as friend:
        assert until_last(link, Opened)[-1] == Opened(1, 502, Peer("10.0.0.7", friend.getsockname()[1]))
    network.close()


def test_two_units_of_one_network(network: TcpNetwork) -> None:
    server, client = network.attach(UNIT), network.attach("192.168.250.3")
    heard: list[TapEvent] = []
    network.tap = lambda now_ns, address, event: heard.append(event)
    client.submit([Connect(1, Peer(UNIT, 502))], now_ns())
    assert until(client, bool) == [Failed(1, "open", "ECONNREFUSED")]
    server.submit([Listen(1, 502, Peer("192.168.250.3", 0))], now_ns())
    client.submit([Connect(1, Peer(UNIT, 502))], now_ns())
    [event] = until(client, bool)
    assert isinstance(event, Opened)
    assert until(server, bool) == [Opened(1, 502, Peer("192.168.250.3", event.local_port))]
    assert all(event.mirrored for event in heard)
    assert [event.kind for event in heard if event.out][-2:] == [TapKind.SYN, TapKind.OPEN]


def test_a_local_port_of_the_clients_own(network: TcpNetwork, device: Device) -> None:
    link = network.attach(UNIT)
    link.submit([Connect(1, SERVER, local_port=502)], now_ns())
    assert until(link, bool) == [Opened(1, 502, SERVER)]
    assert device.accept().getpeername()[1] == network.host_endpoint(Peer(UNIT, 502)).port


def test_a_port_without_a_row_is_used_as_it_is() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        network = TcpNetwork()
        link = network.attach(UNIT)
        link.submit([Listen(1, port)], now_ns())
        assert link.events(now_ns()) == [Failed(1, "open", "EADDRINUSE")]
        network.close()


def test_a_connection_to_itself_is_refused() -> None:
    network = TcpNetwork()
    link = network.attach(UNIT)
    with socket.create_server(("127.0.0.1", 0)) as probe:
        port = probe.getsockname()[1]
    link.submit([Connect(1, Peer("127.0.0.1", port), local_port=port)], now_ns())
    assert until(link, bool) == [Failed(1, "open", "ECONNREFUSED")]
    network.close()


# --- datagrams, the map, the tap -----------------------------------------------------------------------------------


def test_datagrams() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as device:
        device.bind(("127.0.0.1", 0))
        device.settimeout(BOUND_S)
        there = Peer("192.168.250.9", 9600)
        network = TcpNetwork({there: device.getsockname(), Peer(UNIT, 9600): ("127.0.0.1", 0)})
        link = network.attach(UNIT)
        sends = [SendTo(1, there, b"hello"), SendTo(1, there, bytes(70_000)), Send(1, b"")]
        link.submit([Bind(1, 9600), *sends], now_ns())
        assert link.events(now_ns()) == [
            Opened(1, 9600, Peer("0.0.0.0", 0)),
            Sent(1, 5),
            Failed(1, "send", "EMSGSIZE"),
            Failed(1, "send", "ENOTCONN"),
        ]
        data, sender = device.recvfrom(100)
        assert (data, Peer(*sender)) == (b"hello", network.host_endpoint(Peer(UNIT, 9600), UDP))
        device.sendto(b"one", sender)
        device.sendto(b"two", sender)
        assert until(link, lambda events: len(events) == 2) == [Received(1, b"one", there), Received(1, b"two", there)]
        link.submit([SendTo(1, Peer("0.0.0.0", 1), b""), Close(1)], now_ns())
        assert link.events(now_ns()) == [Failed(1, "send", "EADDRNOTAVAIL"), Closed(1)]
        network.close()


def test_datagrams_between_units() -> None:
    network = TcpNetwork({Peer("10.0.0.1", 0): ("127.0.0.1", 0), Peer("10.0.0.2", 0): ("127.0.0.1", 0)})
    one, two = network.attach("10.0.0.1"), network.attach("10.0.0.2")
    one.submit([Bind(1, 9600)], now_ns())
    two.submit([Bind(1, 9600), SendTo(1, Peer("10.0.0.1", 9600), b"hi")], now_ns())
    assert until_last(one, Received)[-1] == Received(1, b"hi", Peer("10.0.0.2", 9600))
    network.close()


def test_the_map() -> None:
    rows = {
        Peer("10.0.0.1", 502): Peer("127.0.0.1", 1502),
        Peer("10.0.0.2", 0): Peer("127.0.0.2", 0),
        Peer("10.0.0.3", 0): Peer("127.0.0.3", 7),
        Peer("10.0.0.9", 0): Peer("127.0.0.2", 0),
    }
    book = AddressMap(rows, "127.0.0.1")
    assert book.outward(Peer("10.0.0.1", 502)) == Peer("127.0.0.1", 1502)
    assert book.outward(Peer("10.0.0.1", 503)) == Peer("10.0.0.1", 503)
    assert book.outward(Peer("10.0.0.2", 503)) == Peer("127.0.0.2", 503)
    assert book.outward(Peer("10.0.0.3", 503)) == Peer("127.0.0.3", 7)
    assert book.local(Peer("10.0.0.5", 502)) == Peer("127.0.0.1", 502)
    assert book.local(Peer("10.0.0.9", 502)) == Peer("127.0.0.2", 0)
    assert book.inward(Peer("127.0.0.1", 1502), ()) == Peer("10.0.0.1", 502)
    assert book.inward(Peer("127.0.0.1", 4000), ()) == Peer("127.0.0.1", 4000)
    assert book.inward(Peer("127.0.0.2", 4000), ()) == Peer("10.0.0.2", 4000)
    assert book.inward(Peer("127.0.0.2", 4000), {"10.0.0.2"}) == Peer("10.0.0.9", 4000)


def test_the_tap_hears_the_programs_addresses(network: TcpNetwork, device: Device) -> None:
    heard: list[tuple[TapKind, Peer, Peer, bool, bytes]] = []
    network.tap = lambda now_ns, address, h: heard.append((h.kind, h.local, h.remote, h.out, h.data))
    link, line = opened(network, device)
    link.submit([Send(1, b"\1\2")], now_ns())
    line.sendall(b"\3")
    assert data_of(until_last(link, Received)) == b"\3"
    assert line.recv(2) == b"\1\2"
    link.submit([Close(1)], now_ns())
    line.close()
    until(link, lambda events: len(heard) == 6)
    here = Peer(UNIT, heard[0][1].port)
    assert heard == [
        (TapKind.SYN, here, SERVER, True, b""),
        (TapKind.OPEN, here, SERVER, True, b""),
        (TapKind.DATA, here, SERVER, True, b"\1\2"),
        (TapKind.DATA, here, SERVER, False, b"\3"),
        (TapKind.FIN, here, SERVER, True, b""),
        (TapKind.FIN, here, SERVER, False, b""),
    ]


def test_wait(network: TcpNetwork, device: Device) -> None:
    link, line = opened(network, device)
    assert not network.wait(0)
    assert not network.wait(-1)
    line.sendall(b"x")
    assert network.wait(BOUND_S)
    link.submit([Close(1, reset=True)], now_ns())
    assert network.wait(BOUND_S)  # an answer that waits to be fetched
    assert link.events(now_ns()) == [Closed(1)]


@each_of(("number", "timeout_s", "ready", "asked"), [
    (5, 0.0025, False, [("selector", 0.002), ([5], 0.0005)]), (5, 0.0025, True, [("selector", 0.002)]),
    (5, 0.0005, False, [([5], 0.0005)]), (None, 0.0005, False, [("selector", 0.0005)]), (None, 0.0, True, [("selector", 0.0)])])
def test_what_is_finer_than_a_millisecond_is_waited_for_by_select(number: int | None, timeout_s: float, ready: bool,
                                                                  asked: list[tuple[object, float]]) -> None:
    """Of a selector that has a file number; others take all of it."""
    seen: list[tuple[object, float]] = []

    def selected(selector: object, timeout_s: float) -> list[object]:
        seen.append(("selector", timeout_s))
        return [selector] if ready else []

    def select(reading: list[int], _writing: object, _failing: object, timeout_s: float) -> tuple[list[int], ...]:
        seen.append((reading, timeout_s))
        return [], [], []

    network = TcpNetwork()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fbvm.net.switchboard.host.select", selected)
        patch.setattr("fbvm.net.switchboard.select.select", select)
        network._number = number
        assert network.wait(timeout_s) is ready
    network.close()
    assert seen == [(whom, pytest.approx(timeout_s)) for whom, timeout_s in asked]


def test_of_a_connection_that_has_ended_on_both_sides_nothing_is_left(network: TcpNetwork, device: Device) -> None:
    """Else it would be reset when its time is over."""
    heard: list[TapKind] = []
    network.tap = lambda now_ns, unit, event: heard.append(event.kind)
    link, line = opened(network, device)
    link.submit([Close(1)], now_ns())
    line.close()
    until(link, lambda events: heard.count(TapKind.FIN) == 2)
    network.serve(now_ns() + 2 * ORPHAN_LIMIT_NS)
    assert TapKind.RST not in heard


def test_a_port_that_cannot_be_used_is_told_with_its_reason(device: Device) -> None:
    told: list[Notice] = []
    door = Peer(UNIT, 502)
    network = TcpNetwork({door: ("127.0.0.1", device.port)})
    network.notices.tell = told.append
    link = network.attach(UNIT)
    link.submit([Listen(1, 502)], now_ns())
    assert until(link, bool) == [Failed(1, "open", "EADDRINUSE")]
    assert told == [Notice(NoticeKind.UNUSABLE, door, Peer("127.0.0.1", device.port), "somebody else listens there")]
    network.close()


def test_who_drives_a_network_asks_the_host_once_for_all(network: TcpNetwork, device: Device) -> None:
    link, line = opened(network, device)
    network.attach("192.168.250.3")
    network.driven = True
    line.sendall(b"x")
    assert network.wait(BOUND_S)
    assert link.events(now_ns()) == []
    assert network.serve(now_ns()) == [link]
    assert link.events(now_ns()) == [Received(1, b"x")]
    assert network.serve(now_ns()) == []


def test_a_link_is_quiet_only_while_somebody_keeps_an_eye_on_the_host(network: TcpNetwork, device: Device) -> None:
    link, line = opened(network, device)
    assert (link.events(now_ns()), link.is_quiet) == ([], False)
    network.driven = True
    assert (link.events(now_ns()), link.is_quiet) == ([], True)
    refreshes = link.refreshes
    assert (link.events(now_ns()), link.refreshes) == ((), refreshes + 1), "a refresh without events counts, too"
    link.submit([Grant(1, 50)], now_ns())
    assert (link.is_quiet, list(link.events(now_ns()))) == (True, [])
    link.submit([Send(1, b"x")], now_ns())
    assert (link.is_quiet, list(link.events(now_ns())), link.is_quiet) == (False, [Sent(1, 1)], True)
    network.driven = False
    line.sendall(b"y")
    assert not link.is_quiet
    assert until_last(link, Received) == [Received(1, b"y")]
    link.submit([Close(1)], now_ns())
    assert (list(link.events(now_ns())), link.is_quiet) == ([Closed(1)], False)
    line.close()
    until(link, lambda events: link.is_quiet)  # the old connection has ended on both sides
    assert link.events(now_ns()) == ()


def test_wrong_use(network: TcpNetwork, device: Device) -> None:
    link, _ = opened(network, device)
    with pytest.raises(ValueError, match="channel 1"):
        link.submit([Connect(1, SERVER)], now_ns())
    with pytest.raises(ValueError, match="attached already"):
        network.attach(UNIT)
    network.close()
    network.close()
    assert network.wait(0) and network.serve(now_ns()) == []
    link.submit([Send(1, b""), Close(1), Connect(1, SERVER)], now_ns())
    assert link.events(now_ns()) == [Failed(1, "send", "ENOTCONN"), Closed(1), Failed(1, "open", "ENETDOWN")]


def test_why_a_port_cannot_be_used_is_said_in_words() -> None:
    said = {errno.EADDRINUSE: "somebody else listens there", errno.EADDRNOTAVAIL: "it is not an address of this host",
            errno.EMFILE: "too many open files"}  # fmt: skip
    assert {number: why_unusable(OSError(number, "Too many open files")) for number in said} == said
    assert why_unusable(OSError("Not today")) == "not today"


def test_the_selector_is_closed_with_the_network() -> None:
    network = TcpNetwork()
    network.attach(UNIT)
    network.close()
    assert network._selector.get_map() is None
    assert network.links == {}


def test_a_door_at_every_address_is_known_by_that_of_this_host() -> None:
    network = TcpNetwork()
    network.own("tcp", Peer("0.0.0.0", 5000), SERVER)
    network.own("tcp", Peer("127.0.0.2", 5001), SERVER)
    assert [network.inward("tcp", Peer(host, port)) == SERVER for host, port in (
        ("127.0.0.1", 5000), ("127.0.0.2", 5001), ("127.0.0.1", 5001))] == [True, True, False]  # fmt: skip
    network.own("tcp", Peer("0.0.0.0", 5000), None)
    assert network.inward("tcp", Peer("127.0.0.1", 5000)) != SERVER
    network.close()


def test_a_unit_that_listens_at_every_address_is_called_at_that_of_this_host() -> None:
    hosts = {UNIT: "0.0.0.0", "10.0.0.8": "127.0.0.2"}
    network = TcpNetwork({Peer(host, 0): (real, 5000 + number) for number, (host, real) in enumerate(hosts.items())})
    for host in hosts:
        network.attach(host)
    assert [network.outward(Peer(host, 2000)) for host in (*hosts, "10.0.0.9")] == [
        Peer("127.0.0.1", 5000), Peer("127.0.0.2", 5001), Peer("10.0.0.9", 2000)]  # fmt: skip
    network.close()
