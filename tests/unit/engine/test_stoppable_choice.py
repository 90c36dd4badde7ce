"""Which engine does runs that stop: machine code only if it was chosen, nothing stands in place of a body, and it is there."""

from __future__ import annotations

import pytest
from hand_image import at, const, image, power_on, store
from rows import each_of

from fbvm.engine.choice.stoppable import StoppableEngine
from fbvm.engine.native import engine as native
from fbvm.engine.stops import StopTable


@pytest.mark.slow
@pytest.mark.skipif(not native.available(), reason="llvmlite is not installed")
@each_of(("choice", "substituted", "available", "compiles", "at_once"), (
    ("python", False, True, False, False), ("auto", False, True, True, False), ("native", False, True, True, True),
    ("native", True, True, False, False), ("auto", True, True, False, False), ("python", True, True, False, False),
    ("auto", False, False, False, False)))  # fmt: skip
def test_machine_code_is_there(choice: str, substituted: bool, available: bool, compiles: bool, at_once: bool) -> None:
    program = image((store("i64", 0, const("i64", 7)),))
    memory = power_on(program)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(native, "available", lambda: available)
        made = StoppableEngine(program, memory, StopTable(memory, len(program.sites)), choice,
                               {0: lambda base: None} if substituted else {})  # fmt: skip
    assert (made._code is not None, made.native) == (compiles, at_once)
    assert made.run(0) is None
    assert memory.read(at(0)[1], "i64") == (0 if substituted else 7)
