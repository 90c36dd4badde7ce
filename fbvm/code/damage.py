"""Which messages only follow from text that could not be read."""

from __future__ import annotations

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.syntax import tree

_NAMES = frozenset(("S0201", "S0204", "S0207", "S0208", "S0209", "S0210", "S0304", "S0401", "S0402", "S0404"))
"""Codes that a missing or half-read declaration elsewhere causes."""


FEW = 3
"""Statements of a body that may be lost before the rest is taken for something else than Structured Text."""


class Damage:
    """What of a project could not be read.

    Behind a statement in which text was skipped the rest is judged, but not what stands on its line; a body with several of
    them, and other declarations, are not judged any further.  Where only a sign was missing, such as `;`, all is.  Where a
    declaration may be lost or half read, nobody is told that its names are unknown."""

    def __init__(self) -> None:
        self._skipped: list[tuple[Source, int, int]] = []
        self._names_lost = False

    def note(self, source: Source, text: tree.SourceText, errors: list[Diagnostic]) -> None:
        """Take the syntax errors of one text."""
        hard = [error for error in errors if error.end > error.start and not error.lossless]
        counts: dict[tree.Declaration, int] = {}
        for error in hard:
            inside = [d for d in text.declarations if d.start <= error.start < d.end]
            body_only = bool(inside) and all(_in_body(d, error.start) for d in inside)
            self._names_lost = self._names_lost or not body_only
            for declaration in inside:
                counts[declaration] = counts.get(declaration, 0) + 1
                whole = not body_only or counts[declaration] > FEW
                self._skipped.append((source, declaration.start, declaration.end) if whole else _line(source, error.start))

    def explains(self, message: Diagnostic) -> bool:
        """True if a message of the checker may be no more than a consequence."""
        if self._names_lost and message.code in _NAMES:
            return True
        return any(source is message.source and start <= message.start < end for source, start, end in self._skipped)


def _line(source: Source, at: int) -> tuple[Source, int, int]:
    """The line of a place."""
    number = source.place(at)[0]
    start = source.line_starts[number - 1]
    return source, start, start + len(source.line(number)) + 1


def _in_body(declaration: tree.Declaration, at: int) -> bool:
    """True if a place lies behind all declarations of variables of a POU."""
    if not isinstance(declaration, tree.Pou):
        return False
    first = declaration.body[0].start if declaration.body else declaration.name.end
    return at >= max((section.end for section in declaration.sections), default=first)
