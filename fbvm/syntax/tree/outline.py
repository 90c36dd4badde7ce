"""A tree as readable text, one node a line: for golden tests and for looking at what the parser understood."""

from __future__ import annotations

from typing import Any

from fbvm.syntax.tree import Binary, Direct, EnumLiteral, Literal, Location, Name, NamedType, NameRef, Node
from fbvm.syntax.tree.node import names_of

HIDDEN = {"start", "end", "op_start", "forms"}


def dump(tree: Node) -> str:
    """The outline of a tree.  Leaves stand on their parent's line; positions are left out."""
    lines: list[str] = []
    _walk(tree, "", 0, lines)
    return "\n".join(lines) + "\n"


def _leaf(value: Any) -> str | None:
    """A value that needs no line of its own, or None."""
    if value is None:
        return "_"
    if isinstance(value, (Name, NameRef, NamedType, Direct, Location)):
        return value.text
    if isinstance(value, Literal):
        typed = f"{value.type_name}#" if value.type_name else ""
        return f"{typed}{value.kind}:{value.value!r}"
    if isinstance(value, EnumLiteral):
        return f"{value.type_name.text}#{value.member.text}"
    if isinstance(value, tuple):
        leaves = [_leaf(item) for item in value]
        return f"[{', '.join(leaf or '' for leaf in leaves)}]" if None not in leaves else None
    return None if isinstance(value, Node) else str(value)


def _walk(value: Any, label: str, depth: int, lines: list[str]) -> None:
    pad = "  " * depth
    leaf = _leaf(value)
    if leaf is not None:
        lines.append(f"{pad}{label}{leaf}")
    elif isinstance(value, tuple):
        lines.append(f"{pad}{label}-")
        for item in value:
            _walk(item, "", depth + 1, lines)
    else:
        _node(value, label, depth, lines)


def _node(node: Node, label: str, depth: int, lines: list[str]) -> None:
    short, long = [], []
    for name in (name for name in names_of(node) if name not in HIDDEN):
        value = getattr(node, name)
        if value is None or value is False or value == "" or (value == () and name != "otherwise"):
            continue
        leaf = _leaf(value)
        if leaf is None:
            long.append((name, value))
        else:
            short.append(leaf if isinstance(node, Binary) else f"{name}={leaf}")
    lines.append("  " * depth + label + " ".join([type(node).__name__, *short]))
    for name, value in long:
        _walk(value, f"{name}: ", depth + 1, lines)
