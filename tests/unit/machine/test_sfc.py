"""Charts beside the program text: restarts, retained instances, the times at which something becomes due."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import RUN, Plc
from fbvm.machine.state import Mode

MS = 10**6
TWO = """FUNCTION_BLOCK Seq
VAR_OUTPUT n : INT; END_VAR
INITIAL_STEP a: END_STEP
TRANSITION FROM a TO b := a.T >= T#20ms; END_TRANSITION
STEP b: c(N); END_STEP
TRANSITION FROM b TO d := b.T >= T#100ms; END_TRANSITION
STEP d: END_STEP
ACTION c: n := n + 1; END_ACTION
END_FUNCTION_BLOCK
PROGRAM Main
VAR plain : Seq; END_VAR
VAR RETAIN kept : Seq; END_VAR
plain(); kept();
END_PROGRAM
"""


def made(text: str, cycle_ms: int = 10) -> Plc:
    image = compile_text(text).image
    assert image is not None
    return Plc(image, cycle_ms * MS)


def active(plc: Plc, instance: str) -> str:
    return "".join(step for step in "abd" if plc.read(f"Main.{instance}.{step}.X"))


def test_a_warm_start_begins_anew_but_for_retained_instances() -> None:
    plc = made(TWO)
    plc.run(scans=6)
    assert (active(plc, "plain"), active(plc, "kept"), plc.read("Main.kept.n")) == ("b", "b", 4)
    plc.warm_start()
    plc.run(scans=1)
    assert (active(plc, "plain"), active(plc, "kept"), plc.read("Main.kept.n")) == ("a", "b", 5)
    plc.run(scans=6)
    assert plc.read("Main.kept.b.T") == 100 * MS and active(plc, "kept") == "d", "its time went on"


def test_a_cold_start_begins_anew() -> None:
    plc = made(TWO)
    plc.run(scans=6)
    plc.cold_start()
    assert active(plc, "kept") == ""
    plc.run(scans=1)
    assert (active(plc, "plain"), active(plc, "kept")) == ("a", "a")


@pytest.mark.slow
def test_from_program_to_run_begins_anew() -> None:
    plc = made(TWO)
    plc.run(scans=6)
    plc.mode = Mode.PROGRAM
    plc.run(scans=2)
    plc.mode = RUN
    plc.run(scans=1)
    assert (active(plc, "plain"), active(plc, "kept")) == ("a", "b")


@pytest.mark.slow
def test_times_do_not_drift() -> None:
    plc = made("""PROGRAM Main
        VAR rounds : INT; END_VAR
        INITIAL_STEP a: END_STEP
        TRANSITION FROM a TO a := a.T >= T#1s; END_TRANSITION
        END_PROGRAM""".replace("a: END_STEP", "a: count(P1); END_STEP").replace(
        "END_PROGRAM", "ACTION count: rounds := rounds + 1; END_ACTION END_PROGRAM"), 100)
    plc.run(scans=1001)
    assert plc.read("Main.rounds") == 101


@pytest.mark.slow
@each_of(("association", "due_ms"), [
    ("x(L, T#70ms)", 70), ("x(D, T#80ms)", 80), ("x(DS, T#90ms)", 90), ("x(SD, T#60ms)", 60), ("x(SL, T#50ms)", 50)])  # fmt: skip
def test_it_is_known_when_an_action_changes_by_itself(association: str, due_ms: int) -> None:
    plc = made(f"PROGRAM Main VAR x : BOOL; END_VAR INITIAL_STEP a: {association}; END_STEP END_PROGRAM")
    before = plc.now_ns
    plc.run(scans=1)
    state = plc.read("Main.x")
    assert plc.due_ns == before + due_ms * MS
    plc.run(scans=due_ms // 10 - 1)
    assert plc.read("Main.x") is state
    plc.run(scans=1)
    assert plc.read("Main.x") is not state


def test_it_is_known_when_a_transition_waits_for_a_time() -> None:
    plc = made("""PROGRAM Main
        VAR long : TIME := T#1s; END_VAR
        INITIAL_STEP a: END_STEP
        TRANSITION FROM a TO b := a.T >= long; END_TRANSITION
        STEP b: END_STEP
        END_PROGRAM""")
    plc.run(scans=2)
    assert plc.due_ns == 1000 * MS
