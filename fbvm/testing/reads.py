"""Which variables a test asked for since the last scan, and in which line of it."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path

from fbvm.watch.paths import Place

_HERE = str(Path(__file__).parent)


@dataclass
class VariableReads:
    """Places with file and line of who asked for each."""

    rows: list[tuple[str, int, Place]] = field(default_factory=list)

    def add(self, place: Place) -> None:
        """Notes that somebody outside this package asks for a place."""
        frame = sys._getframe(1)
        while frame.f_back is not None and frame.f_code.co_filename.startswith(_HERE):
            frame = frame.f_back
        self.rows.append((frame.f_code.co_filename, frame.f_lineno, place))

    def clear(self) -> None:
        """A new scan begins."""
        self.rows.clear()

    def places(self, file: str = "", lines: range = range(0)) -> list[Place]:
        """Those that some lines of a file asked for, else all."""
        chosen = [place for name, line, place in self.rows if name == file and line in lines]
        return list(dict.fromkeys(chosen or (place for _, _, place in self.rows)))
