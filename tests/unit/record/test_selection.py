"""Patterns of a trace over arrays of several dimensions, and over single elements."""

from __future__ import annotations

import pytest

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.record.trace.selection import select
from fbvm.watch.paths import UnknownPlace

TABLES = """
TYPE Pair : STRUCT a, b : INT; END_STRUCT END_TYPE
PROGRAM Main
VAR
    Table : ARRAY [0..1, 5..6] OF Pair; Grid : ARRAY [0..1, 5..6] OF INT; Words : ARRAY [8..20] OF WORD;
    Rows : ARRAY [1..2] OF ARRAY [-1..0] OF INT;
END_VAR
Grid[1, 6] := 1;
END_PROGRAM
"""


@pytest.mark.parametrize(("pattern", "found"), [
    ("main.table[*].b", ["Main.Table[0, 5].b", "Main.Table[0, 6].b", "Main.Table[1, 5].b", "Main.Table[1, 6].b"]),
    ("Main.Table[*, 6].a", ["Main.Table[0, 6].a", "Main.Table[1, 6].a"]),
    ("Main.Table[1*", ["Main.Table[1, 5]", "Main.Table[1, 6]"]),
    ("Main.Grid*", ["Main.Grid"]), ("Main.Grid[*]", ["Main.Grid"]),
    ("Main.Grid[*, 5]", ["Main.Grid[0, 5]", "Main.Grid[1, 5]"]), ("Main.Grid[0, *]", ["Main.Grid[0, 5]", "Main.Grid[0, 6]"]),
    ("Main.Words[1*", [f"Main.Words[{number}]" for number in range(10, 20)]),
    ("Main.Rows[*][0]", ["Main.Rows[1][0]", "Main.Rows[2][0]"]), ("Main.Rows[2]*", ["Main.Rows[2]"]),
])  # fmt: skip
def test_a_pattern_names_elements_by_all_their_subscripts(pattern: str, found: list[str]) -> None:
    plc = Plc(compile_text(TABLES).image)
    assert [place.name for place in select(plc.image.symbols, plc.memory.areas, [pattern]).places] == found


def test_a_pattern_for_subscripts_outside_of_the_bounds_fits_nothing() -> None:
    plc = Plc(compile_text(TABLES).image)
    with pytest.raises(UnknownPlace, match=r"no variable is called like Main\.Table\[2\*"):
        select(plc.image.symbols, plc.memory.areas, ["Main.Table[2*"])
