"""The small mends of a syntax error: a word more, another word, a word less, judged by how well the parse goes on."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from fbvm.syntax.automaton import Automaton
from fbvm.syntax.frames import OPENERS, STATEMENT_WORDS, UNITS, anchor, frames
from fbvm.syntax.lexer import MISSPELT, Token, lexis
from fbvm.syntax.phrases import found, hint, quoted, sign, unlike
from fbvm.syntax.prospect import State, advance, expected, symbols

INSERTED = ("SEMICOLON", "RPAR", "RSQB", "THEN", "DO", "OF", "COLON", "ASSIGN", "COMMA")
"""Words that may be put in, the most likely first."""

REPLACED = {"EQUAL": ("ASSIGN",), "ASSIGN": ("EQUAL", "COLON"), "COLON": ("SEMICOLON", "ASSIGN"),
            "SEMICOLON": ("COLON",), "COMMA": ("SEMICOLON",), "DOT": ("SEMICOLON",)}
"""Signs that are mistaken for others."""

BRACKETS = {"RPAR": "LPAR", "RSQB": "LSQB"}
GOOD = 3
"""Tokens that must be read well after a word was taken away or replaced, or all that are left."""


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


def best_mend(automaton: Automaton, token: Token, following: list[Token]) -> Mend | None:
    """The mend after which the most of `following` (which begins with `token`) can be read; None if none is good."""
    special = _misspelt(token) or _reserved_name(automaton, token, following) or _end_of_section(automaton, token)
    if special:
        return special
    trials = [*_insertions(automaton, following), *_replacements(automaton, following), *_removal(automaton, following)]
    return max(trials, key=lambda trial: trial[:2])[2] if trials else None


Trial = tuple[int, int, Mend]
"""How many tokens are read well, how likely the mend is, the mend."""


def _score(automaton: Automaton, states: State | None, tokens: list[Token]) -> int:
    """How many of the tokens can be read one after the other."""
    for count, token in enumerate(tokens):
        if states is None:
            return count - 1
        after = advance(states, token.type)
        if after is None and token.type != "NAME" and automaton.may_be_name(token):
            after = advance(states, "NAME")
        if after is not None and (token.type == "$END" or token.type.startswith("REFUSED")):
            return len(tokens)
        states = after
    return len(tokens) if states is not None else len(tokens) - 1


def _insertions(automaton: Automaton, following: list[Token]) -> Iterator[Trial]:
    token, at = following[0], automaton.before.end
    kinds = expected(automaton.states)
    for rank, kind in enumerate(INSERTED):
        after = advance(automaton.states, kind) if kind in kinds else None
        if after is None:
            continue
        score = _score(automaton, after, following)
        if score < (1 if kind == "SEMICOLON" else 2):
            continue
        where = f"before {found(token)}"
        if kind == "SEMICOLON":
            where = f"after the {'statement' if anchor(automaton.states).symbol == 'ended_list' else 'declaration'}"
        yield score, -rank, Mend([Token(kind, sign(kind), at, at), token], at, at, f"{quoted(kind)} expected {where}",
                                 hint(token, kinds), _bracket(automaton, BRACKETS.get(kind)))


def _bracket(automaton: Automaton, kind: str | None) -> Token | None:
    """The innermost open bracket of a kind."""
    return next((v for v in reversed(automaton.values) if isinstance(v, Token) and v.type == kind), None)


def _replacements(automaton: Automaton, following: list[Token]) -> Iterator[Trial]:
    token = following[0]
    for rank, kind in enumerate(REPLACED.get(token.type, ())):
        score = 1 + _score(automaton, advance(automaton.states, kind), following[1:])
        if score >= GOOD:
            message = f"{quoted(kind)} expected, but {found(token)} found"
            advice = hint(token, {kind})
            other = Token(kind, sign(kind), token.start, token.end)
            yield score, 1 - rank, Mend([other], token.start, token.end, message, advice)


def _removal(automaton: Automaton, following: list[Token]) -> Iterator[Trial]:
    token = following[0]
    if token.type in OPENERS or token.type in UNITS or token.type == "VAR":
        return
    rest = following[1:]
    score = _score(automaton, automaton.states, rest)
    if score >= min(GOOD, len(rest)) and rest:
        opener = BRACKETS.get(token.type)
        why = f"{found(token)} without `{sign(opener)}`" if opener and not _bracket(automaton, opener) else ""
        kinds = expected(automaton.states)
        yield score, -len(INSERTED), Mend([], token.start, token.end, why or unlike(token, kinds), hint(token, kinds))


# --- mends of their own kind ---


def _misspelt(token: Token) -> Mend | None:
    """`ENDIF`, `ELSEIF`; the automaton has seen that the right word fits."""
    if token.type != "MISSPELT":
        return None
    kind = MISSPELT[token.text.upper()]
    return Mend([Token(kind, kind, token.start, token.end)], token.start, token.end,
                f"{found(token)} is no word of Structured Text", f"write {kind}")


def _reserved_name(automaton: Automaton, token: Token, following: list[Token]) -> Mend | None:
    """`VAR if : INT;`, `FOR := 1;`"""
    word = automaton.before
    if token.type == "ASSIGN" and word.type in STATEMENT_WORDS and automaton.values[-1] is word:
        name = Token("NAME", word.text, word.start, word.end)
        return Mend([name, token], word.start, word.end, f"{found(word)} is a reserved word and cannot be a name",
                    "choose another name", cut=True)
    if token.type not in lexis().reserved or following[1:2] == []:
        return None
    if following[1].type not in ("COLON", "COMMA", "ASSIGN"):
        return None
    if advance(automaton.states, "NAME") is None:
        return None
    if following[1].type != "ASSIGN" and advance(automaton.states, "NUMBER"):
        return None
    return Mend([Token("NAME", token.text, token.start, token.end)], token.start, token.end,
                f"{found(token)} is a reserved word and cannot be a name", "choose another name")


def _end_of_section(automaton: Automaton, token: Token) -> Mend | None:
    """`VAR x : INT; x := 5;`: the END_VAR is missing in front of the first statement."""
    if token.type not in ("ASSIGN", "LPAR", "LSQB", "DOT", "CARET", "PART"):
        return None
    states, before = automaton.states, automaton.before
    if anchor(states).symbol != "var_decls" or before.type != "NAME" or symbols()[states[-1]] != "names":
        return None
    word = frames(states, automaton.values)[-1].word
    if word.type != "VAR":
        return None
    return Mend([Token("END_VAR", "END_VAR", before.start, before.start), before, token], before.start, before.end,
                f"END_VAR expected before {found(before)}, which begins a statement", "", word, cut=True)
