"""Two blocks beside each other: equal for all inputs, or the shortest run in which they are not."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.code.compiler import compile_sources
from fbvm.prove.equality import PROGRAM, Unlike, equality, pair
from fbvm.prove.prover import Limits, prove
from fbvm.prove.question import Verdict

BLOCKS = """
FUNCTION_BLOCK Latch VAR_INPUT S, R1 : BOOL; END_VAR VAR_OUTPUT Q1 : BOOL; END_VAR
IF R1 THEN Q1 := FALSE; ELSIF S THEN Q1 := TRUE; END_IF
END_FUNCTION_BLOCK
FUNCTION_BLOCK Dominant VAR_INPUT S, R1 : BOOL; END_VAR VAR_OUTPUT Q1 : BOOL; END_VAR
Q1 := S OR Q1 AND NOT R1;
END_FUNCTION_BLOCK
FUNCTION_BLOCK Adding VAR_INPUT n : INT; END_VAR VAR_OUTPUT sum : DINT; END_VAR sum := sum + n; END_FUNCTION_BLOCK
FUNCTION_BLOCK Subtracting VAR_INPUT n : INT; END_VAR VAR_OUTPUT sum : DINT; END_VAR
sum := sum - (0 - INT_TO_DINT(n));
END_FUNCTION_BLOCK
FUNCTION Larger : INT VAR_INPUT a, b : INT; END_VAR Larger := MAX(a, b); END_FUNCTION
FUNCTION Chosen : INT VAR_INPUT a, b : INT; END_VAR Chosen := SEL(a < b, a, b); END_FUNCTION
FUNCTION Smaller : INT VAR_INPUT a, b : INT; END_VAR Smaller := MIN(a, b); END_FUNCTION
FUNCTION_BLOCK Filled VAR_INPUT i : BYTE; END_VAR VAR_OUTPUT a : ARRAY [0..3] OF BOOL; r : REAL; END_VAR
a[BYTE_TO_INT(i AND 3)] := TRUE; r := SEL(i > 100, 1.5, 2.5);
END_FUNCTION_BLOCK
FUNCTION_BLOCK Listed VAR_INPUT i : BYTE; END_VAR VAR_OUTPUT a : ARRAY [0..3] OF BOOL; r : REAL; END_VAR
CASE BYTE_TO_INT(i) MOD 4 OF 0: a[0] := TRUE; 1: a[1] := TRUE; 2: a[2] := TRUE; ELSE a[3] := TRUE; END_CASE
IF i > 100 THEN r := 2.5; ELSE r := 1.5; END_IF
END_FUNCTION_BLOCK
"""


def compared(left: str, right: str) -> Verdict:
    sources = [Source("blocks.st", BLOCKS)]
    made = compile_sources([*sources, pair(sources, (left, right))], PROGRAM, runnable=True, lint=False)
    assert made.image is not None, made.diagnostics
    return prove(made.image, equality(made.image, (left, right)), Limits(simulated_scans=100))


@pytest.mark.slow
@each_of("left, right", [("Adding", "Subtracting"), ("Larger", "Chosen"), ("Filled", "Listed"), ("Latch", "RS")])
def test_what_is_equal_is_proved(left: str, right: str) -> None:
    verdict = compared(left, right)
    assert (verdict.word, verdict.notes) == ("proved", ()), verdict


@pytest.mark.slow
def test_the_shortest_difference_is_found() -> None:
    verdict = compared("Latch", "Dominant")
    assert verdict.run is not None
    assert [{place.name: value for place, value in scan.items()} for scan in verdict.run.writes] == [
        {"Equal.S": True, "Equal.R1": True}]
    assert compared("Larger", "Smaller").word == "broken"


@each_of("left, right, said", [("Latch", "Adding", "have other inputs"), ("Latch", "Nobody", "there is no Nobody"),
                               ("Larger", "Latch", "have other inputs")])  # fmt: skip
def test_blocks_that_cannot_be_compared_are_refused(left: str, right: str, said: str) -> None:
    with pytest.raises(Unlike, match=said):
        compared(left, right)


def test_the_program_that_calls_both_sides() -> None:
    blocks = """FUNCTION_BLOCK One VAR_INPUT i : INT; j : BOOL; END_VAR VAR_OUTPUT q : BOOL; END_VAR VAR_IN_OUT io : INT; END_VAR
