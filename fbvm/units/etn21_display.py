"""The words that an ETN21 shows: takes changes of bits, each with the refresh in which it is due, and writes them.

Only bits that changed are written, so what the CPU has cleared meanwhile (a change of mode) stays cleared
(W421 6-9-1 p155).  Changes of one word keep their order, whatever delays they were given.
"""

from __future__ import annotations

from dataclasses import dataclass

from fbvm.units import etn21_map as at
from fbvm.units.etn21_service import Area, Service
from fbvm.units.etn21_socket import Socket
from fbvm.units.etn21_timing import TOGETHER, Skew
from fbvm.units.etn21_words import Words


@dataclass(slots=True)
class Shown:
    """What the words of one socket and protocol say, and where they are: status in CIO, the others in D."""

    status_at: int
    received_at: int
    state_at: int
    status: int = 0
    received: int = 0
    state: int = 0


class Display:
    """Writes one unit's status words, R words and request switches."""

    def __init__(self, layout: at.Layout) -> None:
        self._layout = layout
        self._shown: dict[tuple[str, int], Shown] = {}
        """By protocol and socket, from the first time on that it has something to show."""
        self._words: Words
        self._cycle = 0
        self._changed = False
        self._later: list[tuple[int, bool, int, int, int]] = []
        """Due refresh, whether in D, address, mask of the bits that stay, bits that turn ON."""
        self._last_due: dict[tuple[bool, int], int] = {}

    def begin(self, words: Words, cycle: int) -> None:
        """A refresh begins, in which the unit has something to do."""
        self._words, self._cycle, self._changed = words, cycle, False

    def end(self, touched: dict[Socket, Skew]) -> bool:
        """The refresh ends: report what changed of these sockets, which are then done, and write what was put off until
        now; True if any word was written in this refresh."""
        for socket, skew in touched.items():
            self._show(socket, skew)
        touched.clear()
        if self._later:
            self._write_due()
        return self._changed

    def _write_due(self) -> None:
        later, self._later = self._later, []
        for change in later:
            if change[0] > self._cycle:
                self._later.append(change)
            else:
                _, in_d, address, stays, turns_on = change
                words = self._words.d if in_d else self._words.cio
                words[address] = words[address] & stays | turns_on
                self._changed = True
        if not self._later:
            self._last_due.clear()

    @property
    def pending(self) -> bool:
        """True while a write is still to come."""
        return bool(self._later)

    def show_result(self, service: Service, area: Area, due_cycle: int) -> None:
        """Write the results of a service and its response code, and turn its switch OFF, in refresh `due_cycle`."""
        first, (word, first_bit) = area.first, area.switches
        if due_cycle > self._cycle or self._later:
            for offset, value in service.results.items():
                self._put_off(True, first + offset, 0, value, due_cycle)
            self._put_off(True, first + at.RESPONSE, 0, service.code or 0, due_cycle)
            self._put_off(False, word, ~(1 << first_bit + service.switch), 0, due_cycle)
            return
        d, cio = self._words.d, self._words.cio
        for offset, value in service.results.items():
            d[first + offset] = value
        d[first + at.RESPONSE] = service.code or 0
        cio[word] &= ~(1 << first_bit + service.switch)
        self._changed = True

    def end_force_close(self) -> None:
        """Turn bit 2 of n OFF."""
        self._change(False, self._layout.n, at.FORCE_CLOSE, 0, TOGETHER)

    def _show(self, socket: Socket, skew: Skew) -> None:
        """Report what changed of a socket since it was last shown."""
        shown = self._shown.get((socket.protocol, socket.number)) or self._first(socket)
        status, received = socket.shown()
        if status != shown.status:
            self._change(False, shown.status_at, shown.status ^ status, status, skew)
            shown.status = status
        if socket.protocol == "TCP":
            if received != shown.received:
                self._change(True, shown.received_at, shown.received ^ received, received, skew)
                shown.received = received
            if socket.state != shown.state:
                self._change(True, shown.state_at, shown.state ^ socket.state, socket.state, skew)
                shown.state = socket.state

    def _first(self, socket: Socket) -> Shown:
        protocol, number, m = socket.protocol, socket.number, self._layout.m
        shown = self._shown[protocol, number] = Shown(
            self._layout.status(protocol, number), m + at.BYTES_RECEIVED + number, m + at.TCP_STATE + number)
        return shown

    def _change(self, in_d: bool, address: int, changed: int, value: int, skew: Skew) -> None:
        """Write bits of a word that have changed, each group of them when it is due."""
        if skew is TOGETHER and not self._later:
            words = self._words.d if in_d else self._words.cio
            words[address] = words[address] & ~changed | changed & value
            self._changed = True
            return
        flags, opened = (0, 0) if in_d else (at.FLAGS, at.OPEN)
        groups = ((flags, skew.flag), (opened, skew.open), (0xFFFF & ~flags & ~opened, skew.data))
        for mask, delay in groups:
            if changed & mask:
                self._put_off(in_d, address, ~(changed & mask), changed & mask & value, self._cycle + delay)

    def _put_off(self, in_d: bool, address: int, stays: int, turns_on: int, due_cycle: int) -> None:
        """Leave a change for the end of that refresh; not before an earlier change of the same word."""
        due_cycle = max(due_cycle, self._last_due.get((in_d, address), 0))
        self._last_due[in_d, address] = due_cycle
        self._later.append((due_cycle, in_d, address, stays, turns_on))
