"""Suppression of warnings: by pragmas of a text, and by codes that the caller gives.

    {warning disable S0390}          from here on S0390 is not warned of; several codes with commas
    {warning restore S0390}          from here on again

A pragma speaks of its own text, from its own place on.  A code of another tool in such a pragma is passed over.
"""

from __future__ import annotations

import bisect
import re
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from fbvm.base.codes import CODES
from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.base.dialects import Dialect
from fbvm.syntax.st.pragmas import NO_EFFECT, dialectal, in_place

if TYPE_CHECKING:
    from fbvm.syntax.tree import SourceText

_PRAGMA = re.compile(r"\s*warning\s+(disable|restore)\b(.*)", re.IGNORECASE | re.DOTALL)
_OURS = re.compile(r"S\d{4}")


@dataclass(frozen=True)
class Wanted:
    """The caller's choice of warnings: codes that are suppressed ("all" for every warning), and whether warnings forbid running.

    Raises ValueError for what is no code of a warning."""

    no_warn: frozenset[str] = field(default_factory=frozenset)
    as_errors: bool = False

    @classmethod
    def of(cls, no_warn: Iterable[str], as_errors: bool) -> Wanted:
        """Of codes in any case."""
        codes = frozenset(code.strip().upper() for code in no_warn)
        wrong = sorted(code for code in codes if code != "ALL" and (code not in CODES or CODES[code].severity != "warning"))
        if wrong:
            known = ", ".join(code for code, row in CODES.items() if row.severity == "warning")
            raise ValueError(f"{wrong[0]} is no code of a warning; there are {known}, or all")
        return cls(codes, as_errors)


ANY = Wanted()
"""Every warning, and none forbids running."""


class Suppressions:
    """The places in the texts of a project at which pragmas switch warnings off and on."""

    def __init__(self) -> None:
        self._switches: dict[tuple[str, str], list[tuple[int, bool]]] = {}
        """Source and code -> places from which on it is off (True) or on."""

    def add(self, source: Source, text: SourceText, dialect: Dialect) -> list[Diagnostic]:
        """Add the pragmas of one text.  Returns warnings for unknown codes, and for pragmas of other dialects."""
        unknown = []
        for pragma in text.pragmas:
            if dialectal(pragma.text) and not (dialect.pragmas_act and in_place(source, pragma)):
                unknown.append(Diagnostic("S0190", source, pragma.start, pragma.end, f"the pragma `{{{pragma.text.strip()}}}` "
                                          "is not known and has no effect", NO_EFFECT))
            found = _PRAGMA.fullmatch(pragma.text)
            if not found:
                continue
            for code in re.split(r"[\s,]+", found[2].strip().upper()):
                self._switches.setdefault((source.name, code), []).append((pragma.end, found[1].lower() == "disable"))
                if _OURS.fullmatch(code) and (code not in CODES or CODES[code].severity != "warning"):
                    unknown.append(Diagnostic("S0190", source, pragma.start, pragma.end,
                                              f"{code} is no code of a warning: the pragma has no effect",
                                              "`fbvm explain` lists all codes"))
        return unknown

    def suppresses(self, warning: Diagnostic) -> bool:
        """True if a pragma switches a warning off at its place."""
        switches = self._switches.get((warning.source.name, warning.code))
        if not switches:
            return False
        at = bisect.bisect_right(switches, warning.start, key=lambda switch: switch[0])
        return at > 0 and switches[at - 1][1]

    def apply(self, diagnostics: Iterable[Diagnostic], wanted: Wanted) -> list[Diagnostic]:
        """The diagnostics without suppressed warnings; with `wanted.as_errors` the remaining warnings count as errors."""
        kept = []
        for each in diagnostics:
            if each.severity == "warning":
                if "ALL" in wanted.no_warn or each.code in wanted.no_warn or self.suppresses(each):
                    continue
                each = replace(each, raised=wanted.as_errors)
            kept.append(each)
        return kept
