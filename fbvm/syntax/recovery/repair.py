"""A mend: what a mistake in the text is taken for, so that the rest of it can be read."""

from __future__ import annotations

from dataclasses import dataclass

from fbvm.syntax.st.lexer import Token


@dataclass(frozen=True)
class Mend:
    """What to say and which tokens to go on with; `cut` gives up the statement's beginning first."""

    tokens: list[Token]
    start: int
    end: int
    message: str
    hint: str = ""
    opener: Token | None = None
    cut: bool = False
    code: str = "S0101"
    lossless: bool | None = None
    """Whether all that was written is read; None if that is so unless `cut`, or there being no tokens, says no."""
    silent: int = 0
    """Up to where nothing else is told, since the text is none of ours."""
