"""Text of the machine code of scans: what a scan does up to its refresh, several at known times, a burst upon a clock.

It is made for a shape: which of the tasks have an interval, which words tell the program about time, what is watched,
which units there are.  It has no calls but those of the tasks, of units and of the clock."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from string import Template

from fbvm.base.areas import BUDGET, DUE, NEVER, NOW, SCANS
from fbvm.engine.native.scans.date import date_text
from fbvm.engine.native.scans.parameters import COUNT, addresses
from fbvm.engine.native.scans.units import Shape, refresh_text


@dataclass(frozen=True)
class ClockWordTable:
    """What a scan writes at its start from its time alone; offsets in bytes of the buffer."""

    cleared: tuple[tuple[int, int], ...] = ()
    """Words of 16 bits and the bits of them that stay."""
    cycle_time: tuple[int, int, int] | None = None
    """Where 32 bits with the cycle time lie, where those with the longest one, and their unit in nanoseconds."""
    counters: tuple[tuple[int, int], ...] = ()
    """Words of 16 bits that count, and what they count, in nanoseconds."""
    pulses: tuple[tuple[int, int, tuple[tuple[int, int, int], ...]], ...] = ()
    """Bytes, the bits of them that stay, and the others: mask, period, and from when in it they are ON."""
    date: int | None = None
    """Where the four words with the date lie; see `date_text`."""


NO_CLOCK_WORDS = ClockWordTable()
OVER = 0
"""What `@scans` and `@burst` return when all is done: nothing has to be seen to, no program has trapped.  Above 0 they
return the point of a trap."""
ASKED = -1
"""After a scan: units have requests for their networks, or the program of a unit has trapped.  A burst goes on by another
call."""
SCANNED = -2
"""`@burst` after a scan that was not the last, because `is_single` was set.  It goes on by another call."""
ASKED_BEFORE = -3
"""`@burst`, as ASKED, but before its first scan: after the refresh that had been left out."""
REFRESHED = -4
"""`@burst`, as SCANNED, but before its first scan: after the refresh that had been left out."""
TASK_ROW = 4
"""Numbers of 64 bits in the row of a task: where the address of its function lies, interval in ns, time in ns from which on
it is due, whether it is due in this scan."""
NEXT_NS = 2
"""Which of them is the time from which on the task is due."""
WATCHED_ROW = 2
"""Numbers of 64 bits in the row of watched words: their offset in the memory, and the eight bytes that are expected there."""
WATCHED_BYTES = 8
"""How many bytes one row watches."""
PLC_ROW = 2
"""Numbers of 64 bits in the row of a PLC for `@all`: the address of its parameters, how much its time is behind the time told."""
ALL_OVER = -1
"""What `@all` returns when the last PLC has scanned.  Else the number of a PLC that wants something behind its scan, in the upper
32 bits, and what `@scans` has returned for it."""
MOST_CYCLE = 0xFFFF_FFFF
"""The longest cycle time that its words can say."""
SECOND_NS = 1_000_000_000
_SCAN = f"""scan:
%before = load i64, ptr %now_word
store i64 %now, ptr %now_word
store i64 {NEVER}, ptr %due_word
store i64 %amount, ptr %left_word
$clock_words
$tasks
br label %good
good:
%s = load i64, ptr %scans_word
%s1 = add i64 %s, 1
store i64 %s1, ptr %scans_word"""
_TRAP = """trap:
%point = phi i32 $points
%s2 = load i64, ptr %scans_word
%s3 = add i64 %s2, 1
store i64 %s3, ptr %scans_word"""
_SCANS = Template(f"""
define i32 @scans(ptr %p) {{
entry:
$addresses
$rows
store i64 0, ptr %changed_at
%n = load i64, ptr %most_scans_at
%first = load i64, ptr %time_ns_at
%step = load i64, ptr %step_ns_at
%spend = load i64, ptr %spend_at
br label %test
test:
%i = phi i64 [ 0, %entry ], [ %i1, %good ]
%now = phi i64 [ %first, %entry ], [ %next, %good ]
%spent = phi i64 [ 0, %entry ], [ %spent1, %good ]
%more = icmp slt i64 %i, %n
%rest = icmp slt i64 %spent, %spend
%go = and i1 %more, %rest
br i1 %go, label %scan, label %end
{_SCAN}
%left = load i64, ptr %left_word
%used = sub i64 %amount, %left
%spent1 = add i64 %spent, %used
%i1 = add i64 %i, 1
%next = add i64 %now, %step
$watched
br i1 %changed, label %stop, label %test
stop:
store i64 %i1, ptr %done_at
$changed
{_TRAP}
%i2 = add i64 %i, 1
store i64 %i2, ptr %done_at
ret i32 %point
end:
store i64 %i, ptr %done_at
ret i32 0
}}
define i64 @all(ptr %rows, i64 %first, i64 %count, i64 %now) {{
entry:
br label %test
test:
%i = phi i64 [ %first, %entry ], [ %i1, %next ]
%more = icmp slt i64 %i, %count
br i1 %more, label %one, label %over
one:
%number = mul i64 %i, {PLC_ROW}
%row = getelementptr inbounds i64, ptr %rows, i64 %number
%p = load ptr, ptr %row
%behind_at = getelementptr inbounds i64, ptr %row, i64 1
%behind = load i64, ptr %behind_at
$addresses_of_one
%own = sub i64 %now, %behind
store i64 %own, ptr %time_ns_at
%point = call i32 @scans(ptr %p)
%changed = load i64, ptr %changed_at
%quiet = icmp eq i64 %changed, 0
%good = icmp eq i32 %point, 0
%nothing = and i1 %quiet, %good
br i1 %nothing, label %next, label %wants
next:
%i1 = add i64 %i, 1
br label %test
wants:
%low = zext i32 %point to i64
%high = shl i64 %i, 32
%answer = or i64 %high, %low
ret i64 %answer
over:
ret i64 {ALL_OVER}
}}
$burst
declare i32 @llvm.umax.i32(i32, i32)
declare i64 @llvm.umin.i64(i64, i64)
declare i64 @llvm.smax.i64(i64, i64)
""")
_BURST = Template(f"""
define internal i64 @clock_time(ptr %p) {{
$addresses
%spec = alloca [2 x i64]
%part_at = getelementptr inbounds i8, ptr %spec, i64 8
%clock = load ptr, ptr %clock_function_at
%number = load i32, ptr %clock_number_at
%told = call i32 %clock(i32 signext %number, ptr %spec)
%whole = load i64, ptr %spec
%part = load i64, ptr %part_at
%ns = mul i64 %whole, {SECOND_NS}
%time = add i64 %ns, %part
%zero = load i64, ptr %clock_zero_ns_at
%less = sub i64 %time, %zero
ret i64 %less
}}
define i32 @burst(ptr %p) {{
entry:
$addresses
$rows
%alone = load i64, ptr %is_single_at
%single = icmp ne i64 %alone, 0
store i64 0, ptr %is_single_at
%ends = load i64, ptr %times_end_at
%given = load i64, ptr %time_ns_at
%known = load i64, ptr %is_time_known_at
%is_known = icmp ne i64 %known, 0
br i1 %is_known, label %start, label %look
look:
%looked = call i64 @clock_time(ptr %p)
store i64 %looked, ptr %time_ns_at
br label %start
start:
%first = phi i64 [ %given, %entry ], [ %looked, %look ]
%deferred = load i64, ptr %refresh_first_at
%late = icmp ne i64 %deferred, 0
br i1 %late, label %refresh, label %ready
refresh:
store i64 0, ptr %refresh_first_at
%early = call i32 @refresh(ptr %p, i64 %first)
%asks = icmp slt i32 %early, 0
%back = or i1 %asks, %single
br i1 %back, label %refreshed, label %uncollected
refreshed:
store i64 1, ptr %is_time_known_at
%before_scan = select i1 %asks, i32 {ASKED_BEFORE}, i32 {REFRESHED}
br label %return
uncollected:
store i64 0, ptr %events_collected_at
br label %ready
ready:
store i64 0, ptr %is_time_known_at
%at0 = load i64, ptr %times_at
br label %begin
begin:
%now = phi i64 [ %first, %ready ], [ %next, %follow ]
%at = phi i64 [ %at0, %ready ], [ %at1, %follow ]
%time_at = inttoptr i64 %at to ptr
store i64 %now, ptr %time_at
%at1 = add i64 %at, 8
store i64 %at1, ptr %times_at
store i64 %now, ptr %time_ns_at
store i64 0, ptr %changed_at
br label %scan
{_SCAN}
%ran = call i32 @refresh(ptr %p, i64 %now)
%again = load i64, ptr %again_at
%wanted = icmp ne i64 %again, 0
%more = icmp ult i64 %at1, %ends
%go = and i1 %wanted, %more
br i1 %go, label %on, label %over
on:
%urgent = icmp slt i32 %ran, 0
%away = or i1 %urgent, %single
br i1 %away, label %scanned, label %follow
scanned:
%after_scan = select i1 %urgent, i32 {ASKED}, i32 {SCANNED}
br label %return
follow:
store i64 0, ptr %events_collected_at
%next = call i64 @clock_time(ptr %p)
br label %begin
return:
%answer = phi i32 [ %before_scan, %refreshed ], [ %after_scan, %scanned ]
%collected = load i64, ptr %events_collected_at
%stays = select i1 %single, i64 %collected, i64 0
store i64 %stays, ptr %events_collected_at
ret i32 %answer
over:
ret i32 {OVER}
{_TRAP}
ret i32 %point
}}
""")


def text(intervals: Sequence[bool], clock_words: ClockWordTable, watched: int, shapes: Sequence[Shape]) -> str:
    """The functions @scans and, where there are units, @burst: both take the address of the parameters, and return
    a trap's point, ASKED, 0, or what else there is for a burst.  @all is a scan of each of several PLCs, from one on up to the
    first that wants something: watched words have changed, the program of a unit has run, or a trap."""
    first = COUNT + TASK_ROW * len(intervals)
    parts = {"addresses": _lines(_addresses()), "addresses_of_one": _lines(addresses()), "rows": _lines(_rows(len(intervals))),
             "clock_words": _lines(_clock_words(clock_words)), "tasks": _lines(_tasks(intervals)),
             "points": ", ".join(f"[ %r{n}, %run{n} ]" for n in range(len(intervals)))}  # fmt: skip
    if shapes:
        burst = refresh_text(shapes, first) + _BURST.substitute(parts)
        return _SCANS.substitute(parts, watched=_REFRESHED, changed=_RAN, burst=burst)
    return _SCANS.substitute(parts, watched=_lines(_watched(first, watched)), changed=_CHANGED, burst="")


def _lines(lines: Iterable[str]) -> str:
    return "\n".join(lines)


def _addresses() -> Iterator[str]:
    """Where the parameters are, and the words of the system page; some of them as they stay."""
    yield from addresses()
    yield from ("%m = load ptr, ptr %memory_at", "%c = load ptr, ptr %context_at", "%amount = load i64, ptr %scan_budget_at")
    for name, offset in {"now": NOW, "due": DUE, "left": BUDGET, "scans": SCANS}.items():
        yield f"%{name}_word = getelementptr inbounds i8, ptr %m, i64 {offset}"


def _clock_words(row: ClockWordTable) -> Iterator[str]:
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
    if row.date is not None:
        yield from date_text(row.date)


def _rows(count: int) -> Iterator[str]:
    """The addresses of the tasks' functions, and where their rows are."""
    for n in range(count):
        for letter, number in zip("finw", range(COUNT + TASK_ROW * n, COUNT + TASK_ROW * (n + 1)), strict=True):
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
_REFRESHED = """%ran = call i32 @refresh(ptr %p, i64 %now)
%changed = icmp ne i32 %ran, 0"""
_RAN = """%answer = ashr i32 %ran, 31
ret i32 %answer"""


def _tasks(intervals: Sequence[bool]) -> Iterator[str]:
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
