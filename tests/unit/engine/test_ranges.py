"""What is known of temporaries: the union of what their `let`s say."""

from __future__ import annotations

from hand_image import const, load

from fbvm.base.arithmetic import limits
from fbvm.code.operations import Node
from fbvm.engine.ranges import with_temporaries


def let(number: int, value: Node) -> Node:
    return "let", number, value[1], value


def tmp(number: int, machine: str = "i64") -> Node:
    return "tmp", machine, number


INDEX = ("check", "i64", ("convert", "i64", "i16", load("i16", 0)), 0, 9, "R0102", 1)


def test_a_temporary_has_the_range_of_what_it_was_made_of() -> None:
    of = with_temporaries((let(1, INDEX), let(2, ("add", "i64", tmp(1), const("i64", 5)))))
    assert (of(tmp(1)), of(tmp(2)), of(tmp(3))) == ((0, 9), (5, 14), limits("i64"))


def test_of_several_it_has_all_ranges() -> None:
    otherwise = (let(1, const("i64", 40)),)
    of = with_temporaries((("if", ((load("b", 8), (let(1, INDEX),)),), otherwise),))
    assert of(tmp(1)) == (0, 40)


def test_one_that_is_made_of_itself_can_be_anything() -> None:
    code = let(1, const("u8", 0)), ("loop", (), (let(1, ("add", "u8", tmp(1, "u8"), const("u8", 1))),), ())
    assert with_temporaries(code)(tmp(1, "u8")) == (0, 255)


def test_two_that_are_made_of_each_other_can_be_anything() -> None:
    def more(number: int) -> Node:
        return "add", "u8", tmp(number, "u8"), const("u8", 1)

    code = let(1, const("u8", 0)), ("loop", (), (let(2, more(1)), let(1, more(2))), ())
    of = with_temporaries(code)
    assert (of(tmp(1, "u8")), of(tmp(2, "u8"))) == ((0, 255), (0, 255))
