"""Scans inside machine code: what a scan does up to its refresh, for as long as nobody outside has to be told.

The function that does them is made for a shape: which of the tasks have an interval, which words tell the program about
time, what is watched.  It has no calls but those of the tasks and of companions."""

from __future__ import annotations

import ctypes
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import count
from string import Template

from fbvm.base.areas import BUDGET, DUE, NEVER, NOW, SCANS
from fbvm.base.memory import Memory
from fbvm.engine import native_cache
from fbvm.engine.native_cache import Stored, name_of
from fbvm.engine.native_companions import Companion, Shape, Told
from fbvm.engine.native_companions import text as companions_text
from fbvm.engine.native_compiler import Linked, compile_text
from fbvm.engine.native_entries import Entry


@dataclass
class Turn:
    """A task in its turn: its number, its interval or 0, and when it runs next if it has one."""

    task: int
    interval_ns: int = 0
    next_ns: int = 0


@dataclass(frozen=True)
class Clockwork:
    """What a scan writes at its start from its time alone; offsets in bytes of the buffer."""

    cleared: tuple[tuple[int, int], ...] = ()
    """Words of 16 bits and the bits of them that stay."""
    cycle_time: tuple[int, int, int] | None = None
    """Where 32 bits with the cycle time lie, where those with the longest one, and their unit in nanoseconds."""
    counters: tuple[tuple[int, int], ...] = ()
    """Words of 16 bits that count, and what they count, in nanoseconds."""
    pulses: tuple[tuple[int, int, tuple[tuple[int, int, int], ...]], ...] = ()
    """Bytes, the bits of them that stay, and the others: mask, period, and from when in it they are ON."""


NOTHING = Clockwork()
MEMORY, CONTEXT, LEFT, FIRST, STEP, BUDGETED, SPEND, DONE, CHANGED, UNFINISHED, AGAIN, FAULTY, POINT, ROWS = range(14)
"""Parameters, 64 bits each, and then the rows of turns, of what is watched and of companions: the addresses of memory and
context, how many scans, the time of the first one and by how far it goes on, statements that a scan may execute and all
of them together, how many scans there were, whether something that is watched has changed or which companions ran, and
what else these tell."""
TOLD = Told(memory=MEMORY, ran=CHANGED, unfinished=UNFINISHED, again=AGAIN, faulty=FAULTY, point=POINT)
ASKED = -1
"""In place of a trap's point: companions have requests, or one of them has a trap of its own."""
ROW = 4
"""Numbers of a turn: where the address of its function lies, interval, next time, whether it is due."""
WATCHED_ROW, WATCHED_BYTES = 2, 8
"""Numbers of what is watched: its offset in the memory, and the eight bytes that are expected there."""
NO_LIMIT = 1 << 62
MOST_CYCLE = 0xFFFF_FFFF
"""The longest cycle time that its words can say."""
_SCANS = Template(f"""
define i32 @scans(ptr %p) {{
entry:
%m = load ptr, ptr %p
%c_at = getelementptr inbounds i8, ptr %p, i64 {8 * CONTEXT}
%c = load ptr, ptr %c_at
%now_at = getelementptr inbounds i8, ptr %m, i64 {NOW}
%due_at = getelementptr inbounds i8, ptr %m, i64 {DUE}
%budget_at = getelementptr inbounds i8, ptr %m, i64 {BUDGET}
%count_at = getelementptr inbounds i8, ptr %m, i64 {SCANS}
%n_at = getelementptr inbounds i8, ptr %p, i64 {8 * LEFT}
%first_at = getelementptr inbounds i8, ptr %p, i64 {8 * FIRST}
%step_at = getelementptr inbounds i8, ptr %p, i64 {8 * STEP}
%amount_at = getelementptr inbounds i8, ptr %p, i64 {8 * BUDGETED}
%spend_at = getelementptr inbounds i8, ptr %p, i64 {8 * SPEND}
%done_at = getelementptr inbounds i8, ptr %p, i64 {8 * DONE}
%changed_at = getelementptr inbounds i8, ptr %p, i64 {8 * CHANGED}
store i64 0, ptr %changed_at
%n = load i64, ptr %n_at
%first = load i64, ptr %first_at
%step = load i64, ptr %step_at
%amount = load i64, ptr %amount_at
%spend = load i64, ptr %spend_at
$rows
br label %test
test:
%i = phi i64 [ 0, %entry ], [ %i1, %good ]
%now = phi i64 [ %first, %entry ], [ %next, %good ]
%spent = phi i64 [ 0, %entry ], [ %spent1, %good ]
%more = icmp slt i64 %i, %n
%rest = icmp slt i64 %spent, %spend
%go = and i1 %more, %rest
br i1 %go, label %scan, label %end
scan:
%before = load i64, ptr %now_at
store i64 %now, ptr %now_at
store i64 {NEVER}, ptr %due_at
store i64 %amount, ptr %budget_at
$clockwork
$turns
br label %good
good:
%left = load i64, ptr %budget_at
%used = sub i64 %amount, %left
%spent1 = add i64 %spent, %used
%s = load i64, ptr %count_at
%s1 = add i64 %s, 1
store i64 %s1, ptr %count_at
%i1 = add i64 %i, 1
%next = add i64 %now, %step
$watched
br i1 %changed, label %stop, label %test
stop:
store i64 %i1, ptr %done_at
$changed
trap:
%point = phi i32 $points
%s2 = load i64, ptr %count_at
%s3 = add i64 %s2, 1
store i64 %s3, ptr %count_at
%i2 = add i64 %i, 1
store i64 %i2, ptr %done_at
ret i32 %point
end:
store i64 %i, ptr %done_at
ret i32 0
}}
$companions
declare i32 @llvm.umax.i32(i32, i32)
declare i64 @llvm.umin.i64(i64, i64)
""")


