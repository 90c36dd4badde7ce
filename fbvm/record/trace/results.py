"""What bodies return to their callers: the result and the outputs of functions, methods and properties."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

from fbvm.base.types import Field, fold
from fbvm.code.image import Image
from fbvm.record.trace import symbols

Results: TypeAlias = Mapping[int, Sequence[Field]]
"""By the number of a body its result and outputs, whose values are there until the next call."""
RETURNED = ("RESULT", "VAR_OUTPUT")


def results_of(image: Image) -> Results:
    """The results of the bodies of a program; those that return nothing have no row."""
    found = {number: tuple(field for field in image.frames.get(fold(body.name), {}).values() if field.kind in RETURNED)
             for number, body in enumerate(image.bodies)}  # fmt: skip
    return {number: fields for number, fields in found.items() if fields}


def to_data(results: Results) -> dict[str, Any]:
    """Results as lists and dictionaries that JSON can write; `from_data` reads them."""
    return symbols.to_data({f"{number} {field.name}": replace(field, name=f"{number} {field.name}")
                            for number, fields in results.items() for field in fields})  # fmt: skip


def from_data(data: Mapping[str, Any]) -> Results:
    """The results again.  Raises SymbolError for what `to_data` did not write."""
    found: dict[int, list[Field]] = {}
    for field in symbols.from_data(data).values():
        number, _, name = field.name.partition(" ")
        if not number.isdecimal():
            raise symbols.SymbolError(f"no result: {field.name}")
        found.setdefault(int(number), []).append(replace(field, name=name))
    return found
