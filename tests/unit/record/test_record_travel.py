"""Time travel of a PLC: the state after any remembered scan, and another future from there."""

from __future__ import annotations

import pytest
from trace_rig import image, press

from fbvm.machine.plc import Plc


@pytest.fixture
def plc() -> Plc:
    plc = Plc(image())
    plc.remember(50)
    for _ in range(100):
        press(plc)
        plc.scan()
    return plc


def test_the_memory_of_a_scan(plc: Plc) -> None:
    twin = plc.at(60)
    assert (twin.scans, twin.now_ns, twin.read("Main.Both[2].b")) == (61, 600_000_000, 30.5)
    assert plc.read("Main.Both[2].b") == 50.0


def test_a_scan_is_run_again_with_other_inputs(plc: Plc) -> None:
    twin = plc.at(60)
    twin.write("CIO 0.00", False)
    twin.scan()
    assert (twin.read("Main.Pump"), plc.at(61).read("Main.Pump")) == (False, True)


def test_the_same_inputs_give_the_same_again(plc: Plc) -> None:
    twin = plc.at(60)
    twin.run(scans=39)
    assert bytes(twin.memory.snapshot()) == bytes(plc.memory.snapshot())


def test_only_so_many_are_kept(plc: Plc) -> None:
    assert plc.at(50).scans == 51
    with pytest.raises(ValueError, match="scan 49 is not remembered; scans 50 to 99 are"):
        plc.at(49)
    with pytest.raises(ValueError, match=r"none is: see Plc\.remember"):
        Plc(image()).at(0)
