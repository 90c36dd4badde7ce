"""What a run tells afterwards is what it tells while it stands still: the same observations, with the same memory at each."""

from __future__ import annotations

from random import Random

import pytest
from depth import times
from hand_image import image
from lang_corpus import programs
from observing import first_difference
from random_code import COUNTERS, Maker
from rows import go_through
from st_programs import made
from st_text import text_of

from fbvm.base.diagnostics import Source
from fbvm.code.compiler import compile_sources, compile_text
from fbvm.code.operations import Block, Node

pytestmark = pytest.mark.slow
EACH_NTH = 20
"""Of the language corpus one program in so many."""


def compare_text(text: str, dialect: str = "standard", cycle_ns: int = 10_000_000) -> None:
    compiled = compile_sources([Source("text.st", text)], runnable=True, dialect=dialect, lint=False).image
    assert compiled is None or first_difference(compiled, 2, cycle_ns=cycle_ns) == ""


def test_programs_of_the_corpus() -> None:
    running = [program for program in programs() if program.runs][::EACH_NTH]
    go_through((f"{p.name}:{p.line}", lambda p=p: compare_text(p.text, p.dialect, p.cycle_ns)) for p in running)  # type: ignore[misc]


@pytest.mark.parametrize("seed", range(times(8, 50)))
def test_programs_made_at_random(seed: int) -> None:
    compiled = compile_text(text_of(made(seed))[0]).image
    assert compiled is None or first_difference(compiled) == ""


def watched(random: Random, block: Block) -> Block:
    """Code with an observation behind each statement, of stores often the write, and sometimes of a read."""
    out: list[Node] = []
    for node in block:
        out.append(_watched_inside(random, node))
        where = {"store": 2, "store_raw": 2, "store_bit": 1, "store_flag": 1}.get(node[0])
        if where and random.random() < 0.7:
            form = node[1] if where == 2 else "b"
            bit = node[2] if node[0] == "store_bit" else 255
            out.append(("observe", random.choice(("write", "write", "read")), 3, (form, node[where], bit)))
        elif node[0] not in ("exit", "next", "return", "stop"):
            out.append(("observe", "statement", random.randrange(30), None))
    return tuple(out)


def _watched_inside(random: Random, node: Node) -> Node:
    if node[0] == "if":
        return "if", tuple((c, watched(random, block)) for c, block in node[1]), watched(random, node[2])
    if node[0] == "case":
        return (*node[:3], tuple((labels, watched(random, block)) for labels, block in node[3]), watched(random, node[4]))
    return ("loop", *(watched(random, block) for block in node[1:])) if node[0] == "loop" else node


@pytest.mark.parametrize("seed", range(times(8, 50)))
def test_code_made_at_random(seed: int) -> None:
    random = Random(seed)
    codes = [watched(random, code) for code in Maker(random, 3).program()]
    assert first_difference(image(*codes, size=1024, counters=COUNTERS), budget=3000) == ""