def _clockwork(row: Clockwork) -> Iterator[str]:
    """What it writes, as instructions."""
    for n, (offset, stay) in enumerate(row.cleared):
        yield from (f"%ka{n} = getelementptr inbounds i8, ptr %m, i64 {offset}", f"%kb{n} = load i16, ptr %ka{n}",
                    f"%kc{n} = and i16 %kb{n}, {stay}", f"store i16 %kc{n}, ptr %ka{n}")
    if row.cycle_time:
        now, longest, unit_ns = row.cycle_time
        yield from ("%tb = sub i64 %now, %before", f"%tu = udiv i64 %tb, {unit_ns}",
                    f"%tq = call i64 @llvm.umin.i64(i64 %tu, i64 {MOST_CYCLE})", "%tc = trunc i64 %tq to i32",
                    f"%ta = getelementptr inbounds i8, ptr %m, i64 {now}",
                    "store i32 %tc, ptr %ta, align 2", f"%tl = getelementptr inbounds i8, ptr %m, i64 {longest}",
                    "%to = load i32, ptr %tl, align 2", "%tm = call i32 @llvm.umax.i32(i32 %tc, i32 %to)",
                    "store i32 %tm, ptr %tl, align 2")
    for n, (offset, unit_ns) in enumerate(row.counters):
        yield from (f"%qa{n} = udiv i64 %now, {unit_ns}", f"%qb{n} = trunc i64 %qa{n} to i16",
                    f"%qc{n} = getelementptr inbounds i8, ptr %m, i64 {offset}", f"store i16 %qb{n}, ptr %qc{n}")
    for n, (offset, stay, bits) in enumerate(row.pulses):
        yield from (f"%pa{n} = getelementptr inbounds i8, ptr %m, i64 {offset}", f"%pb{n} = load i8, ptr %pa{n}",
                    f"%p{n}.0 = and i8 %pb{n}, {stay}")
        for k, (mask, period_ns, from_ns) in enumerate(bits):
            yield from (f"%ra{n}.{k} = urem i64 %now, {period_ns}", f"%rb{n}.{k} = icmp uge i64 %ra{n}.{k}, {from_ns}",
                        f"%rc{n}.{k} = select i1 %rb{n}.{k}, i8 {mask}, i8 0",
                        f"%p{n}.{k + 1} = or i8 %p{n}.{k}, %rc{n}.{k}")
        yield f"store i8 %p{n}.{len(bits)}, ptr %pa{n}"


def _rows(count: int) -> Iterator[str]:
    """The functions of the turns, and where their times are."""
    for n in range(count):
        for letter, number in zip("finw", range(ROWS + ROW * n, ROWS + ROW * n + ROW), strict=True):
            yield f"%{letter}a{n} = getelementptr inbounds i8, ptr %p, i64 {8 * number}"
        yield from (f"%fs{n} = load ptr, ptr %fa{n}", f"%f{n} = load ptr, ptr %fs{n}")


