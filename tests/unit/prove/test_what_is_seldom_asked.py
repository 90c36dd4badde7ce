"""Programs and questions that are seldom: tasks of events, inputs that are bits, what is refused or taken for any value, and what
limits an answer."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import pairwise
from random import Random
from typing import Any

import pytest
from rows import each_of
from test_prover import image_of

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import STEP_BUDGET
from fbvm.prove import prover as prover_module
from fbvm.prove.bounded import BoundedSearch, Inputs
from fbvm.prove.encoding import execution, summary
from fbvm.prove.encoding.execution import Refused
from fbvm.prove.encoding.summary import summarize
from fbvm.prove.encoding.terms import Terms
from fbvm.prove.invariants import Invariants
from fbvm.prove.prover import Limits, Prover, SpuriousRun, prove
from fbvm.prove.question import ALWAYS, NEVER, NO_TRAP, REACH, Names, Question, Verdict
from fbvm.prove.ready import handshake
from fbvm.prove.report import headline
from fbvm.prove.runs import Judge, Machine, inputs_of, replayed, sampled
from fbvm.prove.shortening import shortened
from fbvm.prove.solver import UNKNOWN, Solver
from fbvm.watch.paths import UnknownPlace

MS = 1_000_000
FEW = {"scans": 12, "simulated_scans": 20}
EVENT = """PROGRAM Main VAR n : INT; END_VAR IF n < 3 THEN n := n + 1; END_IF END_PROGRAM
CONFIGURATION C VAR_GLOBAL Go AT %IX0.0 : BOOL; END_VAR RESOURCE R ON PLC
TASK T(SINGLE := Go, PRIORITY := 1); PROGRAM p WITH T : Main; END_RESOURCE END_CONFIGURATION"""
BITS = """PROGRAM Main
VAR_INPUT a AT CIO 0.01 : BOOL; b AT CIO 1.00 : ARRAY[0..3] OF BOOL; c : BOOL; END_VAR VAR n : INT; END_VAR
    n := BOOL_TO_INT(a) + BOOL_TO_INT(b[2]) + BOOL_TO_INT(c);
END_PROGRAM"""
OVERWRITTEN = "PROGRAM Main VAR_INPUT a : INT; END_VAR VAR n : INT; END_VAR a := a MOD 3; n := a; END_PROGRAM"


def compiled(text: str, dialect: str = "codesys") -> Image:
    image = compile_text(text, dialect=dialect, lint=False).image
    assert image is not None
    return image


def asked(text: str, question: Question, dialect: str = "standard", **limits: Any) -> Verdict:
    return prove(compiled(text, dialect), question, Limits(**{**FEW, **limits}))


def shown(verdict: Verdict) -> tuple[str, list[dict[str, object]]]:
    """The sentence behind the colon, and what is written before each scan."""
    writes = verdict.run.writes if verdict.run else ()
    return headline(verdict).partition(": ")[2], [{place.name: value for place, value in now.items()} for now in writes]


@pytest.mark.slow
@each_of(("text", "question", "said", "writes"), [
    ("PROGRAM Main VAR_INPUT w : WORD; END_VAR VAR n : INT; END_VAR IF w.12 AND NOT w.4 AND w.8 THEN n := 1; END_IF END_PROGRAM",
     Question(REACH, "Main.n = 1"), "REACHED after 1 scan, by the shortest run", [{"Main.w.8": True, "Main.w.12": True}]),
    (EVENT, Question(REACH, "p.n = 1"), "REACHED after 1 scan, by the shortest run", [{"Go": True}]),
    (EVENT, Question(REACH, "p.n = 2"), "REACHED after 3 scans, by the shortest run",
     [{"Go": True}, {"Go": False}, {"Go": True}]),
    (EVENT, Question(NEVER, "p.n > 3"), "PROVED by induction over 1 scan", []),
    (BITS, Question(REACH, "Main.n = 3"), "REACHED after 1 scan, by the shortest run",
     [{"Main.a": True, "CIO 1.02": True, "Main.c": True}]),
    (OVERWRITTEN, Question(NEVER, "Main.n > 2"), "PROVED by induction over 1 scan", []),
    (OVERWRITTEN, Question(REACH, "Main.n = 2 AND Main.a = 2"), "REACHED after 1 scan, by the shortest run", [{"Main.a": 2}]),
])  # fmt: skip
def test_tasks_of_events_and_inputs_of_every_kind(
    text: str, question: Question, said: str, writes: list[dict[str, object]]
) -> None:
    for limits in ({}, {"longest_ns": 30 * MS})[: 2 if text == EVENT else 1]:
        found, wrote = shown(asked(text, question, **limits))
        assert found == said and [*map(set, wrote)] == [*map(set, writes)], (limits, wrote)


FRESH = """PROGRAM Main VAR First AT A200.15 : BOOL; n, m : INT; END_VAR
    IF First THEN n := n + 1; END_IF IF m < 3 THEN m := m + 1; END_IF END_PROGRAM
