"""Work on code that may be nested deeper than the host recurses."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TypeVar

from fbvm.code.image import Image
from fbvm.code.operations import Block

_T = TypeVar("_T")


def with_recursion_room(image: Image, frames_a_level: int, work: Callable[[], _T]) -> _T:
    """What `work` yields, which goes through the code of an image with at most so many frames for a level of tuples.

    Hardly any code is too deep for the host's limit, and to look how deep it is takes a third of the time of translating
    it.  So the work, which has to begin anew whenever it is called, is done again with room if it met the limit."""
    try:
        return work()
    except RecursionError:
        before = sys.getrecursionlimit()
        sys.setrecursionlimit(before + frames_a_level * max(height(body.code) for body in image.bodies))
        try:
            return work()
        finally:
            sys.setrecursionlimit(before)


def height(code: Block) -> int:
    """Levels of tuples in each other."""
    height, level = 0, [code]
    while level:
        height += 1
        level = [part for item in level for part in item if isinstance(part, tuple)]
    return height
