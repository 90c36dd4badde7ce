"""Which types hold, however deep inside, an instance of a block about which something is asked; each type is looked into
once, however many instances there are."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from fbvm.base.types import ArrayType, StructType, Type
from fbvm.check.symbols.facts import Pou

if TYPE_CHECKING:
    from fbvm.check.checker import Checker


class Inside:
    """Answers one question about types: True for those that are or hold an instance of a block that is `asked` for."""

    def __init__(self, checker: Checker, asked: Callable[[Pou], bool]) -> None:
        self.checker, self._asked = checker, asked
        self._known: dict[int, tuple[Type, bool]] = {}
        """By the identity of the type, which stays its own while the type is here."""

    def __call__(self, kind: Type) -> bool:
        if isinstance(kind, ArrayType):
            return self(kind.element)
        if not isinstance(kind, StructType):
            return False
        known = self._known.get(id(kind))
        if known is None:
            known = self._known[id(kind)] = kind, self._look(kind)
        return known[1]

    def _look(self, kind: StructType) -> bool:
        if not kind.block:
            return any(self(member.type) for member in kind.fields.values())
        pou = self.checker.block_of(kind)
        return self._asked(pou) or any(self(v.type) for v in pou.order if v.place == "self" and not v.reference)
