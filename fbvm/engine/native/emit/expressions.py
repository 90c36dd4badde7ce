"""Expressions of code as instructions of LLVM: one row an operation.

A row decides nothing: what it writes means what the table of operations says."""

from __future__ import annotations

from collections.abc import Callable

from fbvm.base.areas import NOW
from fbvm.base.arithmetic import limits, width
from fbvm.base.memory import WHOLE_BYTES
from fbvm.code.operations import BUFFER_OBJECT, OBJECT_SHIFT, OFFSET_MASK, OFFSET_SHIFT, SIZES, TEXT_UNITS, Address, Node
from fbvm.engine.native.emit.conversions import bits, convert, nearest, truncate
from fbvm.engine.native.emit.writer import NAN_BITS, Text, Writer, ir, literal, signed, stored
from fbvm.engine.ranges import is_float, may_trap

Row = Callable[..., str]


# --- memory ---------------------------------------------------------------------------------------------------------


def _load(w: Writer, machine: str, address: Address) -> str:
    return from_memory(w, machine, *place(w, machine, address))


def place(w: Writer, machine: str, address: Address) -> tuple[str, int, str]:
    """Where a value lies, at a multiple of what, and what marks it."""
    size = SIZES[machine]
    if isinstance(address[0], tuple):
        return w.pointer(address, size), 1, ""
    return w.pointer(address, size), size, w.regions.mark(address, size)


def _load_raw(w: Writer, machine: str, address: Address) -> str:
    return from_memory(w, machine, w.pointer(address, SIZES[machine]), 1, w.scope(address, SIZES[machine]))


def from_memory(w: Writer, machine: str, pointer: str, align: int, scope: str, test: str = "ne") -> str:
    """The value of a machine type at a place; of a BOOL whether it stands so to FALSE."""
    value = w.new(f"load {stored(machine)}, ptr {pointer}, align {align}{scope}")
    return w.new(f"icmp {test} i8 {value}, 0") if machine == "b" else value


def _load_bit(w: Writer, machine: str, address: Address, bit: int) -> str:
    byte = w.new(f"load i8, ptr {w.pointer(address, 1)}{w.scope(address, 1)}")
    return w.new(f"icmp ne i8 {w.new(f'and i8 {byte}, {1 << bit}')}, 0")


def _load_flag(w: Writer, machine: str, address: Address) -> str:
    if not w.loose(address):
        return _load(w, "b", address)
    byte = w.new(f"load i8, ptr {w.pointer(address, 1)}")
    whole, mask = flag_mask(w, address)
    wanted = w.new(f"select i1 {whole}, i8 -1, i8 {mask}")
    return w.new(f"icmp ne i8 {w.new(f'and i8 {byte}, {wanted}')}, 0")


def flag_mask(w: Writer, address: Address) -> tuple[str, str]:
    """Of the reference in an address: whether it names a whole byte, and the mask of the bit that it names."""
    reference = w.value(address[0][1])
    low = w.new(f"trunc i64 {reference} to i8")
    bit = w.new(f"and i8 {low}, 7")
    return w.new(f"icmp eq i8 {low}, {WHOLE_BYTES - 256}"), w.new(f"shl i8 1, {bit}")


def _reference(w: Writer, machine: str, address: Address, bit: int) -> str:
    moved = w.new(f"shl i64 {w.offset(address, 1)}, {OFFSET_SHIFT}")
    if not w.loose(address):
        return w.new(f"add i64 {moved}, {(BUFFER_OBJECT << OBJECT_SHIFT) + bit}")
    whose = w.new(f"and i64 {w.value(address[0][1])}, {-1 << OBJECT_SHIFT}")
    return w.new(f"or i64 {whose}, {w.new(f'or i64 {moved}, {bit}')}")


def _bit_behind(w: Writer, machine: str, a: Node, n: Node) -> str:
    reference, number = w.value(a), w.value(n)
    bit = w.new(f"and i64 {reference}, {WHOLE_BYTES}")
    start = w.new(f"select i1 {w.new(f'icmp eq i64 {bit}, {WHOLE_BYTES}')}, i64 0, i64 {bit}")
    number = w.new(f"add i64 {number}, {start}")
    offset = w.new(f"add i64 {w.new(f'lshr i64 {reference}, {OFFSET_SHIFT}')}, {w.new(f'ashr i64 {number}, 3')}")
    moved = w.new(f"shl i64 {w.new(f'and i64 {offset}, {OFFSET_MASK}')}, {OFFSET_SHIFT}")
    whose = w.new(f"and i64 {reference}, {-1 << OBJECT_SHIFT}")
    return w.new(f"or i64 {w.new(f'or i64 {whose}, {moved}')}, {w.new(f'and i64 {number}, 7')}")


