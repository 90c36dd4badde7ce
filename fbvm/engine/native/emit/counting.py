"""Counters in machine code: one addition for a run of statements that are executed equally often.

The statements of a block one after the other, up to a jump, are a segment, and only its first statement is counted in the code.
The last branch of an IF or CASE is not counted at all: it was taken as often as no other was.  A trap ends a segment before its
end; on its way out of the bodies it notes the step at which each of them stood, and these are taken off afterwards."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

from fbvm.code.image import Image
from fbvm.code.operations import Block, Node
from fbvm.code.shapes import blocks, statements

NOWHERE = -1
"""In place of a position: no statement was counted before."""
NO_COUNTER = -1
"""In place of a counter: a step that only says how far a body has come."""
ENTRY_BYTES = 8


class Segment(NamedTuple):
    """A run of statements: the counters at its steps; the position around it; for the last branch of an IF or CASE the segments
    with which its other branches begin, None for a segment that is counted."""

    steps: list[int]
    around: int
    others: list[int] | None


@dataclass
class Choice:
    """An IF or CASE, each of whose branches begins with a counter: its position, and the segments of branches so far."""

    position: int
    branches: int
    begun: list[int] = field(default_factory=list)


class Counting:
    """The counters of a module.  A position is a step of a segment.

    `nested` is how many calls may be nested of bodies that are active already; `offset` is where the bytes for the counters begin
    in the context: how many positions a trap has noted, these, the segments."""

    def __init__(self, image: Image, nested: int) -> None:
        self.is_exact = any(node[0] == "attempt" for body in image.bodies for node in statements(body.code))
        """Whether each counter is a segment of its own, since a program that catches traps goes on behind them."""
        self.most_segments = sum(node[0] == "count" for body in image.bodies for node in statements(body.code))
        self.noted = 1 << (len(image.bodies) + nested).bit_length()
        self.bytes = ENTRY_BYTES * (1 + self.noted + self.most_segments)
        self.offset = 0
        self.segments: list[Segment] = []
        self.positions: list[tuple[int, int]] = []

    def begin(self, around: int, others: list[int] | None = None) -> int:
        """A new segment.  Returns its number."""
        self.segments.append(Segment([], around, others))
        return len(self.segments) - 1

    def step(self, segment: int, counter: int = NO_COUNTER) -> int:
        """Adds a step to a segment.  Returns its position."""
        self.segments[segment].steps.append(counter)
        self.positions.append((segment, len(self.segments[segment].steps) - 1))
        return len(self.positions) - 1

    def segment_at(self, segment: int) -> int:
        """Where a segment is counted, in the context."""
        return self.offset + ENTRY_BYTES * (1 + self.noted + segment)

    @property
    def facts(self) -> list[object]:
        """What `Counts` has to know, as JSON can say it."""
        return [self.offset, self.noted, self.segments, self.positions]


def leaves(node: Node, in_loop: bool = False) -> bool:
    """True if what stands behind a statement may not be executed although the statement was, without a trap."""
    if node[0] in ("return", "stop", "raise") or (node[0] in ("exit", "next") and not in_loop):
        return True
    inside: tuple[Block, ...] = blocks(node)
    return any(leaves(inner, in_loop or node[0] == "loop") for block in inside for inner in block)


def is_choice(node: Node) -> bool:
    """True for an IF or CASE each of whose branches begins with a counter."""
    return node[0] in ("if", "case") and all(map(_begins_counted, blocks(node)))


def _begins_counted(block: Block) -> bool:
    return next((node[0] for node in block if node[0] != "observe"), "") == "count"


class Emits(Protocol):
    """What writes instructions; a `Writer` does."""

    def new(self, instruction: str) -> str: ...

    def emit(self, instruction: str) -> None: ...


Around = tuple[int | None, int, int, Choice | None]
"""The state of a BodyCounting."""


class BodyCounting:
    """Counts in the code of one body, while `w` writes that."""

    def __init__(self, counting: Counting, w: Emits) -> None:
        self._counting, self._w = counting, w
        self._segment: int | None = None
        self._position = self._standing = NOWHERE
        """The step behind which the next statement comes; the step at which a trap finds the body now."""
        self._choice: Choice | None = None
        """The IF or CASE whose branches are written."""

    def begin_block(self) -> Around:
        """In front of a block.  Returns what `end_block` takes."""
        around = self._segment, self._position, self._standing, self._choice
        if self._choice:
            self._position = self._choice.position
        self._segment, self._standing = None, self._position
        return around

    def end_block(self, around: Around) -> None:
        """Behind a block."""
        self._segment, self._position, self._standing, self._choice = around

    def begin(self, node: Node) -> None:
        """In front of a statement: of an IF or CASE that was counted not all branches will be."""
        if node[0] == "count":
            return
        self._choice = None
        if self._segment is not None and is_choice(node):
            self._standing = self._counting.step(self._segment)  # while its conditions are evaluated
            self._position = self._counting.step(self._segment)
            self._choice = Choice(self._position, len(blocks(node)))

    def end(self, node: Node) -> None:
        """Behind a statement."""
        self._standing, self._choice = self._position, None
        if leaves(node):
            self._segment = None

    def count(self, number: int) -> None:
        """Counts an execution; the first counter of a segment does it for all."""
        choice, self._choice = self._choice, None
        if self._segment is None and choice and len(choice.begun) == choice.branches - 1:
            self._segment = self._counting.begin(self._position, choice.begun)
        elif self._segment is None:
            self._segment = self._counting.begin(self._position)
            if choice:
                choice.begun.append(self._segment)
            at = self._field(self._counting.segment_at(self._segment))
            before = self._w.new(f"load i64, ptr {at}")
            self._w.emit(f"store i64 {self._w.new(f'add i64 {before}, 1')}, ptr {at}")
        self._position = self._standing = self._counting.step(self._segment, number)
        if self._counting.is_exact:
            self._segment, self._position = None, NOWHERE
            self._standing = NOWHERE

    def note_position(self) -> None:
        """Writes, where a trap leaves the body, how far that has come."""
        if self._standing == NOWHERE:
            return
        w, counting = self._w, self._counting
        depth_at, first = self._field(counting.offset), self._field(counting.offset + ENTRY_BYTES)
        depth = w.new(f"load i64, ptr {depth_at}")
        index = w.new(f"and i64 {depth}, {counting.noted - 1}")
        w.emit(f"store i64 {self._standing}, ptr {w.new(f'getelementptr inbounds i64, ptr {first}, i64 {index}')}")
        w.emit(f"store i64 {w.new(f'add i64 {depth}, 1')}, ptr {depth_at}")

    def _field(self, offset: int) -> str:
        return self._w.new(f"getelementptr inbounds i8, ptr %c, i64 {offset}")


class Counts:
    """The counters of one engine, in its context at address `at`.  `facts` are those of `Counting`."""

    def __init__(self, counters: int, at: int, facts: Sequence[object]) -> None:
        offset, noted, segments, positions = facts
        assert isinstance(offset, int) and isinstance(noted, int) and isinstance(segments, list) and isinstance(positions, list)
        self._counters = counters
        self._segments: list[tuple[list[int], int, list[int] | None]] = segments
        self._positions: list[tuple[int, int]] = positions
        self._most = noted
        self._noted = (ctypes.c_int64 * (1 + noted)).from_address(at + offset)
        self._table = (ctypes.c_int64 * len(segments)).from_address(at + offset + ENTRY_BYTES * (1 + noted))
        self._trapped: dict[tuple[int, int], int] = {}
        """By segment and step how often a trap came there."""

    def settle(self) -> None:
        """Called after each trap: takes over the steps at which the bodies stood."""
        for position in self._noted[1 : 1 + min(self._noted[0], self._most)]:
            while position != NOWHERE:
                segment, step = self._positions[position]
                self._trapped[segment, step] = self._trapped.get((segment, step), 0) + 1
                position = self._segments[segment][1]
        self._noted[0] = 0

    def read(self) -> list[int]:
        """How often each counter was reached."""
        found = [0] * self._counters
        begun: list[int] = []
        reached: list[list[int]] = []
        for number, (steps, around, others) in enumerate(self._segments):
            count = self._table[number]
            if others is not None:
                segment, step = self._positions[around]
                count = reached[segment][step] - sum(begun[other] for other in others)
            begun.append(count)
            reached.append([])
            for step, counter in enumerate(steps):
                reached[-1].append(count)
                if counter != NO_COUNTER:
                    found[counter] += count
                count -= self._trapped.get((number, step), 0)
        return found
