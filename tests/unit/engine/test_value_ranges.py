"""What integer operations can yield, of what their operands can be."""

from __future__ import annotations

from typing import Any

from hand_image import const, load
from rows import each_of

from fbvm.base.arithmetic import limits
from fbvm.engine.ranges import never_wraps, unwrapped_range, value_range

A, B, WHOLE = load("i16", 0), load("i16", 8), limits("i16")


def two(name: str, right: Any = B) -> Any:
    return name, "i16", A, right


FIVE, MINUS_FIVE, NO, ONE = const("i16", 5), const("i16", -5), const("i16", 0), const("i16", 1)


@each_of(("node", "a", "b", "range_"), (
    (two("add"), (1, 5), (-2, 3), (-1, 8)), (two("sub"), (1, 5), (-2, 3), (-2, 7)),
    (two("mul"), (-2, 5), (-3, 4), (-15, 20)), (two("mul"), (-5, -2), (-4, -3), (6, 20)),
    (two("div", FIVE), (-12, 24), (0, 0), (-2, 4)), (two("div", FIVE), (-4, 4), (0, 0), (0, 0)), (two("div", ONE), (-3, 8), (0,
    0), (-3, 8)),
    (two("div", MINUS_FIVE), (0, 9), (0, 0), (WHOLE[0], WHOLE[1] + 1)), (two("div"), (0, 9), (1, 2), (WHOLE[0], WHOLE[1] + 1)),
    (two("div", NO), (0, 9), (0, 0), (WHOLE[0], WHOLE[1] + 1)),
    (("div", "u16", A, B), (0, 9), (1, 2), (0, 65535)),
    (two("mod", FIVE), (-12, 24), (0, 0), (-4, 4)), (two("mod", MINUS_FIVE), (-12, 24), (0, 0), (-4, 4)),
    (two("mod", FIVE), (-2, 3), (0, 0), (-2, 3)), (two("mod", FIVE), (0, 24), (0, 0), (0, 4)),
    (two("mod", FIVE), (-24, 0), (0, 0), (-4, 0)), (two("mod", FIVE), (2, 3), (0, 0), (0, 3)), (two("mod", FIVE), (-3, -2), (0,
    0), (-3, 0)),
    (two("mod"), (2, 9), (1, 5), (0, 9)), (two("mod"), (-9, -2), (1, 5), (-9, 0)), (two("mod"), (-9, 8), (1, 5), (-9, 8)),
    (("neg", "i16", A), (-2, 5), (0, 0), (-5, 2)), (("abs", "i16", A), (-7, 5), (0, 0), (0, 7)), (("abs", "i16", A), (-2, 5),
    (0, 0), (0, 5)),
    (two("and"), (0, 9), (0, 5), (0, 5)), (two("or"), (0, 9), (0, 5), (0, 15)), (two("xor"), (0, 3), (0, 16), (0, 31)),
    (two("or"), (0, 0), (0, 0), (0, 0)), (two("shr", FIVE), (0, 100), (0, 0), (0, 3)), (two("shr", NO), (0, 100), (0, 0), (0,
    100)),
    (two("shr", const("i16", 99)), (7, 100), (0, 0), (0, 0)), (two("shr", FIVE), (-1, 100), (0, 0), WHOLE), (two("shr"), (0,
    100), (0, 3), WHOLE),
    (two("shr", MINUS_FIVE), (0, 100), (0, 0), WHOLE), (two("floor_div", FIVE), (-12, 24), (0, 0), (-3, 4)),
    (two("floor_div"), (-12, 24), (1, 4), WHOLE), (("convert", "i16", "u8", A), (0, 99), (0, 0), (0, 99)),
    (("convert", "i16", "f32", A), (0, 99), (0, 0), WHOLE), (("check", "i16", A, 0, 9, "R0102", 1), (-4, 4), (0, 0), (0, 4)),
    (("check", "i16", A, 0, 9, "R0102", 1), (4, 40), (0, 0), (4, 9)), (("select", "i16", load("b", 3), A, B), (1, 5), (-2, 3),
    (-2, 5)),
    (("mux", "i16", load("u8", 3), (A, B, FIVE)), (1, 4), (-2, 3), (-2, 5)), (two("min"), (1, 5), (-2, 3), (-2, 5)),
    (two("max"), (1, 5), (-2, 3), (-2, 5)), (FIVE, (0, 0), (0, 0), (5, 5)), (A, (0, 0), (0, 0), WHOLE)))  # fmt: skip
def test_the_range_of_an_operation(node: Any, a: tuple[int, int], b: tuple[int, int], range_: tuple[int, int]) -> None:
    def of(operand: Any) -> tuple[int, int]:
        return {A: a, B: b}.get(operand) or value_range(operand)

    assert unwrapped_range(node, of) == range_


def test_what_could_wrap_can_be_anything_and_what_fits_to_the_last_number_cannot() -> None:
    for low, high, fits in ((-32768, 32767, True), (-32769, 32767, False), (-32768, 32768, False)):
        def of(operand: Any, found: tuple[int, int] = (low + 1, high + 1)) -> tuple[int, int]:
            return found if operand == A else value_range(operand)

        node = two("sub", ONE)
        assert (value_range(node, of), never_wraps(node, of)) == ((low, high) if fits else WHOLE, fits)
