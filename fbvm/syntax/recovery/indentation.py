"""Finds the block whose END is missing by the indentation, when only the outermost block seems open."""

from __future__ import annotations

from typing import Any

from fbvm.base.diagnostics import Source
from fbvm.syntax.recovery.frames import ENDS, OPENERS
from fbvm.syntax.st.lexer import Lexer, Token

LONGEST = 200_000
"""Longest block in characters that is searched."""

BLOCKS = {"IF", "CASE", "FOR", "WHILE", "REPEAT", "TRY"}


def advice(source: Source, opener: Token, until: Token) -> str:
    """A hint which END is missing, if `opener` has none before `until`; "" if the text gives none.

    The block is an IF behind ELSE, or the first block whose END stands further left than its beginning."""
    if opener.type not in BLOCKS or until.start - opener.start > LONGEST:
        return ""
    open_: list[Token] = []
    before = ""
    for token in Lexer(source.text[opener.start:until.start], _silent).tokens():
        if token.type in BLOCKS:
            open_.append(_moved(token, opener.start))
            if before == "ELSE" and token.type == "IF" and not _first(source, open_[-1]):
                return f"ELSE IF in line {_line(source, open_[-1])} opens a second IF; write ELSIF"
        elif token.type in ENDS.values() and OPENERS[token.type] & BLOCKS and open_:
            end, word = _moved(token, opener.start), open_.pop()
            if word.type not in OPENERS[end.type]:
                return ""
            if _first(source, word) and _first(source, end) and _column(source, end) < _column(source, word):
                return (f"by the indentation, the {end.type} of line {_line(source, end)} ends another block: "
                        f"the {word.type} of line {_line(source, word)} may be the one without its end")
        before = token.type
    return ""


def ends_alike(source: Source, opener: Token, end: Token) -> bool:
    """Whether an END is where the END of a block is expected: on its line, or as far indented on a line of its own."""
    if _line(source, opener) == _line(source, end):
        return True
    return _first(source, end) and _column(source, end) == _column(source, opener)


def _silent(*message: Any) -> None:
    """Errors of the lexer were reported before."""


def _moved(token: Token, by: int) -> Token:
    return Token(token.type, token.text, token.start + by, token.end + by)


def _line(source: Source, token: Token) -> int:
    return source.place(token.start)[0]


def _column(source: Source, token: Token) -> int:
    return source.place(token.start)[1]


def _first(source: Source, token: Token) -> bool:
    """Whether a token is the first on its line."""
    line, column = source.place(token.start)
    return not source.line(line)[:column - 1].strip()
