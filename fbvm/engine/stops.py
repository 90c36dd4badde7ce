"""The table of a PLC's breakpoints and watchpoints, which both engines look up at every observation.

A run stops before a statement (or rung), behind a write, or at the end of a program.  A line is found by the number of its
site; a watchpoint compares bytes with what they were at the last look.  When machine code finds a site with an entry, it
calls `hit` here, so that both engines stop at the same observations."""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from fbvm.base.areas import NOW, SCANS
from fbvm.base.memory import STRUCTS, Memory
from fbvm.code.image import Site
from fbvm.engine.trap import Trap

Test = Callable[[], bool]
LineTest = Callable[[int | None], bool | None]
"""The test of a line: of the byte at which the instance of its body begins, which machine code does not know (None).  Returns
None if that decides."""
Wanted = Callable[[int], bool]
"""True for the numbers of those passes, counted from 1, at which a run stops."""
Seen = tuple[tuple[int, ...], bool, object, int]
"""Of a watchpoint at the last look: the watched bits, whether its test held, its value, how often it was passed."""


@dataclass(frozen=True)
class State:
    """What was seen up to a moment of a run: by watchpoints and by lines, and how many messages were told."""

    watched: tuple[Seen, ...]
    passes: tuple[int, ...]
    told: int


@dataclass(frozen=True)
class Told:
    """The message of a log point: the site of its statement, number and time of the scan."""

    site: int
    scan: int
    now_ns: int
    text: str


AT_STATEMENT = 1
"""Bit in the table's byte of a site: a run stops before this statement."""
WATCHING = 2
"""Bit in the table's byte of a site: watched bytes are compared at this site."""
ASK = 0
"""Offset in the buffer of the address of the function that machine code calls."""
COUNT = 8
"""Offset of the number of rows of watched bytes."""
ROWS = 16
"""Offset of the address of these rows."""
TABLE = 24
"""Offset of the table: a byte for each site, and one for the ends of programs."""
ROW_BYTES = 24
"""A row of watched bytes: the offset of eight bytes, the bits of them that count, what they were; 64 bits each."""
STOPPED = "stop"
"""The code of the trap with which machine code ends a run at a breakpoint or watchpoint."""
PAUSE = Trap(STOPPED, Site("", "", 0, 0), (), "stopped where somebody wants to look")
_ASK = ctypes.PYFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_int64)
_CHUNK = STRUCTS["u64"]


@dataclass(eq=False)
class LineStop:
    """Stops at statements, by the numbers of their sites; with a test only where it is TRUE, with `wanted` only at some passes.

    With `message`, which returns None where the instance decides and is not known, it never stops and is told instead."""

    sites: frozenset[int]
    test: LineTest | None = None
    wanted: Wanted | None = None
    message: Callable[[int | None], str | None] | None = None
    passes: int = 0
    """How often it was passed with its test TRUE."""

    def passed(self, base: int | None) -> bool | None:
        """Counts a pass.  Returns True if it is a wanted one, None if only the instance decides that."""
        held = True if self.test is None else self.test(base)
        if held:
            self.passes += 1
            return self.wanted is None or self.wanted(self.passes)
        return held


class Watchpoint:
    """Stops a run where bytes have changed.

    `extents` are (offset, size) in bytes of the memory; with a `mask`, the one byte there of which only these bits count.
    With a `test` it stops only at a change at which the test holds; with `edge`, only if the test did not hold at the change
    before; with `wanted` only at some of these.  `value` and `before` are what `read` returned at the last change and at the one
    before."""

    def __init__(self, extents: Iterable[tuple[int, int]], mask: int = 0, *, test: Test | None = None, edge: bool = False,
                 read: Callable[[], object] = lambda: None, wanted: Wanted | None = None) -> None:  # fmt: skip
        self._extents, self._mask = tuple(extents), mask
        self._test, self._edge, self._read, self._wanted = test, edge, read, wanted
        self.passes = 0
        """How often it would have stopped a run, had each of them been wanted."""
        self.chunks: list[tuple[int, int]] = []
        """Offsets of eight bytes each, and the bits of them that are watched."""
        self.last: tuple[int, ...] = ()
        self.value: object = None
        self.before: object = None
        self._held = False

    def begin(self, memory: Memory) -> None:
        """From now on a change is a difference from what the bytes are now."""
        self.chunks.clear()
        for start, size in self._extents:
            for at in range(start, start + size, 8):
                offset = min(at, memory.size - 8)
                bits = self._mask or (1 << 8 * min(8, start + size - at)) - 1
                self.chunks.append((offset, bits << 8 * (at - offset)))
        self.last = self.seen(memory)
        self.value = self.before = self._read()
        self._held = self._test is not None and self._test()

    def seen(self, memory: Memory) -> tuple[int, ...]:
        """The watched bits, eight bytes each."""
        return tuple([_CHUNK.unpack_from(memory.map, offset)[0] & bits for offset, bits in self.chunks])

    def changed(self, now: tuple[int, ...]) -> bool:
        """Called when the bits are not those of the last look but `now`.  Returns True if a run stops at this change."""
        self.last, self.before, self.value = now, self.value, self._read()
        held, self._held = self._held, self._test is None or self._test()
        if not self._held or (self._edge and held):
            return False
        self.passes += 1
        return self._wanted is None or self._wanted(self.passes)

    @property
    def state(self) -> Seen:
        """What `back` needs to undo later looks."""
        return self.last, self._held, self.value, self.passes

    def back(self, state: Seen) -> None:
        self.last, self._held, self.value, self.passes = state


