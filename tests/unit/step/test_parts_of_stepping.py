"""Parts of stepping alone: values of properties, filters between two scans, ends of statements, how far nothing is done."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any

import pytest
from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image, Site
from fbvm.machine.plc import Plc
from fbvm.step import commands as step_commands
from fbvm.step.commands import CommandError, Commands
from fbvm.step.filters import BetweenScans
from fbvm.step.position import Position
from fbvm.step.properties import Properties
from fbvm.step.scan_replay import ScanReplay
from fbvm.step.search import MOST_AT_ONCE, LiveRunner, PastRunner, Runner
from fbvm.step.session import Session
from fbvm.step.statement_ends import StatementEnds
from fbvm.step.stop_report import StopReport
from fbvm.step.world import Debugged, World

MS = 1_000_000
MOTORS = """\
FUNCTION Twice : INT
VAR_INPUT a : INT; END_VAR
    Twice := Again(a) * 2;
END_FUNCTION
FUNCTION Again : INT
VAR_INPUT a : INT; END_VAR
    Again := a;
END_FUNCTION
FUNCTION_BLOCK Motor
VAR_INPUT other : REF_TO Motor; END_VAR
VAR k : INT := 3; END_VAR
PROPERTY Speed : INT
GET Speed := Twice(k); END_GET
END_PROPERTY
PROPERTY Deep : INT
GET Deep := Twice(Speed) + 1; END_GET
END_PROPERTY
PROPERTY Bad : INT
GET Bad := 10 / (k - 3); END_GET
END_PROPERTY
END_FUNCTION_BLOCK
PROGRAM Main
VAR one : Motor := (k := 5); two : Motor; found : REF_TO Motor; none : REF_TO Motor; n : INT; END_VAR
    found := REF(one); one.other := REF(two); n := one.Speed;
