"""What all nodes of a tree share: `node` makes a class one, `Node` holds its place."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeVar, cast, dataclass_transform

_T = TypeVar("_T")
_defaults: dict[type, dict[str, Any]] = {}
"""Of each class the parts that need not be given."""
_PARENTHESES = re.compile(r"""'(?:\$.|[^'$])*'|"(?:\$.|[^"$])*"|\(\*.*?\*\)|//[^\n]*|([()])""", re.S)
"""Parentheses, and what is passed over because they mean nothing there: texts and comments."""


@dataclass_transform(eq_default=False)
def node(cls: type[_T]) -> type[_T]:
    """A class with slots for what it annotates, a constructor that takes that in its order, and comparison by identity.

    `dataclass` would make the same of it; for seventy classes that takes a fifth of the time in which a command starts, so
    a constructor is written when somebody makes the first node."""
    held, own = vars(cls), vars(cls).get("__annotations__", {})
    names = (*getattr(cls, "__match_args__", ()), *own)
    defaults = {name: held[name] for name in own if name in held}
    for base in cls.__bases__:
        defaults |= _defaults.get(base, {})
    kept = {name: value for name, value in held.items() if name not in own and name not in ("__dict__", "__weakref__")}
    made = type(cls.__name__, cls.__bases__, {**kept, "__slots__": tuple(own), "__match_args__": names})
    _defaults[made] = defaults

    def first(self: Any, *values: Any, **named: Any) -> None:
        construct = _constructor(names, defaults)
        type.__setattr__(made, "__init__", construct)
        construct(self, *values, **named)

    type.__setattr__(made, "__init__", first)
    return cast("type[_T]", made)


def _constructor(names: tuple[str, ...], defaults: Mapping[str, Any]) -> Callable[..., None]:
    parameters = ", ".join(f"{name}=defaults[{name!r}]" if name in defaults else name for name in names)
    lines = "".join(f"    self.{name} = {name}\n" for name in names)
    known: dict[str, Any] = {"defaults": defaults}
    exec(f"def __init__(self, {parameters}):\n{lines}", known)
    return cast("Callable[..., None]", known["__init__"])


@node
class Node:
    """A piece of a source text; `start` and `end` are character offsets."""

    start: int
    end: int

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{name}={getattr(self, name)!r}' for name in names_of(self))})"


def written(text: str, part: Node) -> str:
    """A node as a text has it, in one line.  It gets the parentheses around its first and its last part that are not its own.

    >>> written("n := 2 * (a + b);", Node(5, 15))
    '2 * (a + b)'
    """
    inside = text[part.start:part.end]
    depth = lowest = 0
    for match in _PARENTHESES.finditer(inside):
        depth += {"(": 1, ")": -1}.get(match[1] or "", 0)
        lowest = min(lowest, depth)
    return "(" * -lowest + " ".join(inside.split()) + ")" * (depth - lowest)


def names_of(part: Node) -> tuple[str, ...]:
    """The names of what a node is made of, in the order of its constructor."""
    names: tuple[str, ...] = vars(type(part))["__match_args__"]
    return names


def changed(part: _T, **parts: Any) -> _T:
    """The same node anew with other parts."""
    assert isinstance(part, Node)
    return type(part)(**{name: getattr(part, name) for name in names_of(part)} | parts)


def walk(part: Any) -> Iterator[Node]:
    """A node and all nodes in it; of a tuple, all that it holds."""
    left = [part]
    while left:
        item = left.pop()
        if isinstance(item, tuple):
            left += item
        elif isinstance(item, Node):
            yield item
            left += [getattr(item, name) for name in names_of(item)]


def copied(part: Any) -> Any:
    """The same tree anew: nodes that are not the old ones, so that other facts can be known of them."""
    if isinstance(part, tuple):
        return tuple(copied(item) for item in part)
    return type(part)(*(copied(getattr(part, name)) for name in names_of(part))) if isinstance(part, Node) else part
