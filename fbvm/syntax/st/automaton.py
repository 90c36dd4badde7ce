"""Runs the grammar's tables over tokens: shift, reduce, and ask somebody else at a token that cannot stand there."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from itertools import chain, repeat
from typing import Any, Protocol

from fbvm.syntax.st.builder import TooDeep
from fbvm.syntax.st.lexer import Token, lexis, meant
from fbvm.syntax.st.lookahead import advance
from fbvm.syntax.st.refused import whole
from fbvm.syntax.st.tables import Tables, tables

NESTING_LIMIT = 200
"""Most brackets, blocks and composite types inside one another; those who walk trees rely on it."""

STACK_LIMIT = 4000
"""States of a parse that keeps NESTING_LIMIT; only a chain of signs or NOTs without end needs more."""

NESTING = frozenset(("LPAR", "LSQB", "IF", "CASE", "FOR", "WHILE", "REPEAT", "STRUCT", "UNION", "ARRAY", "REF_TO",
                     "POINTER", "REFERENCE"))
REFUSED = frozenset(("REFUSED_SECTION", "REFUSED_BLOCK", "TRY"))
DIVIDERS = frozenset(("ELSE", "ELSIF", "UNTIL", "END_IF", "END_CASE", "END_FOR", "END_WHILE", "END_REPEAT",
                      "END_FUNCTION", "END_FUNCTION_BLOCK", "END_PROGRAM", "END_ACTION", "END_TRANSITION"))
"""Words that end a list of statements.  The tables reduce the list for any of them and find out later that it was the
wrong one; those who mend want to know before."""

ELEMENTS = frozenset(("STEP", "TRANSITION"))
"""Words of charts: what must follow them says that they are no names."""
NAMED = re.compile(r"\s+\w+\s*:(?!=)")
"""What behind ACTION says that it is no name either."""
FUNCTION_OPERATORS = frozenset(("AND", "OR", "XOR", "MOD", "NOT"))
"""Reserved words that are names in front of `(`, as in `AND(a, b)`."""


_known: dict[tuple[type, str], tuple[Callable[..., Any] | None, ...]] = {}


def _actions(kind: type, language: str) -> tuple[Callable[..., Any] | None, ...]:
    """What a kind of builder does for each rule; looked up once, as most texts are shorter than the rules are many."""
    if (kind, language) not in _known:
        _known[kind, language] = tuple(getattr(kind, r.action) if r.action else None for r in tables(language).rules)
    return _known[kind, language]


class Mender(Protocol):
    """Who takes over at an error.  It changes the stacks, and says which tokens come next before the lexer's."""

    def unexpected(self, token: Token) -> list[Token]: ...

    def too_deep(self, token: Token, why: str) -> list[Token]: ...

    def without_end(self, opener: Token, found: Token) -> None: ...


