"""One connection of a browser, without its socket: bytes in, texts of messages out, and back."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from http import HTTPStatus

from websockets.frames import CloseCode, Frame, Opcode
from websockets.http11 import Request
from websockets.protocol import State
from websockets.server import ServerProtocol

from fbvm.live.files import file_response, text_response
from fbvm.live.guard import SOCKET_PATH, Guard
from fbvm.live.messages import MOST_MESSAGE_BYTES

MOST_REQUEST_BYTES = 64 << 10
"""Of an HTTP request until it is whole."""
_SILENT = logging.getLogger("fbvm.live")
_SILENT.addHandler(logging.NullHandler())
_SILENT.propagate = False


class Connection:
    """A browser's connection: an HTTP request for a file of the page, or a WebSocket.

    `receive` takes what came and returns the texts of whole messages; `taken` are the bytes to be sent.  Nothing that a browser
    sends raises anything."""

    def __init__(self, guard: Guard) -> None:
        self._guard = guard
        self._protocol = ServerProtocol(max_size=MOST_MESSAGE_BYTES, logger=_SILENT)
        self._out = bytearray()
        self._text: bytearray | None = None
        """Of a text in several frames what has come; bytes, since there is no bound to how many frames are empty."""
        self._request_bytes = 0
        self.is_open = False
        """True between the handshake of a WebSocket and its end."""
        self.ends = False
        """True if the connection is to be closed as soon as `taken` has been sent."""

    @property
    def has_output(self) -> bool:
        """True if there are bytes to be sent."""
        return bool(self._out)

    @property
    def output(self) -> memoryview:
        """The bytes to be sent."""
        return memoryview(bytes(self._out))

    def sent(self, size: int) -> None:
        """So many bytes of `output` have been sent."""
        del self._out[:size]

    def receive(self, data: bytes) -> list[str]:
        """Takes bytes of the browser, b"" for the end; returns the texts of the messages that are whole now."""
        protocol = self._protocol
        if self.ends:
            return []
        if data:
            protocol.receive_data(data)
        else:
            protocol.receive_eof()
        if not self.is_open:
            self._request_bytes += len(data)
        texts = list(self._texts())
        if not self.is_open and not self.ends and (not data or self._request_bytes > MOST_REQUEST_BYTES):
            self.ends = True
        self._flush()
        return texts

    def send(self, text: str) -> None:
        """Sends a message."""
        if self.is_open:
            self._protocol.send_text(text.encode())
            self._flush()

    def close(self, code: CloseCode = CloseCode.GOING_AWAY, reason: str = "") -> None:
        """Ends the WebSocket with a reason."""
        if self.is_open and self._protocol.state is State.OPEN:
            self._protocol.send_close(code, reason)
        self._flush()
        self.is_open, self.ends = False, True

    def _texts(self) -> Iterator[str]:
        for event in self._protocol.events_received():
            if isinstance(event, Request):
                self._answer(event)
            elif isinstance(event, Frame):
                yield from self._frame(event)

    def _frame(self, frame: Frame) -> Iterator[str]:
        if frame.opcode is Opcode.TEXT:
            self._text = bytearray()
        if frame.opcode in (Opcode.TEXT, Opcode.CONT) and (data := self._text) is not None:
            data += frame.data
            if frame.fin:
                self._text = None
                try:
                    yield data.decode()
                except UnicodeDecodeError:
                    self._protocol.fail(CloseCode.INVALID_DATA, "a text is UTF-8")
        elif frame.opcode in (Opcode.BINARY, Opcode.CONT):
            self._protocol.fail(CloseCode.UNSUPPORTED_DATA, "messages are texts")

    def _answer(self, request: Request) -> None:
        """Answers the HTTP request of a connection: with a file, or with the handshake of a WebSocket."""
        headers = request.headers
        refused = self._guard.refusal(request.path, headers.get_all("Host"), headers.get_all("Origin"))
        if refused:
            self._protocol.send_response(text_response(*refused))
        elif request.method != "GET":
            self._protocol.send_response(text_response(HTTPStatus.METHOD_NOT_ALLOWED, "only GET is served"))
        elif request.path.partition("?")[0] == SOCKET_PATH:
            response = self._protocol.accept(request)
            self._protocol.send_response(response)
            self.is_open = response.status_code == HTTPStatus.SWITCHING_PROTOCOLS
        else:
            self._protocol.send_response(file_response(request.path, self._guard.headers))
        if not self.is_open:
            self.ends = True

    def _flush(self) -> None:
        """Takes what the protocol wants to send; an empty piece is its wish to end the connection."""
        for piece in self._protocol.data_to_send():
            if piece:
                self._out += piece
            else:
                self.ends = True
        if self._protocol.state in (State.CLOSING, State.CLOSED) and self.is_open:
            self.is_open, self.ends = False, True
