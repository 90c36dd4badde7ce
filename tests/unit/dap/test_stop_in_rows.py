"""A stop as an editor shows it, row by row: frames, scopes, variables; and where each request that moves comes to stand."""

from __future__ import annotations

from base64 import b64encode
from pathlib import Path
from typing import Any

import pytest
from dap_client import Body, Client, RefusedError

TEXT = """\
TYPE
    Phase : (Idle, Filling, Full);
    Tank : STRUCT Level : INT; Name : STRING[8]; END_STRUCT;
END_TYPE
VAR_GLOBAL Total : DINT := 40000; END_VAR
FUNCTION Sum : INT
VAR_INPUT A, B : INT; END_VAR
VAR C : INT; END_VAR
    C := A + B;
    Sum := C;
END_FUNCTION
FUNCTION_BLOCK Pump
VAR_INPUT On : BOOL; END_VAR
VAR_OUTPUT Speed : INT; END_VAR
VAR_IN_OUT Count : INT; END_VAR
VAR State : Phase := Filling; END_VAR
VAR_TEMP Twice : INT; END_VAR
    Twice := 2 * Count;
    Speed := Sum(A := Twice, B := 1);
END_FUNCTION_BLOCK
PROGRAM Main
VAR
    N : INT := 3;
    P : Pump;
    T : Tank := (Level := 5, Name := 'a');
    Level AT D200 : UINT := 129;
    Big : ARRAY[0..599] OF INT;
    Few : ARRAY[1..3] OF INT := [1, 2, 3];
    Most : ARRAY[1..16] OF SINT; More : ARRAY[1..17] OF SINT;
END_VAR
VAR CONSTANT Limit : INT := 7; END_VAR
    P(On := TRUE, Count := N);
    N := N + 1;
    Total := Total + 1;
END_PROGRAM
"""
COUNTED = (("namedVariables", "names"), ("indexedVariables", "numbers"))
SHARED = ["Globals: 1", "Programs: 1", "Areas: 13, later", "Units: 272 numbered, registers", "Runtime: 9"]
"""The scopes that each frame has."""


def begun(tmp_path: Path, **said: Any) -> Client:
    path = tmp_path / "pump.st"
    path.write_text(TEXT, encoding="utf-8")
    client = Client(**said)
    client.begin(program=str(path))
    return client


def shown(scope: Body) -> str:
    count = f"{scope['namedVariables']}" if "namedVariables" in scope else f"{scope['indexedVariables']} numbered"
    hint = f", {scope['presentationHint']}" if "presentationHint" in scope else ""
    return f"{scope['name']}: {count}{', later' if scope['expensive'] else ''}{hint}"


def rows(client: Client, reference: int, **arguments: int) -> list[str]:
    """The rows behind a reference: name, value, type, the name for a watch if it is another one, and what is inside."""
    found = []
    for row in client.ask("variables", variablesReference=reference, **arguments)["variables"]:
        inside = [f"{row[key]} {word}" for key, word in COUNTED if key in row]
        assert bool(inside) == bool(row["variablesReference"])
        watched = [f"as {row['evaluateName']}"] if row.get("evaluateName", row["name"]) != row["name"] else []
        hints = row.get("presentationHint", {}).get("attributes", [])
        found.append(", ".join([f"{row['name']} = {row['value']}", *([row["type"]] if "type" in row else []), *watched, *hints,
                                *inside]))  # fmt: skip
    return found


