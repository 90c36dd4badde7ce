"""Arrays and structures that are written out in statements: `a := [1, x, 3]`, `F((left := 2, right := y))`.

Some tools take them; the standard has them in declarations only, which become statements where they name variables and the
frame of a body gets them at each start.  What they leave out has the initial value of its type.
Each has a variable of its own in the frame of its POU, to which its values are written whenever the statement is executed."""

from __future__ import annotations

from collections.abc import Iterator

from fbvm.base.dialects import takers
from fbvm.base.types import ArrayType, Field, RefType, StructType, Type, fold, followed
from fbvm.check.expressions import references
from fbvm.check.expressions.assignability import is_untyped
from fbvm.check.expressions.constant_integers import integer, repeated
from fbvm.check.expressions.constants import default, encode
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.values import flattened, initialisable
from fbvm.check.expressions.writes import writable
from fbvm.check.symbols.facts import Aggregate, AggregatePart, Pou, Variable
from fbvm.check.symbols.symbol_table import SymbolTable
from fbvm.syntax import tree

Written = tree.ArrayInit | tree.StructInit
Value = tuple[tuple[int, ...], int | None, Type, tree.Expr]
"""Offsets of one value in the whole (several if it is repeated), its bit, its type and its expression."""


def aggregate(scope: Scope, expr: Written, want: Type | None) -> Type | None:
    """The type of an array or structure that is written out: the type of its place; None after a diagnostic."""
    if scope.dialect.assignments_are_values and isinstance(expr, tree.StructInit) and len(expr.fields) == 1 and \
            not isinstance(want, StructType):
        return _assigned(scope, expr)
    if not _has_place(scope, expr, want) or want is None:
        return None
    dialect, pou = scope.dialect, scope.pou
    if pou is None or not dialect.written_out and not _is_declared(pou, expr):
        scope.error("S0903", expr, f"{_form(expr)} is an initial value: statements do not take it in the dialect "
                    f"{dialect.name}", f"assign the parts one by one, or take {takers('written_out')}")
        return None
    values = list(_values(scope, want, expr, (0,)))
    content = bytearray(_initial_bytes(scope.project, want))
    parts = [part for part in (_part(scope, value, content) for value in values) if part is not None]
    scope.facts.aggregates[expr] = Aggregate(in_frame(scope, expr, want, _form(expr)), bytes(content), tuple(parts))
    return want


def _is_declared(pou: Pou, expr: Written) -> bool:
    """True for an initial value in a declaration of the POU."""
    return any(section.start <= expr.start < section.end for section in pou.tree.sections)


def _assigned(scope: Scope, expr: tree.StructInit) -> Type | None:
    """The type of `(variable := value)`, which assigns and has the value of the variable (CODESYS online help, ExST)."""
    (name, value), = expr.fields
    target = tree.NameRef(name.start, name.end, name.text)
    kind = scope.infer(target)
    if kind is None or not scope.is_variable(target):
        scope.infer(value)
        if kind is not None:
            scope.error("S0501", name, f"this is a value of {kind} and cannot be written", "only variables stand left of :=")
        return None
    if not writable(scope, target, "be written") or not scope.fit(value, kind):
        return None
    scope.facts.assignments[expr] = tree.Assign(expr.start, expr.end, (target,), ":=", value)
    scope.error("S0193", expr, f"this assigns {name.text} and has its value then", "`=` compares, `:=` assigns")
    return kind


def _has_place(scope: Scope, expr: Written, want: Type | None) -> bool:
    """True where an array or a structure can stand; else a diagnostic."""
    if isinstance(want, ArrayType if isinstance(expr, tree.ArrayInit) else StructType) and not (
            isinstance(want, StructType) and want.block or isinstance(want, ArrayType) and want.packed):
        return True
    if isinstance(expr, tree.StructInit) and len(expr.fields) == 1:
        at = scope.source.text.find(":=", expr.fields[0][0].end)
        scope.error("S0101", tree.Name(at, at + 2, ":="), "`=` expected, but `:=` found", "`=` compares, `:=` assigns")
    else:
        scope.error("S0301", expr, f"{_form(expr)} stands here, but {want or 'something else'} is needed")
    return False


