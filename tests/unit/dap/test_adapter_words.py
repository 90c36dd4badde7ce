"""What the debug adapter refuses and says: moves that cannot be, values that are shown only, paths as clients write them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from dap_client import Client, RefusedError

TEXT = """\
TYPE Mode : (Off, Slow, Fast); Pair : STRUCT a, b : INT; END_STRUCT END_TYPE
FUNCTION_BLOCK Own
VAR k : INT; END_VAR
PROPERTY Half : INT
GET Half := 100 / k; END_GET
END_PROPERTY
END_FUNCTION_BLOCK
PROGRAM Main
VAR
    n, d : INT;
    mode : Mode := Mode#Fast; said : STRING;
    pair : Pair;
    r, none : REF_TO INT;
    few : ARRAY[1..2] OF INT := [5, 6];
    many : ARRAY[1..17] OF INT;
    lots : ARRAY[0..600] OF INT;
    own : Own;
    Lamp AT CIO 100.01 : BOOL;
END_VAR
VAR CONSTANT Limit : INT := 7; END_VAR
    n := n + 1; r := REF(n); Lamp := n MOD 2 = 1;
    d := d + n;
END_PROGRAM
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "words.st"
    path.write_text(TEXT, encoding="utf-8")
    return path


@pytest.fixture
def client(file: Path) -> Client:
    made = Client()
    made.begin(program=str(file))
    return made


def refused(client: Client, command: str, **arguments: Any) -> str:
    with pytest.raises(RefusedError) as said:
        client.ask(command, **arguments)
    return str(said.value)


def test_moves_that_cannot_be(client: Client) -> None:
    assert refused(client, "fbvm/stepScan", threadId=1, scans=-1) == "at least one scan"
    assert refused(client, "fbvm/gotoScan", threadId=1, scan=-1) == "scans are counted from 0"
    assert refused(client, "fbvm/gotoScan", threadId=1) == "the argument 'scan' is missing"
    assert refused(client, "restartFrame", frameId=client.frames[-1]["id"]) == "this frame has no beginning"
    assert refused(client, "restartFrame", frameId=999).startswith("reference 999 is not known")
    assert client.events("stopped")[-1]["reason"] == "entry" and client.value("n") == "0"
    client.go("fbvm/stepScan", scans=3)
    assert client.go("fbvm/lastWrite", name="Limit")["description"] == "Main.Limit was never changed before"
    assert client.value("n") == "3", "it stands where it stood"
    client.go("fbvm/gotoScan", scan=3)
    client.go("fbvm/gotoScan", scan=5)
    assert client.value("n") == "5" and client.events("stopped")[-1]["reason"] == "step"


def test_what_comes_from_a_client_and_is_no_request_is_left_alone(client: Client) -> None:
    before = len(client.messages)
    for message in ({"type": "event", "event": "x"}, {"type": "response", "request_seq": 1}, {}):
        client.adapter.receive(message)
    assert len(client.messages) == before


def test_a_restart_of_nothing_is_refused_and_a_run_without_debugging_stops_nowhere(file: Path) -> None:
    client = Client()
    client.ask("initialize", adapterID="fbvm")
    assert refused(client, "restart") == "nothing is debugged"
    client = Client()
    stops = {"setBreakpoints": {"source": {"path": str(file)}, "breakpoints": [{"line": 22}]}}
    assert client.begin(stops, program=str(file), noDebug=True, **{"for": "50ms"}) == {}
    assert client.events("stopped") == [] and client.events("exited") == [{"exitCode": 0}]


@pytest.mark.slow
def test_a_breakpoint_that_the_changed_program_has_not_is_told(file: Path) -> None:
    client = Client()
    rows = [{"line": 22}, {"line": 21, "condition": "d > 5"}]
    client.begin({"setBreakpoints": {"source": {"path": str(file)}, "breakpoints": rows}}, program=str(file))
    assert client.line == 22
    file.write_text(TEXT.replace("    d := d + n;\n", "").replace("n, d : INT", "n : INT"), encoding="utf-8")
    client.ask("restart")
    changed = [row["breakpoint"] for row in client.events("breakpoint")]
    assert [(row["id"], row["verified"], row["reason"]) for row in changed] == [(1, False, "failed"), (2, False, "failed")]
    assert "last statement" in changed[0]["message"] and "d" in changed[1]["message"]


@pytest.mark.slow
def test_a_long_run_is_told_to_its_end(file: Path) -> None:
    client = Client()
    client.begin(program=str(file))
    client.ask("setBreakpoints", source={"path": str(file)}, breakpoints=[{"line": 22, "condition": "n = 40"}])
    client.ask("continue", threadId=1)
    client.adapter.tell_progress()
    client.rest()
    started = client.events("progressStart")[-1]
    assert started["cancellable"] and client.events("progressEnd") == [{"progressId": started["progressId"]}]
    client.adapter.tell_progress()
    assert len(client.events("progressStart")) == 1, "nothing runs any more"
    quiet = Client(supportsProgressReporting=False)
    quiet.begin(program=str(file))
    quiet.ask("continue", threadId=1)
    quiet.adapter.tell_progress()
    assert quiet.events("progressStart") == []


