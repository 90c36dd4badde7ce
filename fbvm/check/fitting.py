"""What may stand where: assignment, in-outs, and the hints for what does not fit."""

from __future__ import annotations

from fbvm.base.types import (
    ArrayType,
    Elementary,
    OpenArrayType,
    StringType,
    StructType,
    Type,
    base,
    converts,
    families,
)
from fbvm.check.facts import UNTYPED_INT, UNTYPED_REAL, Value


def is_untyped(kind: Type | None) -> bool:
    return kind is UNTYPED_INT or kind is UNTYPED_REAL


def assignable(kind: Type, target: Type) -> bool:
    """True if a value of `kind` may be stored where `target` is declared, arrays and structures as a whole included."""
    if isinstance(target, OpenArrayType) or isinstance(kind, OpenArrayType):
        return False
    if isinstance(target, ArrayType) and isinstance(kind, ArrayType):
        return kind.bounds == target.bounds and same(kind.element, target.element)
    if isinstance(target, StructType) or isinstance(kind, StructType):
        return kind == target and not (isinstance(target, StructType) and target.block)
    return converts(kind, target)


def same(kind: Type, other: Type) -> bool:
    """True if a variable of `kind` may be passed to an in-out of type `other`: both are the same, but for open bounds."""
    if isinstance(other, OpenArrayType):
        dimensions = len(kind.bounds) if isinstance(kind, ArrayType) else getattr(kind, "dimensions", 0)
        return isinstance(kind, ArrayType | OpenArrayType) and dimensions == other.dimensions and \
            same(kind.element, other.element)
    if isinstance(kind, ArrayType) and isinstance(other, ArrayType):
        return kind.bounds == other.bounds and same(kind.element, other.element)
    return kind == other


def conversion_hint(kind: Type, target: Type) -> str:
    """How to write the conversion, "" if there is none."""
    source, wanted = base(kind), base(target)
    names = [ "STRING" if isinstance(t, StringType) else t.name for t in (source, wanted)]
    if all(isinstance(t, Elementary | StringType) for t in (source, wanted)):
        return f"write {names[0]}_TO_{names[1]}(...)"
    return ""


def literal_hint(value: Value, kind: Type) -> str:
    if "ANY_DURATION" in families(kind):
        return "a duration is written T#500ms"
    if isinstance(kind, StringType):
        return "a text is written 'text'"
    return "write TRUNC(...) or a literal without a point" if isinstance(value, float) else ""
