"""Machine code of an image, shared by all engines that run it: quick code at once, fast code later."""

from __future__ import annotations

from functools import cached_property
from weakref import WeakSet, WeakValueDictionary

from fbvm.code.image import Image
from fbvm.engine.native_compiler import Linked, compile_text
from fbvm.engine.native_context import Point
from fbvm.engine.native_entries import Entry
from fbvm.engine.native_module import Translation, translate

QUICK, FAST = 0, 2
"""Levels of optimisation."""


class Code:
    """The code of one image at each level that somebody wanted."""

    def __init__(self, image: Image) -> None:
        self.image = image
        self._tasks = [f"task{number}" for number in range(len(image.tasks))]
        self._linked: dict[int, Linked] = {}
        self._followers: WeakSet[Entry] = WeakSet()

    @cached_property
    def translation(self) -> Translation:
        return translate(self.image)

    @property
    def points(self) -> tuple[Point, ...]:
        return self.translation.points

    @property
    def context_size(self) -> int:
        return self.translation.context_size

    def prepare(self, level: int | None) -> None:
        """Have code of a level, or of any."""
        wanted = FAST if level is None else level
        if wanted not in self._linked:
            self._linked[wanted] = Linked(compile_text(self.translation.text, wanted), self._tasks)

    def level_of(self, level: int | None) -> int:
        """The level of the code that runs for those who want `level`."""
        return level if level is not None else max(self._linked)

    def address(self, task: int, level: int | None) -> int:
        """Where the entry of a task is."""
        return self._linked[self.level_of(level)].address(f"task{task}")

    def follow(self, entry: Entry, task: int, level: int | None) -> None:
        """Point an entry to the code of a task."""
        entry.point_to(self.address(task, level))
        self._followers.add(entry)


_codes: WeakValueDictionary[int, Code] = WeakValueDictionary()


def code_of(image: Image) -> Code:
    """The code of an image; the same object as long as somebody has it."""
    code = _codes.get(id(image))
    if code is None:
        code = _codes[id(image)] = Code(image)
    return code
