"""Statements of code as lines of Python: one row of EMITTERS an operation, and the function that a body becomes.

`p3_Main(b1)` is the body of number 3 for the instance at byte b1.  Loops and blocks nested deeper than Python allows become
functions inside the body; what leaves them is a return code.  Builds that tell observations are subclasses of the writer of
the plain build (`stepped`, `logged`)."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

from fbvm.base.areas import BUDGET, DUE
from fbvm.code.image import Body, Image
from fbvm.code.operations import SIZES, TEXT_UNITS, Address, Block, Node
from fbvm.code.shapes import is_address, statements
from fbvm.engine.case_tables import case_table, single_values
from fbvm.engine.observation import NO_SITE
from fbvm.engine.python.expressions import ROWS, flag_operands, view
from fbvm.engine.python.writer import Expressions, bare, plus
from fbvm.engine.ranges import may_trap

MOST_LOOPS = 15
"""Nested loops in one function of Python, which takes 20 blocks."""
MOST_INDENTS = 60
"""Levels of indentation in one function of Python, which takes 100."""
CHAIN = 25
"""Branches in one if/elif, which Python's compiler nests in each other."""
FEW_ROWS = 5
"""Rows up to which a case asks one row after the other."""
EXIT, NEXT, RETURN = 1, 2, 3
"""What an outlined block returns if it is left early."""


def function_name(number: int, body: Body) -> str:
    """The name of the Python function of a body."""
    return f"p{number}_" + re.sub(r"\W", "_", body.name, flags=re.ASCII)


