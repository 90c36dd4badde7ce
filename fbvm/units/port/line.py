"""One slot of a mailbox port: follows the program's wish, moves bytes between the network and the words of the slot."""

from __future__ import annotations

import sys
from collections.abc import Callable

from fbvm.units.port import map as at
from fbvm.units.port.map import State, Wish
from fbvm.wire.link import (
    Broken,
    Close,
    Closed,
    Connect,
    Event,
    Failed,
    Grant,
    Listen,
    Opened,
    Peer,
    PeerClosed,
    Received,
    Request,
    Send,
    Sent,
)

_AT_WORK = (State.OPEN, State.ENDED)


class Line:
    """The connection of one slot; `words` are the slot's, and may be given anew at each call."""

    def __init__(self, channel: int, number_of: Callable[[str], int]) -> None:
        self.channel = channel
        self._number_of = number_of
        self._in_use = False
        """The network knows the channel."""
        self._closes = 0
        """Closes that the network has not confirmed; what it tells until then is about the past."""
        self._is_sending = False
        self._granted = 0

    @property
    def is_idle(self) -> bool:
        """True if nothing is open and nothing is awaited."""
        return not self._in_use and not self._closes

    def take(self, event: Event, words: memoryview) -> None:
        """What the network tells."""
        if isinstance(event, Closed):
            self._closes = max(0, self._closes - 1)
            return
        if self._closes or not self._in_use:
            return
        match event:
            case Opened(remote=remote):
                words[at.STATE] = State.OPEN
                words[at.PEER_IP], words[at.PEER_IP + 1] = _ip_words(remote.host)
                words[at.PEER_PORT] = remote.port
            case Failed(service="open", error=error):
                self._in_use = False
                self._fail(error, words)
            case Failed(error=error) | Broken(error=error):
                self._fail(error, words)
            case Sent():
                self._is_sending = False
            case Received(data=data):
                self._store(data, words)
            case PeerClosed():
                if words[at.STATE] == State.OPEN:
                    words[at.STATE] = State.ENDED

    def exchange(self, words: memoryview, is_mine: bool) -> list[Request]:
        """What the network has to do for the program's wish."""
        wish = words[at.WISH] if is_mine else Wish.CLOSED
        if wish in (Wish.CONNECT, Wish.LISTEN):
            if self.is_idle and words[at.STATE] not in (*_AT_WORK, State.FAILED):
                return [self._open(wish, words)]
            return self._work(words) if words[at.STATE] in _AT_WORK else []
        if self._in_use:
            words[at.STATE] = State.CLOSING
            return self.close(wish == Wish.RESET)
        if is_mine and not self._closes and words[at.STATE] != State.CLOSED:
            words[at.STATE] = State.CLOSED
        return []

    def close(self, reset: bool) -> list[Request]:
        """Give the connection up, whatever it does."""
        self._is_sending = False
        self._granted = 0
        if not self._in_use:
            return []
        self._in_use = False
        self._closes += 1
        return [Close(self.channel, reset)]

    def _open(self, wish: int, words: memoryview) -> Request:
        remote = Peer(_dotted(words[at.REMOTE_IP], words[at.REMOTE_IP + 1]), words[at.REMOTE_PORT])
        local_port, keep_alive = words[at.LOCAL_PORT], bool(words[at.OPTIONS] & at.KEEP_ALIVE)
        words[at.STATE] = State.OPENING
        words[at.ERROR] = words[at.RECEIVED] = 0
        self._in_use = True
        if wish == Wish.CONNECT:
            return Connect(self.channel, remote, local_port, keep_alive)
        return Listen(self.channel, local_port, remote, keep_alive)

    def _work(self, words: memoryview) -> list[Request]:
        requests: list[Request] = []
        size = min(words[at.SENDING], at.OUTGOING_BYTES)
        if size and not self._is_sending:
            self._is_sending = True
            words[at.SENDING] = 0
            data = _swapped(words[at.OUTGOING : at.OUTGOING + (size + 1) // 2].tobytes())
            requests.append(Send(self.channel, data[:size]))
        room = max(0, at.INCOMING_BYTES - words[at.RECEIVED])
        if room != self._granted and words[at.STATE] == State.OPEN:
            self._granted = room
            requests.append(Grant(self.channel, room))
        return requests

    def _store(self, data: bytes, words: memoryview) -> None:
        """Add bytes behind those that wait; what has no room, because the program moved the mark, is lost."""
        held = min(words[at.RECEIVED], at.INCOMING_BYTES)
        data = data[: at.INCOMING_BYTES - held]
        self._granted = max(0, self._granted - len(data))
        first = at.INCOMING + held // 2
        whole = bytes((words[first] >> 8,)) + data if held % 2 else data
        whole += bytes(len(whole) % 2)
        words[first : first + len(whole) // 2] = memoryview(_swapped(whole)).cast("H")
        words[at.RECEIVED] = held + len(data)

    def _fail(self, error: str, words: memoryview) -> None:
        words[at.STATE] = State.FAILED
        words[at.ERROR] = self._number_of(error)


def _swapped(data: bytes) -> bytes:
    """Bytes of words as the host has them, from or to bytes of which each word's high half is the first."""
    if sys.byteorder == "big":
        return data
    turned = bytearray(data)
    turned[::2], turned[1::2] = data[1::2], data[::2]
    return bytes(turned)


def _dotted(high: int, low: int) -> str:
    return ".".join(str(octet) for octet in (high >> 8, high & 255, low >> 8, low & 255))


def _ip_words(host: str) -> tuple[int, int]:
    octets = [int(part) for part in host.split(".")]
    return octets[0] << 8 | octets[1], octets[2] << 8 | octets[3]
