"""Paths of instances: texts that begin with the name under which their instance is found, such as `Plant.MAIN.pump`.

A text has `{attribute 'instance-path'}` in front of it, and its block `{attribute 'reflection'}`.
Source: Beckhoff Information System and CODESYS online help, attribute instance-path."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product

from fbvm.base.types import ArrayType, StringType, StructType, Type, base
from fbvm.check.checker import Checker
from fbvm.check.symbols.facts import Pou, Variable
from fbvm.syntax.st.pragmas import attributes_before

Row = tuple[int, bytes]
"""An offset in the buffer, and what lies there at power-on."""


class InstancePaths:
    """The paths of all instances of one program."""

    def __init__(self, checker: Checker) -> None:
        self._checker = checker
        blocks = [block for block in checker.blocks() if "reflection" in attributes_before(block.source.text, block.tree.start)]
        self._texts = {block: texts for block in blocks if (texts := [each for each in block.order if _is_path(each)])}
        self._holding: dict[int, bool] = {}

    def rows(self) -> Iterator[Row]:
        """What lies in the texts at power-on."""
        configurations = self._checker.project.configurations
        application = configurations[0][0].name.text if configurations else "PLC"
        for variable in self._checker.global_order if self._texts else ():
            if variable.place == "abs" and not variable.reference:
                name = f"{variable.space}.{variable.name}" if variable.space else variable.name
                yield from self._in(variable.type, variable.offset, f"{application}.{name}")

    def _in(self, kind: Type, at: int, path: str) -> Iterator[Row]:
        if not self._holds(kind):
            return
        if isinstance(kind, ArrayType):
            for number, subscripts in enumerate(product(*(range(low, high + 1) for low, high in kind.bounds))):
                shown = ",".join(map(str, subscripts))
                yield from self._in(kind.element, at + number * kind.element.size, f"{path}[{shown}]")
        elif isinstance(kind, StructType):
            block = self._checker.block_of(kind) if kind.block else None
            for level in block.lineage() if block is not None else ():
                yield from (_row(text, at, path) for text in self._texts.get(level, ()) if text.owner is level)
            for field in kind.fields.values():
                if not (field.reference or field.absolute):
                    yield from self._in(field.type, at + field.offset, f"{path}.{field.name}")

    def _holds(self, kind: Type) -> bool:
        """True if a value of that type holds such a text."""
        if isinstance(kind, ArrayType):
            return self._holds(kind.element)
        if not isinstance(kind, StructType):
            return False
        if id(kind) not in self._holding:
            lineage: list[Pou] = [*self._checker.block_of(kind).lineage()] if kind.block else []
            self._holding[id(kind)] = any(level in self._texts for level in lineage) or any(
                self._holds(field.type) for field in kind.fields.values() if not (field.reference or field.absolute))
        return self._holding[id(kind)]


def _is_path(variable: Variable) -> bool:
    kind = base(variable.type)
    return isinstance(kind, StringType) and not kind.wide and variable.place == "self" and \
        "instance-path" in attributes_before(variable.source.text, variable.node.start)


def _row(text: Variable, at: int, path: str) -> Row:
    kind = base(text.type)
    assert isinstance(kind, StringType)
    return at + text.offset, path.encode("latin-1", "replace")[:kind.capacity] + b"\0"