class BodyWriter(Expressions):
    """Writes one body of the plain build, which drops observations.

    `tail` is the tail of the innermost loop of the current function, None outside of any.  `holds_budget` is True for a body
    whose variable n has the step budget, too, so that a charge need not read it from memory."""

    may_hold_budget = True
    """Whether nobody changes the memory while a body is executed."""

    def __init__(self, image: Image, constants: dict[str, Any], base: int | None) -> None:
        super().__init__(ROWS, constants, base)
        self.image = image
        self.out: list[str] = []
        self.indent = 1
        self.loops = 0
        self.tail: Block | None = None
        self.holds_budget = False
        self.outlined = False
        self.leaves: set[int] = set()
        self.assigned: set[int] = set()
        self.shared: set[int] = set()
        self.site = NO_SITE
        self._line = 0

    def write(self, number: int) -> list[str]:
        """The lines of the Python function of the body of that number."""
        body = self.image.bodies[number]
        self.holds_budget = self.may_hold_budget and _may_hold_budget(body)
        self.block(body.code)
        self.flush()
        lines = [f"def {function_name(number, body)}(b1):"]
        if self.holds_budget:
            lines.append(f"    n = i64[{BUDGET // 8}]")
        lines += [f"    b{size} = b1 >> {size.bit_length() - 1}" for size in (2, 4, 8) if size in self.bases]
        if self.shared:
            lines.append("    " + "".join(f"t{number} = " for number in sorted(self.shared)) + "None")
        for routine in self.routines:
            lines += ["    " + line for line in routine]
        return lines + self.ended(self.out)

    # --- what other builds do otherwise

    def ended(self, lines: list[str]) -> list[str]:
        """The lines of a function, one at least."""
        return [*lines, "    pass"] if _empty(lines) else lines

    def calling(self, call: str) -> str:
        """Python that calls a function which is made of a block."""
        return call

    def call_body(self, pou: int, address: Address | None, place: str) -> None:
        """Writes the call of the body of number `pou`, whose instance begins at `address`; `place` is Python for that byte."""
        self.line(f"{self.function(pou)}({place})")

    def observe(self, kind: str, site: int, detail: Any) -> None:
        """Writes an observation."""

    def begin_pass(self) -> None:
        """Writes what is done at the beginning of each pass of a loop."""

    def flush(self) -> None:
        """Writes what must stand in front of the next line, or at the end of a block."""

    def function(self, pou: int) -> str:
        """The name of the function of a body."""
        return function_name(pou, self.image.bodies[pou])

    # --- lines and blocks

    def line(self, text: str) -> None:
        self.out.append("    " * self.indent + text)

    def comment(self, text: str) -> None:
        self.out.append("    " * self.indent + text)

    def block(self, block: Block) -> None:
        for node in block:
            EMITTERS[node[0]](self, *node[1:])

    def suite(self, write: Callable[[], None]) -> None:
        """What `write` writes, one level deeper."""
        self.indent += 1
        before = len(self.out)
        if self.indent > MOST_INDENTS:
            self.outline(write)
        else:
            write()
        self.flush()
        if _empty(self.out[before:]):
            self.line("pass")
        self.indent -= 1

    def outline(self, write: Callable[[], None]) -> None:
        """What `write` writes as a function inside the body, and its call."""
        self.flush()
        outer = (self.out, self.indent, self.loops, self.tail, self.outlined, self.leaves, self.assigned)
        self.out, self.indent, self.loops, self.tail = [], 1, 0, None
        self.outlined, self.leaves, self.assigned = True, set(), set()
        write()
        self.flush()
        name, lines, leaves, assigned = self.name("o"), self.out, self.leaves, self.assigned
        self.out, self.indent, self.loops, self.tail, self.outlined, self.leaves, self.assigned = outer
        self.shared |= assigned
        shared = [f"    nonlocal {', '.join(f't{number}' for number in sorted(assigned))}"] if assigned else []
        self.routines.append([f"def {name}():", *shared, *self.ended(lines)])
        call = self.calling(f"{name}()")
        self.line(f"r = {call}" if leaves else call)
        if self.holds_budget and not self.outlined:
            self.line(f"n = i64[{BUDGET // 8}]")
        for code, leave in ((EXIT, _exit), (NEXT, _next), (RETURN, _return)):
            if code in leaves:
                self.line(f"if r == {code}:")
                self.indent += 1
                leave(self)
                self.indent -= 1

    def leave(self, code: int) -> None:
        """Leave an outlined block: whoever called it goes on with the code."""
        self.leaves.add(code)
        self.line(f"return {code}")

    def branches(self, tests: list[tuple[str, Block]], otherwise: Block) -> None:
        """An if with its branches."""
        word = "if"
        for test, block in tests:
            self.line(f"{word} {test}:")
            self.suite(lambda block=block: self.block(block))  # type: ignore[misc]
            word = "elif"
        if otherwise:
            self.line("else:")
            self.suite(lambda: self.block(otherwise))


def _may_hold_budget(body: Body) -> bool:
    """True for a body with several charges, but no calls and no stores behind references, which might change the budget."""
    nodes = list(statements(body.code))
    return sum(node[0] == "charge" for node in nodes) > 1 and not any(map(_may_change_budget, nodes))


def _may_change_budget(node: Node) -> bool:
    return node[0] in ("call", "mark") or any(is_address(part) and isinstance(part[0], tuple) for part in node[1:3])


def _empty(lines: list[str]) -> bool:
    return all(line.lstrip().startswith("#") for line in lines)


# --- stores ---------------------------------------------------------------------------------------------------------


def _ordered(w: BodyWriter, address: Address, value: Node, text: str) -> str:
    """The address evaluated before the value, as the table has it, where Python would do it after."""
    if not may_trap(address) or not may_trap(value):
        return text
    name = w.name("v")
    w.line(f"{name} = {text}")
    return name


def _store(w: BodyWriter, machine: str, address: Address, a: Node) -> None:
    if isinstance(address[0], tuple):
        _store_raw(w, machine, address, a)
        return
    index = bare(w.index(address, machine))
    index = _ordered(w, address, a, index)
    stored, text = w.stored(machine, a)
    w.line(f"{view(stored)}[{index}] = {text}")


