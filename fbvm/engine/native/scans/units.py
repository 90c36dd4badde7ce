"""Units inside machine code: their programs, over memories of their own, run in the I/O refresh of a PLC's scans.

In a refresh a unit's program runs if something that the unit watches in the PLC's memory is not as its last run left it, if
events are posted for it, or if its time has come.  Then the exchanged words are copied into the unit's memory, the program is
executed once, and the words are copied back."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum, auto
from string import Template

from fbvm.base.areas import BUDGET, DUE, NEVER, NOW
from fbvm.engine.native.scans.parameters import addresses
from fbvm.engine.trap import Trap

STATEMENTS = 2_000_000
"""How many a unit's program may execute in a run."""
CHANGED_WORDS, AT_ONCE = 1, 2
"""Why there should be another scan soon, as bits of `Slot.AGAIN`: units changed words that the program may look at, a unit
has more to do."""


@dataclass(frozen=True)
class FieldAt:
    """An unsigned integer in a row: its offset in bytes, and its width."""

    offset: int
    bits: int


@dataclass(frozen=True, kw_only=True)
class MoveShape:
    """What a row says of a block of bytes that is to be moved from a ring into the PLC's memory, as
    `fbvm.units.contract.MOVE_FIELDS` has it, and what the rings are."""

    row_bytes: int
    target: FieldAt
    ring: FieldAt
    place: FieldAt
    size: FieldAt
    filler: FieldAt
    ring_bytes: int
    """A power of two."""
    first_ring: int
    """What `ring` says of the first one."""


@dataclass(frozen=True, kw_only=True)
class MovesAt:
    """Where in a unit's memory the number of such rows (32 bits), the rows and the rings lie, in bytes."""

    count: int
    rows: int
    rings: int
    shape: MoveShape


@dataclass(frozen=True)
class Shape:
    """What the machine code of a unit is made for; units of one shape share it."""

    copies: tuple[int, ...]
    """Bytes of each block of words that is exchanged."""
    watched: int
    """How many groups of eight bytes are watched."""
    unfinished: int
    """In how many places the program may leave something."""
    moves: MoveShape | None

    @property
    def size(self) -> int:
        """How many parameters a unit of this shape has."""
        return len(UnitSlot) + 2 * (len(self.copies) + self.watched) + self.unfinished


class UnitSlot(IntEnum):
    """Parameters of a unit by their numbers, 64 bits each: addresses.  Behind them come for each block of words the address in
    the PLC's memory and the one in the unit's, for each watched group its address and what is expected there, and the
    addresses of what may be left unfinished."""

    FUNCTION = 0  # where the address of the program's function lies, which may be another one later
    MEMORY = auto()  # the unit's memory
    CONTEXT = auto()  # what the program's machine code keeps beside that memory
    POSTED = auto()  # 32 bits: how many events wait for the program
    URGENT = auto()  # 32 bits: how many requests cannot wait for the end of a burst
    WAKE = auto()  # 64 bits: time in ns from which on the program is to run
    MOVED = auto()  # 32 bits: how many blocks are to be moved
    MOVES = auto()  # the rows of these
    RINGS = auto()  # the rings in which they lie


@dataclass(frozen=True, kw_only=True)
class UnitExchange:
    """What a unit's program exchanges with the PLC in a refresh.  Offsets are in bytes of the unit's memory, but for those
    that say otherwise."""

    copies: tuple[tuple[int, int, int], ...]
    """Of each block of words: offset in the PLC's memory, offset in the unit's, how many bytes."""
    watched: tuple[int, ...]
    """Offsets in the PLC's memory of eight bytes each."""
    posted: int
    urgent: int
    unfinished: tuple[int, ...]
    """32 bits each; if one is not 0 after a run, Python has something to do before events are posted again."""
    wake: int
    moves: MovesAt | None = None


