"""The stack of frames: which calls put a frame on it, each at a place of its own where the stack may be full (R0121)."""

from __future__ import annotations

from rows import each_of

from fbvm import compile_text
from fbvm.code.shapes import statements

NODE = """
FUNCTION_BLOCK Node
VAR_INPUT next : POINTER TO Node; END_VAR
VAR n : INT; END_VAR
VAR_TEMP t : INT; END_VAR
n := n + 1;
IF n < 3 THEN next^(); {body} END_IF
METHOD Go
VAR here : INT; END_VAR
here := 1; IF n < 3 THEN {method} END_IF
END_METHOD
END_FUNCTION_BLOCK
ACTION Act:
t := 1; IF n < 3 THEN {action} END_IF
END_ACTION
PROGRAM Main
VAR a, b : Node; END_VAR
b.next := ADR(a);
a(next := ADR(b)); {main}
END_PROGRAM
"""


@each_of("calls, body, action, method, main", [
    ({}, 1, 0, 0, 0),
    ({"body": "Act();"}, 1, 0, 0, 0), ({"body": "next^.Act();"}, 2, 0, 0, 0), ({"body": "THIS^.Act();"}, 2, 0, 0, 0),
    ({"action": "next^.Act();"}, 1, 1, 0, 0), ({"main": "a.Act();"}, 1, 0, 0, 1), ({"method": "Act();"}, 1, 0, 1, 0),
    ({"method": "Go();"}, 1, 0, 1, 0), ({"method": "next^.Go();"}, 1, 0, 1, 0),
    ({"method": "Act();", "action": "Go();"}, 1, 1, 1, 0),
    ({"body": "Go();"}, 1, 0, 0, 0), ({"method": "Go();", "main": "a.Go();"}, 1, 0, 1, 1),
])
def test_an_action_of_the_caller_shares_its_frame(calls: dict[str, str], **places: int) -> None:
    text = NODE.format(**{part: calls.get(part, "") for part in ("body", "action", "method", "main")})
    image = compile_text(text, dialect="codesys").image
    assert image is not None
    found = {body.name: sum(each[:2] == ("stop", "R0121") for each in statements(body.code)) for body in image.bodies}
    names = {"body": "Node", "action": "Node.Act", "method": "Node.Go", "main": "Main"}
    assert found == {names[part]: count for part, count in places.items()}
