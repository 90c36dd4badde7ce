"""Constants as operations."""

from __future__ import annotations

from fbvm.base.types import Type, machine
from fbvm.check.symbols.facts import Value
from fbvm.code.operations import FLOATS, TEXT_UNITS, Node

TRUE: Node = ("const", "b", 1)
FALSE: Node = ("const", "b", 0)


def constant(kind: Type, value: Value) -> Node:
    """A constant of the type `kind` as an operation."""
    form = machine(kind)
    if form in FLOATS:
        return ("const", form, float(value))
    return ("const", form, int(value) if form not in TEXT_UNITS else value)


def zero(form: str) -> Node:
    """The constant of a machine type that stands for no value yet: 0, FALSE, NULL or the empty text."""
    return ("const", form, b"" if form == "s8" else "" if form == "s16" else float(0) if form in FLOATS else 0)
