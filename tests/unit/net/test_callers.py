"""Callers of a unit on 127.0.0.1 while none of its sockets waits, or more of them than wait."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest
from test_tcp import RST_ON_CLOSE, UNIT, call, now_ns, until, until_last

from fbvm.net.tcp import TcpLink, TcpNetwork
from fbvm.wire.link import Close, Grant, Listen, Opened, Peer, Received

HERE = Peer(UNIT, 502)


@pytest.fixture
def holding() -> Iterator[TcpNetwork]:
    """A network with a backlog."""
    network = TcpNetwork({HERE: ("127.0.0.1", 0)}, backlog=True)
    yield network
    network.close()


def first_opened(link: TcpLink) -> Peer:
    """Who is let in next."""
    opened = until_last(link, Opened)[-1]
    assert isinstance(opened, Opened)
    return opened.remote


def test_callers_wait_with_a_backlog(holding: TcpNetwork) -> None:
    """They are let in one after the other, in order, whenever a socket of the unit waits."""
    link = holding.attach(UNIT)
    link.submit([Listen(1, 502)], now_ns())
    callers = [call(holding, HERE) for _ in range(4)]
    callers[2].sendall(b"said while it waits")
    assert first_opened(link) == Peer(*callers[0].getsockname())
    assert link.events(now_ns()) == []
    link.submit([Close(1), Listen(1, 502), Listen(2, 502), Grant(1, 100), Grant(2, 100)], now_ns())
    events = until(link, lambda events: any(isinstance(event, Received) for event in events))
    assert [event.remote for event in events if isinstance(event, Opened)] == [
        Peer(*caller.getsockname()) for caller in callers[1:3]
    ]  # fmt: skip
    assert events[-1] == Received(2, b"said while it waits")
    with pytest.raises(TimeoutError):  # neither refused nor reset
        callers[3].settimeout(0.02)
        callers[3].recv(1)
    link.submit([Listen(3, 502)], now_ns())
    assert first_opened(link) == Peer(*callers[3].getsockname())
    for caller in callers:
        caller.close()
    holding.close()
    with pytest.raises(ConnectionRefusedError):
        call(holding, HERE)


def test_who_has_left_is_not_let_in(holding: TcpNetwork) -> None:
    link = holding.attach(UNIT)
    link.submit([Listen(1, 502)], now_ns())
    first = call(holding, HERE)
    assert first_opened(link) == Peer(*first.getsockname())
    leaving, resetting, half_closed = (call(holding, HERE) for _ in range(3))
    leaving.close()
    resetting.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RST_ON_CLOSE)
    resetting.close()
    half_closed.sendall(b"ask")
    half_closed.shutdown(socket.SHUT_WR)
    link.submit([Listen(2, 502)], now_ns())
    assert first_opened(link) == Peer(*half_closed.getsockname())
    first.close()
    half_closed.close()


@pytest.mark.parametrize("listeners", [1, 3])
def test_callers_of_the_same_moment_are_not_reset_without_a_backlog(listeners: int) -> None:
    """As many are let in as there are listeners; others who came before that wait, and who comes later is refused."""
    network = TcpNetwork({HERE: ("127.0.0.1", 0)})
    link = network.attach(UNIT)
    link.submit([Listen(channel, 502) for channel in range(1, listeners + 1)], now_ns())
    callers = [call(network, HERE) for _ in range(5)]
    names = [Peer(*caller.getsockname()) for caller in callers]
    opened = until(link, lambda events: len(events) == listeners)
    assert [event.remote for event in opened if isinstance(event, Opened)] == names[:listeners]
    with pytest.raises(ConnectionRefusedError):
        call(network, HERE)
    for channel, name in enumerate(names[listeners:], listeners + 1):
        link.submit([Listen(channel, 502)], now_ns())
        assert first_opened(link) == name
    for caller in callers:
        caller.close()
    network.close()
