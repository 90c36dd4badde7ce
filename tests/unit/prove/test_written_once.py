"""Outputs that two statements write in one scan: what the encoder says of it is what the engine does."""

from __future__ import annotations

from random import Random

import pytest

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.prove.prover import Limits, prove
from fbvm.prove.question import WRITTEN_ONCE, Names, Question, Verdict
from fbvm.prove.ready import written_once
from fbvm.record.trace.writes import noting_writes
from fbvm.watch.paths import UnknownPlace

FEW = Limits(simulated_scans=100, scans=40)
INPUTS = "In AT %IX0.0 : BOOL; Other AT %IX0.1 : BOOL; Level AT %IB1 : SINT;"
PARTS = """FUNCTION_BLOCK Setter
VAR_INPUT Go : BOOL; END_VAR VAR_IN_OUT Lamp : BOOL; END_VAR
    IF Go THEN Lamp := TRUE; RETURN; END_IF
    Lamp := FALSE;
END_FUNCTION_BLOCK
FUNCTION Put : BOOL
VAR_INPUT Go : BOOL; END_VAR VAR_IN_OUT Lamp : BOOL; END_VAR
    IF Go THEN Lamp := TRUE; END_IF
    Put := Go;
END_FUNCTION
FUNCTION_BLOCK Source
VAR_INPUT Go : BOOL; END_VAR VAR_OUTPUT Q : BOOL; END_VAR
    Q := Go;
END_FUNCTION_BLOCK
"""


def image_of(body: str, variables: str) -> Image:
    image = compile_text(f"{PARTS}PROGRAM Main\nVAR {INPUTS} {variables} END_VAR\n{body}\nEND_PROGRAM\n").image
    assert image is not None
    return image


def asked(image: Image, name: str) -> Verdict:
    return prove(image, Question(WRITTEN_ONCE, name), FEW)


def doubles(image: Image, name: str, scans: int) -> int:
    """In how many scans of a random run two statements write the same bit."""
    plc, random, found = Plc(image, engine="python"), Random(name), 0
    with noting_writes(plc, Names(image).places(name)) as writes:
        for _ in range(scans):
            plc.write("Main.In", random.random() < 0.5)
            plc.write("Main.Other", random.random() < 0.5)
            plc.write("Main.Level", random.randrange(-4, 5))
            assert plc.scan() is None
            found += bool(writes.twice())
    return found


