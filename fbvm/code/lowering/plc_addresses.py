"""PLC memory addresses, which index registers hold: what lies there, and where variables lie for them.

Each area is a range of them (`base.areas`); flags and bits are counted one by one, 16 to a word.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fbvm.base.areas import E_NAMES, E_PLC_ADDRESS, E_WORDS, PLC_ADDRESSES
from fbvm.base.memory import WHOLE_BYTES
from fbvm.base.types import BOOL, Type
from fbvm.code.operations import BIT_MASK, OFFSET_MASK, OFFSET_SHIFT, Node
from fbvm.syntax import tree
from fbvm.syntax.tree import ladder

if TYPE_CHECKING:
    from fbvm.code.lowering.bodies import BodyLowering
    from fbvm.code.lowering.places import Place

LOST = (1 << 32) - 1
"""An offset at which nothing lies."""
_H_WORDS = 512


def _ranges(body: BodyLowering) -> list[tuple[int, int, int]]:
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


def _chosen(node: Node, rows: list[tuple[int, int, Node]], otherwise: int) -> Node:
    """The operation of the row in which a number lies: (first, count, operation)."""
    result = _number(otherwise)
    for first, count, then in rows:
        within = ("and", "b", ("ge", "b", "i64", node, _number(first)), ("lt", "b", "i64", node, _number(first + count)))
        result = ("select", "i64", within, result, then)
    return result


def words_from(body: BodyLowering, address: Node) -> Node:
    """How many words there are from an address (u32) on up to the end of its area, as u32; 0 if nothing lies there."""
    at = body.keep(("convert", "i64", "u32", address))
    rows = [(first, count, ("sub", "i64", _number(first + count), at)) for first, count, _ in _ranges(body)]
    return ("convert", "u32", "i64", _chosen(at, rows, 0))


def address_of(body: BodyLowering, expr: tree.Expr) -> Node:
    """The address of a variable, as u32; 0 where index registers cannot point."""
    where = body.keep(("bits", "u64", "ref", body.places.reference(body.places.of(expr))))
    moved = ("shr", "u64", where, _number(OFFSET_SHIFT), body.site(expr))
    at = body.keep(("convert", "i64", "u64", ("and", "u64", moved, ("const", "u64", OFFSET_MASK))))
    rows = [(start, 2 * count, ("add", "i64", at, _number(2 * first - start))) for first, count, start in _ranges(body)]
    place = body.keep(_chosen(at, rows, 0))
    bit = body.keep(("convert", "i64", "u64", ("and", "u64", where, ("const", "u64", BIT_MASK))))
    counted = ("add", "i64", ("mul", "i64", place, _number(8)), bit)
    found = ("select", "i64", ("eq", "b", "i64", bit, _number(WHOLE_BYTES)), counted,
             ("floor_div", "i64", place, _number(2)))
    return ("convert", "u32", "i64", ("select", "i64", ("eq", "b", "i64", place, _number(0)), found, _number(0)))


def place_at(body: BodyLowering, expr: ladder.Memory, kind: Type) -> Place:
    """The place at an address; where nothing lies it traps."""
    from fbvm.code.lowering.places import Place

    site = body.site(expr)
    address = body.keep(("convert", "i64", "u32", body.value(expr.address)))
    word = body.keep(("floor_div", "i64", address, _number(16))) if kind == BOOL else address
    rows = [(first, count, ("add", "i64", ("mul", "i64", word, _number(2)), _number(start - 2 * first)))
            for first, count, start in _ranges(body)]
    offset = ("check", "i64", _chosen(word, rows, LOST), 0, LOST - 1, "R0102", site)
    whole = Place(("abs", 0, ((1, offset),)), kind)
    if kind != BOOL:
        return whole
    number = ("sub", "i64", address, ("mul", "i64", word, _number(16)))
    bit = ("bit_behind", "ref", body.places.reference(whole), number)
    return Place((("ref", bit, site), 0, ()), BOOL)


def bound(body: BodyLowering, expr: ladder.Memory | ladder.Words, upper: bool) -> Node:
    """The first and the last subscript of the words from an address or a variable on, as i64."""
    if not upper:
        return _number(0)
    if isinstance(expr, ladder.Words):
        return _number(_words_behind(body, expr.of) - 1)
    left = ("convert", "i64", "u32", words_from(body, body.value(expr.address)))
    return ("sub", "i64", left, _number(1))


def _words_behind(body: BodyLowering, expr: tree.Expr) -> int:
    """How many words there are from a variable on, or from a part of one whose subscripts are constants."""
    root = body.facts.root(expr)
    place, whole = body.places.of(expr), body.places.of(root)
    start, offset, terms = place.address
    end = whole.address[1] + whole.type.size
    if start == "abs":
        ends = (area.offset + area.size_bytes for area in body.program.areas.values()
                if area.unit_bits == 16 and area.offset <= whole.address[1] < area.offset + area.size_bytes)
        end = next(ends, end)
    return (place.type.size if terms else end - offset) // 2
