"""What the checker finds out about __NEW and __DELETE."""

from __future__ import annotations

from dataclasses import dataclass, field

from fbvm.base.types import Type
from fbvm.syntax import tree


@dataclass(eq=False)
class Made:
    """What a __NEW makes: one variable of a type, or, with `count`, as many behind one another as that says.

    `content` are the bytes with which one begins, references in them as marks.  `held` names a hidden variable in the frame of
    the POU, which holds the pointer while FB_init runs; `construction` are the calls of hidden methods that do so."""

    kind: Type
    content: bytes
    count: tree.Expr | None
    held: tree.NameRef
    construction: list[tree.Call]


@dataclass(eq=False)
class Ended:
    """What a __DELETE ends: the operand, whether it is a variable that becomes 0, the hidden variable that holds it meanwhile,
    and by the number of a type the calls of hidden methods that do FB_exit for an instance of it."""

    pointer: tree.Expr
    kind: Type
    clears: bool
    held: tree.NameRef
    exits: dict[int, list[tree.Call]] = field(default_factory=dict)
    parts: list[tree.Call] = field(default_factory=list)
    """Where no instance is ended: the calls that do FB_exit for the instances in what is."""
