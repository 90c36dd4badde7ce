"""Constant expressions and initial values: trees in, values and bytes out."""

from __future__ import annotations

from collections.abc import Callable

from fbvm.base.diagnostics import Source
from fbvm.base.types import ArrayType, Field, RefType, StructType, Type, families, fold
from fbvm.check.constants import encode
from fbvm.check.facts import Facts, Pou, Value
from fbvm.check.project import Project
from fbvm.syntax import tree


class Values:
    """Works out what must be known before anything runs.

    `fit` is the checker's: it types an expression for a target and leaves a constant in the facts."""

    def __init__(self, project: Project, fit: Callable[[tree.Expr, Source, Type], bool],
                 infer: Callable[[tree.Expr, Source], Type | None],
                 interface: Callable[[Pou, Source, tree.Node], bool]) -> None:
        self.project = project
        self.facts: Facts = project.facts
        self.report = project.report
        self._fit = fit
        self._infer = infer
        self.interface = interface

    def integer(self, expr: tree.Expr, source: Source) -> int | None:
        """The value of a constant integer expression, or None after a diagnostic."""
        kind = self._infer(expr, source)
        if kind is None:
            return None
        value = self.facts.constants.get(expr)
        if isinstance(value, bool) or not isinstance(value, int):
            what = f"{kind}" if value is not None else "not known before the program runs"
            self.report.add("S0701", source, expr, f"a constant integer is needed here; this is {what}",
                            "write a number" if value is not None else
                            "write a literal, or declare the name in a VAR CONSTANT section")
            return None
        return value

    def constant(self, expr: tree.Expr, source: Source, kind: Type) -> Value | None:
        """The value of a constant expression for a variable of `kind`, or None after a diagnostic."""
        if not self._fit(expr, source, kind):
            self.facts.wrong.add(expr)
            return None
        value = self.facts.constants.get(expr)
        if value is None:
            self.facts.wrong.add(expr)
            self.report.add("S0701", source, expr, "an initial value must be known before the program runs",
                            "assign it in the body instead")
        return value

    def initial(self, kind: Type, init: tree.Initial, source: Source, default: bytes) -> bytes:
        """The bytes of a variable of `kind` with this initial value; what it leaves open keeps `default`."""
        if isinstance(init, tree.ArrayInit):
            return self._array(kind, init, source, default)
        if isinstance(init, tree.StructInit):
            return self._structure(kind, init, source, default)
        if isinstance(init, tree.NullLiteral) and isinstance(kind, RefType):
            return bytes(8)
        if isinstance(kind, ArrayType | StructType):
            form = "[...]" if isinstance(kind, ArrayType) else "(name := value, ...)"
            self.report.add("S0705", source, init, f"an initial value of {kind} is written {form}")
            return default
        value = self.constant(init, source, kind)
        return default if value is None else encode(kind, value)

    def _array(self, kind: Type, init: tree.ArrayInit, source: Source, default: bytes) -> bytes:
        if not isinstance(kind, ArrayType):
            self.report.add("S0705", source, init, f"[...] is an initial value of an array, not of {kind}")
            return default
        size = kind.element.size
        element_default = default[:size]
        content = bytearray(default)
        at = 0
        if len(kind.bounds) > 1:
            init = flattened(init)
        for repetition, value in init.items:
            count = 1
            if repetition is not None:
                times = self.integer(repetition, source)
                if times is None:
                    return default
                if times < 0:
                    self.report.add("S0705", source, repetition, "a repetition cannot be negative")
                    return default
                count = times
            data = element_default if value is None else self.initial(kind.element, value, source, element_default)
            if at + count > kind.count:
                self.report.add("S0705", source, value or init,
                                f"too many initial values: {kind} has {kind.count} elements")
                return bytes(content)
            content[at * size:(at + count) * size] = data * count
            at += count
        return bytes(content)

    def _structure(self, kind: Type, init: tree.StructInit, source: Source, default: bytes) -> bytes:
        if not isinstance(kind, StructType):
            self.report.add("S0705", source, init, f"(name := value) is an initial value of a structure, not of {kind}")
            return default
        content = bytearray(default)
        seen: set[str] = set()
        for name, value in init.fields:
            member = kind.member(name.text)
            if member is None or not initialisable(kind, member):
                self.report.add("S0210", source, name, f"{kind} has no {name.text} that can be initialised",
                                self.project.choices(name.text, (f.name for f in kind.fields.values()
                                                                 if initialisable(kind, f))))
                continue
            if fold(name.text) in seen:
                self.report.add("S0705", source, name, f"{name.text} is initialised twice")
                continue
            seen.add(fold(name.text))
            span = slice(member.offset, member.offset + member.type.size)
            content[span] = self.initial(member.type, value, source, bytes(content[span]))
        return bytes(content)


def flattened(init: tree.ArrayInit) -> tree.ArrayInit:
    """`[[1, 2], [3, 4]]` as `[1, 2, 3, 4]`: the values of an array of several dimensions in memory order."""
    items: list[tuple[tree.Expr | None, tree.Initial | None]] = []
    for repetition, value in init.items:
        if isinstance(value, tree.ArrayInit) and repetition is None:
            items.extend(flattened(value).items)
        else:
            items.append((repetition, value))
    return tree.ArrayInit(init.start, init.end, tuple(items))


def initialisable(kind: StructType, member: Field) -> bool:
    """True for what an initialiser of a structure or of a block's instance may name."""
    return not (member.reference or member.absolute or member.bit is not None or member.constant) and \
        (not kind.block or member.kind in ("VAR_INPUT", "VAR_OUTPUT", "VAR"))


def is_any(kind: Type, *names: str) -> bool:
    """True if one of the generic types `names` holds `kind`."""
    return any(name in families(kind) for name in names)
