"""`[[picture]]` of a project file: a drawing of one's machine, and what its elements show of the PLCs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fbvm.base.files import resolved
from fbvm.run.project_reader import Key, Keys, Kind, Reading, text, texts_by_name

Range = tuple[float, float]
SHOWS = ("text", "color", "visible", "fill", "rotate", "move", "click")
"""Keys of which a binding has at least one."""


def _pair(value: object) -> Range:
    if not isinstance(value, list) or len(value) != 2 or not all(type(one) in (int, float) for one in value):
        raise ValueError(f"{value!r} is no list of two numbers; write [0, 1000]")
    return float(value[0]), float(value[1])


def _range(value: object) -> Range:
    low, high = _pair(value)
    if low == high:
        raise ValueError(f"{value!r} has the same number twice; write [0, 1000]")
    return low, high


_RANGE = Kind("two numbers, such as [0, 1000]", _range)
MOVE: Keys = {
    "from": Key(_RANGE, "The values at which the element is where it is drawn, and where it has moved to."),
    "by": Key(Kind("two numbers, such as [400, 0]", _pair), "How far it moves, to the right and down, in units of the drawing."),
}
BIND: Keys = {
    "element": Key(text, "The id of an element of the drawing."),
    "name": Key(text, "A variable or an address of the PLC."),
    "plc": Key(text, "The PLC; without it the first of the project.", None),
    "text": Key(text, "What the element says; {} is the value, as in \"{} mm\".", None),
    "color": Key(texts_by_name, "Colours by value, such as { TRUE = \"green\", else = \"#888888\" }.", None),
    "visible": Key(text, "The value at which the element is seen, such as \"TRUE\".", None),
    "fill": Key(_RANGE, "The values at which the element is empty and full, from below.", None),
    "rotate": Key(_RANGE, "The values at which the element stands as it is drawn, and has turned once.", None),
    "move": Key(MOVE, "How the element moves with the value.", None),
    "click": Key(text, "What a click writes: a value, \"toggle\" a BOOL's other value, \"press\" TRUE while it is held.", None),
}  # fmt: skip
PICTURE: Keys = {
    "file": Key(text, "An SVG file, from the folder of the project file."),
    "title": Key(text, "What the picture is called; without it as its file.", None),
    "bind": Key(BIND, "What an element of it shows, or writes.", (), many=True),
}


@dataclass(frozen=True)
class Binding:
    """What an element of a drawing shows of a variable; fields as the keys of `BIND`."""

    element: str
    name: str
    plc: str
    text: str | None = None
    color: Mapping[str, str] | None = None
    visible: str | None = None
    fill: Range | None = None
    rotate: Range | None = None
    move: Mapping[str, Range] | None = None
    click: str | None = None


@dataclass(frozen=True)
class Picture:
    """A drawing of a machine, and what it shows."""

    file: Path
    title: str
    bindings: tuple[Binding, ...]


def check_pictures(reading: Reading, table: Mapping[str, Any], folder: Path, *, allow_outside: bool) -> None:
    """Reports pictures outside of the project, and bindings that show nothing or name no PLC of the project."""
    for number, row in enumerate(table["picture"]):
        where = ("picture", number)
        if not allow_outside and not resolved(folder / row["file"]).is_relative_to(resolved(folder)):
            reading.report("P0103", (*where, "file"), f"picture {number + 1}: {row['file']} is outside of the project",
                           "paths stay inside the folder of the project file; --allow-outside takes others, too")
        for at, bind in enumerate(row["bind"]):
            if all(bind[key] is None for key in SHOWS):
                reading.report("P0104", (*where, "bind", at), f"picture {number + 1}: {bind['element']} shows nothing",
                               f"write one of {', '.join(SHOWS)}")
            if bind["plc"] is not None and bind["plc"].partition("[")[0] not in table["plc"]:
                reading.report("P0103", (*where, "bind", at, "plc"), f"there is no PLC {bind['plc']}",
                               f"there are {', '.join(table['plc'])}")


def pictures_of(rows: Iterable[Mapping[str, Any]], folder: Path, plcs: Mapping[str, Any]) -> tuple[Picture, ...]:
    """The pictures of rows that have been read."""
    name, row = next(iter(plcs.items()))
    first = name if row["count"] is None else f"{name}[1]"
    return tuple(
        Picture(folder / row["file"], row["title"] or Path(row["file"]).stem,
                tuple(Binding(**bind | {"plc": bind["plc"] or first}) for bind in row["bind"]))
        for row in rows
    )  # fmt: skip
