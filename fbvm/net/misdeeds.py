"""Misbehaviour of a Modbus server, by name, to test clients.

`MISDEEDS` are wrong replies: each takes the right reply frame and returns the actions that replace it, as in
`ModbusPeer(reply=MISDEEDS["wrong unit"])`.  `RUDE_PEERS` are servers that misbehave as a whole:
`network.place(endpoint, RUDE_PEERS["closes between requests"](server))`.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Sequence
from weakref import WeakSet

from fbvm.net.peers import Action, Actions, Conversation, Fin, Leave, ModbusPeer, Reset, Say, Station, keep
from fbvm.wire.link import Peer
from fbvm.wire.modbus_server import ModbusServer

LATE_NS = 60_000_000_000
"""Later than any client waits."""
NEXT_NS = 6_000_000_000
"""So late that a client with a time-out of 5 s is at its next request."""
PIECE_GAP_NS = 25_000_000
"""The time between pieces: more than a scan, so that a program receives them one by one."""
FLOOD_BYTES = 20_000
GARBAGE = b"HTTP/1.1 400 Bad Request\r\n\r\n"

Reply = Callable[[bytes], Actions]


# --- wrong answers ----------------------------------------------------------------------------------------------------


def right(frame: bytes) -> Actions:
    """The right reply."""
    return (Say(frame),)


def _changed(offset: int, value: int | None = None) -> Reply:
    """The frame with one byte changed: to a value, or all its bits."""

    def reply(frame: bytes) -> Actions:
        byte = frame[offset] ^ 0xFF if value is None else value
        return (Say(frame[:offset] + bytes((byte,)) + frame[offset:][1:]),)

    return reply


def _length(change: Callable[[int], int]) -> Reply:
    """The frame with another length in its header."""
    return lambda frame: (Say(frame[:4] + change(len(frame) - 6).to_bytes(2, "big") + frame[6:]),)


def _pdu(change: Callable[[bytes], bytes]) -> Reply:
    """A whole frame with another PDU."""

    def reply(frame: bytes) -> Actions:
        pdu = change(frame[7:])
        return (Say(frame[:4] + (1 + len(pdu)).to_bytes(2, "big") + frame[6:7] + pdu),)

    return reply


def _exception(code: int) -> Reply:
    return _pdu(lambda pdu: bytes((pdu[0] | 0x80, code)))


def _part(size: Callable[[int], int], *ends: Action) -> Reply:
    """The beginning of the frame, then an end."""
    return lambda frame: (Say(frame[: size(len(frame))]), *ends)


def _more_data(pdu: bytes) -> bytes:
    """Two bytes more, counted where there is a byte count."""
    return (pdu[:1] + bytes((pdu[1] + 2 & 0xFF,)) + pdu[2:] if pdu[0] <= 0x04 else pdu) + b"\0\0"


def _other_transaction(frame: bytes) -> bytes:
    return bytes((frame[0] ^ 0x80,)) + frame[1:]


def _next_reply(frame: bytes) -> bytes:
    """A reply to the request after this one, which nobody has sent, with other data."""
    transaction = int.from_bytes(frame[:2], "big") + 1 & 0xFFFF
    return transaction.to_bytes(2, "big") + frame[2:9] + bytes(byte ^ 0xFF for byte in frame[9:])


def _next_exception(frame: bytes) -> bytes:
    return _next_reply(frame)[:4] + bytes((0, 3, frame[6], frame[7] | 0x80, 0x02))


def _fewer_data(pdu: bytes) -> bytes:
    """Two bytes less, counted where there is a byte count."""
    return pdu[:1] + bytes((max(pdu[1] - 2, 0),)) + pdu[2:-2] if pdu[0] <= 0x04 else pdu[:-2]


def _byte_by_byte(frame: bytes) -> Actions:
    return [Say(frame[at : at + 1], at * PIECE_GAP_NS) for at in range(len(frame))]


def _half(size: int) -> int:
    return size // 2


MISDEEDS: dict[str, Reply] = {
    # The right reply at another time, in pieces, or with more data.
    "late": lambda frame: (Say(frame, LATE_NS),),
    "late by one request": lambda frame: (Say(frame, NEXT_NS),),
    "two pieces": lambda frame: (Say(frame[:5]), Say(frame[5:], PIECE_GAP_NS)),
    "byte by byte": _byte_by_byte,
    "twice": lambda frame: (Say(frame + frame),),
    "again later": lambda frame: (Say(frame), Say(frame, 4 * PIECE_GAP_NS)),
    "a wrong one first": lambda frame: (Say(_other_transaction(frame) + frame),),
    "a wrong one last": lambda frame: (Say(frame + _other_transaction(frame)),),
    "garbage behind": lambda frame: (Say(frame + GARBAGE),),
    "a byte behind": lambda frame: (Say(frame + b"\0"),),
    "a frame begun behind": lambda frame: (Say(frame + _next_reply(frame)[:-2]),),
    "the next reply, too": lambda frame: (Say(frame + _next_reply(frame)),),
    "the next reply soon": lambda frame: (Say(frame), Say(_next_reply(frame), PIECE_GAP_NS)),
    "the next exception, too": lambda frame: (Say(frame + _next_exception(frame)),),
    "flood behind": lambda frame: (Say(frame + _other_transaction(frame) * (FLOOD_BYTES // len(frame))),),
    "right, then fin": lambda frame: (Say(frame), Fin()),
    "right, then closed": lambda frame: (Say(frame), Leave()),
    "right, then reset": lambda frame: (Say(frame), Reset(PIECE_GAP_NS)),
    # Frames that do not fit the request.
    "wrong transaction": _changed(1),
    "transaction swapped": lambda frame: (Say(frame[1::-1] + frame[2:]),),
    "wrong unit": _changed(6),
    "wrong function": _changed(7, 0x2B),
    "neighbour's function": _pdu(lambda pdu: bytes((pdu[0] ^ 0x01,)) + pdu[1:]),
    "wrong content": _changed(8),
    "one byte short": _pdu(lambda pdu: pdu[:-1]),
    "two bytes more": _pdu(_more_data),
    "fewer data": _pdu(_fewer_data),
    "function only": _pdu(lambda pdu: pdu[:1]),
    "exception 00": _exception(0x00),
    "illegal function": _exception(0x01),
    "server failure": _exception(0x04),
    "gateway without target": _exception(0x0B),
    "exception 0C": _exception(0x0C),
    "exception FF": _exception(0xFF),
    "another's exception": _pdu(lambda pdu: bytes((pdu[0] ^ 0x81, 0x02))),
    "exception without code": _pdu(lambda pdu: bytes((pdu[0] | 0x80,))),
    "exception with more": _pdu(lambda pdu: bytes((pdu[0] | 0x80, 0x02, 0x00))),
    # Streams that are no Modbus.
    "wrong protocol": _changed(3, 1),
    "impossible length": _changed(4),
    "length 0": _length(lambda size: 0),
    "length 1": _length(lambda size: 1),
    "length 255": _length(lambda size: 255),
    "length one less": _length(lambda size: size - 1),
    "length one more": _length(lambda size: size + 1),
    "length 254": _length(lambda size: 254),
    "garbage": lambda frame: (Say(GARBAGE),),
    "garbage first": lambda frame: (Say(GARBAGE + frame),),
    "flood": lambda frame: (Say(b"\xff" * FLOOD_BYTES),),
    # Nothing, or not all.
    "silence": lambda frame: (),
    "one byte": _part(lambda size: 1),
    "half": _part(_half),
    "all but one byte": _part(lambda size: size - 1),
    "half, the rest late": lambda frame: (Say(frame[:9]), Say(frame[9:], LATE_NS)),
    "half, then fin": _part(_half, Fin()),
    "fin": lambda frame: (Leave(),),
    "half closed": lambda frame: (Fin(),),
    "reset": lambda frame: (Reset(),),
    "half, then reset": _part(_half, Reset(PIECE_GAP_NS)),
    "one byte, then reset": _part(lambda size: 1, Reset()),
    "header, then closed": _part(lambda size: 7, Leave()),
}


def by_script(*names: str) -> Reply:
    """A reply function that performs the misdeeds of these names, one a reply ("" is the right reply), then right replies."""
    left = list(names)
    return lambda frame: MISDEEDS.get(left.pop(0) if left else "", right)(frame)


def by_seed(seed: int, chance: float = 0.5, names: Iterable[str] = MISDEEDS) -> Reply:
    """A reply function that performs a random misdeed with probability `chance`; `seed` decides which."""
    dice, choices = random.Random(seed), list(names)
    return lambda frame: (MISDEEDS[dice.choice(choices)] if dice.random() < chance else right)(frame)


# --- servers that misbehave as a whole --------------------------------------------------------------------------------


class RudePeer(ModbusPeer):
    """A Modbus server that performs `greeting` when a connection opens, and `on_bytes` instead of replying.

    `connections` is how many it takes before it refuses; `reads` False leaves all requests in the network."""

    def __init__(
        self, server: ModbusServer | None = None, reply: Reply = right, *, greeting: Sequence[Action] = (),
        on_bytes: Sequence[Action] = (), connections: int | None = None, reads: bool = True,
    ) -> None:  # fmt: skip
        super().__init__(server, reply)
        self.greeting, self.on_bytes, self.connections, self.reads = greeting, on_bytes, connections, reads
        self.callers: list[Peer] = []
        """Who has connected, the last MOST_KEPT."""
        self._accepted = 0
        self._conversations: WeakSet[_RudeConversation] = WeakSet()
        """Those whose connections are still there."""

    def accept(self, caller: Peer) -> Conversation | None:
        inner = super().accept(caller)
        if inner is None or (self.connections is not None and self._accepted >= self.connections):
            return None
        self._accepted += 1
        keep(self.callers, caller)
        conversation = _RudeConversation(self, inner)
        self._conversations.add(conversation)
        return conversation

    def reform(self) -> None:
        """Behaves rightly from now on, also on open connections."""
        self.reply, self.greeting, self.on_bytes, self.connections, self.reads = right, (), (), None, True
        for conversation in self._conversations:
            conversation.reads = True


class _RudeConversation(Conversation):
    def __init__(self, peer: RudePeer, inner: Conversation) -> None:
        self._peer = peer
        self._inner = inner
        self.reads = peer.reads

    def connected(self, now_ns: int) -> Actions:
        return self._peer.greeting

    def received(self, data: bytes, now_ns: int) -> Actions:
        return self._peer.on_bytes or self._inner.received(data, now_ns)


class _Deaf(Station):
    deaf = True


def _with_previous(combine: Callable[[bytes, bytes], bytes]) -> Reply:
    """Replies that `combine` makes of the reply to the request before, b"" for the first one, and the right reply."""
    previous = b""

    def reply(frame: bytes) -> Actions:
        nonlocal previous
        data, previous = combine(previous, frame), frame
        return (Say(data),) if data else ()

    return reply


def _every_second() -> Reply:
    numbers = iter(range(1 << 62))
    return lambda frame: (Say(frame),) if next(numbers) % 2 else ()


def _dripping(frame: bytes) -> Actions:
    """A frame that never ends: the longest there is, a byte a second."""
    return [Say(frame[:4] + b"\0\xfe"), *(Say(b"\0", second * 1_000_000_000) for second in range(1, 254))]


STRANGE = bytes.fromhex("8000 0000 0006 FF 06 00000000")
"""A frame that answers no request."""
IDLE_NS = 60_000_000

RUDE_PEERS: dict[str, Callable[[ModbusServer], Station]] = {
    # Connections.
    "nobody listens": lambda server: Station(),
    "never accepts": lambda server: _Deaf(),
    "closes at once": lambda server: RudePeer(server, greeting=[Leave()]),
    "half closes at once": lambda server: RudePeer(server, greeting=[Fin()]),
    "resets at once": lambda server: RudePeer(server, greeting=[Reset()]),
    "closes after a while": lambda server: RudePeer(server, greeting=[Leave(IDLE_NS)]),
    "closes between requests": lambda server: RudePeer(server, lambda frame: (Say(frame), Leave(IDLE_NS))),
    "resets between requests": lambda server: RudePeer(server, lambda frame: (Say(frame), Reset(IDLE_NS))),
    "takes one connection only": lambda server: RudePeer(server, MISDEEDS["right, then closed"], connections=1),
    # Requests.
    "never reads": lambda server: RudePeer(server, reads=False),
    "never reads, then resets": lambda server: RudePeer(server, reads=False, greeting=[Reset(10 * IDLE_NS)]),
    "closes in mid-request": lambda server: RudePeer(server, on_bytes=[Leave()]),
    "resets in mid-request": lambda server: RudePeer(server, on_bytes=[Reset()]),
    "hears every second request": lambda server: RudePeer(server, _every_second()),
    # Replies.
    "previous reply instead": lambda server: RudePeer(server, _with_previous(lambda before, now: before)),
    "previous reply first": lambda server: RudePeer(server, _with_previous(lambda before, now: before + now)),
    "previous reply behind": lambda server: RudePeer(server, _with_previous(lambda before, now: now + before)),
    "speaks first": lambda server: RudePeer(server, greeting=[Say(STRANGE)]),
    "speaks first, garbage": lambda server: RudePeer(server, greeting=[Say(GARBAGE)]),
    "drips for ever": lambda server: RudePeer(server, _dripping),
    "floods from the start": lambda server: RudePeer(
        server, greeting=[Say(STRANGE * 40, step * 10_000_000) for step in range(500)]),
}  # fmt: skip
"""By name: functions that make such a peer of a server with its contents."""
