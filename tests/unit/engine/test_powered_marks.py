"""Marks of the elements of rungs: how many a body has, which instance has which, and how states follow from them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from hand_image import at, const, image, load, own
from rows import each_of

from fbvm.base.areas import SLOTS_OFFSET
from fbvm.code.image import Image
from fbvm.code.operations import Block, Node
from fbvm.engine.native.emit.module import translate
from fbvm.engine.powered import BodyMarks, powered, state


def contact(element: int, value: Node) -> Node:
    return "observe", "contact", 3, (element, value)


def bit(number: int) -> Node:
    return "load_bit", "b", at(0), number


def readings(code: Block) -> list[Any]:
    """How the states of the elements of a body follow from its marks, in the order of the elements."""
    marks = powered(image(code)).bodies[0]
    return [marks.elements[3, element] for element in range(len(marks.elements))]


@each_of(("base", "row"), ((100, 7), (109, 7), (110, 9), (129, 11), (130, 7), (99, 7), (0, 7)))
def test_each_instance_has_marks_of_its_own_and_what_is_none_has_those_of_the_first(base: int, row: int) -> None:
    assert BodyMarks(7, 2, {}, low=100, size=10, count=3).row(base) == row
    assert BodyMarks(7, 2, {}).row(base) == 7


def test_an_element_at_several_places_has_one_mark() -> None:
    """Each place notes its own value there, also where other elements share a mark."""
    code = (("if", ((load("b", 9), (contact(0, bit(1)),)),), (contact(0, bit(2)),)), contact(1, bit(3)), contact(2, load("b", 8)))
    assert readings(code) == [("mark", 0, 1, False), ("mark", 1, 8, False), ("mark", 2, 1, False)]
    made = powered(image(code)).image.bodies[0].code
    noted = [block[-1] for block in (made[0][1][0][1], made[0][2])]
    assert noted == [("mark", 0, (), bit(1)), ("mark", 0, (), bit(2))]


def test_contacts_at_bits_of_a_byte_share_a_mark_until_all_bits_are_in_it() -> None:
    found = readings(tuple(contact(number, bit(number)) for number in range(8)))
    assert found == [("mark", 0, 1 << number, False) for number in range(7)] + [("mark", 1, 128, False)]


def test_a_store_ends_what_is_evaluated_together() -> None:
    between = ("store_bit", at(0), 0, const("b", 1))
    assert readings((contact(0, bit(0)), between, contact(1, bit(0)))) == [("mark", 0, 1, False), ("mark", 1, 1, False)]
    let = ("let", 1, "b", bit(2))
    tmp = ("tmp", "b", 1)
    assert readings((let, contact(0, tmp))) == [("mark", 0, 4, False)]
    assert readings((let, between, contact(0, tmp))) == [("mark", 0, 1, False)]
    assert readings((contact(0, bit(0)), let, contact(1, tmp))) == [("mark", 0, 1, False), ("mark", 0, 4, False)]


@each_of(("contacts", "of_its_own"), ((32, False), (33, True)))
def test_a_state_follows_from_up_to_32_marks(contacts: int, of_its_own: bool) -> None:
    """Contacts at variables of type BOOL have a mark each; the coil behind them is evaluated from a chain of ANDs."""
    lets = tuple(("let", number, "b", load("b", number)) for number in range(contacts))
    tmps = [("tmp", "b", number) for number in range(contacts)]
    power: Node = tmps[0]
    for tmp in tmps[1:]:
        power = "and", "b", power, tmp
    found = readings((*lets, *(contact(number, tmp) for number, tmp in enumerate(tmps)), contact(contacts, power)))
    assert (found[-1] == ("mark", contacts, 1, False)) is of_its_own and found[-1][0] == ("mark" if of_its_own else "and")


def several() -> Image:
    """A body that is called for two instances among the slots."""
    inner = (contact(0, ("load_bit", "b", own(0), 0)), contact(1, load("b", 9)))
    made = image((("call", 1, at(128)), ("call", 1, at(256))), inner)
    return replace(made, tasks=made.tasks[:1])


def test_a_body_for_several_instances_has_marks_for_as_many_as_there_can_be() -> None:
    made = powered(several())
    size, room = 64, several().layout.slots_size
    marks = made.bodies[1]
    assert (marks.first, marks.marks, marks.low, marks.size, marks.count) == (0, 2, SLOTS_OFFSET, size, room // size + 1)
    assert made.image.marks == 2 * marks.count
    assert [node[2] for node in made.image.bodies[1].code if node[0] == "mark"] == [(SLOTS_OFFSET, size, marks.count, 2)] * 2


def test_machine_code_has_room_for_all_marks_in_front_of_the_fields_of_its_context() -> None:
    made = powered(several()).image
    code, without = translate(made), translate(several())
    assert -code.kept_bytes == code.marks_at <= -made.marks and without.kept_bytes == without.marks_at == 0


def test_a_state_is_that_of_its_marks_and_unknown_as_long_as_one_of_them_is() -> None:
    first, second = ("mark", 0, 1, False), ("mark", 1, 2, True)
    for reading, wanted in ((first, True), (second, False), (("and", first, second), False), (("or", first, second), True),
                            (("not", second), True)):
        assert state(reading, bytes([1, 2])) is wanted
    assert state(("or", first, second), bytes([1, 255])) is None
