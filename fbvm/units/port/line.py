"""One line of a mailbox port: follows the program's command, moves bytes between the network and the words of the line."""

from __future__ import annotations

import sys
from collections.abc import Callable

from fbvm.units.addresses import host_of, words_of
from fbvm.units.port.words import Lines
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


class Line:
    """The connection of one line with the number `channel`.

    `words`, of each method, are the line's words in the PLC's memory; `number_of` gives the number that the unit has for a
    POSIX errno name."""

    def __init__(self, channel: int, lines: Lines, number_of: Callable[[str], int]) -> None:
        self.channel = channel
        self._number_of = number_of
        self._words, self._commands, self._states = lines.words, lines.commands, lines.states
        self._outgoing_bytes, self._incoming_bytes = lines.outgoing_bytes, lines.incoming_bytes
        self._in_use = False
        """The network knows the channel."""
        self._unconfirmed_closes = 0
        """Closes that the network has not confirmed; what it tells until then is about the past."""
        self._is_sending = False
        self._granted = 0

    @property
    def is_idle(self) -> bool:
        """True if nothing is open and nothing is awaited."""
        return not self._in_use and not self._unconfirmed_closes

    def take(self, event: Event, words: memoryview) -> None:
        """Shows the program what the network tells."""
        if isinstance(event, Closed):
            self._unconfirmed_closes = max(0, self._unconfirmed_closes - 1)
            return
        if self._unconfirmed_closes or not self._in_use:
            return
        at, states = self._words, self._states
        match event:
            case Opened(remote=remote):
                words[at.state] = states.open
                words[at.peer_ip], words[at.peer_ip + 1] = words_of(remote.host)
                words[at.peer_port] = remote.port
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
                if words[at.state] == states.open:
                    words[at.state] = states.ended

    def exchange(self, words: memoryview, is_mine: bool) -> list[Request]:
        """What the network has to do for the program's command; a line that is not the unit's any more is closed."""
        at, commands, states = self._words, self._commands, self._states
        command = words[at.command] if is_mine else commands.close
        if command == commands.connect or command == commands.listen:
            state = words[at.state]
            is_at_work = state == states.open or state == states.ended
            if self.is_idle and not is_at_work and state != states.failed:
                return [self._open(command, words)]
            return self._work(words) if is_at_work else []
        if self._in_use:
            words[at.state] = states.closing
            words[at.sending] = 0
            return self.close(command == commands.reset)
        if is_mine and not self._unconfirmed_closes and words[at.state] != states.closed:
            words[at.state] = states.closed
            words[at.sending] = 0  # what was meant for one peer is not sent to the next
        return []

    def close(self, reset: bool) -> list[Request]:
        """Gives the connection up, whatever it does."""
        self._is_sending = False
        self._granted = 0
        if not self._in_use:
            return []
        self._in_use = False
        self._unconfirmed_closes += 1
        return [Close(self.channel, reset)]

    def _open(self, command: int, words: memoryview) -> Request:
        at = self._words
        remote = Peer(host_of(words[at.remote_ip], words[at.remote_ip + 1]), words[at.remote_port])
        local_port, keep_alive = words[at.local_port], bool(words[at.keep_alive])
        words[at.state] = self._states.opening
        words[at.error] = words[at.received] = 0
        self._in_use = True
        if command == self._commands.connect:
            return Connect(self.channel, remote, local_port, keep_alive)
        return Listen(self.channel, local_port, remote, keep_alive)

    def _work(self, words: memoryview) -> list[Request]:
        at, requests = self._words, list[Request]()
        size = min(words[at.sending], self._outgoing_bytes)
        if size and not self._is_sending:
            self._is_sending = True
            words[at.sending] = 0
            data = _swapped(words[at.outgoing : at.outgoing + (size + 1) // 2].tobytes())
            requests.append(Send(self.channel, data[:size]))
        room = max(0, self._incoming_bytes - words[at.received])
        if room != self._granted and words[at.state] == self._states.open:
            self._granted = room
            requests.append(Grant(self.channel, room))
        return requests

    def _store(self, data: bytes, words: memoryview) -> None:
        """Adds bytes behind those that wait; what has no room, because the program moved the mark, is lost."""
        at = self._words
        held = min(words[at.received], self._incoming_bytes)
        data = data[: self._incoming_bytes - held]
        self._granted = max(0, self._granted - len(data))
        first = at.incoming + held // 2
        whole = bytes((words[first] >> 8,)) + data if held % 2 else data
        whole += bytes(len(whole) % 2)
        words[first : first + len(whole) // 2] = memoryview(_swapped(whole)).cast("H")
        words[at.received] = held + len(data)

    def _fail(self, error: str, words: memoryview) -> None:
        words[self._words.state] = self._states.failed
        words[self._words.error] = self._number_of(error)


def _swapped(data: bytes) -> bytes:
    """Bytes of words as the host has them, from or to bytes of which each word's high half is the first."""
    if sys.byteorder == "big":
        return data
    turned = bytearray(data)
    turned[::2], turned[1::2] = data[1::2], data[::2]
    return bytes(turned)
