"""The encoder does with single statements and expressions what the engine does: once with known memory, once with memory of
which it is told the values afterwards."""

from __future__ import annotations

from typing import Any

import pytest
from expression_rows import NUMBERS, RUNS, STRINGS
from hand_image import at, const, execute, image, load, power_on, store
from rows import each_of
from statement_rows import PROGRAMS
from symbolic import encoded_program, held, term_value

from fbvm.base.areas import SLOTS_OFFSET
from fbvm.base.memory import STRUCTS
from fbvm.code.operations import SIZES, Block, Node
from fbvm.prove.encoding.cells import Cell
from fbvm.prove.encoding.execution import Refused, Trapped
from fbvm.prove.encoding.scan import Scanned
from fbvm.prove.encoding.terms import Term

NOT_ENCODED = {"raise", "mark", "count", "now", "store_bit with terms"}
"""Rows of what stands in no program that is proved (a trap that is raised again, marks and counters of tests), of the time, which
the machine sets, and of a bit whose place is not known until the scan."""


def encoded(code: Block, memory: bytes, budget: int, inputs: set[int]) -> tuple[Scanned, dict[Term, Cell]]:
    """The scan of a program that is this code, and the variables of the bytes `inputs`."""
    return encoded_program(image(code), memory, budget, inputs)


def compare(code: Block, before: dict[int, bytes], *, budget: int = 100_000, unknown: bool = False) -> None:
    """Asserts that the encoder leaves the slots, or the trap, that the engine leaves; with `unknown` what lies in the slots
    before is told afterwards."""
    memory = bytes(power_on(image(code), before, budget).u8)
    ran = execute(code, before=before, budget=budget)
    after = bytes(ran.memory.u8)
    told = before if unknown else {}
    inputs = {SLOTS_OFFSET + offset + number for offset, data in told.items() for number in range(len(data))}
    scanned, variables = encoded(code, memory, budget, inputs)
    contents = scanned.contents
    cells = {cell for cells in contents.partition.at.values() for cell in cells if cell.offset >= SLOTS_OFFSET}
    left = {cell: contents.get(cell) for cell in cells}
    values = {term: held(cell, memory) for term, cell in variables.items()}
    if any(value > 1 and not term.width for term, value in values.items()):
        return  # no variable of type BOOL holds that
    known: dict[Term, int] = {}
    trap = next((each.code for each in scanned.execution.traps if term_value(each.condition, values, known)), None)
    assert trap == (ran.trap.code if ran.trap else None)
    if trap is None:
        found = {cell: term_value(term, values, known) for cell, term in left.items()}
        assert found == {cell: held(cell, after) for cell in left}
        changed = {place for place in range(SLOTS_OFFSET, len(after)) if memory[place] != after[place]}
        assert changed <= contents.partition.at.keys(), "what was written is known"


def result(machine: str, expression: Node) -> Block:
    """Code that stores the value of an expression."""
    if machine in ("s8", "s16"):
        return (("store_text", at(100), 20, expression),)
    return (store(machine, 104, expression), ("store_raw", machine, at(121), expression))


@each_of(("name", "code", "before"), [row[:3] for row in PROGRAMS if row[0] not in NOT_ENCODED],
         ids=[row[0] for row in PROGRAMS if row[0] not in NOT_ENCODED])
def test_a_statement_leaves_what_the_engine_leaves(name: str, code: Block, before: dict[int, bytes]) -> None:
    compare(code, before, budget=1000)


@each_of(("machine", "expression", "before"),
         [row[:3] for row in RUNS if row[1][0] not in NOT_ENCODED and row[2] != {0: b"\x01\x00\xc0\xff"}])  # a NaN with a number
def test_an_expression_has_the_value_of_the_engine(machine: str, expression: Node, before: dict[int, bytes]) -> None:
    compare(result(machine, expression), before)


@each_of("expression", [row[0] for row in STRINGS])
def test_a_text_is_that_of_the_engine(expression: Node) -> None:
    compare(result("s8", expression), {})


@pytest.mark.slow
@each_of(("machine", "expression", "before"), [row[:3] for row in RUNS if row[0] in SIZES and row[2] and row[1][0] in {
    "load", "load_bit", "not", "select", "mux", "check", "within", "floor_div"} and row[0][0] in "iub"])
def test_an_expression_of_what_is_told_afterwards_has_the_value_of_the_engine(
    machine: str, expression: Node, before: dict[int, bytes]
) -> None:
    try:
        compare(result(machine, expression), before, unknown=True)
    except (Refused, Trapped):
        assert expression[0] == "load" and expression[2][2], "a place that may be anywhere"


WHOLE = [row for row in NUMBERS if row[1] in SIZES and row[1][0] in "iub" and len(row) == 5]


@pytest.mark.slow
@each_of(("name", "machine", "a", "b"), [row[:4] for row in WHOLE])
def test_numbers_that_are_told_afterwards_give_what_the_engine_gives(name: str, machine: str, a: Any, b: Any) -> None:
    site = (3,) if name in ("div", "mod") else ()
    before = {0: STRUCTS[machine].pack(a), 8: STRUCTS[machine].pack(b)}
    for left, right in ((load(machine, 0), load(machine, 8)), (load(machine, 0), const(machine, b))):
        compare(result(machine, (name, machine, left, right, *site)), before, unknown=True)
