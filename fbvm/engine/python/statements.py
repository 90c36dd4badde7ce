"""Statements of code as lines of Python: one row of EMITTERS an operation.

Builds that tell observations are subclasses of the writer of the plain build (`stepped`, `logged`)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fbvm.base.areas import DUE
from fbvm.code.operations import INTEGERS, SIZES, TEXT_UNITS, Address, Block, Node
from fbvm.engine.case_tables import case_table, single_values
from fbvm.engine.python.bodies import BEGIN, END, EXIT, IN_MEMORY, MOST_INDENTS, NEXT, RETURN, BodyWriter
from fbvm.engine.python.expressions import flag_operands
from fbvm.engine.python.writer import bare, plus, view
from fbvm.engine.ranges import may_trap

MOST_LOOPS = 15
"""Nested loops in one function of Python, which takes 20 blocks."""
CHAIN = 25
"""Branches in one if/elif, which Python's compiler nests in each other."""
FEW_ROWS = 5
"""Rows up to which a case asks one row after the other."""
ROUNDED = ("add", "sub", "mul", "div", "pow", "math", "atan2", "convert")
"""Operations whose number may have to be rounded to 32 bits."""
SAME_BITS = {"u32": "f32", "u64": "f64"}
"""By the type in which numbers are copied that are floats."""

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
        w.held.forget(("store_raw", machine, address, a), w.range_of)
        return
    held, key = w.held, w.held.key(machine, address)
    if not held.worth(key, 1):
        key = None
    range_ = w.range_of(a) if machine in INTEGERS else None
    stored, text = w.stored(machine, a)
    if key in held.must and stored != machine:
        stored, text = machine, bare(w.value(a))
    name, index = w.cell(address, stored)
    index = _ordered(w, address, a, index)
    rounds = machine == "f32" and a[0] in ROUNDED
    if key and stored == machine and not rounds:
        w.line(f"{name}[{index}] = {held.name(key)} = {text}")
        held.forget(("store", machine, address, a), w.range_of)
        held.hold(key, range_)
    else:
        w.line(f"{name}[{index}] = {text}")
        held.forget(("store", machine, address, a), w.range_of)
        if key and key in held.must:
            w.line(f"{held.name(key)} = {w.item(address, machine)}")
            held.hold(key, None)
    if machine in SAME_BITS and a[:2] == ("load", machine):
        _hold_copy(w, SAME_BITS[machine], address, a[2])


def _hold_copy(w: BodyWriter, machine: str, to: Address, source: Address) -> None:
    """Holds a float whose bits were copied, if the one that they were copied from is held."""
    held, key, known = w.held, w.held.key(machine, to), w.held.key(machine, source)
    if key and known and held.state and known in held.state and held.worth(key, 1):
        w.line(f"{held.name(key)} = {held.name(known)}")
        held.hold(key, None)


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
    view_, place = ("u8", bare(w.place(address, 1))) if isinstance(address[0], tuple) else w.cell(address, "u8")
    if not place.isdigit():
        name = w.name("v")
        w.line(f"{name} = {place}")
        place = name
    byte, on, off = f"{view_}[{place}]", 1 << bit, 255 ^ 1 << bit
    if a[0] == "const":
        w.line(f"{byte} |= {on}" if a[2] else f"{byte} &= {off}")
    else:
        w.line(f"{byte} = {byte} | {on} if {w.condition(a)} else {byte} & {off}")


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
    w.held.hold(("tmp", "", number), w.range_of(a) if machine in INTEGERS else None)


# --- control --------------------------------------------------------------------------------------------------------


def _if(w: BodyWriter, rows: tuple[tuple[Node, Block], ...], otherwise: Block) -> None:
    first, conditions = rows[:CHAIN], [condition for condition, _ in rows[:CHAIN]]
    texts = [bare(w.condition(conditions[0])), *(bare(w.aside(w.condition, condition)) for condition in conditions[1:])]
    tests = list(zip(texts, (block for _, block in first), strict=True))
    if len(rows) <= CHAIN:
        w.branches(tests, otherwise, conditions)
        return
    rest: Block = (("if", rows[CHAIN:], otherwise),)
    w.branches(tests, (), conditions)
    w.line("else:")
    w.suite(lambda: w.outline(lambda: w.block(rest)))


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
        before = w.held.copy()
        w.line(f"if {name} < {middle}:")
        w.suite(lambda: choose(first, middle - 1))
        end, w.held.state = w.held.state, before
        w.line("else:")
        w.suite(lambda: choose(middle, last))
        w.held.meet([end, w.held.state])

    choose(0, len(rows))


