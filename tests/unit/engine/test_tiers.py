"""A run begins in Python and goes on as machine code, and nobody can tell."""

from __future__ import annotations

import pytest

from fbvm.base.memory import Memory
from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.engine.allowance import Allowance
from fbvm.engine.choice import tiers
from fbvm.engine.choice.tiers import TieredEngine, engine_for
from fbvm.engine.native import engine as native
from fbvm.engine.native.code import code_of
from fbvm.engine.python.engine import PythonEngine
from fbvm.machine.plc import Plc

TEXT = """
PROGRAM Main
VAR i : INT; sum : DINT; t : TON; x : REAL; s : STRING; END_VAR
FOR i := 1 TO 100 DO sum := sum + i; END_FOR
t(IN := sum MOD 2 = 0, PT := T#30ms);
x := x * 0.5 + DINT_TO_REAL(sum);
s := DINT_TO_STRING(sum);
END_PROGRAM
"""
needs_native = pytest.mark.skipif(not native.available(), reason="llvmlite is not installed")


def image() -> Image:
    made = compile_text(TEXT).image
    assert made is not None
    return made


@pytest.mark.slow
@needs_native
def test_a_run_changes_to_machine_code_and_its_memory_does_not_tell(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tiers, "STATEMENTS_TO_PAY", 500)
    code = image()
    auto, python = Plc(code), Plc(code, engine="python")
    assert isinstance(auto.engine, TieredEngine)
    changed = 0
    for number in range(60):
        if number == 20:
            kept = code_of(code)
            kept.prepare(2)  # as if the helper process had answered
        auto.scan()
        python.scan()
        assert bytes(auto.memory.u8) == bytes(python.memory.u8)
        changed += auto.engine.native
    assert changed >= 39


@needs_native
def test_python_in_place_of_a_block_brings_a_run_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tiers, "STATEMENTS_TO_PAY", 1)
    code = image()
    kept = code_of(code)
    kept.prepare(2)
    plc = Plc(code)
    assert isinstance(plc.engine, TieredEngine)
    for _ in range(3):
        plc.scan()
    assert plc.engine.native
    calls: list[int] = []
    number = next(n for n, body in enumerate(code.bodies) if body.name == "TON")
    tiers.python_of(plc.engine).substitute(number, calls.append)
    plc.scan()
    assert len(calls) == 1 and not plc.engine.native


@pytest.mark.slow
@needs_native
def test_machine_code_asks_whom_the_run_has_asked_before(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tiers, "STATEMENTS_TO_PAY", 1)
    code = image()
    code_of(code).prepare(2)
    plc, asked = Plc(code), list[bool]()
    engine = plc.engine
    assert isinstance(engine, TieredEngine)

    def ask(left: int) -> int:
        asked.append(engine.native)
        return 0

    engine.allowance = Allowance(plc.budget - 10, ask)
    for _ in range(3):
        plc.scan()
    assert asked == [False, True], "once, after which the whole budget may be used up"


def test_choices() -> None:
    code = image()
    assert isinstance(Plc(code, engine="python").engine, PythonEngine)
    assert isinstance(Plc(code, observed=True).engine, PythonEngine)
    with pytest.raises(ValueError, match="no engine 'quick'"):
        Plc(code, engine="quick")
    with pytest.raises(ValueError, match="observe with the python engine"):
        Plc(code, engine="native", observed=True)


def test_without_llvmlite_auto_is_python_and_native_says_what_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(native, "available", lambda: False)
    code = image()
    memory = Plc(code).memory
    assert isinstance(engine_for(code, memory), PythonEngine)
    with pytest.raises(ValueError, match="llvmlite, which is not installed"):
        engine_for(code, memory, "native")


@needs_native
def test_a_large_program_begins_as_machine_code_and_makes_python_when_it_is_needed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tiers, "LARGE_PROGRAM", 1)
    monkeypatch.setattr(tiers, "STATEMENTS_TO_PAY", 500)
    made: list[Image] = []
    code = image()
    kept = code_of(code)
    kept.prepare(2)
    auto, python = Plc(code), Plc(code, engine="python")

    class Counted(PythonEngine):
        def __init__(self, image: Image, memory: Memory) -> None:
            made.append(image)
            super().__init__(image, memory)

    monkeypatch.setattr(tiers, "PythonEngine", Counted)
    assert isinstance(auto.engine, TieredEngine)
    assert not auto.engine.native
    for _ in range(30):
        auto.scan()
        python.scan()
        assert bytes(auto.memory.u8) == bytes(python.memory.u8)
    assert auto.engine.native
    auto.run(scans=30)
    assert (made, auto.scans) == ([], 60)
    main = [body.name for body in code.bodies].index("Main")
    auto.engine.python.substitute(main, lambda base: None)
    before = auto.read("Main.sum")
    auto.scan()
    assert (made, auto.read("Main.sum"), auto.engine.native) == ([code], before, False)