@pytest.mark.slow
def test_each_frame_has_its_scopes_and_each_scope_its_rows(tmp_path: Path) -> None:
    client = begun(tmp_path)
    for _ in range(3):
        client.go("stepIn")
    answer = client.ask("stackTrace", threadId=1)
    frames = answer["stackFrames"]
    assert [(row["name"], row["line"], row["column"], row.get("endLine"), row.get("endColumn"), row.get("canRestart"))
            for row in frames] == [
        ("Sum", 9, 5, 9, 15, True), ("Pump  Main.P", 19, 5, 19, 37, True), ("Main", 32, 5, 32, 30, True),
        ("scan 0, 0s", 0, 0, None, None, None)]  # fmt: skip
    assert answer["totalFrames"] == 4 and frames[3]["presentationHint"] == "label"
    assert all(row["source"]["name"] == "pump.st" and "presentationHint" not in row["source"] for row in frames[:3])
    for first, levels, names in ((1, 2, ["Pump  Main.P", "Main"]), (3, 1, ["scan 0, 0s"]), (2, 0, ["Main", "scan 0, 0s"])):
        part = client.ask("stackTrace", threadId=1, startFrame=first, levels=levels)
        assert ([row["name"] for row in part["stackFrames"]], part["totalFrames"]) == (names, 4)

    own = [client.ask("scopes", frameId=row["id"])["scopes"] for row in frames]
    assert [[shown(scope) for scope in scopes] for scopes in own] == [
        ["Inputs: 2, arguments", "Locals: 2, locals", *SHARED],
        ["Temporary: 1, locals", "Inputs: 1, arguments", "Outputs: 1", "In-outs: 1", "Locals: 1, locals", *SHARED],
        ["Locals: 9, locals", *SHARED], SHARED]  # fmt: skip
    inside = [[rows(client, scope["variablesReference"]) for scope in scopes if shown(scope) not in SHARED] for scopes in own]
    assert inside[0] == [["A = 6, INT", "B = 1, INT"], ["C = 0, INT", "Sum = 0, INT"]]
    assert inside[1] == [["Twice = 6, INT"], ["On = TRUE, BOOL, as Main.P.On"], ["Speed = 0, INT, as Main.P.Speed"],
                         ["Count = 3, INT, as Main.P.Count"], ["State = Filling (1), Phase, as Main.P.State"]]  # fmt: skip
    assert inside[2] == [[
        "N = 3, INT, as Main.N", "P = Pump, Pump, as Main.P, 4 names", "T = Tank, Tank, as Main.T, 2 names",
        "Level = 129, UINT, as Main.Level", "Big = ARRAY [0..599] OF INT, ARRAY [0..599] OF INT, as Main.Big, 600 numbers",
        "Few = [1, 2, 3], ARRAY [1..3] OF INT, as Main.Few, 3 numbers",
        f"Most = [{', '.join('0' * 16)}], ARRAY [1..16] OF SINT, as Main.Most, 16 numbers",
        "More = ARRAY [1..17] OF SINT, ARRAY [1..17] OF SINT, as Main.More, 17 numbers",
        "Limit = 7, INT, as Main.Limit, constant, readOnly"]]

    shared = {scope["name"]: scope["variablesReference"] for scope in own[3]}
    assert rows(client, shared["Globals"]) == ["Total = 40000, DINT"]
    assert rows(client, shared["Programs"]) == ["Main = Main, Main, 9 names"]
    assert rows(client, shared["Runtime"]) == [f"{row}, readOnly" for row in (
        "scan = 0", "statement = 3", "time = T#0s", "cycle = T#10ms", "mode = RUN", "executed scans = 0", "budget = 2000000",
        "engine = Python", "warnings = none")]  # fmt: skip
    areas = rows(client, shared["Areas"])
    assert (areas[1], areas[-1], len(areas)) == (
        "CIO = inputs, outputs and words of units, area, 6144 numbers", "D = data words, area, 32768 numbers", 13)
    assert rows(client, shared["Areas"], start=11, count=1) == ["M = memory of portable programs, area, 65536 numbers"]

    locals_of = client.ask("variables", variablesReference=own[2][0]["variablesReference"])["variables"]
    parts = {row["name"]: row["variablesReference"] for row in locals_of}
    assert rows(client, parts["T"]) == ["Level = 5, INT, as Main.T.Level", "Name = 'a', STRING[8], as Main.T.Name"]
    assert rows(client, parts["T"], start=1, count=1) == ["Name = 'a', STRING[8], as Main.T.Name"]
    assert rows(client, parts["Few"]) == [f"[{number}] = {number}, INT, as Main.Few[{number}]" for number in (1, 2, 3)]
    assert rows(client, parts["Few"], start=1, count=1) == ["[2] = 2, INT, as Main.Few[2]"]
    assert rows(client, parts["Big"], start=598, count=9) == [
        "[598] = 0, INT, as Main.Big[598]", "[599] = 0, INT, as Main.Big[599]"]


