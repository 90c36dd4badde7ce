"""Breakpoints: a run stops at a line, a change or a condition, the same on every engine, and goes on as if it had not."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from rows import each_of

from fbvm import Plc, compile_text
from fbvm.code.image import Image
from fbvm.engine.choice import tiers
from fbvm.engine.native import engine as native
from fbvm.engine.native.code import code_of
from fbvm.machine.breakpoints import Halt, _of_instance
from fbvm.machine.plc import Mode, Phase
from fbvm.watch.conditions import ConditionError

TEXT = """\
FUNCTION_BLOCK Adder
VAR_INPUT a : INT; END_VAR
VAR_OUTPUT n : INT; END_VAR
  n := n + a;
  IF n = 12 THEN
    n := n - 1;
    n := n + 1;
  END_IF;
END_FUNCTION_BLOCK

PROGRAM Main
VAR i : INT; f : Adder; g : Adder; d AT %D100 : INT; lamp AT %CIO5.03 : BOOL; x : LREAL; s : STRING; END_VAR
  FOR i := 1 TO 3 DO
    f(a := i);
  END_FOR;
  g(a := 1); d := f.n;
  lamp := g.n MOD 2 = 0;
  x := x + 0.5;
  IF g.n = 4 THEN s := 'four'; END_IF;
END_PROGRAM
"""
ENGINES = [pytest.param(choice, marks=pytest.mark.skipif(choice == "native" and not native.available(),
                                                         reason="llvmlite is not installed"))
           for choice in ("python", "native")]  # fmt: skip


def image(text: str = TEXT) -> Image:
    compilation = compile_text(text)
    assert compilation.image, [diagnostic.render() for diagnostic in compilation.diagnostics]
    return compilation.image


@pytest.fixture(params=ENGINES)
def plc(request: pytest.FixtureRequest) -> Plc:
    return Plc(image(), engine=request.param)


def halts(plc: Plc, scans: int = 12) -> Iterator[Halt]:
    """Every stop of so many scans."""
    end = plc.scans + scans
    while plc.run(scans=end - plc.scans) == "break":
        assert plc.halted
        yield plc.halted


def line_of(halt: Halt) -> int:
    assert halt.site
    return halt.site.line


# --- lines ----------------------------------------------------------------------------------------------------------


def test_a_line_stops_before_its_statement(plc: Plc) -> None:
    plc.breakpoints.line("text.st:18")
    assert plc.run(scans=5) == "break"
    assert plc.halted and line_of(plc.halted) == 18
    assert plc.read("Main.g.n") == 1 and plc.read("Main.x") == 0.0
    assert plc.run(scans=1) == "scans" and plc.scans == 1 and plc.read("Main.x") == 0.5


def test_a_scan_that_stands_is_ended_by_the_next_one(plc: Plc) -> None:
    plc.breakpoints.line("text.st:18")
    assert plc.scan() is None and plc.halted and plc.scans == 0
    assert plc.scan() is None and not plc.halted and plc.scans == 1
    assert plc.read("Main.x") == 0.5


def test_a_line_without_statement_means_the_next_one(plc: Plc) -> None:
    assert plc.breakpoints.line("text.st:10").where == "text.st:13"


def test_the_name_of_a_pou_means_its_first_statement(plc: Plc) -> None:
    plc.breakpoints.line("adder")
    frames = [[(frame.pou, frame.site and frame.site.line) for frame in halt.frames] for halt in halts(plc, 1)]
    assert frames == [[("Adder", 4), ("Main", 14)]] * 3 + [[("Adder", 4), ("Main", 16)]]


def test_frames_tell_the_instances(plc: Plc) -> None:
    plc.breakpoints.line("text.st:4")
    bases = [halt.frames[0].base for halt in halts(plc, 1)]
    assert bases[0] == bases[1] == bases[2] == plc.find("Main.f").offset  # type: ignore[union-attr]
    assert bases[3] == plc.find("Main.g").offset  # type: ignore[union-attr]


def test_of_several_statements_on_a_line_the_first_counts(plc: Plc) -> None:
    plc.breakpoints.line("text.st:16")
    assert [line_of(halt) for halt in halts(plc, 2)] == [16, 16]


def test_a_line_with_a_condition(plc: Plc) -> None:
    plc.breakpoints.line("text.st:4", when="Main.f.a = 3 AND Main.f.n > 10")
    first = next(halts(plc, 3))
    assert (first.scan, first.frames[0].base) == (1, plc.find("Main.g").offset)  # type: ignore[union-attr]


@each_of("where, when, stops", [
    ("Main", "i = 0 AND x = 0.0", [(0, 0)]),
    ("Main", "g.n = 2", [(2, 0)]),
    ("Adder", "n = 1", [(0, 1), (1, 3)]),
    ("Main.g", "n = 1", [(1, 3)]),
])
def test_a_condition_names_variables_of_its_pou_without_a_path(where: str, when: str, stops: list[tuple[int, int]]) -> None:
    """`stops` are the scan and how often the block had been called in it before."""
    plc = Plc(image(), engine="python")
    plc.breakpoints.line(where, when=when)
    assert [(halt.scan, int(str(plc.read("Main.i"))) - 1 if where != "Main" else 0) for halt in halts(plc, 3)] == stops


def test_a_condition_names_variables_of_a_function() -> None:
    plc = Plc(image("""FUNCTION Twice : INT VAR_INPUT x : INT; END_VAR
  Twice := x * 2;
