"""Which types are or hold, at any depth, an instance of a block with some property.

Each type is looked into once, however many instances there are."""

from __future__ import annotations

from collections.abc import Callable

from fbvm.base.types import ArrayType, StructType, Type
from fbvm.check.symbols.context import Context
from fbvm.check.symbols.facts import Pou


class Containment:
    """A test of types: True for those that are or hold an instance of a block for which `property` is true."""

    def __init__(self, context: Context, property: Callable[[Pou], bool]) -> None:
        self.context, self._property = context, property
        self._known: dict[int, tuple[Type, bool]] = {}
        """By the identity of the type; the type is kept here, so that no other one gets its identity."""

    def __call__(self, kind: Type) -> bool:
        if isinstance(kind, ArrayType):
            return self(kind.element)
        if not isinstance(kind, StructType):
            return False
        known = self._known.get(id(kind))
        if known is None:
            known = self._known[id(kind)] = kind, self._look_into(kind)
        return known[1]

    def _look_into(self, kind: StructType) -> bool:
        if not kind.block:
            return any(self(member.type) for member in kind.fields.values())
        pou = self.context.block_of(kind)
        held = {id(v.type): v.type for v in pou.order if v.place == "self" and not v.reference}
        return self._property(pou) or any(map(self, held.values()))
