"""A host that connects at once, as some do with themselves: the connection opens as any other does."""

from __future__ import annotations

import errno
import socket
import time
from collections.abc import Iterator

import pytest
from rows import each_of

from fbvm.net.notices import Notice, NoticeKind
from fbvm.net.tcp import TcpNetwork
from fbvm.net.udp import HostChannel
from fbvm.wire.link import Connect, Event, Failed, Opened, Peer
from fbvm.wire.tap import TapEvent, TapKind

SERVER = Peer("192.168.250.1", 502)
BOUND_S = 10.0


class Instant:
    """A socket whose connect is over when it returns, with a code if it is told one."""

    def __init__(self, sock: socket.socket, code: int | None) -> None:
        self._sock, self._code = sock, code

    def __getattr__(self, name: str) -> object:
        return getattr(self._sock, name)

    def connect_ex(self, where: tuple[str, int]) -> int:
        self._sock.settimeout(BOUND_S)
        self._sock.connect(where)
        self._sock.setblocking(False)
        return self._code or 0


@pytest.fixture
def door() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as door:
        yield door


@each_of(("code", "wanted"), [
    (0, [Opened]), (errno.EINPROGRESS, [Opened]), (errno.EWOULDBLOCK, [Opened]),
    (errno.EHOSTUNREACH, [Failed]), (errno.ECONNREFUSED, [Failed]), (1, [Failed]), (errno.EISCONN, [Failed]),
])  # fmt: skip
def test_what_the_host_says_of_a_connect_is_what_the_unit_is_told(
    monkeypatch: pytest.MonkeyPatch, door: socket.socket, code: int, wanted: list[type[Event]]
) -> None:
    make = HostChannel.make
    monkeypatch.setattr(HostChannel, "make", lambda self, kind, bind: instant(self, make(self, kind, bind), code))
    told: list[TapEvent] = []
    noted: list[Notice] = []
    network = TcpNetwork({SERVER: ("127.0.0.1", door.getsockname()[1])})
    try:
        network.tap = lambda now_ns, host, event: told.append(event)
        network.notices.tell = noted.append
        link = network.attach("192.168.250.2")
        link.submit([Connect(1, SERVER, 0)], 0)
        events: list[Event] = []
        until_s = time.monotonic() + BOUND_S
        while not events and time.monotonic() < until_s:
            network.wait(0.01)
            network.serve(1)
            events += link.events(1)
    finally:
        network.close()
    assert [type(event) for event in events] == wanted
    if isinstance(events[0], Failed):
        assert events[0].error == errno.errorcode[code]
        refusals = [(TapKind.RST, False)] if code == errno.ECONNREFUSED else []
        assert [(event.kind, event.out) for event in told] == [(TapKind.SYN, True), *refusals]
        assert [(row.kind, row.endpoint, row.error) for row in noted] == [
            (NoticeKind.UNREACHED, SERVER, errno.errorcode[code])]
    else:
        assert [(event.kind, event.out) for event in told] == [(TapKind.SYN, True), (TapKind.OPEN, True)] and noted == []


def instant(channel: HostChannel, sock: socket.socket, code: int) -> socket.socket:
    channel.sock = made = Instant(sock, code)  # type: ignore[assignment]
    return made  # type: ignore[return-value]