END_FUNCTION
PROGRAM Main VAR n : INT; END_VAR n := n + Twice(n) + 1; END_PROGRAM"""), engine="python")
    plc.breakpoints.line("Twice", when="x = 4")
    assert [halt.scan for halt in halts(plc, 4)] == [2]


def test_a_log_point_tells_once_and_does_not_stop() -> None:
    plc = Plc(image(), engine="python")
    plc.breakpoints.line("Main", message="i is {i}, {{D}} {D100:x} {D100..D101:x}, {nobody}")
    assert plc.run(scans=2) == "scans"
    told = plc.breakpoints.take_told()
    assert [(each.scan, each.text) for each in told] == [
        (0, "i is 0, {D} 16#0000 [16#0000, 16#0000], <there is no nobody; known here: Main>"),
        (1, "i is 4, {D} 16#0006 [16#0006, 16#0000], <there is no nobody; known here: Main>")]
    assert plc.breakpoints.take_told() == []


@pytest.mark.parametrize(("where", "words"), [
    ("text.st:99", "the last statement of text.st is on line 19"), ("other.st:3", "no statement is in 'other.st'"),
    ("Pump", "neither FILE:LINE nor a POU"), ("text.st:", "neither FILE:LINE"), ("", "neither FILE:LINE"),
])  # fmt: skip
def test_places_that_are_none_are_refused(plc: Plc, where: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        plc.breakpoints.line(where)
    assert not plc.breakpoints


# --- changes --------------------------------------------------------------------------------------------------------


def test_a_change_of_an_address_stops_behind_the_write(plc: Plc) -> None:
    plc.breakpoints.change("D100")
    stops = [(halt.scan, line_of(halt), halt.reasons) for halt in halts(plc, 2)]
    assert stops == [(0, 16, ("D100 was 0, is 6",)), (1, 16, ("D100 was 6, is 12",))]


def test_a_change_that_is_undone_in_the_same_scan_is_seen(plc: Plc) -> None:
    plc.breakpoints.change("Main.f.n")
    second = [(line_of(halt), halt.reasons[0]) for halt in halts(plc, 2) if halt.scan == 1]
    assert second[-3:] == [(4, "Main.f.n was 9, is 12"), (6, "Main.f.n was 12, is 11"), (7, "Main.f.n was 11, is 12")]


def test_a_bit_alone_is_watched(plc: Plc) -> None:
    plc.breakpoints.change("CIO 5.03")
    found = [(halt.scan, halt.reasons[0]) for halt in halts(plc, 4)]
    assert [scan for scan, _ in found] == [1, 2, 3]
    assert found[0][1] == "CIO 5.03 was FALSE, is TRUE"


def test_texts_ranges_instances_and_long_values_are_watched(plc: Plc) -> None:
    for name in ("Main.s", "D98..D101", "Main.g", "Main.x"):
        plc.breakpoints.change(name)
    reasons = [reason for halt in halts(plc, 4) if halt.scan == 3 for reason in halt.reasons]
    assert "D100 was 18, is 24" in reasons, "of D98..D101 only this one has changed"
    assert "Main.s was '', is 'four'" in reasons and "Main.x was 1.5, is 2.0" in reasons
    assert "Main.g.n was 3, is 4" in reasons


def test_a_change_from_outside_is_found_at_the_first_statement(plc: Plc) -> None:
    plc.breakpoints.change("D7")
    plc.run(scans=2)
    plc.write("D7", 5)
    assert plc.run(scans=1) == "break"
    assert plc.halted and line_of(plc.halted) == 13 and plc.halted.reasons == ("D7 was 0, is 5",)


@pytest.mark.slow
def test_a_change_with_a_condition(plc: Plc) -> None:
    plc.breakpoints.change("D100", when="D100 > 20")
    assert [halt.scan for halt in halts(plc, 5)] == [3, 4]


def test_what_lies_behind_a_reference_is_refused() -> None:
    plc = Plc(image("PROGRAM Main VAR n : INT; r : REF_TO INT; END_VAR\nr := REF(n); n := n + 1;\nEND_PROGRAM"))
    with pytest.raises(ValueError, match="lies behind a reference"):
        plc.breakpoints.change("Main.r^")


# --- conditions -----------------------------------------------------------------------------------------------------


def test_a_condition_stops_when_it_becomes_true(plc: Plc) -> None:
    plc.breakpoints.condition("Main.f.n > 30 AND NOT Main.lamp")
    stops = [(halt.scan, halt.reasons[0]) for halt in halts(plc, 10)]
    assert stops[0] == (5, "Main.f.n > 30 AND NOT Main.lamp holds")
    assert [scan for scan, _ in stops] == [5, 6, 8]


def test_a_condition_that_holds_already_waits_until_it_becomes_true_again(plc: Plc) -> None:
    plc.breakpoints.condition("Main.g.n < 3")
    assert [*halts(plc, 5)] == []


def test_a_condition_that_is_none_is_refused(plc: Plc) -> None:
    with pytest.raises(ConditionError):
        plc.breakpoints.condition("D100 +")
    with pytest.raises(ConditionError):
        plc.breakpoints.line("text.st:4", when="D100")
    with pytest.raises(ValueError, match="ends too early"):
        plc.breakpoints.condition("")


# --- engines agree --------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.skipif(not native.available(), reason="llvmlite is not installed")
@pytest.mark.parametrize("level", [0, 2])
def test_engines_stop_at_the_same_observations_with_the_same_memory(level: int) -> None:
    program = image()
    code_of(program, stops=True).prepare(level)
    seen = []
    for choice in ("python", "native"):
        plc = Plc(program, engine=choice)
        for where in ("D100", "CIO 5.03", "Main.x", "Main.f.n"):
            plc.breakpoints.change(where)
        plc.breakpoints.line("text.st:4", when="Main.f.n MOD 5 = 0")
        plc.breakpoints.line("text.st:19")
        plc.breakpoints.condition("Main.g.n = 3 OR Main.s = 'four'")
        seen.append([(str(halt), halt.frames, bytes(plc.memory.u8)) for halt in halts(plc, 8)])
    assert len(seen[0]) > 40
    assert seen[0] == seen[1]


def test_memory_is_that_of_a_run_that_nobody_stopped(plc: Plc) -> None:
    plain = Plc(plc.image, engine="python")
    plc.breakpoints.change("Main.f.n")
    plc.breakpoints.line("text.st:6")
    for _ in range(6):
        plain.scan()
        while plc.scans < plain.scans:
            plc.scan()
        assert bytes(plc.memory.u8) == bytes(plain.memory.u8)


@pytest.mark.skipif(not native.available(), reason="llvmlite is not installed")
def test_a_run_with_breakpoints_becomes_machine_code_when_that_pays(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fbvm.engine.choice.stoppable.STATEMENTS_TO_PAY", 100)
    program = image()
    plc = Plc(program)
    assert isinstance(plc.engine, tiers.TieredEngine)
    plc.breakpoints.change("D100", when="D100 = 60")
    code = code_of(program, stops=True)
    monkeypatch.setattr(code, "request", lambda: code.prepare(2))
    assert plc.run(scans=50) == "break"
    assert plc.halted and plc.halted.scan == 9
    assert plc.breakpoints._stoppable and plc.breakpoints._stoppable.native


@pytest.mark.skipif(not native.available(), reason="llvmlite is not installed")
def test_what_a_test_raises_in_machine_code_comes_out() -> None:
    plc = Plc(image(), engine="native")
    plc.breakpoints.line("text.st:18", when="D100 = 6")

    def read(place: object) -> int:
        raise RuntimeError("the reader is broken")

    plc.read = read  # type: ignore[assignment,method-assign]
    with pytest.raises(RuntimeError, match="the reader is broken"):
        plc.scan()


# --- on a PLC -------------------------------------------------------------------------------------------------------


def test_a_run_without_breakpoints_any_more_ends_the_scan_that_stands(plc: Plc) -> None:
    point = plc.breakpoints.line("text.st:14")
    plc.scan()
    assert plc.halted and plc.halted.breakpoints == (point,) and list(plc.breakpoints) == [point]
    plc.breakpoints.remove(point)
    with pytest.raises(KeyError):
        plc.breakpoints.remove(point)
    assert plc.run(scans=3) == "scans" and plc.read("D100") == 18
    plc.breakpoints.line("text.st:14")
    plc.breakpoints.clear()
    assert plc.run(scans=1) == "scans"


def test_tasks_behind_the_one_that_stands_run_afterwards() -> None:
    text = TEXT + """
    PROGRAM Other VAR n : INT; END_VAR
      n := n + 1;
    END_PROGRAM
    CONFIGURATION C
      TASK Quick(INTERVAL := T#10ms, PRIORITY := 1);
      TASK Slow(INTERVAL := T#20ms, PRIORITY := 2);
      PROGRAM Main WITH Quick : Main;
      PROGRAM Later WITH Slow : Other;
    END_CONFIGURATION"""
    plc = Plc(image(text))
    plc.breakpoints.line("Main")
    assert plc.run(scans=4) == "break" and plc.read("Later.n") == 0
    plc.scan()
    assert plc.read("Later.n") == 1 and plc.read("D100") == 6


def test_phases_watchers_and_forces_wait_for_the_end(plc: Plc) -> None:
    told: list[object] = []
    plc.phases.append(lambda plc, phase: told.append(phase))
    plc.watchers.append(lambda plc: told.append("watcher"))
    plc.force("Main.lamp", True)
    plc.breakpoints.line("text.st:18")
    plc.scan()
    assert told == [Phase.INPUTS] and plc.read("Main.lamp") is False
    plc.scan()
    assert told == [Phase.INPUTS, Phase.PROGRAM, Phase.REFRESH, "watcher"] and plc.read("Main.lamp") is True


def test_a_trap_behind_a_breakpoint_stops_the_run(plc: Plc) -> None:
    text = "PROGRAM Main VAR n : INT; END_VAR\nn := n + 1;\nn := n / (n - 1);\nEND_PROGRAM"
    plc = Plc(image(text), engine="python")
    plc.breakpoints.line("text.st:3")
    assert plc.run(scans=2) == "break"
    assert plc.run(scans=2) == "trap"


def test_a_restart_leaves_the_scan_that_stands(plc: Plc) -> None:
    plc.breakpoints.line("text.st:18")
    before = plc.snapshot()
    plc.scan()
    with pytest.raises(ValueError, match="stands at a breakpoint"):
        plc.snapshot()
    plc.cold_start()
    assert not plc.halted and plc.read("D100") == 0
    plc.scan()
    assert plc.halted
    plc.restore(before)
    assert not plc.halted
    plc.mode = Mode.PROGRAM
    plc.scan()
    assert plc.scans == 1


def test_a_scan_that_was_given_up_stops_no_later_one(plc: Plc) -> None:
    where = plc.breakpoints.line("text.st:15")
    later = plc.breakpoints.change("D100", when="D100 > 12")
    plc.scan()
    assert plc.halted
    plc.warm_start()
    plc.breakpoints.remove(where)
    for _ in range(2):
        plc.scan()
        assert plc.halted is None
    plc.scan()
    assert plc.halted and plc.halted.breakpoints == (later,)


def test_a_block_in_python_stands_in_with_breakpoints_too() -> None:
    from fbvm.engine.choice.tiers import python_of

    plc = Plc(image())
    number = next(n for n, body in enumerate(plc.image.bodies) if body.name == "Adder")
    plc.breakpoints.change("Main.f.n")
    python_of(plc.engine).substitute(number, lambda base: plc.write("Main.f.n", 77))
    assert next(halts(plc, 1)).reasons == ("Main.f.n was 0, is 77",)


def test_a_recorder_of_every_statement_excludes_breakpoints() -> None:
    from fbvm.record.trace.events import ObservedEngine

    plc = Plc(image())
    plc.engine = ObservedEngine(plc.image, plc.memory, lambda event: None, plc.engine)
    with pytest.raises(ValueError, match="looks into every scan already"):
        plc.breakpoints.line("text.st:18")


def test_of_what_is_large_the_part_that_changed_is_told() -> None:
    made = compile_text("""TYPE Zone : STRUCT Jams : INT; Level : REAL; END_STRUCT END_TYPE
        PROGRAM Main
        VAR Zones : ARRAY [1..2, 0..2] OF Zone; Other : Zone := (Jams := 7, Level := 1.5); n : INT; END_VAR
        n := n + 1;
        CASE n OF
            2: Zones[2, 1].Jams := 5;
            3: Zones[1, 2] := Other;
            4: Zones[1, 1].Level := STRING_TO_REAL('NAN');
        END_CASE
        END_PROGRAM""").image
    assert made is not None
    plc = Plc(made)
    plc.breakpoints.change("Main.Zones")
    assert [halt.reasons[0] for halt in halts(plc, 5)] == [
        "Main.Zones[2, 1].Jams was 0, is 5",
        "Main.Zones[1, 2] was (Jams := 0, Level := 0.0), is (Jams := 7, Level := 1.5)",
        "Main.Zones[1, 1].Level was 0.0, is nan",
    ]  # fmt: skip


def test_breakpoints_are_set_again_on_another_plc_and_removed() -> None:
    first, second = (Plc(image(), engine="python") for _ in range(2))
    points = first.breakpoints
    made = [points.line("text.st:18", "i = 4", "= 2"), points.line("Adder", message="n is {n}"),
            points.change("Main.g.n", "Main.i > 0", "3"), points.condition("Main.x > 1.0", "1"), points.statement()]
    assert list(points) == made and len(points) == 5 and [str(each) for each in made] == [
        "text.st:18 when i = 4", "text.st:4", "Main.g.n when Main.i > 0", "Main.x > 1.0", "the next statement"]
    assert [second.breakpoints.put(each) for each in made] == made
    assert [each.kind for each in second.breakpoints] == ["line", "line", "change", "condition", "statement"]
    second.breakpoints.remove(made[-1])
    assert list(second.breakpoints) == made[:-1] and second.breakpoints.armed
    reasons = [halt.reasons for halt in halts(second, 6)]
    assert reasons[0] == ("breakpoint text.st:18 when i = 4",) and ("Main.x > 1.0 holds",) in reasons
    second.breakpoints.clear()
    assert not second.breakpoints.armed and second.run(scans=2) == "scans"
    with pytest.raises(KeyError):
        second.breakpoints.remove(made[0])


@each_of(("held", "here", "wanted"), [
    (None, 5, True), (None, 6, False), (None, None, None), (True, 5, True), (False, 5, False), (True, 6, False),
    (True, None, None), (None, 0, False)])
def test_a_line_of_one_instance_stops_there_alone(held: bool | None, here: int | None, wanted: bool | None) -> None:
    test = _of_instance(5, None if held is None else lambda base: held)
    assert test(here) is wanted
