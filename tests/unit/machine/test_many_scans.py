"""Scans inside machine code, many at once: to the bit what single scans leave, whatever the program looks at."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import pytest
from depth import times
from hypothesis import given, settings
from hypothesis import strategies as st
from rows import first_quick

from fbvm import Etn21, LoopNetwork, ModbusPeer, Peer, Plc, compile_text
from fbvm.code.image import Image
from fbvm.engine.native import engine as native
from fbvm.engine.native.scans.scans import NativeScans
from fbvm.machine.plc import Mode
from fbvm.net.loop import LoopLink
from fbvm.run import TimedWrite, loop
from fbvm.wire import registers

if not native.available():
    pytest.skip("llvmlite is not installed", allow_module_level=True)

PROGRAM = """
PROGRAM Main
VAR
  n : INT; t : TON; tp : TP; p1 AT %A262 : UDINT; p2 AT %A264 : UDINT; free AT %A0 : WORD; slow AT %A1 : WORD;
  first AT %A200.11 : BOOL; firsts : INT; a : ARRAY [0..7] OF DINT; sum : DINT; pulses : ARRAY [0..4] OF DINT;
  second AT %CF102 : BOOL; fifth AT %CF101 : BOOL; tenth AT %CF100 : BOOL; fiftieth AT %CF103 : BOOL; minute AT %CF104 : BOOL;
