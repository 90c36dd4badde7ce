"""Code of seldom kinds as the encoder follows it: paths of which none goes on, places that are chosen, texts and bits of which
the values are told afterwards, and what it refuses."""

from __future__ import annotations

import pytest
from hand_image import at, behind, const, image, load, power_on, store
from rows import each_of
from statement_rows import reference, when
from symbolic import encoded_program
from test_encoded_rows import compare, result

from fbvm.base.areas import SLOTS_OFFSET
from fbvm.base.types import BOOL, WORD, Field, array
from fbvm.code.operations import Block, Node
from fbvm.prove.encoding.addresses import cases
from fbvm.prove.encoding.cells import Contents, Partition
from fbvm.prove.encoding.execution import Refused, State
from fbvm.prove.encoding.scan import Scanned
from fbvm.prove.encoding.summary import _extent
from fbvm.prove.encoding.terms import Terms

B0: Node = ("load", "b", at(0))
SET_9: Node = store("u8", 9, const("u8", 7))


def scanned(code: Block, *inputs: int, budget: int = 1000) -> Scanned:
    """The scan with the slots of these bytes unknown."""
    memory = bytes(power_on(image(code), {}, budget).u8)
    return encoded_program(image(code), memory, budget, {SLOTS_OFFSET + offset for offset in inputs})[0]


def either(then: Block, otherwise: Block) -> Node:
    return "if", ((B0, then),), otherwise


@pytest.mark.slow
@each_of(("code", "before"), [
    ((either((SET_9, ("return",)), (store("u8", 9, const("u8", 8)), ("return",))), store("u8", 10, const("u8", 1))), {0: b"\1"}),
    ((either((SET_9, ("return",)), (store("u8", 9, const("u8", 8)),)), store("u8", 10, const("u8", 1))), {0: b"\1"}),
    ((either((SET_9, ("return",)), (store("u8", 9, const("u8", 8)),)), store("u8", 10, const("u8", 1))), {0: b"\0"}),
    ((("store_bit", at(100), 3, B0), ("fill", at(100), b"\x55\xaa")), {0: b"\1"}),
    ((("store_bit", at(100), 3, B0), ("fill", at(99), b"\x55\x5a")), {0: b"\1"}),
    ((store("b", 100, B0), store("b", 101, B0), ("fill", at(100), b"\0\1")), {0: b"\1"}),
    ((store("b", 100, B0), ("fill", at(99), b"\5\1\6")), {0: b"\0"}),
    ((store("u32", 100, load("u32", 0)), ("fill", at(98), b"\1\2\3")), {0: b"\x11\x22\x33\x44"}),
    ((store("u32", 100, load("u32", 0)), ("fill", at(102), b"\1\2\3\4")), {0: b"\x11\x22\x33\x44"}),
    ((store("u32", 100, load("u32", 0)), ("fill", at(100), b"\1\2\3\4\5")), {0: b"\x11\x22\x33\x44"}),
    (result("u16", ("bits", "u16", "i16", load("i16", 0))), {0: b"\1\x80"}),
    (result("u16", ("convert", "u16", "b", B0)), {0: b"\1"}), (result("i64", ("convert", "i64", "b", B0)), {0: b"\0"}),
])  # fmt: skip
def test_what_is_told_afterwards_leaves_what_the_engine_leaves(code: Block, before: dict[int, bytes]) -> None:
    compare(code, before, budget=1000, unknown=True)
    compare(code, before, budget=1000)


def test_a_charge_above_the_budget_on_one_path_is_a_loop_that_was_not_followed_to_its_end() -> None:
    some = scanned((when(B0, ("charge", 999, 4), ("charge", 2, 5)),), 0)
    assert [(trap.code, trap.site) for trap in some.execution.traps] == [("unwound", 5)]
    all_of_them = scanned((("charge", 1000, 4), ("charge", 1, 6), ("charge", 1, 7)))
    assert [(trap.code, trap.site) for trap in all_of_them.execution.traps] == [("R0104", 6)]


def test_a_text_that_is_not_known_fills_its_whole_variable_and_no_more() -> None:
    for machine, unit in (("s8", 1), ("s16", 2)):
        text: Node = ("load_text", machine, at(0), 3)
        found = scanned((("store_text", at(100), 3, text), store("u8", 99, const("u8", 3))), *range(8))
        contents, first = found.contents, SLOTS_OFFSET + 100
        units = [contents.number(first + unit * number, unit) for number in range(4)]
        assert [(term.op, term.width) for term in units] == [("unknown", 8 * unit)] * 4 and len(set(units)) == 4
        assert contents.number(first + unit * 4, 1).value == 0 and contents.number(first - 1, 1).value == 3
        assert [*found.execution.unknowns] == [f"text of {'STRING' if unit == 1 else 'WSTRING'}"]


