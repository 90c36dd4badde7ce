"""The debug adapter under a strict client: every request, the order of messages, what is refused."""

from __future__ import annotations

import base64
from pathlib import Path

import pytest
from dap_client import Client, RefusedError

from fbvm.dap.target import LaunchError

TEXT = """\
FUNCTION_BLOCK Twice
VAR_INPUT A : INT; END_VAR
VAR_OUTPUT Q : INT; END_VAR
VAR k : INT; END_VAR
    Q := A;
    Q := Q * 2; k := k + 1;
END_FUNCTION_BLOCK
PROGRAM Main
VAR
    Button AT CIO 0.00 : BOOL;
    N, R : INT;
    T, U : Twice;
    Level AT D200 : UINT;
    Big : ARRAY[0..999] OF INT;
    Wait : TIME := T#50ms;
END_VAR
VAR CONSTANT Limit : INT := 7; END_VAR
    N := N + 1;
    T(A := N);
    U(A := T.Q);
    IF N MOD 10 = 0 THEN
        Level := Level + 1;
    END_IF;
    IF Button THEN
        R := 100 / (N - 5);
    END_IF;
    IF Wait > T#1s THEN Big[4] := Limit; END_IF;
END_PROGRAM
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "pump.st"
    path.write_text(TEXT, encoding="utf-8")
    return path


def lines(file: Path, *rows: object) -> dict[str, object]:
    """The arguments of setBreakpoints."""
    asked = [row if isinstance(row, dict) else {"line": row} for row in rows]
    return {"setBreakpoints": {"source": {"path": str(file)}, "breakpoints": asked}}


# --- order --------------------------------------------------------------------------------------------------------------


def test_the_order_of_a_session(file: Path) -> None:
    client = Client()
    stop = client.begin(program=str(file))
    assert stop["reason"] == "entry" and stop["description"] == "scan 0, 0s" and client.line == 18
    client.ask("terminate")
    client.ask("disconnect")
    assert client.adapter.ended
    shown = [f"{row['type'][0]} {row.get('event') or row['command']}" for row in client.messages]
    assert shown == ["r initialize", "e initialized", "r configurationDone", "r launch", "e process", "e stopped",
                     "r stackTrace", "r terminate", "e terminated", "r disconnect"]  # fmt: skip


def test_capabilities_have_a_request_each() -> None:
    client = Client()
    said = client.ask("initialize", adapterID="fbvm")
    assert said["supportsStepBack"] and said["supportsDataBreakpoints"] and "supportsGotoTargetsRequest" not in said
    assert {row["filter"] for row in said["exceptionBreakpointFilters"]} >= {"trap", "watchdog", "modbus", "response", "warning"}
    with pytest.raises(RefusedError, match="initialize comes once"):
        client.ask("initialize")


@pytest.mark.slow
def test_breakpoints_may_come_before_the_program(file: Path) -> None:
    client = Client()
    client.ask("initialize", adapterID="fbvm")
    early = client.ask("setBreakpoints", source={"path": str(file)}, breakpoints=[{"line": 22}])["breakpoints"]
    assert early == [{"id": 1, "verified": False, "reason": "pending", "message": "the program is not loaded yet"}]
    client.ask("configurationDone")
    client.send("launch", {"program": str(file)})
    changed = client.events("breakpoint")
    assert changed[0]["reason"] == "changed" and changed[0]["breakpoint"]["id"] == 1 and changed[0]["breakpoint"]["verified"]
    assert client.rest()["hitBreakpointIds"] == [1]


@pytest.mark.parametrize(("arguments", "said"), [
    ({}, "either program"), ({"program": "x.st", "project": "y"}, "either program"), ({"program": "missing.st"}, "no file"),
    ({"program": "pump.st", "speed": 3}, "launch has no 'speed'; it has cwd"),
    ({"program": 5}, "program of launch is a text or a list, not 5"), ({"program": "pump.st", "cycle": "soon"}, "no time"),
    ({"program": "pump.st", "set": [{"name": "Main.Z", "value": 1}]}, "Z"),
    ({"program": "pump.st", "dialect": "klingon"}, "no dialect"), ({"project": "nowhere"}, "no "),
    ({"program": "pump.st", "map": ["1.2.3.4:502=host:1"]}, "stays in memory")])  # fmt: skip
def test_what_launch_refuses(file: Path, arguments: dict[str, object], said: str) -> None:
    client = Client()
    client.ask("initialize", adapterID="fbvm")
    with pytest.raises(RefusedError, match=said):
        client.ask("launch", cwd=str(file.parent), **arguments)
    client.ask("configurationDone")
    number = client.send("launch", {"program": "pump.st", "cwd": str(file.parent), "__sessionId": "7", "type": "fbvm"})
    assert [row["success"] for row in client.messages if row.get("request_seq") == number] == [True]


def test_a_program_with_errors_says_what_the_compiler_says(file: Path) -> None:
    file.write_text(TEXT.replace("N + 1", "N + +"), encoding="utf-8")
    client = Client()
    client.ask("initialize", adapterID="fbvm")
    with pytest.raises(RefusedError, match="the program has errors"):
        client.ask("launch", program=str(file))
    assert "error S" in client.events("output")[0]["output"]


def test_two_launches_and_unknown_requests_are_refused(file: Path) -> None:
    client = Client()
    client.begin(program=str(file))
    for command, said in {"launch": "debugged already", "goto": "no request 'goto'", "nonsense": "no request"}.items():
        with pytest.raises(RefusedError, match=said):
            client.ask(command, program=str(file))
    with pytest.raises(RefusedError, match="there is no thread 9"):
        client.ask("next", threadId=9)


@pytest.mark.slow
def test_arguments_of_any_type_are_answered(file: Path) -> None:
    client = Client()
    client.begin(program=str(file), stopOnEntry=True)
    ends = {"initialize", "launch", "attach", "restart", "continue", "reverseContinue", "disconnect", "terminate"}
    for command in sorted(set(client.adapter._requests) - ends):
        for name in ("source", "format", "breakpoints", "filters", "filterOptions", "expression", "count", "frameId"):
            for wrong in (5, "x", [1], ["x"], {"a": 1}, [{"line": "x", "name": 5, "dataId": 5}], float("inf"), {"path": 5}):
                client.send(command, {"threadId": 1, name: wrong})
    with pytest.raises(RefusedError, match="the argument breakpoints has to be a list of objects"):
        client.ask("setBreakpoints", source={"path": str(file)}, breakpoints=[3])


def test_requests_before_launch_are_refused_in_words() -> None:
    client = Client()
    client.ask("initialize", adapterID="fbvm")
    for command in ("threads", "next", "continue", "evaluate"):
        with pytest.raises(RefusedError, match=r"nothing is debugged|nothing to evaluate"):
            client.ask(command)


def test_attach_says_what_to_do() -> None:
    client = Client(lambda how, arguments: (_ for _ in ()).throw(LaunchError("start `fbvm dap --connect PORT`")))
    client.ask("initialize", adapterID="fbvm")
    with pytest.raises(RefusedError, match="--connect"):
        client.ask("attach")


# --- breakpoints --------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_lines_with_conditions_counts_and_messages(file: Path) -> None:
    client = Client()
    rows = ({"line": 5, "condition": "A > 4"}, {"line": 22, "hitCondition": "% 2"}, {"line": 19, "logMessage": "n={N}"},
            {"line": 99}, {"line": 5, "condition": "A >"}, {"line": 5, "hitCondition": "often"}, {"line": 20})  # fmt: skip
    stop = client.begin(lines(file, *rows), program=str(file))
    answer = next(row["body"]["breakpoints"] for row in client.messages if row.get("command") == "setBreakpoints")
    assert [row["verified"] for row in answer] == [True, True, True, False, False, False, True]
    assert [row["line"] for row in answer] == [5, 22, 19, 99, 5, 5, 20] and [row["id"] for row in answer] == list(range(1, 8))
    for row, said in zip(answer[3:6], ("last statement", "ends too early", "hit count"), strict=True):
        assert said in row["message"]
    assert stop["reason"] == "breakpoint" and stop["hitBreakpointIds"] == [7] and client.line == 20
    output = client.events("output")[0]
    assert output["output"] == "scan 0, 0s: n=1\n" and output["line"] == 19 and output["source"]["path"] == str(file)
    client.ask("setBreakpoints", source={"path": str(file)}, breakpoints=[{"line": 22, "hitCondition": "% 2"}])
    client.go("continue")
    assert client.line == 22 and client.value("N") == "20"


def test_a_breakpoint_moves_to_the_next_statement(file: Path) -> None:
    client = Client()
    client.begin(program=str(file))
    answer = client.ask("setBreakpoints", source={"path": str(file)}, lines=[9])["breakpoints"]
    assert answer[0]["line"] == 18 and answer[0]["verified"]
    elsewhere = client.ask("setBreakpoints", source={"path": "/nowhere/x.st"}, breakpoints=[{"line": 1}])["breakpoints"]
    assert not elsewhere[0]["verified"] and "no such source" in elsewhere[0]["message"]
    places = client.ask("breakpointLocations", source={"path": str(file)}, line=5, endLine=6)["breakpoints"]
    assert [(row["line"], row["column"]) for row in places][:2] == [(5, 5), (6, 5)]


def test_functions_instances_and_what_is_none(file: Path) -> None:
    client = Client()
    client.begin(program=str(file))
    answer = client.ask("setFunctionBreakpoints", breakpoints=[{"name": "Main.U"}, {"name": "Nobody"}])["breakpoints"]
    assert [row["verified"] for row in answer] == [True, False] and answer[0]["line"] == 5 and "POUs are" in answer[1]["message"]
    client.go("continue")
    assert client.frames[0]["name"] == "Twice  Main.U"


@pytest.mark.slow
def test_data_breakpoints_on_names_addresses_and_ranges(file: Path) -> None:
    client = Client()
    client.begin(program=str(file))
    locals_ = client.scopes()["Locals"]["variablesReference"]
    assert client.ask("dataBreakpointInfo", variablesReference=locals_, name="N")["dataId"] == "plc|Main.N"
    assert client.ask("dataBreakpointInfo", name="CIO 1516.02")["accessTypes"] == ["write"]
    assert client.ask("dataBreakpointInfo", name="Main.Nothing")["dataId"] is None
    at = client.ask("readMemory", memoryReference="D200", count=0)["address"]
    assert client.ask("dataBreakpointInfo", name=at, asAddress=True, bytes=4)["dataId"] == "plc|D200..D201"
    info = client.ask("dataBreakpointInfo", name="D199..D201")
    answer = client.ask("setDataBreakpoints", breakpoints=[
        {"dataId": info["dataId"], "accessType": "write", "condition": "D200 > 1"}, {"dataId": "plc|D5", "accessType": "read"}])
    assert [row["verified"] for row in answer["breakpoints"]] == [True, False]
    stop = client.go("continue")
    assert stop["reason"] == "data breakpoint" and stop["description"].endswith(", by pump.st:22 in Main")
    assert "was 1, is 2" in stop["description"] and client.value("D200") == "2 (16#0002)" and client.value("N") == "20"


@pytest.mark.slow
def test_breakpoints_may_change_while_it_runs(file: Path) -> None:
    client = Client()
    client.begin(program=str(file))
    client.ask("continue", threadId=1)
    for _ in range(3):
        assert client.adapter.work()
    client.ask("setBreakpoints", source={"path": str(file)}, breakpoints=[{"line": 22}])
    with pytest.raises(RefusedError, match="it runs; pause it first"):
        client.ask("stackTrace", threadId=1)
    with pytest.raises(RefusedError, match="it runs already"):
        client.ask("next", threadId=1)
    assert client.rest()["reason"] == "breakpoint" and client.line == 22


def test_pause_is_answered_first_and_stands_between_two_scans(file: Path) -> None:
    client = Client()
    client.begin(program=str(file))
    with pytest.raises(RefusedError, match="nothing runs"):
        client.ask("pause", threadId=1)
    client.ask("continue", threadId=1)
    client.adapter.tell_progress()
    client.adapter.work()
    client.adapter.tell_progress()
    started, told = client.events("progressStart")[-1], client.events("progressUpdate")
    assert [row["progressId"] for row in told] == [started["progressId"]] and told[0]["message"].startswith("scan ")
    client.ask("pause", threadId=1)
    assert client.events("stopped")[-1]["reason"] == "pause" and not client.adapter.is_running and client.line == 18
    client.ask("continue", threadId=1)
    client.adapter.tell_progress()
    client.ask("cancel", progressId=client.events("progressStart")[-1]["progressId"])
    assert client.events("stopped")[-1]["reason"] == "pause"


def test_what_is_not_under_way_is_not_cancelled(file: Path) -> None:
    client = Client()
    client.begin(program=str(file))
    stops = len(client.events("stopped"))
    client.ask("cancel")
    client.ask("cancel", requestId=1)
    assert len(client.events("stopped")) == stops
    client.ask("continue", threadId=1)
    client.adapter.tell_progress()
    client.ask("cancel", progressId="another")
    assert client.adapter.is_running and len(client.events("stopped")) == stops
    client.ask("pause", threadId=1)


# --- moving -------------------------------------------------------------------------------------------------------------


def test_steps_in_over_out_and_back(file: Path) -> None:
    client = Client()
    client.begin(program=str(file))
    client.go("next")
    client.go("stepIn")
    assert client.line == 5 and [row["name"] for row in client.frames] == ["Twice  Main.T", "Main", "scan 0, 0s"]
    assert [row.get("canRestart", False) for row in client.frames] == [True, True, False]
    stop = client.go("stepOut")
    assert client.line == 20 and stop["reason"] == "step"
    assert client.go("stepBack")["description"] == "back in scan 0, 0s" and client.line == 19
    client.go("next")
    client.go("fbvm/stepBackInto")
    assert client.line == 6
    client.go("restartFrame", frameId=client.frames[0]["id"])
    assert client.line == 5 and client.events("stopped")[-1]["reason"] == "restart"
    client.go("fbvm/gotoScan", scan=0)
    with pytest.raises(RefusedError, match="beginning of what is kept"):
        client.go("stepBack")


@pytest.mark.slow
def test_scans_and_the_end_of_the_program(file: Path) -> None:
    client = Client()
    client.begin(program=str(file))
    client.go("fbvm/stepScan", scans=10)
    assert client.events("stopped")[-1]["description"] == "scan 10, 100ms" and client.value("N") == "10"
    client.go("fbvm/stepBackScan")
    assert client.value("N") == "9"
    while client.line:
        client.go("next")
    assert [(row["name"], row["presentationHint"]) for row in client.frames] == [("scan 9, 90ms", "label")]
    client.go("next")
    assert client.line == 18 and client.value("N") == "10"


@pytest.mark.slow
def test_reverse_who_wrote_this_and_a_forgotten_future(file: Path) -> None:
    client = Client()
    client.begin(program=str(file))
    client.go("fbvm/stepScan", scans=500)
    stop = client.go("fbvm/lastWrite", name="Level")
    assert stop["reason"] == "data breakpoint" and stop["description"] == "D200 was 49, is 50, by pump.st:22 in Main" or (
        stop["description"] == "Main.Level was 49, is 50, by pump.st:22 in Main")
    assert client.value("N") == "500"
    answer = client.ask("setExpression", expression="Main.R", value="77")
    assert answer["value"] == "77"
    info = client.ask("dataBreakpointInfo", name="Level")
    client.ask("setDataBreakpoints", breakpoints=[{"dataId": info["dataId"]}])
    assert "was 48, is 49" in client.go("reverseContinue")["description"]
    client.ask("setDataBreakpoints", breakpoints=[])
    stop = client.go("reverseContinue")
    assert stop["reason"] == "entry" and stop["description"] == "beginning of what is kept: scan 0, 0s"


@pytest.mark.slow
def test_a_write_in_the_past_forgets_what_came_after(file: Path) -> None:
    client = Client()
    client.begin(program=str(file))
    client.go("fbvm/stepScan", scans=20)
    client.go("fbvm/gotoScan", scan=18)
    locals_ = client.scopes()["Locals"]["variablesReference"]
    client.ask("setVariable", variablesReference=locals_, name="R", value="1")
    assert client.events("output")[-1]["output"] == "wrote Main.R := 1 in scan 18; scans 19..19 are forgotten\n"
    client.go("fbvm/stepScan", scans=2)
    client.go("fbvm/gotoScan", scan=5)
    locals_ = client.scopes()["Locals"]["variablesReference"]
    assert client.ask("setVariable", variablesReference=locals_, name="N", value="99")["value"] == "99"
    assert client.events("output")[-1]["output"] == "wrote Main.N := 99 in scan 5; scans 6..19 are forgotten\n"
    client.go("fbvm/stepScan", scans=5)
    assert client.value("N") == "104"


@pytest.mark.slow
def test_a_trap_is_an_exception_that_only_going_back_leaves(file: Path) -> None:
    client = Client()
    stop = client.begin({"setExceptionBreakpoints": {"filters": ["trap"]}}, program=str(file),
                        set=[{"name": "CIO 0.00", "value": True, "at": "20ms"}], stopOnEntry=False)
    assert stop["reason"] == "exception" and stop["text"] == "R0101" and client.line == 25
    info = client.ask("exceptionInfo", threadId=1)
    assert info["exceptionId"] == "R0101" and info["breakMode"] == "always" and "100 divided by 0" in info["description"]
    assert info["details"] == {"message": info["description"], "typeName": "R0101", "stackTrace": f"{file}:25:14 in Main"}
    with pytest.raises(RefusedError, match=r"nothing continues behind a trap \(R0101\); stepping back does"):
        client.ask("continue", threadId=1)
    client.go("stepBack")
    assert client.line == 25 and client.value("N") == "5"
    with pytest.raises(RefusedError, match="did not stop at an exception"):
        client.ask("exceptionInfo", threadId=1)


def test_filters_in_both_forms_and_unknown_ones(file: Path) -> None:
    client = Client()
    client.begin(program=str(file))
    answer = client.ask("setExceptionBreakpoints", filters=["modbus", "nonsense"],
                        filterOptions=[{"filterId": "response", "condition": "16#0302"}, {"filterId": "trap", "condition": "x"}])
    assert [row["verified"] for row in answer["breakpoints"]] == [True, False, True, False]


@pytest.mark.slow
def test_a_run_with_an_end_ends_the_session(file: Path) -> None:
    client = Client()
    assert client.begin(program=str(file), **{"for": "1s"}) == {}
    assert client.events("exited") == [{"exitCode": 0}] and client.events("terminated") == [{}]


def test_what_the_last_scans_said_comes_before_the_end(file: Path) -> None:
    client = Client()
    client.begin(lines(file, {"line": 19, "logMessage": "n={N}"}), program=str(file), **{"for": "50ms"})
    events = [row["event"] for row in client.messages if row.get("event") in ("output", "exited")]
    assert events[-2:] == ["output", "exited"] and "n=5" in client.events("output")[-1]["output"]


@pytest.mark.slow
def test_log_points_speak_again_only_of_what_was_changed(file: Path) -> None:
    client = Client()
    client.begin(lines(file, {"line": 19, "logMessage": "n={N}"}), program=str(file), stopOnEntry=True)
    client.go("fbvm/stepScan", scans=3)
    for typed, numbers in (("print Main.N", ""), ("Main.N := 10", "11 12 13"), ("force Main.R = 1", "11 12 13")):
        client.go("fbvm/gotoScan", scan=0)
        client.value(typed, "repl")
        before = len(client.events("output"))
        client.go("fbvm/stepScan", scans=3)
        said = [row["output"].partition("n=")[2].strip() for row in client.events("output")[before:] if "n=" in row["output"]]
        assert " ".join(said) == numbers, typed


@pytest.mark.slow
def test_a_restart_ends_what_runs(file: Path) -> None:
    client = Client()
    client.begin(program=str(file))
    client.ask("continue", threadId=1)
    assert client.adapter.work() and client.adapter.is_running
    client.ask("restart")
    assert not client.adapter.is_running and client.events("stopped")[-1]["reason"] == "entry" and client.value("N") == "0"
    client.go("fbvm/stepScan", scans=2)
    assert client.value("N") == "2"


@pytest.mark.slow
def test_what_a_plc_warns_of_stops_at_the_beginning_if_that_is_wanted(tmp_path: Path) -> None:
    path = tmp_path / "fast.st"
    path.write_text("""PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM
