"""Every rule of the grammar is exercised by some program of the repository."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path
from typing import Any

import pytest

from fbvm.base.diagnostics import Source
from fbvm.syntax.pous import SourceBuilder
from fbvm.syntax.recovery.recovery import Recovery
from fbvm.syntax.st.automaton import Automaton
from fbvm.syntax.st.builder import Stop
from fbvm.syntax.st.lexer import Lexer
from fbvm.syntax.st.tables import Rule, tables

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


@cache
def used() -> frozenset[int]:
    """Numbers of the rules by which the programs were reduced."""
    seen: set[int] = set()

    def noting(number: int, action: Callable[..., Any] | None, builder: SourceBuilder, *children: Any) -> Any:
        seen.add(number)
        return action(builder, *children) if action else children[0]

    for text in programs():
        source = Source("program.st", text)
        builder = SourceBuilder(source)
        automaton = Automaton(builder, Lexer(text, builder.report).tokens())
        automaton.text = text
        automaton.actions = [partial(noting, number, action) for number, action in enumerate(automaton.actions)]
        try:
            automaton.run(lambda stuck, builder=builder: Recovery(stuck, builder))  # type: ignore[misc]
        except Stop:
            continue
    return frozenset(seen)


@pytest.mark.slow
def test_every_rule_is_exercised() -> None:
    """Rules by number: how lark orders them differs from run to run."""
    rules: tuple[Rule, ...] = tables("st").rules
    missing = [f"{rule.origin} of {rule.size} -> {rule.action or 'its child'} {rule.places or ''}"
               for number, rule in enumerate(rules) if number not in used()]  # fmt: skip
    assert not missing


def test_every_terminal_is_exercised() -> None:
    words = {terminal.pattern.lower() for terminal in tables("st").terminals if terminal.literal}
    text = " ".join(programs()).lower()
    assert not [word for word in sorted(words) if word not in text]