# --- arithmetic -----------------------------------------------------------------------------------------------------


def _binary(integer: str, real: str) -> Row:
    def emit(w: Writer, machine: str, a: Node, b: Node) -> str:
        return w.new(f"{real if is_float(machine) else integer} {ir(machine)} {w.value(a)}, {w.value(b)}")

    return emit


def _divide(w: Writer, machine: str, a: Node, b: Node, site: int) -> str:
    if is_float(machine):
        return w.new(f"fdiv {ir(machine)} {w.value(a)}, {w.value(b)}")
    return _quotient(w, "div", machine, a, b, site)


def _remainder(w: Writer, machine: str, a: Node, b: Node, site: int) -> str:
    return _quotient(w, "rem", machine, a, b, site)


def _quotient(w: Writer, what: str, machine: str, a: Node, b: Node, site: int) -> str:
    """Division of integers: the least by -1, which processors refuse, wraps."""
    kind, left, right = ir(machine), w.value(a), w.value(b)
    if b[0] != "const" or not b[2]:
        zero = w.new(f"icmp eq {kind} {right}, 0")
        w.trap_if(zero, "R0101", site, (machine, left), (machine, right))
    if not signed(machine):
        return w.new(f"u{what} {kind} {left}, {right}")
    if b[0] == "const" and b[2] != -1:
        return w.new(f"s{what} {kind} {left}, {right}")
    minus = w.new(f"icmp eq {kind} {right}, -1")
    divisor = w.new(f"select i1 {minus}, {kind} 1, {kind} {right}")
    answer = w.new(f"s{what} {kind} {left}, {divisor}")
    if what == "rem":
        return answer
    return w.new(f"select i1 {minus}, {kind} {w.new(f'sub {kind} 0, {left}')}, {kind} {answer}")


def _floor_divide(w: Writer, machine: str, a: Node, b: Node) -> str:
    left, right = w.value(a), w.value(b)
    if w.range_of(a)[0] >= 0:
        return w.new(f"udiv i64 {left}, {right}")
    below = w.new(f"icmp slt i64 {w.new(f'srem i64 {left}, {right}')}, 0")
    return w.new(f"add i64 {w.new(f'sdiv i64 {left}, {right}')}, {w.new(f'sext i1 {below} to i64')}")


def _negative(w: Writer, machine: str, a: Node) -> str:
    value = w.value(a)
    return w.new(f"fneg {ir(machine)} {value}" if is_float(machine) else f"sub {ir(machine)} 0, {value}")


def _magnitude(w: Writer, machine: str, a: Node) -> str:
    kind, value = ir(machine), w.value(a)
    if is_float(machine):
        return w.new(f"call {kind} @llvm.fabs.{machine}({kind} {value})")
    return w.new(f"call {kind} @llvm.abs.{kind}({kind} {value}, i1 false)") if signed(machine) else value


def _widely(function: str) -> Row:
    """A function of doubles; a REAL is rounded behind it."""

    def emit(w: Writer, machine: str, *operands: Node) -> str:
        values = [as_double(w, w.value(a), machine) for a in operands]
        answer = w.new(f"call double @{function}({', '.join(f'double {value}' for value in values)})")
        return w.new(f"fptrunc double {answer} to float") if machine == "f32" else answer

    return emit


def as_double(w: Writer, value: str, machine: str) -> str:
    return w.new(f"fpext float {value} to double") if machine == "f32" else value


def _math(w: Writer, machine: str, function: str, a: Node) -> str:
    return _widely("llvm.sqrt.f64" if function == "sqrt" else f"fbvm_{function}")(w, machine, a)


def _arctangent(w: Writer, machine: str, y: Node, x: Node) -> str:
    kind, up, right = ir(machine), w.value(y), w.value(x)
    nowhere = w.new(f"and i1 {w.new(f'fcmp oeq {kind} {up}, 0.0')}, {w.new(f'fcmp oeq {kind} {right}, 0.0')}")
    operands = [as_double(w, value, machine) for value in (up, right)]
    angle = w.new(f"call double @fbvm_atan2(double {operands[0]}, double {operands[1]})")
    if machine == "f32":
        angle = w.new(f"fptrunc double {angle} to float")
    return w.new(f"select i1 {nowhere}, {kind} 0.0, {kind} {angle}")


