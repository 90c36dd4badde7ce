"""Makes a run shorter on the engine, before the solver looks for the shortest one: it then has to look less far.

Parts of the run are left out, first halves, at last single scans, as long as what is left gets to the goal (delta debugging,
Zeller and Hildebrandt 2002)."""

from __future__ import annotations

from collections.abc import Callable
from itertools import accumulate, pairwise

from fbvm.prove.bounded import Inputs
from fbvm.prove.runs import InputWriter, Judge, Machine, stepped

MOST_SCANS = 60_000
"""Scans that may be executed for it."""


def shortened(machine: Machine, judge: Judge, inputs: Inputs, expired: Callable[[], bool]) -> Inputs:
    """A run to the goal with as few scans of a run to it as are found out to be enough."""
    left, size = MOST_SCANS, len(inputs) // 2
    while size:
        at = 0
        while at < len(inputs) and left > 0 and not expired():
            tried = _without(inputs, at, at + size)
            left -= len(tried)
            scans = _met_after(machine, judge, tried)
            if scans:
                inputs = Inputs(tried.values[:scans], tried.times_ns[:scans])
            else:
                at += size
        size //= 2
    return inputs


def _without(inputs: Inputs, first: int, last: int) -> Inputs:
    """A run without some of its scans; what passed before each of the others stays."""
    passed = [0, *(after - before for before, after in pairwise(inputs.times_ns))]
    kept = [*passed[:first], *passed[last:]]
    return Inputs([*inputs.values[:first], *inputs.values[last:]], [*accumulate([0, *kept[1:]])] if kept else [])


def _met_after(machine: Machine, judge: Judge, inputs: Inputs) -> int:
    """After how many scans a run gets to the goal; 0 if it does not, or breaks an assumption before."""
    if not len(inputs):
        return 0
    plc = machine.plc()
    with judge.judging(plc) as judging:
        for number, _ in enumerate(stepped(plc, InputWriter(plc, list(inputs.values[0])), inputs)):
            if not judging.kept(plc):
                return 0
            if judging.met(plc):
                return number + 1
            if plc.trap:
                return 0
    return 0
