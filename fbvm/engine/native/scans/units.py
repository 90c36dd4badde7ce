"""Units in code: programs over memories of their own that machine code runs inside the scans of a PLC, where the I/O refresh is.

Such a unit runs when something that it watches in the PLC's memory is not as its last run left it, when something is
posted for it, or when its time has come.  Then words go into its memory, it is executed once, and they come back."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from string import Template

from fbvm.base.areas import BUDGET, DUE, NEVER, NOW
from fbvm.base.memory import Memory
from fbvm.engine.native.scans.slots import addresses_of_slots
from fbvm.engine.trap import Trap

STATEMENTS = 2_000_000
"""How many it may execute in a run."""
Shape = tuple[tuple[int, ...], int, int, int]
"""Bytes of each copy, how many groups are watched, in how many places something may be left, bytes of a ring or 0: what its
machine code is made for."""
MOVE_BYTES = 20
"""Of a row of what is to be moved (`fbvm.units.contract.Moves`)."""


@dataclass(frozen=True)
class UnitInCode:
    """Where the program of a unit is and what it is to see.  Offsets are in bytes."""

    function_at: int
    """Where the address of what it executes lies, at any time."""
    memory_at: int
    context_at: int
    trap_at: Callable[[int], Trap]
    """What a point of its code says."""
    copies: tuple[tuple[int, int, int], ...]
    """Offset in the PLC's memory, offset in its own, how many bytes."""
    watched: tuple[int, ...]
    """Offsets in the PLC's memory of eight bytes each."""
    posted: int
    """Offset in its memory of 32 bits that are not 0 if something waits for it."""
    requested: int
    """Offset in its memory of 32 bits with the number of requests that it has left and somebody has to see at once."""
    left: tuple[int, ...]
    """Offsets in its memory of 32 bits each; somebody has to see to it sometime if one of them is not 0."""
    wake: int
    """Offset in its memory of 64 bits without sign: the time from which on it is to run."""
    moves: tuple[int, int, int] = (0, 0, 0)
    """Offsets in its memory of how many blocks are to be moved, and of their rows; bytes of a ring, 0 if it moves nothing."""

    @property
    def shape(self) -> Shape:
        """What its machine code depends on."""
        return tuple(size for _, _, size in self.copies), len(self.watched), len(self.left), self.moves[2]

    def row(self, memory_at: int) -> Iterator[int]:
        """Its parameters: addresses, and for what is watched what is expected there."""
        own = self.memory_at
        yield from (self.function_at, own, self.context_at, own + self.posted, own + self.requested, own + self.wake)
        yield from (own + self.moves[0], own + self.moves[1])
        for offset, its_offset, _ in self.copies:
            yield from (memory_at + offset, own + its_offset)
        for offset in self.watched:
            yield from (memory_at + offset, 0)
        yield from (own + offset for offset in self.left)

    def expected(self, memory: Memory) -> list[tuple[memoryview, int]]:
        """What is watched, and which number of the row says what is expected there."""
        first = HEAD + 2 * len(self.copies) + 1
        return [(memory.u8[offset : offset + 8].cast("q"), first + 2 * number) for number, offset in enumerate(self.watched)]


FUNCTION, MEMORY, CONTEXT, POSTED, REQUESTED, WAKE, MOVED, MOVES, HEAD = range(9)
"""Numbers of a unit's row, before those of copies and of what is watched, two for each, and of what may be left."""
CHANGED_WORDS, AT_ONCE = 1, 2
"""Why there should be another scan soon: words have changed that the program may look at, a unit has more to do."""


