"""The TCP side of a unit that is met through a mailbox: one connection for each slot that names the unit.

Knows neither Modbus nor what is in the head of the mailbox.  Several units may share one mailbox; each serves the
slots that carry its number."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from fbvm.units.contract import AreaMemory
from fbvm.units.port import map as at
from fbvm.units.port.line import Line
from fbvm.wire.link import Event, Request


def mailbox(memory: AreaMemory, area: str) -> memoryview | None:
    """The words of a mailbox, None in a PLC whose program does not use it."""
    try:
        return memory.words(area)
    except KeyError:
        return None


class Port:
    """The connections of unit `number` in a mailbox with `slots` slots behind `head_words` words.

    `number_of` gives the number that the unit has for a POSIX errno name."""

    def __init__(self, number: int, head_words: int, slots: int, number_of: Callable[[str], int]) -> None:
        self.number = number
        self._head_words = head_words
        self._lines = [Line(channel, number_of) for channel in range(slots)]
        self._active: set[int] = set()
        """Slots with a connection, or a close that is not confirmed, also when they carry another number by now."""
        self._modules_at = slice(head_words + at.MODULE, head_words + slots * at.SLOT_WORDS, at.SLOT_WORDS)

    def take(self, words: memoryview, events: Iterable[Event]) -> None:
        """What the network tells; `words` is the whole mailbox."""
        for event in events:
            if 0 <= event.channel < len(self._lines):
                self._lines[event.channel].take(event, self._slot(words, event.channel))

    def exchange(self, words: memoryview) -> list[Request]:
        """What the network has to do for the wishes of the program."""
        requests: list[Request] = []
        modules = words[self._modules_at].tolist()
        for channel in [slot for slot, module in enumerate(modules) if module == self.number or slot in self._active]:
            line = self._lines[channel]
            requests += line.exchange(self._slot(words, channel), modules[channel] == self.number)
            (self._active.discard if line.is_idle else self._active.add)(channel)
        return requests

    def reset(self, words: memoryview | None) -> list[Request]:
        """Break all connections; the slots of this unit are as new, but for their owners."""
        requests = [request for line in self._lines for request in line.close(reset=True)]
        if words is None:
            return requests
        for channel in range(len(self._lines)):
            slot = self._slot(words, channel)
            if slot[at.MODULE] == self.number:
                for word in (at.WISH, at.STATE, at.ERROR, at.SENDING, at.RECEIVED):
                    slot[word] = 0
        return requests

    def _slot(self, words: memoryview, channel: int) -> memoryview:
        start = self._head_words + channel * at.SLOT_WORDS
        return words[start : start + at.SLOT_WORDS]
