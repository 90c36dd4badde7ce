"""The nesting of statements: for each statement of an image the IF, CASE or loop around it."""

from __future__ import annotations

from fbvm.code.image import Image
from fbvm.code.operations import Block
from fbvm.code.shapes import blocks

NONE = -1


def outer_statements(image: Image) -> list[int]:
    """For each site the site of the IF, CASE or loop around it, NONE for statements of a body itself."""
    outer: dict[int, int] = {}
    for body in image.bodies:
        _walk(body.code, NONE, outer)
    return [outer.get(site, NONE) for site in range(len(image.sites))]


def _walk(block: Block, around: int, outer: dict[int, int]) -> None:
    """Enters the statement around each statement of a block.

    Of statements with the same site, such as a rung and its first step, the outermost counts."""
    here = around
    for node in block:
        if node[0] == "observe" and node[1] in ("statement", "rung"):
            here = node[2]
            outer.setdefault(here, around)
        for inner in blocks(node):
            _walk(inner, here, outer)
