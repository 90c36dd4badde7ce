"""Where generators disagree about a drawing or a chart: each row of the survey by order of evaluation, scan by scan.

The text rows of the same survey, by dialect, stand in tests/unit/check/contested_rows.txt."""

from __future__ import annotations

from typing import NamedTuple

import pytest
from drawings import RAIL, block, coil, contact, document, pou, result, states, value, variable, wires
from rows import each_of
from test_charts import actions, does, jump, step, transition

from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.interchange.plcopen.read.producer import ORDERS

COIL_BEHIND_COIL = document(pou(
    RAIL + contact(2, "1", "a", at="50,20") + contact(3, "1", "b", at="50,60") + coil(4, "2 3", "c", at="90,20")
    + coil(5, "4", "d", at="130,20"), "a b c d"))
CROSSED = document(pou(
    RAIL + contact(2, "1", "c", at="50,200") + coil(3, "2", "b", at="90,200") + contact(4, "1", "go", at="50,20")
    + coil(5, "4", "c", at="90,20"), "go b c"))


def feedback(sink: str) -> bytes:
    """TON -> NOT -> TON, with an output variable behind one of them."""
    parts = (value(1, "T#20ms", at="10,20"), block(2, "TON", "IN=3 PT=1", "Q,ET", "t", at="50,20"),
             block(3, "NOT", "IN=2.Q", "OUT", at="90,20"), result(4, sink, "x", at="130,20"))
    return document(pou("".join(parts), variable("x") + variable("t", "TON"), language="FBD"))


TIMER_AT_TRANSITION = document(pou("".join((
    step(1, "s", first=True), transition(2, "1", wires("5.Q")), step(3, "e", "2"), transition(6, "3", wires("7")),
    jump(9, "6", "s"), actions(4, "3", does("x")), value(8, "go"), value(10, "T#10ms"), value(7, "back"),
    block(5, "TON", "IN=8 PT=10", "Q,ET", "t"))),
    variable("x") + variable("go") + variable("back") + variable("t", "TON"), language="SFC"))
"""A timer wired to the first transition, whose input does not ask for the step."""


class Row(NamedTuple):
    """A row: its number and name, a document, the variables to look at, what is set before each scan, and by order of evaluation
    what the variables are after each scan."""

    name: str
    document: bytes
    shown: str
    set: list[str]
    seen: dict[str, list[str]]


OR_OF_WIRES = ["1 1", "1 1", "1 1", "0 0"]
FALLING_THROUGH, ONE_SCAN_LATE = ["1 1", "1 1", "0 0", "0 0"], ["0 1", "1 1", "1 0", "0 0"]
CALLED_WITH_FALSE = ["1 0 0", "1 1 0", "1 1 0", "0 1 1", "1 0 0"]
CALLED_WITH_TRUE = ["1 1 0", "1 1 0", "1 1 1", "0 0 0", "1 1 0"]
AT_THE_TIMER = ["0 1 0", "0 1 0", "1 1 1", "0 0 0", "0 1 0"]
AT_THE_TIMER_LATE = ["0 0 0", "0 1 0", "0 1 0", "1 1 1", "0 0 0"]
EVERY_SCAN = ["0 0 1", "0 0 1", "0 1 1", "1 1 0", "0 1 1", "1 1 0"]
ROWS = (
    Row("41 a coil behind a coil, with two wires into the first: the second takes the OR of the wires, too",
        COIL_BEHIND_COIL, "c d", ["a=1", "b=1", "a=0", "b=0"], dict.fromkeys(ORDERS, OR_OF_WIRES)),
    Row("42 two rungs, the first in the document below the other", CROSSED, "b c", ["go=1", "", "go=0", ""],
        {"network": FALLING_THROUGH, "beremiz1": FALLING_THROUGH, "document": ONE_SCAN_LATE, "position": FALLING_THROUGH,
         "ids": ONE_SCAN_LATE}),
    Row("43 a loop with its output behind NOT: cut where the generator comes back to the block that it met first", feedback("3"),
        "x t.IN t.Q", [""] * 5, {"network": CALLED_WITH_FALSE, "beremiz1": CALLED_WITH_FALSE, "document": CALLED_WITH_FALSE,
                                 "position": CALLED_WITH_TRUE, "ids": CALLED_WITH_TRUE}),
    Row("43b the same loop with its output behind the timer", feedback("2.Q"), "x t.IN t.Q", [""] * 5,
        {**dict.fromkeys(ORDERS, AT_THE_TIMER), "network": AT_THE_TIMER_LATE}),
    Row("44 a timer wired to a transition runs in every scan, and is seen one scan late", TIMER_AT_TRANSITION, "x t.Q s.X",
        ["", "go=1", "", "", "back=1", ""], dict.fromkeys(ORDERS, EVERY_SCAN)),
)


@pytest.mark.slow
@each_of("row", ROWS, ids=lambda row: row.name)
def test_every_row_runs_as_its_generator_has_it(row: Row) -> None:
    assert set(row.seen) == set(ORDERS)
    found = {order: states(import_xml(row.document, order=order), row.shown, row.set) for order in ORDERS}
    assert found == row.seen
