"""A unit's own processor: its program, its memory, its variables."""

from __future__ import annotations

from copy import deepcopy
from pathlib import Path

import pytest

from fbvm.base.areas import AREAS
from fbvm.engine.native import engine as native
from fbvm.processor import processor as processor_module
from fbvm.processor.processor import OwnProcessor, contract, prepare, processor
from fbvm.units.contract import Processor
from fbvm.watch.paths import UnknownPlace

TEXT = """
VAR_GLOBAL
    In : ARRAY[0..3] OF WORD; Out : ARRAY[0..3] OF WORD := [7, 3(0)]; Wake : LINT := 12; Runs : UDINT;
    Fifth AT %D5 : WORD; Divisor : INT := 2; Some : BOOL; OneBit AT %D6.3 : BOOL;
END_VAR
PROGRAM Own
VAR i : INT; late : TON; END_VAR
    Runs := Runs + 1;
    FOR i := 0 TO 3 DO Out[i] := UINT_TO_WORD(WORD_TO_UINT(In[i]) / INT_TO_UINT(Divisor)); END_FOR;
    late(IN := TRUE, PT := T#3ms, Q => Some);
    Fifth := Out[1];
END_PROGRAM
"""


@pytest.fixture(params=[True, False], ids=["native", "python"])
def own(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> OwnProcessor:
    if request.param and not native.available():
        pytest.skip("llvmlite is not installed")
    if not request.param:
        monkeypatch.setattr(native, "available", lambda: False)
    found = processor(TEXT)
    assert (found.machine is not None) is request.param
    return found


def test_it_runs_its_program_over_a_memory_of_its_own(own: OwnProcessor) -> None:
    unit: Processor = own
    assert list(unit.view("Out")) == [7, 0, 0, 0] and unit.view("Wake")[0] == 12
    unit.view("In")[1] = 0xFFFF
    for ms in range(4):
        assert unit.view("Some")[0] == 0
        unit.run(ms * 1_000_000)
    assert unit.view("Out").tolist() == [0, 0x7FFF, 0, 0] and unit.view("Some")[0] == 1
    assert unit.view("Runs")[0] == 4
    assert unit.contract.offset("Fifth") == AREAS["D"].offset + 10 and own.memory.words("D")[5] == 0x7FFF


def test_each_has_its_own_memory_and_a_copy_the_same_contents(own: OwnProcessor) -> None:
    own.run(5)
    for other in (own.copy(), deepcopy(own)):
        assert bytes(other.memory.u8) == bytes(own.memory.u8) and other.contract is own.contract
        other.run(6)
        assert (other.view("Runs")[0], own.view("Runs")[0]) == (2, 1)
    assert processor(TEXT).view("Runs")[0] == 0


def test_a_trap_is_a_fault_of_ours(own: OwnProcessor) -> None:
    own.view("Divisor")[0] = 0
    with pytest.raises(RuntimeError, match=r"R0101 unit\.st:9:\d+ in Own: 0 divided by 0"):
        own.run(0)
    own.view("Divisor")[0] = 1
    own.run(0)


def test_what_it_does_not_have(own: OwnProcessor) -> None:
    with pytest.raises(UnknownPlace):
        own.view("Nothing")
    with pytest.raises(ValueError, match="bytes of its own"):
        own.contract.offset("OneBit")


@pytest.mark.slow
def test_a_program_is_compiled_once_and_then_read_from_the_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FBVM_CACHE", str(tmp_path))
    contract.cache_clear()
    made = contract(TEXT)
    assert made.image.tasks and list(tmp_path.rglob("*"))
    monkeypatch.setattr(processor_module, "compile_sources", None)
    contract.cache_clear()
    again = contract(TEXT)
    assert again is not made and again.image.initial == made.image.initial and again.offset("Runs") == made.offset("Runs")


@pytest.mark.slow
def test_what_was_prepared_is_not_compiled_again(monkeypatch: pytest.MonkeyPatch) -> None:
    text = f"{TEXT}// prepared\n"
    prepare(text)
    monkeypatch.setattr(processor_module, "_compiled", None)
    assert list(processor(text).view("Out")) == [7, 0, 0, 0]


@pytest.mark.parametrize(("text", "said"), [
    ("PROGRAM P VAR a : INT; END_VAR a := b; END_PROGRAM", "unit.st:1"), ("VAR_GLOBAL a : INT; END_VAR", "one PROGRAM"),
])  # fmt: skip
def test_a_text_that_is_no_program(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        processor(text)
