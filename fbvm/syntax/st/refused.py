"""A text that is read as one token and refused: __TRY .. __ENDTRY.

`whole` takes the tokens behind the word, so that an END in a comment or a string does not count."""

from __future__ import annotations

from collections.abc import Callable

from fbvm.syntax.st.lexer import Token

ENDS = {"__TRY": "__ENDTRY"}
"""Word -> the end of its refused text."""

LIMITS = {"FUNCTION", "FUNCTION_BLOCK", "PROGRAM", "CONFIGURATION", "END_FUNCTION", "END_FUNCTION_BLOCK", "END_PROGRAM",
          "END_CONFIGURATION", "END_RESOURCE", "END_NAMESPACE", "TYPE", "$END"}
"""Terminals at which a refused text ends at the latest."""


def whole(opener: Token, source: str, following: Callable[[], Token]) -> tuple[Token, Token | None]:
    """The token from a refused word to its end, and None; without an END, the token up to where the text must end, and the
    token that follows there."""
    word = opener.text.upper()
    depth, last = 1, opener
    while True:
        token = following()
        text = token.text.upper()
        if token.type == "$END" or token.type in LIMITS:
            return Token(opener.type, source[opener.start:last.end], opener.start, last.end), token
        last = token
        if text == ENDS[word]:
            depth -= 1
            if not depth:
                return Token(opener.type, source[opener.start:token.end], opener.start, token.end), None
        elif text == word:
            depth += 1