def chosen(offset: int, size: int) -> Node:
    """A place that an unknown byte chooses among a hundred."""
    return at(100, (size, ("check", "i32", ("convert", "i32", "u8", load("u8", offset)), 0, 99, "R0102", 3)))


@each_of(("code", "said"), [
    ((("copy", chosen(0, 8), chosen(1, 8), 8),), "a copy chooses from too many places"),
    ((store("ref", 16, ("bit_behind", "ref", reference(2), load("i64", 0))),),
     "a reference to a bit has no bounds that could be followed"),
    ((store("u8", 16, ("load", "u8", at(100, (1, load("i32", 0))))),), "an index has no bounds that could be followed"),
    ((store("u8", 16, ("load", "u8", behind(load("ref", 0)))),), "a pointer may point to too many places"),
])  # fmt: skip
def test_what_chooses_from_too_many_places_is_refused(code: Block, said: str) -> None:
    with pytest.raises(Refused) as refused:
        scanned((("observe", "statement", 5, None), *code), *range(8))
    assert (refused.value.reason, refused.value.site) == (said, 5)


def test_a_copy_that_chooses_from_few_places_is_followed() -> None:
    index: Node = ("check", "i32", ("convert", "i32", "u8", load("u8", 0)), 0, 2, "R0102", 3)
    other: Node = ("check", "i32", ("convert", "i32", "u8", load("u8", 1)), 0, 1, "R0102", 3)
    code = (("copy", at(100, (2, index)), at(10, (3, other)), 2),)
    for row in (b"\0\0", b"\2\1", b"\1\0", b"\3\0"):
        compare(code, {0: row, 10: b"abcdefgh"}, budget=1000, unknown=True)


@each_of(("width", "known", "most", "values"), [
    (8, (2, 4), 3, [2, 3, 4]), (8, (2, 4), 2, None), (8, (-1, 1), 3, [255, 0, 1]), (8, (5, 5), 1, [5]), (1, None, 2, [1, 0]),
    (8, None, 256, [number % 256 for number in range(-128, 128)]), (8, None, 255, None),
])  # fmt: skip
def test_the_values_of_a_term_are_told_up_to_so_many(width: int, known: tuple[int, int] | None, most: int,
                                                     values: list[int] | None) -> None:  # fmt: skip
    terms = Terms()
    term = terms.variable("x", width)
    contents = Contents(terms, Partition(), lambda cell: terms.true)
    found = cases(terms, State(contents, terms.true, known={term: known} if known else {}), term, most)
    assert (found and [value for _, value in found]) == values


def test_what_no_path_reads_is_nothing_that_is_known() -> None:
    found = scanned((when(B0, store("u8", 16, ("load", "u8", behind(const("ref", 0))))),), 0)
    assert [(trap.code, trap.site) for trap in found.execution.traps] == [("R0110", 9)]
    assert found.contents.number(SLOTS_OFFSET + 16, 1).op == "ite"


@each_of(("code", "traps"), [
    (store("i32", 16, ("nearest", "i32", "f32", load("f32", 0), 7)), [("R0105", 7)]),
    (store("f32", 16, ("add", "f32", load("f32", 0), load("f32", 4))), []),
    (("store_text", at(16), 3, ("left", "s8", ("load_text", "s8", at(0), 3), load("i64", 8), 6)), [("R0108", 6)]),
])  # fmt: skip
def test_an_operation_of_which_nothing_is_known_may_trap_as_it_does(code: Node, traps: list[tuple[str, int]]) -> None:
    found = scanned((code,), *range(16)).execution.traps
    assert [(trap.code, trap.site) for trap in found] == traps
    assert all(trap.condition.op == "unknown" and trap.condition.width == 0 for trap in found)


@each_of(("member", "places"), [
    (Field("a", WORD, 3), [(13, 2, None)]), (Field("a", WORD, 3, absolute=True), [(3, 2, None)]),
    (Field("a", BOOL, 3, bit=6), [(13, 1, 6)]),
    (Field("a", array(((0, 4),), BOOL), 3, bit=6), [(13, 1, 6), (13, 1, 7), (14, 1, 0), (14, 1, 1), (14, 1, 2)]),
])  # fmt: skip
def test_where_an_input_lies(member: Field, places: list[tuple[int, int, int | None]]) -> None:
    assert _extent(member, 10) == places
