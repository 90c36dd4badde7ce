"""Methods and properties in the adapter: breakpoints of one instance, the stack, the variables of the call and of the object."""

from __future__ import annotations

from pathlib import Path

import pytest
from dap_client import Client, RefusedError

TEXT = """\
FUNCTION_BLOCK Motor
VAR Speed : INT; END_VAR
METHOD Start : BOOL
VAR_INPUT Wanted : INT; END_VAR
VAR half : INT; END_VAR
half := Wanted / 2;
Speed := half + Wanted;
END_METHOD
END_FUNCTION_BLOCK
PROGRAM Main
VAR slow, fast : Motor; ok : BOOL; END_VAR
ok := slow.Start(Wanted := 2);
ok := fast.Start(Wanted := 20);
END_PROGRAM
"""


def test_a_method_of_one_instance_stops_with_its_variables(tmp_path: Path) -> None:
    file = tmp_path / "motors.st"
    file.write_text(TEXT, encoding="utf-8")
    client = Client()
    client.begin({"setFunctionBreakpoints": {"breakpoints": [{"name": "Main.fast.Start", "condition": "Wanted > Speed"}]}},
                 program=str(file))  # fmt: skip
    client.go("next")
    assert [(frame["name"], frame["line"]) for frame in client.frames[:2]] == [("Motor.Start  Main.fast", 7), ("Main", 13)]
    shown = {name: row["value"] for scope in list(client.scopes().values())[:4]
             for name, row in client.rows(scope["variablesReference"]).items()}  # fmt: skip
    assert {name: shown.get(name) for name in ("Wanted", "half", "Speed")} == {"Wanted": "20", "half": "10", "Speed": "0"}


def test_properties_are_rows_whose_accessors_run_when_they_are_opened(tmp_path: Path) -> None:
    file = tmp_path / "motors.st"
    file.write_text(TEXT.replace("END_METHOD", "END_METHOD\nPROPERTY Twice : INT\nGET Twice := 2 * Speed; END_GET\nEND_PROPERTY"),
                    encoding="utf-8")  # fmt: skip
    client = Client()
    client.begin({"setFunctionBreakpoints": {"breakpoints": [{"name": "Main.fast.Start", "condition": "Wanted > Speed"}]}},
                 program=str(file))  # fmt: skip
    client.go("fbvm/stepScan")
    client.go("next")
    main = client.rows(client.scopes()["Locals"]["variablesReference"])["slow"]
    row = client.rows(main["variablesReference"])["Twice"]
    assert row["presentationHint"]["lazy"] and row["value"] == ""
    assert client.rows(row["variablesReference"])["Twice"]["value"] == "6"
    assert client.ask("evaluate", expression="Main.slow.Twice", context="watch") == {
        "result": "6", "type": "INT", "variablesReference": 0,
        "presentationHint": {"kind": "property", "attributes": ["readOnly"]}}  # fmt: skip
    assert [each["label"] for each in client.ask("completions", text="Main.slow.T", column=12)["targets"]] == ["Main.slow.Twice"]


def test_properties_stand_in_expressions_behind_references_and_beside_lines_and_methods_are_not_called(tmp_path: Path) -> None:
    file = tmp_path / "motors.st"
    accessors = ("PROPERTY Twice : INT\nGET Twice := 2 * Speed; END_GET\nEND_PROPERTY\n"
                 "PROPERTY Self : REFERENCE TO Motor\nGET Self REF= THIS^; END_GET\nEND_PROPERTY\n"
                 "PROPERTY Share : INT\nGET Share := 100 / Speed; END_GET\nEND_PROPERTY")
    text = TEXT.replace("END_METHOD", f"END_METHOD\n{accessors}")
    file.write_text(text.replace("END_PROGRAM", "ok := slow.Twice > 5;\nok := fast.Share > 5;\nEND_PROGRAM"), encoding="utf-8")
    line = text.count("\n")
    client = Client()
    client.begin({"setBreakpoints": {"source": {"path": str(file)}, "breakpoints": [{"line": line - 1}]}},
                 program=str(file), dialect="codesys")  # fmt: skip
    frame = client.frames[0]["id"]
    wanted = {"slow.Twice > 5": "TRUE", "2 * slow.Twice + Main.fast.Twice": "12", "slow.Self.Twice": "6",
              "slow.Self^.Self.Twice = 6": "TRUE"}  # fmt: skip
    assert {each: client.ask("evaluate", expression=each, frameId=frame)["result"] for each in wanted} == wanted
    for expression, said in (("slow.Start(Wanted := 2)", "slow.Start is a method, which may change"),
                             ("slow.Begin(1)", "no Begin"), ("fast.Share + 1", "fast.Share cannot be computed")):  # fmt: skip
        with pytest.raises(RefusedError, match=said):
            client.ask("evaluate", expression=expression, frameId=frame)
    rows = client.ask("fbvm/inlineValues", source={"path": str(file)}, startLine=line, endLine=line + 1, frameId=frame)["values"]
    assert [(row["line"] - line, row["text"]) for row in rows] == [(0, "ok = FALSE"), (0, "slow.Twice = 6"), (1, "ok = FALSE")]
