"""The words that an ETN21 shows: collects changes of bits, each with the refresh in which it is due, and writes them.

Only bits that changed are written, so what the CPU has cleared meanwhile (a change of mode) stays cleared
(W421 6-9-1 p155).  Changes of one word keep their order, whatever delays they were given.
"""

from __future__ import annotations

from functools import cache

from fbvm.units import etn21_map as at
from fbvm.units.etn21_socket import Socket
from fbvm.units.etn21_timing import TOGETHER, Skew
from fbvm.units.unit import AreaMemory

Word = tuple[str, int]
"""Area and address."""


@cache
def _words_of(layout: at.Layout) -> dict[tuple[str, int], tuple[Word, Word, Word]]:
    """By protocol and socket: status, bytes received, TCP state; the same for all units of a number."""
    return {
        (protocol, socket): (
            ("CIO", layout.status(protocol, socket)),
            ("D", layout.m + at.BYTES_RECEIVED + socket),
            ("D", layout.m + at.TCP_STATE + socket),
        )
        for protocol in ("TCP", "UDP") for socket in at.SOCKETS
    }  # fmt: skip


class Display:
    """Writes for one unit's status words, R words and request switches."""

    def __init__(self, layout: at.Layout) -> None:
        self._words_of = _words_of(layout)
        self._shown: dict[Word, int] = {}
        self._queue: list[tuple[int, Word, int, int]] = []
        """Due refresh, word, mask of the bits that stay, bits that turn ON."""
        self._last_due: dict[Word, int] = {}

    def put(self, word: Word, value: int, due_cycle: int) -> None:
        """Write a whole word in refresh `due_cycle`."""
        self._change(word, 0, value, due_cycle)

    def clear_bit(self, word: Word, bit: int, due_cycle: int) -> None:
        """Turn one bit OFF in refresh `due_cycle`."""
        self._change(word, ~(1 << bit), 0, due_cycle)

    def show(self, socket: Socket, skew: Skew, cycle: int) -> None:
        """Report what changed of a socket since it was last shown."""
        protocol = socket.protocol
        status, received, state = self._words_of[protocol, socket.number]
        size_bytes = socket.bytes_shown()
        self._differences(status, socket.status(size_bytes), skew, cycle)
        if protocol == "TCP":
            self._differences(received, size_bytes, skew, cycle)
            self._differences(state, socket.state, skew, cycle)

    def flush(self, memory: AreaMemory, cycle: int) -> bool:
        """Write everything that is due; True if that is anything."""
        queue, self._queue = self._queue, []
        if not queue:
            return False
        cio, d = memory.words("CIO"), memory.words("D")
        for change in queue:
            due_cycle, (area, at), stays, turns_on = change
            if due_cycle > cycle:
                self._queue.append(change)
            else:
                words = d if area == "D" else cio
                words[at] = words[at] & stays | turns_on
        if not self._queue:
            self._last_due.clear()
        return len(self._queue) < len(queue)

    @property
    def pending(self) -> bool:
        """True while a write is still to come."""
        return bool(self._queue)

    def _differences(self, word: Word, value: int, skew: Skew, cycle: int) -> None:
        changed = self._shown.get(word, 0) ^ value
        if not changed:
            return
        self._shown[word] = value
        if skew is TOGETHER:
            self._change(word, ~changed, changed & value, cycle)
            return
        flags, opened = (at.FLAGS, at.OPEN) if word[0] == "CIO" else (0, 0)
        groups = ((flags, skew.flag), (opened, skew.open), (0xFFFF & ~flags & ~opened, skew.data))
        for mask, delay in groups:
            if changed & mask:
                self._change(word, ~(changed & mask), changed & mask & value, cycle + delay)

    def _change(self, word: Word, stays: int, turns_on: int, due_cycle: int) -> None:
        due_cycle = max(due_cycle, self._last_due.get(word, 0))
        self._last_due[word] = due_cycle
        self._queue.append((due_cycle, word, stays, turns_on))
