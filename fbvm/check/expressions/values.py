"""Tests of types, and of expressions by their form alone."""

from __future__ import annotations

from fbvm.base.types import Field, RefType, StructType, Type, families, fold
from fbvm.syntax import tree
from fbvm.syntax.st.expressions import REPEATED_LIMIT


def flattened(init: tree.ArrayInit) -> tree.ArrayInit:
    """`[[1, 2], 2([3, 4])]` as `[1, 2, 3, 4, 3, 4]`: the values of an array of several dimensions in memory order."""
    items: list[tuple[tree.Expr | None, tree.Initial | None]] = []
    for repetition, value in init.items:
        times = 1 if repetition is None else repetition.value if isinstance(repetition, tree.Literal) else None
        rows = flattened(value).items if isinstance(value, tree.ArrayInit) else ()
        if rows and isinstance(times, int) and times * len(rows) <= REPEATED_LIMIT:
            items.extend(rows * times)
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
    """True for an initial value that is made of a place: REF(x), ADR(x), of a REFERENCE TO the variable itself, of an interface
    the instance."""
    made = isinstance(init, tree.Call) and isinstance(init.callee, tree.NameRef) and fold(init.callee.text) in MAKERS and \
        len(init.arguments) == 1 and init.arguments[0].value is not None
    return made or (kind.follows or kind.interface) and not isinstance(init, tree.Literal)


def is_null(value: tree.Expr) -> bool:
    """True for NULL, and for 0, which CODESYS writes for it."""
    return isinstance(value, tree.NullLiteral) or isinstance(value, tree.Literal) and value.kind == "int" and value.value == 0


def is_any(kind: Type, *names: str) -> bool:
    """True if one of the generic types `names` holds `kind`."""
    return not families(kind).isdisjoint(names)
