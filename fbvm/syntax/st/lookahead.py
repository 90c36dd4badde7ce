"""Look-ahead: what the tables would do with a terminal, on a copy of the stack of states and without building nodes."""

from __future__ import annotations

from functools import cache

from fbvm.syntax.st.tables import tables

State = list[int]


@cache
def symbols() -> tuple[str, ...]:
    """For each state the grammar symbol by which it is reached; "" for the start."""
    names = [""] * len(tables("st").actions)
    for row in tables("st").actions:
        for symbol, act in row.items():
            if act >= 0:
                names[act] = symbol
    return tuple(names)


@cache
def terminal_names() -> tuple[str, ...]:
    """All terminals, the end of the text included."""
    return (*(t.name for t in tables("st").terminals), "$END")


def advance(states: State, kind: str) -> State | None:
    """The stack after a terminal, or None where it cannot stand.  `states` is not changed."""
    grammar = tables("st")
    stack = list(states)
    while True:
        act = grammar.actions[stack[-1]].get(kind)
        if act is None:
            return None
        if act >= 0:
            stack.append(act)
            return stack
        rule = grammar.rules[~act]
        if rule.size:
            del stack[-rule.size:]
        stack.append(grammar.actions[stack[-1]][rule.origin])
        if stack[-1] == grammar.end:
            return stack


def expected(states: State) -> set[str]:
    """Every terminal that can stand here."""
    here = tables("st").actions[states[-1]]
    return {kind for kind in terminal_names() if kind in here and advance(states, kind)}
