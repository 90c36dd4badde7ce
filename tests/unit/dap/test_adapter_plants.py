"""The debug adapter with projects of several PLCs, ladder, charts, units and their networks, and recordings."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner
from dap_client import Client, RefusedError

from fbvm.cli.main import main
from fbvm.code.compiler import compile_text
from fbvm.dap.target import Target
from fbvm.machine.plc import Plc
from fbvm.record.recording.recording import Recording
from fbvm.record.recording.scans import RecordedScans
from fbvm.step.past_session import PastSession
from fbvm.step.session import Session

PROJECT = """\
[plc.fast]
sources = ["fast.st"]
cycle = "10ms"

[plc.slow]
sources = ["slow.st"]
cycle = "30ms"
"""
COUNTER = "PROGRAM Main\nVAR n : INT; END_VAR\nn := n + {step};\nEND_PROGRAM\n"
LADDER = """\
PROGRAM Main
VAR start, stop, motor, lamp : BOOL; END_VAR
LADDER
RUNG Seal-in of the motor
LD start
OR motor
ANDNOT stop
OUT motor
RUNG The lamp
LD motor
OUT lamp
END_LADDER
END_PROGRAM
"""
CHART = """\
PROGRAM Main
VAR n : INT; END_VAR
INITIAL_STEP Waiting: END_STEP
STEP Walking: Count(P1); END_STEP
TRANSITION FROM Waiting TO Walking := TRUE; END_TRANSITION
TRANSITION FROM Walking TO Waiting := n MOD 5 = 0; END_TRANSITION
ACTION Count: n := n + 1; END_ACTION
END_PROGRAM
"""
TRAP = "PROGRAM Main\nVAR n, d : INT; END_VAR\nn := n + 1;\nd := 100 / (n - 41);\nEND_PROGRAM\n"


@pytest.mark.slow
def test_the_plcs_of_a_project_are_threads_of_one_time(tmp_path: Path) -> None:
    (tmp_path / "fbvm.toml").write_text(PROJECT, encoding="utf-8")
    for name, step in {"fast": 1, "slow": 100}.items():
        (tmp_path / f"{name}.st").write_text(COUNTER.format(step=step), encoding="utf-8")
    client = Client()
    client.begin(project=str(tmp_path))
    threads = client.ask("threads")["threads"]
    assert [row["name"].partition(" /")[0] for row in threads] == ["fast", "slow"]
    client.ask("setBreakpoints", source={"path": str(tmp_path / "slow.st")}, breakpoints=[{"line": 3, "condition": "n = 300"}])
    stop = client.go("continue")
    assert stop["threadId"] == 2 and client.frames[0]["source"]["name"] == "slow.st" and client.value("Main.n") == "300"
    assert client.ask("stackTrace", threadId=1)["stackFrames"][-1]["name"] == "scan 10, 100ms"
    assert client.go("reverseContinue", threadId=1)["reason"] == "entry"
    client.go("fbvm/stepScan", threadId=1, scans=4)
    assert client.value("Main.n") == "4"
    client.go("next", threadId=2)
    assert client.frames[-1]["name"] == "scan 2, 60ms" and client.value("Main.n") == "300"
    client.ask("setBreakpoints", source={"path": str(tmp_path / "slow.st")}, breakpoints=[])
    info = client.ask("dataBreakpointInfo", name="Main.n", frameId=client.frames[0]["id"])
    answer = client.ask("setDataBreakpoints", breakpoints=[{"dataId": info["dataId"]}, {"dataId": "nobody|Main.n"}])
    assert info["dataId"] == "slow|Main.n" and [row["verified"] for row in answer["breakpoints"]] == [True, True]
    client.ask("setDataBreakpoints", breakpoints=[{"dataId": info["dataId"]}])
    stop = client.go("continue")
    assert (stop["reason"], stop["threadId"]) == ("data breakpoint", 2)


def test_rungs_are_frames_and_breakpoints(tmp_path: Path) -> None:
    path = tmp_path / "motor.st"
    path.write_text(LADDER, encoding="utf-8")
    client = Client()
    client.begin(program=str(path))
    assert client.frames[0]["name"] == "Main  rung 1 Seal-in of the motor"
    answer = client.ask("setFunctionBreakpoints", breakpoints=[{"name": "Main#2"}, {"name": "Main#9"}])["breakpoints"]
    assert answer[0]["line"] == 9 and not answer[1]["verified"] and "rungs of Main are 1 to 2" in answer[1]["message"]
    client.go("continue")
    assert client.line == 9 and "rung 2 The lamp" in client.frames[0]["name"]
    assert "motor" in client.ask("fbvm/rung", number=1)["text"]
    before = client.line
    client.go("next")
    assert client.line == 11 != before


@pytest.mark.slow
def test_steps_of_charts_are_breakpoints(tmp_path: Path) -> None:
    path = tmp_path / "chart.st"
    path.write_text(CHART, encoding="utf-8")
    client = Client()
    client.begin(program=str(path))
    answer = client.ask("setFunctionBreakpoints", breakpoints=[{"name": "Main.Walking"}])["breakpoints"]
    assert answer[0]["verified"]
    stop = client.go("continue")
    assert stop["reason"] == "breakpoint" and client.value("Main.Walking.X") == "TRUE"
    assert "Main.Walking" in client.ask("fbvm/why", name="Main.Walking.X")["text"]


def past(text: str, scans: int) -> Target:
    image = compile_text(text).image
    assert image is not None
    plc = Plc(image)
    recorded = Recording().add("pump", plc)
    plc.run(scans=scans)
    session = PastSession(RecordedScans(recorded, {}), "pump")
    return Target({"pump": session}, {"text.st": text})


@pytest.mark.slow
def test_a_recording_opens_at_its_end_and_is_gone_through_backwards() -> None:
    client = Client(lambda how, arguments: past(COUNTER.format(step=1), 3000))
    stop = client.begin()
    assert stop["reason"] == "entry" and stop["description"].startswith("the end of the recording: scan 2999")
    for command in ("continue", "next", "fbvm/stepScan"):
        with pytest.raises(RefusedError, match="the end of the recording"):
            client.ask(command, threadId=1)
    info = client.ask("dataBreakpointInfo", name="Main.n")
    client.ask("setDataBreakpoints", breakpoints=[{"dataId": info["dataId"], "condition": "Main.n = 17"}])
    assert client.go("reverseContinue")["description"] == "Main.n was 16, is 17, by text.st:3 in Main"
    with pytest.raises(RefusedError, match="it can be looked at, not changed"):
        client.ask("setExpression", expression="Main.n", value="1")
    client.ask("setDataBreakpoints", breakpoints=[{"dataId": info["dataId"], "condition": "Main.n = 2001"}])
    assert "is 2001" in client.go("continue")["description"]
    assert client.go("continue")["description"] == "the end of the recording"
    source = client.ask("loadedSources")["sources"][0]
    assert client.ask("source", sourceReference=source["sourceReference"])["content"].startswith("PROGRAM Main")
    client.go("fbvm/gotoScan", scan=5)
    assert client.value("Main.n") == "5" and client.line == 3


def attached(text: str) -> Target:
    image = compile_text(text).image
    assert image is not None
    return Target({"pump": Session.of(lambda: Plc(image))}, {"text.st": text})


def test_what_runs_elsewhere_goes_on_when_somebody_attaches_and_is_not_begun_again() -> None:
    client = Client(lambda how, arguments: attached(TRAP))
    client.ask("initialize", adapterID="fbvm")
    client.send("attach", {})
    client.ask("configurationDone")
    assert client.events("process") == [{"name": "pump", "startMethod": "attach", "isLocalProcess": True}]
    assert client.events("stopped") == [] and client.adapter.is_running
    with pytest.raises(RefusedError, match="what runs elsewhere cannot be begun again from here"):
        client.ask("restart")


def test_a_recording_that_ended_in_a_trap_opens_there() -> None:
    client = Client(lambda how, arguments: past(TRAP, 100))
    stop = client.begin()
    assert stop["reason"] == "exception" and "divided by 0" in stop["description"]
    client.go("stepBack")
    assert client.line == 4 and client.value("Main.n") == "41"


TEST = """\
def test_it_counts_to_forty(fb):
    rig = fb("count.st::Main")
    rig.run("500ms")
    assert rig.n == 40