def _store_raw(w: BodyWriter, machine: str, address: Address, a: Node) -> None:
    if SIZES[machine] == 1:
        place = _ordered(w, address, a, bare(w.place(address, 1)))
        stored, text = w.stored(machine, a)
        w.line(f"{view(stored)}[{place}] = {text}")
        return
    place = bare(w.place(address, SIZES[machine]))
    stored, text = w.stored(machine, a)
    if machine == "f32":
        text = f"single({text})"  # `struct` refuses what it would have to round to infinity
    w.line(f"put_{stored}(buffer, {place}, {text})")


def _store_bit(w: BodyWriter, address: Address, bit: int, a: Node) -> None:
    place = bare(w.place(address, 1))
    if not place.isdigit():
        name = w.name("v")
        w.line(f"{name} = {place}")
        place = name
    on, off = 1 << bit, 255 ^ 1 << bit
    if a[0] == "const":
        w.line(f"u8[{place}] |= {on}" if a[2] else f"u8[{place}] &= {off}")
    else:
        w.line(f"u8[{place}] = u8[{place}] | {on} if {w.condition(a)} else u8[{place}] & {off}")


def _store_flag(w: BodyWriter, address: Address, a: Node) -> None:
    if not isinstance(address[0], tuple):
        _store(w, "b", address, a)
        return
    if may_trap(a):
        w.line(w.place(address, 1))
    w.line(f"put_flag({flag_operands(w, address)}, {bare(w.value(a))})")


def _store_text(w: BodyWriter, address: Address, capacity: int, a: Node) -> None:
    place = w.place(address, (capacity + 1) * TEXT_UNITS[a[1]])
    w.line(f"put_{a[1]}({bare(place)}, {capacity}, {bare(w.value(a))})")


def _copy(w: BodyWriter, to: Address, source: Address, size: int) -> None:
    target, origin = bare(w.place(to, size)), bare(w.place(source, size))
    if target.isdigit() and origin.isdigit():
        w.line(f"u8[{target}:{plus(target, size)}] = u8[{origin}:{plus(origin, size)}]")
    else:
        w.line(f"copy({target}, {origin}, {size})")


def _reverse(w: BodyWriter, address: Address, size: int, runs: tuple[tuple[int, ...], ...]) -> None:
    w.line(f"reverse({bare(w.place(address, size))}, {w.constant(runs)})")


def _fill(w: BodyWriter, address: Address, pattern: bytes) -> None:
    w.line(f"fill({bare(w.place(address, len(pattern)))}, {pattern!r})")


def _let(w: BodyWriter, number: int, machine: str, a: Node) -> None:
    w.assigned.add(number)
    w.line(f"t{number} = {bare(w.value(a))}")


# --- control --------------------------------------------------------------------------------------------------------


def _if(w: BodyWriter, rows: tuple[tuple[Node, Block], ...], otherwise: Block) -> None:
    if len(rows) > CHAIN:
        rest: Block = (("if", rows[CHAIN:], otherwise),)
        w.branches([(bare(w.condition(c)), block) for c, block in rows[:CHAIN]], ())
        w.line("else:")
        w.suite(lambda: w.outline(lambda: w.block(rest)))
        return
    w.branches([(bare(w.condition(c)), block) for c, block in rows], otherwise)


def _case(w: BodyWriter, machine: str, a: Node, rows: tuple[tuple[Any, Block], ...], otherwise: Block) -> None:
    name = w.name("v")
    w.line(f"{name} = {bare(w.value(a))}")
    if len(rows) <= FEW_ROWS:
        w.branches([(" or ".join(f"{name} == {low}" if low == high else f"{low} <= {name} <= {high}"
                                 for low, high in labels), block) for labels, block in rows], otherwise)
        return
    blocks = [block for _, block in rows] + [otherwise]
    starts, numbers = case_table([labels for labels, _ in rows])
    single = single_values(starts, numbers, len(rows))
    if single is not None:
        w.line(f"{name} = {w.constant(single.get)}({name}, {len(rows)})")
    else:
        w.line(f"{name} = {w.constant(numbers)}[bisect({w.constant(starts)}, {name})]")

    def choose(first: int, last: int) -> None:
        if first == last:
            w.block(blocks[first])
            return
        middle = (first + last + 1) // 2
        w.line(f"if {name} < {middle}:")
        w.suite(lambda: choose(first, middle - 1))
        w.line("else:")
        w.suite(lambda: choose(middle, last))

    choose(0, len(rows))


