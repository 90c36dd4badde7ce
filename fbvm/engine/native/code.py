"""Machine code of an image, shared by all engines that run it: quick code at once, fast code later."""

from __future__ import annotations

import threading
from functools import cache, cached_property
from weakref import WeakKeyDictionary, WeakValueDictionary

from fbvm.code.image import Image
from fbvm.engine.native.emit.context import Point
from fbvm.engine.native.emit.module import Translation, translate
from fbvm.engine.native.library.library import module_text, parts_of, routines_of
from fbvm.engine.native.llvm import cache as native_cache
from fbvm.engine.native.llvm.cache import Stored, name_of
from fbvm.engine.native.llvm.compiler import Linked, compile_text
from fbvm.engine.native.llvm.entry_points import EntryPoint
from fbvm.engine.native.llvm.worker import compile_apart, worker

QUICK, FAST = 0, 2
"""Levels of optimisation: without passes over the module, and with all."""
_LOADING = threading.RLock()
"""Held while code is loaded, by the main thread or the worker's: the library must not be loaded twice."""


class Code:
    """The machine code of one image, at each level that was asked for; with `stops`, the build that can be stopped.

    `points` (at which a run can end) and the sizes of the context are known as soon as one level is loaded."""

    def __init__(self, image: Image, stops: bool = False) -> None:
        self.image, self.stops = image, stops
        self.points: tuple[Point, ...] = ()
        self.kept_bytes, self.context_bytes = 0, 0
        self.counting: list[object] = []
        self.marks_at = 0
        self._tasks = [f"task{number}" for number in range(len(image.tasks))]
        self._linked: dict[int, Linked] = {}
        self._waiting = False
        self._lock = threading.Lock()
        self._followers: WeakKeyDictionary[EntryPoint, int] = WeakKeyDictionary()

    @cached_property
    def translation(self) -> Translation:
        """The image in LLVM's language."""
        return translate(self.image, self.stops)

    def prepare(self, level: int | None) -> None:
        """Loads code of a level, from disk or by compiling it now.  With None: quick code, and fast code when that is ready."""
        if level is not None:
            if level not in self._linked:
                self._load(level, self._known(level) or self._made(level))
        elif FAST not in self._linked:
            known = None if self._waiting else self._known(FAST)
            if known:
                self._load(FAST, known)
                return
            if QUICK not in self._linked:  # nobody needed it yet if fast code was requested from a run in Python
                self._load(QUICK, self._known(QUICK) or self._made(QUICK))
            self._compile_apart()

    @property
    def ready(self) -> bool:
        """True if fast code is loaded."""
        return FAST in self._linked

    def request(self) -> None:
        """Loads fast code if it is on disk, else has the helper process compile it; does not wait."""
        if self.ready or self._waiting:
            return
        known = self._known(FAST)
        if known:
            self._load(FAST, known)
            return
        self._compile_apart()

    def _compile_apart(self) -> None:
        """Has the helper process compile fast code, unless it does already."""
        if not self._waiting:
            self._waiting = True
            worker.compile(self)

    def job_text(self) -> str:
        """Called in the worker's thread: what is to be compiled."""
        return self.translation.text

    def improve(self, compiled: bytes) -> None:
        """Called in the worker's thread with the object of fast code: loads it, and points the entry points that follow to it."""
        stored = Stored(_facts(self.translation), compiled)
        native_cache.write(self._name(FAST), stored)
        self._load(FAST, stored)
        with self._lock:
            for entry, task in self._followers.items():
                entry.set_target(self.address(task, None))

    def _name(self, level: int) -> str:
        return name_of(f"image {level}{' with stops' * self.stops}", self.image.fingerprint)

    def _known(self, level: int) -> Stored | None:
        return native_cache.read(self._name(level))

    def _made(self, level: int) -> Stored:
        made = self.translation
        stored = Stored(_facts(made), compile_apart(made.quick if level == QUICK else made.text, level))
        native_cache.write(self._name(level), stored)
        return stored

    def _load(self, level: int, stored: Stored) -> None:
        """Loads an object.  One that is loaded already stays: a run may be inside it or inside the library that it calls."""
        with _LOADING:
            if level in self._linked:
                return
            facts = stored.facts
            linked = Linked(stored.compiled, self._tasks, _addresses(facts["parts"]))
            if not self.points:
                self.points = tuple((code, site, tuple((kind, value) for kind, value in shown))
                                    for code, site, shown in facts["points"])
                self.kept_bytes, self.context_bytes = facts["context"]
                self.counting, self.marks_at = facts["counting"], facts["marks_at"]
            self._linked[level] = linked

    def level_of(self, level: int | None) -> int:
        """The level of the code that an engine of `level` runs; with None the best one that is loaded."""
        return level if level is not None else max(self._linked)

    def address(self, task: int, level: int | None) -> int:
        """The address of the function of a task."""
        return self._linked[self.level_of(level)].address(f"task{task}")

    def follow(self, entry: EntryPoint, task: int, level: int | None) -> None:
        """Points an entry point to the function of a task; with level None, to that of fast code as well when it is loaded."""
        with self._lock:
            if level is None:
                self._followers[entry] = task
            entry.set_target(self.address(task, level))


def _facts(made: Translation) -> dict[str, object]:
    return {"points": made.points, "context": [made.kept_bytes, made.context_bytes], "counting": made.counting,
            "marks_at": made.marks_at,
            "parts": parts_of(made.routines)}


_codes: WeakValueDictionary[tuple[int, bool], Code] = WeakValueDictionary()


def code_of(image: Image, stops: bool = False) -> Code:
    """The code of an image, with `stops` or without; the same object as long as an engine holds it."""
    code = _codes.get((id(image), stops))
    if code is None:
        code = _codes[id(image), stops] = Code(image, stops)
    return code


# --- the library ----------------------------------------------------------------------------------------------------


def _addresses(parts: list[int]) -> dict[str, int]:
    """Loads parts of the library.  Returns the addresses of their routines, and of those of the parts before, by name."""
    return _part(max(parts))[1] if parts else {}


@cache
def _part(number: int) -> tuple[Linked, dict[str, int]]:
    """Loads one part of the library.  Returns the part, and the addresses of its routines and of those of the parts before."""
    before = _part(number - 1)[1] if number else {}
    name = name_of(f"library {number}")
    stored = native_cache.read(name)
    if stored is None:
        stored = Stored({"names": routines_of(number)}, compile_text(module_text(number), FAST))
        native_cache.write(name, stored)
    names = stored.facts["names"]
    linked = Linked(stored.compiled, names, before)
    return linked, before | {routine: linked.address(routine) for routine in names}