@pytest.mark.slow
def test_a_client_without_pages_gets_long_rows_in_parts(tmp_path: Path) -> None:
    client = begun(tmp_path, supportsVariablePaging=False)
    locals_of = client.rows(client.scopes()["Locals"]["variablesReference"])
    assert rows(client, locals_of["Few"]["variablesReference"])[2] == "[3] = 3, INT, as Main.Few[3]"
    areas = client.rows(client.scopes()["Areas"]["variablesReference"])
    assert [(name, areas[name]["indexedVariables"]) for name in ("CF", "W", "H", "D")] == [
        ("CF", 128), ("W", 2), ("H", 6), ("D", 128)]
    halves = client.ask("variables", variablesReference=areas["W"]["variablesReference"])["variables"]
    assert [row["name"] for row in halves] == ["[0..255]", "[256..511]"]
    last = client.ask("variables", variablesReference=halves[1]["variablesReference"])["variables"]
    assert (len(last), last[0]["name"], last[-1]["name"]) == (256, "W256", "W511")


@pytest.mark.slow
def test_an_expression_has_its_type_and_where_it_lies(tmp_path: Path) -> None:
    client = begun(tmp_path)
    for text, result, kind in (("N + 1", "4", "INT"), ("T#50ms + T#1s", "T#1s50ms", "TIME"), ("N > 1", "TRUE", "BOOL"),
                               ("Level", "129", "UINT"), ("P.State", "Filling (1)", "Phase")):  # fmt: skip
        answer = client.ask("evaluate", expression=text, context="watch")
        assert (answer["result"], answer["type"]) == (result, kind), text
        assert "memoryReference" not in answer
    word = client.ask("evaluate", expression="D200", context="watch")
    assert word["result"] == "129 (16#0081)"
    assert client.ask("readMemory", memoryReference=word["memoryReference"], count=2)["data"] == b64encode(b"\x00\x81").decode()


@pytest.mark.slow
def test_where_each_move_comes_to_stand(tmp_path: Path) -> None:
    client = begun(tmp_path)
    for command, arguments, stands in (
        ("stepIn", {}, ("step", "scan 0, 0s", 18)), ("stepIn", {}, ("step", "scan 0, 0s", 19)),
        ("stepIn", {}, ("step", "scan 0, 0s", 9)), ("stepOut", {}, ("step", "scan 0, 0s", 33)),
        ("stepOut", {}, ("step", "scan 0, 0s", 0)), ("stepBack", {}, ("step", "back in scan 0, 0s", 34)),
        ("next", {}, ("step", "scan 0, 0s", 0)), ("fbvm/stepBackInto", {}, ("step", "back in scan 0, 0s", 34)),
        ("fbvm/stepBackInto", {}, ("step", "back in scan 0, 0s", 33)),
        ("fbvm/stepBackInto", {}, ("step", "back in scan 0, 0s", 10)), ("restartFrame", {}, ("restart", "back in scan 0, 0s", 9)),
        ("fbvm/stepScan", {}, ("step", "scan 1, 10ms", 32)), ("fbvm/stepScan", {"scans": 3}, ("step", "scan 4, 40ms", 32)),
        ("fbvm/stepScan", {"scans": -1}, "at least one scan"), ("stepBack", {}, ("step", "back in scan 3, 30ms", 0)),
        ("fbvm/stepBackScan", {}, ("step", "back in scan 3, 30ms", 32)),
        ("fbvm/stepBackScan", {"scans": 2}, ("step", "back in scan 1, 10ms", 32)),
        ("fbvm/gotoScan", {"scan": -1}, "scans are counted from 0"), ("fbvm/gotoScan", {"scan": 4}, ("step", "scan 4, 40ms", 32)),
        ("fbvm/gotoScan", {"scan": 6}, ("step", "scan 6, 60ms", 32)),
        ("fbvm/gotoScan", {"scan": 1}, ("step", "back in scan 1, 10ms", 32)),
        ("fbvm/lastWrite", {"name": "Main.N"}, ("data breakpoint", "Main.N was 3, is 4, by pump.st:33 in Main", 34)),
        ("fbvm/lastWrite", {"name": "Main.Limit"}, ("step", "Main.Limit was never changed before", 34)),
        ("reverseContinue", {}, ("entry", "beginning of what is kept: scan 0, 0s", 32)),
        ("stepBack", {}, "this is the beginning of what is kept: scan 0, 0s"), ("next", {}, ("step", "scan 0, 0s", 33)),
        ("next", {}, ("step", "scan 0, 0s", 34)), ("next", {}, ("step", "scan 0, 0s", 0)),
        ("next", {}, ("step", "scan 1, 10ms", 32)),
    ):  # fmt: skip
        if command == "restartFrame":
            arguments = {"frameId": client.frames[0]["id"]}
        try:
            stop = client.go(command, **arguments)
            found: object = (stop["reason"], stop["description"], client.line)
        except RefusedError as refusal:
            found = str(refusal)
        assert found == stands, (command, arguments)


