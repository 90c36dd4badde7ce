"""Texts that are understood as a whole and refused: from METHOD to END_METHOD and their like.

`whole` runs over the tokens behind such a word, so that comments and strings inside need no thought."""

from __future__ import annotations

from collections.abc import Callable

from fbvm.syntax.st.lexer import Token

OBJECT_ORIENTED = {"CLASS", "INTERFACE", "NAMESPACE", "METHOD", "PROPERTY", "USING", "EXTENDS", "IMPLEMENTS", "THIS",
                   "SUPER", "ABSTRACT", "FINAL", "PUBLIC", "PRIVATE", "PROTECTED", "INTERNAL"}
ENDS = {"USING": ";", "__TRY": "__ENDTRY"}
"""What ends a refused text, where it is not END_ and the word."""

HOUSES = {"CLASS", "INTERFACE", "NAMESPACE"}
"""Texts that may contain whole POUs or methods; all others end at the latest with their POU."""

LIMITS = {"FUNCTION", "FUNCTION_BLOCK", "PROGRAM", "CONFIGURATION", "END_FUNCTION", "END_FUNCTION_BLOCK", "END_PROGRAM",
          "END_CONFIGURATION", "END_RESOURCE", "TYPE", "$END"}


def refused_what(text: str) -> tuple[str, str]:
    """How to call a refused piece in messages, and its code, from its first word."""
    word = text.split(None, 1)[0].split("(")[0].upper()
    if word in OBJECT_ORIENTED:
        return word, "S0902"
    return word, "S0901"


def whole(opener: Token, source: str, following: Callable[[], Token]) -> tuple[Token, Token | None]:
    """The token from a refused word to its end; if the end is missing, also the token before which it was missed."""
    word = opener.text.upper()
    end_word = ENDS.get(word, f"END_{word}")
    depth, last = 1, opener
    while True:
        token = following()
        text = token.text.upper()
        if token.type == "$END" or (word not in HOUSES and token.type in LIMITS):
            return Token(opener.type, source[opener.start:last.end], opener.start, last.end), token
        last = token
        if text == end_word:
            depth -= 1
            if not depth:
                return Token(opener.type, source[opener.start:token.end], opener.start, token.end), None
        elif text == word and word in ("NAMESPACE", "__TRY"):
            depth += 1
