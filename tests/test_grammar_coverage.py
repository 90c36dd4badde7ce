"""Every rule of the grammar is exercised by some program of the repository."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any

import pytest

from fbvm.base.diagnostics import Source
from fbvm.syntax.parser import parse
from fbvm.syntax.pous import SourceBuilder
from fbvm.syntax.recovery.recovery import Recovery
from fbvm.syntax.st.automaton import Automaton
from fbvm.syntax.st.builder import Stop
from fbvm.syntax.st.lexer import Lexer
from fbvm.syntax.st.tables import Rule, tables
from fbvm.syntax.tree import SourceText
from fbvm.syntax.tree.node import walk

HOUSE = Path(__file__).resolve().parent.parent
LONGEST = 20_000
"""Characters of a program that is read for this; benchmarks are longer."""


def programs() -> Iterator[str]:
    """All ST in the repository: files, and what stands on the pages of diagnostics."""
    for folder in ("fblib", "examples", "tests"):
        for path in sorted((HOUSE / folder).rglob("*.st")):
            text = path.read_text(encoding="utf-8", errors="replace")
            if len(text) <= LONGEST:
                yield text
    for path in sorted((HOUSE / "fbvm" / "base" / "pages").glob("*.md")):
        yield from re.findall(r"```st\n(.*?)```", path.read_text(encoding="utf-8"), re.S)


class OneByOne(dict[str, Any]):
    """The landings of the automaton without its short cut: each leads to the next rule, also if that only hands on its child."""

    def __missing__(self, terminal: str) -> Any:
        made = self[terminal] = Step(terminal)
        return made


class Step(dict[int, tuple[int, int | None]]):
    def __init__(self, terminal: str) -> None:
        super().__init__()
        self.terminal = terminal

    def __missing__(self, key: int) -> tuple[int, int | None]:
        st = tables("st")
        below, rule = divmod(key, len(st.rules) + 1)
        state = st.actions[below][st.rules[rule].origin]
        return state, st.actions[state].get(self.terminal)


def shape(text: SourceText) -> list[tuple[type, int, int]]:
    """All nodes of the declarations of a text, each with its place."""
    return [(type(node), node.start, node.end) for node in walk(text.declarations)]


@cache
def used() -> tuple[frozenset[int], list[str]]:
    """Numbers of the rules by which the programs were reduced, and the programs of which `parse` makes another tree."""
    seen: set[int] = set()
    differ: list[str] = []

    def noting(number: int, action: Callable[..., Any] | None, builder: SourceBuilder, *children: Any) -> Any:
        seen.add(number)
        return action(builder, *children) if action else children[0]

    for text in programs():
        source = Source("program.st", text)
        builder = SourceBuilder(source)
        automaton = Automaton(builder, Lexer(text, builder.report).tokens())
        automaton.text = text
        automaton.reductions = tuple((partial(noting, number, action), size, places)
                                     for number, (action, size, places) in enumerate(automaton.reductions))
        automaton.landings = OneByOne()  # type: ignore[assignment]
        try:
            made = automaton.run(lambda stuck, builder=builder: Recovery(stuck, builder))  # type: ignore[misc]
        except Stop:
            continue
        if shape(made) != shape(parse(source)[0]):
            differ.append(text)
    return frozenset(seen), differ


@pytest.mark.slow
def test_every_rule_is_exercised() -> None:
    """Rules by number: how lark orders them differs from run to run."""
    rules: tuple[Rule, ...] = tables("st").rules
    missing = [f"{rule.origin} of {rule.size} -> {rule.action or 'its child'} {rule.places or ''}"
               for number, rule in enumerate(rules) if number not in used()[0]]  # fmt: skip
    assert not missing


@pytest.mark.slow
def test_rules_that_only_hand_on_their_child_can_be_passed_over() -> None:
    assert not used()[1]


def test_every_terminal_is_exercised() -> None:
    words = {terminal.pattern.lower() for terminal in tables("st").terminals if terminal.literal}
    text = " ".join(programs()).lower()
    assert not [word for word in sorted(words) if word not in text]