END_PROGRAM
"""


@cache
def motors() -> Image:
    image = compile_text(MOTORS, lint=False).image
    assert image is not None
    return image


def session() -> Session:
    made = Session.of(lambda: Plc(motors()))
    made.goto(1)
    return made


@pytest.mark.slow
def test_properties_are_read_through_calls_and_references() -> None:
    made = session()
    values: dict[str, object] = {}
    for text in ("Main.one.Speed", "Main.two.Speed", "Main.one.Deep", "Main.found^.Speed", "Main.one.other^.Deep",
                 "Main.none^.Speed", "Main.one.Nobody", "Main.n.Speed", "Main.one"):  # fmt: skip
        try:
            found = made.property(text, made.scope(None))
            values[text] = (found.place.name, found.value) if found else None
        except LookupError as error:
            values[text] = type(error).__name__
    assert values == {
        "Main.one.Speed": ("Main.one.Speed", 10), "Main.two.Speed": ("Main.two.Speed", 6), "Main.one.Deep": ("Main.one.Deep", 21),
        "Main.found^.Speed": ("Main.one.Speed", 10), "Main.one.other^.Deep": ("Main.two.Deep", 13), "Main.none^.Speed": None,
        "Main.one.Nobody": None, "Main.n.Speed": None, "Main.one": None}
    with pytest.raises(ValueError, match=r"Main.two.Bad cannot be computed: R0101 .* divided by 0"):
        made.property("Main.two.Bad", made.scope(None))
    assert made.read("Main.n") == 10, "nothing was done to the program"


@pytest.mark.slow
def test_a_run_that_reaches_no_breakpoint_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(step_commands, "LOOK_AHEAD_NS", 55 * MS)
    made = session()
    commands = Commands(made, StopReport(made, {"text.st": MOTORS}))
    list(commands.run("break Main.n = 77"))
    assert next(iter(commands.run("run"))) == "no breakpoint was reached in 5 scans"
    assert made.here.scan == 6
    said = list(commands.run("run 25ms"))
    assert said[0].startswith("scan 9, 90ms") and made.here.scan == 9, "who says for how long is told nothing more"


@each_of(("times_ms", "wanted", "late"), [
    ((0, 10, 20, 30), frozenset(), [""] * 4), ((0, 10, 30, 40), frozenset(), ["", "", "scan 2 began 10ms late", ""]),
    ((0, 10, 29, 40), frozenset(), [""] * 4), ((0, 10, 25, 31), frozenset({5}), ["", "", "scan 2 began 5ms late", ""]),
    ((0, 10, 24, 31), frozenset({5}), [""] * 4), ((0, 10, 24, 36), frozenset({5, 2}), ["", "", "scan 2 began 4ms late",
                                                                                    "scan 3 began 2ms late"]),
    ((0, 30, 40, 50), frozenset(), ["", "scan 1 began 20ms late", "", ""]), ((0, 10, 20, 30), frozenset({0}), [""] * 4),
])  # fmt: skip
def test_late_scans_by_the_time_that_is_asked_for(times_ms: tuple[int, ...], wanted: frozenset[int], late: list[str]) -> None:
    plc: Any = SimpleNamespace(now_ns=0, cycle_ns=10 * MS, scans=0, units=[])
    filters = BetweenScans({"late": wanted})
    filters.attached(plc)
    found = []
    for number, time_ms in enumerate(times_ms):
        plc.now_ns, plc.scans = time_ms * MS, number + 1
        stops = filters.checked(plc)
        found.append((filters.found, filters.kind) if stops else ("", ""))
        assert stops is bool(found[-1][0])
    assert [text for text, _ in found] == late and {kind for text, kind in found if text} <= {"late"}
    others = BetweenScans({"response": frozenset()})
    others.attached(plc)
    plc.now_ns += 100 * MS
    assert not others.checked(plc), "nobody asks for late scans"


class Units:
    """A PLC with two units whose response codes are told; one has meanings."""

    def __init__(self) -> None:
        self.codes = {"D1": 0, "D2": 0}
        self.now_ns, self.cycle_ns, self.scans = 0, 10 * MS, 5
        one = SimpleNamespace(descriptions={"D1": "Response Code of 1", "D9": "other"}, meanings={"D1": {5: "no such node"}})
        self.units: list[Any] = [SimpleNamespace(unit=unit, network=None) for unit in (
            one, SimpleNamespace(descriptions={"D2": "Response Code"}), SimpleNamespace())]  # fmt: skip

    def find(self, address: str) -> Any:
        from fbvm.base.types import WORD
        from fbvm.watch.paths import Place

        return Place(address, WORD, int(address[1:]))

    def read(self, place: Any) -> int:
        return self.codes[place.name]


@each_of(("wanted", "codes", "said"), [
    ((), {"D1": 5}, "D1 Response Code is 16#0005: no such node"), ((), {"D1": 6}, "D1 Response Code is 16#0006"),
    ((), {"D2": 0x302}, "D2 Response Code is 16#0302"), ((0x302,), {"D2": 0x302}, "D2 Response Code is 16#0302"),
    ((1,), {"D2": 0x302}, ""), ((), {"D1": 0}, ""), ((7,), {"D1": 6, "D2": 7}, "D2 Response Code is 16#0007"),
])  # fmt: skip
def test_response_codes_that_come_anew(wanted: tuple[int, ...], codes: dict[str, int], said: str) -> None:
    plc: Any = Units()
    filters = BetweenScans({"response": frozenset(wanted)})
    filters.attached(plc)
    assert not filters.checked(plc)
    plc.codes |= codes
    assert filters.checked(plc) is bool(said) and (filters.found, filters.kind) == (said, "response" if said else "")
    assert not filters.checked(plc), "it stays as it is"
    plc.codes |= dict.fromkeys(codes, 0)
    assert not filters.checked(plc), "none any more"


def test_a_scan_that_differs_is_told_with_its_number() -> None:
    plc: Any = SimpleNamespace(now_ns=0, cycle_ns=1, scans=8, units=[])
    for wanted, differs, found in (({"differs": frozenset[int]()}, lambda scan: scan == 7, True), ({}, lambda scan: True, False),
                                   ({"differs": frozenset[int]()}, lambda scan: scan == 8, False)):  # fmt: skip
        filters = BetweenScans(wanted, differs)
        filters.attached(plc)
        assert filters.checked(plc) is found
        assert filters.found == ("scan 7 comes out differently here: its memory is not the recorded one" if found else "")


def test_where_statements_end() -> None:
    text = "PROGRAM Main\nVAR n : INT; END_VAR\n    n := 1; IF n = 1\n    THEN n := 2;\n    END_IF;\nEND_PROGRAM\n"
    ends = StatementEnds({"a.st": text})
    rows = {(3, 5): (3, 11), (3, 13): (5, 11), (4, 10): (4, 16), (3, 6): None, (9, 1): None}
    assert {place: ends.end(Site("a.st", "Main", *place)) for place in rows} == rows
    assert ends.end(Site("gone.st", "Main", 3, 5)) is None


def live(scans: int, **more: Any) -> Any:
    given = {"actions": [], "timed": {}, "waiting": [], **more}
    return SimpleNamespace(plc=SimpleNamespace(scans=scans, elapsed_ns=scans * 10 * MS, cycle_ns=10 * MS), **given)


@each_of(("made", "pace", "wanted"), [
    (live(5), None, 100), (live(5), object(), 5), (live(5, actions=[Position(3), Position(9), Position(7)]), None, 7),
    (live(5, actions=[Position(5)]), None, 5), (live(5, actions=[Position(200)]), None, 100), (live(5, timed={5: []}), None, 5),
    (live(5, timed={6: []}), None, 100), (live(5, waiting=[SimpleNamespace(at_ns=80 * MS)]), None, 8),
    (live(5, waiting=[SimpleNamespace(at_ns=81 * MS)]), None, 9), (live(5, waiting=[SimpleNamespace(at_ns=0)]), None, 5),
    (live(5, waiting=[SimpleNamespace(at_ns=80 * MS)], actions=[Position(6)]), None, 6),
])  # fmt: skip
def test_up_to_which_scan_nothing_is_done_from_outside(made: Any, pace: object, wanted: int) -> None:
    world: Any = SimpleNamespace(_live={"a": made}, _pace=pace)
    assert World.quiet_until(world, "a", 100) == wanted


def test_what_was_done_inside_a_scan() -> None:
    world: Any = SimpleNamespace(_live={"a": SimpleNamespace(actions=[Position(3), Position(4, 2), Position(6, 1)])})
    asked = range(9), range(5, 9), range(4), range(7, 9)
    assert [World.unchanged_until(world, "a", scans) for scans in asked] == [4, 6, 4, 9]


def test_a_reference_stands_for_the_instance_behind_it() -> None:
    made = session()
    read = Properties(made.facts)
    found, none = made.find("Main.found"), made.find("Main.none")
    assert [read._instance(place, made.memory) for place in (found, none)] == ["Main.one", ""]  # type: ignore[arg-type]


def test_a_program_that_has_ended_executes_no_more_scans() -> None:
    image = compile_text("PROGRAM Main VAR n, k : INT; END_VAR n := n + 1; k := 10 / (2 - n); END_PROGRAM").image
    assert image is not None
    made = Session.of(lambda: Plc(image))
    assert not made.run(lambda statement: False, 5) and made.trap is not None and made.here.scan == 1
    made.world.advance(made.name, 9)
    plc = made.world[made.name]
    scans = plc.scans
    made.world.scan(made.name)
    assert plc.scans == scans and plc.trap is not None
    replay = ScanReplay(plc)
    assert not replay.play(plc.snapshot(), {}, lambda number, statement: True) and replay.count == 0


class Pace:
    """Real time, as far as a world asks for it."""

    def __init__(self) -> None:
        self.said: list[object] = []

    def begin(self) -> None:
        self.said.append("begin")

    def wait(self, elapsed_ns: int) -> int:
        self.said.append(elapsed_ns)
        return elapsed_ns + 7


def test_scans_in_real_time_wait_for_their_time_and_have_the_time_that_it_is() -> None:
    image = compile_text(MOTORS, lint=False).image
    assert image is not None
    pace: Any = Pace()
    world = World(lambda: [Debugged("plc", Plc(image))], is_fixed=True, pace=pace)
    world.begin()
    for _ in range(2):
        world.scan("plc")
    assert pace.said == ["begin", 0, world["plc"].cycle_ns + 7] and world["plc"].now_ns == world["plc"].cycle_ns + 14
    World(lambda: [Debugged("plc", Plc(image))]).begin()


@each_of(("quiet", "checks", "moved", "asked"), [
    (10, False, True, [8]), (10, True, False, []), (3, False, False, []), (4, False, True, [2]), (2, False, False, []),
    (9999, False, True, [MOST_AT_ONCE])])
def test_scans_that_nobody_looks_into_are_executed_at_once(quiet: int, checks: bool, moved: bool, asked: list[int]) -> None:
    found: list[int] = []
    plc = SimpleNamespace(scans=2, scan_many=lambda left: found.append(left) or True)
    runner: Any = SimpleNamespace(check=object() if checks else None, plc=plc, _name="a",
                                  _world=SimpleNamespace(quiet_until=lambda name, scan: quiet))
    assert bool(LiveRunner.many(runner, 9999)) is moved and found == asked
    scene = SimpleNamespace(unchanged_until=lambda scans: (scans.start, scans.stop))
    past: Any = SimpleNamespace(check=runner.check, plc=plc, _scene=scene, _again=SimpleNamespace(many=lambda end: end))
    for scan, end in ((7, 7), (9999, 2 + MOST_AT_ONCE)):
        assert PastRunner.many(past, scan) == (False if checks else (2, end))  # type: ignore[comparison-overlap]


def test_only_a_scan_that_stands_is_taken_back() -> None:
    told: list[str] = []
    world = SimpleNamespace(undo=told.append)
    for halted in (None, object()):
        LiveRunner.undo(SimpleNamespace(_world=world, _name="a", plc=SimpleNamespace(halted=halted)))  # type: ignore[arg-type]
    assert told == ["a"]


@pytest.mark.slow
@each_of(("where", "shown"), [
    ("Main.n", "change of Main.n"), ("Main.n = 10", "Main.n = 10"), ("main", "text.st:24"), ("Main.one", "change of Main.one"),
    ("Twice", "text.st:3"), ("24", "text.st:24"), ("text.st:7", "text.st:7"), ("D0..D3", "change of D0..D3"),
    ("Main.one.Speed", "Main.one.Speed"), ("Motor.Speed.Get", "text.st:13"),
])  # fmt: skip
def test_what_a_breakpoint_is_follows_from_how_its_place_is_written(where: str, shown: str) -> None:
    made = session()
    assert list(Commands(made, StopReport(made, {"text.st": MOTORS})).run(f"break {where}")) == [f"  1  {shown}"]


@each_of("line, written", [
    ("n := 7", 7), ("n = 8", 8), ("N  :=  9", 9), ("n:=10", 10), ("n =11", 11), ("write n = 12", 12), ("Main.n := 13", 13),
])
def test_an_assignment_is_one_where_its_variable_is_called_as_a_command(line: str, written: int) -> None:
    made = session()
    list(Commands(made, StopReport(made, {"text.st": MOTORS})).run(line))
    assert (made.here, made.read("Main.n")) == (Position(1, 0), written)


@each_of("lines", [26, 10**12])
def test_the_whole_text_is_listed_however_many_lines_are_asked_for(lines: int) -> None:
    made = session()
    rows = list(Commands(made, StopReport(made, {"text.st": MOTORS})).run(f"list {lines}"))
    text = MOTORS.splitlines()
    assert [row[8:] for row in rows] == [line for line in text if line]
    assert [row[2:6].strip() for row in rows] == [str(number) for number, line in enumerate(text, 1) if line]


@pytest.mark.slow
@each_of(("where", "said"), [
    ("Nobody", "there is no Nobody; known here: Main"), ("Main.n >", "'Main.n >' ends too early"),
    ("Main.n + 1", "'Main.n + 1' is no condition: it is not BOOL; compare it with something"),
    ("D99999", "D ends at 32767; 99999 does not exist"),
    ("text.st:27", "text.st:27: the last statement of text.st is on line 24"),
    ("Main#3", "'Main#3' is no rung; 'Main' has no rungs"),
    ("Motor", "'Motor' is neither FILE:LINE nor a POU with statements; POUs are "
              "Again, Main, Motor.Bad.Get, Motor.Deep.Get, Motor.Speed.Get, Twice"),
])  # fmt: skip
def test_a_breakpoint_that_cannot_be_says_why(where: str, said: str) -> None:
    made = session()
    with pytest.raises(CommandError) as error:
        list(Commands(made, StopReport(made, {"text.st": MOTORS})).run(f"break {where}"))
    assert str(error.value) == said


class Rows:
    """The breakpoints of a PLC, and what is done to them, in order."""

    def __init__(self) -> None:
        self.said: list[object] = []
        self.state = "before"

    def clear(self) -> None:
        self.said.append("clear")

    def put(self, row: object) -> None:
        self.said.append(row)

    def begin(self, passes: object) -> None:
        self.said.append(("begin", passes))

    def restore(self, state: str) -> None:
        self.said.append(("restore", state))


class Played(Runner):
    """Executes nothing, and says so."""

    def execute(self) -> None:
        self.plc.breakpoints.said.append("execute")  # type: ignore[attr-defined]

    def many(self, scan: int) -> bool:
        return False


@each_of(("changed", "rows", "halted", "stops", "said"), [
    (True, ["b"], None, True, ["clear", "execute", "clear", "b", ("restore", "seen")]), (False, ["b"], None, False, ["execute"]),
    (True, ["b"], None, False, ["clear", "execute", "clear", "b", ("restore", "seen")]), (True, [], None, False, ["execute"]),
    (True, ["b"], "halt", True, ["execute"]), (False, ["b"], "halt", True, ["execute"]),
])  # fmt: skip
def test_a_scan_in_which_something_was_done_is_played_for_its_stops_and_executed_without(
    changed: bool, rows: list[Any], halted: Any, stops: bool, said: list[object]
) -> None:
    made = Rows()
    plc: Any = SimpleNamespace(breakpoints=made, halted=halted, scans=3)
    scene: Any = SimpleNamespace(changed_inside=lambda scan: changed, stops_in=lambda scan, state: (stops, "seen"))
    check: Any = SimpleNamespace(attached=lambda plc: made.said.append("attached"), checked=lambda plc: plc.scans == 3)
    runner = Played(plc, scene, rows, "kept", {}, check)  # type: ignore[arg-type]
    assert made.said == ["clear", *rows, ("begin", {}), ("restore", "kept"), "attached"]
    made.said.clear()
    assert runner.scan() is stops and made.said == said and runner.stops_behind()
    plc.scans = 4
    assert not runner.stops_behind() and not Played(plc, scene, rows, None, {}, None).stops_behind()
