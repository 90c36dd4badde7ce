"""Expressions of code as terms: one row an operation.

A row decides nothing: it says in bit-vectors what the table of operations says.  What has no row of its own (REAL, text) is
worked out where all operands are constants; else it is a value of which nothing is known."""

from __future__ import annotations

import struct
from typing import Any

from fbvm.base.arithmetic import NAN, Undefined, limits, width
from fbvm.code.builder.evaluation import value_of
from fbvm.code.operations import (
    BIT_MASK,
    EXPRESSIONS,
    FLOATS,
    OBJECT_SHIFT,
    OFFSET_MASK,
    OFFSET_SHIFT,
    SIZES,
    TEXT_UNITS,
    WHOLE_BYTES,
    Address,
    Node,
)
from fbvm.prove.encoding import reals
from fbvm.prove.encoding.addresses import cases, targets
from fbvm.prove.encoding.cells import Contents
from fbvm.prove.encoding.execution import Execution, Refused, Row, State
from fbvm.prove.encoding.terms import TEXT, Term, signed

_PACKED = {"f32": "<f", "f64": "<d"}


def term_width(machine: str) -> int:
    """The width of the terms of a machine type."""
    return TEXT if machine in TEXT_UNITS else 0 if machine == "b" else width(machine)


def is_signed(machine: str) -> bool:
    return machine[0] == "i"


def constant_term(x: Execution, machine: str, value: Any) -> Term:
    """A constant of code as a term."""
    if machine in TEXT_UNITS:
        return x.terms.text(value)
    if machine in FLOATS:
        data = struct.pack(_PACKED[machine], value if value == value else NAN)
        return x.terms.constant(8 * len(data), int.from_bytes(data, "little"))
    return x.terms.constant(term_width(machine), int(value))


