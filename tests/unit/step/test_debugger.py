"""The debugger: breakpoints at full speed, forth and back, that stand where stepping stands."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from depth import times
from hypothesis import given, settings
from hypothesis import strategies as st

from fbvm.code.compiler import compile_text
from fbvm.engine.observation import NO_SITE
from fbvm.machine.breakpoints import Breakpoint
from fbvm.machine.plc import Phase, Plc
from fbvm.record.recording import recording as recording_module
from fbvm.record.recording.recording import Recording
from fbvm.record.recording.scans import RecordedScans
from fbvm.record.trace.events import Event, Statement
from fbvm.record.trace.scan_source import Moment
from fbvm.run.running import TimedWrite
from fbvm.step.debugger import BEFORE, Debugger, Move
from fbvm.step.past_session import PastSession
from fbvm.step.position import Position, Reached, Said
from fbvm.step.session import Session
from fbvm.step.world import Debugged, ReadOnlyPast, World

TEXT = """\
FUNCTION_BLOCK Twice
VAR_INPUT A : INT; END_VAR
VAR_OUTPUT Q : INT; END_VAR
    Q := A;
    Q := Q * 2;
END_FUNCTION_BLOCK
PROGRAM Main
VAR
    Button AT CIO 0.00 : BOOL;
    N, R : INT;
    T, U : Twice;
END_VAR
    N := N + 1;
    T(A := N);
    U(A := T.Q);
    IF Button THEN
        R := 100 / (N - 5);
    END_IF;
