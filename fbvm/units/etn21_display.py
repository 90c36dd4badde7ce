"""The words that an ETN21 shows: collects changes of bits, each with the refresh in which it is due, and writes them.

Only bits that changed are written, so what the CPU has cleared meanwhile (a change of mode) stays cleared
(W421 6-9-1 p155).  Changes of one word keep their order, whatever delays they were given.
"""

from __future__ import annotations

from typing import NamedTuple

from fbvm.units import etn21_map as at
from fbvm.units.etn21_socket import Socket
from fbvm.units.etn21_timing import Skew
from fbvm.units.unit import AreaMemory


class _Change(NamedTuple):
    due_cycle: int
    area: str
    word: int
    clear: int
    set: int


class Display:
    """Writes for one unit's status words, R words and request switches."""

    def __init__(self, layout: at.Layout) -> None:
        self._layout = layout
        self._shown: dict[tuple[str, int], int] = {}
        self._queue: list[_Change] = []
        self._last_due: dict[tuple[str, int], int] = {}

    def put(self, area: str, word: int, value: int, due_cycle: int) -> None:
        """Write a whole word in refresh `due_cycle`."""
        self._change(area, word, 0xFFFF, value, due_cycle)

    def clear_bit(self, area: str, word: int, bit: int, due_cycle: int) -> None:
        """Turn one bit OFF in refresh `due_cycle`."""
        self._change(area, word, 1 << bit, 0, due_cycle)

    def show(self, socket: Socket, skew: Skew, cycle: int) -> None:
        """Report what changed of a socket since it was last shown."""
        status = self._layout.status(socket.protocol, socket.number)
        groups = ((at.FLAGS, skew.flag), (at.OPEN, skew.open), (at.DATA_RECEIVED, skew.data))
        self._differences(("CIO", status), socket.status(), groups, cycle)
        if socket.protocol == "TCP":
            whole = ((0xFFFF, skew.data),)
            d = self._layout.m + socket.number
            self._differences(("D", d + at.BYTES_RECEIVED), socket.bytes_shown(), whole, cycle)
            self._differences(("D", d + at.TCP_STATE), socket.state, whole, cycle)

    def flush(self, memory: AreaMemory, cycle: int) -> None:
        """Write everything that is due."""
        later = []
        for change in self._queue:
            if change.due_cycle > cycle:
                later.append(change)
            else:
                words = memory.words(change.area)
                words[change.word] = words[change.word] & ~change.clear | change.set
        self._queue = later
        if not later:
            self._last_due.clear()

    @property
    def pending(self) -> bool:
        """True while a write is still to come."""
        return bool(self._queue)

    def _differences(self, key: tuple[str, int], value: int, groups: tuple[tuple[int, int], ...], cycle: int) -> None:
        changed = self._shown.get(key, 0) ^ value
        if changed:
            self._shown[key] = value
            for mask, delay in groups:
                if changed & mask:
                    self._change(*key, changed & mask & ~value, changed & mask & value, cycle + delay)

    def _change(self, area: str, word: int, clear: int, turn_on: int, due_cycle: int) -> None:
        key = area, word
        due_cycle = max(due_cycle, self._last_due.get(key, 0))
        self._last_due[key] = due_cycle
        self._queue.append(_Change(due_cycle, area, word, clear, turn_on))
