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


def serve(open_target: Opener, read: Callable[[], bytes], write: Callable[[bytes], None]) -> str:
    """Serves a client until it disconnects or is gone.

    `read` waits for bytes and returns b"" at the end; `write` writes all bytes.  Returns what was wrong with the bytes that came,
    "" if nothing was."""
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
            if adapter.is_running and waiting.empty():
                slices.slice()
                continue
            data = waiting.get()
            if not data:
                return "the client is gone in the middle of a message" if framer.is_inside else ""
            was_running = adapter.is_running
            for message in framer.feed(data):
                adapter.receive(message)
            if adapter.is_running and not was_running:
                slices.begin()
    except FramingError as error:
        return str(error)
    except BrokenPipeError:
        return ""
    finally:
        adapter.close()
    return ""


def pass_on(read: Callable[[], bytes], write: Callable[[bytes], None], receive: Callable[[], bytes],
            send: Callable[[bytes], None], close: Callable[[], None]) -> None:  # fmt: skip
    """Passes bytes from `read` to `send` and from `receive` to `write` until one of them ends.  Raises OSError."""

    def there() -> None:
        with suppress(OSError, ValueError):
            while data := read():
                send(data)
        close()

    threading.Thread(target=there, daemon=True).start()
    while data := receive():
        write(data)
