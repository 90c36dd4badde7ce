"""Whether a mutant gives the same outputs as the block it was made of, for all inputs in all scans; then no test can find it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fbvm.base.diagnostics import Source
from fbvm.base.types import fold
from fbvm.campaign.mutation.mutants import Mutant
from fbvm.code.compiler import compile_sources
from fbvm.prove import equality
from fbvm.prove.encoding.execution import Refused
from fbvm.prove.prover import Limits, SpuriousRun, prove
from fbvm.prove.question import PROVED
from fbvm.prove.solver import SolverMissing
from fbvm.run.time_limit import time_limit
from fbvm.syntax import tree
from fbvm.syntax.parser import parse
from fbvm.syntax.tree.node import walk
from fbvm.watch.conditions import ConditionError
from fbvm.watch.paths import UnknownPlace

RENAMED = "{}_as_changed"
"""The name of the changed block beside the other one."""


def proof_of_equality(mutant: Mutant, text: str, libraries: Sequence[Path], cycle_ns: int, budget_ns: int) -> str:
    """How it was proved that a mutant is equal to the block in `text`; "" if it is not proved.

    The proof is for scans `cycle_ns` apart, and is given up after `budget_ns`.  PROGRAMs are not compared: what they do
    lies in memory that both would write."""
    changed = _renamed(mutant, text)
    if changed is None:
        return ""
    names = (mutant.change.pou, RENAMED.format(mutant.change.pou))
    sources = [Source(mutant.file, text), Source("<changed>", changed)]
    try:
        caller = equality.pair(sources, names, libraries)
        made = compile_sources([*sources, caller], equality.PROGRAM, libraries, runnable=True)
        if made.image is None:
            return ""
        question = equality.equality(made.image, names)
        verdict = prove(made.image, question, Limits(cycle_ns, expired=time_limit(budget_ns)))
    except (equality.Unlike, Refused, SpuriousRun, SolverMissing, UnknownPlace, ConditionError):
        return ""
    return f"proved {verdict.how}" if verdict.word == PROVED else ""


def _renamed(mutant: Mutant, text: str) -> str | None:
    """The text of the changed block alone, under another name; None for a PROGRAM."""
    applied = mutant.applied(text)
    for node in parse(Source(mutant.file, applied))[0].everything():
        if isinstance(node, tree.Pou) and node.name.text == mutant.change.pou and node.kind in ("FUNCTION_BLOCK", "FUNCTION"):
            new = RENAMED.format(node.name.text)
            own = {(node.name.start, node.name.end)}
            if node.kind == "FUNCTION":  # whose result has its name
                own |= {(each.start, each.end) for each in walk(node)
                        if isinstance(each, tree.NameRef) and fold(each.text) == fold(node.name.text)}  # fmt: skip
            for start, end in sorted(own, reverse=True):
                applied = applied[:start] + new + applied[end:]
            return applied[node.start : node.end + sum(len(new) - (end - start) for start, end in own)] + "\n"
    return None
