"""Runs the tables of a grammar over tokens: shift, reduce, and hand over to the recovery at a token that cannot stand there."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import cache
from itertools import chain, repeat
from typing import Any, Protocol

from fbvm.syntax.st.builder import TooDeep
from fbvm.syntax.st.lexer import Token, lexis, meant
from fbvm.syntax.st.lookahead import advance
from fbvm.syntax.st.tables import Tables, tables

NESTING_LIMIT = 200
"""Most brackets, blocks and composite types inside one another; recursion over trees relies on it."""

SHALLOW = NESTING_LIMIT // 2
"""States on the stack up to which one token cannot come near NESTING_LIMIT."""

STACK_LIMIT = 4000
"""Most states on the stack; within NESTING_LIMIT only an endless chain of signs or NOTs needs more."""

NESTING = frozenset(("LPAR", "LSQB", "IF", "CASE", "FOR", "WHILE", "REPEAT", "TRY", "STRUCT", "UNION", "ARRAY", "REF_TO",
                     "POINTER", "REFERENCE"))
DIVIDERS = frozenset(("ELSE", "ELSIF", "UNTIL", "CATCH", "FINALLY", "END_IF", "END_CASE", "END_FOR", "END_WHILE", "END_REPEAT",
                      "END_TRY",
                      "END_FUNCTION", "END_FUNCTION_BLOCK", "END_PROGRAM", "END_ACTION", "END_TRANSITION", "END_CLASS",
                      "END_METHOD", "END_ACCESSOR", "END_NAMESPACE", "END_PROPERTY"))
"""Words that end a list of statements.  The tables reduce the list for any of them and find out later that it was the
wrong one; the recovery needs the stacks as they are before that."""

ELEMENTS = frozenset(("STEP", "TRANSITION"))
"""Words of charts, whose conditions in the grammar say that they are no names."""
NO_NAMES = ELEMENTS | {"INSTRUCTION_LIST"}
"""Terminals of words that are not reserved, and no names where they have these terminals."""
NAMED = re.compile(r"\s+\w+\s*:(?!=)")
"""The text behind ACTION that says that ACTION is no name."""
FUNCTION_OPERATORS = frozenset(("AND", "OR", "XOR", "MOD", "NOT"))
"""Reserved words that are names of functions in front of `(`, as in `AND(a, b)`."""


Reduction = tuple[Callable[..., Any] | None, int, tuple[int | None, ...] | None]
"""What is done for a rule: its method of the builder, its size and its places, as `Rule` has them."""


_known: dict[tuple[type, str], tuple[Reduction, ...]] = {}


def _reductions(kind: type, language: str) -> tuple[Reduction, ...]:
    """For each rule what a class of builders does; looked up once a class, since a short text uses few of the rules."""
    if (kind, language) not in _known:
        _known[kind, language] = tuple(
            (getattr(kind, r.action) if r.action else None, r.size, r.places) for r in tables(language).rules)
    return _known[kind, language]


class _Landings(dict[int, tuple[int, int | None]]):
    """Where reductions lead that one terminal demands: by the state below and the rule the state above, and the action there.

    Behind an operand up to ten rules follow that only hand on their child (a primary is a term is a sum ...).  What they come
    to depends on the two and the terminal alone, so it is worked out once."""

    def __init__(self, language: str, terminal: str) -> None:
        super().__init__()
        self.tables, self.terminal = tables(language), terminal
        self.width = len(self.tables.rules) + 1

    def __missing__(self, key: int) -> tuple[int, int | None]:
        rows, rules = self.tables.actions, self.tables.rules
        below, rule = divmod(key, self.width)
        state = rows[below][rules[rule].origin]
        act = rows[state].get(self.terminal)
        while act is not None and act < 0 and rules[~act].action is None:
            state = rows[below][rules[~act].origin]
            act = rows[state].get(self.terminal)
        self[key] = state, act
        return state, act


class _AllLandings(dict[str, _Landings]):
    """The landings of a language by terminal."""

    def __init__(self, language: str) -> None:
        super().__init__()
        self.language = language

    def __missing__(self, terminal: str) -> _Landings:
        made = self[terminal] = _Landings(self.language, terminal)
        return made


@cache
def _landings(language: str) -> _AllLandings:
    return _AllLandings(language)


class ErrorRecovery(Protocol):
    """Takes over at an error: changes the stacks, and returns the tokens to feed before those of the lexer."""

    def unexpected(self, token: Token) -> list[Token]: ...

    def too_deep(self, token: Token, why: str) -> list[Token]: ...


class Automaton:
    """One parse in progress.  `states` and `values` are its stacks; `states` has one entry more, the start state."""

    def __init__(self, builder: object, stream: Iterator[Token], text: str = "", language: str = "st") -> None:
        self.tables: Tables = tables(language)
        self.rows = self.tables.actions
        self.builder = builder
        self.landings = _landings(language)
        self.reductions = _reductions(type(builder), language)
        self.states: list[int] = [self.tables.start]
        self.values: list[Any] = []
        self.stream = chain(stream, repeat(Token("$END", "", len(text), len(text))))
        """The tokens; "$END" repeats, since the recovery may have taken it."""
        self.recovery: ErrorRecovery | None = None
        self.before = Token("", "", 0, 0)
        """The last token that was taken."""
        self.ahead: list[Token] = []
        """Tokens to feed before those of the stream, the next one last."""
        lex = lexis()
        self.soft = frozenset(lex.words.values()) - lex.reserved
        """Terminals of words that are names where the grammar cannot take the word."""
        self.text = text

    def run(self, recovery: Callable[[Automaton], ErrorRecovery]) -> Any:
        """Feed every token; returns the value of the start symbol.  `recovery` is called at the first error."""
        ahead, special = self.ahead, DIVIDERS | NESTING | {"$END"}
        while True:
            try:
                tokens = iter((ahead.pop(),)) if ahead else self.stream
                token, refused = self.feed_all(tokens, special)
                if token is None:
                    continue
                if refused is None and token.type in DIVIDERS and advance(self.states, token.type) is None:
                    refused = token
                elif refused is None:
                    refused = self.feed(token)
                    if refused is None and self._ended(token, recovery):
                        return self.values[-1]
                if refused is None:
                    self.before = token
                    continue
                self.settle()
                repaired = self._recovery(recovery).unexpected(refused)
            except TooDeep as error:
                assert error.token is not None
                repaired = self._recovery(recovery).too_deep(error.token, "operators")
            ahead.extend(reversed(repaired))

    def _recovery(self, recovery: Callable[[Automaton], ErrorRecovery]) -> ErrorRecovery:
        if self.recovery is None:
            self.recovery = recovery(self)
        return self.recovery

    def _ended(self, token: Token, recovery: Callable[[Automaton], ErrorRecovery]) -> bool:
        """Called behind a token that nests; returns whether the token was the end of the text."""
        if token.type == "$END":
            return True
        if token.type in NESTING and len(self.states) > NESTING_LIMIT and self._nested_too_deep():
            self.ahead.extend(reversed(self._recovery(recovery).too_deep(token, "levels")))
        return False

    def next(self) -> Token:
        return self.ahead.pop() if self.ahead else next(self.stream)

    def _nested_too_deep(self) -> bool:
        """Whether more brackets and blocks are open than allowed."""
        if len(self.states) > STACK_LIMIT:
            return True
        return sum(1 for v in self.values if isinstance(v, Token) and v.type in NESTING) > NESTING_LIMIT

    def feed(self, token: Token) -> Token | None:
        """Take one token: reduce as it demands, then shift it.  Returns None, or the token if it cannot stand here; its
        reductions are not undone then: they would follow in any case."""
        before = self.before
        _, refused = self.feed_all(iter((token,)), frozenset())
        self.before = before
        return refused

    def feed_all(self, tokens: Iterator[Token], special: frozenset[str]) -> tuple[Token | None, Token | None]:
        """Take tokens as `feed` does, as long as they can stand here and none is `special`; each is the one `before` then.

        Returns the last one, if any was left, and that again if it cannot stand here; a special one was not taken.
        TooDeep knows the token.  Most of a parse is spent here, in one call for many tokens."""
        rows, reductions, states, values, builder = self.tables.actions, self.reductions, self.states, self.values, self.builder
        landings, end, width, before = self.landings, self.tables.end, len(reductions) + 1, self.before
        token = before
        try:
            for token in tokens:
                kind = token[0]
                if kind in special and (kind not in NESTING or len(states) > SHALLOW):
                    return token, None
                taken, act = token, rows[states[-1]].get(kind)
                while act is None or act < 0:
                    if act is None:
                        if kind == "NAME" or not self.may_be_name(taken) or kind == "MISSPELT" and self.misspelt(taken):
                            return token, taken
                        taken, kind = Token("NAME", *token[1:]), "NAME"
                        act = rows[states[-1]].get(kind)
                        continue
                    action, size, places = reductions[~act]
                    if action is None:
                        del states[-1]
                    elif size == 1 and places is None:
                        values[-1] = action(builder, values[-1])
                        del states[-1]
                    else:
                        at = len(values) - size
                        children = values[at:]
                        del values[at:], states[at + 1:]
                        if places is not None:
                            children = [None if p is None else children[p] for p in places]
                        values.append(action(builder, *children))
                    state, act = landings[kind][states[-1] * width + ~act]
                    states.append(state)
                    if state == end:
                        break
                else:
                    states.append(act)
                    values.append(taken)
                before = token
        except TooDeep as error:
            error.token = token
            raise
        finally:
            self.before = before
        return None, None

    def settle(self) -> None:
        """Reduce what is complete whatever follows, so that the recovery finds values for what has been read."""
        while True:
            acts = set(self.rows[self.states[-1]].values())
            act = acts.pop() if len(acts) == 1 else 0
            if act >= 0:
                return
            self.reduce(act)

    def reduce(self, act: int) -> None:
        """Reduce by one rule; `act` is an action of the tables below 0."""
        rule, (action, size, places) = self.tables.rules[~act], self.reductions[~act]
        at = len(self.values) - size
        children = self.values[at:]
        del self.values[at:]
        del self.states[at + 1:]
        if places is not None:
            children = [None if p is None else children[p] for p in places]
        self.values.append(action(self.builder, *children) if action else children[0])
        self.states.append(self.rows[self.states[-1]][rule.origin])

    def misspelt(self, token: Token) -> bool:
        """Whether `ENDIF` or the like stands where the right word fits, and is not used as a name."""
        behind = self.text[token.end:token.end + 20].lstrip()
        right = meant(token.text)
        if right == "EXIT" and not behind.startswith(";"):
            return False
        return not behind.startswith((":", ",", "(", "[", ".", "^", "=")) and advance(self.states, right) is not None

    def may_be_name(self, token: Token) -> bool:
        """Whether a word that the grammar cannot take here may be a name of the user."""
        if token.type in self.soft:
            return token.text[-1] != "=" and token.type not in NO_NAMES and not (
                token.type == "ACTION" and NAMED.match(self.text, token.end))
        return token.type in FUNCTION_OPERATORS and self.text[token.end:token.end + 20].lstrip().startswith("(")
