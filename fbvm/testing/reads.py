"""The variables that a test has read since the last scan, and the lines that have read them."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path

from fbvm.watch.paths import Place

_HERE = str(Path(__file__).parent)


@dataclass
class VariableReads:
    """The reads since the last scan: file and line of the test, and the place."""

    rows: list[tuple[str, int, Place]] = field(default_factory=list)

    def add(self, place: Place) -> None:
        """Adds a read of a place by the nearest caller outside this package."""
        frame = sys._getframe(1)
        while frame.f_back is not None and frame.f_code.co_filename.startswith(_HERE):
            frame = frame.f_back
        self.rows.append((frame.f_code.co_filename, frame.f_lineno, place))

    def clear(self) -> None:
        """Forgets all reads, at the beginning of a scan."""
        self.rows.clear()

    def places(self, file: str = "", lines: range = range(0)) -> list[Place]:
        """The places that some lines of a file have read; all places if they have read none."""
        chosen = [place for name, line, place in self.rows if name == file and line in lines]
        return list(dict.fromkeys(chosen or (place for _, _, place in self.rows)))
