"""Which statements of an imported diagram stand among rungs that belong together."""

from __future__ import annotations

import pytest

from fbvm.base.diagnostics import Source
from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.interchange.plcopen.read.spans import divided
from fbvm.interchange.plcopen.write.exporting import export_xml


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


@pytest.mark.slow
def test_a_network_that_is_no_rung_is_not_executed_within_an_interlock() -> None:
    rungs = "RUNG 1\nLD a\nIL\nRUNG 2 between\nLD b\nOUT c\nRUNG 3\nILC\n"
    declared = "VAR a, b, c : BOOL; v : ARRAY[0..3] OF BOOL; n : INT; END_VAR"
    source = f"PROGRAM Main\n{declared}\nLADDER\n{rungs}END_LADDER\nEND_PROGRAM\n"
    text = export_xml([Source("Main.st", source)]).text
    assert text is not None
    made = import_xml(text.replace("<variable>b</variable>", "<variable>v[n + 1]</variable>").encode())
    lines = [" ".join(line.split()) for line in made.files["Main.st"].splitlines()]
    assert lines[lines.index("LADDER"):] == [
        "LADDER", "RUNG 1", "LD a", "IL", "END_LADDER", "// between", "// network 2 was not taken over", "LADDER",
        "RUNG 2", "ILC", "END_LADDER", "END_PROGRAM"]  # fmt: skip
    [error] = made.errors
    assert error.code == "X0202" and "stands among rungs that belong together" in error.message
