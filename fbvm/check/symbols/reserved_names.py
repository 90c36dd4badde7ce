"""Names that a program cannot declare: those of the elementary types, which are reserved (IEC 61131-3 ed. 3, table 10)."""

from __future__ import annotations

from fbvm.base.diagnostics import Source
from fbvm.base.types import ELEMENTARY, fold
from fbvm.check.symbols.report import Report
from fbvm.syntax import tree

RESERVED = frozenset(ELEMENTARY) | {"STRING", "WSTRING", "TOD", "LTOD", "DT", "LDT"}
"""The short forms T, D, LT and LD stay usable: they mean something in front of `#` only."""


def refuse_reserved(report: Report, source: Source, name: tree.Name) -> None:
    """Report a declaration under the name of an elementary type.

    Members of structures may have one: they stand behind a point."""
    if fold(name.text) in RESERVED:
        report.add("S0101", source, name, f"`{name.text}` is a reserved word and cannot be a name", "choose another name")