def test_it_counts(fb):
    rig = fb("count.st::Main")
    rig.run("30ms")
    assert rig.n == 3
"""


@pytest.mark.slow
def test_a_test_is_run_and_looked_at_backwards_from_its_failure(tmp_path: Path) -> None:
    (tmp_path / "count.st").write_text(COUNTER.format(step=1), encoding="utf-8")
    (tmp_path / "test_count.py").write_text(TEST, encoding="utf-8")
    client = Client()
    stop = client.begin(test="test_count.py::test_it_counts_to_forty", cwd=str(tmp_path))
    assert stop["reason"] == "exception" and stop["text"] == "assert" and "40" in stop["description"]
    assert client.ask("exceptionInfo", threadId=1)["exceptionId"] == "assert"
    assert "1 failed" in client.events("output")[0]["output"]
    assert client.value("Main.n") == "50"
    client.go("fbvm/gotoScan", scan=39)
    assert client.value("Main.n") == "39"
    passed = Client()
    assert passed.begin(test="test_count.py::test_it_counts", cwd=str(tmp_path))["reason"] == "entry"
    again = Client()
    again.ask("initialize", adapterID="fbvm")
    with pytest.raises(RefusedError, match="no test"):
        again.ask("launch", test="test_count.py::test_nothing", cwd=str(tmp_path))


FUNCTIONS = """\
FUNCTION Twice : INT
VAR_INPUT x : INT; END_VAR
VAR t : ARRAY[0..2] OF INT; END_VAR
t[1] := x * 2;
Twice := t[1];
END_FUNCTION
PROGRAM Main
VAR n : INT; END_VAR
VAR_TEMP q : INT; END_VAR
q := Twice(n) + 1;
n := q;
END_PROGRAM
"""


@pytest.mark.slow
def test_variables_of_functions_and_temporary_ones_have_names_while_they_live(tmp_path: Path) -> None:
    path = tmp_path / "twice.st"
    path.write_text(FUNCTIONS, encoding="utf-8")
    client = Client()
    rows = [{"line": 5, "condition": "x > 5 AND t[1] > 5", "logMessage": ""}, {"line": 4, "logMessage": "x={x}"}]
    client.begin({"setBreakpoints": {"source": {"path": str(path)}, "breakpoints": rows}}, program=str(path))
    scopes = client.scopes()
    assert client.rows(scopes["Inputs"]["variablesReference"])["x"]["value"] == "7"
    locals_ = client.rows(scopes["Locals"]["variablesReference"])
    assert client.rows(locals_["t"]["variablesReference"])["[1]"]["value"] == "14" and "Twice" in locals_
    assert client.value("x + t[1]", frame=0) == "21"
    assert [row["output"].partition(": ")[2] for row in client.events("output")] == ["x=0\n", "x=1\n", "x=3\n", "x=7\n"]
    main = client.scopes(1)
    assert client.rows(main["Temporary"]["variablesReference"])["q"]["type"] == "INT"
    assert client.ask("setExpression", expression="x", value="100", frameId=client.frames[0]["id"])["value"] == "100"


@pytest.mark.slow
def test_a_recording_in_a_file_is_debugged_from_its_trap_backwards(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "trap.st").write_text(TRAP, encoding="utf-8")
    assert CliRunner().invoke(main, ["run", "trap.st", "--for", "10s", "--trace", "night.fbtrace"]).exit_code == 4
    client = Client()
    stop = client.begin(recording=str(tmp_path / "night.fbtrace"))
    assert stop["reason"] == "exception" and stop["text"] == "R0101" and client.line == 4
    client.go("stepBack")
    assert client.line == 4 and client.value("Main.n") == "41"
    assert client.go("fbvm/lastWrite", name="d")["description"].startswith("Main.d was -50, is -100")
    with pytest.raises(RefusedError, match="looked at, not changed"):
        client.ask("setExpression", expression="Main.n", value="1")
    client.ask("disconnect")
    wrong = Client()
    wrong.ask("initialize", adapterID="fbvm")
    with pytest.raises(RefusedError):
        wrong.ask("launch", recording=str(tmp_path / "trap.st"))
