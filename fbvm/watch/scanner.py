"""The tokens of a condition: literals, places, operators.  An address with blanks is one token: `W 0`, `E0 : 5`."""

from __future__ import annotations

import re
from collections.abc import Iterator

from fbvm.syntax.st.comments import SILENT


class ConditionError(ValueError):
    """The text is no condition; the message says why."""


_SILENT = re.compile(SILENT)


def code_of(line: str) -> str:
    """A line of a source with blanks in place of comments and texts, in which no variable stands."""
    return _SILENT.sub(lambda match: " " * len(match[0]), line)


ADDRESS = r"""
    %?\s*(?:CIO|DM|D|W|H|A|TF|CNF|CF|T|C|E[0-9A-F]\s*[_:])\s*\d+(?:\.\d+)?(?![\w.\[^\#])
    | %\s*(?:[IQM][XBWDL]?)?\d+(?:\.\d+)?(?![\w.])
"""
"""What `parse_address` reads, with a letter or a % in front: digits alone are a number here."""
_TOKEN = re.compile(
    rf"""\s*(?:
    (?P<text>(?:W?(?:STRING|CHAR)\#)?(?:'(?:\$.|[^'$])*'|"(?:\$.|[^"$])*"))
    |(?P<literal>(?:[A-Z_]+\#)?(?:(?:2|8|16)\#[0-9A-F_]+|0x[0-9A-F_]+)
      |(?:TIME|LTIME|LT|T)\#-?[\d._a-z]+
      |(?:LDATE_AND_TIME|DATE_AND_TIME|LTIME_OF_DAY|TIME_OF_DAY|LDATE|DATE|LTOD|TOD|LDT|DT|LD|D)\#\d[\d:._-]*
      |(?:[A-Z_]+\#[-+]?)?\d[\d_]*(?:\.\d[\d_]*)?(?:(?:ms|us|ns|d|h|m|s)[\d_.dhmsun]*|e[+-]?\d+)?)
    |(?P<place>{ADDRESS}|[^\W\d]\w*(?:\s*\[[^\]]*\]|\s*\.\s*%?\w+|\s*\^|\#\w+)*)
    |(?P<sign><=|>=|<>|:=|[-+*/=<>&()])
    )""",
    re.I | re.X,
)
_PLACE = r"""(?:
    %?\s*(?:CIO|DM|D|W|H|A|TF|CNF|CF|T|C|E[0-9A-F]\s*[_:])\s*\d+(?:\.\d+)?(?![\w\[^]|\.(?!\.))
    | %\s*(?:[IQM][XBWDL]?)?\d+(?:\.\d+)?(?!\w)
    | \d+(?:\.\d+)?(?!\w)
    | [^\W\d]\w*(?:\s*\[[^\]]*\]|\s*\.\s*%?\w+|\s*\^)*
)"""
_LISTED = re.compile(rf"\s*({_PLACE}(?:\s*\.\.\s*{_PLACE})?)\s*(?:,|(?=\s|$))", re.I | re.X)
_WORDS = frozenset(("AND", "OR", "XOR", "NOT", "MOD", "TRUE", "FALSE"))


def tokens(text: str) -> Iterator[tuple[str, str]]:
    """Kind (text, literal, place, sign, word) and text of each token.  Raises ConditionError."""
    at = 0
    while at < len(text.rstrip()):
        match = _TOKEN.match(text, at)
        if not match:
            raise ConditionError(f"{text[at:].strip()[:20]!r} is not understood in {text!r}")
        kind, word = match.lastgroup or "", match[0].strip()
        if kind == "place" and word.upper() in _WORDS:
            kind, word = "word", word.upper()
        yield kind, word
        at = match.end()


def listed_places(text: str) -> list[str]:
    """The names, addresses and ranges of a list, parted by blanks or commas.  Raises ValueError for what is none of these.

    >>> listed_places("Main.Delay CIO 0.00, D200..D209")
    ['Main.Delay', 'CIO 0.00', 'D200..D209']
    """
    found: list[str] = []
    at = 0
    while at < len(text.rstrip()):
        match = _LISTED.match(text, at)
        if not match:
            raise ValueError(f"{text[at:].strip()!r} is neither a name nor an address nor a range")
        found.append(match[1])
        at = match.end()
    return found
