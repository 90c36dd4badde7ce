"""Reports a syntax error."""

from __future__ import annotations

from fbvm.syntax.automaton import Automaton
from fbvm.syntax.builder import Builder
from fbvm.syntax.lexer import Token


class Stop(Exception):
    """The rest of the text is not looked at."""


class Recovery:
    """Reports the first error and stops."""

    def __init__(self, automaton: Automaton, builder: Builder) -> None:
        self.automaton, self.builder = automaton, builder

    def unexpected(self, token: Token) -> list[Token]:
        self.builder.report("S0101", token.start, token.end, f"unexpected `{token.text}`")
        raise Stop

    def too_deep(self, token: Token, why: str) -> list[Token]:
        self.builder.report("S0106", token.start, token.end, f"too many {why}")
        raise Stop

    def without_end(self, opener: Token, found: Token) -> None:
        self.builder.report("S0101", opener.start, opener.end, f"{opener.text} has no END")