def constant_value(machine: str, term: Term) -> Any:
    """The Python value of a constant term."""
    if machine in TEXT_UNITS:
        return term.value
    if machine in FLOATS:
        return struct.unpack(_PACKED[machine], term.value.to_bytes(width(machine) // 8, "little"))[0]
    if machine == "b":
        return bool(term.value)
    return signed(term.value, term.width) if is_signed(machine) else term.value


def folded(x: Execution, state: State, name: str, machine: str, nodes: list[Node], rest: tuple[Any, ...] = (),
           before: tuple[Any, ...] = ()) -> Term:  # fmt: skip
    """An operation that is worked out for constants only.

    `before` and `rest` are what its row has in front of the expressions `nodes`, and behind."""
    values = [x.value(state, node) for node in nodes]
    if all(value.is_constant for value in values):
        known = [("const", node[1], constant_value(node[1], value)) for node, value in zip(nodes, values, strict=True)]
        try:
            return constant_term(x, machine, value_of((name, machine, *before, *known, *rest)))
        except Undefined as undefined:
            x.trap(state, x.terms.true, undefined.code, rest[-1])
    return _unknown(x, state, name, machine, nodes, values, rest, before)


def _unknown(x: Execution, state: State, name: str, machine: str, nodes: list[Node], values: list[Term], rest: tuple[Any, ...],
             before: tuple[Any, ...]) -> Term:  # fmt: skip
    """The result of an operation of which nothing is known, not even whether it traps."""
    codes = EXPRESSIONS[name].traps
    key = (name, machine, *before, *(rest[:-1] if codes else rest))
    x.unknowns.setdefault(f"{name} of {_shown(nodes, machine)}", x.site)
    if codes:
        x.trap(state, x.terms.unknown(("trap", *key), 0, *values), codes[0], rest[-1])
    return x.terms.unknown(key, term_width(machine), *values)


_SHOWN = {"f32": "REAL", "f64": "LREAL", "s8": "STRING", "s16": "WSTRING"}


def _shown(nodes: list[Node], machine: str) -> str:
    kinds = [_SHOWN[each] for each in (*(node[1] for node in nodes), machine) if each in _SHOWN]
    return kinds[0] if kinds else machine


# --- memory -----------------------------------------------------------------------------------------------------------


def _chosen(x: Execution, found: list[tuple[Term, Term]], machine: str) -> Term:
    """One of some values by their conditions."""
    if not found:
        return x.terms.unknown("nowhere", term_width(machine))
    value = found[-1][1]
    for condition, other in reversed(found[:-1]):
        value = x.terms.ite(condition, other, value)
    return value


def _load(x: Execution, state: State, machine: str, address: Address) -> Term:
    size = SIZES[machine]
    found = [(target.condition, _at(state.contents, target.offset, size, machine))
             for target in targets(x, state, address, size)]
    return _chosen(x, found, machine)


def _at(contents: Contents, offset: int, size: int, machine: str) -> Term:
    return contents.boolean(offset) if machine == "b" else contents.number(offset, size)


def _load_bit(x: Execution, state: State, machine: str, address: Address, bit: int) -> Term:
    found = [(target.condition, state.contents.bit(target.offset, bit)) for target in targets(x, state, address, 1)]
    return _chosen(x, found, "b")


def _load_flag(x: Execution, state: State, machine: str, address: Address) -> Term:
    return _chosen(x, [(target.condition, _flag(state.contents, target.offset, target.bit))
                       for target in targets(x, state, address, 1)], "b")


def _flag(contents: Contents, offset: int, bit: int) -> Term:
    return contents.boolean(offset) if bit == WHOLE_BYTES else contents.bit(offset, bit & 7)


def _load_text(x: Execution, state: State, machine: str, address: Address, capacity: int) -> Term:
    unit = TEXT_UNITS[machine]
    found = [(target.condition, _text_at(x, state.contents, target.offset, capacity, unit))
             for target in targets(x, state, address, capacity * unit)]
    return _chosen(x, found, machine)


def _text_at(x: Execution, contents: Contents, offset: int, capacity: int, unit: int) -> Term:
    units = [contents.number(offset + unit * at, unit) for at in range(capacity)]
    end = next((at for at, term in enumerate(units) if not term.is_constant or not term.value), capacity)
    if end == capacity or units[end].is_constant:
        codes = [term.value for term in units[:end]]
        return x.terms.text(bytes(codes) if unit == 1 else "".join(map(chr, codes)))
    x.unknowns.setdefault("text of STRING" if unit == 1 else "text of WSTRING", x.site)
    return x.terms.unknown(("text", unit), TEXT, *units)


def _reference(x: Execution, state: State, machine: str, address: Address, bit: int) -> Term:
    found = [(target.condition, x.terms.constant(64, target.owner << OBJECT_SHIFT | target.offset << OFFSET_SHIFT | bit))
             for target in targets(x, state, address, 1)]
    return _chosen(x, found, "ref")


def _bit_behind(x: Execution, state: State, machine: str, a: Node, n: Node) -> Term:
    references, counts = (cases(x.terms, state, x.value(state, node)) for node in (a, n))
    if references is None or counts is None:
        raise Refused("a reference to a bit has no bounds that could be followed", x.site)
    found = []
    for condition, reference in references:
        start = reference & BIT_MASK
        for other, count in counts:
            at = signed(count, 64) + (0 if start == WHOLE_BYTES else start)
            offset = (reference >> OFFSET_SHIFT) + (at >> 3) & OFFSET_MASK
            moved = reference >> OBJECT_SHIFT << OBJECT_SHIFT | offset << OFFSET_SHIFT | at & 7
            found.append((x.terms.and_(condition, other), x.terms.constant(64, moved)))
    return _chosen(x, found, "ref")


# --- numbers ----------------------------------------------------------------------------------------------------------


def _sum(name: str) -> Row:
    def row(x: Execution, state: State, machine: str, a: Node, b: Node) -> Term:
        if machine in FLOATS:
            return folded(x, state, name, machine, [a, b])
        made: Term = getattr(x.terms, name)(x.value(state, a), x.value(state, b))
        return made

    return row


def _divided(name: str) -> Row:
    def row(x: Execution, state: State, machine: str, a: Node, b: Node, site: int) -> Term:
        if machine in FLOATS:
            return _real_quotient(x, state, machine, a, b, site)
        left, right = x.value(state, a), x.value(state, b)
        x.trap(state, x.terms.not_(x.terms.is_set(right)), "R0101", site)
        letter = "s" if is_signed(machine) else "u"
        return x.terms.divide(letter + {"div": "div", "mod": "rem"}[name], left, right)

    return row


def _real_quotient(x: Execution, state: State, machine: str, a: Node, b: Node, site: int) -> Term:
    """A quotient of REALs, which never traps."""
    left, right = x.value(state, a), x.value(state, b)
    if left.is_constant and right.is_constant:
        known = [("const", machine, constant_value(machine, each)) for each in (left, right)]
        return constant_term(x, machine, value_of(("div", machine, *known, site)))
    x.unknowns.setdefault(f"div of {_SHOWN[machine]}", x.site)
    return x.terms.unknown(("div", machine), width(machine), left, right)


def _neg(x: Execution, state: State, machine: str, a: Node) -> Term:
    value = x.value(state, a)
    return reals.negated(x.terms, value) if machine in FLOATS else x.terms.neg(value)


def _abs(x: Execution, state: State, machine: str, a: Node) -> Term:
    value = x.value(state, a)
    if machine in FLOATS:
        return reals.magnitude(x.terms, value)
    if not is_signed(machine):
        return value
    return x.terms.ite(x.terms.bit(value, value.width - 1), x.terms.neg(value), value)


def _bitwise(name: str) -> Row:
    def row(x: Execution, state: State, machine: str, a: Node, b: Node) -> Term:
        left, right = x.value(state, a), x.value(state, b)
        if machine != "b":
            return x.terms.bitwise(f"bv{name}", left, right)
        made: Term = {"and": x.terms.and_, "or": x.terms.or_, "xor": x.terms.xor}[name](left, right)
        return made

    return row


def _not(x: Execution, state: State, machine: str, a: Node) -> Term:
    value = x.value(state, a)
    return x.terms.not_(value) if machine == "b" else x.terms.invert(value)


def _lazy(name: str) -> Row:
    """The right side is evaluated, and may trap, only where the left one does not decide."""

    def row(x: Execution, state: State, machine: str, a: Node, b: Node) -> Term:
        left, path = x.value(state, a), state.path
        if left.is_constant:
            return x.value(state, b) if bool(left.value) == (name == "and_then") else left
        state.path = x.terms.and_(path, left if name == "and_then" else x.terms.not_(left))
        known = dict(state.known)
        right = x.value(state, b)
        state.path, state.known = path, known
        return x.terms.and_(left, right) if name == "and_then" else x.terms.or_(left, right)

    return row


def _shifted(name: str) -> Row:
    def row(x: Execution, state: State, machine: str, a: Node, n: Node, site: int) -> Term:
        terms = x.terms
        value, count = x.value(state, a), x.value(state, n)
        x.trap(state, terms.less(count, terms.constant(64, 0), True), "R0106", site)
        bits = terms.constant(64, value.width)
        if name in ("shl", "shr"):
            if count.is_constant:
                return terms.shift(name, value, count)
            narrow = terms.resized(count, value.width, False)
            return terms.ite(terms.less(count, bits, False), terms.shift(name, value, narrow), terms.constant(value.width, 0))
        count = terms.divide("urem", count, bits)
        back = terms.resized(terms.sub(bits, count), value.width, False)
        there = terms.resized(count, value.width, False)
        left, right = (there, back) if name == "rol" else (back, there)
        return terms.bitwise("bvor", terms.shift("shl", value, left), terms.shift("shr", value, right))

    return row


def _compared(name: str) -> Row:
    def row(x: Execution, state: State, machine: str, kind: str, a: Node, b: Node) -> Term:
        if kind in TEXT_UNITS:
            return folded(x, state, name, machine, [a, b], before=(kind,))
        terms, left, right = x.terms, x.value(state, a), x.value(state, b)
        if name in ("eq", "ne"):
            equal = reals.equal(terms, left, right) if kind in FLOATS else terms.eq(left, right)
            return equal if name == "eq" else terms.not_(equal)
        if left.width == 0:
            left, right = (terms.of_boolean(each, 1) for each in (left, right))
        if name[0] == "g":
            left, right = right, left
        if kind in FLOATS:
            return reals.less(terms, left, right, name[1] == "e")
        return terms.less(left, right, is_signed(kind), name[1] == "e")

    return row


def _convert(x: Execution, state: State, machine: str, source: str, a: Node) -> Term:
    if machine in FLOATS or source in FLOATS:
        return x.value(state, a) if machine == source else folded(x, state, "convert", machine, [a], before=(source,))
    value = x.value(state, a)
    if value.width == 0:
        return x.terms.of_boolean(value, width(machine))
    return x.terms.resized(value, width(machine), is_signed(source))


def _to_integer(name: str) -> Row:
    return lambda x, state, machine, kind, a, site: folded(x, state, name, machine, [a], (site,), (kind,))


def _bits(x: Execution, state: State, machine: str, source: str, a: Node) -> Term:
    if machine in FLOATS or source in FLOATS:
        return x.value(state, a) if machine == source else folded(x, state, "bits", machine, [a], before=(source,))
    return x.value(state, a)


def _is_set(x: Execution, state: State, machine: str, kind: str, a: Node) -> Term:
    value = x.value(state, a)
    return x.terms.is_set(x.terms.extract(value, 0, value.width - 1) if kind in FLOATS else value)


def _select(x: Execution, state: State, machine: str, g: Node, a: Node, b: Node) -> Term:
    choice, one, other = (x.value(state, each) for each in (g, a, b))
    return x.terms.ite(choice, other, one)


def _mux(x: Execution, state: State, machine: str, k: Node, choices: tuple[Node, ...], site: int) -> Term:
    terms, number = x.terms, x.value(state, k)
    values = [x.value(state, choice) for choice in choices]
    x.trap(state, terms.not_(terms.less(number, terms.constant(64, len(values)), False)), "R0107", site)
    return _chosen(x, [(terms.eq(number, terms.constant(64, at)), value) for at, value in enumerate(values)], machine)


def _extreme(name: str) -> Row:
    def row(x: Execution, state: State, machine: str, a: Node, b: Node) -> Term:
        if machine in TEXT_UNITS:
            return folded(x, state, name, machine, [a, b])
        left, right = x.value(state, a), x.value(state, b)
        if machine in FLOATS:
            return reals.extreme(x.terms, left, right, name == "min")
        if machine == "b":
            return x.terms.and_(left, right) if name == "min" else x.terms.or_(left, right)
        low, high = (left, right) if name == "min" else (right, left)
        return x.terms.ite(x.terms.less(low, high, is_signed(machine), True), left, right)

    return row


def _check(x: Execution, state: State, machine: str, a: Node, low: int, high: int, code: str, site: int) -> Term:
    terms, value = x.terms, x.value(state, a)
    lowest, highest = limits(machine)  # a bound may be wider than the type, as that of a time of day is
    least, greatest = terms.constant(value.width, max(low, lowest)), terms.constant(value.width, min(high, highest))
    sign = is_signed(machine)
    inside = terms.and_(terms.less(least, value, sign, True), terms.less(value, greatest, sign, True))
    x.trap(state, terms.not_(inside), code, site)
    _remember(state, value, low, high)
    return value


def _within(x: Execution, state: State, machine: str, a: Node, low: Node, high: Node, code: str, site: int) -> Term:
    terms = x.terms
    value, least, greatest = (terms.resized(x.value(state, each), 64, is_signed(each[1])) for each in (a, low, high))
    inside = terms.and_(terms.less(least, value, True, True), terms.less(value, greatest, True, True))
    x.trap(state, terms.not_(inside), code, site)
    if least.is_constant and greatest.is_constant:
        _remember(state, value, signed(least.value, 64), signed(greatest.value, 64))
    return value


def _remember(state: State, value: Term, low: int, high: int) -> None:
    """Keeps the bounds of a value that were checked, for addresses."""
    if not value.is_constant:
        before = state.known.get(value, (low, high))
        state.known[value] = max(low, before[0]), min(high, before[1])
        if value.op in ("zext", "sext") and low >= 0:
            state.known[value.args[0]] = state.known[value]


def _floor_div(x: Execution, state: State, machine: str, a: Node, b: Node) -> Term:
    terms, left, right = x.terms, x.value(state, a), x.value(state, b)
    quotient, rest = (terms.divide(op, left, right) for op in ("sdiv", "srem"))
    below = terms.less(rest, terms.constant(64, 0), True)
    return terms.ite(below, terms.sub(quotient, terms.constant(64, 1)), quotient)


def _from_bcd(x: Execution, state: State, machine: str, source: str, a: Node, site: int) -> Term:
    terms, value = x.terms, x.value(state, a)
    wide = max(value.width, width(machine))
    total, wrong = terms.constant(wide, 0), terms.false
    for digit in range(value.width // 4):
        nibble = terms.extract(value, 4 * digit, 4)
        wrong = terms.or_(wrong, terms.less(terms.constant(4, 9), nibble, False))
        total = terms.add(total, terms.mul(terms.extend(nibble, wide, False), terms.constant(wide, 10**digit)))
    most = terms.constant(wide, (1 << (width(machine) - is_signed(machine))) - 1)
    x.trap(state, terms.or_(wrong, terms.less(most, total, False)), "R0105", site)
    return terms.resized(total, width(machine), False)


def _to_bcd(x: Execution, state: State, machine: str, source: str, a: Node, site: int) -> Term:
    terms, sign = x.terms, is_signed(source)
    wide = max(width(source), width(machine)) + 1
    value = terms.extend(x.value(state, a), wide, sign)
    digits = width(machine) // 4
    wrong = terms.less(value, terms.constant(wide, 0), True)
    if 10**digits < 1 << (wide - 1):
        wrong = terms.or_(wrong, terms.less(terms.constant(wide, 10**digits), value, True, True))
    x.trap(state, wrong, "R0105", site)
    made, ten = terms.constant(4, 0), terms.constant(wide, 10)
    for digit in range(digits):
        nibble = terms.extract(terms.divide("urem", value, ten), 0, 4)
        made = terms.concat(nibble, made) if digit else nibble
        value = terms.divide("udiv", value, ten)
    return made


def _operation(name: str) -> Row:
    """An operation on texts or REALs, its operands in the order of its row."""

    def row(x: Execution, state: State, machine: str, *operands: Any) -> Term:
        at = [number for number, operand in enumerate(operands) if isinstance(operand, tuple)]
        nodes = [operands[number] for number in at]
        return folded(x, state, name, machine, nodes, operands[at[-1] + 1 :], operands[: at[0]])

    return row


EXPRESSION_ROWS: dict[str, Row] = {
    "const": lambda x, state, machine, value: constant_term(x, machine, value),
    "tmp": lambda x, state, machine, number: state.temporaries[number],
    "load": _load, "load_raw": _load, "load_bit": _load_bit, "load_flag": _load_flag, "load_text": _load_text,
    "add": _sum("add"), "sub": _sum("sub"), "mul": _sum("mul"), "div": _divided("div"), "mod": _divided("mod"),
    "neg": _neg, "abs": _abs,
    **{name: _bitwise(name) for name in ("and", "or", "xor")}, "not": _not,
    "and_then": _lazy("and_then"), "or_else": _lazy("or_else"),
    **{name: _shifted(name) for name in ("shl", "shr", "rol", "ror")},
    **{name: _compared(name) for name in ("eq", "ne", "lt", "le", "gt", "ge")},
    "convert": _convert, "nearest": _to_integer("nearest"), "truncate": _to_integer("truncate"), "bits": _bits,
    "is_set": _is_set, "select": _select, "mux": _mux, "min": _extreme("min"), "max": _extreme("max"),
    "check": _check, "within": _within, "floor_div": _floor_div, "now": lambda x, state, machine: x.now,
    "from_bcd": _from_bcd, "to_bcd": _to_bcd,
    "enum_text": lambda x, state, machine, names, a: folded(x, state, "enum_text", machine, [a], before=(names,)),
    "reference": _reference, "bit_behind": _bit_behind,
    **{name: _operation(name) for name in (
        "pow", "math", "atan2", "length", "left", "right", "mid", "concat", "insert", "delete", "replace", "find", "to_text",
        "from_text", "from_leading", "character", "first", "recode", "characters", "units_of")},
}  # fmt: skip
"""How each operation becomes a term: called with the operands of its row."""
