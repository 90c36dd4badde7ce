"""Writes the LLVM text of one body: names, blocks, addresses, traps and constants, for the rows of operations.

A body becomes a function `i64 (ptr %m, ptr %c, i64 %self, i64 %left)`, whose arguments are the flat memory, the context (see
`emit.context`), the byte at which its instance begins, and the step budget that is left.  The function returns the budget
that is left then; or, far below 0, the point at which the run ends early, whose values are in the context.  The budget is
stored in memory whenever it changes but not read from there, which would make each charge wait for the one before."""

from __future__ import annotations

import struct
from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from fbvm.base.areas import BUDGET
from fbvm.base.arithmetic import single
from fbvm.code.image import Image
from fbvm.code.operations import BUFFER_OBJECT, OBJECT_SHIFT, OFFSET_MASK, OFFSET_SHIFT, Address, Block, Node
from fbvm.engine.native.emit.alias_scopes import SYSTEM, AliasScopes
from fbvm.engine.native.emit.call_graph import Range
from fbvm.engine.native.emit.context import FIELDS, INSTANCE, SCRATCH, Point, Shown
from fbvm.engine.native.emit.counting import BodyCounting, Counting
from fbvm.engine.ranges import is_float, with_temporaries
from fbvm.engine.trap import NO_INSTANCE

NAN_BITS = {"f32": "0x7FF8000000000000", "f64": "0x7FF8000000000000"}
"""The canonical NaN as LLVM writes it; a float's digits are those of the double of that value."""
ENDED = -(1 << 63)
"""A body that ends at point n returns ENDED + n."""
TRAPPED = -(1 << 62)
"""A number below is a point, one above a budget."""
RARE = "!prof !0"
"""The metadata of a branch whose first target is hardly ever taken."""


STOPPABLE = ("statement", "rung", "write")
"""The kinds of observations at which a run can stop."""


def ir(machine: str) -> str:
    """LLVM's type for values of a machine type."""
    return _IR[machine]


_IR = {"b": "i1", "f32": "float", "f64": "double", "ref": "i64",
       **{f"{sign}{bits}": f"i{bits}" for sign in "iu" for bits in (8, 16, 32, 64)}}


def stored(machine: str) -> str:
    """LLVM's type for a machine type in memory, where a BOOL takes a byte."""
    return "i8" if machine == "b" else ir(machine)


def signed(machine: str) -> bool:
    return machine[0] == "i"


def literal(machine: str, value: Any) -> str:
    """LLVM's text of a constant of a machine type."""
    if machine == "b":
        return "true" if value else "false"
    if not is_float(machine):
        return str(int(value))
    if value != value:
        return NAN_BITS[machine]
    number = single(value) if machine == "f32" else float(value)
    return f"0x{struct.unpack('<Q', struct.pack('<d', number))[0]:016X}"


def _is_seen_later(node: Node, following: Node | None) -> bool:
    """True for the observation of a write behind which nothing happens up to the next one: that one sees the write as well."""
    return (following is not None and node[:2] == ("observe", "write")
            and following[0] == "observe" and following[1] in STOPPABLE)  # fmt: skip


class Text(NamedTuple):
    """A string value: the names of a pointer to its characters and of their number, and the bytes of one character."""

    at: str
    length: str
    unit: int = 1


class Unsupported(ValueError):
    """An image has code that this engine cannot translate.  The compiler never makes such code; the message says what it is."""


@dataclass
class Module:
    """What the bodies of an image share: points, constants, names of routines that are called, bytes of the context.

    `bases` is where the instance of a body with one instance begins, `instances` the range in which those of any body begin,
    `heights` how many calls are nested below a body, all by the number of the body."""

    image: Image
    bases: Mapping[int, int]
    instances: Mapping[int, Range]
    heights: Mapping[int, int]
    points: list[Point]
    constants: dict[bytes, str]
    routines: set[str]
    stops: bool = False
    """Whether its runs can be stopped at observations."""
    recursive: Collection[int] = ()
    """The bodies that may be called again while they run."""
    counting: Counting | None = None
    """The counters, if its code counts."""
    marks_at: int = 0
    """Where the bytes for notes of power begin in the context."""
    kept_bytes: int = 0
    scratch_end: int = SCRATCH
    attempts: bool = False
    """Whether any of its code catches what has stopped a body."""
    regions: list[AliasScopes] = field(default_factory=list)
    """The accesses of each body that has been written."""

    def point(self, code: str, site: int, shown: tuple[Shown, ...]) -> int:
        """Adds a point at which a run can end early.  Returns its number, from 1 on."""
        self.points.append((code, site, shown))
        return len(self.points)

    def constant(self, value: bytes) -> str:
        """The name of a constant with these bytes."""
        return self.constants.setdefault(value, f"@k{len(self.constants)}")

    def room(self, size: int) -> int:
        """Reserves bytes in front of the fields of the context.  Returns their offset from the fields, which is negative."""
        self.kept_bytes += size
        return -self.kept_bytes


