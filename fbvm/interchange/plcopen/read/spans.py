"""Rungs that belong together, such as those from IL to ILC: they must stand in one LADDER, with no statement among them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

from fbvm.syntax.ladder.instructions.instruction_set import instruction_set

PAIRS = {"IL": "ILC", "FOR": "NEXT", "JMP0": "JME0", "SBN": "RET"}
"""What begins rungs that belong together, and what ends them."""
BY_NUMBER = {"MILH": "MILC", "MILR": "MILC", "MILC": "MILC", "JMP": "JME", "CJP": "JME", "CJPN": "JME", "JME": "JME",
             "SBS": "SBN", "MCRO": "SBN", "SBN": "SBN"}
"""Instructions that belong to all others of the same group and number: the name of the group."""
TO_THE_END = ("END", "STEP", "SNXT")
"""Instructions that are about all rungs of their LADDER: the program's end, its steps."""


def divided(rungs: Sequence[Sequence[str] | None]) -> set[int]:
    """The places of statements that stand among rungs which belong together.

    rungs: the steps of each rung, None for a statement; all in the order of the program."""
    spans: list[tuple[int, int]] = []
    opened: dict[str, int] = {}
    mentioned: dict[tuple[str, str], tuple[int, int]] = {}
    restarted: set[tuple[str, str]] = set()
    for place, rung in enumerate(rungs):
        for step in rung or ():
            word, *operands = step.split()
            word = word.lstrip("!@%").partition("(")[0]
            if word in PAIRS:
                opened.setdefault(PAIRS[word], place)
            if word in opened:
                spans.append((opened.pop(word), place))
            group = BY_NUMBER.get(word) or ("TRSET" if word in _timers() else "")
            key = group, operands[0].lstrip("#&Tt0") if operands else ""
            if group:
                mentioned[key] = mentioned.get(key, (place, place))[0], place
            if word == "TRSET":
                restarted.add(key)
            if word in TO_THE_END:
                spans.append((-1, len(rungs)))
    spans += [(first, len(rungs)) for first in opened.values()] + [
        span for key, span in mentioned.items() if key[0] != "TRSET" or key in restarted]
    return {place for place, rung in enumerate(rungs) if rung is None and any(a < place < b for a, b in spans)}


@cache
def _timers() -> frozenset[str]:
    """Instructions of a timer with a number, and TRSET, which stands in the rungs of its timer."""
    return frozenset(name for name, row in instruction_set().rows.items() if row.operands[:1] == "t")
