"""Constant expressions and initial values: trees in, values and bytes out."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from fbvm.base.codes import CODES
from fbvm.base.diagnostics import Source
from fbvm.base.dialects import takers
from fbvm.base.types import ArrayType, Field, RefType, StructType, Type, families, fold
from fbvm.check.expressions.constants import encode
from fbvm.check.symbols.facts import UNTYPED_INT, Facts, Pou, Value, Variable
from fbvm.check.symbols.project import Project
from fbvm.check.symbols.vendor_names import comma_hint
from fbvm.syntax import tree
from fbvm.syntax.tree.node import walk


class Values:
    """Works out what must be known before anything runs.

    `fit` is the checker's: it types an expression for a target and leaves a constant in the facts."""

    def __init__(self, project: Project, fit: Callable[[tree.Expr, Source, Type], bool],
                 infer: Callable[[tree.Expr, Source], Type | None],
                 variable: Callable[[str, Source], Variable | None],
                 interface: Callable[[Pou, Source, tree.Node], bool],
                 start: Callable[[tree.Expr, RefType, Source], bytes]) -> None:
        self.project = project
        self.facts: Facts = project.facts
        self.report = project.report
        self._fit = fit
        self._infer = infer
        self._variable = variable
        self.interface = interface
        self._start = start

    def integer(self, expr: tree.Expr, source: Source, known: Mapping[str, int] | None = None) -> int | None:
        """The value of a constant integer expression, or None after a diagnostic.

        `known` are names, folded, that stand for numbers in it."""
        for name in walk(expr) if known else ():
            if known and isinstance(name, tree.NameRef) and fold(name.text) in known:
                self.facts.types[name], self.facts.constants[name] = UNTYPED_INT, known[fold(name.text)]
        kind = self._infer(expr, source)
        if kind is None:
            return None
        value = self.facts.constants.get(expr)
        if isinstance(value, bool) or not isinstance(value, int):
            what = f"{kind}" if value is not None else "not known before the program runs"
            if value is None and self._is_undefined(expr, source):
                return None
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
            if self._is_undefined(expr, source):
                return None
            taken = isinstance(expr, tree.NameRef | tree.Member) and not self.project.dialect.initial_variables
            self.report.add("S0701", source, expr, "an initial value must be known before the program runs",
                            "assign it in the body instead" + (f", or take {takers('initial_variables')}" if taken else ""))
        return value

    def _is_undefined(self, expr: tree.Expr, source: Source) -> bool:
        """True, with a diagnostic, if a call in a constant expression would trap."""
        for call, (where, code) in self.facts.undefined.items():
            if where is source and expr.start <= call.start and call.end <= expr.end:
                self.report.add("S0703", source, call, f"this has no value: {CODES[code].title}")
                return True
        return False

    def initial(self, kind: Type, init: tree.Initial, source: Source, default: bytes) -> bytes:
        """The bytes of a variable of `kind` with this initial value; what it leaves open keeps `default`."""
        if isinstance(init, tree.ArrayInit):
            return self._array(kind, init, source, default)
        if isinstance(init, tree.StructInit):
            return self._structure(kind, init, source, default)
        if isinstance(kind, RefType) and is_null(init):
            return bytes(8)
        if isinstance(kind, RefType) and starts(kind, init):
            return self._start(init, kind, source)
        if isinstance(kind, ArrayType | StructType):
            form = "[...]" if isinstance(kind, ArrayType) else "(name := value, ...)"
            self.report.add("S0705", source, init, f"an initial value of {kind} is written {form}")
            return default
        value = self.constant(init, source, kind)
        return default if value is None else encode(kind, value)

    def _array(self, kind: Type, init: tree.ArrayInit, source: Source, default: bytes) -> bytes:
        if not isinstance(kind, ArrayType):
            self.report.add("S0705", source, init, f"[...] is an initial value of an array, not of {kind}",
                            comma_hint(source.text[init.start:init.end]))
            return default
        size = kind.element.size
        content = bytearray(default)
        at = 0
        if len(kind.bounds) > 1:
            init = flattened(init)
        for repetition, value in init.items:
            repetition, value = self.repeated(repetition, value, source)
            count = 1
            if repetition is not None:
                times = self.integer(repetition, source)
                if times is None:
                    return default
                if times < 0:
                    self.report.add("S0705", source, repetition, "a repetition cannot be negative")
                    return default
                count = times
            if at + count > kind.count:
                self.report.add("S0705", source, value or init,
                                f"too many initial values: {kind} has {kind.count} elements")
                return bytes(content)
            if value is not None and count:
                self._elements(kind.element, value, source, content, [n * size for n in range(at, at + count)])
            at += count
        return bytes(content)

    def _elements(self, kind: Type, value: tree.Initial, source: Source, content: bytearray, places: list[int]) -> None:
        """The same initial value for some elements of an array; each keeps its own default where that says nothing."""
        made: dict[bytes, bytes] = {}
        for start in places:
            before = bytes(content[start:start + kind.size])
            if before not in made:
                made[before] = self.initial(kind, value, source, before)
            content[start:start + kind.size] = made[before]

    def repeated(self, repetition: tree.Expr | None, value: tree.Initial | None,
                 source: Source) -> tuple[tree.Expr | None, tree.Initial | None]:
        """How often an element of an array is repeated, and its value.

        `N(0)` reads as a call: where N is a constant it is a repetition."""
        if repetition is None and isinstance(value, tree.Call) and isinstance(value.callee, tree.NameRef) and \
                len(value.arguments) < 2 and all(not argument.kind for argument in value.arguments):
            variable = self._variable(value.callee.text, source)
            if variable is not None and isinstance(variable.value, int):
                return value.callee, value.arguments[0].value if value.arguments else None
        return repetition, value

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
            if member.bit is None:
                content[span] = self.initial(member.type, value, source, bytes(content[span]))
            else:
                made = self.initial(member.type, value, source, bytes((content[member.offset] >> member.bit & 1,)))
                content[member.offset] = content[member.offset] & ~(1 << member.bit) | made[0] << member.bit
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
    return not (member.reference or member.absolute or member.constant and member.kind != "VAR_INPUT") and \
        (not kind.block or member.kind in ("VAR_INPUT", "VAR_OUTPUT", "VAR"))


MAKERS = ("REF", "ADR")
"""Functions that make a reference to a variable."""


def starts(kind: RefType, init: tree.Expr) -> bool:
    """True for an initial value that is made of a place: REF(x), ADR(x), and of a REFERENCE TO the variable itself."""
    made = isinstance(init, tree.Call) and isinstance(init.callee, tree.NameRef) and fold(init.callee.text) in MAKERS and \
        len(init.arguments) == 1 and init.arguments[0].value is not None
    return made or kind.follows and not isinstance(init, tree.Literal)


def is_null(value: tree.Expr) -> bool:
    """True for NULL, and for 0, which CODESYS writes for it."""
    return isinstance(value, tree.NullLiteral) or isinstance(value, tree.Literal) and value.kind == "int" and value.value == 0


def is_any(kind: Type, *names: str) -> bool:
    """True if one of the generic types `names` holds `kind`."""
    return not families(kind).isdisjoint(names)