def _form(expr: Written) -> str:
    return "an array [...]" if isinstance(expr, tree.ArrayInit) else "a structure (name := value)"


def in_frame(scope: Scope, expr: tree.Expr, kind: Type, what: str) -> Variable:
    """A new variable for a value in the frame of the POU that is executed."""
    return scope.in_frame(expr, kind, what)


# --- values -----------------------------------------------------------------------------------------------------


def _values(scope: Scope, kind: Type, expr: tree.Expr, places: tuple[int, ...], bit: int | None = None) -> Iterator[Value]:
    """The single values of an array or structure that is written out."""
    if isinstance(expr, tree.ArrayInit) and isinstance(kind, ArrayType):
        yield from _elements(scope, kind, flattened(expr) if len(kind.bounds) > 1 else expr, places)
    elif isinstance(expr, tree.StructInit) and isinstance(kind, StructType) and not kind.block:
        for name, value in expr.fields:
            member = _member(scope, kind, name)
            if member is not None:
                there = tuple(at + member.offset for at in places)
                yield from _values(scope, member.type, value, there, member.bit)
    elif isinstance(expr, tree.ArrayInit | tree.StructInit):
        _has_place(scope, expr, kind)
    else:
        yield places, bit, kind, expr


def _elements(scope: Scope, kind: ArrayType, expr: tree.ArrayInit, places: tuple[int, ...]) -> Iterator[Value]:
    reached = 0
    for written, stands in expr.items:
        repetition, value = repeated(scope, written, stands)
        count = integer(scope, repetition) if repetition is not None else 1
        if count is None or count < 0 or reached + count > kind.count:
            if count is not None:
                scope.error("S0705", stands or expr, f"too many values: {kind} has {kind.count} elements" if count > 0 else
                            "a repetition cannot be negative")
            return
        if value is not None and count:
            size = kind.element.size
            steps = [number * size for number in range(reached, reached + count)]
            yield from _values(scope, kind.element, value, tuple(at + step for at in places for step in steps))
        reached += count


def _member(scope: Scope, kind: StructType, name: tree.Name) -> Field | None:
    member = kind.member(name.text)
    if member is not None and initialisable(kind, member):
        return member
    scope.error("S0210", name, f"{kind} has no {name.text}",
                scope.project.choices(fold(name.text), (f.name for f in kind.fields.values())))
    return None


def _part(scope: Scope, value: Value, content: bytearray) -> AggregatePart | None:
    """The part for a value that is computed when the program runs; None for a constant, which is written into `content`."""
    places, bit, kind, expr = value
    if isinstance(kind, RefType) and kind.follows:
        good = references.lend(scope, expr, followed(kind), "S0301", str(kind))
        return AggregatePart(places, bit, kind, expr) if good else None
    if not scope.fit(expr, kind) or is_untyped(scope.facts.types[expr]):
        return None
    known = scope.facts.constants.get(expr)
    if known is None or isinstance(kind, RefType):
        return AggregatePart(places, bit, kind, expr)
    made = encode(kind, known)
    for at in places:
        if bit is None:
            content[at:at + len(made)] = made
        else:
            content[at] = content[at] & ~(1 << bit) | (made[0] & 1) << bit
    return None


def _initial_bytes(project: SymbolTable, kind: Type) -> bytes:
    """The bytes of a variable of a type that is declared without an initial value."""
    if isinstance(kind, ArrayType):
        return _initial_bytes(project, kind.element) * kind.count
    known = project.nameless.get(kind) or next((entry.resolved[1] for entry in project.types.values()
                                                if entry.resolved is not None and entry.resolved[0] is kind), None)
    if known is not None or not isinstance(kind, StructType):
        return default(kind) if known is None else known
    content = bytearray(kind.size)
    for member in kind.fields.values():
        if member.bit is None and not any(content[member.offset:member.offset + member.type.size]):
            content[member.offset:member.offset + member.type.size] = _initial_bytes(project, member.type)
    return bytes(content)
