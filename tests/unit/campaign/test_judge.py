"""What a run is judged by while it goes on, and what is kept of runs: counts, times, what ended a process."""

from __future__ import annotations

from types import SimpleNamespace

from fbvm import Plc, compile_text
from fbvm.base.diagnostics import Source
from fbvm.campaign.execution import Result
from fbvm.campaign.executors import LIMIT_NS
from fbvm.campaign.judge import CRASHED, GOLDEN, WITHIN, Failure, Judge
from fbvm.campaign.plan import Golden, Judging, Plan, Response
from fbvm.campaign.processes import Crashed, Late
from fbvm.campaign.runs import Outcome, ended
from fbvm.campaign.store import columns, rows
from fbvm.run.project import Project

MS = 1_000_000
TEXT = "PROGRAM Main VAR Asked, Told : BOOL; END_VAR ; END_PROGRAM"


def judged(*scans: str) -> list[str | None]:
    """What is said behind scans of 10 ms, before each of which the variables in a text are set TRUE and the others FALSE."""
    image = compile_text(TEXT).image
    assert image is not None
    plc = Plc(image)
    running = SimpleNamespace(plc=plc, reason="")
    judge = Judge(Judging(responses=(Response("Main.Asked", "Main.Told", 20 * MS),)), {"main": running}, True)  # type: ignore[dict-item]
    said = []
    for scan in scans:
        for name in ("Asked", "Told"):
            plc.write(f"Main.{name}", name in scan.split())
        plc.scan()
        seen = judge.look(plc.now_ns)
        said.append(seen and str(seen.failure))
    return said


def test_an_answer_is_awaited_from_its_trigger_on() -> None:
    late = f"{WITHIN} Main.Told within 20ms of Main.Asked"
    assert judged(*[""] * 8) == [None] * 8, "nobody has asked"
    assert judged("", "Asked", "", "Told", "", "", "") == [None] * 7
    assert judged("", "Asked", "", "", "") == [None] * 4 + [late]
    assert judged("Asked", "", "Asked", "") == [None] * 3 + [late], "who asks again waits since the first time"
    assert judged("Asked", "Asked Told", *["Asked"] * 4) == [None] * 6, "a trigger that stays asks once"


def test_a_run_that_is_not_as_its_golden_trace_has_failed_when_it_is_over() -> None:
    image = compile_text(TEXT).image
    assert image is not None
    found = []
    for asked in (False, True):
        plc = Plc(image)
        golden = Golden("asked.txt", "main", ("Main.Asked",), "scans 0 to 1\n\nMain.Asked\n  scan 0      0s        FALSE\n")
        judge = Judge(Judging(goldens=(golden,)), {"main": SimpleNamespace(plc=plc, reason="")}, True)  # type: ignore[dict-item]
        plc.scan()
        plc.write("Main.Asked", asked)
        plc.scan()
        found.append(judge.ended())
    assert found[0] is None
    assert found[1] is not None and (found[1].kind, found[1].text, found[1].scan) == (GOLDEN, "asked.txt: Main.Asked", 1)


def outcome(*results: Result) -> Outcome:
    project = Project(Source("fbvm.toml", ""), "loop", 0, None, None, (), (), frozenset(), (), ())
    made = Outcome(Plan(project, runs=len(results)))
    made.add(results)
    return made


def test_runs_that_failed_are_counted_and_times_are_whole_milliseconds_where_they_can() -> None:
    failed = Failure("never", "Main.Up", now_ns=1_500_000)
    made = outcome(Result(0, time_ns=2 * MS), Result(1, failure=failed), Result(2, time_ns=MS // 4))
    assert made.failing == 1
    at = columns(made.plan).index("time_ms")
    assert [repr(row[at]) for row in rows(made)] == ["2", "1.5", "0.25"]


def test_a_run_that_ended_its_process_says_how_as_far_as_it_is_known() -> None:
    found = [ended(7, how) for how in (Crashed("by SIGKILL"), Crashed(), Late())]
    assert [(result.number, result.failure and result.failure.kind) for result in found] == [(7, CRASHED)] * 3
    assert [result.failure.text for result in found if result.failure] == [
        "the process of the run ended by SIGKILL", "the process of the run ended",
        f"it has not ended within {LIMIT_NS // 10**9} s"]
