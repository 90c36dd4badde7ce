"""Where statements and calls store: bytes of the memory, of an instance, or anywhere."""

from __future__ import annotations

from typing import Any

from hand_image import at, behind, const, image, own, store
from rows import each_of

from fbvm.base.areas import SLOTS_OFFSET
from fbvm.code.operations import Block, Node
from fbvm.engine import effects
from fbvm.engine.effects import Effects, Span

INDEX = ("convert", "i64", "u8", ("load", "u8", at(0)))


def stored(node: Node, *codes: Block) -> Any:
    """Where a statement stores, in a program whose other bodies have these codes, as offsets among the slots."""
    found = Effects(image((), *codes), {}, ()).of(node)
    return None if found is None else [(each.base, each.first - SLOTS_OFFSET * (each.base == "abs"),
                                        each.end - SLOTS_OFFSET * (each.base == "abs")) for each in found]


@each_of(("node", "wanted"), (
    (store("i16", 2, const("i16", 1)), ("abs", 2, 4)), (("store_raw", "u32", at(3), const("u32", 1)), ("abs", 3, 7)),
    (("store_bit", at(5), 1, const("b", 1)), ("abs", 5, 6)), (("store_flag", at(5), const("b", 1)), ("abs", 5, 6)),
    (("store_text", at(8), 5, const("s8", b"a")), ("abs", 8, 14)),
    (("store_text", at(8), 5, const("s16", "a")), ("abs", 8, 20)), (("copy", at(0), at(16), 4), ("abs", 0, 4)),
    (("fill", own(8), b"abc"), ("self", 8, 11)), (("reverse", own(0), 2, ((0, 1, 2, 2),)), ("self", 0, 2)),
    (("store", "u16", at(10, (2, INDEX)), const("u16", 1)), ("abs", 10, 522)),
    (("store", "u16", at(600, (-2, INDEX)), const("u16", 1)), ("abs", 90, 602))))  # fmt: skip
def test_a_statement_stores_at_so_many_bytes(node: Node, wanted: tuple[str, int, int]) -> None:
    assert stored(node) == [wanted]


def test_what_stores_nothing_and_what_stores_behind_a_reference() -> None:
    assert stored(("let", 1, "i16", const("i16", 1))) == []
    assert stored(("store_raw", "u8", behind(("reference", "ref", at(0), 255)), const("u8", 1))) is None


def test_a_call_stores_where_its_body_does_and_in_its_instance_only_if_the_body_does() -> None:
    slots, inner = (store("u8", 3, const("u8", 1)),), (("store", "u8", own(1), const("u8", 1)),)
    assert stored(("call", 1, own(16)), slots) == [("abs", 3, 4)]
    assert stored(("call", 1, own(16)), inner) == [("self", 16, 80)]
    assert stored(("call", 1, at(128)), inner + slots) == [("abs", 3, 4), ("abs", 128, 192)]
    assert stored(("call", 1, None), slots) == [("abs", 3, 4)]


def test_an_instance_without_an_address_begins_at_byte_0() -> None:
    inner = (("store", "u8", own(1), const("u8", 1)),)
    assert Effects(image((), inner), {}, ()).of(("call", 1, None)) == (Span("abs", 0, 64),)


def test_a_call_of_what_stores_anywhere_or_of_an_instance_behind_a_reference_stores_anywhere() -> None:
    reference = ("reference", "ref", at(0), 255)
    away = (("store_raw", "u8", behind(reference), const("u8", 1)),)
    inner = (("store", "u8", own(1), const("u8", 1)),)
    assert stored(("call", 1, own(0)), (("call", 2, None),), away) is None
    assert stored(("call", 1, behind(reference)), inner) is None


def test_a_body_with_more_places_than_are_told_apart_stores_between_the_first_and_the_last(monkeypatch: Any) -> None:
    monkeypatch.setattr(effects, "MOST_SPANS", 3)
    places = tuple(store("u8", offset, const("u8", 1)) for offset in (9, 2, 30))
    inner = (("store", "u8", own(1), const("u8", 1)),)
    call = ("call", 1, at(128))
    assert stored(call, places) == [("abs", 2, 3), ("abs", 9, 10), ("abs", 30, 31)]
    assert stored(call, places + inner) == [("abs", 2, 31), ("abs", 128, 192)]


def test_a_chain_of_calls_may_be_longer_than_the_stack() -> None:
    chain = [(("call", number + 2, None),) for number in range(2000)]
    assert stored(("call", 1, None), *chain, (store("u8", 3, const("u8", 1)),)) == [("abs", 3, 4)]
