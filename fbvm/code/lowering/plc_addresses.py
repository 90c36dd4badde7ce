"""PLC memory addresses, which index registers hold: what lies at one, and which one a variable has.

Each area is a range of them (`base.areas`); flags and bits are counted one by one, 16 to a word."""

from __future__ import annotations

from fbvm.base.areas import E_NAMES, E_PLC_ADDRESS, E_WORDS, PLC_ADDRESSES
from fbvm.base.memory import WHOLE_BYTES
from fbvm.base.types import BOOL, Type
from fbvm.code.builder.places import Place
from fbvm.code.lowering.context import BodyContext
from fbvm.code.operations import BIT_MASK, OFFSET_MASK, OFFSET_SHIFT, Node
from fbvm.syntax import tree
from fbvm.syntax.tree import ladder

NOWHERE = (1 << 32) - 1
"""An offset at which nothing lies."""
_H_WORDS = 512


def _ranges(body: BodyContext) -> list[tuple[int, int, int]]:
    """First PLC memory address, number of words and offset in the buffer of each area."""
    first = {**PLC_ADDRESSES, **{name: E_PLC_ADDRESS + E_WORDS * bank for bank, name in enumerate(E_NAMES)}}
    areas = body.program.areas
    rows = []
    for name in first.keys() & areas.keys():
        words = areas[name].size_bytes // 2
        rows.append((first[name], min(words, _H_WORDS) if name == "H" else words, areas[name].offset))
    return sorted(rows)


def _number(value: int) -> Node:
    return ("const", "i64", value)


def _in_range(node: Node, rows: list[tuple[int, int, Node]], otherwise: int) -> Node:
    """The expression of the row (first, count, expression) in whose range a number lies, else `otherwise`."""
    result = _number(otherwise)
    for first, count, then in rows:
        within = ("and", "b", ("ge", "b", "i64", node, _number(first)), ("lt", "b", "i64", node, _number(first + count)))
        result = ("select", "i64", within, result, then)
    return result


def words_from(body: BodyContext, address: Node) -> Node:
    """How many words there are from an address (u32) on up to the end of its area, as u32; 0 if nothing lies there."""
    at = body.to_temporary(("convert", "i64", "u32", address))
    rows = [(first, count, ("sub", "i64", _number(first + count), at)) for first, count, _ in _ranges(body)]
    return ("convert", "u32", "i64", _in_range(at, rows, 0))


def address_of(body: BodyContext, expr: tree.Expr) -> Node:
    """The address of a variable, as u32; 0 where index registers cannot point."""
    reference = body.to_temporary(("bits", "u64", "ref", body.place(expr).reference()))
    moved = ("shr", "u64", reference, _number(OFFSET_SHIFT), body.site(expr))
    offset = body.to_temporary(("convert", "i64", "u64", ("and", "u64", moved, ("const", "u64", OFFSET_MASK))))
    rows = [(start, 2 * count, ("add", "i64", offset, _number(2 * first - start))) for first, count, start in _ranges(body)]
    doubled = body.to_temporary(_in_range(offset, rows, 0))
    bit = body.to_temporary(("convert", "i64", "u64", ("and", "u64", reference, ("const", "u64", BIT_MASK))))
    counted = ("add", "i64", ("mul", "i64", doubled, _number(8)), bit)
    found = ("select", "i64", ("eq", "b", "i64", bit, _number(WHOLE_BYTES)), counted,
             ("floor_div", "i64", doubled, _number(2)))
    return ("convert", "u32", "i64", ("select", "i64", ("eq", "b", "i64", doubled, _number(0)), found, _number(0)))


def place_at(body: BodyContext, expr: ladder.Memory, kind: Type) -> Place:
    """The place at an address; where nothing lies it traps R0102."""
    site = body.site(expr)
    address = body.to_temporary(("convert", "i64", "u32", body.value(expr.address)))
    word = body.to_temporary(("floor_div", "i64", address, _number(16))) if kind == BOOL else address
    rows = [(first, count, ("add", "i64", ("mul", "i64", word, _number(2)), _number(start - 2 * first)))
            for first, count, start in _ranges(body)]
    offset = ("check", "i64", _in_range(word, rows, NOWHERE), 0, NOWHERE - 1, "R0102", site)
    whole = Place(("abs", 0, ((1, offset),)), kind)
    if kind != BOOL:
        return whole
    number = ("sub", "i64", address, ("mul", "i64", word, _number(16)))
    bit = ("bit_behind", "ref", whole.reference(), number)
    return Place((("ref", bit, site), 0, ()), BOOL)


def bound(body: BodyContext, expr: ladder.Memory | ladder.Words, upper: bool) -> Node:
    """The first or the last subscript of the words from an address or a variable on, as i64."""
    if not upper:
        return _number(0)
    if isinstance(expr, ladder.Words):
        return _number(_words_from_variable(body, expr.of) - 1)
    left = ("convert", "i64", "u32", words_from(body, body.value(expr.address)))
    return ("sub", "i64", left, _number(1))


def _words_from_variable(body: BodyContext, expr: tree.Expr) -> int:
    """How many words there are from a variable on, or from a part of one whose subscripts are constants."""
    root = body.facts.root(expr)
    place, whole = body.place(expr), body.place(root)
    start, offset, terms = place.address
    end = whole.address[1] + whole.type.size
    if start == "abs":
        ends = (area.offset + area.size_bytes for area in body.program.areas.values()
                if area.unit_bits == 16 and area.offset <= whole.address[1] < area.offset + area.size_bytes)
        end = next(ends, end)
    return (place.type.size if terms else end - offset) // 2
