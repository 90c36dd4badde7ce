"""The TCP side of a unit that is met through a mailbox: one connection for each line that names the unit.

Knows neither Modbus nor what is in the head of the mailbox.  Several units may share one mailbox; each serves the
lines that carry its number."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict

from fbvm.units.addresses import host_of
from fbvm.units.front import Socket
from fbvm.units.port.line import Line
from fbvm.units.port.words import Lines
from fbvm.wire.link import Event, Request


class Port:
    """The connections of unit `number` in the lines of a mailbox.

    `number_of` gives the number that the unit has for a POSIX errno name."""

    def __init__(self, number: int, lines: Lines, number_of: Callable[[str], int]) -> None:
        self.number = number
        self._first_word, self._size = lines.first_word, lines.size
        self._lines = [Line(channel, lines, number_of) for channel in range(lines.count)]
        self._at = at = lines.words
        self._states = {number: name.upper() for name, number in asdict(lines.states).items()}
        self._module = at.module
        self._modules = slice(self._first_word + at.module, self._first_word + lines.count * self._size, self._size)
        """Where in the mailbox the numbers of all lines are."""
        self._cleared = (at.command, at.state, at.error, at.sending, at.received)
        """Words that are 0 in a line that is as new."""

    def take(self, words: memoryview, events: Iterable[Event]) -> None:
        """Shows the program what the network tells; `words` is the whole mailbox."""
        for event in events:
            if 0 <= event.channel < len(self._lines):
                self._lines[event.channel].take(event, self._line(words, event.channel))

    def exchange(self, words: memoryview) -> list[Request]:
        """What the network has to do for the program's commands; `words` is the whole mailbox.  A line with a connection, or with
        a close that is not confirmed, is asked also when it carries another number by now."""
        requests: list[Request] = []
        for channel, (line, module) in enumerate(zip(self._lines, words[self._modules].tolist(), strict=True)):
            if module == self.number or not line.is_idle:
                requests += line.exchange(self._line(words, channel), module == self.number)
        return requests

    def reset(self, words: memoryview | None) -> list[Request]:
        """Breaks all connections; the lines of this unit are as new, but for their owners."""
        requests = [request for line in self._lines for request in line.close(reset=True)]
        if words is None:
            return requests
        for channel in range(len(self._lines)):
            line = self._line(words, channel)
            if line[self._module] == self.number:
                for word in self._cleared:
                    line[word] = 0
        return requests

    def sockets(self, words: memoryview, errors: Mapping[int, str]) -> Iterator[Socket]:
        """The lines of this unit that a program uses, as people read them; `errors` are the names of the unit's numbers."""
        at = self._at
        for channel in range(len(self._lines)):
            line = self._line(words, channel)
            if line[self._module] != self.number:
                continue
            high, low, port = line[at.peer_ip], line[at.peer_ip + 1], line[at.peer_port]
            if not (high or low or port):
                high, low, port = line[at.remote_ip], line[at.remote_ip + 1], line[at.remote_port]
            error = line[at.error]
            yield Socket(f"line {channel}", self._states.get(line[at.state], str(line[at.state])), str(line[at.local_port] or ""),
                         f"{host_of(high, low)}:{port}" if high or low or port else "", line[at.received], line[at.sending],
                         errors.get(error, f"16#{error:02X}") if error else "")  # fmt: skip

    def _line(self, words: memoryview, channel: int) -> memoryview:
        start = self._first_word + channel * self._size
        return words[start : start + self._size]
