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
