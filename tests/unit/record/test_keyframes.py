"""Keyframes of a recording: packed beside an earlier one, and what does the scans behind them again."""

from __future__ import annotations

from typing import Any

import pytest

from fbvm import Etn21, Plc, compile_text
from fbvm.code.image import Image
from fbvm.record.recording import replay
from fbvm.record.recording.chunks import Chunk, PackedSnapshot, ScanInputs, UnitKeyframe
from fbvm.record.recording.recording import Recording
from fbvm.record.recording.scan_codec import WRITES, decode_inputs, encode_inputs
from fbvm.units.contract import UnitState


def image_of(size: int) -> Image:
    image = compile_text(f"PROGRAM Main VAR n : UDINT; big : ARRAY[0..{size}] OF UDINT; END_VAR n := n + 1; END_PROGRAM").image
    assert image is not None
    return image


@pytest.fixture(scope="module")
def image() -> Image:
    return image_of(4000)


def keyframe(plc: Plc) -> Chunk:
    plc.scan()
    return Chunk(plc.snapshot(), [], plc.budget, True)


def test_scans_that_python_did_are_not_done_again_by_machine_code(image: Image) -> None:
    plc = Plc(image)
    kept = Recording().add("plc", plc)
    plc.run(scans=3)
    assert plc.engine.machine is None
    assert kept.at(2).engine_choice == plc.engine_choice == "auto"


@pytest.mark.parametrize("name", WRITES)
def test_inputs_of_each_kind_alone_are_kept(name: str) -> None:
    inputs = ScanInputs(7)
    setattr(inputs, name, [(3, b"\1\2")])
    assert decode_inputs(encode_inputs(inputs), 100) == inputs


def test_scans_of_machine_code_are_done_again_by_machine_code(image: Image, monkeypatch: pytest.MonkeyPatch) -> None:
    """Since Python takes too long for as many."""
    plc = Plc(image)
    kept = Recording().add("plc", plc)
    plc.run(scans=3)
    kept.chunk(2).machine = True
    made: list[object] = []
    monkeypatch.setattr(replay.native, "available", lambda: True)

    def again(image: Image, cycle_ns: int, *, budget: int, engine: str) -> Plc:
        made.append(engine)
        return Plc(image, cycle_ns, budget=budget, engine="python")

    monkeypatch.setattr(replay, "Plc", again)
    replay.Replay(kept, 2)
    assert made == ["native"]


def test_a_keyframe_is_packed_beside_an_earlier_one(image: Image) -> None:
    plc = Plc(image)
    first, second = keyframe(plc), keyframe(plc)
    alone, pages = second.size_bytes(None), second.state.memory.pages
    second.pack(first)
    assert second.size_bytes(first) < alone / 10
    assert second.state.memory.pages == pages


def test_a_keyframe_takes_the_pages_that_have_changed_beside_an_earlier_one(image: Image) -> None:
    """Each of 4096 bytes; the array of 16004 bytes has four of its own, and n one."""
    plc = Plc(image)
    first, same = keyframe(plc), keyframe(plc)
    for place in (1500, 3000):
        plc.write(f"Main.big[{place}]", 1)
    changed = keyframe(plc)
    assert changed.size_bytes(same) - same.size_bytes(first) == 2 * 4096


def test_of_units_only_those_have_a_memory_to_be_packed_whose_processors_are_on(image: Image) -> None:
    plc = Plc(image)
    units: list[Any] = [Etn21(0, "192.168.250.21"), Etn21(1, "192.168.250.22"), Etn21(2, "192.168.250.23")]

    def with_units() -> Chunk:
        frame = keyframe(plc)
        states = [None, UnitState(None, (1,)), UnitState(frame.state.memory, (2,))]
        frame.units = [UnitKeyframe(unit, state) for unit, state in zip(units, states, strict=True)]
        return frame

    first, second = with_units(), with_units()
    whole = second.memories
    assert whole == [second.state.memory] * 2
    second.pack(first)
    assert [frame.unit for frame in second.units] == units and [frame.state and frame.state.other for frame in second.units] == [
        None, (1,), (2,)]  # fmt: skip
    assert [memory.pages for memory in second.memories] == [memory.pages for memory in whole]
    assert all(isinstance(memory, PackedSnapshot) for memory in second.memories)


def test_a_keyframe_of_another_size_of_memory_stays_as_it_is(image: Image) -> None:
    one = keyframe(Plc(image))
    whole = one.state.memory
    one.pack(keyframe(Plc(image_of(1))))
    assert one.state.memory is whole
