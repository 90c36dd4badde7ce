"""A program that counts how often each of its statements is executed, for coverage: an Image made of another.

Machine code executes it, so that counting costs little.  The counters are beside the memory, which is that of the plain
program."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple
from weakref import finalize

from fbvm.code.image import Body, Image
from fbvm.code.operations import Block, Node
from fbvm.code.shapes import blocks, statements
from fbvm.engine.depths import with_recursion_room

STATEMENTS = ("statement", "rung")


class Counter(NamedTuple):
    """What a counter counts: executions of a statement or rung, by its site, which may have several counters.

    With `skipped` the statement is an IF or CASE, and what is counted are its executions past all statements inside."""

    site: int
    skipped: bool = False


@dataclass(frozen=True)
class Counted:
    """An image with counters, and what each of them counts, by its number."""

    image: Image
    counters: tuple[Counter, ...]


FRAMES_A_LEVEL = 4
"""Python frames that counting takes at most for each level of nested code."""
_counted: dict[int, dict[frozenset[str] | None, Counted]] = {}
"""Those of images that are still in use, by what is counted."""


def counted(image: Image, files: Set[str] | None = None) -> Counted:
    """The same program, in which all statements, rungs, and ways past the statements of an IF or CASE are counted.

    With `files` only those of bodies that these files have, by their names in sites.  The same object as long as the image is in
    use."""
    wanted = None if files is None else frozenset(files)
    if id(image) not in _counted:
        _counted[id(image)] = {}
        finalize(image, _counted.pop, id(image))
    known = _counted[id(image)].get(wanted)
    if known is None:
        known = _counted[id(image)][wanted] = with_recursion_room(image, FRAMES_A_LEVEL, partial(_made, image, wanted))
    return known


def _made(image: Image, files: frozenset[str] | None) -> Counted:
    counters: list[Counter] = []
    bodies = tuple(replace(body, code=_block(body.code, None, counters)) if files is None or _is_of(body, image, files) else body
                   for body in image.bodies)  # fmt: skip
    return Counted(replace(image, bodies=bodies, counters=len(counters)), tuple(counters))


def _is_of(body: Body, image: Image, files: frozenset[str]) -> bool:
    """True if some statement of a body stands in one of some files."""
    return any(image.sites[node[2]].file in files for node in statements(body.code) if _is_statement(node))


def _block(block: Block, site: int | None, counters: list[Counter]) -> Block:
    """A block with counters.  `site` is the statement in which it stands."""
    out: list[Node] = []
    for node in block:
        if _is_statement(node):
            site = node[2]
            out += [node, ("count", len(counters))]
            counters.append(Counter(node[2]))
        elif not any(map(_has_statement, blocks(node))):  # an IF among them chooses values, such as that of OR_ELSE
            out.append(node)
        elif node[0] == "if":
            rows = tuple((condition, _branch(inner, site, counters)) for condition, inner in node[1])
            out.append(("if", rows, _branch(node[2], site, counters)))
        elif node[0] == "case":
            rows = tuple((labels, _branch(inner, site, counters)) for labels, inner in node[3])
            out.append((*node[:3], rows, _branch(node[4], site, counters)))
        else:
            out.append(("loop", *(_block(inner, site, counters) for inner in node[1:])))
    return tuple(out)


def _branch(block: Block, site: int | None, counters: list[Counter]) -> Block:
    """A branch of an IF or CASE, which counts itself if it has no statements."""
    if site is None or _has_statement(block):
        return _block(block, site, counters)
    counters.append(Counter(site, skipped=True))
    return ("count", len(counters) - 1), *block


def _is_statement(node: Node) -> bool:
    return node[0] == "observe" and node[1] in STATEMENTS


def _has_statement(block: Block) -> bool:
    return any(_is_statement(node) or any(map(_has_statement, blocks(node))) for node in block)