_UNIT = Template(f"""
define internal i32 @unit$number(ptr %p, ptr %w, i64 %now, i64 %bit) {{
entry:
$fields
$watched
%posted = load i32, ptr %posted_at
%told = icmp ne i32 %posted, 0
%wake = load i64, ptr %wake_at
%due = icmp uge i64 %now, %wake
%moved = or i1 %changed, %told
%wanted = or i1 %moved, %due
br i1 %wanted, label %run, label %rest
rest:
ret i32 0
run:
$into
%now_at = getelementptr inbounds i8, ptr %m, i64 {NOW}
%due_at = getelementptr inbounds i8, ptr %m, i64 {DUE}
%budget_at = getelementptr inbounds i8, ptr %m, i64 {BUDGET}
store i64 %now, ptr %now_at
store i64 {NEVER}, ptr %due_at
store i64 {STATEMENTS}, ptr %budget_at
%f = load ptr, ptr %function_at
%point = call i32 %f(ptr %m, ptr %c)
%ran = load i64, ptr %changed_at
%ran1 = or i64 %ran, %bit
store i64 %ran1, ptr %changed_at
%sound = icmp eq i32 %point, 0
br i1 %sound, label %out, label %trap
out:
$outof
$expected
$moves
%next = load i64, ptr %wake_at
%late = icmp uge i64 %now, %next
%at_once = select i1 %late, i64 {AT_ONCE}, i64 0
%changed_words = icmp ne i64 %x$copies, 0
%again = select i1 %changed_words, i64 {CHANGED_WORDS}, i64 0
%again1 = or i64 %again, %at_once
%again2 = load i64, ptr %again_at
%again3 = or i64 %again1, %again2
store i64 %again3, ptr %again_at
$left
%bits = select i1 %left, i64 %bit, i64 0
%before = load i64, ptr %unfinished_at
%all = or i64 %before, %bits
store i64 %all, ptr %unfinished_at
%requested = load i32, ptr %requested_at
%asks = icmp ne i32 %requested, 0
%answer = select i1 %asks, i32 -1, i32 1
ret i32 %answer
trap:
%number = zext i32 %point to i64
store i64 %bit, ptr %faulty_at
store i64 %number, ptr %point_at
%others = load i64, ptr %unfinished_at
%trapped = or i64 %others, %bit
store i64 %trapped, ptr %unfinished_at
ret i32 -1
}}
""")
_MOVES = Template(f"""
%plc_in = load ptr, ptr %memory_at
%count = load i32, ptr %moved_at
store i32 0, ptr %moved_at
br label %row
row:
%k = phi i32 [ 0, %out ], [ %k1, %passed ]
%row_in = phi ptr [ %moves_at, %out ], [ %row_next, %passed ]
%more = icmp ult i32 %k, %count
br i1 %more, label %move, label %quiet
move:
%target_in = load i32, ptr %row_in
%target_by = zext i32 %target_in to i64
%target = getelementptr inbounds i8, ptr %plc_in, i64 %target_by
%ring_at = getelementptr inbounds i8, ptr %row_in, i64 4
%ring_in = load i32, ptr %ring_at
%ring_by = zext i32 %ring_in to i64
%ring = getelementptr inbounds i8, ptr %m, i64 %ring_by
%place_at = getelementptr inbounds i8, ptr %row_in, i64 8
%place = load i32, ptr %place_at
%size_at = getelementptr inbounds i8, ptr %row_in, i64 12
%size_in = load i16, ptr %size_at
%size = zext i16 %size_in to i32
%filler_at = getelementptr inbounds i8, ptr %row_in, i64 14
%filler = load i16, ptr %filler_at
br label %byte
byte:
%j = phi i32 [ 0, %move ], [ %j1, %store ]
%inside = icmp ult i32 %j, %size
br i1 %inside, label %store, label %last
store:
%from = add i32 %place, %j
%in_ring = and i32 %from, $mask
%from_by = zext i32 %in_ring to i64
%from_at = getelementptr inbounds i8, ptr %ring, i64 %from_by
%value = load i8, ptr %from_at
%turned = xor i32 %j, 1
%to_by = zext i32 %turned to i64
%to_at = getelementptr inbounds i8, ptr %target, i64 %to_by
store i8 %value, ptr %to_at
%j1 = add i32 %j, 1
br label %byte
last:
%odd = and i32 %size, 1
%is_odd = icmp ne i32 %odd, 0
%fills = icmp ult i16 %filler, 256
%both = and i1 %is_odd, %fills
br i1 %both, label %fill, label %passed
fill:
%low = xor i32 %size, 1
%low_by = zext i32 %low to i64
%low_at = getelementptr inbounds i8, ptr %target, i64 %low_by
%low_value = trunc i16 %filler to i8
store i8 %low_value, ptr %low_at
br label %passed
passed:
%k1 = add i32 %k, 1
%row_next = getelementptr inbounds i8, ptr %row_in, i64 {MOVE_BYTES}
br label %row
quiet:
""")
"""Blocks of bytes go into the PLC's memory, the high byte of a word first."""
_REFRESH = Template("""
define internal i32 @refresh(ptr %p, i64 %now) {
$slots
store i64 0, ptr %changed_at
store i64 0, ptr %again_at
$calls
ret i32 %any$count
}
""")


def refresh_text(shapes: Sequence[Shape], first: int) -> str:
    """The function @refresh, for parameters in which their rows begin with number `first`: a refresh at a time.

    It returns 0 if none ran, 1 if one did, -1 if somebody has to look at once: there are requests, or a trap."""
    kinds = list(dict.fromkeys(shapes))
    functions = [_UNIT.substitute(
        number=number, fields=_lines(_fields()), watched=_lines(_watched(HEAD + 2 * len(copies), groups)),
        into=_lines(_into(copies)), outof=_lines(_out_of(copies)), expected=_lines(_expected(groups)), copies=len(copies),
        moves=_MOVES.substitute(mask=ring - 1) if ring else "",
        left=_lines(_left(HEAD + 2 * (len(copies) + groups), places)),
    ) for number, (copies, groups, places, ring) in enumerate(kinds)]  # fmt: skip
    calls = ["%any0 = add i32 0, 0"]
    for number, shape in enumerate(shapes):
        calls += [_address(f"w{number}", "p", first),
                  f"%a{number} = call i32 @unit{kinds.index(shape)}(ptr %p, ptr %w{number}, i64 %now, i64 {1 << number})",
                  f"%any{number + 1} = or i32 %any{number}, %a{number}"]  # fmt: skip
        first += size(shape)
    return "".join(functions) + _REFRESH.substitute(slots=_lines(addresses_of_slots()), calls=_lines(calls), count=len(shapes))