CONFIGURATION C RESOURCE R ON PLC TASK t(INTERVAL := T#1ms, PRIORITY := 1); PROGRAM p WITH t : Main; END_RESOURCE
END_CONFIGURATION""", encoding="utf-8")
    stop = Client().begin({"setExceptionBreakpoints": {"filters": ["warning"]}}, program=str(path), cycle="10ms")
    assert (stop["reason"], stop["text"]) == ("exception", "warning") and "1ms" in stop["description"]
    assert Client().begin(program=str(path), cycle="10ms")["reason"] == "entry"


@pytest.mark.slow
def test_what_the_rest_of_the_last_scan_said_comes_before_the_end(file: Path) -> None:
    client = Client()
    client.begin(lines(file, {"line": 18, "condition": "N = 4"}, {"line": 19, "logMessage": "n={N}"}), program=str(file),
                 **{"for": "50ms"})  # fmt: skip
    assert client.events("output")[-1]["output"].endswith("n=4\n")
    client.go("continue")
    events = [row["event"] for row in client.messages if row.get("event") in ("output", "exited")]
    assert events[-2:] == ["output", "exited"] and client.events("output")[-1]["output"].endswith("n=5\n")


@pytest.mark.slow
def test_restart_keeps_the_breakpoints(file: Path) -> None:
    client = Client()
    client.begin(lines(file, 22), program=str(file))
    file.write_text(TEXT.replace("N MOD 10 = 0", "N MOD 10 = 3"), encoding="utf-8")
    client.ask("restart")
    assert client.rest()["reason"] == "breakpoint" and client.value("N") == "3"


# --- values -------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_scopes_have_what_there_is(file: Path) -> None:
    client = Client()
    client.begin(lines(file, 6), program=str(file))
    scopes = client.scopes()
    assert list(scopes)[:3] == ["Inputs", "Outputs", "Locals"] and "Globals" not in scopes and scopes["Areas"]["expensive"]
    assert client.rows(scopes["Inputs"]["variablesReference"])["A"]["value"] == "1"
    inputs = client.rows(scopes["Inputs"]["variablesReference"])["A"]
    assert inputs["evaluateName"] == "Main.T.A" and inputs["type"] == "INT"
    assert client.rows(scopes["Runtime"]["variablesReference"])["scan"]["value"] == "0"
    main = client.scopes(1)
    assert next(iter(main)) == "Locals" and "Inputs" not in main
    rows = client.rows(main["Locals"]["variablesReference"])
    assert rows["Wait"]["value"] == "T#50ms" and rows["Limit"]["presentationHint"]["attributes"] == ["constant", "readOnly"]
    units = client.rows(main["Units"]["variablesReference"])
    assert "Send Request Switch" in units["CIO 1519.03"]["value"]


@pytest.mark.slow
def test_large_arrays_and_areas_come_in_pages(file: Path) -> None:
    client = Client()
    client.begin(program=str(file))
    big = client.rows(client.scopes()["Locals"]["variablesReference"])["Big"]
    assert big["indexedVariables"] == 1000 and "memoryReference" in big
    page = client.rows(big["variablesReference"], start=990, count=100, filter="indexed")
    assert list(page) == [f"[{number}]" for number in range(990, 1000)]
    assert client.rows(big["variablesReference"], start=5000, count=10) == {}
    areas = client.rows(client.scopes()["Areas"]["variablesReference"])
    words = client.rows(areas["D"]["variablesReference"], start=32760, count=100)
    assert areas["D"]["indexedVariables"] == 32768 and list(words)[-1] == "D32767" and words["D32767"]["value"] == "0 (16#0000)"


@pytest.mark.slow
def test_a_client_without_paging_never_gets_more_than_256_rows(file: Path) -> None:
    client = Client(supportsVariablePaging=False)
    client.begin(program=str(file))
    areas = client.rows(client.scopes()["Areas"]["variablesReference"])
    nodes = client.rows(areas["D"]["variablesReference"])
    assert len(nodes) == 128 and len(client.rows(nodes["[256..511]"]["variablesReference"])) == 256


def test_references_end_when_the_position_changes(file: Path) -> None:
    client = Client()
    client.begin(program=str(file))
    reference, frame = client.scopes()["Locals"]["variablesReference"], client.frames[0]["id"]
    client.go("next")
    for command, arguments in {"variables": {"variablesReference": reference}, "scopes": {"frameId": frame},
                               "setVariable": {"variablesReference": reference, "name": "N", "value": "1"}}.items():
        with pytest.raises(RefusedError, match="is not known"):
            client.ask(command, **arguments)


@pytest.mark.slow
def test_setting_the_shown_value_changes_nothing(file: Path) -> None:
    client = Client()
    client.begin(lines(file, 22), program=str(file))
    reference = client.scopes()["Locals"]["variablesReference"]
    rows = client.rows(reference)
    for name, row in rows.items():
        if row["variablesReference"] or name == "Limit":
            continue
        reference = client.scopes()["Locals"]["variablesReference"]
        assert client.ask("setVariable", variablesReference=reference, name=name, value=row["value"])["value"] == row["value"]
    with pytest.raises(RefusedError, match="CONSTANT"):
        client.ask("setVariable", variablesReference=client.scopes()["Locals"]["variablesReference"], name="Limit", value="1")
    with pytest.raises(RefusedError, match="range"):
        client.ask("setVariable", variablesReference=client.scopes()["Locals"]["variablesReference"], name="N", value="99999")


@pytest.mark.slow
def test_force_and_release(file: Path) -> None:
    client = Client()
    client.begin(program=str(file))
    assert client.ask("fbvm/force", name="R", value="5")["forces"] == [{"name": "Main.R", "value": "5"}]
    assert client.events("invalidated") == [{"areas": ["variables"]}]
    client.go("fbvm/stepScan", scans=3)
    assert client.value("Main.R") == "5 (forced)" and client.value("Main.R", "clipboard") == "5"
    assert list(client.rows(client.scopes()["Forced"]["variablesReference"])) == ["Main.R"]
    assert client.ask("fbvm/unforce")["forces"] == [] and client.ask("fbvm/forces") == {"forces": []}


@pytest.mark.slow
def test_expressions_names_and_commands_in_the_console(file: Path) -> None:
    client = Client()
    client.begin(lines(file, 6), program=str(file))
    assert client.value("A", frame=0) == "1" and client.value("Q + 2 * 3", frame=0) == "7"
    assert client.value("Main.N > 0") == "TRUE"
    assert client.value("D199..D200") == "[0 (16#0000), 0 (16#0000)]"
    assert "Main.N" in client.value("table Main.N", "repl") and "pump.st:18" in client.value("why Main.N", "repl")
    before = len(client.events("stopped"))
    client.value("goto 7", "repl")
    assert len(client.events("stopped")) == before + 1 and client.value("Main.N") == "7"
    client.value("Main.N := 40", "repl")
    assert client.value("Main.N") == "40"
    wrong = {"Nobody": "there is no Nobody", "1 / 0": "division by zero", "quit": "the editor has that", "": "nothing to"}
    for text, said in wrong.items():
        with pytest.raises(RefusedError, match=said):
            client.ask("evaluate", expression=text, context="repl")


@pytest.mark.slow
def test_hexadecimal_is_asked_for(file: Path) -> None:
    client = Client()
    client.begin(lines(file, 22), program=str(file))
    assert client.ask("evaluate", expression="N", format={"hex": True})["result"].endswith("A")


def test_completions_are_the_names_that_can_be_written_here(file: Path) -> None:
    client = Client()
    client.begin(lines(file, 6), program=str(file))
    frame = client.frames[0]["id"]

    def labels(text: str) -> list[str]:
        return [row["label"] for row in client.ask("completions", text=text, column=len(text) + 1, frameId=frame)["targets"]]

    assert labels("Main.T.") == ["Main.T.A", "Main.T.Q", "Main.T.k"]
    assert "A" in labels("") and "why" in labels("wh") and "Main" in labels("print M")
    rows = client.ask("completions", text="print Ma", column=9, frameId=frame)["targets"]
    assert [(row["label"], row["start"], row["length"]) for row in rows if row["label"] == "Main"] == [("Main", 7, 2)]
    from_0 = Client(columnsStartAt1=False)
    from_0.begin(lines(file, 6), program=str(file))
    rows = from_0.ask("completions", text="print Ma", column=8, frameId=from_0.frames[0]["id"])["targets"]
    assert [(row["label"], row["start"], row["length"]) for row in rows if row["label"] == "Main"] == [("Main", 6, 2)]


def test_memory_is_read_and_written_in_words_with_their_high_byte_first(file: Path) -> None:
    client = Client()
    client.begin(program=str(file))
    client.ask("setExpression", expression="D200", value="16#1234")
    answer = client.ask("readMemory", memoryReference="D200", count=4)
    assert base64.b64decode(answer["data"]) == b"\x12\x34\x00\x00"
    written = client.ask("writeMemory", memoryReference="D200", offset=2, data=base64.b64encode(b"\xab\xcd").decode())
    assert written["bytesWritten"] == 2
    assert client.value("D201") == "43981 (16#ABCD)" and client.events("memory")[-1]["count"] == 2
    assert client.events("memory")[-1]["offset"] == 0
    before = client.ask("readMemory", memoryReference=answer["address"], offset=-2, count=4)
    assert base64.b64decode(before["data"]) == b"\0\0\x12\x34"
    assert [client.ask("readMemory", memoryReference="D200", **asked)["data"] for asked in ({}, {"count": 0})] == ["", ""]
    client.ask("setExpression", expression="Main.N", value="16#1234")
    assert base64.b64decode(client.ask("readMemory", memoryReference="Main.N", count=2)["data"]) == b"\x34\x12"
    behind = base64.b64decode(client.ask("readMemory", memoryReference="D32767", offset=2, count=2)["data"])
    assert behind[0] and not behind[1], "right behind the last word lies the number of a type, low byte first"
    client.ask("writeMemory", memoryReference="D210", data=base64.b64encode(b"\x0a\x0b").decode())
    assert (client.value("D210"), client.value("D211")) == ("2571 (16#0A0B)", "0 (16#0000)")
    far = client.ask("readMemory", memoryReference="0x7FFFFFFF", count=8)
    assert far["unreadableBytes"] == 8
    for arguments in ({"memoryReference": "D0", "data": "?"}, {"memoryReference": "0x7FFFFFFF", "data": "AAA="}):
        with pytest.raises(RefusedError):
            client.ask("writeMemory", **arguments)


def test_values_beside_the_lines(file: Path) -> None:
    client = Client()
    client.begin(lines(file, 6), program=str(file))
    frame = client.frames[0]["id"]
    rows = client.ask("fbvm/inlineValues", source={"path": str(file)}, startLine=5, endLine=6, frameId=frame)["values"]
    assert [(row["line"], row["text"]) for row in rows] == [(5, "Q = 1"), (5, "A = 1"), (6, "Q = 1"), (6, "k = 0")]
    assert rows[0]["expression"] == "Main.T.Q"


def test_sources_ends_and_checksums(file: Path) -> None:
    client = Client()
    client.begin(lines(file, 6), program=str(file))
    frame = client.frames[0]
    assert (frame["line"], frame["column"], frame["endLine"], frame["endColumn"]) == (6, 5, 6, 15)
    assert frame["source"]["checksums"][0]["algorithm"] == "SHA256"
    sources = client.ask("loadedSources")["sources"]
    assert [row["name"] for row in sources] == ["pump.st"]
    assert client.ask("source", source={"path": str(file)})["content"].startswith("FUNCTION_BLOCK Twice")
    with pytest.raises(RefusedError, match="no such source"):
        client.ask("source", source={"sourceReference": 99})


def test_lines_from_0_and_columns_in_utf_16(tmp_path: Path) -> None:
    path = tmp_path / "ü.st"
    path.write_text("PROGRAM Main\nVAR a : INT; END_VAR\n(* 😀 *) a := 1;\nEND_PROGRAM\n", encoding="utf-8")
    client = Client(linesStartAt1=False, columnsStartAt1=False)
    client.begin(program=str(path))
    assert (client.frames[0]["line"], client.frames[0]["column"]) == (2, 9)


def test_a_library_block_is_a_source_with_a_number(tmp_path: Path) -> None:
    path = tmp_path / "timer.st"
    path.write_text("PROGRAM Main\nVAR t : TON; END_VAR\nt(IN := TRUE, PT := T#1s);\nEND_PROGRAM\n", encoding="utf-8")
    client = Client()
    client.begin(program=str(path))
    client.go("stepIn")
    source = client.frames[0]["source"]
    assert source["name"] == "TON.st" and source["presentationHint"] == "deemphasize"
    assert "FUNCTION_BLOCK TON" in client.ask("source", sourceReference=source["sourceReference"])["content"]
    answer = client.ask("setBreakpoints", source=source, breakpoints=[{"line": 1}])["breakpoints"]
    assert answer[0]["verified"]


def test_every_request_that_is_there_is_tried_here() -> None:
    here = Path(__file__)
    files = [here, here.with_name("test_adapter_plants.py"), here.parents[1] / "rigs" / "dap_client.py"]
    asked = "".join(file.read_text(encoding="utf-8") for file in files)
    missing = [command for command in Client().adapter._requests if f'"{command}"' not in asked]
    assert missing == []