def test_values_as_they_are_shown(client: Client) -> None:
    client.go("fbvm/stepScan")
    shown = {"mode": "Fast (2)", "pair": "Pair", "r": "-> Main.n", "none": "NULL", "few": "[5, 6]", "own": "Own", "Limit": "7",
             "many": "ARRAY [1..17] OF INT", "Lamp": "TRUE", "CIO 100": "2 (16#0002)"}  # fmt: skip
    assert {text: client.value(text) for text in shown} == shown
    locals_ = client.rows(client.scopes()["Locals"]["variablesReference"])
    assert locals_["Limit"]["presentationHint"] == {"attributes": ["constant", "readOnly"]}
    assert "presentationHint" not in locals_["n"]
    assert client.ask("setExpression", expression="mode", value="Slow")["value"] == "Slow (1)"
    client.ask("fbvm/force", name="n", value="3")
    for name, text in {"mode": "Off (0)", "CIO 101": "129 (16#0081)", "said": "'a (5)'", "d": "-7", "n": "3 (forced)"}.items():
        assert client.ask("setExpression", expression=name, value=text)["value"] == text, "as it is shown"
    assert client.ask("setExpression", expression="CIO 1519", value="4 (16#0004)  Send Request")["value"] == "4 (16#0004)"
    assert client.rows(locals_["few"]["variablesReference"], start=1, count=1).keys() == {"[2]"}
    assert client.ask("evaluate", expression="few", context="clipboard")["result"] == "[5, 6]"
    assert locals_["pair"]["namedVariables"] == 2 and locals_["few"]["indexedVariables"] == 2
    assert client.rows(locals_["own"]["variablesReference"]).keys() == {"k", "Half"}


def test_a_client_that_does_not_page_gets_nodes(file: Path) -> None:
    client = Client(supportsVariablePaging=False)
    client.begin(program=str(file))
    lots = client.rows(client.scopes()["Locals"]["variablesReference"])["lots"]
    assert lots["indexedVariables"] == 3
    nodes = client.rows(lots["variablesReference"])
    assert list(nodes) == ["[0..255]", "[256..511]", "[512..600]"]
    assert list(client.rows(lots["variablesReference"], start=1, count=1)) == ["[256..511]"]
    assert list(client.rows(nodes["[512..600]"]["variablesReference"])) == [f"[{number}]" for number in range(512, 601)]
    assert list(client.rows(nodes["[256..511]"]["variablesReference"], start=255, count=9)) == ["[511]"]


def test_a_property_whose_accessor_traps_says_so(client: Client) -> None:
    own = client.rows(client.scopes()["Locals"]["variablesReference"])["own"]
    lazy = client.rows(own["variablesReference"])["Half"]
    row = client.rows(lazy["variablesReference"])["Half"]
    assert "cannot be computed" in row["value"] and row["variablesReference"] == 0
    client.ask("setExpression", expression="own.k", value="20")
    assert client.value("own.Half") == "5"


def test_what_is_shown_only_is_not_written(client: Client) -> None:
    runtime = client.scopes()["Runtime"]["variablesReference"]
    shown = {"scan": "0", "statement": "0", "time": "T#0s", "cycle": "T#10ms", "mode": "RUN", "executed scans": "0",
             "warnings": "none"}  # fmt: skip
    assert {name: row["value"] for name, row in client.rows(runtime).items() if name in shown} == shown
    assert "shown only" in refused(client, "setVariable", variablesReference=runtime, name="scan", value="5")
    assert refused(client, "setExpression", expression="D0..D1", value="1") == "set one value after the other"
    assert refused(client, "setExpression", expression="pair", value="1") == "Main.pair is Pair: set its members"
    assert refused(client, "fbvm/force", name="D0..D1", value="1") == "force one place after the other"
    assert "no code; write 2, or 16#0302" in client.ask(
        "setExceptionBreakpoints", filterOptions=[{"filterId": "modbus", "condition": "TRUE"}])["breakpoints"][0]["message"]
    assert refused(client, "evaluate", expression="print Nobody", context="repl")
    assert "is no place in memory" in refused(client, "readMemory", memoryReference="D0..D1", count=1)
    assert "Nobody" in refused(client, "readMemory", memoryReference="Nobody", count=1)
    assert client.ask("dataBreakpointInfo", name="0", asAddress=True, bytes=1)["dataId"] is None


def test_paths_as_clients_write_them(file: Path) -> None:
    client = Client(pathFormat="uri")
    client.begin(program=str(file))
    source = client.frames[0]["source"]
    assert source["path"] == file.as_uri()
    answer = client.ask("setBreakpoints", source={"path": file.as_uri().replace("words", "%77ords")}, breakpoints=[{"line": 22}])
    assert answer["breakpoints"][0]["verified"]
    link = file.with_name("link.st")
    link.symlink_to(file)
    plain = Client()
    plain.begin(program=str(file))
    assert plain.ask("setBreakpoints", source={"path": str(link)}, breakpoints=[{"line": 22}])["breakpoints"][0]["verified"]
    assert plain.frames[0]["source"]["path"] == str(link), "a client is told the path that it uses itself"
    shouted = plain.ask("setBreakpoints", source={"path": str(file).upper()}, breakpoints=[{"line": 22}])
    assert shouted["breakpoints"][0]["verified"], "editors at Windows change the case of a drive"
