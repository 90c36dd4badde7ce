"""A repair: how parsing goes on after a syntax error, and the diagnostic that says so."""

from __future__ import annotations

from dataclasses import dataclass

from fbvm.syntax.st.lexer import Token


@dataclass(frozen=True)
class Repair:
    """The diagnostic for a mistake, and the tokens to feed to the parser in place of the one that cannot stand there."""

    tokens: list[Token]
    start: int
    end: int
    message: str
    hint: str = ""
    opener: Token | None = None
    """The word or bracket to which the message refers."""
    cut: bool = False
    """Whether what has been read of the statement or declaration is given up first."""
    code: str = "S0101"
    lossless: bool | None = None
    """Whether nothing that was written is lost for the tree; None: if there are tokens and nothing is `cut`."""
    silent: int = 0
    """End of the text in which other errors are not reported, since it is in another language; 0 if there is none."""
