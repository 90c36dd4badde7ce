"""The branches of a program: what each IF and CASE may do next, by the statement that is then executed.

A loop is no branch: leaving it is part of every loop that ends.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fbvm.code.image import Image
from fbvm.code.operations import Block
from fbvm.code.shapes import blocks


@dataclass(frozen=True)
class Branch:
    """A statement that chooses: `ways` are the sites of the first statement of each way it has.

    Besides, it may go past all of them if `past`."""

    site: int
    targets: tuple[int, ...]
    may_skip: bool


def statements(image: Image) -> list[int]:
    """The sites of all statements and rungs."""
    return sorted({site for body in image.bodies for site in _sites(body.code)})


def branches(image: Image) -> list[Branch]:
    """All statements that choose."""
    found: dict[int, tuple[list[int], bool]] = {}
    for body in image.bodies:
        _walk(body.code, -1, found)
    return [Branch(site, tuple(dict.fromkeys(ways)), past) for site, (ways, past) in sorted(found.items()) if ways]


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
            ways = [first for each in inner if (first := next(_sites(each), None)) is not None]
            past = next(_sites(inner[-1]), None) is None
            known, before = found.get(here, ([], False))
            if ways:
                found[here] = [*known, *ways], before or past
        for each in inner:
            _walk(each, here, found)