class Writer:
    """Writes body number `number` of the module's image.  `values`, `texts` and `statements` are tables of rows, by operation."""

    values: Mapping[str, Callable[..., str]]
    texts: Mapping[str, Callable[..., Text]]
    statements: Mapping[str, Callable[..., None]]

    def __init__(self, module: Module, number: int) -> None:
        self.module, self.body = module, module.image.bodies[number]
        self.base = module.bases.get(number)
        self.range_of = with_temporaries(self.body.code)
        first = module.regions[-1].next if module.regions else 0
        self.regions = AliasScopes(module.instances[number], self.base, first, self.range_of)
        module.regions.append(self.regions)
        self.lines: list[str] = []
        self.counting = BodyCounting(module.counting, self) if module.counting else None
        self.cold: list[str] = []
        self.here = "entry"
        """Label of the block that is being written."""
        self.dead = False
        """True behind a jump, where nothing can be executed."""
        self.loops: list[tuple[str, str]] = []
        """Labels of tail and end of the loops around, the innermost last."""
        self.temporaries: dict[str, str] = {}
        self.kept_texts: dict[str, str] = {}
        """Text temporaries that are kept on the host's stack, with LLVM's type of each."""
        self.is_recursive = number in module.recursive
        self.capacities: dict[int, tuple[int, int]] | None = None
        self.next_scratch = SCRATCH
        self.uses_instance = False
        self.passes_on = False
        """True if the block is written in which a body returns what a called body returned."""
        self._names = 0
        self._prefix = "%"
        """In front of the numbers that name values.  LLVM reads names fastest if their numbers grow from line to line, so blocks
        that are written `aside` have another prefix."""

    # --- lines

    def emit(self, text: str) -> None:
        self.lines.append(text)

    def new(self, text: str) -> str:
        """Writes an instruction.  Returns the name of its value."""
        self._names += 1
        name = f"{self._prefix}{self._names}"
        self.lines.append(f"{name} = {text}")
        return name

    def label(self, letter: str = "b") -> str:
        self._names += 1
        return f"{letter}{self._names}"

    def begin(self, label: str) -> None:
        """Starts the block of that label."""
        self.lines.append(f"{label}:")
        self.here, self.dead = label, False

    def jump(self, label: str) -> None:
        if not self.dead:
            self.emit(f"br label %{label}")
        self.dead = True

    def branch(self, condition: str, yes: str, no: str) -> None:
        self.emit(f"br i1 {condition}, label %{yes}, label %{no}")
        self.dead = True

    def unlikely(self, condition: str, yes: str, no: str) -> None:
        """Writes a branch that hardly ever goes to `yes`."""
        self.emit(f"br i1 {condition}, label %{yes}, label %{no}, {RARE}")

    def write(self, block: Block) -> None:
        """Writes the statements of a block, up to the first that leaves it."""
        stops, counting = self.module.stops, self.counting
        around = counting.begin_block() if counting else None
        for position, node in enumerate(block, 1):
            if self.dead:
                break
            if node[0] == "observe" and (not stops or _is_seen_later(node, block[position] if position < len(block) else None)):
                continue
            self.next_scratch = SCRATCH
            if counting:
                counting.begin(node)
            self.statements[node[0]](self, *node[1:])
            if counting:
                counting.end(node)
        if counting and around:
            counting.end_block(around)

    @contextmanager
    def aside(self, label: str) -> Iterator[None]:
        """What is written in this context becomes a block at the end of the body, out of the way of the code that runs."""
        (hot, prefix), (self.lines, self._prefix) = (self.lines, self._prefix), ([f"{label}:"], "%c")
        yield
        self.cold += self.lines
        self.lines, self._prefix = hot, prefix

    # --- operands

    def value(self, node: Node) -> str:
        """Writes an expression that is no text.  Returns the name of its value."""
        return self.values[node[0]](self, *node[1:])

    def text(self, node: Node) -> Text:
        """Writes a text expression.  The bytes of the value stay as they are until the next statement."""
        return self.texts[node[0]](self, *node[1:])

    def wide(self, node: Node) -> str:
        """Writes an integer expression.  Returns the name of its value in 64 bits."""
        return self.widened(self.value(node), node[1])

    def widened(self, value: str, machine: str) -> str:
        """Extends an integer to 64 bits."""
        if ir(machine) == "i64":
            return value
        return self.new(f"{'sext' if machine[0] == 'i' else 'zext'} {ir(machine)} {value} to i64")

    def temporary(self, number: int, machine: str) -> str:
        """The name of the stack slot of a temporary."""
        name = f"%t{number}.{machine}"
        self.temporaries[name] = stored(machine)
        return name

    def call(self, routine: str, *operands: str) -> str:
        """Writes the call of a routine of the library with numbers of 64 bits.  Returns the name of its result."""
        self.module.routines.add(routine)
        return self.new(f"call i64 @{routine}({', '.join(f'i64 {operand}' for operand in operands)})")

    def field(self, name: str) -> str:
        """Address of a field of the context."""
        return self.new(f"getelementptr inbounds i8, ptr %c, i64 {FIELDS[name]}")

    def scratch(self, size: int) -> str:
        """Address of bytes of the context that are used until the statement ends."""
        at = self.next_scratch
        self.next_scratch += size
        self.module.scratch_end = max(self.module.scratch_end, self.next_scratch)
        return self.new(f"getelementptr inbounds i8, ptr %c, i64 {at}")

    def integer(self, pointer: str) -> str:
        return self.new(f"ptrtoint ptr {pointer} to i64")

    # --- the system page, and what does not overlap

    def system(self, offset: int) -> str:
        """A word of the system page."""
        return self.new(f"load i64, ptr {self._system_word(offset)}, align 8{SYSTEM}")

    def put_system(self, offset: int, value: str) -> None:
        self.emit(f"store i64 {value}, ptr {self._system_word(offset)}, align 8{SYSTEM}")

    def _system_word(self, offset: int) -> str:
        return self.new(f"getelementptr inbounds i8, ptr %m, i64 {offset}")

    def scope(self, address: Address, count: int) -> str:
        """The mark of an access for the end of its line (see `alias_scopes`); empty for one behind a reference."""
        return "" if self.loose(address) else self.regions.mark(address, count)

    @staticmethod
    def loose(address: Address) -> bool:
        """True for an address behind a reference, which may lie anywhere."""
        return isinstance(address[0], tuple)

    def reload(self, address: Address, count: int) -> None:
        """Behind a store: reads the step budget from memory again if the store may have touched it."""
        if self.loose(address) or not self.regions.is_apart(address, count):
            self.emit(f"store i64 {self.system(BUDGET)}, ptr %budget")

    # --- traps

    def trap_if(self, condition: str, code: str, site: int, *shown: tuple[Any, ...]) -> None:
        """Writes a branch that ends the run with trap `code` if the condition is TRUE.

        `shown` are the values of the trap: (machine type, name), ("text", address, length) or ("const", value)."""
        bad, good = self.label("x"), self.label()
        self.unlikely(condition, bad, good)
        with self.aside(bad):
            self.end(code, site, shown)
        self.begin(good)

    def trap(self, code: str, site: int) -> None:
        """End the run."""
        self.end(code, site)
        self.dead = True

    def give_back(self) -> None:
        """Leave the body."""
        left = self.new("load i64, ptr %budget")
        self.emit(f"ret i64 {left}")
        self.dead = True

    def passing_on(self) -> str:
        """The label of the block that returns what a called body returned, which stands in the budget."""
        if self.counting:
            label = self.label("x")
            with self.aside(label):
                self.counting.note_position()
                self.give_back()
            self.dead = False
            return label
        if not self.passes_on:
            self.passes_on = True
            with self.aside("passing_on"):
                self.give_back()
        self.dead = False
        return "passing_on"

    def end(self, code: str, site: int, shown: tuple[Any, ...] = ()) -> None:
        """Writes the end of the run at a new point.  `shown` is that of `trap_if`."""
        if self.counting:
            self.counting.note_position()
        kinds: list[Shown] = []
        place = 0
        for kind, *operands in shown:
            kinds.append((kind, operands[0] if kind == "const" else None))
            if kind == "const":
                continue
            for number in [self._raw(kind, operands[0])] if kind != "text" else operands:
                at = self.new(f"getelementptr inbounds i8, ptr %c, i64 {FIELDS['values'] + 8 * place}")
                self.emit(f"store i64 {number}, ptr {at}")
                place += 1
        kinds.append((INSTANCE, self._instance()))
        self.emit(f"ret i64 {ENDED + self.module.point(code, site, tuple(kinds))}")

    def _instance(self) -> int | None:
        """Where the instance of this body begins; None if the code writes that into the context, because there are several."""
        if self.body.kind == "FUNCTION":
            return NO_INSTANCE
        if self.base is None:
            at = self.new(f"getelementptr inbounds i8, ptr %c, i64 {FIELDS['result']}")
            self.emit(f"store i64 %self, ptr {at}")
        return self.base

    def _raw(self, kind: str, operand: str) -> str:
        """Converts a value of a trap to the 64 bits in which the context has it."""
        if kind == "f32":
            operand = self.new(f"fpext float {operand} to double")
        return self.new(f"bitcast double {operand} to i64") if is_float(kind) else self.widened(operand, kind)

    # --- addresses

    def pointer(self, address: Address, count: int) -> str:
        """Writes the address of `count` bytes.  Returns the name of the pointer."""
        base, offset, terms = address
        start = "%m"
        if base == "self":
            if self.base is None:
                self.uses_instance, start = True, "%s"
            else:
                offset += self.base
        elif isinstance(base, tuple):
            return self.new(f"getelementptr i8, ptr %m, i64 {self._behind(address, count)}")
        if offset:
            start = self.new(f"getelementptr inbounds i8, ptr {start}, i64 {offset}")
        for stride, term in terms:
            start = self.new(f"getelementptr inbounds [{stride} x i8], ptr {start}, i64 {self.wide(term)}")
        return start

    def offset(self, address: Address, count: int) -> str:
        """Writes how many bytes behind the start of memory an address lies.  Returns the name of the number, in 64 bits."""
        base, offset, terms = address
        if isinstance(base, tuple):
            return self._behind(address, count)
        if base == "self" and self.base is None:
            total = self.new(f"add i64 %self, {offset}") if offset else "%self"
        else:
            total = str(offset + (self.base or 0 if base == "self" else 0))
        for stride, term in terms:
            total = self.new(f"add i64 {total}, {self.new(f'mul i64 {self.wide(term)}, {stride}')}")
        return total

    def _behind(self, address: Address, count: int) -> str:
        """Writes the offset of `count` bytes behind a reference, with the check that they lie in the object that the reference
        names (R0110).  Returns the name of the number."""
        (_, pointer, site), offset, terms = address
        reference = self.value(pointer)
        form = "i128" if any(abs(stride * edge) >> 56 for stride, term in terms for edge in self.range_of(term)) else "i64"
        delta = str(offset)
        for stride, term in terms:
            number = self.value(term)
            if ir(term[1]) != form:
                number = self.new(f"{'sext' if term[1][0] == 'i' else 'zext'} {ir(term[1])} {number} to {form}")
            delta = self.new(f"add {form} {delta}, {self.new(f'mul {form} {number}, {stride}')}")
        start = self.new(f"and i64 {self.new(f'lshr i64 {reference}, {OFFSET_SHIFT}')}, {OFFSET_MASK}")
        if form == "i128":
            start = self.new(f"zext i64 {start} to i128")
        total = self.new(f"add {form} {start}, {delta}")
        size = self.new(f"load i64, ptr {self.field('size')}, !invariant.load !1")
        last = self.new(f"sub i64 {size}, {count}")
        if form == "i128":
            last = self.new(f"zext i64 {last} to i128")
        number = self.new(f"lshr i64 {reference}, {OBJECT_SHIFT}")
        other = self.new(f"icmp ne i64 {number}, {BUFFER_OBJECT}")
        outside = self.new(f"icmp ugt {form} {total}, {last}")
        place = self.new(f"trunc i128 {total} to i64") if form == "i128" else total
        apart, good, bad = self.label("x"), self.label(), self.label("x")
        self.emit(f"br i1 {self.new(f'or i1 {other}, {outside}')}, label %{apart}, label %{good}, {RARE}")
        with self.aside(apart):
            inside = self.new(f"call fastcc i1 @inside(ptr %m, i64 {number}, i64 {place}, i64 {count})")
            if form == "i128":
                inside = self.new(f"and i1 {inside}, {self.new(f'icmp ult i128 {total}, {1 << 32}')}")
            self.emit(f"br i1 {inside}, label %{good}, label %{bad}")
        with self.aside(bad):
            self.end("R0110", site, (("ref", reference),))
        self.begin(good)
        return place