@pytest.mark.slow
def test_log_points_speak_again_behind_a_change_of_memory(tmp_path: Path) -> None:
    client = begun(tmp_path)
    client.ask("setBreakpoints", source={"path": str(tmp_path / "pump.st")}, breakpoints=[{"line": 33, "logMessage": "n {N}"}])
    client.go("fbvm/stepScan", scans=2)
    client.go("fbvm/gotoScan", scan=1)
    client.go("fbvm/stepScan")
    told = [row["output"].split(": ")[-1].strip() for row in client.events("output")]
    assert len([row for row in told if "n " in row]) == 2, "what was said is not said again"
    client.go("fbvm/gotoScan", scan=1)
    client.ask("writeMemory", memoryReference="Main.N", data=b64encode(b"\x09\x00").decode())
    client.go("fbvm/stepScan")
    assert len([row for row in client.events("output") if "n 9" in row["output"]]) == 1


@pytest.mark.slow
def test_why_it_stands_at_a_breakpoint(tmp_path: Path) -> None:
    client, file = begun(tmp_path), str(tmp_path / "pump.st")
    client.ask("setBreakpoints", source={"path": file}, breakpoints=[{"line": 33}])
    stop = client.go("continue")
    assert (stop["reason"], stop["description"], stop["hitBreakpointIds"]) == ("breakpoint", f"breakpoint {file}:33", [1])
    client.ask("setBreakpoints", source={"path": file}, breakpoints=[{"line": 33, "condition": "N > 6"}])
    stop = client.go("continue")
    assert (stop["reason"], stop["description"]) == ("breakpoint", f"breakpoint {file}:33 when N > 6")
    assert client.value("N") == "7"
    client.ask("setBreakpoints", source={"path": file}, breakpoints=[])
    data = client.ask("dataBreakpointInfo", name="Total")["dataId"]
    client.ask("setDataBreakpoints", breakpoints=[{"dataId": data}])
    stop = client.go("continue")
    assert (stop["reason"], stop["description"]) == ("data breakpoint", "Total was 40004, is 40005, by pump.st:34 in Main")


@pytest.mark.slow
def test_memory_is_written_up_to_its_last_byte(tmp_path: Path) -> None:
    client = begun(tmp_path)
    size = client.adapter.debug.plc().memory.size
    for offset, data, good in ((size - 2, b"\x01\x02", True), (size - 1, b"\x01\x02", False), (-1, b"\x01", False)):
        arguments = {"memoryReference": "0x0", "offset": offset, "data": b64encode(data).decode()}
        if good:
            assert client.ask("writeMemory", **arguments)["bytesWritten"] == len(data)
        else:
            with pytest.raises(RefusedError, match="outside of the memory"):
                client.ask("writeMemory", **arguments)


def test_what_is_put_out_ends_with_one_line_end() -> None:
    client = Client()
    for text in ("a", "b\n", ""):
        client.adapter._output(text)
    assert [row["output"] for row in client.events("output")] == ["a\n", "b\n", "\n"]


@pytest.mark.slow
def test_what_the_console_completes_and_what_a_move_invalidates(tmp_path: Path) -> None:
    client = begun(tmp_path)
    frame, scope = client.frames[0]["id"], client.scopes()["Locals"]["variablesReference"]
    found = client.ask("completions", text="fo", column=3, frameId=frame)["targets"]
    assert [(row["label"], row["type"], row["start"], row["length"]) for row in found] == [("force", "keyword", 1, 2)]
    assert client.ask("completions", text="qui", column=4, frameId=frame)["targets"] == [], "the editor has that"
    rows = client.ask("completions", text="print Main.Fe", column=14, frameId=frame)["targets"]
    assert [(row["label"], row["start"], row["length"]) for row in rows] == [("Main.Few", 7, 7)]
    client.ask("continue", threadId=1)
    with pytest.raises(RefusedError):
        client.ask("variables", variablesReference=scope)
    client.ask("pause", threadId=1)
