"""The server of pages with sockets that are none: what is written when, when it waits, and who is dropped."""

from __future__ import annotations

import selectors
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from browsers import Page, request

from fbvm.live.session import Session
from fbvm.live.sockets import MOST_BACKLOG_BYTES, LiveServer, _Browser

READ, BOTH = selectors.EVENT_READ, selectors.EVENT_READ | selectors.EVENT_WRITE


class Sock:
    """A socket that takes so many bytes at each send, None: would block; and has these pieces to be read."""

    def __init__(self, *takes: int | None, pieces: tuple[bytes | None, ...] = ()) -> None:
        self.takes, self.pieces, self.sent, self.is_closed = list(takes), list(pieces), bytearray(), False

    def send(self, data: Any) -> int:
        size = self.takes.pop(0) if self.takes else None
        if size is None:
            raise BlockingIOError
        if size < 0:
            raise BrokenPipeError
        self.sent += bytes(data[:size])
        return min(size, len(data))

    def recv(self, size: int) -> bytes:
        piece = self.pieces.pop(0) if self.pieces else None
        if piece is None:
            raise BlockingIOError
        return piece

    def close(self) -> None:
        self.is_closed = True


class Selector:
    """Notes what is waited for, and says what is ready."""

    def __init__(self) -> None:
        self.rows: list[tuple[str, Any, int]] = []
        self.ready: list[tuple[Any, int]] = []
        self.waited_s: list[float] = []

    def select(self, timeout_s: float) -> list[tuple[Any, int]]:
        self.waited_s.append(timeout_s)
        return [(SimpleNamespace(data=browser), events) for browser, events in self.ready]

    def modify(self, sock: Any, wanted: int, browser: Any) -> None:
        self.rows.append(("modify", sock, wanted))

    def unregister(self, sock: Any) -> None:
        self.rows.append(("unregister", sock, 0))

    def close(self) -> None:
        """Nothing is open."""


@pytest.fixture
def server() -> Iterator[LiveServer]:
    page = Page()
    made = LiveServer(lambda: Session(page.bench), "127.0.0.1", 0, "t", ())
    real = made._selector
    made._selector = Selector()  # type: ignore[assignment]
    yield made
    for browser in list(made._browsers):
        made._drop(browser)
    made._listener.close()
    real.close()


def browser(server: LiveServer, sock: Sock, output: bytes = b"") -> Any:
    made: Any = _Browser(sock, server.guard)  # type: ignore[arg-type]
    made.connection._out += output
    server._browsers.append(made)
    return made


def test_what_a_socket_does_not_take_is_waited_for_and_what_it_has_taken_is_not(server: LiveServer) -> None:
    sock = Sock(2, None, 1, None, 3)
    made, selector = browser(server, sock, b"abcdef"), server._selector
    for sent, rows in ((b"ab", [BOTH]), (b"abc", [BOTH]), (b"abcdef", [BOTH, READ])):
        server._write(made)
        assert (bytes(sock.sent), [row[2] for row in selector.rows]) == (sent, rows)  # type: ignore[attr-defined]
    server._write(made)
    assert len(selector.rows) == 2 and made in server._browsers  # type: ignore[attr-defined]


@pytest.mark.parametrize(("takes", "size", "ends", "is_dropped"), [
    ((None,), MOST_BACKLOG_BYTES, False, False), ((None,), MOST_BACKLOG_BYTES + 1, False, True), ((5,), 5, False, False),
    ((5,), 5, True, True), ((4, None), 5, True, False), ((-1,), 5, False, True),
])  # fmt: skip
def test_who_takes_too_little_or_is_ended_is_dropped(
    server: LiveServer, takes: tuple[int | None, ...], size: int, ends: bool, is_dropped: bool
) -> None:
    sock = Sock(*takes)
    made = browser(server, sock, bytes(size))
    made.connection.ends = ends
    server._write(made)
    assert (made not in server._browsers, sock.is_closed) == (is_dropped, is_dropped)
    assert ("unregister" in [row[0] for row in server._selector.rows]) is is_dropped  # type: ignore[attr-defined]


def test_a_socket_with_nothing_to_be_read_stays_and_one_at_its_end_goes_when_all_is_written(server: LiveServer) -> None:
    silent, ended, owed = (browser(server, Sock(pieces=pieces), output) for pieces, output in (
        ((None,), b""), ((b"",), b""), ((b"",), b"left")))  # fmt: skip
    for made in (silent, ended, owed):
        server._read(made)
    assert server._browsers == [silent, owed]


def test_events_of_a_browser_that_is_gone_are_left_alone_and_those_who_say_nothing_count(server: LiveServer) -> None:
    one, gone = browser(server, Sock(pieces=(request(upgrade=False),))), browser(server, Sock())
    server._browsers.remove(gone)
    server._selector.ready = [(gone, BOTH), (one, selectors.EVENT_WRITE)]  # type: ignore[attr-defined]
    assert server.serve(0) and one.rounds == 1 and gone.rounds == 0
    assert one.sock.pieces, "it may be written to only"
    server._selector.ready = []  # type: ignore[attr-defined]
    assert not server.serve(0) and one.rounds == 2


def test_nobody_is_waited_for_longer_than_was_said(server: LiveServer) -> None:
    for wait_ns in (-5, 0, 20_000_000):
        server.serve(wait_ns)
    assert server._selector.waited_s == [0, 0, 0.02]  # type: ignore[attr-defined]


def test_pages_that_are_open_get_new_sessions_and_the_old_ones_are_ended(server: LiveServer) -> None:
    told: list[str] = []
    page, file = browser(server, Sock()), browser(server, Sock())
    page.session = SimpleNamespace(end=lambda: told.append("end"))
    server._new_session = lambda: SimpleNamespace(begin_again=lambda: told.append("begin again"), end=lambda: None)  # type: ignore
    old = page.session
    server.renew_sessions()
    assert told == ["end", "begin again"] and page.session is not old and file.session is None


def test_pages_without_a_session_or_with_something_unsent_get_no_update(server: LiveServer) -> None:
    asked: list[str] = []

    def session(name: str, text: str | None) -> Any:
        return SimpleNamespace(update=lambda now_ns, is_late: asked.append(name) or text, end=lambda: None, is_behind=False)

    first, second, third, fourth = (browser(server, Sock(100, 100), output) for output in (b"", b"", b"x", b""))
    second.session, third.session, fourth.session = session("second", "said"), session("third", "said"), session("fourth", None)
    second.connection.send = lambda text: second.connection._out.extend(text.encode())
    server.update(0, lambda: False)
    assert asked == ["second", "fourth"] and server._browsers == [first, third, fourth, second]
    assert b"said" in second.sock.sent and not third.sock.sent
    asked.clear()
    server.update(0, lambda: True)
    assert asked == ["fourth"], "time was up behind the first who had a turn"


def test_pages_are_told_the_end_and_those_who_do_not_take_it_are_dropped(server: LiveServer) -> None:
    takes, full = browser(server, Sock(1000)), browser(server, Sock(None), b"left")
    server._selector.rows.clear()  # type: ignore[attr-defined]
    for made in (takes, full):
        made.connection.close(reason="fbvm has ended")
    listener = server._listener
    server.close()
    assert server._browsers == [] and takes.sock.is_closed and full.sock.is_closed and listener.fileno() == -1
