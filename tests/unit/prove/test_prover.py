"""Verdicts about small programs: proofs, shortest runs, what is undecided, and what limits an answer."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm.base.data import data_folder
from fbvm.code.compiler import compile_files, compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.prove.encoding.execution import Refused
from fbvm.prove.invariants import Invariants, Ordered
from fbvm.prove.prover import Limits, Prover, prove
from fbvm.prove.question import ALWAYS, NEVER, NO_TRAP, REACH, WITHIN, Names, Question, Verdict
from fbvm.prove.runs import repeated, replayed, simulated
from fbvm.prove.shortening import shortened
from fbvm.prove.solver import UNKNOWN, UNSAT, Solver
from fbvm.prove.unreached import unreached
from fbvm.watch.names import Names as NamesAt
from fbvm.watch.paths import UnknownPlace

FEW = Limits(simulated_scans=200, scans=120)


def image_of(text: str) -> Image:
    image = compile_text(text).image
    assert image is not None
    return image


def program(body: str, variables: str = "") -> Image:
    return image_of(f"PROGRAM Main\nVAR\n    In AT %IX0.0 : BOOL; Other AT %IX0.1 : BOOL; Level AT %IW2 : INT;\n{variables}\n"
                    f"END_VAR\n{body}\nEND_PROGRAM\n")  # fmt: skip


def asked(image: Image, kind: str, text: str = "", *assumed: str, limits: Limits = FEW) -> Verdict:
    verdict = prove(image, Question(kind, text, assumed), limits)
    if verdict.run is not None:
        plc = Plc(image, verdict.run.cycle_ns)
        repeated(plc, verdict.run)
        assert plc.scans == verdict.run.scans
        assert (plc.trap is None) == (kind != NO_TRAP)
    return verdict


def classic(name: str) -> Image:
    image = compile_files([data_folder("examples") / "classics" / f"{name}.st"], runnable=True).image
    assert image is not None
    return image


COUNTER = "IF In THEN n := n + 1; ELSE n := 0; END_IF\nQ := n >= 5;"
COUNTED = "n : INT; Q : BOOL;"


def test_two_outputs_of_an_interlock_are_never_on_together() -> None:
    verdict = asked(classic("interlock"), NEVER, "Main.Left AND Main.Right")
    assert (verdict.word, verdict.how, verdict.notes) == ("proved", "by induction over 1 scan", ())


def test_the_shortest_run_that_breaks_a_property_is_found_and_simple() -> None:
    verdict = asked(program(COUNTER, COUNTED), NEVER, "Main.Q")
    assert verdict.run is not None
    writes = [{place.name: value for place, value in scan.items()} for scan in verdict.run.writes]
    assert (verdict.word, writes) == ("broken", [{"Main.In": True}, {}, {}, {}, {}])
    assert verdict.how == "after 5 scans, by the shortest run"


def test_reach_finds_the_shortest_inputs() -> None:
    verdict = asked(program(COUNTER, COUNTED), REACH, "Main.n = 3")
    assert verdict.run is not None
    assert (verdict.word, verdict.run.scans, verdict.is_good) == ("reached", 3, True)


@pytest.mark.slow
def test_an_input_of_a_subrange_has_its_ends_and_nothing_behind_them() -> None:
    image = program("n := Part;", "Part AT %IW4 : INT(-3..5); n : INT;")
    words = {value: asked(image, REACH, f"Main.n = {value}").word for value in (-4, -3, 5, 6)}
    assert words == {-4: "unreachable", -3: "reached", 5: "reached", 6: "unreachable"}


def test_inputs_of_all_sizes_are_inputs_where_these_are_apart() -> None:
    text = ("PROGRAM Main VAR a AT %IX0.0 : BOOL; b AT %IW0 : INT; q AT %QX0.0 : BOOL; r AT %QW0 : INT; END_VAR\n"
            "q := a; r := b; END_PROGRAM")
    made = compile_text(text, dialect="matiec").image
    assert made is not None
    for wanted in ("Main.q AND Main.r = 6", "Main.q AND Main.r = 7", "NOT Main.q AND Main.r = 7"):
        assert asked(made, REACH, wanted).word == "reached"


def test_what_is_never_reached_is_said_to_be_unreachable() -> None:
    verdict = asked(program(COUNTER.replace("5;", "5; IF n > 9 THEN n := 0; END_IF"), COUNTED), REACH, "Main.n = 11")
    assert (verdict.word, verdict.is_good) == ("unreachable", False)


@pytest.mark.slow
def test_a_property_that_needs_an_invariant_is_proved() -> None:
    verdict = asked(classic("batch_sequence"), NEVER, "Main.Inlet AND Main.Outlet")
    assert verdict.word == "proved"
    assert "invariants" in verdict.how


@pytest.mark.slow
def test_without_a_proof_the_scans_without_a_run_are_told() -> None:
    deep = program("IF In THEN n := n + 1; ELSE n := 0; END_IF", "n : DINT;")
    verdict = asked(deep, NEVER, "Main.n = 100000", limits=Limits(simulated_scans=10, scans=40))
    assert (verdict.word, verdict.scans) == ("undecided", 40)
    assert verdict.how == "no run of 40 scans gets there, and no proof was found that none ever does"


@pytest.mark.parametrize(("kind", "greatest"), [("USINT", 255), ("SINT", 127)])
def test_decimal_digits_that_make_too_large_a_number_trap(kind: str, greatest: int) -> None:
    digits = image_of(f"PROGRAM Main VAR w AT %IW0 : WORD; n : {kind}; END_VAR n := WORD_BCD_TO_{kind}(w); END_PROGRAM")
    few = int(str(greatest), 16)
    assert asked(digits, NO_TRAP, "", f"Main.w = {few + 1}").word == "broken"
    assert asked(digits, NO_TRAP, "", f"Main.w = {few}").word == "proved"


@pytest.mark.slow
def test_steps_behind_a_long_wait_are_never_active_with_those_before() -> None:
    """No random run waits so long: that Draining is never active is guessed, and refuted with much that holds without it."""
    image = image_of("""PROGRAM Main
        VAR_INPUT Start, Full, Hot, Empty : BOOL; END_VAR
        VAR Valve, Drain : BOOL; END_VAR
        INITIAL_STEP Idle: END_STEP  STEP Filling: Valve(N); END_STEP  STEP Heating: END_STEP  STEP Mixing: END_STEP
        STEP Draining: Drain(N); END_STEP
        TRANSITION FROM Idle TO Filling := Start; END_TRANSITION
        TRANSITION FROM Filling TO (Heating, Mixing) := Full; END_TRANSITION
        TRANSITION FROM (Heating, Mixing) TO Draining := Hot AND Mixing.T >= T#3s; END_TRANSITION
        TRANSITION FROM Draining TO Idle := Empty; END_TRANSITION
        END_PROGRAM""")
    assert asked(image, NEVER, "Main.Valve AND Main.Drain").word == "proved"


def test_a_program_that_always_traps_is_told_so() -> None:
    with pytest.raises(Refused, match=r"each run ends in a trap .* within 4 scans: there is nothing to prove"):
        asked(program("n := n + 1; n := n + 10 / (3 - n) * 0;", "n : INT;"), NEVER, "Main.n > 5")


def test_assumptions_that_no_run_keeps_for_long_are_told() -> None:
    counts = program("n := n + 1;", "n : INT;")
    verdict = asked(counts, NEVER, "Main.n > 9", "Main.n < 10")
    assert (verdict.word, verdict.notes) == ("proved", (
        "assumed: Main.n < 10",
        "no run keeps the assumptions, or does not trap, for longer than 9 scans: nothing is said of later ones"))
    assert asked(counts, NEVER, "Main.In", "NOT Main.In").notes == ("assumed: NOT Main.In",)


def test_statements_of_which_nothing_is_known_yet_are_not_said_to_be_unreached(monkeypatch: pytest.MonkeyPatch) -> None:
    prover = Prover(program("IF In THEN n := 1; END_IF", "n : INT;"), Question(NEVER, "Main.n > 1"), Limits(), lambda said: None)
    asked = prover.summary, prover.goal, prover.clock, 4, lambda: False
    assert unreached(*asked) == []
    monkeypatch.setattr(Solver, "ask", lambda *terms: UNKNOWN)
    assert unreached(*asked) == []


@each_of(("answer", "known"), [(UNSAT, True), (UNKNOWN, False)])
def test_a_run_is_called_the_shortest_only_if_that_is_known(monkeypatch: pytest.MonkeyPatch, answer: str, known: bool) -> None:
    """Once a run is found, it is asked whether there is a shorter one: an answer that does not come in time says nothing."""
    prover = Prover(program(COUNTER, COUNTED), Question(REACH, "Main.Q"), Limits(), lambda said: None)
    asks, ask = iter([None, answer]), Solver.ask
    monkeypatch.setattr(Solver, "ask", lambda solver, *terms: next(asks, None) or ask(solver, *terms))
    assert prover.search.until(16) is not None
    assert prover.search.is_shortest is known


LATCHED = "IF Other THEN n := 0; ELSIF In THEN n := n + 1; END_IF"


@each_of(("body", "text", "fewest"), [
    (LATCHED, "Main.n = 30", 30), (COUNTER, "Main.n = 40", 40), ("n := n + 1;", "Main.n = 90", 90),
    (LATCHED, "Main.n = 4 AND Main.Other", 0)])
def test_a_random_run_is_made_shorter_on_the_engine(body: str, text: str, fewest: int) -> None:
    prover = Prover(program(body, COUNTED), Question(REACH, text), Limits(), lambda said: None)
    found = next((each for each in simulated(prover.machine, prover.judge, prover.inputs, 2000, 1) if each), None)
    assert (found is not None) == bool(fewest)
    if found:
        inputs = shortened(prover.machine, prover.judge, found.inputs, lambda: False)
        assert (len(inputs), inputs.times_ns) == (fewest, [number * 10_000_000 for number in range(fewest)])
        run = replayed(prover.machine, prover.judge, inputs, False)
        assert run is not None and run.scans == fewest
        assert shortened(prover.machine, prover.judge, found.inputs, lambda: True) == found.inputs


def test_bits_of_a_word_that_never_change_are_an_invariant() -> None:
    """Rungs and statements write single bits of a word, of which a condition asks as a number."""
    words = image_of("PROGRAM Main\nVAR In AT %IX0.0 : BOOL; Other AT %IX0.1 : BOOL; w : WORD := 16#0100; END_VAR\n"
                     "w.6 := In; w.2 := Other AND NOT In;\nEND_PROGRAM\n")  # fmt: skip
    assert asked(words, NEVER, "Main.w > 16#0140").word == "proved"
    assert asked(words, NEVER, "Main.w = 16#0144").word == "proved"
    assert asked(words, NEVER, "Main.w = 16#0140").word == "broken"


def test_no_time_at_all_is_undecided() -> None:
    image = program(COUNTER, COUNTED)
    verdict = asked(image, NEVER, "Main.n = 30000", limits=Limits(simulated_scans=10, expired=lambda: True))
    assert (verdict.word, verdict.scans) == ("undecided", 0)
    assert verdict.how.startswith("the time is over")


def test_division_by_an_input_traps() -> None:
    verdict = asked(program("n := 10 / Level;", "n : INT;"), NO_TRAP)
    assert verdict.run is not None and verdict.run.trap is not None
    assert (verdict.word, verdict.run.trap.code, verdict.run.scans) == ("broken", "R0101", 1)


@pytest.mark.slow
def test_an_index_that_is_limited_never_traps() -> None:
    image = program("n := LIMIT(0, Level, 9); a[n] := a[n] + 1;", "a : ARRAY [0..9] OF INT; n : INT;")
    assert asked(image, NO_TRAP).word == "proved"


@pytest.mark.slow
def test_an_index_that_is_one_too_large_traps() -> None:
    image = program("n := LIMIT(0, Level, 10); a[n] := a[n] + 1;", "a : ARRAY [0..9] OF INT; n : INT;")
    verdict = asked(image, NO_TRAP)
    assert verdict.run is not None and verdict.run.trap is not None
    assert (verdict.word, verdict.run.trap.code) == ("broken", "R0102")


def test_an_assumption_leaves_runs_out() -> None:
    image = program("n := 10 / Level;", "n : INT;")
    verdict = asked(image, NO_TRAP, "", "Main.Level > 0")
    assert (verdict.word, verdict.notes) == ("proved", ("assumed: Main.Level > 0",))


def test_assumptions_that_no_run_keeps_are_refused() -> None:
    with pytest.raises(Refused, match="nothing to prove"):
        asked(program(COUNTER, COUNTED), NEVER, "Main.Q", "Main.In AND NOT Main.In")


@pytest.mark.parametrize("condition", ["Main.n < 101.5", "Main.n <> 1e999"])
def test_a_whole_number_beside_a_real_literal_is_refused_in_words(condition: str) -> None:
    with pytest.raises(Refused, match="compare whole numbers with a whole number"):
        prove(program("n := n + 1;", "n : INT;"), Question(NEVER, condition), FEW)


def test_a_word_is_free_if_it_is_named() -> None:
    image = program("Q := w > 5;", "w AT %D100 : INT; Q : BOOL;")
    assert prove(image, Question(NEVER, "Main.Q"), FEW).word == "proved"
    verdict = prove(image, Question(NEVER, "Main.Q", free=("D100",)), FEW)
    assert verdict.word == "broken"


def test_a_free_word_that_the_program_writes_is_written_again_in_the_run() -> None:
    image = program("IF w = 0 THEN n := n + 1; END_IF w := 5;", "w AT %D100 : INT; n : INT;")
    verdict = prove(image, Question(REACH, "Main.n = 3", free=("D100",)), FEW)
    assert (verdict.word, verdict.run and verdict.run.scans) == ("reached", 3)
    assert verdict.run is not None
    plc = Plc(image, verdict.run.cycle_ns)
    repeated(plc, verdict.run)
    assert plc.read("Main.n") == 3


def test_inputs_that_only_the_property_reads_are_free() -> None:
    image = program("n := n;", "n, Unread : INT;")
    for name, free in (("Main.Unread", ("Main.Unread",)), ("D5", ("D4..D6",)), ("Main.Level", ())):
        verdict = prove(image, Question(ALWAYS, f"{name} = 0", free=free), FEW)
        assert (verdict.word, verdict.run is not None and verdict.run.scans) == ("broken", 1), name


def test_a_text_or_a_reference_cannot_be_free() -> None:
    image = program("n := LEN(s);", "n : INT; s : STRING; r : REF_TO INT;")
    for name in ("Main.s", "Main.r"):
        with pytest.raises(UnknownPlace, match="texts, references and instances cannot"):
            prove(image, Question(ALWAYS, "Main.n = 0", free=(name,)), FEW)


def test_what_holds_a_text_a_reference_or_an_instance_cannot_be_free() -> None:
    image = image_of("TYPE Tag : STRUCT n : INT; s : STRING[8]; END_STRUCT END_TYPE\n"
                     "TYPE Line : STRUCT n : INT; t : ARRAY[1..2] OF Tag; END_STRUCT END_TYPE\n"
                     "TYPE Plain : STRUCT n : INT; b : ARRAY[1..2] OF BOOL; END_STRUCT END_TYPE\n"
                     "PROGRAM Main VAR t : Tag; l : Line; p : ARRAY[0..1] OF REF_TO INT; e : R_TRIG; f : Plain; END_VAR\n"
                     "END_PROGRAM\n")
    names = Names(image)
    for name, part in (("Main.t", "Main.t.s is of STRING"), ("Main.l", "an element of Main.l.t.s is of STRING"),
                       ("Main.p", "an element of Main.p is of REF_TO INT"), ("Main.e", "Main.e is an instance of R_TRIG")):
        with pytest.raises(UnknownPlace, match=part):
            names.extents(name)
    assert [(size, bit) for _, size, bit in names.extents("Main.f")] == [(4, None)]


def test_a_variable_that_nothing_changes_is_told() -> None:
    verdict = asked(program("Q := In AND Enabled;", "Q, Enabled : BOOL;"), NEVER, "Main.Q")
    assert verdict.word == "proved"
    assert "Main.Q has the same value in every scan: it is no input, and no code changes it" in verdict.notes


def test_statements_that_no_run_reaches_are_told() -> None:
    verdict = asked(program("Q := In;\nIF Mode = 7 THEN\n    Q := FALSE;\nEND_IF", "Q : BOOL; Mode : INT;"), NEVER,
                    "Main.Q AND NOT Main.In")  # fmt: skip
    assert verdict.notes == ("no run of 64 scans executes text.st:8",)


def rung(contact: str) -> Image:
    return image_of(f"PROGRAM Main\nVAR Q : BOOL; END_VAR\nLADDER\n{contact}\nOUT Q\nEND_LADDER\nEND_PROGRAM\n")


@pytest.mark.parametrize("contact", ["LD P_On", "LDNOT P_Off"])
def test_what_stands_behind_the_always_on_flag_is_executed(contact: str) -> None:
    image = rung(contact)
    verdict = prove(image, Question(REACH, "Main.Q"), FEW)
    assert (verdict.word, verdict.run and verdict.run.scans) == ("reached", 1)


def test_the_first_cycle_flag_is_on_in_the_first_scan_only() -> None:
    image = program("IF First THEN n := n + 1; END_IF", "First AT A200.11 : BOOL; n : INT;")
    assert prove(image, Question(ALWAYS, "Main.n = 1"), FEW).word == "proved"


def test_what_the_machine_writes_is_seen_by_a_property_that_nobody_else_reads() -> None:
    image = program("Q := In;", "Q : BOOL; First AT A200.11 : BOOL; Count AT A0 : UINT;")
    assert prove(image, Question(REACH, "Main.First"), FEW).word == "reached"
    verdict = prove(image, Question(NEVER, "Main.Count = 3"), FEW)
    assert (verdict.word, verdict.run and verdict.run.scans, verdict.notes) == ("broken", 4, ())


def test_clock_pulses_follow_the_cycle() -> None:
    verdict = prove(rung("LD P_0_1s"), Question(REACH, "Main.Q"), FEW)
    assert (verdict.word, verdict.run and verdict.run.scans) == ("reached", 6)


@pytest.mark.slow
def test_a_timer_ends_after_its_time_and_not_before() -> None:
    image = program("t(IN := In, PT := T#100ms);", "t : TON;")
    verdict = asked(image, REACH, "Main.t.Q")
    assert verdict.run is not None
    assert (verdict.word, verdict.run.scans) == ("reached", 11)
    assert asked(image, NEVER, "Main.t.Q AND Main.t.ET < T#100ms").word == "proved"


def test_tasks_run_at_their_intervals() -> None:
    image = image_of("""PROGRAM Slow VAR n : INT; END_VAR n := n + 1; END_PROGRAM