def size(shape: Shape) -> int:
    """Numbers of a row."""
    copies, groups, places, _ = shape
    return HEAD + 2 * (len(copies) + groups) + places


def _lines(lines: Iterable[str]) -> str:
    return "\n".join(lines)


def _address(name: str, base: str, number: int) -> str:
    """The address of a number."""
    return f"%{name} = getelementptr inbounds i8, ptr %{base}, i64 {8 * number}"


def _loaded(name: str, number: int, kind: str = "ptr") -> Iterator[str]:
    """A number of the row."""
    yield from (_address(f"{name}_in", "w", number), f"%{name} = load {kind}, ptr %{name}_in")


def _fields() -> Iterator[str]:
    """The names that a unit's function uses."""
    yield from addresses_of_slots()
    for number, name in enumerate((
            "function_at", "m", "c", "posted_at", "requested_at", "wake_at", "moved_at", "moves_at")):
        yield from _loaded(name, number)


def _watched(first: int, groups: int) -> Iterator[str]:
    """Whether anything that is watched is not what is expected."""
    yield "%v0 = add i1 0, 0"
    for n in range(groups):
        yield from _loaded(f"vp{n}", first + 2 * n)
        yield from _loaded(f"ve{n}", first + 2 * n + 1, "i64")
        yield from (f"%vm{n} = load i64, ptr %vp{n}, align 1", f"%vx{n} = icmp ne i64 %vm{n}, %ve{n}",
                    f"%v{n + 1} = or i1 %v{n}, %vx{n}")  # fmt: skip
    yield f"%changed = or i1 %v{groups}, 0"


def _expected(groups: int) -> Iterator[str]:
    """What is watched is expected to stay as it is."""
    for n in range(groups):
        yield from (f"%en{n} = load i64, ptr %vp{n}, align 1", f"store i64 %en{n}, ptr %ve{n}_in")


def _left(first: int, places: int) -> Iterator[str]:
    """Whether anything is left."""
    yield "%l0 = add i32 0, 0"
    for n in range(places):
        yield from _loaded(f"lp{n}", first + n)
        yield from (f"%lv{n} = load i32, ptr %lp{n}", f"%l{n + 1} = or i32 %l{n}, %lv{n}")
    yield f"%left = icmp ne i32 %l{places}, 0"


def _pieces(bytes_: int) -> Iterator[tuple[int, int]]:
    """Where the pieces of so many bytes begin, and how many bits they have."""
    at = 0
    for wide in (8, 4, 2, 1):
        while bytes_ - at >= wide:
            yield at, 8 * wide
            at += wide


def _into(copies: Sequence[int]) -> Iterator[str]:
    """The PLC's words go into the unit's memory."""
    for n, bytes_ in enumerate(copies):
        yield from _loaded(f"o{n}", HEAD + 2 * n)
        yield from _loaded(f"i{n}", HEAD + 2 * n + 1)
        for at, bits in _pieces(bytes_):
            yield from (f"%op{n}.{at} = getelementptr inbounds i8, ptr %o{n}, i64 {at}",
                        f"%ip{n}.{at} = getelementptr inbounds i8, ptr %i{n}, i64 {at}",
                        f"%ov{n}.{at} = load i{bits}, ptr %op{n}.{at}, align 1",
                        f"store i{bits} %ov{n}.{at}, ptr %ip{n}.{at}, align 1")  # fmt: skip


def _out_of(copies: Sequence[int]) -> Iterator[str]:
    """They come back; whatever has changed is a bit of %x and the number of copies."""
    yield "%x0 = add i64 0, 0"
    for n, bytes_ in enumerate(copies):
        last = f"%x{n}"
        for at, bits in _pieces(bytes_):
            name = f"{n}.{at}"
            yield from (f"%in{name} = load i{bits}, ptr %ip{name}, align 1", f"%on{name} = load i{bits}, ptr %op{name}, align 1",
                        f"store i{bits} %in{name}, ptr %op{name}, align 1", f"%d{name} = xor i{bits} %in{name}, %on{name}",
                        f"%dw{name} = " + (f"zext i{bits} %d{name} to i64" if bits < 64 else f"or i64 %d{name}, 0"),
                        f"%do{name} = or i64 {last}, %dw{name}")  # fmt: skip
            last = f"%do{name}"
        yield f"%x{n + 1} = or i64 {last}, 0"
