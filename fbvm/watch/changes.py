"""What of an array, a structure or a range of addresses has changed: the part that tells most."""

from __future__ import annotations

from collections.abc import Iterator

from fbvm.base.types import ArrayType, StructType, base
from fbvm.watch.paths import Place, Span, element, member
from fbvm.watch.values import Value

Change = tuple[Place | Span, Value, Value]
"""A place, what it held and what it holds."""


def changed(found: Place | Span, before: Value, after: Value) -> Change:
    """The only part that differs, down to a single value; all of what several parts of differ."""
    change: Change = found, before, after
    while len(parts := list(_different(*change))) == 1:
        change = parts[0]
    return change


def _different(found: Place | Span, before: Value, after: Value) -> Iterator[Change]:
    kind = base(found.type) if isinstance(found, Place) else None
    if isinstance(before, list) and isinstance(after, list):
        for number, (old, new) in enumerate(zip(before, after, strict=True)):
            if repr(old) != repr(new):  # NAN is no other NAN
                if isinstance(found, Span):
                    yield found.places[number], old, new
                elif isinstance(kind, ArrayType):
                    yield element(found, kind, number), old, new
    elif isinstance(before, dict) and isinstance(after, dict) and isinstance(found, Place) and isinstance(kind, StructType):
        for name, old in before.items():
            if repr(old) != repr(after[name]):
                yield member(found, name), old, after[name]
