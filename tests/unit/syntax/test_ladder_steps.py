"""Which steps of rungs have a state that a drawing shows."""

from __future__ import annotations

import pytest

from fbvm.base.diagnostics import Source, errors
from fbvm.syntax.parser import parse
from fbvm.syntax.tree.ladder import Element, Ladder
from fbvm.syntax.tree.node import walk


def states(lines: str) -> list[str]:
    """The steps of a rung that have a state."""
    source, found = parse(Source("x.st", f"PROGRAM Main\nVAR a : BOOL; END_VAR\nLADDER\n{lines}END_LADDER\nEND_PROGRAM\n"))
    assert errors(found) == []
    return [f"{rung.steps[step].mnemonic} {' '.join(rung.steps[step].operands)}".strip()
            for ladder in walk(source) if isinstance(ladder, Ladder) for rung in ladder.rungs
            for step in sorted({each.step for each in walk(rung.body) if isinstance(each, Element)})]


def test_instructions_of_block_programs_show_whether_they_were_executed() -> None:
    """What only parts the program, and what makes no difference by itself, has no state: BEND, ELSE, IEND, LOOP."""
    executed = ["LD P_On", "BPRG 1", "++ D0", "IF a", "IFNOT a", "LD a", "IF", "WAIT a", "WAITNOT a", "EXIT a", "EXITNOT a",
                "TIMW 5 #1", "TMHWX 6 &1", "CNTW 7 #1 a", "CNTWX 8 &1 a", "BPPS 1", "BPRS 1", "LEND a", "SET a"]
    lines = ("LD P_On\nBPRG 1\n++ D0\nIF a\nELSE\nIEND\nIFNOT a\nIEND\nLD a\nIF\nIEND\nWAIT a\nWAITNOT a\nEXIT a\nEXITNOT a\n"
             "TIMW 5 #1\nTMHWX 6 &1\nCNTW 7 #1 a\nCNTWX 8 &1 a\nBPPS 1\nBPRS 1\nLOOP\nLEND a\nSET a\nBEND\n")
    assert states(lines) == executed


@pytest.mark.slow
def test_branches_of_block_programs_stand_in_each_other_253_deep() -> None:
    def messages(depth: int) -> list[str]:
        rungs = "LD P_On\nBPRG 1\n" + "IF a\n" * depth + "IEND\n" * depth + "BEND\n"
        text = f"PROGRAM Main\nVAR a : BOOL; END_VAR\nLADDER\n{rungs}END_LADDER\nEND_PROGRAM\n"
        return [f"{each.source.place(each.start)[0]} {each.message}" for each in parse(Source("x.st", text))[1]]

    assert messages(253) == []
    assert messages(254) == ["259 branches stand in each other more than 253 deep", "513 IEND without IF"]
