"""The protocol with an editor whose messages may be wrong: a request is answered with an error, anything else told in a line."""

from __future__ import annotations

import logging
from typing import Any

from pygls import server
from pygls.exceptions import JsonRpcException, JsonRpcInvalidRequest
from pygls.protocol import JsonRPCProtocol, LanguageServerProtocol


class Refused(JsonRpcException):
    """A request was not understood, which its answer has said."""


class Protocol(LanguageServerProtocol):
    """The protocol of pygls, with an answer to each request, also to one whose parameters are none."""

    def structure_message(self, data: dict[str, Any]) -> Any:
        """The message that an object of JSON is.  Raises JsonRpcException, which is Refused if it has been answered."""
        try:
            return super().structure_message(data)
        except JsonRpcException as error:
            if "id" not in data or "method" not in data:
                raise
            self._send_response(data["id"], error=error.to_response_error())
            raise Refused(f"{data['method']}: {error.message}") from None

    def handle_message(self, message: Any) -> None:
        """Does what a message asks for.  Raises JsonRpcInvalidRequest for JSON that is no message."""
        if not hasattr(message, "jsonrpc"):
            raise JsonRpcInvalidRequest("a message is an object with the key jsonrpc")
        if not isinstance(getattr(message, "id", None), int | str | None):
            raise JsonRpcInvalidRequest("the id of a message is an integer or a text")
        if self._shutdown and hasattr(message, "id") and hasattr(message, "method"):
            self._send_response(message.id, error=JsonRpcInvalidRequest("the server has been shut down").to_response_error())
            return
        super().handle_message(message)


def tell_in_a_line() -> None:
    """Lets the log of pygls name a message that is not understood, without the places in this program where that was noticed."""
    logging.getLogger(JsonRPCProtocol.__module__).addFilter(_is_fault)
    logging.getLogger(server.__name__).addFilter(_shortened)


def _is_fault(record: logging.LogRecord) -> bool:
    """False for a refusal, which the editor gets as an answer: nobody has to look for its place in this program."""
    is_refusal = record.exc_info and isinstance(record.exc_info[1], JsonRpcException)
    return not is_refusal and not str(record.msg).startswith("Unable to deserialize message")


def _shortened(record: logging.LogRecord) -> bool:
    if record.exc_info and record.msg == "Unable to handle message":
        record.msg, record.args = "a message of the editor is not understood: %s", (record.exc_info[1],)
        record.exc_info = None
    return True