def _watched(first: int, count: int) -> Iterator[str]:
    """Whether anything that is watched is not what is expected; its rows begin with parameter `first`."""
    yield "%j0 = add i1 0, 0"
    for n in range(count):
        at = 8 * (first + WATCHED_ROW * n)
        yield from (f"%joa{n} = getelementptr inbounds i8, ptr %p, i64 {at}", f"%jo{n} = load i64, ptr %joa{n}",
                    f"%jea{n} = getelementptr inbounds i8, ptr %p, i64 {at + 8}", f"%je{n} = load i64, ptr %jea{n}",
                    f"%jma{n} = getelementptr inbounds i8, ptr %m, i64 %jo{n}", f"%jm{n} = load i64, ptr %jma{n}, align 1",
                    f"%jx{n} = icmp ne i64 %jm{n}, %je{n}", f"%j{n + 1} = or i1 %j{n}, %jx{n}")
    yield f"%changed = or i1 %j{count}, 0"


_CHANGED = """store i64 1, ptr %changed_at
ret i32 0"""
_REFRESHED = """%ran = call i32 @companions(ptr %p, i64 %now)
%changed = icmp ne i32 %ran, 0"""
_RAN = """%answer = ashr i32 %ran, 31
ret i32 %answer"""
_REFRESH = f"""
define i32 @refresh(ptr %p) {{
%now_at = getelementptr inbounds i8, ptr %p, i64 {8 * FIRST}
%now = load i64, ptr %now_at
%ran = call i32 @companions(ptr %p, i64 %now)
%answer = ashr i32 %ran, 31
ret i32 %answer
}}
"""


def _turns(intervals: Sequence[bool]) -> Iterator[str]:
    """Which are due is found before the first one runs."""
    for n in (n for n, has in enumerate(intervals) if has):
        yield from (f"%x{n} = load i64, ptr %na{n}", f"%y{n} = icmp sge i64 %now, %x{n}", f"%z{n} = zext i1 %y{n} to i64",
                    f"store i64 %z{n}, ptr %wa{n}", f"br i1 %y{n}, label %due{n}, label %set{n}", f"due{n}:",
                    f"%u{n} = load i64, ptr %ia{n}", f"%l{n} = sub i64 %now, %x{n}", f"%d{n} = udiv i64 %l{n}, %u{n}",
                    f"%e{n} = add i64 %d{n}, 1", f"%g{n} = mul i64 %e{n}, %u{n}", f"%h{n} = add i64 %x{n}, %g{n}",
                    f"store i64 %h{n}, ptr %na{n}", f"br label %set{n}", f"set{n}:")
    for n, has in enumerate(intervals):
        if has:
            yield from (f"%w{n} = load i64, ptr %wa{n}", f"%v{n} = icmp ne i64 %w{n}, 0",
                        f"br i1 %v{n}, label %run{n}, label %over{n}", f"run{n}:")
        else:
            yield from (f"br label %run{n}", f"run{n}:")
        yield from (f"%r{n} = call i32 %f{n}(ptr %m, ptr %c)", f"%t{n} = icmp eq i32 %r{n}, 0",
                    f"br i1 %t{n}, label %over{n}, label %trap", f"over{n}:")


