"""Statements of code as instructions of LLVM: one row an operation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fbvm.base.areas import BUDGET, DUE
from fbvm.code.operations import RAISED, SIZES, TEXT_UNITS, WAYS_OUT, Address, Block, Node
from fbvm.engine.case_tables import FEW_VALUES, case_table
from fbvm.engine.native.emit.expressions import flag_mask, place
from fbvm.engine.native.emit.step_charges import charge
from fbvm.engine.native.emit.stop_checks import observe
from fbvm.engine.native.emit.texts import in_bytes, keep
from fbvm.engine.native.emit.writer import ENDED, RARE, TRAPPED, Writer, ir, signed, stored
from fbvm.engine.ranges import is_float

# --- stores ---------------------------------------------------------------------------------------------------------


def _store(w: Writer, machine: str, address: Address, a: Node) -> None:
    pointer, align, scope = place(w, machine, address)
    to_memory(w, machine, pointer, a, align, scope)
    w.reload(address, SIZES[machine])


def _store_raw(w: Writer, machine: str, address: Address, a: Node) -> None:
    pointer, scope = w.pointer(address, SIZES[machine]), w.scope(address, SIZES[machine])
    to_memory(w, machine, pointer, a, 1, scope)
    w.reload(address, SIZES[machine])


def to_memory(w: Writer, machine: str, pointer: str, a: Node, align: int, scope: str) -> None:
    """Store a value as memory holds it."""
    value, kind, how = w.value(a), stored(machine), f"align {align}{scope}"
    if machine == "b":
        value = w.new(f"zext i1 {value} to i8")
    elif is_float(machine) and not (a[0] == "const" or (a[0] == "convert" and not is_float(a[2]))):
        bad, good, after = w.label("x"), w.label(), w.label()
        w.unlikely(w.new(f"fcmp uno {kind} {value}, {value}"), bad, good)
        with w.aside(bad):
            w.emit(f"store {kind} {w.new(f'load {kind}, ptr {w.field(machine)}')}, ptr {pointer}, {how}")
            w.emit(f"br label %{after}")
        w.begin(good)
        w.emit(f"store {kind} {value}, ptr {pointer}, {how}")
        w.jump(after)
        w.begin(after)
        return
    w.emit(f"store {kind} {value}, ptr {pointer}, {how}")


def _store_bit(w: Writer, address: Address, bit: int, a: Node) -> None:
    pointer, scope = w.pointer(address, 1), w.scope(address, 1)
    value = w.value(a)
    byte = w.new(f"load i8, ptr {pointer}{scope}")
    cleared = w.new(f"and i8 {byte}, {~(1 << bit)}")
    moved = w.new(f"shl i8 {w.new(f'zext i1 {value} to i8')}, {bit}")
    w.emit(f"store i8 {w.new(f'or i8 {cleared}, {moved}')}, ptr {pointer}{scope}")
    w.reload(address, 1)


def _store_flag(w: Writer, address: Address, a: Node) -> None:
    if not w.loose(address):
        _store(w, "b", address, a)
        return
    pointer = w.pointer(address, 1)
    whole, mask = flag_mask(w, address)
    value = w.value(a)
    byte = w.new(f"load i8, ptr {pointer}")
    cleared = w.new(f"and i8 {byte}, {w.new(f'xor i8 {mask}, -1')}")
    changed = w.new(f"select i1 {value}, i8 {w.new(f'or i8 {byte}, {mask}')}, i8 {cleared}")
    full = w.new(f"zext i1 {value} to i8")
    w.emit(f"store i8 {w.new(f'select i1 {whole}, i8 {full}, i8 {changed}')}, ptr {pointer}")
    w.reload(address, 1)


def _store_text(w: Writer, address: Address, capacity: int, a: Node) -> None:
    unit = TEXT_UNITS[a[1]]
    size = (capacity + 1) * unit
    pointer = w.pointer(address, size)
    text = w.text(a)
    length = w.new(f"call i64 @llvm.umin.i64(i64 {text.length}, i64 {capacity})")
    count = in_bytes(w, length, unit)
    w.emit(f"call void @llvm.memmove.p0.p0.i64(ptr {pointer}, ptr {text.at}, i64 {count}, i1 false)")
    end = w.new(f"getelementptr inbounds i8, ptr {pointer}, i64 {count}")
    w.emit(f"store i{8 * unit} 0, ptr {end}, align 1")
    w.reload(address, size)


def _copy(w: Writer, to: Address, source: Address, size: int) -> None:
    target, origin = w.pointer(to, size), w.pointer(source, size)
    w.emit(f"call void @llvm.memmove.p0.p0.i64(ptr {target}, ptr {origin}, i64 {size}, i1 false)")
    w.reload(to, size)


def _fill(w: Writer, address: Address, pattern: bytes) -> None:
    pointer = w.pointer(address, len(pattern))
    if not any(pattern):
        w.emit(f"call void @llvm.memset.p0.i64(ptr {pointer}, i8 0, i64 {len(pattern)}, i1 false)")
    else:
        origin = w.module.constant(pattern)
        w.emit(f"call void @llvm.memcpy.p0.p0.i64(ptr {pointer}, ptr {origin}, i64 {len(pattern)}, i1 false)")
    w.reload(address, len(pattern))


def _reverse(w: Writer, address: Address, size: int, runs: tuple[tuple[int, ...], ...]) -> None:
    start = w.integer(w.pointer(address, size))
    for offset, count, stride, item in runs:
        w.call("reverse_items", w.new(f"add i64 {start}, {offset}"), str(count), str(stride), str(item))
    w.reload(address, size)


def _let(w: Writer, number: int, machine: str, a: Node) -> None:
    if machine in TEXT_UNITS:
        keep(w, number, a)
        return
    value = w.value(a)
    if machine == "b":
        value = w.new(f"zext i1 {value} to i8")
    w.emit(f"store {stored(machine)} {value}, ptr {w.temporary(number, machine)}, align {SIZES[machine]}")


# --- control --------------------------------------------------------------------------------------------------------


def _if(w: Writer, rows: tuple[tuple[Node, Block], ...], otherwise: Block) -> None:
    after = w.label()
    for number, (condition, block) in enumerate(rows, 1):
        yes, no = w.label(), w.label() if otherwise or number < len(rows) else after
        w.branch(w.value(condition), yes, no)
        w.begin(yes)
        w.write(block)
        w.jump(after)
        w.begin(no)
    if otherwise:
        w.write(otherwise)
        w.jump(after)
        w.begin(after)


def _case(w: Writer, machine: str, a: Node, rows: tuple[tuple[Any, Block], ...], otherwise: Block) -> None:
    value, kind, after = w.value(a), ir(machine), w.label()
    blocks = [w.label() for _ in rows] + [w.label()]
    cases = []
    starts, numbers = case_table([labels for labels, _ in rows])
    for low, end, number in zip(starts, starts[1:], numbers[1:], strict=False):
        if number == len(rows):
            continue
        if end - low <= FEW_VALUES:
            cases += [f"{kind} {label}, label %{blocks[number]}" for label in range(low, end)]
        else:
            inside, more = _between(w, machine, value, low, end - 1), w.label()
            w.branch(inside, blocks[number], more)
            w.begin(more)
    w.emit(f"switch {kind} {value}, label %{blocks[-1]} [ {' '.join(cases)} ]")
    for label, block in zip(blocks, [block for _, block in rows] + [otherwise], strict=True):
        w.begin(label)
        w.write(block)
        w.jump(after)
    w.begin(after)


def _between(w: Writer, machine: str, value: str, low: int, high: int) -> str:
    kind, sign = ir(machine), "s" if signed(machine) else "u"
    above, below = w.new(f"icmp {sign}ge {kind} {value}, {low}"), w.new(f"icmp {sign}le {kind} {value}, {high}")
    return w.new(f"and i1 {above}, {below}")


def _loop(w: Writer, head: Block, body: Block, tail: Block) -> None:
    start, following, after = w.label("l"), w.label(), w.label()
    w.jump(start)
    w.begin(start)
    w.loops.append((following, after))
    w.write(head)
    w.write(body)
    w.jump(following)
    w.loops[-1] = start, after
    w.begin(following)
    w.write(tail)
    w.jump(start)
    w.loops.pop()
    w.begin(after)


def _exit(w: Writer) -> None:
    w.jump(w.loops[-1][1])


def _next(w: Writer) -> None:
    w.jump(w.loops[-1][0])


def _return(w: Writer) -> None:
    w.give_back()


def _call(w: Writer, pou: int, address: Address | None) -> None:
    size = w.module.image.bodies[pou].instance_size
    place = w.offset(address, max(1, size)) if address else "0"
    left = w.new("load i64, ptr %budget")
    result = w.new(f"notail call fastcc i64 @b{pou}(ptr %m, ptr %c, i64 {place}, i64 {left})")
    good = w.label()
    w.emit(f"store i64 {result}, ptr %budget")
    w.unlikely(w.new(f"icmp slt i64 {result}, {TRAPPED}"), w.passing_on(), good)
    w.begin(good)


def _attempt(w: Writer, pou: int, address: Address | None, number: int, traps: bool) -> None:
    place = w.offset(address, max(1, w.module.image.bodies[pou].instance_size)) if address else "0"
    w.module.attempts = True
    left, slot = w.new("load i64, ptr %budget"), w.temporary(number, "u32")
    result = w.new(f"notail call fastcc i64 @b{pou}(ptr %m, ptr %c, i64 {place}, i64 {left})")
    stopped, good, after = w.label("x"), w.label(), w.label()
    w.emit(f"store i64 {result}, ptr %budget")
    w.unlikely(w.new(f"icmp slt i64 {result}, {TRAPPED}"), stopped, good)
    passing = w.passing_on()
    with w.aside(stopped):
        point = w.new(f"add i64 {result}, {-ENDED}")
        row = w.new(f"getelementptr inbounds i32, ptr @caught, i64 {point}")
        what, over = w.new(f"load i32, ptr {row}"), w.label("x")
        # as unsigned numbers: 0, which nobody catches, is one less than all others
        most = 0xFFFFFFFF if traps else max(WAYS_OUT.values())
        other = w.new(f"icmp uge i32 {w.new(f'sub i32 {what}, 1')}, {most}")
        w.emit(f"br i1 {other}, label %{passing}, label %{over}, {RARE}")
        w.emit(f"{over}:")
        own = w.new(f"load i32, ptr {w.field('values')}, align 8")
        is_raised = w.new(f"icmp eq i32 {what}, {RAISED}")
        w.emit(f"store i32 {w.new(f'select i1 {is_raised}, i32 {own}, i32 {what}')}, ptr {slot}, align 4")
        w.emit(f"store i64 {w.system(BUDGET)}, ptr %budget")
        w.emit(f"br label %{after}")
    w.begin(good)
    w.emit(f"store i32 0, ptr {slot}, align 4")
    w.jump(after)
    w.begin(after)


def _due(w: Writer, a: Node) -> None:
    value = w.value(a)
    sooner, after = w.label(), w.label()
    w.branch(w.new(f"icmp slt i64 {value}, {w.system(DUE)}"), sooner, after)
    w.begin(sooner)
    w.put_system(DUE, value)
    w.jump(after)
    w.begin(after)


def _stop(w: Writer, code: str, site: int) -> None:
    w.trap(code, site)


def _raise(w: Writer, a: Node, site: int) -> None:
    w.end("R0122", site, (("u32", w.value(a)),))
    w.dead = True


def _count(w: Writer, number: int) -> None:
    assert w.counting, "an image says how many counters it has"
    w.counting.count(number)


def _mark(w: Writer, number: int, rows: tuple[int, ...], a: Node) -> None:
    index = str(w.module.marks_at + number)
    if rows:
        low, size, count, marks = rows
        away = w.new(f"sub i64 {w.offset(('self', 0, ()), 1)}, {low}")
        row = w.new(f"udiv i64 {away}, {size}")
        known = w.new(f"select i1 {w.new(f'icmp ult i64 {row}, {count}')}, i64 {row}, i64 0")
        index = w.new(f"add i64 {w.new(f'mul i64 {known}, {marks}')}, {index}")
    value = w.value(a) if a[1] == "u8" else w.new(f"zext i1 {w.value(a)} to i8")
    w.emit(f"store i8 {value}, ptr {w.new(f'getelementptr inbounds i8, ptr %c, i64 {index}')}, align 1")


def _observe(w: Writer, kind: str, site: int, detail: Any) -> None:
    """What a run can stop at; a plain build has none."""
    observe(w, kind, site)


EMITTERS: dict[str, Callable[..., None]] = {
    "store": _store, "store_raw": _store_raw, "store_bit": _store_bit, "store_flag": _store_flag,
    "store_text": _store_text, "copy": _copy, "fill": _fill, "reverse": _reverse, "let": _let,
    "if": _if, "case": _case, "loop": _loop, "exit": _exit, "next": _next, "return": _return, "call": _call,
    "attempt": _attempt, "charge": charge, "due": _due, "stop": _stop, "raise": _raise,
    "observe": _observe, "count": _count, "mark": _mark,
}
"""How each statement is written: called with the operands of its row."""
