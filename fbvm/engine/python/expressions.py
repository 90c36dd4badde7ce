"""Expressions of code as expressions of Python: one row an operation.

A row decides nothing: what it writes means what the table of operations says."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fbvm.base.areas import NOW
from fbvm.base.arithmetic import limits, width
from fbvm.code.operations import BUFFER_OBJECT, INTEGERS, OBJECT_SHIFT, OFFSET_SHIFT, SIZES, TEXT_UNITS, Address, Node
from fbvm.engine.python.writer import ARITHMETIC, LONGEST_TWICE, Expressions, Rows, bare, view
from fbvm.engine.ranges import constant_integer, is_float, mask, may_trap

SIGNS = {"add": "+", "sub": "-", "mul": "*", "and": "&", "or": "|", "xor": "^",
         "eq": "==", "ne": "!=", "lt": "<", "le": "<=", "gt": ">", "ge": ">="}


def _brought(name: str) -> Callable[..., str]:
    """The row of an operation that `loose` knows: its number brought into the type."""

    def emit(e: Expressions, machine: str, *operands: Any) -> str:
        node = (name, machine, *operands)
        text = _LOOSE[name](e, node)
        if machine == "f32":
            return e.rounded(node, text)
        return text if machine == "f64" or (machine in INTEGERS and e.never_wraps(node)) else e.bring(text, machine)

    return emit


def _binary(e: Expressions, node: Node) -> str:
    read = e.value if is_float(node[1]) or e.never_wraps(node) else e.loose
    return f"({read(node[2])} {SIGNS[node[0]]} {read(node[3])})"


def _negative(e: Expressions, node: Node) -> str:
    read = e.value if is_float(node[1]) or e.never_wraps(node) else e.loose
    return f"(-{read(node[2])})"


def _loose_convert(e: Expressions, node: Node) -> str:
    _, machine, source, a = node
    if is_float(machine):
        return e.value(a) if is_float(source) else f"float({bare(e.value(a))})"
    if source == "b":
        return f"(1 if {e.condition(a)} else 0)"
    return e.loose(a) if width(machine) <= width(source) and not e.never_wraps(node) else e.value(a)


def _convert(e: Expressions, machine: str, source: str, a: Node) -> str:
    if machine == "f32" and not is_float(source):
        low, high = e.range_of(a)
        exact = low >= -(1 << 24) and high <= 1 << 24
        return f"{'float' if exact else 'single_of_integer'}({bare(e.value(a))})"
    if (is_float(source) and machine == "f64") or machine == source:
        return e.value(a)
    return _brought("convert")(e, machine, source, a)


def _loose_divide(e: Expressions, node: Node) -> str:
    a, b = node[2], node[3]
    if b[0] == "const" and b[2]:
        return f"({e.value(a)} / {e.value(b)})"
    if may_trap(a) and may_trap(b):
        return f"divide({bare(e.value(a))}, {bare(e.value(b))})"
    first, divisor = e.once(e.value(b))
    dividend = bare(e.value(a))
    if len(dividend) > LONGEST_TWICE:
        return f"divide({dividend}, {first})"
    return f"(({dividend}) / {divisor} if {first} else divide({dividend}, {divisor}))"


def _divide(e: Expressions, machine: str, a: Node, b: Node, site: int) -> str:
    node = ("div", machine, a, b, site)
    if is_float(machine):
        return _brought("div")(e, machine, a, b, site)
    divisor = constant_integer(b)
    if divisor is not None and divisor > 0:
        return _toward_zero("//", e, a, divisor)
    text = f"quotient({bare(e.value(a))}, {bare(e.value(b))}, {site})"
    return text if e.never_wraps(node) or divisor not in (None, -1) else e.bring(text, machine)


def _toward_zero(sign: str, e: Expressions, a: Node, b: int) -> str:
    """Quotient or remainder by a positive constant; Python's go toward minus infinity."""
    if e.range_of(a)[0] >= 0:
        return f"({e.value(a)} {sign} {b})"
    first, v = e.once(e.value(a))
    return f"({v} {sign} {b} if {first} >= 0 else -(-{v} {sign} {b}))"


def _remainder(e: Expressions, machine: str, a: Node, b: Node, site: int) -> str:
    divisor = constant_integer(b)
    if divisor is not None and divisor > 0:
        return _toward_zero("%", e, a, divisor)
    return f"remainder({bare(e.value(a))}, {bare(e.value(b))}, {site})"