class Automaton:
    """One parse in progress.  `states` and `values` are its stacks; `states` is longer by the start."""

    def __init__(self, builder: object, stream: Iterator[Token], text: str = "", language: str = "st") -> None:
        self.tables: Tables = tables(language)
        self.rows = self.tables.actions
        self.builder = builder
        self.actions: Sequence[Callable[..., Any] | None] = _actions(type(builder), language)
        self.states: list[int] = [self.tables.start]
        self.values: list[Any] = []
        self.stream = chain(stream, repeat(Token("$END", "", len(text), len(text))))
        """The tokens; whoever passes over text may have taken the end away, so it comes again."""
        self.mender: Mender | None = None
        self.before = Token("", "", 0, 0)
        """The last token that was taken."""
        self.ahead: list[Token] = []
        """Tokens that come before the stream's, the next one last."""
        lex = lexis()
        self.soft = frozenset(lex.words.values()) - lex.reserved
        """Words that are names where they cannot be words."""
        self.text = text

    def run(self, mender: Callable[[Automaton], Mender]) -> Any:
        """Feed every token; the value of the start symbol.  The mender is made at the first error."""
        ahead, stream, special = self.ahead, self.stream, DIVIDERS | NESTING | REFUSED | {"$END"}
        while True:
            token = ahead.pop() if ahead else next(stream)
            try:
                if token.type not in special:
                    refused = self.feed(token)
                elif token.type in DIVIDERS and advance(self.states, token.type) is None:
                    refused = token
                else:
                    refused = self.feed(token)
                    if refused is None and self.ended(token, mender):
                        return self.values[-1]
                if refused is None:
                    self.before = token
                    continue
                self.settle()
                tokens = self.mended_by(mender).unexpected(refused)
            except TooDeep:
                tokens = self.mended_by(mender).too_deep(token, "operators")
            ahead.extend(reversed(tokens))

    def mended_by(self, mender: Callable[[Automaton], Mender]) -> Mender:
        if self.mender is None:
            self.mender = mender(self)
        return self.mender

    def ended(self, token: Token, mender: Callable[[Automaton], Mender]) -> bool:
        """What is to do behind some tokens; whether it was the end of the text."""
        if token.type == "$END":
            return True
        if token.type in NESTING and len(self.states) > NESTING_LIMIT and self.nested_too_deep():
            self.ahead.extend(reversed(self.mended_by(mender).too_deep(token, "levels")))
        elif token.type in REFUSED and self.values[-1] is token:
            self.values[-1], missed = whole(token, self.text, self.next)
            if missed:
                self.mended_by(mender).without_end(token, missed)
                self.ahead.append(missed)
        return False

    def next(self) -> Token:
        return self.ahead.pop() if self.ahead else next(self.stream)

    def nested_too_deep(self) -> bool:
        """Whether the brackets and blocks that are open are more than allowed."""
        if len(self.states) > STACK_LIMIT:
            return True
        return sum(1 for v in self.values if isinstance(v, Token) and v.type in NESTING) > NESTING_LIMIT

    def feed(self, token: Token) -> Token | None:
        """Take one token: reduce as it demands, then shift it.  Returns the token if it cannot stand here; nothing is
        undone then, since reducing more cannot do harm."""
        rows, rules, actions, states, values = self.rows, self.tables.rules, self.actions, self.states, self.values
        builder, end, kind = self.builder, self.tables.end, token.type
        while True:
            act = rows[states[-1]].get(kind)
            if act is None:
                if kind == "NAME" or not self.may_be_name(token):
                    return token
                if kind == "MISSPELT" and self.misspelt(token):
                    return token
                token = Token("NAME", token.text, token.start, token.end)
                kind = "NAME"
                continue
            if act >= 0:
                states.append(act)
                values.append(token)
                return None
            rule, action = rules[~act], actions[~act]
            size = rule.size
            if action is None:
                del states[-1]
            elif size == 1 and rule.places is None:
                values[-1] = action(builder, values[-1])
                del states[-1]
            else:
                at = len(values) - size
                children = values[at:]
                del values[at:], states[at + 1:]
                if rule.places is not None:
                    children = [None if p is None else children[p] for p in rule.places]
                values.append(action(builder, *children))
            row = rows[states[-1]]
            state = row[rule.origin]
            act = rows[state].get(kind)
            while act is not None and act < 0 and actions[~act] is None:
                state = row[rules[~act].origin]
                act = rows[state].get(kind)
            states.append(state)
            if state == end:
                return None

    def settle(self) -> None:
        """Reduce what is complete whatever follows; done at an error, so that the stacks show what has been read."""
        while True:
            acts = set(self.rows[self.states[-1]].values())
            act = acts.pop() if len(acts) == 1 else 0
            if act >= 0:
                return
            self.reduce(act)

    def reduce(self, act: int) -> None:
        """One step of the grammar upwards."""
        rule, action = self.tables.rules[~act], self.actions[~act]
        at = len(self.values) - rule.size
        children = self.values[at:]
        del self.values[at:]
        del self.states[at + 1:]
        if rule.places is not None:
            children = [None if p is None else children[p] for p in rule.places]
        self.values.append(action(self.builder, *children) if action else children[0])
        self.states.append(self.rows[self.states[-1]][rule.origin])

    def misspelt(self, token: Token) -> bool:
        """Whether `ENDIF` and the like stand where the right word could, and not as somebody's name."""
        behind = self.text[token.end:token.end + 20].lstrip()
        right = meant(token.text)
        if right == "EXIT" and not behind.startswith(";"):
            return False
        return not behind.startswith((":", ",", "(", "[", ".", "^", "=")) and advance(self.states, right) is not None

    def may_be_name(self, token: Token) -> bool:
        """Whether a word that the grammar cannot take here may be the user's name."""
        if token.type in self.soft:
            return token.text[-1] != "=" and token.type not in ELEMENTS and not (
                token.type == "ACTION" and NAMED.match(self.text, token.end))
        return token.type in FUNCTION_OPERATORS and self.text[token.end:token.end + 20].lstrip().startswith("(")
