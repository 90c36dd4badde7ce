"""Time travel of a PLC: the state before any recorded scan, and another future from there."""

from __future__ import annotations

import pytest
from trace_rig import image, press

from fbvm.machine.plc import Plc
from fbvm.record.recording.recording import PlcRecording, Recording


@pytest.fixture
def recorded() -> PlcRecording:
    plc = Plc(image())
    recorded = Recording().add("plc", plc)
    for _ in range(100):
        press(plc)
        plc.scan()
    return recorded


def test_the_memory_of_a_scan(recorded: PlcRecording) -> None:
    twin = recorded.at(61)
    assert (twin.scans, twin.now_ns, twin.read("Main.Both[2].b")) == (61, 600_000_000, 30.5)
    assert recorded.plc.read("Main.Both[2].b") == 50.0


def test_a_scan_is_run_again_with_other_inputs(recorded: PlcRecording) -> None:
    twin = recorded.at(61)
    twin.write("CIO 0.00", False)
    twin.scan()
    assert (twin.read("Main.Pump"), recorded.at(62).read("Main.Pump")) == (False, True)


def test_the_same_inputs_give_the_same_again(recorded: PlcRecording) -> None:
    twin = recorded.at(61)
    twin.run(scans=39)
    assert bytes(twin.memory.snapshot()) == bytes(recorded.plc.memory.snapshot())