END_FUNCTION_BLOCK
FUNCTION_BLOCK Two VAR_INPUT I, J : SINT; END_VAR VAR_OUTPUT Q : BOOL; END_VAR VAR_IN_OUT IO : DINT; END_VAR END_FUNCTION_BLOCK
FUNCTION F : INT VAR_INPUT i : INT; END_VAR VAR_OUTPUT q : BOOL; END_VAR VAR_IN_OUT io : REAL; END_VAR END_FUNCTION
FUNCTION G : DINT VAR_INPUT i : INT; END_VAR VAR_OUTPUT q : BYTE; END_VAR VAR_IN_OUT io : LREAL; END_VAR END_FUNCTION
FUNCTION H VAR_INPUT i : INT; END_VAR VAR_OUTPUT q : BOOL; END_VAR END_FUNCTION
PROGRAM P END_PROGRAM"""
    sources = [Source("blocks.st", blocks)]
    assert pair(sources, ("One", "Two")).text.split("\n") == [
        "PROGRAM Equal", "VAR_INPUT", "    i : INT;", "    j : BOOL;", "END_VAR", "VAR", "    Left_io : INT;", "    Left : One;",
        "    Right_IO : DINT;", "    Right : Two;", "END_VAR", "    Left(i := i, j := j, io := Left_io);",
        "    Right(I := I, J := J, IO := Right_IO);", "END_PROGRAM", ""]  # fmt: skip
    assert pair(sources, ("F", "G")).text.split("\n") == [
        "PROGRAM Equal", "VAR_INPUT", "    i : INT;", "END_VAR", "VAR", "    Left_io : REAL;", "    Left_q : BOOL;",
        "    Left_Result : INT;", "    Right_io : LREAL;", "    Right_q : BYTE;", "    Right_Result : DINT;", "END_VAR",
        "    Left_Result := F(i := i, io := Left_io, q => Left_q);",
        "    Right_Result := G(i := i, io := Right_io, q => Right_q);", "END_PROGRAM", ""]  # fmt: skip
    assert "    Left_Result : BOOL;\n" in pair(sources, ("H", "H")).text
    assert "    H(i := i, q => Left_q);\n" in pair(sources, ("H", "H")).text
    for names, said in ((("One", "F"), "One and F have other inputs: i, j; i"),
                        (("F", "H"), "F and H have other in-outs: io; none"),
                        (("P", "One"), "P is a PROGRAM: --equal compares function blocks and functions"),
                        (("One", "Nobody"), "there is no Nobody in the files, nor in a library")):  # fmt: skip
        with pytest.raises(Unlike) as refused:
            pair(sources, names)
        assert str(refused.value) == said


@pytest.mark.slow
@each_of("left, right, said", [
    ("Same", "Given", "Same is a FUNCTION_BLOCK, Given a FUNCTION"),
    ("Silent", "Quiet", "Silent and Quiet have 0 outputs to compare; 1 to 400 are possible"),
    ("Many", "Many", "Many and Many have 401 outputs to compare; 1 to 400 are possible"),
])
def test_blocks_without_outputs_to_compare_are_refused(left: str, right: str, said: str) -> None:
    sources = [Source("blocks.st", """
        FUNCTION_BLOCK Same VAR_INPUT i : INT; END_VAR END_FUNCTION_BLOCK
        FUNCTION Given : INT VAR_INPUT i : INT; END_VAR Given := i; END_FUNCTION
        FUNCTION_BLOCK Silent VAR_INPUT i : INT; END_VAR END_FUNCTION_BLOCK
        FUNCTION_BLOCK Quiet VAR_INPUT i : INT; END_VAR END_FUNCTION_BLOCK
        FUNCTION_BLOCK Many VAR_INPUT i : INT; END_VAR VAR_OUTPUT a : ARRAY [0..400] OF INT; END_VAR END_FUNCTION_BLOCK""")]
    with pytest.raises(Unlike) as refused:
        made = compile_sources([*sources, pair(sources, (left, right))], PROGRAM, runnable=True, lint=False)
        assert made.image is not None
        equality(made.image, (left, right))
    assert str(refused.value) == said


def test_the_members_of_structures_are_compared_one_by_one_and_reals_also_as_no_number() -> None:
    sources = [Source("blocks.st", """TYPE Pair : STRUCT n : INT; r : LREAL; END_STRUCT END_TYPE
        FUNCTION_BLOCK One VAR_INPUT i : INT; END_VAR VAR_OUTPUT p : Pair; END_VAR END_FUNCTION_BLOCK""")]
    made = compile_sources([*sources, pair(sources, ("One", "One"))], PROGRAM, runnable=True, lint=False)
    assert made.image is not None
    asked = equality(made.image, ("One", "One"), ("i > 0",))
    assert (asked.kind, asked.assumptions, asked.prefix, asked.title) == ("always", ("i > 0",), "Equal.", "One and One are equal")
    assert asked.text == ("Equal.Left.p.n = Equal.Right.p.n AND (Equal.Left.p.r = Equal.Right.p.r OR "
                          "Equal.Left.p.r <> Equal.Left.p.r AND Equal.Right.p.r <> Equal.Right.p.r)")
