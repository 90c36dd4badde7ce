"""__NEW and __DELETE while one writes: completion, and where the type that is made is declared."""

from __future__ import annotations

import pytest
from editing import at_mark, check_declaration

from fbvm.analysis.completion import complete

HEAD = """\
{attribute 'enable_dynamic_creation'}
FUNCTION_BLOCK Motor
METHOD FB_init : BOOL
VAR_INPUT bInitRetains, bInCopyCode : BOOL; speed : INT; END_VAR
END_METHOD
END_FUNCTION_BLOCK
{attribute 'enable_dynamic_creation'}
TYPE Part : STRUCT a : INT; END_STRUCT END_TYPE
PROGRAM Main
VAR p : POINTER TO Motor; q : POINTER TO Part; END_VAR
"""


def test_the_names_are_offered_where_the_dialect_has_them() -> None:
    for dialect, offered in (("codesys", {"__NEW", "__DELETE"}), ("standard", set())):
        program, offset = at_mark(HEAD + "‸\nEND_PROGRAM\n", dialect)
        assert {item.label for item in complete(program, "pump.st", offset)} & {"__NEW", "__DELETE"} == offered


def test_types_are_offered_behind_the_bracket() -> None:
    program, offset = at_mark(HEAD + "p := __NEW(Mo‸);\nEND_PROGRAM\n", "codesys")
    found = {item.label: item.kind for item in complete(program, "pump.st", offset)}
    assert (found["Motor"], found["Part"], found["BYTE"]) == ("block", "type", "type")
    assert "p" not in found


@pytest.mark.parametrize(("before", "word", "line"), [
    ("__NEW(Motor(", "Motor", 2), ("__NEW(Part)", "Part", 8), ("__NEW(POINTER TO Part", "Part", 8), ("__DELETE(p)", "p", 10)])
def test_a_name_leads_to_its_declaration(before: str, word: str, line: int) -> None:
    text = HEAD + "p := __NEW(Motor(speed := 3)); q := __NEW(Part); r := __NEW(POINTER TO Part, 3); __DELETE(p);\nEND_PROGRAM\n"
    text = text.replace("q : POINTER", "r : POINTER TO POINTER TO Part; q : POINTER")
    check_declaration(text, before, word, line, {"Motor": 3, "Part": 5, "p": 3}[word], "codesys")
