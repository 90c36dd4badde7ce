"""The same image on every build of every engine: memory to the bit and traps are equal after every run.

The tests of the Python engine and the programs of the language corpus are executed once more, each image on machine code
at both levels as well."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial, wraps
from itertools import groupby
from typing import Any, NamedTuple

import hand_image
import lang_check
import lang_corpus
import pytest
import test_engine_expressions as expressions
import test_engine_limits as limits
import test_engine_statements as statements
from rows import go_through

from fbvm.base import cache
from fbvm.code.image import Image
from fbvm.code.operations import Block
from fbvm.engine.native import engine as native
from fbvm.machine.plc import Plc
from fbvm.syntax.st.tables import tables as grammar

if not native.available():
    pytest.skip("llvmlite is not installed", allow_module_level=True)

pytestmark = pytest.mark.slow

LEVELS = (0, 2)
KEPT: dict[int, native.NativeEngine] = {}
"""By level the engine of the last `program`, which keeps its machine code for the next run."""
_python = hand_image.execute


class Ran(NamedTuple):
    """What the Python engine has made of one code: the trap as text, and the memory."""

    code: Block
    before: dict[int, bytes] | None
    budget: int
    trap: str
    memory: bytes


TOGETHER = 50
"""Codes of one image: most of the time for a small module of machine code is the module's, not the code's."""
waiting: list[Ran] = []
"""What machine code has still to do as well."""


def execute_later(*codes: Block, before: dict[int, bytes] | None = None, budget: int = 100_000) -> Any:
    """What `hand_image.execute` does; `compare_waiting` does the same on machine code."""
    [code] = codes
    rig = _python(code, before=before, budget=budget)
    waiting.append(Ran(code, before, budget, repr(rig.trap), bytes(rig.memory.snapshot())))
    return rig


def compare_waiting() -> None:
    """Each code that waits is the body of one program; all programs have their instance at the same place, as one has alone."""
    while waiting:
        runs, waiting[:TOGETHER] = waiting[:TOGETHER], []
        made = hand_image.image(*(ran.code for ran in runs))
        offset = made.tasks[0].programs[0].offset
        tasks = tuple(replace(task, programs=(replace(task.programs[0], offset=offset),)) for task in made.tasks)
        program = replace(made, tasks=tasks, layout=hand_image.image(()).layout)
        for level in LEVELS:
            kept = native.NativeEngine(program, hand_image.power_on(program), level)  # machine code stays while an engine has it
            for number, ran in enumerate(runs):
                memory = hand_image.power_on(program, ran.before, ran.budget)
                trap = native.NativeEngine(program, memory, level).run(number)
                assert repr(trap) == ran.trap, f"level {level}: {ran.code}"
                assert bytes(memory.snapshot()) == ran.memory, f"level {level}: {ran.code}"
            del kept


def execute(*codes: Block, before: dict[int, bytes] | None = None, budget: int = 100_000, program: Image | None = None) -> Any:
    """What `hand_image.execute` does, and the same on machine code, which must agree to the bit."""
    keep = program is not None
    program = program or hand_image.image(*codes)
    rig = _python(before=before, budget=budget, program=program)
    if len(program.tasks) > 1:
        program = replace(program, tasks=program.tasks[:1])  # the others would make the same bodies once more
    for level in LEVELS:
        memory = hand_image.power_on(program, before, budget)
        engine = native.NativeEngine(program, memory, level)
        trap = engine.run(0)
        if keep:
            KEPT[level] = engine
        assert repr(trap) == repr(rig.trap), f"level {level}"
        assert bytes(memory.snapshot()) == bytes(rig.memory.snapshot()), f"level {level}"
    return rig


@pytest.fixture(autouse=True)
def _every_engine(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    for module in (limits, statements):
        monkeypatch.setattr(module, "execute", execute)
    for module in (hand_image, expressions):
        monkeypatch.setattr(module, "execute", execute_later)
    grammar("st")  # which is kept
    cache.switch(False)  # thousands of images that nobody runs again
    yield
    cache.switch(True)


def _again(module: Any) -> None:
    """Take over the tests of a module that execute images."""
    for name, test in vars(module).items():
        if name.startswith("test_") and callable(test):
            globals()[f"{name}_on_every_engine"] = on_every_engine(test)


def on_every_engine(test: Callable[..., None]) -> Callable[..., None]:
    @wraps(test)
    def both(**fixtures: Any) -> None:
        waiting.clear()
        test(**fixtures)
        compare_waiting()

    return both


for _module in (expressions, limits, statements):
    _again(_module)


# --- the language corpus --------------------------------------------------------------------------------------------


def build(level: int) -> Any:
    """What makes a PLC that executes an image as machine code of a level."""

    def make(image: Image, cycle_ns: int) -> Plc:
        plc = Plc(image, cycle_ns, budget=lang_check.BUDGET)
        plc.engine = native.NativeEngine(image, plc.memory, level)
        return plc

    return make


RUNNING = groupby((program for program in lang_corpus.programs() if program.runs), lambda program: program.name)
"""The programs of each file that run."""


@pytest.mark.parametrize("file", [pytest.param(list(inside), id=name) for name, inside in RUNNING])
def test_programs(file: list[lang_corpus.Program]) -> None:
    builds = lang_check.BUILDS | {f"native {level}": build(level) for level in LEVELS}
    go_through((f"{p.name}:{p.line} {p.title}", partial(lang_check.check, p, builds)) for p in file)