def _loop(w: BodyWriter, head: Block, body: Block, tail: Block) -> None:
    if w.loops >= MOST_LOOPS or w.indent >= MOST_INDENTS:
        w.outline(lambda: _loop(w, head, body, tail))
        return
    outer = w.tail
    w.loops += 1
    w.line("while True:")

    def inside() -> None:
        w.tail = tail
        w.begin_pass()
        w.block(head + body)
        w.tail = ()
        w.block(tail)

    w.suite(inside)
    w.loops -= 1
    w.tail = outer


def _exit(w: BodyWriter) -> None:
    if w.tail is None:
        w.leave(EXIT)
    else:
        w.line("break")


def _next(w: BodyWriter) -> None:
    if w.tail is None:
        w.leave(NEXT)
        return
    tail, w.tail = w.tail, ()
    w.block(tail)
    w.tail = tail
    w.line("continue")


def _return(w: BodyWriter) -> None:
    if w.outlined:
        w.leave(RETURN)
    else:
        w.line("return")


def _call(w: BodyWriter, pou: int, address: Address | None) -> None:
    w.call_body(pou, address, bare(w.place(address, max(1, w.image.bodies[pou].instance_size))) if address else "0")


def _charge(w: BodyWriter, count: int, site: int) -> None:
    held = "n" if w.holds_budget and not w.outlined else f"i64[{BUDGET // 8}]"
    w.line(f"i64[{BUDGET // 8}] = n = {held} - {count}")
    w.line(f"if n < least: ask(n, {site})")


def _due(w: BodyWriter, a: Node) -> None:
    first, time = w.once(w.value(a))
    w.line(f"if {first} < i64[{DUE // 8}]: i64[{DUE // 8}] = {time}")


def _count(w: BodyWriter, number: int) -> None:
    w.line(f"counts[{number}] += 1")


def _mark(w: BodyWriter, number: int, rows: tuple[int, ...], a: Node) -> None:
    index = str(number)
    if rows:
        low, size, count, marks = rows
        index = f"{number} + {marks} * (n if 0 <= (n := ({w.place(('self', 0, ()), 1)} - {low}) // {size}) < {count} else 0)"
    w.line(f"marks[{index}] = {bare(w.value(a))}")


def _stop(w: BodyWriter, code: str, site: int) -> None:
    w.line(f"stop({code!r}, {site})")


# --- observations ---------------------------------------------------------------------------------------------------


def _observe(w: BodyWriter, kind: str, site: int, detail: Any) -> None:
    if kind in ("statement", "rung"):
        w.site = site
    if kind == "statement" and w.image.sites[site].line != w._line:
        w._line = w.image.sites[site].line
        w.comment(f"# {w.image.sites[site]}".replace("\n", " ").replace("\r", " "))
    w.observe(kind, site, detail)


EMITTERS: dict[str, Callable[..., None]] = {
    "store": _store, "store_raw": _store_raw, "store_bit": _store_bit, "store_flag": _store_flag,
    "store_text": _store_text, "copy": _copy, "fill": _fill, "reverse": _reverse, "let": _let,
    "if": _if, "case": _case, "loop": _loop, "exit": _exit, "next": _next, "return": _return, "call": _call,
    "charge": _charge, "due": _due, "stop": _stop,
    "observe": _observe, "count": _count, "mark": _mark,
}
"""How each statement is written: called with the operands of its row."""
