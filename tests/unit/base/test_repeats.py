"""One message for a name that is unknown in many places."""

from __future__ import annotations

from fbvm.code.compiler import compile_text

TEXT = """PROGRAM Main
VAR a, b : Missing; c : Missing; d : ARRAY [0..1] OF Missing; n : INT; END_VAR
n := GVL.x;
n := GVL.y + GVL.z;
n := other; n := other;
IF n > 0 THEN
    n := GVL.x;
END_IF
END_PROGRAM
"""


def test_an_unknown_name_is_complained_about_once_and_its_other_lines_are_named() -> None:
    found = [(d.code, d.line, d.hint) for d in compile_text(TEXT).diagnostics]
    assert found == [
        ("S0204", 2, ""),
        ("S0201", 3, "if it is a library, an enumeration or a file of global variables, give its source with the files; "
                     "the same in lines 4, 7"),
        ("S0201", 5, ""), ("S0201", 5, "")]


def test_an_unknown_attribute_is_named_once() -> None:
    text = """{attribute 'odd'}
FUNCTION F : INT
VAR_INPUT {attribute 'odd' := '1'} a : INT; {attribute 'monitoring' := 'call'} b : INT; END_VAR
F := a + b;
END_FUNCTION
PROGRAM Main VAR {attribute 'other'} n : INT; END_VAR n := F(1, 2); END_PROGRAM
"""
    found = [(d.line, d.message, d.hint.partition("; ")[2]) for d in compile_text(text).diagnostics if d.code == "S0190"]
    assert found == [(1, "the attribute 'odd' is not known and has no effect", "it stands in 2 places"),
                     (6, "the attribute 'other' is not known and has no effect", "")]
