"""The code of a body with the code of small bodies in place of their calls.

What a call and its return cost is saved, and an engine knows of values what it cannot know across a call.  Charges, counts, sites
and stores stay as they were.  Two statements more mark what was a call, for the engine that asks for this code: ("begin", number,
address), with the operands of the call, and ("end", number)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Mapping
from itertools import chain
from typing import Any

from fbvm.code.image import Image
from fbvm.code.operations import Address, Block, Node
from fbvm.code.shapes import is_address, statements

MOST_STATEMENTS = 40
"""Statements of a body that takes the place of its calls, with those that take the place of calls in it."""
TOO_MANY = MOST_STATEMENTS + 1
LEAST_GROWTH, GROWTH = 200, 0.25
"""Statements that the bodies of an image may grow by: so many, or this share of what they have."""
CALLED = {"return", "mark", "attempt"}
"""Statements whose bodies are always called: they leave their body, ask where its instance begins, or catch a trap in it."""


class Inlining:
    """Which bodies of an image take the place of their calls.

    `called` are the numbers of bodies that have to be called, such as those that call each other in a circle."""

    def __init__(self, image: Image, called: Container[int]) -> None:
        self._image = image
        self._codes: dict[int, Block] = {}
        found = [[node for node in statements(body.code) if node[0] != "observe"] for body in image.bodies]
        calls = [[node[1] for node in code if node[0] == "call" and _is_fixed(node[2])] for code in found]
        sizes = {number: TOO_MANY for number, code in enumerate(found)
                 if number in called or len(code) > MOST_STATEMENTS or any(node[0] in CALLED for node in code)}  # fmt: skip
        waiting = list(range(len(found)))
        while waiting:  # a body is looked at again once all that it calls have a size
            number = waiting.pop()
            unknown = [each for each in calls[number] if each not in sizes]
            if unknown:
                waiting += [number, *unknown]
            elif number not in sizes:
                inside = sum(sizes[each] for each in calls[number] if sizes[each] <= MOST_STATEMENTS)
                sizes[number] = min(TOO_MANY, len(found[number]) + inside)
        self._numbers = _smallest(sizes, Counter(chain.from_iterable(calls)), max(LEAST_GROWTH, GROWTH * sum(map(len, found))))

    def code(self, number: int) -> Block:
        """The code of the body of that number."""
        if number not in self._codes:
            self._codes[number] = _Writer(self, self._image.bodies[number].code).code
        return self._codes[number]

    def of(self, call: Node) -> Block | None:
        """The code that takes the place of a call; None if the body is called."""
        return self.code(call[1]) if call[1] in self._numbers and _is_fixed(call[2]) else None


def in_place(code: Block, address: Address | None) -> Block:
    """The code of a body without temporaries, for the instance at an address."""
    return _Moved(code, address, 0).code


def _smallest(sizes: Mapping[int, int], calls: Mapping[int, int], room: float) -> set[int]:
    """The bodies of which calls gain most, as long as there is room for their statements."""
    chosen: set[int] = set()
    for size, number in sorted((sizes[number], number) for number in calls):
        room -= calls[number] * size
        if room < 0 or size == TOO_MANY:
            break
        chosen.add(number)
    return chosen


def _is_fixed(address: Address | None) -> bool:
    """Whether an instance lies where no statement could change."""
    return address is None or (isinstance(address[0], str) and not address[2])


class _Writer:
    """Writes the code of one body; temporaries of what takes the place of a call get numbers that nothing else has."""

    def __init__(self, inlining: Inlining, code: Block) -> None:
        self._inlining = inlining
        self._numbers = 1 + max((node[1] if node[0] == "let" else node[3] for node in statements(code)
                                 if node[0] in ("let", "attempt")), default=-1)  # fmt: skip
        self.code = self._block(code)

    def _block(self, block: Block) -> Block:
        found: list[Node] = []
        for node in block:
            code = self._inlining.of(node) if node[0] == "call" else None
            if code is None:
                found.append(self._inside(node))
            else:
                found += [("begin", *node[1:]), *_Moved(code, node[2], self._numbers).code, ("end", node[1])]
                self._numbers += 1 + max((each[1] for each in statements(code) if each[0] == "let"), default=-1)
        return tuple(found)

    def _inside(self, node: Node) -> Node:
        """A statement with what takes the place of calls in its blocks."""
        if node[0] == "if":
            return ("if", tuple((condition, self._block(block)) for condition, block in node[1]), self._block(node[2]))
        if node[0] == "case":
            rows = tuple((labels, self._block(block)) for labels, block in node[3])
            return (*node[:3], rows, self._block(node[4]))
        return ("loop", *map(self._block, node[1:])) if node[0] == "loop" else node


class _Moved:
    """Code for the one instance at `address`, with its temporaries from number `first` on."""

    def __init__(self, code: Block, address: Address | None, first: int) -> None:
        self._address, self._first = address or ("abs", 0, ()), first
        self.code: Block = self._part(code)

    def _part(self, part: Any) -> Any:
        if part.__class__ is not tuple or not part:
            return part
        if part[0] == "self" and is_address(part):
            base, offset, _ = self._address
            return base, offset + part[1], self._part(part[2])
        if part[0] == "let":
            return ("let", self._first + part[1], part[2], self._part(part[3]))
        if part[0] == "tmp":
            return ("tmp", part[1], self._first + part[2])
        return part if part[0] in ("const", "charge") else tuple(map(self._part, part))