def _loop(w: BodyWriter, head: Block, body: Block, tail: Block) -> None:
    if w.loops >= MOST_LOOPS or w.indent >= MOST_INDENTS:
        w.outline(lambda: _loop(w, head, body, tail))
        return
    outer, must = w.tail, w.held.begin_loop(("loop", head, body, tail))
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
    w.held.end_loop(must)


def _exit(w: BodyWriter) -> None:
    if w.tail is None:
        w.leave(EXIT)
    else:
        w.line("break")
        w.held.exit()


def _next(w: BodyWriter) -> None:
    if w.tail is None:
        w.leave(NEXT)
        return
    tail, w.tail = w.tail, ()
    w.block(tail)
    w.tail = tail
    w.line("continue")
    w.held.state = None


def _return(w: BodyWriter) -> None:
    if w.outlined:
        w.leave(RETURN)
    else:
        w.line(w.returning())
        w.held.state = None


def _call(w: BodyWriter, pou: int, address: Address | None) -> None:
    w.call_body(pou, address, bare(w.place(address, max(1, w.image.bodies[pou].instance_size))) if address else "0")


def _begin(w: BodyWriter, pou: int, address: Address | None) -> None:
    w.comment(f"{BEGIN}{len(w.inlined)}: {w.image.bodies[pou].name}{f' at {bare(w.place(address, 1))}' if address else ''}")
    w.inlined.append((pou, address))


def _end(w: BodyWriter, pou: int) -> None:
    w.comment(f"{END}{w.image.bodies[pou].name}")


def _attempt(w: BodyWriter, pou: int, address: Address | None, number: int, traps: bool) -> None:
    place = bare(w.place(address, max(1, w.image.bodies[pou].instance_size))) if address else "0"
    w.assigned.add(number)
    w.line("try:")
    w.suite(lambda: w.attempt_body(pou, place, f"t{number}"))
    w.line("except Stop as stopped:")
    w.suite(lambda: w.after_stop(f"t{number}", traps))
    w.held.hold(("tmp", "", number), None)


def _charge(w: BodyWriter, count: int, site: int) -> None:
    name = w.budget
    if name == IN_MEMORY:
        name = "steps"
        w.line(f"{IN_MEMORY} = steps = {IN_MEMORY} - {count}")
    else:
        w.line(f"{name} = {name} - {count}")
    w.line(f"if {name} < least: ask({name}, {site})")


def _due(w: BodyWriter, a: Node) -> None:
    first, time = w.once(w.value(a))
    w.line(f"if {first} < i64[{DUE // 8}]: i64[{DUE // 8}] = {time}")


def _count(w: BodyWriter, number: int) -> None:
    w.line(f"counts[{number}] += 1")


def _mark(w: BodyWriter, number: int, rows: tuple[int, ...], a: Node) -> None:
    index = str(number)
    if rows:
        low, size, count, marks = rows
        index = f"{number} + {marks} * (m if 0 <= (m := ({w.place(('self', 0, ()), 1)} - {low}) // {size}) < {count} else 0)"
    w.line(f"marks[{index}] = {bare(w.value(a))}")


def _stop(w: BodyWriter, code: str, site: int) -> None:
    w.line(f"stop({code!r}, {site})")
    w.held.state = None


def _raise(w: BodyWriter, a: Node, site: int) -> None:
    w.line(f"stop('R0122', {site}, {bare(w.value(a))})")
    w.held.state = None


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
    "begin": _begin, "end": _end, "attempt": _attempt,
    "charge": _charge, "due": _due, "stop": _stop, "raise": _raise,
    "observe": _observe, "count": _count, "mark": _mark,
}
"""How each statement is written: called with the operands of its row."""


class PlainWriter(BodyWriter):
    """Writes one body of the plain build."""

    emitters = EMITTERS
