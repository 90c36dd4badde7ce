"""Forms of declarations that the tool of a dialect does not have: refused in some dialects, warned of in others."""

from __future__ import annotations

from fbvm.base.diagnostics import Source
from fbvm.base.dialects import DIALECTS, Dialect, option
from fbvm.check.symbols.report import Report
from fbvm.syntax import tree


def report_form(report: Report, dialect: Dialect, source: Source, node: tree.Node, form: str, what: str = "") -> None:
    """Report a form, such as `POINTER TO`, if the dialect refuses it or warns of it; `what` are other words for it."""
    if source.library or form not in dialect.refused | dialect.warned:
        return
    said = f"{what or form} is not taken by the dialect {dialect.name}: {dialect.for_whom}"
    if form in dialect.refused:
        takers = option(row for row in DIALECTS.values() if form not in row.refused | row.warned)
        report.add("S0903", source, node, said, f"take {takers}")
    else:
        report.add("S0195", source, node, f"{what or form}: the tool of this dialect does not have it")


def report_objects(report: Report, dialect: Dialect, source: Source, pou: tree.Pou) -> None:
    """Report what belongs to objects in a POU: CLASS and INTERFACE as a whole, else methods, properties and bases."""
    if pou.kind in ("CLASS", "INTERFACE"):
        report_form(report, dialect, source, pou.name, pou.kind, f"the {pou.kind} {pou.name.text}")
        return
    for method in pou.methods:
        form = "METHOD" if method.kind == "METHOD" else "PROPERTY"
        report_form(report, dialect, source, method.name, form, f"the {form} {method.name.text}")
    for word, bases in (("EXTENDS", pou.bases), ("IMPLEMENTS", pou.interfaces)):
        for base in bases:
            report_form(report, dialect, source, base, word, f"{word} {base.text}")
