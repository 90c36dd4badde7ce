"""The bytes of initial values: an initializer of the tree in, bytes out."""

from __future__ import annotations

from fbvm.base.dialects import takers
from fbvm.base.types import ArrayType, RefType, StructType, Type, fold
from fbvm.check.declarations import initializers
from fbvm.check.expressions import references
from fbvm.check.expressions.constant_integers import integer, is_undefined, repeated
from fbvm.check.expressions.constants import encode
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.values import flattened, initialisable, is_null, starts
from fbvm.check.symbols.facts import Start, Value
from fbvm.check.symbols.vendor_names import comma_hint
from fbvm.syntax import tree


def constant(scope: Scope, expr: tree.Expr, kind: Type) -> Value | None:
    """The value of a constant expression for a variable of `kind`, or None after a diagnostic."""
    if not _fits(scope, expr, kind):
        scope.facts.wrong.add(expr)
        return None
    value = scope.facts.constants.get(expr)
    if value is None:
        scope.facts.wrong.add(expr)
        if is_undefined(scope, expr):
            return None
        taken = isinstance(expr, tree.NameRef | tree.Member) and not scope.dialect.initial_variables
        scope.error("S0701", expr, "an initial value must be known before the program runs",
                    "assign it in the body instead" + (f", or take {takers('initial_variables')}" if taken else ""))
    return value


def _fits(scope: Scope, expr: tree.Expr, kind: Type) -> bool:
    """True if an expression fits the type; a dialect may let it name variables whose initial values are known."""
    if not scope.fit(expr, kind, "S0705", "the initial value"):
        return False
    if not scope.dialect.initial_variables or expr in scope.facts.constants or not initializers.replace_by_values(scope, expr):
        return True
    return scope.fit(expr, kind, "S0705", "the initial value")


def initial_bytes(scope: Scope, kind: Type, init: tree.Initial, default: bytes) -> bytes:
    """The bytes of a variable of `kind` with this initial value; what it leaves open keeps `default`."""
    if isinstance(init, tree.ArrayInit):
        return _array(scope, kind, init, default)
    if isinstance(init, tree.StructInit):
        return _structure(scope, kind, init, default)
    if isinstance(kind, RefType) and is_null(init):
        return bytes(8)
    if isinstance(kind, RefType) and starts(kind, init):
        scope.project.dependencies.repeatable = False
        init = references.without_this(init)
        return references.placeholder(scope.facts, Start(references.named(init), init, kind, scope.source, scope.pou, scope.late))
    if isinstance(kind, ArrayType | StructType):
        return _whole(scope, kind, init, default)
    value = constant(scope, init, kind)
    return default if value is None else encode(kind, value)


def _whole(scope: Scope, kind: ArrayType | StructType, init: tree.Expr, default: bytes) -> bytes:
    """The bytes of an array or structure whose initial value is written in one name: those of that variable."""
    place = isinstance(init, tree.NameRef | tree.Member | tree.Index)
    if place and scope.dialect.initial_variables and not (isinstance(kind, StructType) and kind.block):
        if not scope.fit(init, kind, "S0705", "the initial value"):
            return default
        known = initializers.initial_value(scope, init)
        if known is not None:
            return known[1]
    form = "[...]" if isinstance(kind, ArrayType) else "(name := value, ...)"
    others = f"take {takers('initial_variables')}" if place and not scope.dialect.initial_variables else ""
    scope.error("S0705", init, f"an initial value of {kind} is written {form}", others)
    return default


def _array(scope: Scope, kind: Type, init: tree.ArrayInit, default: bytes) -> bytes:
    if not isinstance(kind, ArrayType):
        scope.error("S0705", init, f"[...] is an initial value of an array, not of {kind}",
                    comma_hint(scope.text(init)))
        return default
    size = kind.element.size
    content = bytearray(default)
    at = 0
    if len(kind.bounds) > 1:
        init = flattened(init)
    for repetition, value in init.items:
        repetition, value = repeated(scope, repetition, value)
        count = 1
        if repetition is not None:
            times = integer(scope, repetition)
            if times is None:
                return default
            if times < 0:
                scope.error("S0705", repetition, "a repetition cannot be negative")
                return default
            count = times
        if at + count > kind.count:
            scope.error("S0705", value or init,
                        f"too many initial values: {kind} has {kind.count} elements")
            return bytes(content)
        if value is not None and count:
            _elements(scope, kind.element, value, content, [n * size for n in range(at, at + count)])
        at += count
    return bytes(content)


def _elements(scope: Scope, kind: Type, value: tree.Initial, content: bytearray, places: list[int]) -> None:
    """Write one initial value to several elements of an array; each keeps its own bytes where the value says nothing."""
    made: dict[bytes, bytes] = {}
    for start in places:
        before = bytes(content[start:start + kind.size])
        if before not in made:
            made[before] = initial_bytes(scope, kind, value, before)
        content[start:start + kind.size] = made[before]


def _structure(scope: Scope, kind: Type, init: tree.StructInit, default: bytes) -> bytes:
    if not isinstance(kind, StructType):
        scope.error("S0705", init, f"(name := value) is an initial value of a structure, not of {kind}")
        return default
    scope.facts.types[init] = kind
    content = bytearray(default)
    seen: set[str] = set()
    for name, value in init.fields:
        member = kind.member(name.text)
        if member is None or not initialisable(kind, member):
            scope.error("S0210", name, f"{kind} has no {name.text} that can be initialised",
                        scope.project.choices(name.text, (f.name for f in kind.fields.values()
                                                          if initialisable(kind, f))))
            continue
        if fold(name.text) in seen:
            scope.error("S0705", name, f"{name.text} is initialised twice")
            continue
        seen.add(fold(name.text))
        span = slice(member.offset, member.offset + member.type.size)
        if member.bit is None:
            content[span] = initial_bytes(scope, member.type, value, bytes(content[span]))
        else:
            made = initial_bytes(scope, member.type, value, bytes((content[member.offset] >> member.bit & 1,)))
            content[member.offset] = content[member.offset] & ~(1 << member.bit) | made[0] << member.bit
    return bytes(content)
