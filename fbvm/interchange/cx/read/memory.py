"""The contents of the memory window to initial values."""

from __future__ import annotations

import re

AREAS = {"D": "D", "H": "H", "W": "W"}
"""Names of lines -> areas that are taken; what is in CIO is made by the program and by units."""
_RUN = re.compile(r"(\d{1,5})(?:-(\d{1,5}))?:([0-9A-Fa-f]{1,4})")


def initial_values(dump: str) -> list[str]:
    """Declarations of arrays with the words that are not 0.  `dump` is a hexadecimal dump of the lines of the window."""
    try:
        lines = bytes.fromhex("".join(dump.split())).decode("latin-1").splitlines()
    except ValueError:
        return []
    made = []
    for line in lines:
        name, sign, contents = line.partition("=")
        bank = re.fullmatch(r"E([0-9A-Fa-f])_?", name)
        area = AREAS.get(name) or (f"E{bank[1].upper()}_" if bank else "")
        if not sign or not area:
            continue
        for first, words in _runs(contents):
            values = ", ".join(f"16#{word:04X}" for word in words)
            name = f"{area.rstrip('_')}_{first}_initial"
            made.append(f"{name} AT {area}{first} : ARRAY [0..{len(words) - 1}] OF WORD := [{values}];")
    return ["// Contents of the memory window", "VAR_GLOBAL", *made, "END_VAR"] if made else []


def _runs(contents: str) -> list[tuple[int, list[int]]]:
    """Words that follow one another and are not 0, with the number of the first."""
    words: dict[int, int] = {}
    for found in _RUN.finditer(contents):
        first, last, value = int(found[1]), int(found[2] or found[1]), int(found[3], 16)
        if value and last <= 65535:
            words.update((number, value) for number in range(first, last + 1))
    runs: list[tuple[int, list[int]]] = []
    for number in sorted(words):
        if runs and runs[-1][0] + len(runs[-1][1]) == number:
            runs[-1][1].append(words[number])
        else:
            runs.append((number, [words[number]]))
    return runs
