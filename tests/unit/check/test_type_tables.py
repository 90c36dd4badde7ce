"""Which type is taken where, as tables: implicit conversions of each dialect, conversion functions, hints, constants.

`FBVM_REWRITE=1 pytest` of this file writes `type_tables.txt` anew, a line for each type: read the difference.  What the standard
converts is figure 11 of IEC 61131-3 ed. 3, and its functions tables 22 to 27."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from rows import each_of

from fbvm.base import types as t
from fbvm.base.dialects import DIALECTS
from fbvm.check.calls.generics import _joined
from fbvm.check.expressions import assignability as a
from fbvm.check.expressions import constants
from fbvm.check.expressions.constants import NotConstant
from fbvm.check.symbols.facts import UNTYPED_INT, UNTYPED_REAL
from fbvm.syntax import tree

KEPT = Path(__file__).with_name("type_tables.txt")
COLOUR = t.EnumType("Colour", 2, 2, t.INT, {"RED": 0, "GREEN": 1}, {0: "Red", 1: "Green"})
SMALL = t.SubrangeType("Small", 2, 2, t.INT, 2, 9)
BLOCK = t.StructType("Block", 16, 8, {"Q": t.Field("Q", t.BOOL, 8, "VAR_OUTPUT")}, block=True)
PLAIN = t.StructType("Plain", 4, 2, {"A": t.Field("a", t.INT, 0)})
REF, POINTER = t.RefType("REF_TO INT", 8, 8, t.INT), t.RefType("POINTER TO INT", 8, 8, t.INT, moves=True)
TEXT, WIDE = t.string(5), t.string(5, True)
ROW, OTHER_ROW, LONGER = (t.array((bounds,), t.INT) for bounds in ((0, 2), (1, 3), (0, 3)))
OPEN, OPEN_PLANE, PLANE = t.open_array(1, t.INT), t.open_array(2, t.INT), t.array(((0, 1), (0, 1)), t.INT)
ANY, NUMBER = t.AnyType("ANY", 24, 8), t.AnyType("ANY_NUM", 24, 8)
OTHERS = TEXT, WIDE, COLOUR, SMALL, REF, POINTER, ROW, OTHER_ROW, LONGER, PLANE, PLAIN, BLOCK, OPEN, OPEN_PLANE, ANY, NUMBER
VALUES = t.Elementary | t.StringType | t.EnumType
NAMED = {kind.name: kind for kind in (*dict.fromkeys(t.ELEMENTARY.values()), *OTHERS)}

# --- one text ---------------------------------------------------------------------------------------------------------


def rows(title: str, takes: Callable[[t.Type, t.Type], bool]) -> Iterator[str]:
    """A line for each type with the others for which something holds."""
    yield f"# {title}"
    for name, kind in NAMED.items():
        if found := [other for other, target in NAMED.items() if other != name and takes(kind, target)]:
            yield f"{name}: {', '.join(found)}"
    yield ""


def text() -> str:
    lines = [*rows("assigned without a conversion", a.assignable)]
    for name, dialect in DIALECTS.items():
        found = [*rows(f"and under {name}", lambda kind, target, by=dialect: not a.assignable(kind, target)  # type: ignore[misc]
                       and a.converted_by_dialect(kind, target, by))]  # fmt: skip
        lines += found if len(found) > 2 else []
        numbers = [f"{kind}: {number}" for kind in NAMED.values() if (number := a.as_number(kind, dialect)) != kind]
        lines += [f"# computed with as numbers under {name}", *numbers, ""] if numbers else []
    lines += rows("passed to an in-out of another type", a.same)
    lines += rows("X_TO_Y that there is not", lambda kind, target: isinstance(kind, VALUES) and isinstance(target, VALUES)
                  and not a.convertible("TO", kind, target))  # fmt: skip
    for form in ("TRUNC", "BCD_TO", "TO_BCD"):
        lines += rows(form, lambda kind, target, by=form: a.convertible(by, kind, target))  # type: ignore[misc]
    lines += ["# what to write where another type is needed"]
    for kind in (t.INT, t.REAL, t.BOOL, t.WORD, t.TIME, t.DATE, TEXT, COLOUR, REF, POINTER, ROW, PLAIN, BLOCK):
        for target in (t.INT, t.BOOL, t.WORD, t.TIME, TEXT, COLOUR, REF, POINTER, BLOCK):
            if hint := a.conversion_hint(kind, target):
                lines.append(f"{kind} for {target}: {hint}")
    return "\n".join(lines) + "\n"


@pytest.mark.slow
def test_types_are_taken_as_they_are_listed() -> None:
    made = text()
    if os.environ.get("FBVM_REWRITE"):
        KEPT.write_text(made, encoding="utf-8")
    assert made == KEPT.read_text(encoding="utf-8")


def test_what_brings_its_bounds_or_its_type_is_no_value() -> None:
    assert not any(a.assignable(kind, target) for kind in (OPEN, ANY) for target in NAMED.values())
    assert not any(a.assignable(kind, target) for kind in NAMED.values() for target in (OPEN, ANY))


# --- arguments that meet ------------------------------------------------------------------------------------------------


@each_of("met, kind, exact, joined", [
    (None, t.INT, False, t.INT), (None, SMALL, False, t.INT), (None, SMALL, True, SMALL), (SMALL, SMALL, True, SMALL),
    (t.INT, SMALL, True, SMALL), (UNTYPED_INT, SMALL, True, SMALL), (t.DINT, SMALL, True, None),
    (UNTYPED_REAL, SMALL, True, None),
    (SMALL, t.INT, True, SMALL), (SMALL, t.INT, False, SMALL), (SMALL, t.DINT, False, t.DINT), (t.INT, t.INT, True, t.INT),
    (t.INT, t.DINT, False, t.DINT), (t.DINT, t.INT, False, t.DINT), (t.INT, t.DINT, True, None), (t.INT, t.UINT, False, t.DINT),
    (t.INT, UNTYPED_INT, False, t.INT), (t.REAL, UNTYPED_INT, False, t.REAL), (t.REAL, UNTYPED_REAL, False, t.REAL),
    (t.INT, UNTYPED_REAL, False, UNTYPED_REAL), (UNTYPED_INT, UNTYPED_REAL, False, UNTYPED_REAL),
    (UNTYPED_REAL, UNTYPED_INT, False, UNTYPED_REAL), (UNTYPED_REAL, t.REAL, False, t.REAL),
    (UNTYPED_REAL, t.INT, False, UNTYPED_REAL),
    (UNTYPED_INT, t.WORD, False, t.WORD), (UNTYPED_INT, t.INT, True, t.INT), (t.BOOL, t.INT, False, None), (ROW, ROW, True, ROW),
    (ROW, OTHER_ROW, True, None), (None, t.string(3), True, t.string(3)), (None, t.string(3), False, t.string(255)),
    (None, t.string(300), False, t.string(300)), (None, t.string(3, True), False, t.string(255, True)),
    (t.string(80), t.string(3), True, None), (t.TIME, t.LTIME, False, t.LTIME),
])
def test_arguments_of_a_generic_function_meet_in_one_type(met: t.Type | None, kind: t.Type, exact: bool,
                                                          joined: t.Type | None) -> None:
    assert _joined(met, kind, exact) == joined, _joined(met, kind, exact)


# --- hints --------------------------------------------------------------------------------------------------------------


@each_of("value, kind, hint", [
    (5, t.BOOL, "write TRUE or FALSE, or a comparison"), (5, TEXT, "a text is written 'text'"),
    (5, WIDE, 'a WSTRING is written "text"'),
    (5, t.ELEMENTARY["CHAR"], "a CHAR is one character, written 'A'"),
    (5, t.ELEMENTARY["WCHAR"], 'a WCHAR is one character, written "A"'),
    (5, REF, "a reference is made of a variable, or NULL"), (1, COLOUR, "name a member, such as Colour#Green"),
    (5, COLOUR, "name a member, such as Colour#Red"), ("green", COLOUR, "name a member, such as Colour#Green"),
    ("blue", COLOUR, "name a member, such as Colour#Red"), (20, t.TIME, "a duration is written T#20ms"),
    (0, t.TIME, "a duration is written T#500ms"), (-3, t.LTIME, "a duration is written T#500ms"),
    (True, t.TIME, "a duration is written T#500ms"), (1.5, t.TIME, "a duration is written T#500ms"),
    (1, t.DATE, "a literal is written D#2024-12-31"), (1, t.ELEMENTARY["LDATE"], "a literal is written D#2024-12-31"),
    (1, t.TOD, "a literal is written TOD#23:59:59"), (1, t.DT, "a literal is written DT#2024-12-31-23:59:59"),
    (1.5, t.INT, "write a number without a point"), ("x", t.INT, "write a number"), (1.5, t.REAL, "write a number"),
    ("x", t.WORD, "write a number"), (1.5, t.WORD, "write a number"), (5, PLAIN, ""), (None, t.INT, "write a number"),
])
def test_how_a_literal_is_written(value: Any, kind: t.Type, hint: str) -> None:
    assert a.literal_hint(value, kind) == hint


@each_of("kind, hint", [
    (t.INT, "compare it, for example with <> 0"), (t.WORD, "compare it, for example with <> 0"),
    (t.REAL, "compare it, for example with <> 0"), (TEXT, "compare it, for example with = 'text'"), (t.TIME, "compare it"),
    (COLOUR, "compare it"), (PLAIN, ""),
])
def test_what_to_write_where_a_bool_is_needed(kind: t.Type, hint: str) -> None:
    assert a.comparison_hint(kind) == hint


def call(name: str) -> tree.Expr:
    return tree.Call(0, 9, tree.NameRef(0, len(name), name), ())


@each_of("expr, target, hint", [
    (call("BCD_TO_INT"), t.DINT, "write BCD_TO_DINT(...)"), (call("bcd_to_uint"), SMALL, "write BCD_TO_INT(...)"),
    (call("BCD_TO_INT"), t.REAL, ""), (call("INT_TO_BCD"), t.DINT, ""), (tree.NameRef(0, 3, "BCD_TO_INT"), t.DINT, ""),
])
def test_a_number_of_bcd_digits_is_made_of_the_type_that_is_needed(expr: tree.Expr, target: t.Type, hint: str) -> None:
    assert a.bcd_hint(expr, target) == hint


@each_of("target, kind, held", [
    (t.INT, SMALL, True), (t.SINT, SMALL, True), (t.USINT, SMALL, True), (t.INT, t.INT, False), (t.REAL, SMALL, False),
    (t.SINT, t.SubrangeType("Wide", 2, 2, t.INT, 0, 127), True), (t.SINT, t.SubrangeType("Wide", 2, 2, t.INT, 0, 128), False),
    (t.USINT, t.SubrangeType("Below", 2, 2, t.INT, -1, 9), False), (t.SINT, t.SubrangeType("Low", 2, 2, t.INT, -128, 0), True),
    (SMALL, SMALL, True),
])
def test_an_integer_type_holds_a_subrange(target: t.Type, kind: t.Type, held: bool) -> None:
    assert a.holds(target, kind) is held


# --- constants ----------------------------------------------------------------------------------------------------------


@each_of("op, kind, left, right, value", [
    ("+", t.INT, 32767, 1, -32768), ("+", UNTYPED_INT, 1 << 70, 1, (1 << 70) + 1), ("-", t.USINT, 0, 1, 255),
    ("*", t.DINT, -3, 4, -12),
    ("/", t.INT, -7, 2, -3), ("MOD", t.INT, -7, 4, -3), ("/", t.INT, 7, 0, "it divides by zero"),
    ("MOD", t.INT, 7, 0, "it divides by zero"),
    ("AND", t.WORD, 12, 10, 8), ("OR", t.WORD, 12, 10, 14), ("XOR", t.WORD, 12, 10, 6), ("AND", t.BOOL, True, False, False),
    ("OR", t.BOOL, True, False, True), ("XOR", t.BOOL, True, True, False), ("AND_THEN", t.BOOL, True, True, True),
    ("OR_ELSE", t.BOOL, False, False, False), ("=", t.INT, 3, 3, True), ("<>", t.INT, 3, 3, False), ("<", t.INT, 3, 3, False),
    ("<=", t.INT, 3, 3, True), (">", t.INT, 4, 3, True), (">=", t.INT, 2, 3, False), ("<", TEXT, b"a", b"b", True),
    ("+", t.LREAL, 0.5, 0.25, 0.75), ("-", t.LREAL, 0.5, 0.25, 0.25), ("*", t.LREAL, 0.5, 0.25, 0.125),
    ("/", t.LREAL, 1.0, 0.0, math.inf),
    ("+", t.REAL, 0.1, 0.2, 0.30000001192092896), ("+", UNTYPED_REAL, 0.1, 0.2, 0.30000000000000004),
    ("**", t.LREAL, 2, 10, 1024.0),
    ("**", t.REAL, 0.1, 1, 0.10000000149011612), ("*", t.TIME, 10, 0.25, 2), ("*", t.TIME, 6, 0.25, 2),
    ("*", t.TIME, 14, 0.25, 4),
    ("/", t.TIME, 10, 4.0, 2), ("/", t.TIME, 10, 0.0, "it divides by zero"),
    ("*", t.TIME, 1 << 62, 4.0, "its value is too large"),
    ("+", t.TOD, 86_399_000_000_000, 2_000_000_000, 1_000_000_000), ("-", t.TOD, 0, 1, 86_399_999_999_999),
    ("+", t.TIME, 5, 7, 12),
])
def test_operators_over_constants(op: str, kind: t.Type, left: Any, right: Any, value: Any) -> None:
    if isinstance(value, str):
        with pytest.raises(NotConstant, match=f"^{value}$"):
            constants.binary(op, kind, left, right)
    else:
        found = constants.binary(op, kind, left, right)
        assert found == value and type(found) is type(value), found


@each_of("op, kind, operand, value", [
    ("-", t.INT, 5, -5), ("-", t.INT, -32768, -32768), ("-", t.USINT, 1, 255), ("-", UNTYPED_INT, 1 << 70, -(1 << 70)),
    ("+", t.INT, 5, 5),
    ("-", t.REAL, 1.5, -1.5), ("NOT", t.BOOL, True, False), ("NOT", t.WORD, 1, 65534), ("NOT", t.INT, 0, -1),
])
def test_signs_and_not_over_constants(op: str, kind: t.Type, operand: Any, value: Any) -> None:
    found = constants.unary(op, kind, operand)
    assert found == value and type(found) is type(value)


@each_of("value, kind, held", [
    (300, t.USINT, 44), (-1, t.UINT, 65535), (2.9, t.INT, 2), (-2.9, t.INT, -2), (1e9, t.INT, 32767), (-1e9, t.INT, -32768),
    (math.nan, t.INT, 0),
    (32767.0, t.INT, 32767), (True, t.INT, 1), (0.1, t.REAL, 0.10000000149011612), (5, t.LREAL, 5.0), (5, t.BOOL, True),
    (0, t.BOOL, False),
    (65, TEXT, b"A"), (0, TEXT, b""), (0x20AC, WIDE, "€"), (0, WIDE, ""), (b"ab", TEXT, b"ab"), (7.5, SMALL, 7), (1e9, SMALL, 9),
    (-1.0, SMALL, 2),
])
def test_a_constant_is_cut_to_a_type(value: Any, kind: t.Type, held: Any) -> None:
    found = constants.cut(value, kind)
    assert found == held and type(found) is type(held), found


@each_of("kind, value, data", [
    (t.BOOL, True, "01"), (t.INT, -2, "feff"), (t.UDINT, 0x01020304, "04030201"), (t.REAL, 0.1, "cdcccc3d"),
    (t.LREAL, 1.0, "000000000000f03f"),
    (TEXT, b"ab", "616200000000"), (TEXT, b"abcdefg", "616263646500"), (t.string(2, True), "a€", "6100ac200000"),
    (COLOUR, 1, "0100"), (SMALL, 5, "0500"),
])
def test_values_and_their_bytes(kind: t.Type, value: Any, data: str) -> None:
    assert constants.encode(kind, value).hex() == data
    assert constants.encode(kind, constants.decode(kind, bytes.fromhex(data))).hex() == data


@each_of("kind, data", [
    (t.INT, "0000"), (SMALL, "0200"), (COLOUR, "0000"), (t.EnumType("E", 1, 1, t.SINT, {"A": 7, "B": 0}, {7: "A", 0: "B"}), "07"),
    (t.array(((1, 3),), SMALL), "020002000200"), (TEXT, "00" * 6), (PLAIN, "00" * 4),
])
def test_what_a_variable_holds_without_an_initial_value(kind: t.Type, data: str) -> None:
    assert constants.default(kind).hex() == data


@each_of("kind, limits", [
    (t.INT, (-32768, 32767)), (SMALL, (2, 9)), (COLOUR, (-32768, 32767)), (t.REAL, None), (t.BOOL, (0, 1)), (TEXT, None),
    (PLAIN, None),
    (t.WORD, (0, 65535)),
])
def test_least_and_greatest_values(kind: t.Type, limits: tuple[int, int] | None) -> None:
    assert constants.limits(kind) == limits


@each_of("op, left, right, value", [("+", 5, 7, 12), ("-", 5, 7, -2), ("+", (1 << 63) - 1, 1, None), ("-", -(1 << 63), 1, None)])
def test_dates_stay_in_their_range(op: str, left: int, right: int, value: int | None) -> None:
    if value is None:
        with pytest.raises(NotConstant, match=r"for dates 1677-09-22 to 2262-04-11$"):
            constants.moment(op, left, right)
    else:
        assert constants.moment(op, left, right) == value
    moments = t.DATE, t.DT, t.ELEMENTARY["LDATE"]
    assert [constants.is_moment(kind) for kind in (*moments, t.TOD, t.TIME, COLOUR)] == [True] * 3 + [False] * 3
