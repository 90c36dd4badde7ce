"""Repairs of a syntax error by one token: inserted, replaced or removed, judged by how many tokens can be read then."""

from __future__ import annotations

from collections.abc import Iterator

from fbvm.syntax.recovery.chart_mistakes import chart_mistake
from fbvm.syntax.recovery.frames import HEADS, OPENERS, UNITS, anchor, frames, open_head
from fbvm.syntax.recovery.mistakes import known_mistake, open_bracket
from fbvm.syntax.recovery.repair import Repair
from fbvm.syntax.recovery.wording import found, hint, quoted, sign, unlike
from fbvm.syntax.st.automaton import ELEMENTS, Automaton
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.st.lookahead import State, advance, expected
from fbvm.syntax.tree import EnumLiteral, Literal

INSERTED = ("SEMICOLON", "RPAR", "RSQB", "THEN", "DO", "OF", "COLON", "ASSIGN", "COMMA", "END_REPEAT")
"""Terminals that may be inserted, the most likely first."""

REPLACED = {"EQUAL": ("ASSIGN", "COLON"), "OUTPUT": ("GREATER_EQUAL",),
            "ASSIGN": ("EQUAL", "COLON"), "COLON": ("SEMICOLON", "ASSIGN"),
            "SEMICOLON": ("COLON",), "COMMA": ("SEMICOLON",), "DOT": ("SEMICOLON",)}
"""Terminal -> the terminals for which people write it by mistake."""

BRACKETS = {"RPAR": "LPAR", "RSQB": "LSQB"}
GOOD = 3
"""Tokens that must be readable after a removal or replacement; fewer only at the end of the text."""


def best_repair(automaton: Automaton, token: Token, following: list[Token]) -> Repair | None:
    """The repair for a token that cannot stand in its place; None if no repair is good enough.

    A known mistake has a repair of its own; otherwise the repair wins after which the most of `following` (the next tokens,
    `token` first) can be read."""
    known = chart_mistake(automaton, token, following) or known_mistake(automaton, token, following)
    if known:
        return known
    trials = [*_insertions(automaton, following), *_replacements(automaton, following), *_removal(automaton, following)]
    return max(trials, key=lambda trial: trial[:2])[2] if trials else None


Trial = tuple[int, int, Repair]
"""How many tokens can be read after a repair, how likely the repair is, and the repair."""


def _score(automaton: Automaton, states: State | None, tokens: list[Token]) -> int:
    """How many of the tokens can be read one after the other."""
    for count, token in enumerate(tokens):
        if states is None:
            return count - 1
        after = advance(states, token.type)
        if after is None and token.type != "NAME" and automaton.may_be_name(token):
            after = advance(states, "NAME")
        if after is not None and token.type == "$END":
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
        if score < (1 if kind == "SEMICOLON" else 2) or (kind == "ASSIGN" and token.type == "NAME"):
            continue
        if kind == "COLON" and _after_label(automaton):
            rank = -1
        where = f"before {found(token)}"
        if kind == "SEMICOLON":
            where = f"after the {_unended(automaton)}"
        yield score, -rank, Repair([Token(kind, sign(kind), at, at), token], at, at, f"{quoted(kind)} expected {where}",
                                   "", open_bracket(automaton, BRACKETS.get(kind)))


def _unended(automaton: Automaton) -> str:
    """What a missing `;` should end, for the message."""
    place, open_ = anchor(automaton.states), frames(automaton.states, automaton.values)
    if open_ and open_[-1].word.type == "TRANSITION" and place.size <= open_[-1].at:
        return "condition"
    return {"ended_list": "statement", "associations": "action"}.get(place.symbol, "declaration")


def _after_label(automaton: Automaton) -> bool:
    """Whether the statement begins with a literal that may be a label of CASE."""
    open_ = frames(automaton.states, automaton.values)
    literal = isinstance(automaton.values[-1], (Literal, EnumLiteral)) if automaton.values else False
    return literal and bool(open_) and open_[-1].word.type == "CASE" and (
        len(automaton.states) == anchor(automaton.states).size + 1)


def _replacements(automaton: Automaton, following: list[Token]) -> Iterator[Trial]:
    token = following[0]
    for rank, kind in enumerate(REPLACED.get(token.type, ())):
        score = 1 + _score(automaton, advance(automaton.states, kind), following[1:])
        if kind == "GREATER_EQUAL" and advance(automaton.states, "COLON"):
            continue  # behind a label of CASE
        if score >= GOOD:
            message = f"{quoted(kind)} expected, but {found(token)} found"
            advice = hint(token, {kind})
            other = Token(kind, sign(kind), token.start, token.end)
            yield score, 1 - rank, Repair([other], token.start, token.end, message, advice)


def _removal(automaton: Automaton, following: list[Token]) -> Iterator[Trial]:
    token = following[0]
    if token.type in OPENERS or token.type in UNITS or token.type in ("VAR", "ACTION", *ELEMENTS):
        return
    head = open_head(automaton.states, automaton.values)
    if head and token.type == HEADS[head.word.type]:  # what stands behind it is no head, even where an assignment is a condition
        return
    rest = following[1:]
    score = _score(automaton, automaton.states, rest)
    if score >= min(GOOD, len(rest)) and rest:
        opener = BRACKETS.get(token.type)
        why = f"{found(token)} without `{sign(opener)}`" if opener and not open_bracket(automaton, opener) else ""
        kinds = expected(automaton.states)
        yield score, -len(INSERTED), Repair([], token.start, token.end, why or unlike(token, kinds), hint(token, kinds))