def _extreme(name: str) -> Row:
    """a if a is first or the two are equal, b if b is, NaN if neither can be told."""
    first = {"min": "le", "max": "ge"}[name]

    def emit(w: Writer, machine: str, a: Node, b: Node) -> str:
        kind, left, right = ir(machine), w.value(a), w.value(b)
        if is_float(machine):
            other = w.new(f"fcmp o{first[0]}t {kind} {right}, {left}")
            rest = w.new(f"select i1 {other}, {kind} {right}, {kind} {NAN_BITS[machine]}")
            return w.new(f"select i1 {w.new(f'fcmp o{first} {kind} {left}, {right}')}, {kind} {left}, {kind} {rest}")
        sign = "s" if signed(machine) else "u"
        return w.new(f"call {kind} @llvm.{sign}{name}.{kind}({kind} {left}, {kind} {right})")

    return emit


# --- bits -----------------------------------------------------------------------------------------------------------


def _not(w: Writer, machine: str, a: Node) -> str:
    if machine == "b" and a[0] == "load":
        return from_memory(w, "b", *place(w, "b", a[2]), test="eq")
    return w.new(f"xor {ir(machine)} {w.value(a)}, {'true' if machine == 'b' else -1}")


def _shift(name: str) -> Row:
    def emit(w: Writer, machine: str, a: Node, n: Node, site: int) -> str:
        kind, value, count = ir(machine), w.value(a), w.value(n)
        if not (n[0] == "const" and n[2] >= 0):
            w.trap_if(w.new(f"icmp slt i64 {count}, 0"), "R0106", site, ("i64", count))
        by = count if kind == "i64" else w.new(f"trunc i64 {count} to {kind}")
        if name in ("fshl", "fshr"):
            return w.new(f"call {kind} @llvm.{name}.{kind}({kind} {value}, {kind} {value}, {kind} {by})")
        inside = w.new(f"icmp ult i64 {count}, {width(machine)}")
        shifted = w.new(f"{name} {kind} {value}, {w.new(f'and {kind} {by}, {width(machine) - 1}')}")
        return w.new(f"select i1 {inside}, {kind} {shifted}, {kind} 0")

    return emit


def _lazy(name: str) -> Row:
    """The second operand is evaluated only where it counts, or where that cannot be told."""
    idle = {"and": "false", "or": "true"}[name]

    def emit(w: Writer, machine: str, a: Node, b: Node) -> str:
        left = w.value(a)
        if not may_trap(b):
            return w.new(f"{name} i1 {left}, {w.value(b)}")
        before, more, after = w.here, w.label(), w.label()
        w.branch(left, *((more, after) if name == "and" else (after, more)))
        w.begin(more)
        right, ended = w.value(b), w.here
        w.jump(after)
        w.begin(after)
        return w.new(f"phi i1 [ {idle}, %{before} ], [ {right}, %{ended} ]")

    return emit


def _bcd_number(w: Writer, machine: str, source: str, a: Node, site: int) -> str:
    value = w.value(a)
    number = w.call("bcd_number", w.widened(value, source))
    high = min(limits(machine)[1], (1 << 63) - 1)
    w.trap_if(w.new(f"icmp ugt i64 {number}, {high}"), "R0105", site, (source, value))
    return cut(w, number, machine)