def _function(e: Expressions, node: Node) -> str:
    return f"math_{node[2]}({bare(e.value(node[3]))})"


def _two(function: str) -> Callable[[Expressions, Node], str]:
    return lambda e, node: f"{function}({bare(e.value(node[2]))}, {bare(e.value(node[3]))})"


def _bitwise(name: str) -> Callable[..., str]:
    """Both operands are evaluated; where that cannot be told, Python's shorter way does for BOOL."""

    def emit(e: Expressions, machine: str, a: Node, b: Node) -> str:
        if machine == "b":
            word = {"and": "and", "or": "or"}.get(name)
            if word and not may_trap(b):
                return f"({e.value(a)} {word} {e.aside(e.value, b)})"
            return f"({e.value(a)} {'!=' if name == 'xor' else SIGNS[name]} {e.value(b)})"
        reads = [e.value, e.value]
        if name == "and" and "const" in (a[0], b[0]):
            reads[0 if b[0] == "const" else 1] = e.loose  # the mask is within the width
        return f"({reads[0](a)} {SIGNS[name]} {reads[1](b)})"

    return emit


def _lazy(word: str) -> Callable[..., str]:
    return lambda e, machine, a, b: f"({e.value(a)} {word} {e.aside(e.value, b)})"


def _not(e: Expressions, machine: str, a: Node) -> str:
    return f"(not {e.condition(a)})" if machine == "b" else f"({e.value(a)} ^ {mask(machine)})"


def _compare(name: str) -> Callable[..., str]:
    return lambda e, machine, kind, a, b: f"({e.value(a)} {SIGNS[name]} {e.value(b)})"


_USUAL_SHIFTS = {"shift_left": "<<", "shift_right": ">>"}
"""Python's operators where 0 to less than the width is shifted by; all else is seen to by the functions."""


def _shift(name: str) -> Callable[..., str]:
    def emit(e: Expressions, machine: str, a: Node, n: Node, site: int) -> str:
        count = constant_integer(n)
        if count is not None and 0 <= count < width(machine):
            if name == "shift_left":
                return e.bring(f"({e.loose(a)} << {count})", machine)
            if name == "shift_right" and (count == 0 or e.range_of(a)[0] >= 0):
                return f"({e.value(a)} >> {count})" if count else e.value(a)
        if name in _USUAL_SHIFTS and not (may_trap(a) and may_trap(n)) and (name == "shift_left" or e.range_of(a)[0] >= 0):
            first, by = e.once(e.value(n))
            shifted = bare(e.value(a))
            if len(shifted) <= LONGEST_TWICE:
                usual = f"(({shifted}) {_USUAL_SHIFTS[name]} {by})"
                usual = e.bring(usual, machine) if name == "shift_left" else usual
                return f"({usual} if 0 <= {first} < {width(machine)} else {name}({shifted}, {by}, {machine!r}, {site}))"
        return f"{name}({bare(e.value(a))}, {bare(e.value(n))}, {machine!r}, {site})"

    return emit


def _call(function: str) -> Callable[..., str]:
    """A function of the runtime over the operands as they stand: expressions evaluated, the rest as constants."""

    def emit(e: Expressions, machine: str, *operands: Any) -> str:
        texts = [bare(e.value(o)) if isinstance(o, tuple) else repr(o) for o in operands]
        return f"{function}({', '.join(texts)})"

    return emit


def _nearest(e: Expressions, machine: str, kind: str, a: Node, site: int) -> str:
    """Python's `round` where the number fits: halves go to the even neighbour, which the least number of a type is."""
    first, v = e.once(e.value(a))
    low, high = limits(machine)
    return f"(round({v}) if {low - 0.5!r} <= {first} < {high + 0.5!r} else nearest({v}, {machine!r}, {site}))"


def _truncate(e: Expressions, machine: str, kind: str, a: Node, site: int) -> str:
    first, v = e.once(e.value(a))
    low, high = limits(machine)
    return f"(int({v}) if {float(low - 1)!r} < {first} < {float(high + 1)!r} else truncate({v}, {machine!r}, {site}))"


def _to_integer(function: str) -> Callable[..., str]:
    return lambda e, machine, kind, a, site: f"{function}({bare(e.value(a))}, {machine!r}, {site})"


def _bits(e: Expressions, machine: str, source: str, a: Node) -> str:
    if machine == source and not is_float(machine):
        return e.value(a)
    if is_float(machine) or is_float(source):
        return f"bits({bare(e.value(a))}, {source!r}, {machine!r})"
    return e.bring(e.value(a), machine)


