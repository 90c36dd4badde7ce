"""Which bodies take the place of their calls: by their statements, those of what they call, and the room that there is."""

from __future__ import annotations

import pytest
from hand_image import at, const, image, own, store
from rows import each_of

from fbvm.code.operations import Block, Node
from fbvm.code.shapes import statements
from fbvm.engine import inlining
from fbvm.engine.inlining import Inlining

CALL, INNER_CALL = ("call", 1, own(0)), ("call", 2, own(8))


def stores(count: int) -> Block:
    return tuple(store("u8", number, const("u8", 1)) for number in range(count))


def inlined(*codes: Block, called: frozenset[int] = frozenset()) -> list[int]:
    """The numbers of the bodies of a program that take the place of calls at fixed addresses."""
    found = Inlining(image(*codes), called)
    return [number for number in range(len(codes)) if found.of(("call", number, own(0))) is not None]


@each_of(("codes", "wanted"), (
    (((CALL,), stores(40)), [1]), (((CALL,), stores(41)), []), ((stores(1), stores(1)), []),
    (((CALL,), (*stores(40), ("observe", "statement", 3, None))), [1]), (((CALL,), (*stores(1), ("return",))), []),
    (((CALL,), (*stores(1), INNER_CALL), stores(38)), [1, 2]), (((CALL,), (*stores(1), INNER_CALL), stores(39)), [2]),
    (((CALL,), (INNER_CALL,), stores(40)), [2]), (((CALL,), (INNER_CALL,), stores(41)), [1])))  # fmt: skip
def test_a_body_of_up_to_40_statements_with_those_of_what_it_calls_is_inlined(codes: tuple[Block, ...],
                                                                             wanted: list[int]) -> None:
    assert inlined(*codes) == wanted


def test_a_body_that_has_to_be_called_is_not_and_nothing_is_at_an_address_that_may_change() -> None:
    assert inlined((CALL,), stores(2), called=frozenset((1,))) == []
    index = ("convert", "i64", "u8", ("load", "u8", at(0)))
    found = Inlining(image((CALL, ("call", 1, own(0, (1, index)))), stores(2)), ())
    assert found.of(("call", 1, own(0, (1, index)))) is None and found.of(CALL) == stores(2)


@pytest.mark.parametrize(("calls", "wanted"), [(2, [1]), (3, [])])
def test_as_long_as_there_is_room_for_the_statements_of_all_its_calls(monkeypatch: pytest.MonkeyPatch, calls: int,
                                                                      wanted: list[int]) -> None:
    monkeypatch.setattr(inlining, "LEAST_GROWTH", 10)
    assert inlined((CALL,) * calls, stores(5)) == wanted


def test_the_smallest_bodies_are_first_where_there_is_no_room_for_all(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inlining, "LEAST_GROWTH", 9)
    assert inlined((CALL, INNER_CALL), stores(6), stores(4)) == [2]


def test_temporaries_of_each_call_have_numbers_that_nothing_else_has() -> None:
    def let(number: int) -> Node:
        return "let", number, "u8", const("u8", 1)

    code = Inlining(image((let(0), CALL, CALL), (let(0), let(1))), ()).code(0)
    numbers = [node[1] for node in statements(code) if node[0] == "let"]
    assert numbers[0] == 0 and len(set(numbers)) == len(numbers) == 5
