"""Nodes know where they stand: their text is theirs, and children lie inside their parents."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.syntax.parser import parse
from fbvm.syntax.tree import Binary, Literal, Name, NamedType, NameRef, Node
from fbvm.syntax.tree.node import names_of

GOLDEN = Path(__file__).resolve().parent.parent.parent / "golden" / "syntax"


def children(value: Any) -> Iterator[Node]:
    if isinstance(value, Node):
        yield value
    elif isinstance(value, tuple):
        for item in value:
            yield from children(item)


@each_of("path", sorted(GOLDEN.glob("*.st")), ids=lambda p: p.stem)
def test_spans(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    todo: list[Node] = [parse(Source(path.name, text))[0]]
    seen = 0
    while todo:
        node = todo.pop()
        seen += 1
        if isinstance(node, (NameRef, Literal, NamedType)):
            assert text[node.start:node.end] == node.text
        if isinstance(node, Name):
            assert text[node.start:node.end].upper() == node.text.upper()
        if isinstance(node, Binary):
            assert text[node.op_start:node.op_start + len(node.op)].upper() == node.op or text[node.op_start] == "&"
        for name in names_of(node):
            for child in children(getattr(node, name)):
                assert node.start <= child.start <= child.end <= node.end, (node, child)
                todo.append(child)
    assert seen > 20
