"""Pictures of one's machine: drawings on disk, bound to values of PLCs, and read again when they change."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from fbvm.base.diagnostics import Diagnostic, errors
from fbvm.base.files import read_file, reason
from fbvm.live.changes import Stamp, stamp
from fbvm.live.drawings import MOST_BYTES, PREFIX, DrawingError, clean_drawing
from fbvm.live.plcs import LivePlc
from fbvm.run.picture_rows import Binding, Picture
from fbvm.watch.names import is_single
from fbvm.watch.paths import Place, UnknownPlace

Places = dict[str, tuple[LivePlc, Place]]
"""What is shown, by `key`."""


class Pictures:
    """The pictures of a project.  `read` returns its rows as the file says them now, or its errors; `file` is that file."""

    def __init__(self, file: Path, read: Callable[[], Sequence[Picture] | list[Diagnostic]], plcs: Mapping[str, LivePlc]) -> None:
        self._file, self._read, self._plcs = file, read, plcs
        self._rows: Sequence[Picture] = ()
        self._stamps: dict[Path, Stamp] = {}
        self.places: Places = {}
        self.shown: list[dict[str, Any]] = []
        """As pages are told: title, the drawing as SVG, its bindings, and what is wrong with it."""
        self._load()

    def look(self) -> None:
        """Reads again what has changed on disk; called a few times a second."""
        if any(stamp(file) != known for file, known in self._stamps.items()):
            self._load()

    def _load(self) -> None:
        self._stamps = {self._file: stamp(self._file)}
        found = self._read()
        rows: list[Picture] = [row for row in found if isinstance(row, Picture)]
        if not errors([one for one in found if isinstance(one, Diagnostic)]):
            self._rows = rows
        self.places, self.shown = {}, []
        for row in self._rows:
            self._stamps[row.file] = stamp(row.file)
            self.shown.append(self._picture(row))

    def _picture(self, row: Picture) -> dict[str, Any]:
        try:
            svg, left_out = clean_drawing(read_file(row.file, MOST_BYTES))
        except OSError as error:
            return {"title": row.title, "svg": "", "bindings": [], "problems": [f"{row.file.name}: {reason(error)}"]}
        except DrawingError as error:
            return {"title": row.title, "svg": "", "bindings": [], "problems": [f"{row.file.name}: {error}"]}
        elements = {element.get("id", "").removeprefix(PREFIX) for element in ElementTree.fromstring(svg).iter()}
        problems = [f"{row.file.name}: left out, since it does more than draw: {', '.join(left_out)}"] if left_out else []
        bindings = []
        for binding in row.bindings:
            if mistake := self._mistake(binding, elements):
                problems.append(mistake)
            else:
                bindings.append({name: value for name, value in asdict(binding).items() if value is not None}
                                | {"key": key(binding)})  # fmt: skip
        return {"title": row.title, "svg": svg, "bindings": bindings, "problems": problems}

    def _mistake(self, binding: Binding, elements: set[str]) -> str:
        """What is wrong with a binding, "" for nothing; a good one gets its place."""
        if binding.element not in elements:
            return f"the drawing has no element with the id {binding.element}"
        live = self._plcs.get(binding.plc)
        if live is None:
            return f"there is no PLC {binding.plc}"
        try:
            place = live.plc.find(binding.name)
        except (UnknownPlace, ValueError) as error:
            return f"{binding.element}: {error}"
        if not isinstance(place, Place) or not is_single(place):
            return f"{binding.element}: {binding.name} is no single value"
        if binding.click in ("toggle", "press") and place.type.name != "BOOL":
            return f"{binding.element}: {binding.name} is {place.type.name}; only a BOOL is clicked by {binding.click}"
        self.places[key(binding)] = live, place
        return ""


def key(binding: Binding) -> str:
    """The name of a bound value in messages."""
    return f"{binding.plc}/{binding.name}"