class StopTable:
    """The breakpoints and watchpoints of one PLC: of its memory, and of an image with so many sites.

    `at` is the address of the buffer that machine code reads."""

    def __init__(self, memory: Memory, sites: int) -> None:
        self.memory = memory
        self._watched: list[Watchpoint] = []
        self._rows_of_lines: list[LineStop] = []
        self._lines: dict[int, list[LineStop]] = {}
        self.told: list[Told] = []
        """The messages of log points, the oldest first; who reads them clears the list between two scans."""
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
        """Replaces all rows: these stop runs from now on, and no others."""
        rows = list(rows)
        for row in rows:
            if isinstance(row, Watchpoint) and row not in self._watched:
                row.begin(self.memory)
        self._watched = [row for row in rows if isinstance(row, Watchpoint)]
        ctypes.memset(self.table, WATCHING if self._watched else 0, len(self.table))
        self._lines = {}
        self._rows_of_lines = [row for row in rows if isinstance(row, LineStop)]
        for line in self._rows_of_lines:
            for site in line.sites:
                self._lines.setdefault(site, []).append(line)
                self.table[site] |= AT_STATEMENT
        self._rows = (ctypes.c_uint8 * (ROW_BYTES * sum(len(row.chunks) for row in self._watched) or 1))()
        self._write_rows()

    def begin(self, passes: Mapping[LineStop | Watchpoint, int]) -> None:
        """From now on a change is a difference from what the memory is now; rows count on from `passes`, or from 0."""
        for row in self._watched:
            row.begin(self.memory)
            row.passes = passes.get(row, 0)
        for line in self._rows_of_lines:
            line.passes = passes.get(line, 0)
        self._write_rows()

    def hit(self, site: int, statement: bool, base: int | None = None) -> bool:
        """Looks at one observation.  Returns True if the run stops there; `reasons` then says why.

        `site` is its number, -1 for the end of a program; `statement` is True before a statement or rung, False behind a
        write; `base` is the byte at which the instance of its body begins, if that is known.  Raises what a test raises."""
        found: list[LineStop | Watchpoint] = []
        changed = False
        for row in self._watched:
            now = row.seen(self.memory)
            if now != row.last:
                changed = True
                found += [row] * row.changed(now)
        if changed:
            self._write_rows()
        if statement:
            found += [line for line in self._lines.get(site, ()) if self._stops_at(line, site, base)]
        self.reasons = tuple(found)
        return bool(found)

    def _stops_at(self, line: LineStop, site: int, base: int | None) -> bool:
        """Looks at a line.  What the instance decides stops a run that does not know the instance; it is undone by `back`."""
        passed = line.passed(base)
        if not passed or line.message is None:
            return passed is not False
        text = line.message(base)
        if text is None:
            return True
        self.told.append(Told(site, int(self.memory.read(SCANS, "i64")), int(self.memory.read(NOW, "i64")), text))
        return False

    @property
    def state(self) -> State:
        """What was seen at the last look, for `back`."""
        passes = tuple(row.passes for row in self._rows_of_lines)
        return State(tuple(row.state for row in self._watched), passes, len(self.told))

    def back(self, state: State) -> None:
        """Undoes all looks since `state` was taken, because the memory goes back as well."""
        for row, was in zip(self._watched, state.watched, strict=True):
            row.back(was)
        for line, passes in zip(self._rows_of_lines, state.passes, strict=True):
            line.passes = passes
        del self.told[state.told :]
        self.reasons = ()
        self._write_rows()

    def _ask(self, memory: int | None, what: int) -> int:
        """Called by machine code: `what` is twice the site, and 1 more before a statement.  Not 0 ends the run."""
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
