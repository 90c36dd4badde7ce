"""Which statement stands inside which: for each statement of an image the one that decides whether it is executed."""

from __future__ import annotations

from fbvm.code.image import Image
from fbvm.code.operations import Block

NONE = -1


def outer_statements(image: Image) -> list[int]:
    """For each site the site of the IF, CASE or loop around it, NONE for statements of a body itself."""
    outer: dict[int, int] = {}
    for body in image.bodies:
        _walk(body.code, NONE, outer)
    return [outer.get(site, NONE) for site in range(len(image.sites))]


def _walk(block: Block, around: int, outer: dict[int, int]) -> None:
    """Notes what stands around each statement of a block.

    Of statements that begin at one place, as those of a rung and of its first step, the outermost counts."""
    here = around
    for node in block:
        name, *operands = node
        if name == "observe" and operands[0] in ("statement", "rung"):
            here = operands[1]
            outer.setdefault(here, around)
        elif name == "if":
            for _, inner in operands[0]:
                _walk(inner, here, outer)
            _walk(operands[1], here, outer)
        elif name == "case":
            for _, inner in operands[2]:
                _walk(inner, here, outer)
            _walk(operands[3], here, outer)
        elif name == "loop":
            for inner in operands:
                _walk(inner, here, outer)
