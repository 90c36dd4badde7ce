"""Numbers of markers: one counter over texts and lists, in the order of the document."""

from __future__ import annotations

import re

from fbvm.base.digits import whole_number

_ANY = re.compile(r"\$\?St\$Bk\?_#\[(\d+)\]|BEGIN_LIST_\$#\[(\d+)\]|END_LIST_\$#\[(\d+)\]")


def renumbered(text: str, before: str) -> str:
    """The text with its markers numbered through, if those of the text `before` were; else only new ones get numbers, behind
    the highest."""
    old = [number for _, number in _pairs(before)]
    pairs = _pairs(text)
    follows = bool(old) and old == list(range(old[0], old[0] + len(old)))
    if [number for _, number in pairs] == old:
        return text
    first, highest = old[0] if old else 1, max(old, default=0)
    made, at = [], 0
    numbers: list[tuple[int, int, int]] = []
    for position, (spans, number) in enumerate(pairs):
        if follows:
            number = first + position
        elif number > highest:
            highest += 1
            number = highest
        numbers += [(start, end, number) for start, end in spans]
    for start, end, number in sorted(numbers):
        made += [text[at:start], str(number)]
        at = end
    return "".join([*made, text[at:]])


def _pairs(text: str) -> list[tuple[list[tuple[int, int]], int]]:
    """For each text and list in the order in which they begin: the places of its number, and the number."""
    made: list[tuple[list[tuple[int, int]], int]] = []
    lists: dict[int, list[tuple[int, int]]] = {}
    at = 0
    while found := _ANY.search(text, at):
        at = found.end()
        if found[1]:
            second = text.find(found[0], at)
            spans = [found.span(1)]
            if second >= 0:
                spans.append((second + found.start(1) - found.start(), second + found.end(1) - found.start()))
                at = second + len(found[0])
            made.append((spans, whole_number(found[1])))
        elif found[2]:
            lists[whole_number(found[2])] = [found.span(2)]
            made.append((lists[whole_number(found[2])], whole_number(found[2])))
        elif whole_number(found[3]) in lists:
            lists[whole_number(found[3])].append(found.span(3))
    return made
