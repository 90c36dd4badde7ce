"""Source files that an import makes: names that every system can have, texts in canonical form."""

from __future__ import annotations

import re

from fbvm.base.diagnostics import Source
from fbvm.base.host import is_device
from fbvm.syntax.formatter.formatter import formatted

LONGEST_NAME = 60
"""Most characters of the name of a file; file systems take 255 bytes."""


class SourceFiles:
    """Lines by the names of their files, which all systems can have: no two differ by case only, none is long or a device."""

    def __init__(self) -> None:
        self.lines: dict[str, list[str]] = {}
        self._taken: set[str] = set()
        self._numbers: dict[str, int] = {}

    def add(self, name: str, lines: list[str]) -> str:
        """Puts lines into a file of their own, which is called `name` or like it.  Returns its name."""
        name = re.sub(r"[^\w-]", "_", name)[:LONGEST_NAME]
        if is_device(name):
            name += "_"
        free, folded = name, name.casefold()
        while free.casefold() in self._taken:
            self._numbers[folded] = number = self._numbers.get(folded, 1) + 1
            free = f"{name}_{number}"
        self._taken.add(free.casefold())
        self.lines[free] = lines
        return f"{free}.st"

    def texts(self) -> dict[str, str]:
        """The texts by their file names, in the form in which `fmt` writes them; as they are if they cannot be read."""
        return {f"{name}.st": formatted(Source("", "\n".join(lines) + "\n"))[0] for name, lines in self.lines.items()}
