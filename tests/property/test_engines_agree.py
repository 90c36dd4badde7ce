"""The same image on every build of every engine: memory to the bit and traps are equal after every run.

The tests of the Python engine are executed once more, each image of theirs on machine code at both levels as well."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent.parent / "unit"))
import hand_image
import test_engine_expressions as expressions
import test_engine_limits as limits
import test_engine_statements as statements

from fbvm.code.operations import Block
from fbvm.engine import native

if not native.available():
    pytest.skip("llvmlite is not installed", allow_module_level=True)

LEVELS = (0, 2)
_python = hand_image.execute


def execute(*codes: Block, before: dict[int, bytes] | None = None, budget: int = 100_000) -> Any:
    """What `hand_image.execute` does, and the same on machine code, which must agree to the bit."""
    rig = _python(*codes, before=before, budget=budget)
    program = hand_image.image(*codes)
    for level in LEVELS:
        memory = hand_image.power_on(program, before, budget)
        trap = native.NativeEngine(program, memory, level).run(0)
        assert repr(trap) == repr(rig.trap), f"level {level}"
        assert bytes(memory.snapshot()) == bytes(rig.memory.snapshot()), f"level {level}"
    return rig


@pytest.fixture(autouse=True)
def _every_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (hand_image, expressions, limits, statements):
        monkeypatch.setattr(module, "execute", execute)


def _again(module: Any) -> None:
    """Take over the tests of a module that execute images."""
    for name, test in vars(module).items():
        if name.startswith("test_") and callable(test):
            globals()[f"{name}_on_every_engine"] = test


for _module in (expressions, limits, statements):
    _again(_module)