@dataclass(frozen=True)
class UnitInCode:
    """A unit whose program runs inside machine code: the program, and what it exchanges."""

    function_at: int
    """The address where the address of its function lies, at any time."""
    memory_at: int
    context_at: int
    trap_at: Callable[[int], Trap]
    """The trap that a point of its code stands for."""
    exchange: UnitExchange

    @property
    def shape(self) -> Shape:
        """What its machine code depends on."""
        exchange = self.exchange
        return Shape(tuple(size for _, _, size in exchange.copies), len(exchange.watched), len(exchange.unfinished),
                     exchange.moves.shape if exchange.moves else None)  # fmt: skip

    def parameters(self, memory_at: int) -> Iterator[int]:
        """Its parameters beside a PLC whose memory has this address; as expected on what is watched stands 0."""
        own, exchange, moves = self.memory_at, self.exchange, self.exchange.moves
        slots = {
            UnitSlot.FUNCTION: self.function_at, UnitSlot.MEMORY: own, UnitSlot.CONTEXT: self.context_at,
            UnitSlot.POSTED: own + exchange.posted, UnitSlot.URGENT: own + exchange.urgent, UnitSlot.WAKE: own + exchange.wake,
        }  # fmt: skip
        if moves:
            slots |= {UnitSlot.MOVED: own + moves.count, UnitSlot.MOVES: own + moves.rows, UnitSlot.RINGS: own + moves.rings}
        yield from (slots.get(slot, 0) for slot in UnitSlot)
        for offset, own_offset, _ in exchange.copies:
            yield from (memory_at + offset, own + own_offset)
        for offset in exchange.watched:
            yield from (memory_at + offset, 0)
        yield from (own + offset for offset in exchange.unfinished)

    @property
    def expected(self) -> list[tuple[int, int]]:
        """For each watched group its offset in the PLC's memory, and the number of the parameter with what is expected there."""
        first = len(UnitSlot) + 2 * len(self.exchange.copies) + 1
        return [(offset, first + 2 * number) for number, offset in enumerate(self.exchange.watched)]


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
$unfinished
%bits = select i1 %unfinished, i64 %bit, i64 0
%before = load i64, ptr %unfinished_at
%all = or i64 %before, %bits
store i64 %all, ptr %unfinished_at
%urgent = load i32, ptr %urgent_at
%asks = icmp ne i32 %urgent, 0
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
_MOVES = Template("""
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
$fields
%target = getelementptr inbounds i8, ptr %plc_in, i64 %target_in
%ring_number = sub i64 %ring_in, $first_ring
%ring_by = mul i64 %ring_number, $ring_bytes
%ring = getelementptr inbounds i8, ptr %rings_at, i64 %ring_by
br label %byte
byte:
%j = phi i64 [ 0, %move ], [ %j1, %store ]
%inside = icmp ult i64 %j, %size_in
br i1 %inside, label %store, label %last
store:
%from = add i64 %place_in, %j
%from_by = and i64 %from, $mask
%from_at = getelementptr inbounds i8, ptr %ring, i64 %from_by
%value = load i8, ptr %from_at
%to_by = xor i64 %j, 1
%to_at = getelementptr inbounds i8, ptr %target, i64 %to_by
store i8 %value, ptr %to_at
%j1 = add i64 %j, 1
br label %byte
last:
%odd = and i64 %size_in, 1
%is_odd = icmp ne i64 %odd, 0
%fills = icmp ult i64 %filler_in, 256
%both = and i1 %is_odd, %fills
br i1 %both, label %fill, label %passed
fill:
%low_by = xor i64 %size_in, 1
%low_at = getelementptr inbounds i8, ptr %target, i64 %low_by
%low_value = trunc i64 %filler_in to i8
store i8 %low_value, ptr %low_at
br label %passed
passed:
%k1 = add i32 %k, 1
%row_next = getelementptr inbounds i8, ptr %row_in, i64 $row_bytes
br label %row
quiet:
""")
"""Blocks of bytes go into the PLC's memory, the high byte of a word first."""
_REFRESH = Template("""
define internal i32 @refresh(ptr %p, i64 %now) {
$parameters
store i64 0, ptr %changed_at
store i64 0, ptr %again_at
$calls
ret i32 %any$count
}
""")


