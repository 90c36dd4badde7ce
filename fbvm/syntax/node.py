"""What all nodes of a tree share: `node` makes a class one, `Node` holds its place."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TypeVar, dataclass_transform

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
