"""Texts that are read as one token and refused: NAMESPACE .. END_NAMESPACE and the like.

`whole` takes the tokens behind such a word, so that an END in a comment or a string does not count."""

from __future__ import annotations

from collections.abc import Callable

from fbvm.syntax.st.lexer import Token

OBJECT_ORIENTED = {"NAMESPACE", "USING", "EXTENDS"}
ENDS = {"USING": ";", "__TRY": "__ENDTRY"}
"""Word -> the end of its refused text, if that is not END_ and the word."""

HOUSES = {"NAMESPACE"}
"""Words of texts that may contain whole POUs; other texts end at the latest with their POU."""

LIMITS = {"FUNCTION", "FUNCTION_BLOCK", "PROGRAM", "CONFIGURATION", "END_FUNCTION", "END_FUNCTION_BLOCK", "END_PROGRAM",
          "END_CONFIGURATION", "END_RESOURCE", "TYPE", "$END"}


def refused_what(text: str) -> tuple[str, str]:
    """The name of a refused text in messages, and the code of its diagnostic, from its first word."""
    word = text.split(None, 1)[0].split("(")[0].upper()
    if word in OBJECT_ORIENTED:
        return word, "S0902"
    return word, "S0901"


def whole(opener: Token, source: str, following: Callable[[], Token]) -> tuple[Token, Token | None]:
    """The token from a refused word to its end, and None; without an END, the token up to where the text must end, and the
    token that follows there."""
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
