"""Each construct in which dialects differ works, or is refused, in every dialect as the tables beside this file have it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.base.dialects import DIALECTS
from fbvm.code.compiler import compile_sources
from fbvm.machine.plc import Plc
from fbvm.watch.paths import UnknownPlace

pytestmark = pytest.mark.slow
TABLES = ("dialect_rows.txt", "contested_rows.txt")
WARNINGS = ("S0190", "S0193", "S0195", "S0296", "S0504", "S0590", "S0591", "S0791", "S0792", "S0793", "S0295", "S0392")
"""Warnings that say something of dialects, and so belong to what is expected."""


class Row(NamedTuple):
    """A construct: its number and name, what is expected by dialect, a program, and how many scans of 10 ms it runs.

    Expected is `x = 7`, `x = 7 (S0193)` with a warning, `trap R0101`, or the code and words of an error."""

    name: str
    expected: dict[str, str]
    text: str
    scans: int


def read_rows(table: str) -> Iterator[Row]:
    """The rows of a table, in their order."""
    text = Path(__file__).with_name(table).read_text(encoding="utf-8")
    for piece in re.split(r"(?m)^---- ", text)[1:]:
        head, program = piece.split("\n\n", 1)
        name, *lines = head.splitlines()
        expected: dict[str, str] = {}
        scans = 1
        for line in lines:
            if line.startswith("scans "):
                scans = int(line.split()[1])
                continue
            names, said = line.split(": ", 1)
            expected |= dict.fromkeys(DIALECTS if names == "all" else names.split(), said)
        yield Row(name, expected, program, scans)


ROWS = tuple(row for table in TABLES for row in read_rows(table))


def outcome(text: str, dialect: str, scans: int = 1) -> str:
    """What becomes of a program: `x = 7` after its scans or the trap that stops it, with warnings, else its errors."""
    compiled = compile_sources([Source("row.st", text)], dialect=dialect, runnable=True)
    if compiled.image is None:
        return "\n".join(f"{error.code} {error.message} {error.code} {error.hint}" for error in compiled.errors)
    plc = Plc(compiled.image)
    while plc.scans < scans and plc.trap is None:
        plc.scan()
    warned = " ".join(sorted({warning.code for warning in compiled.diagnostics if warning.code in WARNINGS}))
    return (f"trap {plc.trap.code}" if plc.trap else f"x = {_x(plc)}") + (f" ({warned})" if warned else "")


def _x(plc: Plc) -> object:
    try:
        return plc.read("Main.x")
    except UnknownPlace:
        return plc.read("i.x")


@each_of("row", ROWS, ids=lambda row: row.name)
def test_every_row_works_or_is_refused_by_name(row: Row) -> None:
    assert set(row.expected) == set(DIALECTS)
    for dialect, said in row.expected.items():
        found = outcome(row.text, dialect, row.scans)
        code, _, words = said.partition(" ")
        assert found == said if code in ("x", "trap") else code in found and words in found, f"{dialect}: {found}"


def test_who_is_refused_what_another_dialect_takes_is_told_which() -> None:
    """Two pragmas mean something in matiec only, which is not executed: elsewhere they have no effect."""
    silent = [row.name for row in ROWS if any(said.startswith("x =") for said in row.expected.values())
              and any(said.startswith("S0") and "--dialect" not in said for said in row.expected.values())]
    assert silent == ["1.4 code generation switched off", "1.4b another file included"]
