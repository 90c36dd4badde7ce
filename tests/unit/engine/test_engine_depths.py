"""Work on deep code: done once as a rule, again with room where the host's limit was met, which is as before then."""

from __future__ import annotations

import sys
from typing import Any

import pytest
from hand_image import const, image, store

from fbvm.engine.depths import height, with_recursion_room


def nested(depth: int) -> Any:
    code = const("i16", 1)
    for _ in range(depth):
        code = ("neg", "i16", code)
    return code


@pytest.mark.parametrize(("depth", "times"), [(10, 1), (3000, 2)])
def test_what_meets_the_limit_is_done_again(depth: int, times: int) -> None:
    before, tried = sys.getrecursionlimit(), []

    def below(code: Any) -> int:
        return 1 + below(code[2]) if code[0] == "neg" else 0

    def work() -> int:
        tried.append(sys.getrecursionlimit())
        return below(nested(depth))

    assert with_recursion_room(image((store("i16", 0, nested(depth)),)), 1, work) == depth
    assert (len(tried), sys.getrecursionlimit()) == (times, before)


def test_levels_are_those_of_tuples() -> None:
    assert height((nested(0),)) + 5 == height((nested(5),))