CONFIGURATION C VAR_GLOBAL Go AT %IX0.0 : BOOL; END_VAR RESOURCE R ON PLC
TASK T(SINGLE := Go, PRIORITY := 1); PROGRAM p WITH T : Main; END_RESOURCE END_CONFIGURATION"""


@pytest.mark.slow
def test_the_first_cycle_of_a_task_of_an_event_is_its_first_one() -> None:
    assert shown(asked(FRESH, Question(REACH, "p.n = 1")))[0] == "REACHED after 1 scan, by the shortest run"
    assert shown(asked(FRESH, Question(REACH, "p.n = 1 AND p.m = 2")))[0] == "REACHED after 3 scans, by the shortest run"


NOTHING = "a run of 1 scans may get there, but does not on the engine: it depends on values of which the solver knows nothing"


@pytest.mark.slow
@each_of(("text", "dialect", "unknown"), [
    ("PROGRAM Main VAR_INPUT b : BYTE; END_VAR VAR s : STRING[4] := 'abc'; n : INT; END_VAR s[0] := b; n := LEN(s); END_PROGRAM",
     "codesys", ["text of STRING", "length of STRING"]),
    ("PROGRAM Main VAR_INPUT b : INT; END_VAR VAR n : INT; END_VAR n := REAL_TO_INT(INT_TO_REAL(b) / 3.0); END_PROGRAM",
     "standard", ["convert of REAL", "div of REAL", "nearest of REAL"]),
    ("PROGRAM Main VAR_INPUT b : INT; END_VAR VAR n : INT; END_VAR n := LREAL_TO_INT(SQRT(INT_TO_LREAL(b))); END_PROGRAM",
     "standard", ["convert of LREAL", "math of LREAL", "nearest of LREAL"]),
    ("PROGRAM Main VAR_INPUT b : WORD; END_VAR VAR s : WSTRING[4] := \"abc\"; n : INT; END_VAR "
     "s[0] := b; n := LEN(s); END_PROGRAM",
     "codesys", ["text of WSTRING", "length of WSTRING"]),
    ("PROGRAM Main VAR_INPUT b : INT; END_VAR VAR n : INT; END_VAR n := STRING_TO_INT(INT_TO_STRING(b)); END_PROGRAM",
     "standard", ["to_text of STRING", "from_text of STRING"]),
])
def test_what_is_taken_for_any_value_is_said(text: str, dialect: str, unknown: list[str]) -> None:
    verdict = asked(text, Question(NEVER, "Main.n > 4"), dialect)
    assert shown(verdict)[0] == f"UNDECIDED {NOTHING}"
    [note] = verdict.notes
    head, _, rows = note.partition(": ")
    assert head == "taken for any value" and [row.partition(" (")[0] for row in rows.split("), ")] == unknown


REALS = "PROGRAM Main VAR_INPUT i : INT; END_VAR VAR r : REAL; s : STRING; t : TIME; n : INT; END_VAR n := i; END_PROGRAM"
PLACES = """PROGRAM Main VAR_INPUT i, j, k : INT(0..40); END_VAR VAR a : ARRAY[0..40, 0..40, 0..40] OF INT; n : INT; END_VAR
    a[i, j, k] := 1; END_PROGRAM"""
FEW_PLACES = """PROGRAM Main VAR_INPUT i : DINT(0..3); END_VAR VAR a : ARRAY[0..3] OF INT; p : POINTER TO INT; n : INT; END_VAR
    p := ADR(a) + i; n := p^; END_PROGRAM"""
NO_WHOLE = "cannot be followed: compare whole numbers with a whole number"


@pytest.mark.slow
@each_of(("text", "condition", "dialect", "said"), [
    (REALS, "Main.r + 1.0 > 2.0", "standard", f"Main.r + 1.0 > 2.0 {NO_WHOLE}"),
    (REALS, "Main.n > Main.r + 1", "standard", f"Main.n > Main.r + 1 {NO_WHOLE}"),
    (REALS, "Main.n > 1.5", "standard", f"Main.n > 1.5 {NO_WHOLE}"),
    (REALS, "Main.t * Main.r > T#1s", "standard", "Main.r is REAL, which cannot be followed"),
    (REALS, "Main.t * (Main.r + 1.0) > T#1s", "standard", "Main.r + 1.0 is arithmetic of REAL, of which nothing is known"),
    (REALS, "Main.s = 'a'", "standard", "Main.s is STRING[80], and texts cannot be followed"),
    (REALS, "Main.n + 1.5 > 2", "standard", f"Main.n + 1.5 > 2 {NO_WHOLE}"),
    (REALS, "Main.t * 1.5 > T#1s", "standard", "1.5 is no whole number, and only whole numbers can be followed"),
    (REALS, "Main.r = Main.n", "standard", "Main.n cannot be followed: compare a REAL with one of its type, or with a number"),
    (PLACES, "Main.n > 4", "standard", "an index chooses from more than 4096 places"),
    ("PROGRAM Main VAR_INPUT i : INT; END_VAR VAR a : ARRAY[0..30000] OF INT; n : INT; END_VAR a[i] := 1; END_PROGRAM",
     "Main.n > 4", "standard", "an index has no bounds that could be followed"),
    (FEW_PLACES, "Main.n > 4", "codesys", "a pointer may point to too many places"),
    ("FUNCTION F : INT VAR_INPUT a : INT; END_VAR WHILE TRUE DO F := a; END_WHILE END_FUNCTION "
     "PROGRAM Main VAR_INPUT i : INT; END_VAR VAR n : INT; END_VAR n := F(i); END_PROGRAM", "Main.n > 4", "standard",
     "each run ends in a trap"),
    ("FUNCTION F : INT VAR_INPUT a : INT; END_VAR WHILE TRUE DO F := a; END_WHILE END_FUNCTION "
     "PROGRAM Main VAR_INPUT i : BOOL; END_VAR VAR n : INT; END_VAR IF i THEN n := F(n); END_IF END_PROGRAM", "Main.n > 4",
     "standard", "a call never ends"),
])  # fmt: skip
def test_what_cannot_be_followed_is_refused_in_words(text: str, condition: str, dialect: str, said: str) -> None:
    with pytest.raises(Refused) as refused:
        asked(text, Question(NEVER, condition), dialect)
    assert str(refused.value).partition(" (")[0] == said


COUNTER = """PROGRAM Main VAR In AT %IX0.0 : BOOL; n, m, d : DINT; END_VAR
    IF In THEN n := n + 1; m := m + 2; END_IF
    IF n > 1000 THEN n := 0; m := 0; END_IF
    d := 100 / (n - 9);
