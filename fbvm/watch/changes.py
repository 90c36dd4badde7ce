"""The part of an array, a structure or a range of addresses that has changed."""

from __future__ import annotations

from collections.abc import Iterator

from fbvm.base.types import ArrayType, StructType, base
from fbvm.watch.paths import Place, Span, element, member
from fbvm.watch.values import Value

Change = tuple[Place | Span, Value, Value]
"""A place, its old value and its new value."""


def changed(found: Place | Span, before: Value, after: Value) -> Change:
    """The smallest part of `found` that contains all differences between the values `before` and `after`."""
    change: Change = found, before, after
    while len(parts := list(_different(*change))) == 1:
        change = parts[0]
    return change


def _different(found: Place | Span, before: Value, after: Value) -> Iterator[Change]:
    kind = base(found.type) if isinstance(found, Place) else None
    if isinstance(before, list) and isinstance(after, list):
        for number, (old, new) in enumerate(zip(before, after, strict=True)):
            if repr(old) != repr(new):  # by text, since NaN is not equal to NaN
                if isinstance(found, Span):
                    yield found.places[number], old, new
                elif isinstance(kind, ArrayType):
                    yield element(found, kind, number), old, new
    elif isinstance(before, dict) and isinstance(after, dict) and isinstance(found, Place) and isinstance(kind, StructType):
        for name, old in before.items():
            if repr(old) != repr(after[name]):
                yield member(found, name), old, after[name]
