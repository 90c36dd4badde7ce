"""Which statements of an imported diagram stand among rungs that belong together."""

from __future__ import annotations

import pytest

from fbvm.interchange.plcopen.read.spans import divided


@pytest.mark.parametrize(("program", "places"), [
    ("LD a; IL | LD b; OUT c | ILC | - | LD d; OUT e", ()),
    ("LD a; IL | - | LD b; OUT c | ILC | -", (1,)),
    ("- | LD a; IL | LD b; OUT c | -", (3,)),
    ("FOR &2 | - | NEXT | -", (1,)),
    ("LD a; @JMP(004) #1 | - | JME 1 | - | LD b; JMP 2 | JME 2", (1,)),
    ("JME 03 | - | LD a; CJP 3 | -", (1,)),
    ("LD a; MILH 0 W0.00 | MILC 0 | - | LD a; MILR 1 W0.01 | - | MILC 1", (4,)),
    ("LD a; SBS 1 | - | SBN 1 | LD b; OUT c | RET | -", (1,)),
    ("SBN 1 | - | RET", (1,)),
    ("LD a; JMP0 | - | JME0", (1,)),
    ("- | LD a; OUT b | -", ()),
    ("- | LD a; OUT b | END | -", (0, 3)),
    ("LD a; TIM 3 #5 | - | LD a; TRSET T0003 | - | LD a; TIM 4 #5 | - | LD b; TIM 4 #6", (1,)),
    ("STEP W0.00 | - | LD a; SNXT W0.01", (1,)),
])  # fmt: skip
def test_statements_among_rungs_that_belong_together(program: str, places: tuple[int, ...]) -> None:
    rungs = [None if part.strip() == "-" else [step.strip() for step in part.split(";")] for part in program.split("|")]
    assert divided(rungs) == set(places)
