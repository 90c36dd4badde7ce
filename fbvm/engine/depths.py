"""Recursion over code that may be nested deeper than Python's recursion limit."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import TypeVar

from fbvm.code.image import Image
from fbvm.code.operations import Block
from fbvm.code.recursion import with_room

_T = TypeVar("_T")


def with_recursion_room(image: Image, frames_a_level: int, work: Callable[[], _T]) -> _T:
    """Returns what `work()` returns; if that met Python's recursion limit, calls it once more with a higher limit.

    `work` recurses over the code of `image`, with at most `frames_a_level` Python frames for each level of nested tuples, and
    begins anew at each call.  The limit is raised only after it was met, because hardly any code is too deep and finding
    out how deep code is takes a third of the time of translating it."""
    return with_room(work, lambda: sys.getrecursionlimit() + frames_a_level * max(height(body.code) for body in image.bodies))


def height(code: Block) -> int:
    """How many levels of tuples are nested in each other at most."""
    height, level = 0, [code]
    while level:
        height += 1
        level = [part for item in level for part in item if isinstance(part, tuple)]
    return height
