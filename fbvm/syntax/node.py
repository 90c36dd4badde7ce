"""What all nodes of a tree share: `node` makes a class one, `Node` holds its place."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from typing import Any, TypeVar, dataclass_transform

_T = TypeVar("_T")


@dataclass_transform(eq_default=False, field_specifiers=(field,))
def node(cls: type[_T]) -> type[_T]:
    """A dataclass with slots that compares by identity.  `Node` has the one `__repr__` for all: sixty of their own
    would cost a third of the time that it takes to start."""
    return dataclass(eq=False, slots=True, repr=False)(cls)


@node
class Node:
    """A piece of a source text; `start` and `end` are character offsets."""

    start: int
    end: int

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{f.name}={getattr(self, f.name)!r}' for f in fields(self))})"


def walk(part: Any) -> Iterator[Node]:
    """A node and all nodes in it; of a tuple, all that it holds."""
    left = [part]
    while left:
        item = left.pop()
        if isinstance(item, tuple):
            left += item
        elif isinstance(item, Node):
            yield item
            left += [getattr(item, f.name) for f in fields(item)]


def copied(part: Any) -> Any:
    """The same tree anew: nodes that are not the old ones, so that other facts can be known of them."""
    if isinstance(part, tuple):
        return tuple(copied(item) for item in part)
    return type(part)(*(copied(getattr(part, f.name)) for f in fields(part))) if isinstance(part, Node) else part