ROWS = [
    ("two branches", "IF In THEN Q := TRUE; ELSE Q := FALSE; END_IF", "Q : BOOL;", "Main.Q", True),
    ("a second thought", "Q := In; IF Other THEN Q := FALSE; END_IF", "Q : BOOL;", "Main.Q", False),
    ("conditions that exclude each other", "IF In THEN Q := Other; END_IF IF NOT In THEN Q := FALSE; END_IF", "Q : BOOL;",
     "Main.Q", True),
    ("early return", "IF In THEN Q := TRUE; RETURN; END_IF Q := Other;", "Q : BOOL;", "Main.Q", True),
    ("a loop is one statement", "FOR i := 0 TO 3 DO a[0] := i; END_FOR", "i : INT; a : ARRAY[0..3] OF INT;", "Main.a", True),
    ("other elements", "a[0] := 1; a[1] := 2;", "a : ARRAY[0..3] OF INT;", "Main.a", True),
    ("an index that may meet", "a[0] := 1; a[LIMIT(0, Level, 3)] := 2;", "a : ARRAY[0..3] OF INT;", "Main.a", False),
    ("an index that never meets", "a[0] := 1; a[LIMIT(1, Level, 3)] := 2;", "a : ARRAY[0..3] OF INT;", "Main.a", True),
    ("a store that changes its own index", "a[0] := 0; a[a[0]] := 2; a[2] := 1;", "a : ARRAY[0..3] OF INT;", "Main.a[2]", True),
    ("bits of a word", "w := 0; b := In;", "w AT CIO 100 : WORD; b AT CIO 100.03 : BOOL;", "CIO 100", False),
    ("other bits of a word", "b := In; c := In;", "b AT CIO 100.03 : BOOL; c AT CIO 100.04 : BOOL;", "CIO 100", True),
    ("in a reference", "s(Go := In, Lamp := Q); s(Go := In, Lamp := P);", "s : Setter; P, Q : BOOL;", "Main.Q", True),
    ("in a reference and here", "s(Go := In, Lamp := Q); IF In THEN Q := FALSE; END_IF", "s : Setter; Q : BOOL;",
     "Main.Q", False),
    ("two instances", "s(Go := In, Lamp := Q); t(Go := In, Lamp := Q);", "s, t : Setter; Q : BOOL;", "Main.Q", False),
    ("two calls of one instance", "s(Go := In, Lamp := Q); s(Go := In, Lamp := Q);", "s : Setter; Q : BOOL;", "Main.Q", False),
    ("instances that take turns", "IF In THEN s(Lamp := Q); ELSE t(Lamp := Q); END_IF", "s, t : Setter; Q : BOOL;",
     "Main.Q", True),
    ("instances of an array", "FOR i := 0 TO 1 DO s[i](Lamp := Q); END_FOR", "s : ARRAY[0..1] OF Setter; i : INT; Q : BOOL;",
     "Main.Q", False),
    ("a function that is called twice", "a := Put(In, Q); a := Put(In, Q);", "a, Q : BOOL;", "Main.Q", False),
    ("an output of a call", "s(Go := In, Q => Q); IF Other THEN Q := FALSE; END_IF", "s : Source; Q : BOOL;", "Main.Q", False),
    ("a structure as a whole", "s := t; s.Run := In;", "s, t : STRUCT Run, Stop : BOOL; END_STRUCT;", "Main.s.Run", False),
    ("another part of it", "s := t; s.Run := In;", "s, t : STRUCT Run, Stop : BOOL; END_STRUCT;", "Main.s.Stop", True),
    ("the same value", "Q := In; Q := In;", "Q : BOOL;", "Main.Q", False),
    ("in the third scan", "n := n + 1; Q := In; IF n = 3 THEN Q := TRUE; END_IF", "n : INT; Q : BOOL;", "Main.Q", False),
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("about", "body", "variables", "name", "once"), ROWS, ids=[row[0] for row in ROWS])
def test_the_encoder_and_the_engine_agree(about: str, body: str, variables: str, name: str, once: bool) -> None:
    image = image_of(body, variables)
    verdict = asked(image, name)
    assert verdict.word == ("proved" if once else "broken"), about
    assert (doubles(image, name, 200) == 0) is once
    if verdict.run is not None:
        assert len(verdict.run.writers) == 2


def test_both_statements_are_told_of_the_shortest_run() -> None:
    verdict = asked(image_of("n := n + 1; Q := In;\nIF n = 3 THEN\n    Q := TRUE;\nEND_IF", "n : INT; Q : BOOL;"), "Main.Q")
    assert verdict.run is not None
    assert (verdict.run.scans, [place.split(":")[1] for place in verdict.run.writers]) == (3, ["17", "19"])


def test_one_statement_in_two_instances_is_told_with_its_calls() -> None:
    verdict = asked(image_of("s(Go := In, Lamp := Q);\nt(Go := In, Lamp := Q);", "s, t : Setter; Q : BOOL;"), "Main.Q")
    assert verdict.run is not None
    inner = [place.split(", called by ") for place in verdict.run.writers]
    assert inner[0][0] == inner[1][0]
    assert [place.split(":")[1] for _, place in inner] == ["17", "18"]


def test_two_coils_of_one_output_are_a_double_write() -> None:
    coils = "LD In\nOUT Q\nLDNOT In\nOUT Q"
    variables = "VAR In AT %IX0.0 : BOOL; Q : BOOL; END_VAR"
    image = compile_text(f"PROGRAM Main\n{variables}\nLADDER\n{coils}\nEND_LADDER\nEND_PROGRAM\n").image
    assert image is not None
    assert asked(image, "Main.Q").word == "broken"


def test_an_output_that_nobody_writes_is_told() -> None:
    verdict = asked(image_of("Q := In;", "P, Q : BOOL;"), "Main.P")
    assert (verdict.word, verdict.notes) == ("proved", ("no statement writes Main.P",))


def test_names_are_asked_one_by_one() -> None:
    names = Names(image_of("Q := In;", "P, Q : BOOL; r : REF_TO INT;"))
    assert [str(each) for each in written_once(names, "Main.P, CIO 100..CIO 102")] == [
        "written once Main.P", "written once CIO 100..CIO 102"]
    for text in ("Main.P,Nobody", "Main.r^", ""):
        with pytest.raises(UnknownPlace):
            written_once(names, text)
