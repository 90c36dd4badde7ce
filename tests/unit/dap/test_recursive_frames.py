"""The debug adapter inside methods that have called themselves: each frame shows its own variables."""

from __future__ import annotations

from pathlib import Path

from dap_client import Client

TEXT = """\
FUNCTION_BLOCK Node
    METHOD Sum : INT
    VAR_INPUT n : INT; END_VAR
    VAR twice : INT; END_VAR
        twice := 2 * n;
        IF n > 0 THEN
            Sum := Sum(n - 1);
        END_IF;
        Sum := Sum + twice;
    END_METHOD
END_FUNCTION_BLOCK
PROGRAM Main
VAR a : Node; r : INT; END_VAR
    r := a.Sum(3);
END_PROGRAM
"""


def test_each_frame_of_a_method_that_calls_itself_shows_its_own_variables(tmp_path: Path) -> None:
    file = tmp_path / "nodes.st"
    file.write_text(TEXT, encoding="utf-8")
    client = Client()
    client.begin({"setBreakpoints": {"source": {"path": str(file)}, "breakpoints": [{"line": 9}]}}, program=str(file))
    frames = client.ask("stackTrace", threadId=1)["stackFrames"]
    seen = [client.ask("evaluate", expression="twice", frameId=frame["id"])["result"] for frame in frames[:4]]
    assert seen == ["0", "2", "4", "6"]
