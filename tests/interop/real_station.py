"""A station of the network in memory, placed on a real TCP port of 127.0.0.1: what misbehaves there misbehaves here."""

from __future__ import annotations

import heapq
import itertools
import selectors
import socket
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from fbvm.net.peers import Action, Actions, Conversation, Fin, Leave, Reset, Say, Station
from fbvm.wire.link import Peer

RST_ON_CLOSE = struct.pack("ii", 1, 0)
TICK_S = 0.02


class RealStation:
    """Serves a station in a thread of its own, one selector, until `close`.  Delays are divided by `haste`."""

    def __init__(self, station: Station, haste: float = 1.0) -> None:
        self.station = station
        self.haste = haste
        self.listener = socket.create_server(("127.0.0.1", 0), backlog=16)
        self.listener.setblocking(False)
        self.port = self.listener.getsockname()[1]
        self._selector = selectors.DefaultSelector()
        self._selector.register(self.listener, selectors.EVENT_READ, None)
        self._due: list[tuple[int, int, _Caller, Action]] = []
        self._count = itertools.count()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def close(self) -> None:
        self._stop.set()
        self._thread.join(10)
        for key in list(self._selector.get_map().values()):
            key.fileobj.close()  # type: ignore[union-attr]
        self._selector.close()

    def _serve(self) -> None:
        while not self._stop.is_set():
            for key, _ in self._selector.select(TICK_S if not self._due else 0.001):
                if key.data is None:
                    self._accept()
                else:
                    self._read(key.data)
            now_ns = time.monotonic_ns()
            while self._due and self._due[0][0] <= now_ns:
                _, _, caller, action = heapq.heappop(self._due)
                caller.do(action)

    def _accept(self) -> None:
        conn, name = self.listener.accept()
        conversation = self.station.accept(Peer(*name))
        if conversation is None:
            conn.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RST_ON_CLOSE)
            conn.close()
            return
        caller = _Caller(conn, conversation, self._selector)
        self._selector.register(conn, selectors.EVENT_READ, caller)
        self.plan(caller, conversation.connected(time.monotonic_ns()))

    def _read(self, caller: _Caller) -> None:
        if not caller.conversation.reads:
            time.sleep(0.001)
            return
        try:
            data = caller.sock.recv(65536)
        except OSError:
            caller.end()
            return
        now_ns = time.monotonic_ns()
        if data:
            self.plan(caller, caller.conversation.received(data, now_ns))
        else:
            self.plan(caller, caller.conversation.peer_closed(now_ns))

    def plan(self, caller: _Caller, actions: Actions) -> None:
        now_ns = time.monotonic_ns()
        for action in actions:
            if action.after_ns:
                due_ns = now_ns + int(action.after_ns / self.haste)
                heapq.heappush(self._due, (due_ns, next(self._count), caller, action))
            else:
                caller.do(action)


class _Caller:
    def __init__(self, sock: socket.socket, conversation: Conversation, selector: selectors.BaseSelector) -> None:
        self.sock = sock
        self.conversation = conversation
        self._selector = selector
        sock.settimeout(0.2)

    def do(self, action: Action) -> None:
        with suppress(OSError):
            match action:
                case Say(data):
                    self.sock.sendall(data)
                case Fin():
                    self.sock.shutdown(socket.SHUT_WR)
                case Leave():
                    self.end()
                case Reset():
                    self.sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, RST_ON_CLOSE)
                    self.end()

    def end(self) -> None:
        if self.sock.fileno() >= 0:
            self._selector.unregister(self.sock)
            self.sock.close()


@contextmanager
def real(station: Station, haste: float = 1.0) -> Iterator[int]:
    """The port of a station."""
    served = RealStation(station, haste)
    try:
        yield served.port
    finally:
        served.close()


@contextmanager
def black_hole() -> Iterator[int]:
    """A port of 127.0.0.1 that leaves every wish for a connection unanswered: its queue of callers is full (Linux)."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen(0)
        where = listener.getsockname()
        callers = [socket.socket() for _ in range(8)]
        try:
            for caller in callers:
                caller.setblocking(False)
                caller.connect_ex(where)
            yield where[1]
        finally:
            for caller in callers:
                caller.close()


@contextmanager
def closed_port() -> Iterator[int]:
    """A port at which nobody listens."""
    with socket.socket() as keeper:
        keeper.bind(("127.0.0.1", 0))
        yield keeper.getsockname()[1]
