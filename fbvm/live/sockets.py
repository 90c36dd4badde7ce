"""The sockets of browsers: accepted, read and written without ever blocking, between scans."""

from __future__ import annotations

import selectors
import socket
from collections.abc import Callable, Sequence
from contextlib import suppress

from fbvm.live.connection import Connection
from fbvm.live.guard import Guard
from fbvm.live.session import Session

MOST_CONNECTIONS = 32
"""Connections at a time.  A further one takes the place of the oldest that has not finished its request; without one it is
refused."""
READ_BYTES = 64 << 10
MOST_BACKLOG_BYTES = 4 << 20
"""What may wait for a browser that does not read; then its connection is ended."""
IDLE_SERVES = 3000
"""A connection that has not finished its request after so many rounds of the loop is ended: a minute at rest."""


class _Browser:
    """A connection with its socket, and the session of its WebSocket."""

    def __init__(self, sock: socket.socket, guard: Guard) -> None:
        self.sock, self.connection = sock, Connection(guard)
        self.session: Session | None = None
        self.rounds = 0
        self.wanted = selectors.EVENT_READ


class LiveServer:
    """Serves the page and its sessions at `bind` and `port`; port 0 is any free one.  Raises OSError if it cannot be used.

    `new_session` is called for each WebSocket."""

    def __init__(self, new_session: Callable[[], Session], bind: str = "127.0.0.1", port: int = 0,
                 token: str | None = None, frames: Sequence[str] = ()) -> None:  # fmt: skip
        self._new_session = new_session
        self._selector = selectors.DefaultSelector()
        self._listener = socket.create_server((bind, port), backlog=16)
        self._listener.setblocking(False)
        self._selector.register(self._listener, selectors.EVENT_READ, None)
        self._browsers: list[_Browser] = []
        self.guard = Guard(self._listener.getsockname()[1], bind, token, frames)

    @property
    def sessions(self) -> list[Session]:
        """The sessions of open pages."""
        return [browser.session for browser in self._browsers if browser.session]

    def serve(self, wait_ns: int) -> bool:
        """Handles every socket that is ready, after at most `wait_ns`; True if there was one."""
        ready = self._selector.select(max(0, wait_ns) / 1e9)
        for key, events in ready:
            if key.data is None:
                self._accept()
                continue
            browser: _Browser = key.data
            if browser not in self._browsers:  # it has made room for another
                continue
            if events & selectors.EVENT_READ:
                self._read(browser)
            if browser in self._browsers:
                self._write(browser)
        for browser in [browser for browser in self._browsers if browser.session is None]:
            browser.rounds += 1
            if browser.rounds > IDLE_SERVES:
                self._drop(browser)
        return bool(ready)

    @property
    def is_behind(self) -> bool:
        """True if an update or a reply has been begun and waits for time to go on."""
        return any(session.is_behind for session in self.sessions)

    def update(self, now_ns: int, is_late: Callable[[], bool]) -> None:
        """Sends pages what has changed, if they have taken the update before, until `is_late` says that time is up; who had no
        turn then is the first at the next call."""
        for browser in list(self._browsers):
            session = browser.session if not browser.connection.has_output else None
            if session is None:
                continue
            if (text := session.update(now_ns, is_late)) is not None:
                browser.connection.send(text)
                self._write(browser)
                if browser in self._browsers:  # behind all others
                    self._browsers.remove(browser)
                    self._browsers.append(browser)
            if is_late():
                return

    def renew_sessions(self) -> None:
        """Gives each page a new session, and lets it begin again."""
        for browser in self._browsers:
            if browser.session:
                browser.session.end()
                browser.session = self._new_session()
                browser.session.begin_again()

    def close(self) -> None:
        """Ends all connections."""
        for browser in list(self._browsers):
            browser.connection.close(reason="fbvm has ended")
            self._write(browser)
            if browser in self._browsers:
                self._drop(browser)
        self._selector.unregister(self._listener)
        self._listener.close()
        self._selector.close()

    def _accept(self) -> None:
        while True:
            try:
                sock, _ = self._listener.accept()
            except OSError:
                return
            if len(self._browsers) >= MOST_CONNECTIONS:
                waiting = next((browser for browser in self._browsers if browser.session is None), None)
                if waiting is None:
                    sock.close()
                    continue
                self._drop(waiting)
            sock.setblocking(False)
            with suppress(OSError):
                sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            browser = _Browser(sock, self.guard)
            self._browsers.append(browser)
            self._selector.register(sock, browser.wanted, browser)

    def _read(self, browser: _Browser) -> None:
        try:
            data = browser.sock.recv(READ_BYTES)
        except BlockingIOError:
            return
        except OSError:
            self._drop(browser)
            return
        connection = browser.connection
        texts = connection.receive(data)
        if connection.is_open and browser.session is None:
            browser.session = self._new_session()
        if browser.session:
            for text in texts:
                if (reply := browser.session.answer(text)) is not None:
                    connection.send(reply)
        if not data and not connection.has_output:
            self._drop(browser)

    def _write(self, browser: _Browser) -> None:
        connection = browser.connection
        while connection.has_output:
            try:
                connection.sent(browser.sock.send(connection.output))
            except BlockingIOError:
                break
            except OSError:
                self._drop(browser)
                return
        if connection.has_output and len(connection.output) > MOST_BACKLOG_BYTES or connection.ends and not connection.has_output:
            self._drop(browser)
            return
        wanted = selectors.EVENT_READ | selectors.EVENT_WRITE if connection.has_output else selectors.EVENT_READ
        if wanted != browser.wanted:
            browser.wanted = wanted
            self._selector.modify(browser.sock, wanted, browser)

    def _drop(self, browser: _Browser) -> None:
        self._browsers.remove(browser)
        self._selector.unregister(browser.sock)
        browser.sock.close()
        if browser.session:
            browser.session.end()