END_PROGRAM
"""


def debugger(text: str = TEXT, writes: Sequence[tuple[str, object, int]] = (), said: list[Said] | None = None,
             names: Sequence[str] = ("plc",)) -> Debugger:  # fmt: skip
    image = compile_text(text).image
    assert image is not None

    def make() -> list[Debugged]:
        plcs = [Plc(image) for _ in names]
        rows = [TimedWrite(plcs[0].find(name), value, at_ns) for name, value, at_ns in writes]
        return [Debugged(name, plc, rows) for name, plc in zip(names, plcs, strict=True)]

    world = World(make)
    return Debugger({name: Session(world, name) for name in names}, (said if said is not None else []).append)


def done(move: Move) -> Reached | None:
    """Does a whole move."""
    while True:
        try:
            next(move)
        except StopIteration as end:
            reached: Reached | None = end.value
            return reached


def where(found: Debugger) -> tuple[int, int | None]:
    """Scan and line at which the debugger stands."""
    session = found.session
    return session.here.scan, session.facts.sites[session.statement.site].line if session.statement else None


def line(where: str, when: str = "", hits: str = "", message: str = "") -> Breakpoint:
    return Breakpoint("line", where, when, hits, message)


@pytest.mark.slow
def test_a_stop_at_full_speed_is_a_position_of_stepping() -> None:
    found = debugger()
    found.here.put([line("text.st:5", "Main.N = 300")])
    reached = done(found.resume())
    assert reached and reached.position == Position(299, 3) and where(found) == (299, 5)
    done(found.into())
    found.session.back()
    assert found.session.here == reached.position


def test_what_the_guarded_run_says_of_a_halt_is_where_the_session_finds_it() -> None:
    image = compile_text(TEXT).image
    assert image is not None
    plc = Plc(image)
    plc.breakpoints.change("Main.U.Q")
    assert plc.run(scans=5) == "break" and plc.halted
    found = debugger()
    found.here.put([Breakpoint("change", "Main.U.Q")])
    reached = done(found.resume())
    assert reached and reached.position.step == plc.halted.statement and plc.halted.task == 0
    assert reached.reasons == plc.halted.reasons


def test_variables_of_the_block_need_no_path_in_a_condition() -> None:
    found = debugger()
    found.here.put([line("text.st:5", "A = 8")])
    done(found.resume())
    assert where(found) == (1 + 2, 5) and found.session.read("Main.T.A") == 4 * 1
    assert found.session.names.instance(found.session.statement.frame.base) == "Main.U" if found.session.statement else False


def test_one_instance_stops_and_the_other_does_not() -> None:
    found = debugger()
    found.here.put([line("Main.U")])
    for _ in range(2):
        done(found.resume())
        statement = found.session.statement
        assert statement and found.session.names.instance(statement.frame.base) == "Main.U"
    assert where(found) == (1, 4)


@pytest.mark.slow
def test_reverse_goes_to_the_last_change_and_then_to_the_beginning() -> None:
    found = debugger(writes=[("CIO 0.00", True, 70_000_000)])
    done(found.scan(2000))
    found.here.put([Breakpoint("change", "Main.R")])
    reached = done(found.reverse())
    assert reached and reached.reasons[0].startswith("Main.R was 1, is 0") and reached.position.scan == 105
    assert done(found.reverse()) and found.session.here.scan < 105
    found.here.put([])
    assert done(found.reverse()) is None and found.session.here == Position(0, 0)


def test_reverse_stops_at_an_earlier_statement_of_the_same_scan() -> None:
    found = debugger()
    found.session.goto(1)
    for _ in range(4):
        done(found.into())
    found.here.put([line("text.st:14")])
    reached = done(found.reverse())
    assert reached and reached.position == Position(1, 1) and where(found) == (1, 14)


@pytest.mark.slow
def test_reverse_goes_over_to_the_plc_whose_breakpoint_was_reached_last() -> None:
    found = debugger(names=("a", "b"))
    done(found.scan(4))
    found.plcs["a"].put([line("text.st:14", "N = 2")])
    found.plcs["b"].put([line("text.st:14", "N = 3")])
    reached = done(found.reverse())
    assert reached and (reached.plc, found.focus, where(found)) == ("b", "b", (2, 14))
    reached = done(found.reverse())
    assert reached and (reached.plc, found.focus, where(found)) == ("a", "a", (1, 14))


@pytest.mark.slow
def test_a_recording_that_ended_in_a_trap_has_it_at_its_end_only() -> None:
    image = compile_text(TEXT).image
    assert image is not None
    plc = Plc(image)
    recorded = Recording().add("plc", plc)
    plc.write("CIO 0.00", True)
    assert plc.run(scans=20) == "trap"
    session = PastSession(RecordedScans(recorded, {}), "plc")
    assert session.here.scan == 4 and session.trap == plc.trap and session.trap is not None and session.trap.code == "R0101"
    session.goto(3)
    assert session.trap is None and session.read("Main.N") == 3
    found = Debugger({"plc": session})
    reached = done(found.resume())
    assert reached and (reached.kind, reached.position.scan) == ("trap", 4)


def test_passes_before_a_scan_are_those_of_the_scans_before() -> None:
    found = debugger()
    row = line("text.st:13", hits="> 100")
    found.here.put([row])
    done(found.scan(4))
    assert found.here.passes(Position(3, BEFORE)) == {row: 2}, "behind the statement at which it was set"
    assert found.here.passes(Position(3, 0)) == {row: 3}


class FifthScan:
    """Stops a run behind the fifth scan."""

    found, kind = "five scans", "five"

    def attached(self, plc: Plc) -> None:
        """Another PLC executes the scans."""

    def checked(self, plc: Plc) -> bool:
        return plc.scans == 5


@pytest.mark.slow
def test_what_stops_a_run_between_two_scans_is_stood_at_on_its_plc() -> None:
    found = debugger(names=("a", "b"))
    found.checks = {"b": FifthScan()}
    reached = done(found.resume(20))
    assert reached == Reached("b", Position(5), NO_SITE, (), ("five scans",), "five")
    assert found.focus == "b" and {plc.session.here for plc in found.plcs.values()} == {Position(5)}
    assert done(found.resume(20)) is None and found.session.here == Position(20)
    assert done(found.reverse()) == reached and found.focus == "b"


@pytest.mark.slow
def test_a_hit_count_belongs_to_the_past() -> None:
    found = debugger()
    found.here.put([line("text.st:5", hits="7")])
    done(found.resume())
    assert where(found) == (3, 5)
    found.session.goto(1)
    done(found.resume())
    assert where(found) == (3, 5)
    found.session.goto(50)
    assert done(found.reverse()) and where(found) == (3, 5)


def test_hits_in_scans_that_were_stepped_count() -> None:
    found = debugger()
    found.here.put([line("text.st:5", hits="7")])
    done(found.scan(2))
    done(found.resume())
    assert where(found) == (3, 5)


def test_a_recording_is_gone_through_by_statements() -> None:
    image = compile_text(TEXT).image
    assert image is not None
    plc, recording = Plc(image), Recording()
    recorded = recording.add("plc", plc)
    plc.run(scans=3)
    session = PastSession(RecordedScans(recorded, {}), "plc")
    session.goto(1)
    lines = []
    for _ in range(4):
        lines.append(session.facts.sites[session.statement.site].line if session.statement else None)
        session.step()
    assert lines == [13, 14, 4, 5] and session.read("Main.N") == 2


def test_from_the_end_of_a_scan_one_goes_back_over_what_the_last_statement_has_called() -> None:
    found = debugger("FUNCTION_BLOCK Step\nVAR n : INT; END_VAR\nn := n + 1;\nEND_FUNCTION_BLOCK\n"
                     "PROGRAM Main\nVAR s : Step; END_VAR\n;\ns();\nEND_PROGRAM\n")  # fmt: skip
    while found.session.statement:
        done(found.into())
    found.back_over()
    assert where(found) == (0, 8)


@pytest.mark.slow
def test_what_was_attached_to_goes_back_to_the_oldest_scan_that_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """The PLC is not executed anew from power-on, because its connections do not travel in time."""
    image = compile_text(TEXT).image
    assert image is not None
    plc = Plc(image)
    monkeypatch.setattr(recording_module, "AGAIN_NS", 1_000_000)
    recorded = Recording(limit_bytes=8_000).add("plc", plc)
    plc.run(scans=400)
    session = Session(World(lambda: [Debugged("plc", plc, recorded=recorded)], is_fixed=True))
    session.goto(0)
    assert 0 < recorded.scans.start < 400 and session.here == Position(recorded.scans.start)
    assert session.read("Main.N") == recorded.scans.start
    with pytest.raises(ReadOnlyPast, match="do not travel in time"):
        session.act(lambda changed: changed.write("Main.N", 7))


@pytest.mark.slow
def test_a_table_of_a_recording_ends_where_one_stands() -> None:
    """Of the scan that is looked at it has what was executed so far, of the scans before all, and each of those with its end."""
    image = compile_text(TEXT).image
    assert image is not None
    plc = Plc(image)
    recorded = Recording().add("plc", plc)
    plc.run(scans=3)
    session = PastSession(RecordedScans(recorded, {}), "plc")
    session.goto(2)
    session.step()
    seen: list[object] = []

    class Listener:
        def phase(self, moment: Moment, phase: Phase) -> None:
            seen.append(phase)

        def event(self, moment: Moment, event: Event) -> None:
            if isinstance(event, Statement):
                seen.append((moment.scans, session.facts.sites[event.site].line))

    session.follow(Listener(), range(1, 10))
    whole = [13, 14, 4, 5, 15, 4, 5, 16]
    assert seen == [Phase.INPUTS, *((1, line) for line in whole), Phase.PROGRAM, Phase.REFRESH, Phase.INPUTS, (2, 13)]
    assert session.here == Position(2, 1)


@pytest.mark.slow
def test_hits_of_another_plc_count_on_when_a_run_begins() -> None:
    found = debugger(names=("a", "b"))
    found.plcs["b"].put([line("text.st:5", hits="7")])
    done(found.scan(2))
    reached = done(found.resume())
    assert reached and (reached.plc, reached.position.scan) == ("b", 3)


def test_an_act_in_the_past_forgets_what_was_done_inside_the_same_scan_of_another_plc() -> None:
    found = debugger(names=("a", "b"))
    done(found.scan(3))
    found.choose("b")
    done(found.into())
    assert found.session.here == Position(2, 1)
    found.session.act(lambda plc: plc.write("Main.R", 77))
    done(found.scan(3))
    assert found.session.read("Main.R") == 77
    found.choose("a")
    found.session.goto(2)
    found.session.act(lambda plc: plc.write("Main.R", 5))
    for name, value in (("a", 5), ("b", 0)):
        session = found.plcs[name].session
        session.goto(5)
        assert session.read("Main.R") == value


@pytest.mark.slow
def test_log_points_speak_once_a_scan_however_often_it_is_done_again() -> None:
    said: list[Said] = []
    found = debugger(said=said)
    found.here.put([line("text.st:14", message="n {N} {{x}} {D5:x}"), line("text.st:16", "N MOD 4 = 0")])
    done(found.resume())
    assert [(one.scan, one.text) for one in said] == [(scan, f"n {scan + 1} {{x}} 16#0000") for scan in range(4)]
    found.session.goto(0)
    done(found.resume())
    assert len(said) == 4
    done(found.resume())
    assert [one.scan for one in said] == list(range(8))


def test_a_change_between_two_scans_is_not_laid_on_a_statement() -> None:
    found = debugger(writes=[("D200", 9, 50_000_000)])
    found.here.put([Breakpoint("change", "D200")])
    reached = done(found.resume())
    assert reached and reached.position == Position(5, 0)
    assert reached.reasons == ("D200 was 0, is 9 by the I/O refresh or from outside, between two scans",)


def test_a_trap_ends_the_run_and_can_be_gone_back_from() -> None:
    found = debugger(writes=[("CIO 0.00", True, 0)])
    reached = done(found.resume())
    assert reached and reached.kind == "trap" and reached.position.scan == 4
    found.back_over()
    assert where(found) == (4, 17)


@pytest.mark.slow
def test_a_trap_in_the_rest_of_a_scan_ends_the_run_too() -> None:
    found = debugger(writes=[("CIO 0.00", True, 0)])
    found.session.goto(4)
    done(found.into())
    reached = done(found.resume())
    assert reached and (reached.kind, reached.position.scan, found.session.here.scan) == ("trap", 4, 4)
    assert "divided by 0" in reached.reasons[0]
    assert done(found.resume()) == reached, "nothing goes on behind a trap"


@pytest.mark.slow
def test_machine_code_goes_to_the_same_places() -> None:
    image = compile_text(TEXT).image
    assert image is not None
    world = World(lambda: [Debugged("plc", Plc(image, engine="native"), [TimedWrite(Plc(image).find("D7"), 3, 2_000_000_000)])])
    said: list[Said] = []
    found = Debugger({"plc": Session(world, "plc")}, said.append)
    found.here.put([line("text.st:13", "N = 150"), line("text.st:14", "N MOD 100 = 0", message="n {N} {D7}")])
    reached = done(found.resume())
    assert reached and reached.position == Position(150, 0) and [one.text for one in said] == ["n 100 0"]
    found.here.put([line("text.st:14", "N MOD 100 = 0", message="n {N} {D7}")])
    assert done(found.resume(500)) is None and found.session.here == Position(500) and found.session.read("D7") == 3
    assert [one.text for one in said] == ["n 100 0", "n 200 0", "n 300 3", "n 400 3", "n 500 3"]
    found.here.put([line("text.st:14", "N < 120")])
    reached = done(found.reverse())
    assert reached and reached.position == Position(118, 1) and found.session.read("D7") == 0


@pytest.mark.slow
def test_a_recording_is_gone_through_to_its_end_and_no_further() -> None:
    image = compile_text(TEXT).image
    assert image is not None
    plc = Plc(image)
    recorded = Recording().add("plc", plc)
    plc.run(scans=20)
    found = Debugger({"plc": PastSession(RecordedScans(recorded, {}), "plc")})
    end = found.session.here
    assert (end.scan, found.session.statement) == (19, None)
    found.session.goto(3)
    found.here.put([line("text.st:5", hits="% 7")])
    reached = done(found.resume())
    assert reached and where(found) == (6, 5) and found.session.read("Main.N") == 7
    found.here.put([])
    assert done(found.resume()) is None and found.session.here == end and found.session.read("Main.N") == 20
    reached = done(found.reverse({"plc": [Breakpoint("change", "Main.T.Q")]}))
    assert reached and reached.position.scan == 19 and found.here.breakpoints == ()
    found.session.goto(100)
    assert found.session.here.scan == 19
    with pytest.raises(ValueError, match="nothing is recorded"):
        PastSession(RecordedScans(Recording().add("plc", Plc(image)), {}))


def test_what_was_done_last_takes_effect_when_the_session_ends() -> None:
    found = debugger()
    done(found.scan(3))
    session = found.session
    assert isinstance(session, Session)
    session.act(lambda plc: plc.write("Main.R", 9))
    plc = session.world["plc"]
    assert (plc.scans, plc.read("Main.R"), plc.input_recorder is None) == (3, 0, False)
    session.world.leave()
    assert (plc.scans, plc.read("Main.R"), plc.input_recorder) == (4, 9, None)


def test_steps_stop_at_breakpoints_in_what_they_pass_over() -> None:
    found = debugger()
    found.here.put([line("text.st:5")])
    done(found.over())
    assert done(found.over()) and where(found) == (0, 5)
    found.here.put([])
    done(found.over(1))
    assert where(found) == (0, 15)
    found.back_over()
    assert where(found) == (0, 14)


def test_a_scan_is_left_by_way_of_its_refresh_and_stops_on_the_way_count() -> None:
    found = debugger()
    found.here.put([line("text.st:16", "N = 3")])
    assert done(found.scan(10)) and where(found) == (2, 16)
    found.here.put([])
    assert done(found.scan(10)) is None and where(found) == (12, 13)


@pytest.mark.slow
def test_two_plcs_have_one_time() -> None:
    found = debugger(names=("a", "b"))
    found.plcs["b"].put([line("text.st:16", "N = 40")])
    reached = done(found.resume())
    assert reached and reached.plc == "b" and found.focus == "b"
    assert found.plcs["a"].session.here == Position(40, 0)
    found.choose("a")
    assert found.session.read("Main.N") == 40
    assert done(found.reverse()) is None or found.session.here.scan <= 40


def test_a_run_that_is_given_up_stands_between_two_scans() -> None:
    found = debugger()
    move = found.resume()
    for _ in range(3):
        next(move)
    move.close()
    found.pause()
    here = found.session.here
    assert here.step == 0 and here.scan > 0
    assert found.session.read("Main.N") == here.scan


@pytest.mark.slow
def test_a_change_in_the_past_is_met_again() -> None:
    found = debugger()
    done(found.scan(3))
    done(found.into())
    session = found.session
    session.act(lambda plc: plc.write("Main.R", 77))
    found.forget()
    found.here.put([Breakpoint("change", "Main.R")])
    done(found.scan(20))
    reached = done(found.reverse())
    assert reached and reached.reasons[0].startswith("Main.R was 0, is 77") and reached.position == Position(3, 1)


MOVES = ("into", "over", "out", "scan", "resume", "back", "back over", "reverse", "goto", "write")


STOPS = (line("text.st:5"), line("text.st:5", "A > 6"), line("Main.T", hits="3"), Breakpoint("change", "Main.R"),
         Breakpoint("condition", "Main.N > 4"))  # fmt: skip


def move(found: Debugger, what: str) -> None:
    session = found.session
    if what == "back":
        session.back()
    elif what == "back over":
        found.back_over()
    elif what == "goto":
        session.goto(max(0, session.here.scan - 3))
    elif what == "write":
        session.act(lambda plc: plc.write("CIO 0.00", not plc.read("CIO 0.00")))
        found.forget()
    else:
        done({"into": found.into, "over": found.over, "out": lambda: found.over(1), "scan": lambda: found.scan(2),
              "resume": lambda: found.resume(session.here.scan + 20), "reverse": found.reverse}[what]())  # fmt: skip


@pytest.mark.slow
@given(moves=st.lists(st.sampled_from(MOVES), min_size=1, max_size=14),
       stops=st.lists(st.sampled_from(STOPS), max_size=2))  # fmt: skip
@settings(max_examples=times(60), deadline=None)
def test_any_moves_end_in_the_memory_that_a_plain_run_has_there(moves: list[str], stops: list[Breakpoint]) -> None:
    found = debugger()
    found.here.put(stops)
    for each in moves:
        move(found, each)
        session = found.session
        here, memory, statement = session.here, bytes(session.memory.u8), session.statement
        again = debugger()
        again.session.world._live["plc"].actions = dict(session.world._live["plc"].actions)
        again.session.goto(here.scan)
        while again.session.here < here and not again.session.trap:
            again.session.step()
        assert again.session.here == here
        assert (again.session.statement and again.session.statement.site) == (statement and statement.site)
        assert bytes(again.session.memory.u8) == memory
