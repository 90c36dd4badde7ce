"""One message for a name that is unknown in many places."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

from fbvm.base.diagnostics import Diagnostic

NAMES = frozenset(("S0201", "S0204", "S0401"))
"""Codes of names that nobody declares."""
FEW = 2
"""Up to this number of messages about one name of a source all are kept."""
LISTED = 4
"""Lines that the message names."""


def gathered(found: Sequence[Diagnostic]) -> list[Diagnostic]:
    """The messages, in their order; of those about one unknown name of a source the first, which names the other lines, and of
    those about one unknown attribute the first of all sources."""
    places: dict[tuple[str, str, str], list[Diagnostic]] = defaultdict(list)
    for message in found:
        if (key := _key(message)) is not None:
            places[key].append(message)
    kept: list[Diagnostic] = []
    for message in found:
        key = _key(message)
        same = places[key] if key is not None else []
        if len(same) <= (FEW if message.code in NAMES else 1):
            kept.append(message)
        elif message is same[0] and message.code in NAMES:
            kept.append(replace(message, hint=_with_lines(message.hint, same)))
        elif message is same[0]:
            kept.append(replace(message, hint=f"{message.hint}; it stands in {len(same)} places"))
    return kept


def _key(message: Diagnostic) -> tuple[str, str, str] | None:
    """What messages that say the same have in common; None for one that is always said."""
    if message.code in NAMES:
        return message.code, message.source.name, message.message
    return (message.code, "", message.message) if message.code == "S0190" and "attribute '" in message.message else None


def _with_lines(hint: str, same: Sequence[Diagnostic]) -> str:
    lines = sorted({each.source.place(each.start)[0] for each in same} - {same[0].source.place(same[0].start)[0]})
    if not lines:
        return hint
    shown = ", ".join(map(str, lines[:LISTED]))
    more = f" and {len(lines) - LISTED} more" if len(lines) > LISTED else ""
    also = f"the same in line{'s' if len(lines) > 1 else ''} {shown}{more}"
    return f"{hint}; {also}" if hint else also
