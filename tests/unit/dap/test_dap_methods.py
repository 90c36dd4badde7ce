"""Methods and properties in the adapter: breakpoints of one instance, the stack, the variables of the call and of the object."""

from __future__ import annotations

from pathlib import Path

from dap_client import Client

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
    assert client.ask("evaluate", expression="Main.slow.Twice", context="watch")["result"] == "6"
    assert [each["label"] for each in client.ask("completions", text="Main.slow.T", column=12)["targets"]] == ["Main.slow.Twice"]