END_VAR
  n := n + 1;
  IF first THEN firsts := firsts + 1; END_IF;
  t(IN := n MOD 50 < 30, PT := T#70ms);
  tp(IN := t.Q, PT := T#45ms);
  a[n MOD 8] := a[n MOD 8] + UDINT_TO_DINT(p1) + UDINT_TO_DINT(p2) + WORD_TO_DINT(free) + WORD_TO_DINT(slow);
  IF second THEN pulses[0] := pulses[0] + 1; END_IF;
  IF fifth THEN pulses[1] := pulses[1] + 1; END_IF;
  IF tenth THEN pulses[2] := pulses[2] + 1; END_IF;
  IF fiftieth THEN pulses[3] := pulses[3] + 1; END_IF;
  IF minute THEN pulses[4] := pulses[4] + 1; END_IF;
  IF tp.Q THEN sum := sum + 1; END_IF;
END_PROGRAM
PROGRAM Other
VAR n : DINT; x : DINT; END_VAR
  n := n + 1;
  {trap}
END_PROGRAM
CONFIGURATION C
  TASK Quick(INTERVAL := {quick}, PRIORITY := 3);
  TASK Slow(INTERVAL := T#25ms, PRIORITY := 1);
  PROGRAM P WITH Quick : Main;
  PROGRAM Q WITH Slow : Other;
  PROGRAM R : Main;
END_CONFIGURATION
"""


def image(quick: str = "T#7ms", trap: str = ";") -> Image:
    compilation = compile_text(PROGRAM.replace("{quick}", quick).replace("{trap}", trap))
    assert compilation.image, [diagnostic.render() for diagnostic in compilation.diagnostics]
    return compilation.image


IMAGE = image()


def single(plc: Plc) -> Plc:
    """The same PLC, whose scans somebody is told of."""
    plc.watchers.append(lambda plc: None)
    return plc


def state(plc: Plc) -> tuple[Any, ...]:
    snapshot = plc.snapshot()
    return bytes(snapshot.memory), snapshot.now_ns, snapshot.scans, snapshot.schedule, repr(snapshot.trap)


@pytest.mark.slow
@settings(max_examples=times(25), deadline=None)
@given(st.sampled_from([1, 99_999, 1_000_000, 3_333_333, 10_000_000, 60_000_000, 1_000_000_000, 10**15]),
       st.lists(st.integers(0, 400), min_size=1, max_size=4))
def test_many_scans_are_as_many_single_ones(cycle_ns: int, parts: list[int]) -> None:
    many, one, python = (Plc(IMAGE, cycle_ns, engine=engine) for engine in ("native", "native", "python"))
    single(one)
    for count in parts:
        for plc in (many, one, python):
            plc.run(scans=count)
        assert state(many) == state(one) == state(python)


@pytest.mark.parametrize("trap", [
    "x := 100 / (40 - n);", "WHILE n > 40 DO n := n + 1; IF n > 100 THEN n := 50; END_IF; END_WHILE;"])  # fmt: skip
def test_a_trap_ends_them_where_it_ends_single_ones(trap: str) -> None:
    code = image(trap=trap)
    many, one = Plc(code, engine="native", budget=5000), single(Plc(code, engine="native", budget=5000))
    assert many.run(scans=1000) == one.run(scans=1000) == "trap"
    assert state(many) == state(one)
    assert many.trap is not None and many.scans > 90


@pytest.mark.parametrize("goal", [{"for_ns": 1_234_567_891}, {"for_ns": 1}, {"scans": 0}, {"scans": 1},
                                  {"scans": 5000, "max_ns": 333_333_333}, {"until": "Main.n = 3 OR P.n > 200", "max_ns": 10**9}])
def test_runs_end_at_the_same_scan(goal: dict[str, Any]) -> None:
    code = image("T#10ms")
    if "until" in goal:
        goal = goal | {"until": "P.n > 200"}
    many, one = Plc(code, engine="native"), single(Plc(code, engine="native"))
    for _ in range(3):
        assert many.run(**goal) == one.run(**goal)
        assert state(many) == state(one)


def test_they_are_used(monkeypatch: pytest.MonkeyPatch) -> None:
    plc = Plc(IMAGE, engine="native")
    assert plc.run(scans=10_000) == "scans"
    monkeypatch.setattr(plc, "scan", lambda: pytest.fail("a single scan"))
    assert plc.run(scans=10_000) == "scans"
    assert plc.scans == 20_000


def test_a_long_run_comes_back_now_and_then(monkeypatch: pytest.MonkeyPatch) -> None:
    """For Ctrl-C: machine code cannot be interrupted."""
    monkeypatch.setattr("fbvm.machine.plc.STEP_BUDGET", 5000)
    plc = Plc(IMAGE, engine="native")
    plc.run(scans=100)
    counts = []
    run_many = NativeScans.run

    def counted(self: NativeScans, *operands: Any, **named: Any) -> Any:
        counts.append(plc.scans)
        return run_many(self, *operands, **named)

    monkeypatch.setattr(NativeScans, "run", counted)
    assert plc.run(scans=2000) == "scans"
    assert len(counts) > 4 and all(later - earlier < 500 for earlier, later in pairwise(counts))


@pytest.mark.parametrize("disturb", [
    lambda plc: plc.watchers.append(lambda plc: None), lambda plc: plc.phases.append(lambda plc, phase: None),
    lambda plc: plc.force("D7", 5), lambda plc: setattr(plc, "mode", Mode.PROGRAM),
])  # fmt: skip
def test_who_wants_every_scan_gets_it(monkeypatch: pytest.MonkeyPatch, disturb: Any) -> None:
    plc = Plc(IMAGE, engine="native")
    plc.run(scans=10)
    disturb(plc)
    monkeypatch.setattr(NativeScans, "run", lambda *_: pytest.fail("not scan by scan"))
    assert plc.run(scans=10) == "scans" and plc.scans == 20


@pytest.mark.parametrize("disturb", [
    lambda plc: plc.phases.append(lambda plc, phase: None), lambda plc: plc.force("D7", 5),
    lambda plc: plc.attach(Etn21(0, "192.168.250.2"), LoopNetwork()), lambda plc: setattr(plc, "mode", Mode.PROGRAM),
    lambda plc: plc.cold_start(),
], ids=["phases", "force", "unit", "mode", "first scan"])  # fmt: skip
def test_who_wants_every_scan_gets_it_with_breakpoints_too(disturb: Any) -> None:
    plc = Plc(IMAGE, engine="native")
    plc.scan()
    plc.breakpoints.line("Other", when="P.n = 9999")
    assert plc.scan_many(5) and plc.scans == 6
    disturb(plc)
    assert not plc.scan_many(5) and plc.scans == 6


@pytest.mark.slow
def test_a_recorder_is_told_in_front_of_many_scans_with_breakpoints_and_behind_them() -> None:
    told: list[tuple[Any, ...]] = []

    class Recorder:
        wants_plain_scans = False

        def __getattr__(self, name: str) -> Any:
            return lambda *given: told.append((name, *given))

    plc = Plc(IMAGE, engine="native")
    plc.scan()
    plc.record_inputs(Recorder())  # type: ignore[arg-type]
    plc.breakpoints.line("Other", when="P.n = 9999")
    told.clear()
    cycle_ns = plc.cycle_ns
    assert plc.scan_many(5)
    assert told == [("before", cycle_ns), ("after", 5, cycle_ns, cycle_ns)]
    told.clear()
    assert plc.run(scans=3) == "scans"
    assert told == [("run_begins",), ("before", 6 * cycle_ns), ("after", 3, 6 * cycle_ns, cycle_ns), ("run_ends",)]


def test_after_a_restart_the_first_scan_is_one_again() -> None:
    many, one = Plc(IMAGE, engine="native"), single(Plc(IMAGE, engine="native"))
    for plc in (many, one):
        plc.run(scans=500)
        plc.warm_start()
        plc.run(scans=500)
    assert state(many) == state(one)
    assert many.read("R.firsts") == 1


@pytest.mark.slow
def test_a_task_that_a_variable_starts_is_looked_at_in_every_scan() -> None:
    text = PROGRAM.replace("{trap}", ";").replace("{quick}", "T#10ms").replace(
        "TASK Slow(INTERVAL := T#25ms,", "TASK Slow(SINGLE := Go,")
    text = text.replace("CONFIGURATION C", "CONFIGURATION C\nVAR_GLOBAL Go : BOOL; END_VAR")
    compilation = compile_text(text)
    assert compilation.image, [diagnostic.render() for diagnostic in compilation.diagnostics]
    many = Plc(compilation.image, engine="native")
    many.run(scans=50)
    many.write("Go", True)
    many.run(scans=50)
    assert many.read("Q.n") == 1
    many.breakpoints.line("Main" if "PROGRAM Main" in text else "Other", when="Q.n = 99")
    many.write("Go", False)
    many.run(scans=50)
    many.write("Go", True)
    many.run(scans=50)
    assert many.read("Q.n") == 2


@pytest.mark.slow
def test_with_breakpoints_they_end_before_the_scan_that_stops() -> None:
    seen = []
    for choice in ("python", "native"):
        plc = Plc(IMAGE, engine=choice)
        plc.breakpoints.change("P.tp.Q")
        plc.breakpoints.condition("R.n > 77 AND Q.n MOD 2 = 0")
        plc.breakpoints.line("Other", when="P.n = 120")
        halts = []
        end = 400
        while plc.run(scans=end - plc.scans) == "break":
            halts.append((str(plc.halted), bytes(plc.memory.u8)))
        seen.append((halts, state(plc)))
    assert len(seen[0][0]) > 10
    assert seen[0] == seen[1]


@pytest.mark.slow
def test_with_breakpoints_they_are_used(monkeypatch: pytest.MonkeyPatch) -> None:
    plc = Plc(IMAGE, engine="native")
    plc.breakpoints.change("P.n", when="P.n = 5000")
    assert plc.run(scans=10) == "scans"
    scans, scan = [], plc.scan

    def counted() -> None:
        scans.append(plc.scans)
        scan()

    monkeypatch.setattr(plc, "scan", counted)
    assert plc.run(scans=10_000) == "break"
    assert plc.halted and plc.halted.scan == scans[0] == 4999 and len(scans) == 1


@pytest.mark.slow
@pytest.mark.parametrize(("budget", "done"), [(105, 20), (104, 0)])
def test_with_breakpoints_each_of_them_has_the_whole_budget(budget: int, done: int) -> None:
    made = compile_text("PROGRAM Main VAR n, i : INT; END_VAR FOR i := 1 TO 50 DO ; END_FOR n := n + 1; END_PROGRAM", lint=False)
    assert made.image is not None
    plc = Plc(made.image, budget=budget, engine="native")
    plc.breakpoints.condition("Main.n < 0")
    assert (plc.run(scans=20), plc.read("Main.n")) == ("scans" if done else "trap", done)


# --- with units -------------------------------------------------------------------------------------------------------

OPENING = """
PROGRAM Main
VAR
  n : UDINT; wanted : UDINT := {wanted}; opened : UDINT;
  open AT %CIO1519.2 : BOOL; socket AT %D30018 : WORD; host AT %D30020 : ARRAY [0..1] OF WORD; port AT %D30022 : WORD;
  link AT %CIO1517 : WORD; t : TON;
END_VAR
  n := n + 1;
  t(IN := TRUE, PT := T#700ms);
  IF n = wanted THEN
    socket := 1; host[0] := 16#C0A8; host[1] := 16#FA01; port := 502; open := TRUE;
  END_IF;
  IF n = wanted / 2 THEN link := 0; END_IF;
  IF n > wanted AND NOT open AND opened = 0 THEN opened := n; END_IF;
END_PROGRAM
"""


def with_unit(engine: str, wanted: int, timing: str = "exact") -> Plc:
    compilation = compile_text(OPENING.replace("{wanted}", str(wanted)))
    assert compilation.image, [diagnostic.render() for diagnostic in compilation.diagnostics]
    network = LoopNetwork()
    network.place(Peer("192.168.250.1", 502), ModbusPeer(registers.server()))
    plc = Plc(compilation.image, engine=engine)
    plc.attach(Etn21(timing=timing), network)
    return plc


@pytest.mark.slow
@pytest.mark.parametrize("timing", first_quick(["exact", "real"]))
@pytest.mark.parametrize("wanted", first_quick([2, 3, 40, 4000]))
def test_a_unit_with_nothing_to_do_does_not_hinder_them(wanted: int, timing: str) -> None:
    many, one, python = (with_unit(engine, wanted, timing) for engine in ("native", "native", "python"))
    single(one)
    for count in (1, 30, wanted, 3000):
        for plc in (many, one, python):
            plc.run(scans=count)
        assert state(many) == state(one) == state(python)
    assert many.read("Main.opened") == python.read("Main.opened") != 0


@pytest.mark.slow
def test_with_an_idle_unit_they_are_used(monkeypatch: pytest.MonkeyPatch) -> None:
    plc = with_unit("native", 1_000_000)
    plc.run(scans=10)
    monkeypatch.setattr(plc, "scan", lambda: pytest.fail("a single scan"))
    assert plc.run(scans=10_000) == "scans"


@pytest.mark.slow
def test_a_unit_that_something_is_done_to_takes_part_again() -> None:
    plc = with_unit("native", 1_000_000)
    plc.run(scans=100)
    unit = plc.units[0].unit
    assert isinstance(unit, Etn21)
    unit.error_status = 0x4000
    plc.run(scans=100)
    assert plc.read("CIO1518") == 0x4000
    plc.write("A501", 1)
    plc.run(scans=1)
    assert plc.read("A302") == 1
    plc.run(scans=100)
    assert plc.read("A302") == 0


@pytest.mark.slow
def test_a_unit_that_is_taken_away_and_comes_back_takes_part() -> None:
    plc = with_unit("native", 1_000_000)
    plc.run(scans=100)
    taken = plc.units.pop()
    plc.write("CIO1517", 0)
    plc.run(scans=100)
    assert plc.read("CIO1517") == 0
    plc.units.append(taken)
    plc.run(scans=1)
    assert plc.read("CIO1517") != 0


@pytest.mark.slow
def test_faults_by_the_number_of_a_scan_count_all_scans() -> None:
    plc = with_unit("native", 1_000_000)
    plc.run(scans=5000)
    link = plc.units[0].link
    assert isinstance(link, LoopLink)
    plc.write("D30018", 1)
    plc.write("CIO1519.2", True)
    plc.run(scans=1)
    assert link.scan == 5000


@pytest.mark.slow
def test_the_loop_that_waits_for_nobody_uses_them(monkeypatch: pytest.MonkeyPatch) -> None:
    plc = with_unit("native", 4980)
    begun: list[int] = []
    scan = plc.scan

    def counted(now_ns: int) -> None:
        begun.append(plc.scans)
        scan(now_ns)

    monkeypatch.setattr(plc, "scan", counted)
    write = TimedWrite(plc.find("D7"), 5, at_ns=1234 * plc.cycle_ns)
    assert loop.run(plc, scans=5000, writes=[write]) == "scans"
    assert (plc.scans, plc.now_ns, plc.read("D7")) == (5000, 4999 * plc.cycle_ns, 5)
    assert len(begun) < 30  # from the open on each scan is one of its own
    assert plc.scan_times.count == 5000
