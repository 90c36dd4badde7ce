"""Serves one client: bytes of a pipe or a connection in, bytes out.  A thread reads, so that `pause` is heard while it runs."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from contextlib import suppress

from fbvm.dap.adapter import Adapter
from fbvm.dap.framing import Framer, FramingError, Message, encode
from fbvm.dap.target import Opener
from fbvm.run.slices import Slices

MEANWHILE_S = 0.02
Connection = tuple[Callable[[], bytes], Callable[[bytes], None], Callable[[], None]]
"""How bytes are read and written, and the connection closed."""


def serve(open_target: Opener, read: Callable[[], bytes], write: Callable[[bytes], None]) -> str:
    """Serves a client until it disconnects or is gone.

    `read` waits for bytes and returns b"" at the end; `write` writes all bytes.  Returns what was wrong with the bytes that came,
    "" if nothing was."""
    return serve_until_ended(open_target, read, write)[0]


def serve_until_ended(open_target: Opener, read: Callable[[], bytes], write: Callable[[bytes], None],
                      meanwhile: Callable[[], bool] | None = None) -> tuple[str, bool]:  # fmt: skip
    """Does what `serve` does; the second result is True if the client wants what is debugged to end.

    `meanwhile` is called every 20 ms or so, whether or not something runs; when it returns True, the client is left."""
    waiting: queue.SimpleQueue[bytes] = queue.SimpleQueue()

    def reading() -> None:
        data = b"-"
        while data:
            try:
                data = read()
            except (OSError, ValueError):
                data = b""
            waiting.put(data)

    def send(message: Message) -> None:
        write(encode(message))

    adapter, framer = Adapter(open_target, send), Framer()
    slices = Slices(adapter.work, adapter.tell_progress)
    threading.Thread(target=reading, daemon=True).start()
    try:
        while not adapter.ended:
            if meanwhile and meanwhile():
                return "", False
            if adapter.is_running and waiting.empty():
                slices.slice()
                continue
            try:
                data = waiting.get(timeout=MEANWHILE_S if meanwhile else None)
            except queue.Empty:
                continue
            if not data:
                return "the client is gone in the middle of a message" if framer.is_inside else "", False
            was_running = adapter.is_running
            for message in framer.feed(data):
                adapter.receive(message)
            if adapter.is_running and not was_running:
                slices.begin()
    except FramingError as error:
        return str(error), False
    except BrokenPipeError:
        return "", False
    finally:
        if not adapter.ended:
            adapter.close()
    return "", adapter.ends_target


class DebugDoor:
    """Where a debugger attaches to a program that runs.  `accept` waits for the next connection."""

    def __init__(self, accept: Callable[[], Connection]) -> None:
        self._waiting: queue.SimpleQueue[Connection] = queue.SimpleQueue()

        def accepting() -> None:
            with suppress(OSError):
                while True:
                    self._waiting.put(accept())

        threading.Thread(target=accepting, daemon=True).start()

    @property
    def is_called(self) -> bool:
        """True if a client waits."""
        return not self._waiting.empty()

    def serve(self, open_target: Opener, meanwhile: Callable[[], bool] | None = None) -> bool:
        """Serves the client that waits, if one does, until it disconnects or `meanwhile`, which is called now and then, returns
        True; returns True if the client wants the program to end."""
        if self._waiting.empty():
            return False
        read, write, close = self._waiting.get()
        try:
            return serve_until_ended(open_target, read, write, meanwhile)[1]
        finally:
            close()


def pass_on(read: Callable[[], bytes], write: Callable[[bytes], None], receive: Callable[[], bytes],
            send: Callable[[bytes], None], end: Callable[[], None]) -> None:  # fmt: skip
    """Passes bytes from `read` to `send` and from `receive` to `write` until one of them ends.

    `end` ends the connection when `read` has ended; what `receive` raises from then on is its end.  Raises OSError."""
    has_ended = threading.Event()

    def there() -> None:
        with suppress(OSError, ValueError):
            while data := read():
                send(data)
        has_ended.set()
        end()

    threading.Thread(target=there, daemon=True).start()
    while data := _received(receive, has_ended):
        write(data)


def _received(receive: Callable[[], bytes], has_ended: threading.Event) -> bytes:
    """What `receive` returns, b"" if it fails because the connection has been ended here.  Raises OSError."""
    try:
        return receive()
    except OSError:
        if has_ended.is_set():
            return b""
        raise
