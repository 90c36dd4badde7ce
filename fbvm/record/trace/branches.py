"""The branches of a program: the statements that may be executed next after each IF and CASE.

Loops are not counted as branches, since every loop that ends is left.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fbvm.code.image import Image
from fbvm.code.operations import Block
from fbvm.code.shapes import blocks


@dataclass(frozen=True)
class Branch:
    """An IF or CASE: its site, and in `targets` the site of the first statement of each of its branches.

    `may_skip` is True if it can execute none of them."""

    site: int
    targets: tuple[int, ...]
    may_skip: bool


def statements(image: Image) -> list[int]:
    """The sites of all statements and rungs, in order."""
    return sorted({site for body in image.bodies for site in _sites(body.code)})


def branches(image: Image) -> list[Branch]:
    """All IF and CASE statements that have branches with statements, in the order of their sites."""
    found: dict[int, tuple[list[int], bool]] = {}
    for body in image.bodies:
        _walk(body.code, -1, found)
    return [Branch(site, tuple(dict.fromkeys(targets)), skips) for site, (targets, skips) in sorted(found.items()) if targets]


def _sites(block: Block) -> Iterator[int]:
    for node in block:
        if node[0] == "observe" and node[1] in ("statement", "rung"):
            yield node[2]
        for inner in blocks(node):
            yield from _sites(inner)


def _walk(block: Block, around: int, found: dict[int, tuple[list[int], bool]]) -> None:
    here = around
    for node in block:
        if node[0] == "observe" and node[1] in ("statement", "rung"):
            here = node[2]
            continue
        inner = blocks(node)
        if node[0] in ("if", "case") and here >= 0:
            targets = [first for each in inner if (first := next(_sites(each), None)) is not None]
            may_skip = next(_sites(inner[-1]), None) is None
            known, before = found.get(here, ([], False))
            if targets:
                found[here] = [*known, *targets], before or may_skip
        for each in inner:
            _walk(each, here, found)
