"""Names that a program cannot declare: those of the elementary types, which are reserved (IEC 61131-3 ed. 3, table 10)."""

from __future__ import annotations

from fbvm.base.diagnostics import Source
from fbvm.base.dialects import Dialect, takers
from fbvm.base.types import ELEMENTARY, fold
from fbvm.check.symbols.report import Report
from fbvm.syntax import tree

RESERVED = frozenset(ELEMENTARY) | {"STRING", "WSTRING", "TOD", "LTOD", "DT", "LDT"}
"""The short forms T, D, LT and LD stay usable: they mean something in front of `#` only."""


EDITION_3 = frozenset(("LTIME", "LDT", "LTOD", "LDATE", "LDATE_AND_TIME", "LTIME_OF_DAY", "CHAR", "WCHAR"))
"""Types that the second edition does not have: its programs may use their names."""


def refuse_reserved(report: Report, source: Source, name: tree.Name, dialect: Dialect) -> None:
    """Report a declaration under the name of an elementary type.

    Members of structures may have one: they stand behind a point."""
    if fold(name.text) not in RESERVED:
        return
    newer = fold(name.text) in EDITION_3
    if not newer or not dialect.names_of_edition_2:
        report.add("S0101", source, name, f"`{name.text}` is a reserved word and cannot be a name",
                   "choose another name" + (f", or take {takers('names_of_edition_2')}" if newer else ""))
    elif not source.library:
        report.add("S0193", source, name, f"`{name.text}` is a type of the third edition, and a name here")