def refresh_text(shapes: Sequence[Shape], first: int) -> str:
    """The text of the function @refresh(parameters, now): one I/O refresh of units of these shapes, whose parameters begin
    with number `first`.

    The function returns 0 if no program ran, 1 if one did, -1 if Python has to look at once: there are urgent requests, or a
    trap."""
    kinds = list(dict.fromkeys(shapes))
    functions = [_unit_text(number, shape) for number, shape in enumerate(kinds)]
    calls = ["%any0 = add i32 0, 0"]
    for number, shape in enumerate(shapes):
        calls += [_address(f"w{number}", "p", first),
                  f"%a{number} = call i32 @unit{kinds.index(shape)}(ptr %p, ptr %w{number}, i64 %now, i64 {1 << number})",
                  f"%any{number + 1} = or i32 %any{number}, %a{number}"]  # fmt: skip
        first += shape.size
    return "".join(functions) + _REFRESH.substitute(parameters=_lines(addresses()), calls=_lines(calls), count=len(shapes))


def _unit_text(number: int, shape: Shape) -> str:
    """The function for units of a shape."""
    watched_from = len(UnitSlot) + 2 * len(shape.copies)
    return _UNIT.substitute(
        number=number, fields=_lines(_fields()), watched=_lines(_watched(watched_from, shape.watched)),
        into=_lines(_into(shape.copies)), outof=_lines(_out_of(shape.copies)), expected=_lines(_expected(shape.watched)),
        copies=len(shape.copies), moves=_moves(shape.moves) if shape.moves else "",
        unfinished=_lines(_unfinished(watched_from + 2 * shape.watched, shape.unfinished)))  # fmt: skip


def _lines(lines: Iterable[str]) -> str:
    return "\n".join(lines)


def _address(name: str, base: str, number: int) -> str:
    """The address of a number."""
    return f"%{name} = getelementptr inbounds i8, ptr %{base}, i64 {8 * number}"


def _loaded(name: str, number: int, kind: str = "ptr") -> Iterator[str]:
    """A number of the row."""
    yield from (_address(f"{name}_in", "w", number), f"%{name} = load {kind}, ptr %{name}_in")


def _fields() -> Iterator[str]:
    """The names that a unit's function uses: slots of all scans, and of the unit."""
    yield from addresses()
    short = {UnitSlot.MEMORY: "m", UnitSlot.CONTEXT: "c"}
    for slot in UnitSlot:
        yield from _loaded(short.get(slot, f"{slot.name.lower()}_at"), slot)


def _moves(shape: MoveShape) -> str:
    """Moves all blocks that the program left."""
    fields = {"target": shape.target, "ring": shape.ring, "place": shape.place, "size": shape.size, "filler": shape.filler}
    loads = [line for name, field in fields.items() for line in (
        f"%{name}_field = getelementptr inbounds i8, ptr %row_in, i64 {field.offset}",
        f"%{name}_value = load i{field.bits}, ptr %{name}_field",
        f"%{name}_in = zext i{field.bits} %{name}_value to i64" if field.bits < 64 else f"%{name}_in = or i64 %{name}_value, 0")]
    return _MOVES.substitute(fields=_lines(loads), first_ring=shape.first_ring, ring_bytes=shape.ring_bytes,
                             mask=shape.ring_bytes - 1, row_bytes=shape.row_bytes)  # fmt: skip


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


def _unfinished(first: int, places: int) -> Iterator[str]:
    """Whether the program left anything."""
    yield "%l0 = add i32 0, 0"
    for n in range(places):
        yield from _loaded(f"lp{n}", first + n)
        yield from (f"%lv{n} = load i32, ptr %lp{n}", f"%l{n + 1} = or i32 %l{n}, %lv{n}")
    yield f"%unfinished = icmp ne i32 %l{places}, 0"


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
        yield from _loaded(f"o{n}", len(UnitSlot) + 2 * n)
        yield from _loaded(f"i{n}", len(UnitSlot) + 2 * n + 1)
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