PROGRAM Fast VAR n : INT; END_VAR n := n + 1; END_PROGRAM
CONFIGURATION C RESOURCE R ON PLC
TASK S(INTERVAL := T#50ms, PRIORITY := 2); TASK F(INTERVAL := T#10ms, PRIORITY := 1);
PROGRAM A WITH S : Slow; PROGRAM B WITH F : Fast;
END_RESOURCE END_CONFIGURATION
""")
    verdict = prove(image, Question(REACH, "A.n = 3"), FEW)
    assert (verdict.word, verdict.run and verdict.run.scans) == ("reached", 11)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "address"), [("REAL", "%ID4"), ("LREAL", "%IL1")])
def test_reals_are_compared_exactly(kind: str, address: str) -> None:
    image = program("Q := r > 10.0 AND r < 11.0; n := SEL(r = -r, 0, 1);", f"r AT {address} : {kind}; Q : BOOL; n : INT;")
    assert asked(image, NEVER, "Main.Q AND Main.r <= 10.0").word == "proved"
    assert asked(image, NEVER, "Main.n = 1 AND Main.r <> 0.0").word == "proved"
    found = asked(image, REACH, "Main.Q AND Main.r > 10.25")
    assert found.run is not None
    [(place, value)] = found.run.writes[0].items()
    assert place.name == "Main.r" and isinstance(value, float) and 10.25 < value < 11.0


@pytest.mark.slow
def test_arithmetic_of_reals_is_taken_for_any_value() -> None:
    image = program("r := r + 1.0; Q := r > 10.0 AND In;", "r : REAL; Q : BOOL;")
    assert asked(image, NEVER, "Main.Q AND NOT Main.In").word == "proved"
    broken = asked(program("Q := r * 0.0 > 1.0;", "r AT %ID4 : REAL; Q : BOOL;"), NEVER, "Main.Q")
    assert broken.word == "undecided"
    assert broken.notes[0] == "taken for any value: mul of REAL (text.st:6:1 in Main)"


def test_a_program_in_the_loop_of_a_pointer_to_a_local_is_refused_with_its_line() -> None:
    image = image_of("""FUNCTION Look : INT
VAR local : INT; p : POINTER TO INT; END_VAR
local := 3; p := ADR(local); Look := p^;
END_FUNCTION
PROGRAM Main VAR n : INT; END_VAR n := Look(); END_PROGRAM
""")
    with pytest.raises(Refused, match="ends with its call") as refused:
        prove(image, Question(NEVER, "Main.n > 3"), FEW)
    assert image.sites[refused.value.site].line == 3


@pytest.mark.slow
def test_inputs_of_an_enumeration_have_its_values_only() -> None:
    image = image_of("""TYPE Colour : (Red, Green, Blue); END_TYPE
PROGRAM Main
VAR_INPUT c : Colour; END_VAR
VAR n : INT; END_VAR
CASE c OF Red: n := 1; Green: n := 2; Blue: n := 3; ELSE n := 99; END_CASE
END_PROGRAM
""")
    verdict = prove(image, Question(NEVER, "Main.n = 99"), FEW)
    assert verdict.word == "proved"
    assert verdict.notes and "executes" in verdict.notes[0]


WAITING = "t(IN := In AND NOT Other, PT := T#30ms); Q := t.Q;"


def answered(image: Image, within_ms: int, *assumed: str) -> Verdict:
    return prove(image, Question(WITHIN, "Main.Q", assumed, trigger="Main.In", within_ns=within_ms * 1_000_000), FEW)


@pytest.mark.slow
def test_an_answer_within_a_time_is_proved() -> None:
    image = program(WAITING, "t : TON; Q : BOOL;")
    assert answered(image, 30, "Main.In", "NOT Main.Other").word == "proved"


@pytest.mark.slow
def test_induction_looks_back_as_many_scans_as_an_answer_may_take() -> None:
    image = program("Q := s[7]; FOR i := 7 TO 1 BY -1 DO s[i] := s[i - 1]; END_FOR s[0] := In;",
                    "s : ARRAY[0..7] OF BOOL; i : INT; Q : BOOL;")
    verdict = answered(image, 80)
    assert (verdict.word, verdict.how) == ("proved", "by induction over 10 scans")


@pytest.mark.slow
def test_an_answer_that_comes_too_late_is_shown() -> None:
    image = program(WAITING, "t : TON; Q : BOOL;")
    verdict = answered(image, 20, "NOT Main.Other")
    assert verdict.run is not None
    assert (verdict.word, verdict.run.scans, str(verdict.question)) == ("broken", 3, "Main.Q within 20ms of Main.In")


@pytest.mark.slow
def test_an_answer_that_somebody_prevents_is_shown() -> None:
    image = program(WAITING, "t : TON; Q : BOOL;")
    verdict = answered(image, 50)
    assert (verdict.word, verdict.run and verdict.run.scans) == ("broken", 6)


@pytest.mark.slow
def test_bits_of_a_word_are_inputs_unless_the_program_writes_them() -> None:
    image = image_of("""PROGRAM Main
VAR w AT CIO 0 : WORD; First AT CIO 0.00 : BOOL; Busy AT CIO 0.15 : BOOL; n : WORD; END_VAR
n := w AND 16#00FF; Busy := First;
END_PROGRAM
""")
    verdict = prove(image, Question(REACH, "Main.n = 16#0081"), FEW)
    assert verdict.word == "reached"
    assert prove(image, Question(ALWAYS, "Main.Busy = Main.First"), FEW).word == "proved"


@pytest.mark.slow
def test_a_loop_that_cannot_be_followed_to_its_end_leaves_it_undecided() -> None:
    image = program("n := 0; WHILE n * n <> Level DO n := n + 1; IF n > 1000 THEN EXIT; END_IF END_WHILE; Q := In;",
                    "n : DINT; Q : BOOL;")  # fmt: skip
    verdict = asked(image, NEVER, "Main.Q AND NOT Main.In")
    assert verdict.word == "undecided"
    assert verdict.how.startswith("a loop goes on for longer than it can be followed (text.st:6:")


ENDLESS = {
    "IF Level = 12 THEN i := 0; WHILE i < 4 DO Q := FALSE; END_WHILE END_IF": "broken",
    "IF Level = 12 THEN i := 0; WHILE i < 4 DO i := i * i; Q := NOT Q; END_WHILE END_IF": "broken",
    "i := 0; WHILE i < Level DO IF In THEN i := i + 0; ELSE EXIT; END_IF END_WHILE": "broken",
    "IF Level = 12 THEN i := 0; WHILE i < 200 DO i := i + 1; END_WHILE END_IF": "proved",
    "IF Level > 12 THEN i := 0; WHILE i < Level DO EXIT; END_WHILE END_IF": "proved",
}


@each_of("body", ENDLESS)
def test_a_loop_that_comes_back_to_where_it_was_never_ends(body: str) -> None:
    verdict = asked(program(body, "i : INT; Q : BOOL;"), NO_TRAP)
    assert (verdict.word, verdict.run and verdict.run.trap and verdict.run.trap.code) == (
        ENDLESS[body], "R0104" if ENDLESS[body] == "broken" else None)  # fmt: skip


CHECKSUM = """FOR i := 0 TO 30 DO
    sum := table[WORD_TO_UINT((SHR(sum, 8) XOR SHL(sum, 1) XOR INT_TO_WORD(Level)) AND 16#3FF)];
END_FOR"""


@pytest.mark.slow
def test_a_scan_with_too_many_ways_is_undecided_when_the_time_is_over() -> None:
    asks = iter(range(3))
    limits = Limits(expired=lambda: next(asks, None) is None)
    verdict = asked(program(CHECKSUM, "i : INT; sum : WORD; table : ARRAY[0..1023] OF WORD;"), NO_TRAP, limits=limits)
    assert (verdict.word, verdict.how, verdict.scans) == (
        "undecided", "the time is over: one scan has too many ways to follow all of them", 0)


def test_a_timer_was_started_at_the_time_of_the_scan_at_the_latest() -> None:
    """Of its times only the start is never later than the scan is; the times that it was given or has measured may be."""
    image = image_of("PROGRAM Main VAR In AT %IX0.0 : BOOL; t : TON; END_VAR t(IN := In, PT := T#50ms); END_PROGRAM")
    prover = Prover(image, Question(NEVER, "Main.t.ET > T#1h"), Limits(), lambda said: None)
    state = list(prover.summary.next)
    found = Invariants(prover.summary, state, prover.goal.stop, prover.goal.given, prover.clock, lambda: False)
    kept = found.kept([Ordered(variable, None) for variable in state if variable.width == 64])
    names = NamesAt.of(image, Plc(image).memory.areas)
    assert kept is not None and len([variable for variable in state if variable.width == 64]) > 1
    [ordered] = kept
    assert isinstance(ordered, Ordered)
    place = names.at(ordered.lesser.value[1].offset)
    assert place is not None and place.name not in ("Main.t.PT", "Main.t.ET")
