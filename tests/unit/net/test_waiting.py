"""Whoever looks after a server is told of callers that wait for a socket, and of nobody who is let in soon."""

from __future__ import annotations

import socket

from fbvm.net.notices import Notice, NoticeKind
from fbvm.net.tcp import TcpNetwork
from fbvm.wire.link import Close, Grant, Listen, Peer

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
