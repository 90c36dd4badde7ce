"""Names that a program cannot declare: those of the elementary types, which are reserved (IEC 61131-3 ed. 3, table 10)."""

from __future__ import annotations

from fbvm.base.diagnostics import Source
from fbvm.base.dialects import Dialect, takers
from fbvm.base.types import ELEMENTARY, fold
from fbvm.check.symbols.report import Report
from fbvm.syntax import tree

RESERVED = frozenset(ELEMENTARY) | {"STRING", "WSTRING", "TOD", "LTOD", "DT", "LDT"}
"""The short forms T, D, LT and LD stay usable: they mean something in front of `#` only."""
_TAKEN = {
    "names_of_edition_2": (("LTIME", "LDT", "LTOD", "LDATE", "LDATE_AND_TIME", "LTIME_OF_DAY", "CHAR", "WCHAR"),
                           "a type of the third edition"),
    "own_time": (("TIME",), "a type and a standard function"),
    "short_names": (("DT", "TOD", "LDT", "LTOD"), "the short name of a type"),
}
"""By switch of a dialect, the words that programs may declare then, and what these are: types that the second edition does not
have, and short names of types."""


def refuse_reserved(report: Report, source: Source, name: tree.Name, dialect: Dialect, what: str) -> None:
    """Report a declaration under the name of an elementary type.

    Members of structures may have one: they stand behind a point.  `what` is declared: a POU, a type, a section of variables."""
    if dialect.plain_names and not source.library and fold(name.text).startswith(("_", "P_")):
        sign = "_" if name.text[0] == "_" else "P_"
        report.add("S0195", source, name, f"`{name.text}` begins with `{sign}`, and the tool of this dialect refuses such names",
                   "choose another name")
    if fold(name.text) not in RESERVED:
        return
    switches = {switch: meant for switch, (words, meant) in _TAKEN.items()
                if fold(name.text) in words and (switch != "own_time" or what == "POU")}
    taken = [meant for switch, meant in switches.items() if getattr(dialect, switch)]
    if not taken:
        report.add("S0101", source, name, f"`{name.text}` is a reserved word and cannot be a name",
                   "".join(("choose another name", *(f", or take {takers(switch)}" for switch in switches))))
    elif not source.library:
        report.add("S0193", source, name, f"`{name.text}` is {taken[0]}, and a name here")