END_PROGRAM"""


@pytest.mark.slow
def test_a_random_run_that_is_longer_than_is_searched_is_told_as_it_is() -> None:
    verdict = asked(COUNTER, Question(REACH, "Main.n = 6"), scans=3, simulated_scans=400)
    assert shown(verdict)[0].startswith("REACHED after ") and shown(verdict)[0].endswith("by a run that may not be the shortest")
    assert verdict.run is not None and verdict.run.scans >= 6


def prover_of(question: Question, **limits: Any) -> Prover:
    return Prover(image_of(COUNTER), question, Limits(**{**FEW, **limits}), lambda said: None)


@pytest.mark.slow
def test_a_lemma_is_proved_together_with_assumptions_about_the_state() -> None:
    double = "Main.m = 2 * Main.n AND Main.n >= 0 AND Main.n <= 1000"
    question = Question(NEVER, "Main.m > 2001", ("Main.d < 1000", "NOT Main.In OR Main.n <> 9"), lemmas=(double,))
    prover = prover_of(question)
    assert sorted(prover.lemmas.values()) == ["", "", double], "the assumption about the state, the property, the lemma"


@pytest.mark.slow
@each_of(("asks", "how"), [
    (0, "the time is over, and no scan has been searched to its end"), (60, "the time is over: no run of 4 scans gets there")])
def test_how_far_it_came_is_said_when_the_time_is_over(asks: int, how: str) -> None:
    left = [asks]

    def expired() -> bool:
        left[0] -= 1
        return left[0] < 0

    verdict = prove(image_of(COUNTER), Question(NEVER, "Main.m > 2001"), Limits(**FEW, expired=expired))
    assert (verdict.word, verdict.how) == ("undecided", how)


@pytest.mark.slow
def test_an_answer_that_the_solver_does_not_give_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    prover = prover_of(Question(NEVER, "Main.n > 2"))
    monkeypatch.setattr(Solver, "ask", lambda self, *some: UNKNOWN)
    search = BoundedSearch(prover.summary, prover.goal, prover.clock, lambda: False)
    assert search.until(10) is None and search.cleared == 0
    state = list(prover.summary.cells)
    invariants = Invariants(prover.summary, state, prover.goal.stop, prover.goal.given, prover.clock, lambda: False)
    assert invariants.kept([]) is None


@pytest.mark.slow
def test_a_run_of_the_solver_that_the_engine_does_not_do_is_a_defect_that_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prover_module, "replayed", lambda *run: None)
    with pytest.raises(SpuriousRun, match=r"the solver's run of 3 scans does not do on the engine what the solver says"):
        prove(image_of(COUNTER), Question(REACH, "Main.n = 3"), Limits(scans=12, simulated_scans=0))


def run_of(*ins: bool) -> tuple[Machine, Callable[[Question], Judge], Inputs]:
    """A run of the counter with these inputs."""
    image: Image = image_of(COUNTER)
    machine = Machine(image, 10 * MS, 10 * MS, STEP_BUDGET)
    prover = prover_of(Question(NEVER, "Main.n > 2"))
    [cell] = [cell for cell in prover.inputs if cell.offset == machine.plc().find("%IX0.0").offset]  # type: ignore[union-attr]
    return machine, lambda question: Judge.of(image, question), Inputs(
        [{cell: int(value)} for value in ins], [10 * MS * number for number in range(len(ins))])  # fmt: skip


@pytest.mark.slow
@each_of(("question", "ins", "scans"), [
    (Question(REACH, "Main.n = 2"), (True, False, True), 3), (Question(REACH, "Main.n = 2"), (True, True, True), 0),
    (Question(REACH, "Main.n = 3"), (True, False, True), 0), (Question(NO_TRAP), (True,) * 9, 9),
    (Question(REACH, "Main.n = 20"), (True,) * 12, 0), (Question(ALWAYS, "Main.n < 2"), (True, True), 2),
    (Question(REACH, "Main.n = 2", ("NOT Main.In OR Main.n <> 1",)), (True, False, True), 0),
    (Question(REACH, "Main.n = 2", ("Main.n < 3",)), (True, False, True), 3),
])  # fmt: skip
def test_a_run_is_replayed_to_its_goal_and_no_further(question: Question, ins: tuple[bool, ...], scans: int) -> None:
    machine, judge, inputs = run_of(*ins)
    run = replayed(machine, judge(question), inputs, True)
    assert (run.scans if run else 0) == scans
    if run:
        assert run.times_ns == tuple(inputs.times_ns)
        again = inputs_of(machine, run)
        pressed = [before or after for before, after in zip((False, *ins), ins, strict=False) if before != after]
        assert [*map(len, again.values)] == [int(before != after) for before, after in zip((False, *ins), ins, strict=False)]
        assert len(pressed) == sum(map(len, run.writes))


@pytest.mark.slow
@each_of(("question", "ins", "wanted"), [
    (Question(REACH, "Main.n = 2"), (False, True, False, False, True, False), 2),
    (Question(REACH, "Main.n = 2"), (False,) * 4, 4),
    (Question(NO_TRAP), (False, True) * 12, 9), (Question(REACH, "Main.n = 20"), (True,) * 12, 12),
    (Question(REACH, "Main.n = 2", ("NOT Main.In OR Main.n <> 1",)), (False, True, True), 3),
])  # fmt: skip
def test_a_run_is_made_shorter_as_long_as_it_gets_there(question: Question, ins: tuple[bool, ...], wanted: int) -> None:
    machine, judge, inputs = run_of(*ins)
    assert len(shortened(machine, judge(question), inputs, lambda: False)) == wanted


@pytest.mark.slow
@each_of(("assumed", "least", "most"), [((), 120, 120), (("Main.n < 5",), 6, 119), (("Main.n = 77",), 0, 0)])
def test_states_are_sampled_as_long_as_runs_do_not_trap_and_keep_the_assumptions(
    assumed: tuple[str, ...], least: int, most: int
) -> None:
    image = image_of(COUNTER.replace("100 / (n - 9)", "100"))
    machine, judge = Machine(image, 10 * MS, 10 * MS, STEP_BUDGET), Judge.of(image, Question(NEVER, "Main.n > 2000", assumed))
    prover = Prover(image, Question(NEVER, "Main.n > 2000", assumed), Limits(**FEW), lambda said: None)
    found = sampled(machine, judge, prover.inputs, dict(prover.summary.cells), 20, 1)
    assert least <= len(found) <= most
    assert all(sample.now_ns % (10 * MS) == 0 for sample in found)


def test_random_times_lie_between_the_bounds() -> None:
    image = image_of(COUNTER)
    times = Machine(image, 10 * MS, 30 * MS, STEP_BUDGET).random_times(Random(1), 2)
    found = [next(times) for _ in range(400)]
    passed = {later - earlier for earlier, later in pairwise(found)}
    assert found[0] == 0 and {10 * MS, 30 * MS} < passed and min(passed) == 10 * MS and max(passed) == 30 * MS
    fixed = Machine(image, 10 * MS, 10 * MS, STEP_BUDGET).random_times(Random(1), 2)
    assert [next(fixed) for _ in range(3)] == [0, 10 * MS, 20 * MS]


def names_beside(outputs: str) -> Names:
    block = f"FUNCTION_BLOCK B VAR_OUTPUT {outputs} : BOOL; END_VAR END_FUNCTION_BLOCK"
    return Names(image_of(f"{block} PROGRAM Main VAR b : B; n : INT; END_VAR b(); END_PROGRAM"))


@each_of("outputs, pairs, told", [
    ("Done, Busy", ["Done Busy"], "Busy, Done"), ("BUSY, done, Other", ["done BUSY"], "BUSY, done"),
    ("Done, Busy, ENO", ["Done Busy"], "Busy, Done"), ("ENO, Error", ["ENO Error"], "ENO, Error"),
    ("Done, ENO, Error", ["Done Error", "ENO Error"], "Done, ENO, Error"),
    ("CommandAborted, Error, Busy", ["Busy Error", "Busy CommandAborted", "Error CommandAborted"], "Busy, CommandAborted, Error"),
])
def test_a_handshake_is_asked_of_an_instance(outputs: str, pairs: list[str], told: str) -> None:
    asked = handshake(names_beside(outputs), "Main.b", ("Main.n = 0",), ("Main.n",))
    assert asked.text == " OR ".join("(Main.b.{}) AND (Main.b.{})".format(*pair.split()) for pair in pairs)
    assert (asked.kind, asked.title) == (NEVER, f"handshake of Main.b ({told})")
    assert (asked.assumptions, asked.free) == (("Main.n = 0",), ("Main.n",))


@each_of("path, outputs, said", [
    ("Main.n", "Done, Busy", "Main.n is no instance of a function block"),
    ("D0..D1", "Done, Busy", "D0..D1 is no instance of a function block"),
    *(("Main.b", outputs,
       "Main.b is of B, which has no two of the outputs Done, Busy, Error, CommandAborted, and no ENO and Error") for outputs in (
        "Done, ENO", "Error", "Done : BOOL; END_VAR VAR_INPUT Busy")),
])
def test_without_two_outputs_of_a_handshake_there_is_none(path: str, outputs: str, said: str) -> None:
    with pytest.raises(UnknownPlace, match=f"^{re.escape(said)}$"):
        handshake(names_beside(outputs), path)


BYTES = """PROGRAM Main VAR_INPUT In : BYTE; END_VAR VAR b, c : BOOL; p : POINTER TO BYTE; n : INT; END_VAR
    p := ADR(b); c := b; p^ := In; IF b THEN n := 1; ELSE n := 2; END_IF END_PROGRAM"""


@pytest.mark.slow
def test_a_boolean_in_which_another_number_may_lie_is_a_byte() -> None:
    verdict = asked(BYTES, Question(REACH, "Main.n = 1"), "codesys")
    assert shown(verdict)[0] == "REACHED after 1 scan, by the shortest run"
    assert shown(asked(BYTES, Question(NEVER, "Main.n = 0"), "codesys"))[0].startswith("PROVED")


@pytest.mark.slow
def test_how_often_a_program_is_encoded_has_a_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    said: list[str] = []
    for rounds in range(1, 12):
        monkeypatch.setattr(summary, "MOST_ROUNDS", rounds)
        try:
            summarize(compiled(BYTES), STEP_BUDGET)
        except Refused as refused:
            said.append(refused.reason)
    assert said == ["its memory is used in too many shapes", "what is state cannot be told"]


@pytest.mark.slow
def test_lemmas_that_the_solver_does_not_decide_are_no_help(monkeypatch: pytest.MonkeyPatch) -> None:
    prover = prover_of(Question(NEVER, "Main.n > 2000", lemmas=("Main.n >= 0",)))
    monkeypatch.setattr(Solver, "ask", lambda self, *some: UNKNOWN)
    assert prover._with_lemmas() is None and prover.notes == []


SOCKET = """PROGRAM Main VAR status AT CIO 1505 : WORD; switches AT CIO 1519 : WORD; code AT D30027 : WORD; n : INT; END_VAR
    IF n < 100 THEN n := n + 1; END_IF
    IF n = 3 THEN switches := 16#0008; END_IF
    IF code <> 0 OR status <> 0 THEN n := 50; END_IF
