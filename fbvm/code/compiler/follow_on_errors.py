"""Follow-on errors: which messages of the checker are only consequences of text that could not be parsed."""

from __future__ import annotations

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.syntax import tree

_NAMES = frozenset(("S0201", "S0204", "S0207", "S0208", "S0209", "S0210", "S0304", "S0401", "S0402", "S0404"))
"""Codes that a missing or half-parsed declaration elsewhere causes."""

FEW = 3
"""Syntax errors in one body from which on the rest of it is not judged, as it may not be Structured Text at all."""

Range = tuple[Source, int, int]
"""Characters of a source, from the first on up to, not including, the second."""


class FollowOnErrors:
    """Knows from the syntax errors which ranges of the sources, and which names, the checker knows too little about.

    - A syntax error in a body: nothing is said about its line, but about the statements behind it.
    - More than FEW of them in one body, or one among its declarations: nothing is said about the whole declaration.
    - A declaration that may be lost: nowhere is it said that a name is unknown.
    - Only a sign such as `;` is missing: everything is said."""

    def __init__(self) -> None:
        self._skipped: list[Range] = []
        self._names_lost = False

    def add(self, source: Source, text: tree.SourceText, errors: list[Diagnostic]) -> None:
        """Take the syntax errors of one source, and the tree that was made of it in spite of them."""
        counts: dict[tree.Declaration, int] = {}
        for error in errors:
            if error.end <= error.start or error.lossless:
                continue
            around = [d for d in text.declarations if d.start <= error.start < d.end]
            in_body = bool(around) and all(_in_body(d, error.start) for d in around)
            self._names_lost = self._names_lost or not in_body
            for declaration in around:
                counts[declaration] = counts.get(declaration, 0) + 1
                whole = not in_body or counts[declaration] > FEW
                self._skipped.append((source, declaration.start, declaration.end) if whole else _line(source, error.start))

    def has(self, message: Diagnostic) -> bool:
        """True if a message of the checker may be no more than a consequence of a syntax error."""
        if self._names_lost and message.code in _NAMES:
            return True
        return any(source is message.source and start <= message.start < end for source, start, end in self._skipped)


def _line(source: Source, at: int) -> Range:
    """The line in which a character stands."""
    number = source.place(at)[0]
    start = source.line_starts[number - source.first_line]
    return source, start, start + len(source.line(number)) + 1


def _in_body(declaration: tree.Declaration, at: int) -> bool:
    """True if a character stands behind all declarations of variables of a POU."""
    if not isinstance(declaration, tree.Pou):
        return False
    first = declaration.body[0].start if declaration.body else declaration.name.end
    return at >= max((section.end for section in declaration.sections), default=first)