def _select(e: Expressions, machine: str, g: Node, a: Node, b: Node) -> str:
    if may_trap(a) or may_trap(b):
        return f"choose({bare(e.value(g))}, {bare(e.value(a))}, {bare(e.value(b))})"
    return f"({e.aside(e.value, b)} if {e.condition(g)} else {e.aside(e.value, a)})"


def _mux(e: Expressions, machine: str, k: Node, choices: tuple[Node, ...], site: int) -> str:
    return f"mux({bare(e.value(k))}, ({''.join(bare(e.value(c)) + ', ' for c in choices)}), {site})"


def _extreme(sign: str, function: str) -> Callable[..., str]:
    def emit(e: Expressions, machine: str, a: Node, b: Node) -> str:
        if is_float(machine):
            return f"{function}({bare(e.value(a))}, {bare(e.value(b))})"
        first, v = e.once(e.value(a))
        second, w = e.once(e.value(b))
        return f"({v} if {first} {sign} {second} else {w})"

    return emit


def _check(e: Expressions, machine: str, a: Node, low: int, high: int, code: str, site: int) -> str:
    least, greatest = e.range_of(a)
    if low <= least and greatest <= high:
        return e.value(a)
    lowest, highest = limits(machine)
    if a[0] in ARITHMETIC and lowest <= low and high <= highest and not e.never_wraps(a):  # a number within needs no wrap
        first, v = e.once(e.loose(a))
        return f"({v} if {low} <= {first} <= {high} else wrapped({v}, {machine!r}, {low}, {high}, {code!r}, {site}))"
    first, v = e.once(e.value(a))
    return f"({v} if {low} <= {first} <= {high} else stop({code!r}, {site}, {v}, {low}, {high}))"


def _within(e: Expressions, machine: str, a: Node, low: Node, high: Node, code: str, site: int) -> str:
    parts = ", ".join(bare(e.value(part)) for part in (a, low, high))
    return f"within({parts}, {code!r}, {site})"


def _temporary(e: Expressions, machine: str, number: Any) -> str:
    known = e.known_range(("tmp", machine, number))
    return str(known[0]) if known and known[0] == known[1] else f"t{number}"


def _load(e: Expressions, machine: str, address: Address) -> str:
    if isinstance(address[0], tuple):
        return _load_raw(e, machine, address)
    return e.kept(machine, address) or e.item(address, machine)


def _load_raw(e: Expressions, machine: str, address: Address) -> str:
    if SIZES[machine] == 1:
        return f"{view(machine)}[{bare(e.place(address, 1))}]"
    return f"get_{machine}(buffer, {bare(e.place(address, SIZES[machine]))})[0]"


def _load_bit(e: Expressions, machine: str, address: Address, bit: int) -> str:
    return f"({_bit(e, address, bit)} != 0)"


def _bit(e: Expressions, address: Address, bit: int) -> str:
    """Python for something that is true if a bit is set."""
    byte = f"u8[{bare(e.place(address, 1))}]" if isinstance(address[0], tuple) else e.item(address, "u8")
    return f"{byte} & {1 << bit}"


def _load_flag(e: Expressions, machine: str, address: Address) -> str:
    if not isinstance(address[0], tuple):
        return _load(e, machine, address)
    return f"get_flag({flag_operands(e, address)})"


def flag_operands(e: Expressions, address: Address) -> str:
    """Reference, distance and site of a BOOL behind a reference, as the runtime takes them."""
    (_, reference, site), offset, terms = address
    delta = bare(e.place(("abs", offset, terms), 1))
    return f"{bare(e.value(reference))}, {delta}, {site}"


def _load_text(e: Expressions, machine: str, address: Address, capacity: int) -> str:
    return f"get_{machine}({bare(e.place(address, capacity * TEXT_UNITS[machine]))}, {capacity})"


def _reference(e: Expressions, machine: str, address: Address, bit: int) -> str:
    if isinstance(address[0], tuple):
        (_, reference, site), offset, terms = address
        delta = bare(e.place(("abs", offset, terms), 1))
        return f"moved({bare(e.value(reference))}, {delta}, {bit}, {site})"
    place, rest = e.place(address, 1), (BUFFER_OBJECT << OBJECT_SHIFT) + bit
    return str((int(place) << OFFSET_SHIFT) + rest) if place.isdigit() else f"(({place} << {OFFSET_SHIFT}) + {rest})"


