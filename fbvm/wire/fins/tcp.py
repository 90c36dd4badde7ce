"""FINS/TCP: messages of sixteen bytes and a body around FINS frames, cut out of a stream.  From W421 7-4 p177-181."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum

from fbvm.wire.fins.frames import MAX_FRAME_BYTES

MAGIC = b"FINS"
HEAD_BYTES = 16
MIN_LENGTH = 8
"""Of the length field, which counts from the command on."""
MAX_LENGTH = 8 + MAX_FRAME_BYTES
_HEAD = struct.Struct(">4sIII")
_NODE = struct.Struct(">I")


class Kind(IntEnum):
    """What a message is: its command field."""

    CLIENT_NODE = 0
    """The client's node, or 0: the first message, once."""
    SERVER_NODE = 1
    """The answer: the client's node and the server's."""
    FRAME = 2
    ERROR = 3
    """A notification of an error; who gets it closes the connection."""
    CONFIRMATION = 6
    """Asks whether a connection lives; its receiver throws it away."""


class Error(IntEnum):
    """Values of the error field, W421 7-4 p178."""

    NONE = 0
    NOT_FINS = 0x01
    TOO_LONG = 0x02
    NOT_SUPPORTED = 0x03
    ALL_IN_USE = 0x20
    NODE_CONNECTED = 0x21
    NOT_PERMITTED = 0x22
    NODE_OUT_OF_RANGE = 0x23
    NODE_OF_SERVER = 0x24
    NO_NODE_LEFT = 0x25


ERRORS = {
    Error.NONE: "normal", Error.NOT_FINS: "the message does not begin with FINS", Error.TOO_LONG: "the message is too long",
    Error.NOT_SUPPORTED: "command not supported", Error.ALL_IN_USE: "all connections are in use",
    Error.NODE_CONNECTED: "the node is connected already", Error.NOT_PERMITTED: "the client's address is not permitted",
    Error.NODE_OUT_OF_RANGE: "the client's node is out of range", Error.NODE_OF_SERVER: "the client's node is that of the server",
    Error.NO_NODE_LEFT: "no node is left",
}  # fmt: skip
"""What each error says."""
BODY_BYTES = {Kind.CLIENT_NODE: (4, 4), Kind.SERVER_NODE: (8, 8), Kind.FRAME: (12, MAX_FRAME_BYTES), Kind.ERROR: (0, 0),
              Kind.CONFIRMATION: (0, 0)}  # fmt: skip
"""The least and the most bytes that the body of a message has."""


@dataclass(frozen=True, slots=True)
class Message:
    """One message: its command field (a `Kind`, or a number that is none), its error field, its body."""

    kind: int
    body: bytes = b""
    error: int = 0

    def to_bytes(self) -> bytes:
        return _HEAD.pack(MAGIC, 8 + len(self.body), self.kind, self.error) + self.body

    @property
    def node(self) -> int:
        """The first node in the body: the client's."""
        return int(_NODE.unpack_from(self.body)[0])

    @property
    def server(self) -> int:
        """The second node in the body of a server's answer: the server's."""
        return int(_NODE.unpack_from(self.body, _NODE.size)[0])

    @property
    def is_wrong(self) -> bool:
        """True if the body does not have the length of its command."""
        least, most = BODY_BYTES.get(Kind(self.kind), (0, 0)) if self.kind in list(Kind) else (0, MAX_FRAME_BYTES)
        return not least <= len(self.body) <= most


def client_node(node: int = 0) -> Message:
    """What a client sends first; node 0 asks the server for one."""
    return Message(Kind.CLIENT_NODE, _NODE.pack(node))


def server_node(client: int, server: int, error: int = 0) -> Message:
    """What the server answers to that."""
    return Message(Kind.SERVER_NODE, _NODE.pack(client) + _NODE.pack(server), error)


@dataclass(frozen=True, slots=True)
class Unreadable:
    """Bytes of the stream that are no message: which error they are.  What follows cannot be read either."""

    error: Error
    data: bytes


class Splitter:
    """Cuts a TCP stream into messages, wherever TCP cut or joined it; one for each direction of a connection.

    After bytes that are no message the stream is `broken`, and all later ones are dropped."""

    def __init__(self, held: bytes = b"", broken: bool = False) -> None:
        self._held = bytearray(held)
        self.broken = broken

    @property
    def pending(self) -> bytes:
        """The bytes of a message that is not complete."""
        return bytes(self._held)

    def feed(self, data: bytes) -> list[Message | Unreadable]:
        """Appends bytes of the stream; returns the messages that they complete, in order.

        >>> Splitter().feed(client_node(25).to_bytes())
        [Message(kind=0, body=b'\\x00\\x00\\x00\\x19', error=0)]
        """
        found: list[Message | Unreadable] = []
        if self.broken:
            return found
        held = self._held
        held += data
        while held:
            if not MAGIC.startswith(held[:4]):
                return self._break(found, Error.NOT_FINS)
            if len(held) < 8:
                break
            length = _NODE.unpack_from(held, 4)[0]
            if not MIN_LENGTH <= length <= MAX_LENGTH:
                return self._break(found, Error.TOO_LONG)
            if len(held) < 8 + length:
                break
            _, _, kind, error = _HEAD.unpack_from(held)
            found.append(Message(kind, bytes(held[HEAD_BYTES : 8 + length]), error))
            del held[: 8 + length]
        return found

    def _break(self, found: list[Message | Unreadable], error: Error) -> list[Message | Unreadable]:
        found.append(Unreadable(error, self.pending))
        self.broken = True
        self._held.clear()
        return found
