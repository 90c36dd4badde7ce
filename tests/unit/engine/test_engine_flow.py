"""Control flow of random programs against a walker of the tree: what leaves what, and where the budget ends."""

from __future__ import annotations

from contextlib import suppress

import pytest
from depth import times
from hand_image import at, const, execute, load
from hypothesis import given, settings
from hypothesis import strategies as st

from fbvm.code.operations import Block, Node

SLOTS = 4
"""Bytes that programs count in, each behind the other."""


class Exit(Exception):
    """Left a loop."""


class Next(Exception):
    """Goes to the tail."""


class Return(Exception):
    """Left the body."""


class Watchdog(Exception):
    """The budget is used up."""


class Walker:
    """Executes code by walking it."""

    def __init__(self, budget: int) -> None:
        self.slots, self.temporaries, self.budget = [0] * SLOTS, {}, budget

    def value(self, node: Node) -> int:
        """load, tmp, const, add of u8, and comparisons."""
        if node[0] == "load":
            return self.slots[node[2][1] - at(0)[1]]
        if node[0] == "tmp":
            return self.temporaries[node[2]]
        if node[0] == "const":
            return node[2]
        if node[0] == "add":
            return (self.value(node[2]) + self.value(node[3])) % 256
        return {"lt": int.__lt__, "eq": int.__eq__}[node[0]](self.value(node[3]), self.value(node[4]))

    def block(self, block: Block) -> None:
        for node in block:
            getattr(self, f"do_{node[0]}")(*node[1:])

    def run(self, code: Block) -> bool:
        """True if the watchdog ended it."""
        try:
            self.block(code)
        except Return:
            return False
        except Watchdog:
            return True
        return False

    def do_store(self, machine: str, address: tuple[str, int, tuple[()]], a: Node) -> None:
        self.slots[address[1] - at(0)[1]] = self.value(a)

    def do_let(self, number: int, machine: str, a: Node) -> None:
        self.temporaries[number] = self.value(a)

    def do_charge(self, count: int, site: int) -> None:
        self.budget -= count
        if self.budget < 0:
            raise Watchdog

    def do_if(self, rows: tuple[tuple[Node, Block], ...], otherwise: Block) -> None:
        for condition, block in rows:
            if self.value(condition):
                return self.block(block)
        return self.block(otherwise)

    def do_case(self, machine: str, a: Node, rows: tuple[tuple[tuple[tuple[int, int], ...], Block], ...],
                otherwise: Block) -> None:
        value = self.value(a)
        for labels, block in rows:
            if any(low <= value <= high for low, high in labels):
                return self.block(block)
        return self.block(otherwise)

    def do_loop(self, head: Block, body: Block, tail: Block) -> None:
        try:
            while True:
                self.block(head)
                with suppress(Next):
                    self.block(body)
                self.block(tail)
        except Exit:
            return

    def do_exit(self) -> None:
        raise Exit

    def do_next(self) -> None:
        raise Next

    def do_return(self) -> None:
        raise Return


LEAVES: tuple[Node, ...] = (*(load("u8", slot) for slot in range(SLOTS)), *(const("u8", number) for number in range(6)),
                            ("tmp", "u8", 0))  # fmt: skip
SLOT = st.integers(0, SLOTS - 1)
VALUE = st.sampled_from((*LEAVES * len(LEAVES), *(("add", "u8", one, other) for one in LEAVES for other in LEAVES)))
"""One of the leaves, or as often a sum of two: drawn at once, since drawing takes longer than what is drawn."""
RELATION = st.sampled_from(("lt", "eq"))
LABELS = st.lists(st.sampled_from([(low, low + more) for low in range(13) for more in range(5)]), min_size=1, max_size=3)
UP_TO = [st.integers(0, most) for most in range(5)]
AT_LEAST_ONE = {most: st.integers(1, most) for most in (3, 8)}
ALWAYS, DEEP, IN_LOOP = ("store", "store", "let"), ("if", "if", "case", "loop"), ("exit", "next", "return")
KIND = {(deep, in_loop): st.sampled_from((*ALWAYS, *DEEP * deep, *IN_LOOP * in_loop))
        for deep in (False, True) for in_loop in (False, True)}  # fmt: skip


def condition(draw: st.DrawFn) -> Node:
    return draw(RELATION), "b", "u8", draw(VALUE), draw(VALUE)


def block(draw: st.DrawFn, depth: int, in_loop: bool, most: int = 4) -> Block:
    return tuple(statement(draw, depth, in_loop) for _ in range(draw(UP_TO[most])))


def statement(draw: st.DrawFn, depth: int, in_loop: bool) -> Node:
    kind = draw(KIND[depth > 0, in_loop])
    if kind == "store":
        return "store", "u8", at(draw(SLOT)), draw(VALUE)
    if kind == "let":
        return "let", 0, "u8", draw(VALUE)
    if kind == "if":
        rows = tuple((condition(draw), block(draw, depth - 1, in_loop)) for _ in range(draw(AT_LEAST_ONE[3])))
        return "if", rows, block(draw, depth - 1, in_loop, most=2)
    if kind == "case":
        choices = tuple((tuple(draw(LABELS)), block(draw, depth - 1, in_loop, most=2)) for _ in range(draw(AT_LEAST_ONE[8])))
        return "case", "u8", draw(VALUE), choices, block(draw, depth - 1, in_loop, most=2)
    if kind == "loop":
        leave = ("if", ((condition(draw), (("exit",),)),), ())
        head = (("charge", draw(AT_LEAST_ONE[3]), 4), leave)
        tail = (*block(draw, 0, False, most=2), *((leave,) if draw(st.booleans()) else ()))
        return "loop", head, block(draw, depth - 1, True), tail
    return (kind,)


@st.composite
def blocks(draw: st.DrawFn, depth: int) -> Block:
    return block(draw, depth, False)


def deepened(block: Block, levels: int) -> Block:
    """The same code inside so many blocks that are always executed."""
    for _ in range(levels):
        block = (("if", ((("eq", "b", "u8", const("u8", 1), const("u8", 1)), block),), ()),)
    return block


def deep_bodies(node: Node, levels: int) -> Node:
    """The same loop with its body deep inside."""
    return ("loop", node[1], deepened(node[2], levels), node[3]) if node[0] == "loop" else node


@pytest.mark.slow
@given(code=blocks(3), levels=st.sampled_from((0, 0, 59, 75)))
@settings(max_examples=times(40), deadline=None)
def test_random_programs(code: Block, levels: int) -> None:
    code = (("let", 0, "u8", const("u8", 3)), *deepened(tuple(deep_bodies(node, levels) for node in code), levels))
    walker = Walker(200)
    trapped = walker.run(code)
    rig = execute(code, budget=200)
    assert (rig.trap is not None) == trapped
    assert list(rig.memory.u8[at(0)[1]:at(0)[1] + SLOTS]) == walker.slots
    assert trapped is False or (rig.trap is not None and rig.trap.code == "R0104")
