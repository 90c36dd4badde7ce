"""Which pragmas may be passed over without a word, since they only speak to editors and other tools."""

from __future__ import annotations

import re

from fbvm.syntax.tree import Declaration, SourceText

WORDS = {"region", "endregion", "warning", "info", "text", "elsif", "else", "end_if"}
"""First words of pragmas for the reader or for messages of a compiler that we are not, and of those that go on with an
IF, which was warned of."""

ATTRIBUTES = {
    "qualified_only", "strict", "hide", "hide_all_locals", "conditionalshow", "conditionalshow_all_locals", "displaymode",
    "monitoring", "symbol", "linkalways", "naming", "obsolete", "analysis", "estimated-stack-usage", "to_string",
    "opc.ua.da", "tcencoding", "tcdisplayscale", "tcnocopy"}
"""Names of attributes that make no valid program do anything else: they restrict, show, hide or export."""

_HEXADECIMAL = re.compile(r"""\{\s*attribute\s*'displaymode'\s*:=\s*'hex(?:adecimal)?'\s*\}\s*\Z""", re.IGNORECASE)
_REACH = 100
"""How far before a name its pragma is looked for."""

_SHAPE = re.compile(r"""\s*(?:attribute\s*'([^']*)'|(\w+))""", re.IGNORECASE)


def harmless(text: str) -> bool:
    """Whether the program means the same without the pragma whose contents are `text`."""
    found = _SHAPE.match(text)
    if not found:
        return not text.strip()
    name, word = found[1], found[2]
    return name.lower() in ATTRIBUTES if name is not None else word.lower() in WORDS


def shown_in_hexadecimal(text: str, start: int) -> bool:
    """Whether `{attribute 'displaymode' := 'hex'}` stands before the name that begins at `start`, as CODESYS has it."""
    before = text[max(0, start - _REACH):start]
    return before.rstrip().endswith("}") and _HEXADECIMAL.search(before) is not None


def attributes(text: SourceText, declaration: Declaration) -> set[str]:
    """Names of the attributes that stand directly in front of a declaration."""
    before = max((d.end for d in text.declarations if d.end <= declaration.start), default=0)
    found = (_SHAPE.match(p.text) for p in text.pragmas if before <= p.start and p.end <= declaration.start)
    return {match[1].lower() for match in found if match and match[1] is not None}
