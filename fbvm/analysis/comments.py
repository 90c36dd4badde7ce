"""The comments of declarations: behind a declaration on its line, or directly above it.

Read from text alone, so that a source needs no tree for it; a name counts only where something declares it."""

from __future__ import annotations

import re
from collections.abc import Iterable

_BEHIND = re.compile(r"[^\n]*?(?://[ \t]*([^\n]*)|\(\*[ \t]*(.*?)\s*\*\))[ \t\r]*(?=\n|\Z)")
_ABOVE = re.compile(
    r"^((?:[ \t]*//[^\n]*\n)+|[ \t]*\(\*(?:(?!\*\)).)*\*\)[ \t]*\n)(?:[ \t]*\{[^}\n]*\}[ \t]*\n)*[ \t]*\Z", re.S | re.M)
_NEARLY = 2000
"""Characters in front of a declaration in which its comment is searched."""
_HEAD = re.compile(r"(?:PROGRAM|FUNCTION_BLOCK|FUNCTION)\s+(?:(?:ABSTRACT|FINAL|PUBLIC|INTERNAL)\s+)*([^\W\d]\w*)", re.I)
_STRUCTURE = re.compile(r"(?:TYPE\s+)?([^\W\d]\w*)\s*:\s*(?:STRUCT|UNION)\b", re.I)
_BEGIN = re.compile(
    r"VAR(?:_\w+)?\b(?!\s*:)(?:\s+(?:RETAIN|NON_RETAIN|PERSISTENT|CONSTANT|PUBLIC|PRIVATE|PROTECTED|INTERNAL)\b)*", re.I)
_END = re.compile(r"END_(?:VAR|STRUCT|UNION)\b", re.I)
_DECLARED = re.compile(r"((?:[^\W\d]\w*\s*,\s*)*[^\W\d]\w*)\s*(?:AT\s+[%\w.]+(?:\s+\d[\d.]*)?\s*)?:(?!=)", re.I)

Key = tuple[str, str]
"""A POU or a structure, "" for global variables, and a name in it, both in upper case."""


def comment_at(text: str, start: int, end: int) -> str:
    """The comment that belongs to what is declared from `start` to `end`; "" if there is none."""
    if behind := _BEHIND.match(text, end):
        return (behind[1] if behind[1] is not None else behind[2]).strip()
    line = text.rfind("\n", 0, start) + 1
    above = _ABOVE.search(text, max(0, line - _NEARLY), line)
    if above is None:
        return ""
    lines = [re.sub(r"^\s*(?://|\(\*|\*(?!\)))?|\*\)\s*$", "", each).strip() for each in above[1].splitlines()]
    return "\n".join(lines).strip()


def declared_comments(texts: Iterable[str]) -> dict[Key, str]:
    """The comments of all variables and members of sources.

    >>> declared_comments(["PROGRAM Main VAR\\n Level : INT;  // mm\\nEND_VAR"])
    {('MAIN', 'LEVEL'): 'mm'}"""
    found: dict[Key, str] = {}
    for text in texts:
        owner, inside, at = "", False, 0
        for line in text.splitlines(keepends=True):
            place, at = at + len(line) - len(line.lstrip()), at + len(line)
            if head := _HEAD.match(text, place):
                owner, inside, place = head[1].upper(), False, _behind_blanks(text, head.end())
            if begin := _BEGIN.match(text, place):
                owner = "" if begin[0].upper().startswith("VAR_GLOBAL") else owner
                inside, place = True, _behind_blanks(text, begin.end())
            elif structure := _STRUCTURE.match(text, place):
                owner, inside, place = structure[1].upper(), True, _behind_blanks(text, structure.end())
            while inside and place < at and (names := _DECLARED.match(text, place, at)):
                if said := comment_at(text, place, names.end()):
                    found |= {(owner, name.strip().upper()): said for name in names[1].split(",")}
                place = _behind_blanks(text, text.find(";", names.end(), at) + 1 or at)
            inside = inside and not _END.match(text, place)
    return found


def _behind_blanks(text: str, place: int) -> int:
    """The first place from this one on, on the same line, that is no blank."""
    while text[place : place + 1] in (" ", "\t"):
        place += 1
    return place
