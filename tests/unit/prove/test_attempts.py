"""What is caught by __TRY goes on in a proof as on a PLC."""

from __future__ import annotations

import pytest
from rows import each_of
from test_prover import FEW, image_of

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.prove.prover import prove
from fbvm.prove.question import NEVER, NO_TRAP, REACH, Question
from fbvm.prove.runs import repeated

GUARDED = """FUNCTION Ratio : INT
VAR_INPUT a, b : INT; END_VAR
    Ratio := a / b;
END_FUNCTION
PROGRAM Main
VAR_INPUT a, b : INT; go : BOOL; END_VAR
VAR r, k : INT; code : __SYSTEM.ExceptionCode; faults, finals : INT; x : ARRAY[1..3] OF INT; END_VAR
    __TRY
        k := 1;
        r := Ratio(a, b);
        k := 2;
        x[a] := r;
        k := 3;
    __CATCH(code)
        IF faults < 100 THEN faults := faults + 1; END_IF
        k := -k;
        IF go THEN RETURN; END_IF
    __FINALLY
        IF finals < 50 THEN finals := finals + 1; END_IF
    __ENDTRY
    k := k * 10;
END_PROGRAM"""
REACHED = {
    "Main.k = -10": 1, "Main.k = -2": 1, "Main.k = -1 AND Main.go": 1, "Main.k = 30 AND Main.a = 2": 1,
    "Main.code = RTSEXCPT_ARRAYBOUNDS AND Main.faults = 1 AND Main.r = 7": 1, "Main.faults = 3": 3,
    "Main.k = 0": 0, "Main.k = -20 AND Main.b = 0": 0, "Main.k = 30 AND Main.a > 3": 0, "Main.faults > Main.finals": 51,
    "Main.k = -1 AND NOT Main.go": 0,
}  # fmt: skip
"""Scans after which a condition can hold, 0 for never."""


@pytest.mark.slow
@each_of("condition", REACHED)
def test_paths_through_what_is_caught_are_those_of_the_engine(condition: str) -> None:
    image = image_of(GUARDED)
    verdict = prove(image, Question(REACH, condition, ()), FEW)
    assert (verdict.word, verdict.run.scans if verdict.run else 0) == (
        "reached" if REACHED[condition] else "unreachable", REACHED[condition])  # fmt: skip
    if verdict.run:
        plc = Plc(image, verdict.run.cycle_ns)
        repeated(plc, verdict.run)
        assert plc.scans == REACHED[condition]


RAISING = """PROGRAM Main
VAR_INPUT a : UDINT; END_VAR
VAR code : __SYSTEM.ExceptionCode; seen : UDINT; END_VAR
    __TRY
        seen := 1;
        IF a > 10 THEN F_RaiseException(a + 5); END_IF
    __CATCH(code)
        seen := code;
    __ENDTRY
END_PROGRAM"""


def test_a_raised_number_is_what_the_handler_gets_in_proofs_too() -> None:
    image = compile_text(RAISING, dialect="twincat").image
    assert image is not None
    conditions = ("Main.seen = 16 AND Main.a = 11", "Main.seen = 15", "Main.seen = 16#FFFFFFFF AND Main.a = 16#FFFFFFFC")
    assert [prove(image, Question(REACH, each, ()), FEW).word == "reached" for each in conditions] == [True, False, True]
    assert prove(image, Question(NO_TRAP, "", ()), FEW).word == "proved"


def test_what_is_caught_is_no_trap_and_what_is_not_is_one() -> None:
    assert prove(image_of(GUARDED), Question(NO_TRAP, "", ()), FEW).word == "proved"
    broken = GUARDED.replace("k := -k;", "k := -k / b;")
    assert prove(image_of(broken), Question(NO_TRAP, "", ()), FEW).word == "broken"


def test_loops_and_attempts_inside_others() -> None:
    image = image_of("""PROGRAM Main
VAR_INPUT z : INT(0..3); END_VAR
VAR i, n, inner, outer : INT; one, two : __SYSTEM.ExceptionCode; a : ARRAY[1..3] OF INT; END_VAR
    n := 0; inner := 0; outer := 0;
    FOR i := 1 TO 3 DO
        __TRY
            __TRY
                n := n + 6 / z;
                IF z = 3 THEN EXIT; END_IF
            __CATCH(one)
                inner := inner + 1;
                a[i + 1] := 1;
            __ENDTRY
            IF z = 2 THEN CONTINUE; END_IF
            outer := outer + 10;
        __CATCH(two)
            outer := outer + 100;
        __ENDTRY
        n := n + 1;
    END_FOR
END_PROGRAM""")
    wanted = {0: (3, 3, 120), 1: (21, 0, 30), 2: (9, 0, 0), 3: (2, 0, 0)}
    holds = " AND ".join(f"(Main.z <> {z} OR (Main.n = {n} AND Main.inner = {inner} AND Main.outer = {outer}))"
                         for z, (n, inner, outer) in wanted.items())  # fmt: skip
    assert prove(image, Question(NEVER, f"NOT ({holds})", ()), FEW).word == "proved"


def test_each_instance_has_its_own() -> None:
    image = image_of("""FUNCTION_BLOCK Divider
VAR_INPUT by_ : INT; END_VAR
VAR q : INT; code : __SYSTEM.ExceptionCode; END_VAR
    __TRY q := 10 / by_; __CATCH(code) q := 0; __ENDTRY
END_FUNCTION_BLOCK
PROGRAM Main
VAR_INPUT i : INT(0..2); END_VAR
VAR d : ARRAY[0..2] OF Divider; END_VAR
    d[1](by_ := i); d[i](by_ := i);
END_PROGRAM""")
    assert prove(image, Question(NEVER, "Main.d[1].q = 3", ()), FEW).word == "proved"
    assert prove(image, Question(REACH, "Main.d[1].q = 0 AND Main.d[2].q = 5", ()), FEW).word == "reached"