class Series:
    """Scans of one PLC: its memory and context by their addresses, its tasks by their entries, in the order of `turns`.

    In each scan there is a time, nothing is due, the budget is full, the clockwork is written; then the tasks that are
    due take their turns, and the number of scans grows.  `watched` are offsets of eight bytes each, by who watches them: a
    scan after which they are not as `expect` saw them last is the last one.  In place of it there may be `companions`: then
    each scan ends with a refresh, and the one in whose refresh one of them ran is the last one."""

    def __init__(self, memory: Memory, memory_at: int, context_at: int, tasks: Sequence[Entry], turns: Sequence[Turn],
                 clockwork: Clockwork, watched: Sequence[Sequence[int]] = (),
                 companions: Sequence[Companion] = ()) -> None:  # fmt: skip
        rows: list[tuple[int, ...]] = [
            (tasks[turn.task].function_at, turn.interval_ns, turn.next_ns, 0) for turn in turns]  # fmt: skip
        offsets = [offset for group in watched for offset in group]
        rows += [(offset, 0) for offset in offsets]
        self._tasks = tasks  # which stay while machine code calls them
        self.turns = turns
        """These move on, or others of the same tasks."""
        self._timed = [(row, ROWS + ROW * row + 2) for row, turn in enumerate(turns) if turn.interval_ns]
        """Which turns have an interval, and where their next time is."""
        given = {MEMORY: memory_at, CONTEXT: context_at, LEFT: 1, SPEND: NO_LIMIT}
        self.numbers = numbers = array("q", [given.get(number, 0) for number in range(ROWS)])
        """The parameters, for who calls `call` himself."""
        numbers.extend(number for row in rows for number in row)
        at = count(ROWS + ROW * len(turns) + 1, WATCHED_ROW)
        self._expected = [[(memory.u8[offset : offset + WATCHED_BYTES].cast("q"), next(at)) for offset in group]
                          for group in watched]  # fmt: skip
        """What is watched, and where what is expected of it is, by who watches it: of each companion, if there are any."""
        self.companions = companions
        for companion in companions:
            self._expected.append([(view, len(numbers) + at) for view, at in companion.expected(memory)])
            numbers.extend(companion.row(memory_at))
        shape = tuple(turn.interval_ns > 0 for turn in turns), clockwork, len(offsets)
        self.numbers_at = numbers.buffer_info()[0]
        self.call, self.call_refresh = _scans(*shape, tuple(companion.shape for companion in companions))
        """Machine code of scans, and of one refresh: they take the address of the parameters."""

    @property
    def changed(self) -> bool:
        """True if after the last scan something that is watched was not as expected, or a companion ran."""
        return self.numbers[CHANGED] != 0

    def expect(self, number: int) -> None:
        """From now on what this one watches shall be as it is."""
        for view, at in self._expected[number]:
            self.numbers[at] = view[0]

    def load_turns(self) -> None:
        """Take over when the tasks run next."""
        for row, at in self._timed:
            self.numbers[at] = self.turns[row].next_ns

    def store_turns(self) -> None:
        """Give back when the tasks run next."""
        for row, at in self._timed:
            self.turns[row].next_ns = self.numbers[at]

    def once(self, now_ns: int, budget: int) -> int:
        """One scan; the point of its trap, 0, or ASKED."""
        numbers = self.numbers
        numbers[FIRST], numbers[BUDGETED] = now_ns, budget
        if not self._timed:
            return self.call(self.numbers_at)
        self.load_turns()
        point = self.call(self.numbers_at)
        self.store_turns()
        return point

    def run(self, n: int, now_ns: int, step_ns: int, budget: int, spend: int) -> tuple[int, int]:
        """Up to n scans, a step of time between them; how many there were, and what `once` says of the last.

        No other begins when all together have executed `spend` statements."""
        numbers = self.numbers
        numbers[LEFT], numbers[STEP], numbers[SPEND] = n, step_ns, spend
        point = self.once(now_ns, budget)
        numbers[LEFT], numbers[SPEND] = 1, NO_LIMIT
        return numbers[DONE], point


Call = Callable[[int], int]


@cache
def _scans(intervals: tuple[bool, ...], clockwork: Clockwork, watched: int, shapes: tuple[Shape, ...]) -> tuple[Call, Call]:
    """The functions for a shape: scans, and a refresh, which is never called where there are no companions."""
    points = ", ".join(f"[ %r{n}, %run{n} ]" for n in range(len(intervals)))
    first = ROWS + ROW * len(intervals)
    compared = _REFRESHED if shapes else "\n".join(_watched(first, watched))
    text = _SCANS.substitute(rows="\n".join(_rows(len(intervals))), clockwork="\n".join(_clockwork(clockwork)),
                             turns="\n".join(_turns(intervals)), points=points, watched=compared,
                             changed=_RAN if shapes else _CHANGED,
                             companions=companions_text(shapes, first, TOLD) + _REFRESH if shapes else "")  # fmt: skip
    name = name_of("scans", text)
    stored = native_cache.read(name)
    if stored is None:
        stored = Stored({}, compile_text(text, 1))
        native_cache.write(name, stored)
    names = ["scans", "refresh"] if shapes else ["scans"]
    linked = Linked(stored.compiled, names)
    _LOADED.append(linked)
    of_address = ctypes.PYFUNCTYPE(ctypes.c_int32, ctypes.c_void_p)
    return of_address(linked.address(names[0])), of_address(linked.address(names[-1]))


_LOADED: list[Linked] = []
"""What functions that were given out lie in."""