def _bcd_digits(w: Writer, machine: str, source: str, a: Node, site: int) -> str:
    value = w.value(a)
    number = w.widened(value, source)
    most = 10 ** (width(machine) // 4) - 1
    w.trap_if(w.new(f"icmp ugt i64 {number}, {most}"), "R0105", site, (source, value))
    return cut(w, w.call("bcd_digits", number), machine)


def cut(w: Writer, number: str, machine: str) -> str:
    """The low bits of a number of 64 bits."""
    return number if ir(machine) == "i64" else w.new(f"trunc i64 {number} to {ir(machine)}")


# --- comparison and choice ------------------------------------------------------------------------------------------


def _compare(name: str) -> Row:
    def emit(w: Writer, machine: str, kind: str, a: Node, b: Node) -> str:
        if kind in TEXT_UNITS:
            left, right = w.text(a), w.text(b)
            order = text_order(w, left, right)
            return w.new(f"icmp {name if name in ('eq', 'ne') else 's' + name} i64 {order}, 0")
        left_value, right_value = w.value(a), w.value(b)
        return w.new(f"{_comparison(name, kind)} {ir(kind)} {left_value}, {right_value}")

    return emit


def _comparison(name: str, kind: str) -> str:
    if is_float(kind):
        return f"fcmp {'u' if name == 'ne' else 'o'}{name}"
    return f"icmp {name if name in ('eq', 'ne') else ('s' if signed(kind) else 'u') + name}"


def _is_set(w: Writer, machine: str, kind: str, a: Node) -> str:
    value = w.value(a)
    return w.new(f"fcmp une {ir(kind)} {value}, 0.0" if is_float(kind)
                 else f"icmp ne {ir(kind)} {value}, {'false' if kind == 'b' else 0}")


def _select(w: Writer, machine: str, g: Node, a: Node, b: Node) -> str:
    chosen, left, right = w.value(g), w.value(a), w.value(b)
    return w.new(f"select i1 {chosen}, {ir(machine)} {right}, {ir(machine)} {left}")


def _mux(w: Writer, machine: str, k: Node, choices: tuple[Node, ...], site: int) -> str:
    number = w.value(k)
    values = [w.value(choice) for choice in choices]
    choose = chooser(w, number, len(values), site)
    return choose(ir(machine), values)


def chooser(w: Writer, number: str, count: int, site: int) -> Callable[[str, list[str]], str]:
    """What picks one of `count` values by number, which is checked (R0107)."""
    w.trap_if(w.new(f"icmp uge i64 {number}, {count}"), "R0107", site, ("i64", number), ("const", count - 1))
    tests = [w.new(f"icmp eq i64 {number}, {place}") for place in range(count - 1)]

    def choose(kind: str, values: list[str]) -> str:
        answer = values[-1]
        for test, value in zip(reversed(tests), reversed(values[:-1]), strict=True):
            answer = w.new(f"select i1 {test}, {kind} {value}, {kind} {answer}")
        return answer

    return choose


def _check(w: Writer, machine: str, a: Node, low: int, high: int, code: str, site: int) -> str:
    value, (least, greatest), kind = w.value(a), w.range_of(a), ir(machine)
    sign = "s" if signed(machine) else "u"
    tests = []
    if least < low:
        tests.append("true" if low > limits(machine)[1] else w.new(f"icmp {sign}lt {kind} {value}, {low}"))
    if greatest > high:
        tests.append("true" if high < limits(machine)[0] else w.new(f"icmp {sign}gt {kind} {value}, {high}"))
    if tests:
        outside = tests[0] if len(tests) == 1 else w.new(f"or i1 {tests[0]}, {tests[1]}")
        w.trap_if(outside, code, site, (machine, value), ("const", low), ("const", high))
    return value


def _within(w: Writer, machine: str, a: Node, low: Node, high: Node, code: str, site: int) -> str:
    value, least, greatest = w.value(a), w.value(low), w.value(high)
    under, over = w.new(f"icmp slt i64 {value}, {least}"), w.new(f"icmp sgt i64 {value}, {greatest}")
    w.trap_if(w.new(f"or i1 {under}, {over}"), code, site, ("i64", value), ("i64", least), ("i64", greatest))
    return value


# --- texts ----------------------------------------------------------------------------------------------------------


def text_order(w: Writer, left: Text, right: Text) -> str:
    """Below 0, 0 or above: how a text stands to another of its width."""
    routine = "text_order" if left.unit == 1 else "wide_order"
    return w.call(routine, w.integer(left.at), left.length, w.integer(right.at), right.length)


VALUES: dict[str, Row] = {
    "const": lambda w, machine, value: literal(machine, value),
    "tmp": lambda w, machine, number: from_memory(w, machine, w.temporary(number, machine), SIZES[machine], ""),
    "load": _load, "load_raw": _load_raw, "load_bit": _load_bit, "load_flag": _load_flag,
    "add": _binary("add", "fadd"), "sub": _binary("sub", "fsub"), "mul": _binary("mul", "fmul"),
    "div": _divide, "mod": _remainder, "neg": _negative, "abs": _magnitude, "pow": _widely("fbvm_pow"),
    "and": _binary("and", ""), "or": _binary("or", ""), "xor": _binary("xor", ""), "not": _not,
    "and_then": _lazy("and"), "or_else": _lazy("or"),
    "shl": _shift("shl"), "shr": _shift("lshr"), "rol": _shift("fshl"), "ror": _shift("fshr"),
    **{name: _compare(name) for name in ("eq", "ne", "lt", "le", "gt", "ge")},
    "convert": convert, "nearest": nearest, "truncate": truncate, "bits": bits,
    "is_set": _is_set, "select": _select, "mux": _mux, "min": _extreme("min"), "max": _extreme("max"),
    "check": _check, "within": _within, "math": _math, "atan2": _arctangent, "floor_div": _floor_divide,
    "now": lambda w, machine: w.system(NOW),
    "from_bcd": _bcd_number, "to_bcd": _bcd_digits,
    "reference": _reference, "bit_behind": _bit_behind,
}
"""How each operation is written but those that yield or read a text: called with the operands of its row."""
