"""Whoever looks after a server is told of callers that wait for a socket, and of nobody who is let in soon."""

from __future__ import annotations

import socket

import pytest

from fbvm.net.notices import Notice, NoticeKind
from fbvm.net.tcp import TcpNetwork
from fbvm.wire.link import Close, Grant, Listen, Opened, Peer

MS = 1_000_000
DOOR = Peer("192.168.250.2", 502)


def test_the_second_client_of_a_full_table_is_told() -> None:
    network = TcpNetwork({DOOR: ("127.0.0.1", 0)}, backlog=True)
    told: list[Notice] = []
    network.notices.tell = told.append
    link, where = network.attach(DOOR.host), network.host_endpoint(DOOR)

    def scans(first: int, count: int) -> None:
        for scan in range(first, first + count):
            link.events(scan * 10 * MS)

    link.submit([Listen(1, 502), Grant(1, 99)], 0)
    with socket.create_connection((where.host, where.port), 5), socket.create_connection((where.host, where.port), 5):
        scans(0, 40)
        assert [notice.kind for notice in told] == [NoticeKind.LISTENING], "not before half a second"
        scans(40, 30)
        assert [notice.kind for notice in told] == [NoticeKind.LISTENING, NoticeKind.FULL]
        assert told[1].endpoint == DOOR
        scans(70, 200)
        assert len(told) == 2, "each caller that waits once"
        link.submit([Close(1), Listen(1, 502), Grant(1, 99)], 2_700 * MS)
        scans(270, 100)
        assert len(told) == 2, "the second one has the socket now"
    network.close()


def test_a_caller_who_is_let_in_soon_is_no_news() -> None:
    network = TcpNetwork({DOOR: ("127.0.0.1", 0)}, backlog=True)
    told: list[Notice] = []
    network.notices.tell = told.append
    link, where = network.attach(DOOR.host), network.host_endpoint(DOOR)
    link.submit([Listen(1, 502), Grant(1, 99)], 0)
    with socket.create_connection((where.host, where.port), 5), socket.create_connection((where.host, where.port), 5):
        for scan in range(100):
            link.events(scan * 10 * MS)
            if scan == 10:
                link.submit([Close(1), Listen(1, 502), Grant(1, 99)], scan * 10 * MS)
    assert [notice.kind for notice in told] == [NoticeKind.LISTENING]
    network.close()


@pytest.mark.parametrize("stays", [True, False])
def test_who_came_beside_the_last_caller_is_let_in_by_the_next_socket_unless_gone_by_then(stays: bool) -> None:
    network = TcpNetwork({DOOR: ("127.0.0.1", 0)})
    link, where = network.attach(DOOR.host), network.host_endpoint(DOOR)
    link.submit([Listen(1, 502), Grant(1, 99)], 0)

    def opened(now_ns: int) -> list[int]:
        """The channels that are opened within a second at most, in which nothing else has to happen."""
        found: list[int] = []
        for _ in range(100):
            found += [event.channel for event in link.events(now_ns) if isinstance(event, Opened)]
            if found or not network.wait(0.01):
                break
        return found

    with socket.create_connection((where.host, where.port), 5), socket.create_connection((where.host, where.port), 5) as second:
        assert opened(MS) == [1]
        if not stays:
            second.close()
        link.submit([Listen(2, 502), Grant(2, 99)], 2 * MS)
        assert opened(2 * MS) == ([2] if stays else [])
        if not stays:
            with socket.create_connection((where.host, where.port), 5):
                assert opened(3 * MS) == [2]
    network.close()


class Left:
    """A connection that its unit has closed; `given_up` when that was."""

    def __init__(self) -> None:
        self.sock: socket.socket | None = None
        self.given_up: list[int] = []

    def give_up(self, now_ns: int) -> None:
        self.given_up.append(now_ns)

    def end(self) -> None:
        self.given_up.append(-1)


def test_a_closed_connection_has_ten_seconds_for_its_data() -> None:
    network = TcpNetwork()
    first, second, third = Left(), Left(), Left()
    with socket.socket() as kept:
        first.sock = third.sock = kept
        for left, now_ns in ((first, 5), (second, 6), (third, 7)):
            network.adopt(left, now_ns)
        network.serve(10_000 * MS + 4)
        assert (first.given_up, second.given_up) == ([], []), "one that has ended waits behind those before it"
        network.serve(10_000 * MS + 5)
        assert (first.given_up, second.given_up, third.given_up) == ([10_000 * MS + 5], [10_000 * MS + 5], [])
    network.close()
    assert third.given_up == [-1]


def test_calls_are_made_when_they_are_due() -> None:
    network, made = TcpNetwork(), list[int]()
    for due_ns in (5, 6):
        network.call_at(due_ns, lambda due_ns=due_ns: made.append(due_ns))  # type: ignore[misc]
    network.serve(4)
    assert made == []
    network.serve(5)
    assert made == [5]
    network.serve(9)
    assert made == [5, 6]
    network.close()
