"""Each construct in which dialects differ works, or is refused as `dialect_rows.txt` has it, in every dialect."""

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


class Row(NamedTuple):
    """A construct: its number and name, what is expected by dialect (`x = 7`, or an error), and a program."""

    name: str
    expected: dict[str, str]
    text: str


def read_rows() -> Iterator[Row]:
    """The rows of the table, in their order."""
    table = Path(__file__).with_name("dialect_rows.txt").read_text(encoding="utf-8")
    for piece in re.split(r"(?m)^---- ", table)[1:]:
        head, text = piece.split("\n\n", 1)
        name, *lines = head.splitlines()
        expected: dict[str, str] = {}
        for line in lines:
            names, said = line.split(": ", 1)
            expected |= dict.fromkeys(DIALECTS if names == "all" else names.split(), said)
        yield Row(name, expected, text)


ROWS = tuple(read_rows())


def outcome(text: str, dialect: str) -> str:
    """`x = 7` for a program that runs, else its errors."""
    compiled = compile_sources([Source("row.st", text)], dialect=dialect, runnable=True, lint=False)
    if compiled.image is None:
        return "\n".join(f"{error.code} {error.message} {error.code} {error.hint}" for error in compiled.errors)
    plc = Plc(compiled.image)
    plc.scan()
    assert plc.trap is None
    try:
        return f"x = {plc.read('Main.x')}"
    except UnknownPlace:
        return f"x = {plc.read('i.x')}"


@each_of("row", ROWS, ids=lambda row: row.name)
def test_every_row_works_or_is_refused_by_name(row: Row) -> None:
    assert set(row.expected) == set(DIALECTS)
    for dialect, said in row.expected.items():
        found = outcome(row.text, dialect)
        code, _, words = said.partition(" ")
        assert found == said if code == "x" else code in found and words in found, f"{dialect}: {found}"


def test_who_is_refused_what_another_dialect_takes_is_told_which() -> None:
    """Conversions name the function to write in place of the dialect."""
    silent = [row.name for row in ROWS if any(said.startswith("x =") for said in row.expected.values())
              and any(said.startswith("S") and "--dialect" not in said for said in row.expected.values())]
    assert silent == [
        "1.2 comments that nest", "1.4 code generation switched off", "1.4b another file included", "1.11b = for :=",
        "2.2 BOOL for a number", "2.8 a real for an integer", "2.11 BCD for a USINT",
        "2.13 a long time of day for a short one", "2.14 a duration for a time of day", "2.14b a duration for a date and time",
        "2.14c a time of day for an integer", "2.16b ADR of a local of a function",
        "3.23 the counter of a loop, written", "6.2 a pointer compared with 0", "6.5 the difference of pointers"]