def _const(e: Expressions, machine: str, value: Any) -> str:
    if machine == "b":
        return repr(bool(value))
    if is_float(machine):
        return {"nan": "NAN", "inf": "INF", "-inf": "(-INF)"}.get(repr(float(value)), repr(float(value)))
    return repr(value)


def _enum_text(e: Expressions, machine: str, names: Any, a: Node) -> str:
    return f"enum_text({e.constant(dict(names))}, {bare(e.value(a))})"


def _both(word: str, e: Expressions, node: Node) -> str:
    if may_trap(node[3]):
        return e.value(node)
    return f"({e.condition(node[2])} {word} {e.aside(e.condition, node[3])})"


_LOOSE: dict[str, Callable[[Expressions, Node], str]] = {
    "add": _binary, "sub": _binary, "mul": _binary, "neg": _negative,
    "abs": lambda e, node: f"abs({bare(e.value(node[2]))})",
    "convert": _loose_convert, "div": _loose_divide, "math": _function, "pow": _two("power"),
    "atan2": _two("arctangent"),
}
"""Operations whose number becomes the value when it is brought into the type (`div` here: of floats only)."""

VALUES: dict[str, Callable[..., str]] = {
    "const": _const,
    "tmp": _temporary,
    "load": _load, "load_raw": _load_raw, "load_bit": _load_bit, "load_flag": _load_flag, "load_text": _load_text,
    **{name: _brought(name) for name in ("add", "sub", "mul", "neg", "abs", "pow", "math", "atan2")},
    "div": _divide, "mod": _remainder,
    "and": _bitwise("and"), "or": _bitwise("or"), "xor": _bitwise("xor"), "not": _not,
    "and_then": _lazy("and"), "or_else": _lazy("or"),
    "shl": _shift("shift_left"), "shr": _shift("shift_right"),
    "rol": _shift("rotate_left"), "ror": _shift("rotate_right"),
    **{name: _compare(name) for name in ("eq", "ne", "lt", "le", "gt", "ge")},
    "convert": _convert, "nearest": _nearest, "truncate": _truncate, "bits": _bits,
    "is_set": lambda e, machine, kind, a: f"({e.value(a)} != 0)",
    "select": _select, "mux": _mux, "min": _extreme("<=", "lesser"), "max": _extreme(">=", "greater"),
    "check": _check, "within": _within,
    "floor_div": lambda e, machine, a, b: f"({e.value(a)} // {e.value(b)})",
    "now": lambda e, machine: f"i64[{NOW // 8}]",
    "from_bcd": _to_integer("from_bcd"), "to_bcd": _to_integer("to_bcd"),
    "length": lambda e, machine, a: e.bring(f"len({bare(e.value(a))})", machine),
    "left": _call("left"), "right": _call("right"), "mid": _call("mid"), "insert": _call("insert"),
    "delete": _call("delete"), "replace": _call("replace"),
    "concat": lambda e, machine, a, b: f"({e.value(a)} + {e.value(b)})",
    "find": lambda e, machine, a, b: e.bring(f"find({bare(e.value(a))}, {bare(e.value(b))})", machine),
    "characters": _call("characters"), "units_of": _call("units_of"),
    "to_text": _call("to_text"), "from_text": _call("from_text"), "from_leading": _call("from_leading"), "enum_text": _enum_text,
    "character": lambda e, machine, a: f"character({bare(e.value(a))}, {machine == 's16'})",
    "first": lambda e, machine, a: f"first({bare(e.value(a))})",
    "recode": lambda e, machine, a: f"{'widened' if machine == 's16' else 'narrowed'}({bare(e.value(a))})",
    "reference": _reference, "bit_behind": _call("bit_behind"),
}
"""How each operation is written: called with the operands of its row."""

_CONDITIONS: dict[str, Callable[[Expressions, Node], str]] = {
    "load_bit": lambda e, node: _bit(e, node[2], node[3]),
    "is_set": lambda e, node: e.value(node[3]),
    "and": lambda e, node: _both("and", e, node),
    "or": lambda e, node: _both("or", e, node),
    "and_then": lambda e, node: f"({e.condition(node[2])} and {e.aside(e.condition, node[3])})",
    "or_else": lambda e, node: f"({e.condition(node[2])} or {e.aside(e.condition, node[3])})",
}
"""Shorter forms where only the truth of a BOOL is wanted."""

ROWS = Rows(VALUES, _LOOSE, _CONDITIONS)
