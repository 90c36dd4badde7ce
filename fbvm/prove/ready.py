"""Properties in words: at most one of some conditions, and what PLCopen asks of the outputs of a block."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations

from fbvm.base.types import StructType, fold
from fbvm.prove.question import NEVER, WRITTEN_ONCE, Names, Question
from fbvm.watch.paths import Place, UnknownPlace

EXCLUSIVE = (("DONE", "BUSY", "ERROR", "COMMANDABORTED"), ("ENO", "ERROR"))
"""Outputs of blocks of which never two are TRUE (PLCopen, Function blocks for motion control, 2.4.1), or ENO and Error."""


def at_most_one(conditions: Sequence[str], assumed: tuple[str, ...] = (), free: tuple[str, ...] = ()) -> Question:
    """That never two of some conditions hold behind a scan.  Raises ValueError for fewer than two."""
    if len(conditions) < 2:
        raise ValueError("at most one of them: name two or more, with commas between them")
    return Question(NEVER, _two_of(conditions), assumed, free, title=f"at most one of {', '.join(conditions)}")


def written_once(names: Names, text: str, assumed: tuple[str, ...] = (), free: tuple[str, ...] = ()) -> list[Question]:
    """Of each of some names, addresses and ranges with commas between them: no bit is written by two statements in one scan.

    Raises UnknownPlace."""
    asked = [each.strip() for each in text.split(",")]
    for each in asked:
        names.places(each)
    return [Question(WRITTEN_ONCE, each, assumed, free, names.prefix) for each in asked]


def handshake(names: Names, path: str, assumed: tuple[str, ...] = (), free: tuple[str, ...] = ()) -> Question:
    """That of the outputs Done, Busy, Error and CommandAborted of an instance never two are TRUE, nor ENO and Error.

    Raises UnknownPlace for what is no instance, or has no two of these outputs."""
    place = names.find(path)
    if not isinstance(place, Place) or not isinstance(place.type, StructType) or not place.type.block:
        raise UnknownPlace(f"{path} is no instance of a function block")
    own = {fold(field.name): field.name for field in place.type.fields.values() if field.kind == "VAR_OUTPUT"}
    groups = [[own[fold(name)] for name in group if fold(name) in own] for group in EXCLUSIVE]
    pairs = [_two_of([f"{path}.{name}" for name in group]) for group in groups if len(group) > 1]
    if not pairs:
        raise UnknownPlace(f"{path} is of {place.type}, which has no two of the outputs Done, Busy, Error, CommandAborted, and "
                           "no ENO and Error")  # fmt: skip
    told = sorted({name for group in groups if len(group) > 1 for name in group})
    return Question(NEVER, " OR ".join(pairs), assumed, free, title=f"handshake of {path} ({', '.join(told)})")


def _two_of(conditions: Iterable[str]) -> str:
    return " OR ".join(f"({one}) AND ({other})" for one, other in combinations(conditions, 2))
