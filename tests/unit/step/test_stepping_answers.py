"""What each move of a session answers and where it stands behind it, live and in a recording alike."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial

import pytest
from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Phase, Plc
from fbvm.record.recording.recording import Recording
from fbvm.record.recording.scans import RecordedScans
from fbvm.record.trace.events import Event, Statement
from fbvm.step.past_session import PastSession
from fbvm.step.position import Position
from fbvm.step.scan_replay import Moment
from fbvm.step.session import Session
from fbvm.step.session_events import SessionEvents
from fbvm.step.stepping import Stepping, reached_step
from fbvm.step.stop_report import StopReport

TEXT = """\
FUNCTION_BLOCK Twice
VAR_INPUT A : INT; END_VAR
VAR_OUTPUT Q : INT; END_VAR
    Q := A;
    Q := Q * 2;
END_FUNCTION_BLOCK
PROGRAM Main
VAR
    N, R : INT;
    T : Twice;
    W : WORD;
END_VAR
    N := N + 1;
    T(A := N);
    W.0 := N > 2;
END_PROGRAM
"""
STATEMENTS = 5
"""Of one scan: 13, 14, 4, 5, 15."""


@cache
def image() -> Image:
    made = compile_text(TEXT).image
    assert made is not None
    return made


def live() -> Session:
    return Session.of(lambda: Plc(image()))


def past() -> PastSession:
    plc = Plc(image())
    recorded = Recording().add("plc", plc)
    plc.run(scans=6)
    return PastSession(RecordedScans(recorded, {}), "plc")


SESSIONS: tuple[Callable[[], Stepping], ...] = (live, past)


def line(session: Stepping) -> int | None:
    return session.facts.sites[session.statement.site].line if session.statement else None


def at_line(wanted: int, session: Stepping, statement: Statement | None) -> bool:
    return statement is not None and session.facts.sites[statement.site].line == wanted


def test_the_source_around_a_statement_begins_with_its_first_line_at_most() -> None:
    session = live()
    report = StopReport(session, {"text.st": TEXT})
    shown = [f" {'>' if number == 13 else ' '}{number:>4}  {text}" for number, text in enumerate(TEXT.splitlines(), 1)]
    assert [list(report.around(lines)) for lines in (0, 1, 11, 12, 13)] == [
        shown[12:13], shown[11:14], shown[1:], shown, shown]  # fmt: skip


@each_of("make", SESSIONS)
def test_what_a_move_answers_and_where_it_stands(make: Callable[[], Stepping]) -> None:
    session = make()
    session.goto(1)
    assert session.play(1, partial(reached_step, 2)) is True and line(session) == 4
    assert session.play(1, partial(reached_step, STATEMENTS)) is False and line(session) is None
    session.go_to(Position(1, 99))
    assert session.here == Position(1, STATEMENTS)
    for move, place in ((session.back, (1, 15)), (session.back, (1, 5)), (session.step_out, (1, 15)),
                        (session.back_scan, (1, 13)), (session.step, (1, 14)), (session.step_over, (1, 15)),
                        (session.step, (1, None)), (session.step, (2, 13)),
                        (session.back, (1, None)), (session.step_over, (2, 13)), (session.back, (1, None)),
                        (session.step_out, (2, 13)), (session.step, (2, 14)), (session.step, (2, 4)),
                        (session.step_over, (2, 5)), (session.step_over, (2, 15))):  # fmt: skip
        move()
        assert (session.here.scan, line(session)) == place, move
    session.back_scan(2)
    assert session.here == Position(1), "of this scan the beginning counts as one"
    session.back_scan(5)
    assert session.here == Position(0)
    session.back()
    assert session.here == Position(0), "there is nothing before"
    session.scan(3)
    assert session.here == Position(3)


@each_of("make", SESSIONS)
def test_a_run_says_whether_it_got_there(make: Callable[[], Stepping]) -> None:
    session = make()
    session.goto(0)
    stop = partial(at_line, 15, session)
    assert session.run(stop, 1) is True and session.here == Position(0, 4)
    assert session.run(stop, 1) is False and session.here == Position(1), "the statement that it stood at does not count"
    assert session.run(stop, 2) is True and session.here == Position(1, 4)
    assert session.run(lambda statement: statement is None, 1) is True and session.here == Position(1, STATEMENTS)
    assert session.run(lambda statement: statement is None, 2) is True and session.here == Position(2, STATEMENTS)
    assert session.run(lambda statement: False, 2) is False and session.here == Position(4)
    assert session.run_back(stop) is True and session.here == Position(3, 4)
    assert session.run_back(stop) is True and session.here == Position(2, 4)
    assert session.run_back(lambda statement: False) is False and session.here == Position(2, 4)


@each_of("make", SESSIONS)
def test_what_changed_since_the_mark(make: Callable[[], Stepping]) -> None:
    session = make()
    session.goto(2)
    session.mark()
    assert list(session.changes()) == []
    session.go_to(Position(2, STATEMENTS))
    changes = {(each.place.name, each.old, each.new) for each in session.changes()}
    assert changes == {("Main.N", "2", "3"), ("Main.T.A", "2", "3"), ("Main.T.Q", "4", "6"), ("Main.W", "0", "1")}


def test_a_session_begins_with_nothing_changed() -> None:
    session = past()
    assert session.here.scan == 5 and list(session.changes()) == []
    with pytest.raises(ValueError, match="nothing is recorded"):
        empty = Recording().add("plc", Plc(session.facts.image))
        PastSession(RecordedScans(empty, {}), "plc")


def test_scans_outside_of_a_recording_are_its_ends() -> None:
    session = past()
    assert [session.reachable(scan) for scan in (-1, 0, 3, 5, 6)] == [0, 0, 3, 5, 5]
    session.goto(9)
    assert session.here == Position(5, STATEMENTS)


@each_of("make", SESSIONS)
def test_what_changed_is_counted_from_the_beginning_on(make: Callable[[], Stepping]) -> None:
    session = make()
    session.goto(1)
    assert ("Main.N", "0" if isinstance(session, Session) else "6", "1") in {
        (each.place.name, each.old, each.new) for each in session.changes()}


@each_of("make", SESSIONS)
def test_events_are_those_of_the_scans_that_are_asked_for(make: Callable[[], Stepping]) -> None:
    session = make()
    session.go_to(Position(2, 2))
    seen: list[tuple[str, int]] = []

    class Follower:
        def phase(self, moment: Moment, phase: Phase) -> None:
            seen.append((phase.name, moment.scans))

        def event(self, moment: Moment, event: Event) -> None:
            if isinstance(event, Statement):
                seen.append(("", moment.scans))

    events = SessionEvents(session, StopReport(session, {"text.st": TEXT}))  # type: ignore[arg-type]
    events.follow(Follower(), range(1, 3))  # type: ignore[arg-type]
    scan = ["INPUTS", "", "", "", "", "", "PROGRAM", "REFRESH"]
    assert seen == [*((name, 1) for name in scan), ("INPUTS", 2), ("", 2), ("", 2)] and session.here == Position(2, 2)
    seen.clear()
    events.follow(Follower())  # type: ignore[arg-type]
    events.follow(Follower(), range(1))  # type: ignore[arg-type]
    assert session.read("Main.N") == 3 and line(session) == 4, "it stands where it stood"
    del seen[-len(scan):]
    assert events.scans == range(3) and [row for row in seen if row[1] == 0] == [(name, 0) for name in scan] and len(seen) == 19
    assert events.line(session.facts.sites[0]) == TEXT.splitlines()[session.facts.sites[0].line - 1].strip()


def test_where_a_place_may_have_changed_is_told_of_a_session() -> None:
    text = "PROGRAM Main VAR n, k : INT; END_VAR n := n + 1; IF n = 30 THEN k := 1; END_IF END_PROGRAM"
    made = compile_text(text).image
    assert made is not None
    session = Session.of(lambda: Plc(made))
    session.goto(90)
    events = SessionEvents(session, StopReport(session, {"text.st": text}))
    found = events.may_change([session.find("Main.k")], range(80))  # type: ignore[list-item]
    assert 0 < found.stop < 80 and 29 in found and events.may_change([session.find("Main.k")], range(40, 80)) == range(40, 40)  # type: ignore[list-item]
    assert events.scans == range(91)
