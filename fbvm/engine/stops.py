"""Where the runs of one PLC stop: a table in memory that both engines look up at every observation.

Runs stop at a statement (or rung) that is about to be executed, behind a write, or at the end of a program.  Lines are
looked up by the number of their site; watched bytes are compared with what they were when somebody looked last.  What
machine code finds is asked about here (`hit`), so that both engines stop alike."""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from fbvm.base.memory import STRUCTS, Memory
from fbvm.code.image import Site
from fbvm.engine.trap import Trap

Test = Callable[[], bool]
Seen = tuple[tuple[int, ...], bool, object]
"""What was seen of watched bytes last: their bits, whether the test held, their value."""
State = list[Seen]
AT_STATEMENT, WATCHING = 1, 2
"""Bits of a byte of the table: a run stops at this statement; watched bytes are compared at this site."""
ASK, COUNT, ROWS, TABLE = 0, 8, 16, 24
"""Where machine code finds what it asks, how many rows of watched bytes there are, where they are, and the table."""
ROW_BYTES = 24
"""A row: the offset of eight bytes, the bits of them that count, what they were; 64 bits each."""
STOPPED = "stop"
"""The code of a run's end that somebody wanted."""
PAUSE = Trap(STOPPED, Site("", "", 0, 0), (), "stopped where somebody wants to look")
_ASK = ctypes.PYFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64)
_CHUNK = STRUCTS["u64"]


@dataclass(eq=False)
class LineStop:
    """Stops at statements, by the numbers of their sites; with a test only where it is TRUE."""

    sites: frozenset[int]
    test: Test | None = None


class Watchpoint:
    """Stops where bytes have changed: runs of (offset, size), or one byte of which only the bits of `mask` count.

    With a test it stops only if that is TRUE at a change; with `edge`, if it was not at the change before.  `value` and
    `before` are what `read` yielded at the last change and at the one before."""

    def __init__(self, extents: Iterable[tuple[int, int]], mask: int = 0, *, test: Test | None = None,
                 edge: bool = False, read: Callable[[], object] = lambda: None) -> None:  # fmt: skip
        self._extents, self._mask = tuple(extents), mask
        self._test, self._edge, self._read = test, edge, read
        self.chunks: list[tuple[int, int]] = []
        """Offsets of eight bytes each, and the bits of them that are watched."""
        self.last: tuple[int, ...] = ()
        self.value = self.before = read()
        self._held = test is not None and test()

    def begin(self, memory: Memory) -> None:
        """Take what is there now for unchanged."""
        self.chunks.clear()
        for start, size in self._extents:
            for at in range(start, start + size, 8):
                offset = min(at, memory.size - 8)
                bits = self._mask or (1 << 8 * min(8, start + size - at)) - 1
                self.chunks.append((offset, bits << 8 * (at - offset)))
        self.last = self.seen(memory)

    def seen(self, memory: Memory) -> tuple[int, ...]:
        """The watched bits as they are."""
        return tuple([_CHUNK.unpack_from(memory.map, offset)[0] & bits for offset, bits in self.chunks])

    def changed(self, now: tuple[int, ...]) -> bool:
        """Take in a change; True if a run stops at it."""
        self.last, self.before, self.value = now, self.value, self._read()
        held, self._held = self._held, self._test is None or self._test()
        return self._held and not (self._edge and held)

    @property
    def state(self) -> Seen:
        """What `back` brings back."""
        return self.last, self._held, self.value

    def back(self, state: Seen) -> None:
        self.last, self._held, self.value = state


class StopTable:
    """The table of one memory, for an image with so many sites.  `at` is its address in the host."""

    def __init__(self, memory: Memory, sites: int) -> None:
        self._memory = memory
        self._watched: list[Watchpoint] = []
        self._lines: dict[int, list[LineStop]] = {}
        self._buffer = (ctypes.c_uint8 * (TABLE + sites + 1))()
        self.at = ctypes.addressof(self._buffer)
        self._head = (ctypes.c_int64 * 3).from_buffer(self._buffer)
        self.table = (ctypes.c_uint8 * (sites + 1)).from_buffer(self._buffer, TABLE)
        """A byte a site, and one for the ends of programs."""
        self._rows = (ctypes.c_uint8 * 1)()
        self._asked = _ASK(self._ask)  # stays while machine code may ask
        self._head[0] = ctypes.cast(self._asked, ctypes.c_void_p).value or 0
        self.reasons: tuple[LineStop | Watchpoint, ...] = ()
        """What stopped the run."""
        self.failure: BaseException | None = None
        """What a test raised while machine code ran."""

    @property
    def armed(self) -> bool:
        """True if anything could stop a run."""
        return bool(self._lines or self._watched)

    def put(self, rows: Iterable[LineStop | Watchpoint]) -> None:
        """These stop runs from now on, and no others."""
        rows = list(rows)
        for row in rows:
            if isinstance(row, Watchpoint) and row not in self._watched:
                row.begin(self._memory)
        self._watched = [row for row in rows if isinstance(row, Watchpoint)]
        ctypes.memset(self.table, WATCHING if self._watched else 0, len(self.table))
        self._lines = {}
        for line in (row for row in rows if isinstance(row, LineStop)):
            for site in line.sites:
                self._lines.setdefault(site, []).append(line)
                self.table[site] |= AT_STATEMENT
        self._rows = (ctypes.c_uint8 * (ROW_BYTES * sum(len(row.chunks) for row in self._watched) or 1))()
        self._write_rows()

    def hit(self, site: int, statement: bool) -> bool:
        """True if the run stops at this observation; the site of an end is -1."""
        found: list[LineStop | Watchpoint] = []
        changed = False
        for row in self._watched:
            now = row.seen(self._memory)
            if now != row.last:
                changed = True
                found += [row] * row.changed(now)
        if changed:
            self._write_rows()
        if statement:
            found += [line for line in self._lines.get(site, ()) if line.test is None or line.test()]
        self.reasons = tuple(found)
        return bool(found)

    @property
    def state(self) -> State:
        """What was seen last, for `back`."""
        return [row.state for row in self._watched]

    def back(self, state: State) -> None:
        """Nothing has been seen since then."""
        for row, was in zip(self._watched, state, strict=True):
            row.back(was)
        self.reasons = ()
        self._write_rows()

    def _ask(self, memory: int | None, what: int) -> int:
        """Machine code asks: the site doubled, and 1 more for a statement.  Its answer ends the run if it is not 0."""
        try:
            return self.hit(what >> 1, bool(what & 1))
        except BaseException as error:  # it cannot pass through machine code
            self.failure = error
            return True

    def _write_rows(self) -> None:
        """The rows that machine code compares."""
        rows = [number for row in self._watched for (offset, bits), last in zip(row.chunks, row.last, strict=True)
                for number in (offset, bits, last)]  # fmt: skip
        struct.pack_into(f"<{len(rows)}Q", self._rows, 0, *rows)
        self._head[1], self._head[2] = len(rows) // 3, ctypes.addressof(self._rows)