END_PROGRAM"""


@pytest.mark.slow
def test_what_a_unit_writes_at_random_keeps_its_rules() -> None:
    image = image_of(SOCKET)
    question = Question(NEVER, "Main.n > 2000", units=((0, 1),))
    prover = Prover(image, question, Limits(**FEW), lambda said: None)
    assert len(prover.inputs) > 3
    machine, judge = Machine(image, 10 * MS, 10 * MS, STEP_BUDGET), Judge.of(image, question)
    found = sampled(machine, judge, prover.inputs, dict(prover.summary.cells), 5, 1)
    assert len(found) == 6 * 5, "no run breaks a rule"


@pytest.mark.slow
def test_where_no_run_keeps_the_assumptions_no_invariants_are_guessed() -> None:
    assert prover_of(Question(NEVER, "Main.n > 2", ("Main.n = 77",)))._with_invariants(24) is None


@pytest.mark.slow
def test_a_scan_of_too_many_statements_is_not_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(execution, "MOST_STEPS", 1)
    with pytest.raises(Refused, match="a scan may execute more than 1 statements, which is too long to be followed"):
        prover_of(Question(NEVER, "Main.n > 2"))


def test_terms_are_shown_for_people() -> None:
    terms = Terms()
    one, other = terms.variable("x", 8), terms.constant(8, 5)
    assert repr(one) == "x" and repr(other) == "5"
    assert repr(terms.add(one, other)) in ("(add x 5)", "(add 5 x)")
    assert repr(terms.extract(one, 3, 2)) == "(extract:3 x)"


@pytest.mark.slow
@each_of(("question", "limits", "said"), [
    (Question(REACH, "Main.n = 3"), {"scans": 12, "simulated_scans": 400}, ["searching 4 scans"]),
    (Question(REACH, "Main.n = 6"), {"scans": 3, "simulated_scans": 400}, [
        "searching 3 scans", "searching 3 scans", "trying random inputs",
        "a random run gets there after 6 scans: looking for the shortest", "searching 3 scans"]),
    (Question(NEVER, "Main.m > 2001", lemmas=("Main.m = 2 * Main.n AND Main.n >= 0 AND Main.n <= 1000",)), FEW, [
        "searching 4 scans", "proving the lemmas", "looking for statements that no run reaches"]),
])  # fmt: skip
def test_what_is_done_is_told_as_it_goes(question: Question, limits: dict[str, int], said: list[str]) -> None:
    told: list[str] = []
    prove(compiled(COUNTER, "standard"), question, Limits(**limits), told.append)
    assert told == said
