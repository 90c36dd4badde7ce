"""Streams of bytes between programs on this computer, for tools such as a debugger: not for units of a PLC."""

from __future__ import annotations

import socket
from contextlib import suppress
from types import TracebackType

RECEIVE_BYTES = 65536


class Stream:
    """A connection.  `receive` and `send` wait until they are done."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def receive(self) -> bytes:
        """The bytes that come next, b"" at the end.  Raises OSError."""
        return self._connection.recv(RECEIVE_BYTES)

    def send(self, data: bytes) -> None:
        """Sends all bytes.  Raises OSError; a BrokenPipeError if the other side is gone."""
        try:
            self._connection.sendall(data)
        except ConnectionError as error:
            raise BrokenPipeError(str(error)) from None

    def end(self) -> None:
        """Ends the connection for both sides: whoever waits in `receive` gets what has come, then b"".  For any thread; the one
        that receives calls `close`."""
        with suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Ends the connection for both sides and frees it."""
        self.end()
        self._connection.close()

    def __enter__(self) -> Stream:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()


class Listener:
    """Waits for connections at a host and port; port 0 is one that the system picks.  Raises OSError if it cannot be used."""

    def __init__(self, host: str, port: int) -> None:
        self._socket = socket.create_server((host, port))

    @property
    def port(self) -> int:
        """The port."""
        number: int = self._socket.getsockname()[1]
        return number

    def accept(self) -> Stream:
        """The next connection.  Raises OSError."""
        return Stream(self._socket.accept()[0])

    def close(self) -> None:
        """Takes no more connections."""
        self._socket.close()


def connect(host: str, port: int) -> Stream:
    """A connection to a host and port.  Raises OSError."""
    return Stream(socket.create_connection((host, port)))
