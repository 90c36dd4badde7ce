"""Each fast path of a scan leaves what the plain scan leaves, to the bit; docs/explanation/fast-paths.md lists them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from rows import first_quick
from test_many_scans import IMAGE
from test_units_in_code import MS, Rig, image, way

from fbvm import Plc
from fbvm.engine.native import engine as native
from fbvm.machine.fast.paths import ProgramAlone
from fbvm.machine.fast.units_in_code import WithUnits

if not native.available():
    pytest.skip("llvmlite is not installed", allow_module_level=True)

HOUSE = Path(__file__).resolve().parents[3]
PAGE = HOUSE / "docs" / "explanation" / "fast-paths.md"


def plain(plc: Plc) -> Plc:
    """The same PLC on the plain path: somebody looks inside its scans."""
    plc.phases.append(lambda plc, phase: None)
    return plc


@pytest.mark.parametrize("cycle_ns", first_quick([10 * MS, 1, 33 * MS, 1000 * MS]))
def test_the_program_alone_scan_by_scan(cycle_ns: int) -> None:
    fast, slow = Plc(IMAGE, cycle_ns, engine="native"), plain(Plc(IMAGE, cycle_ns, engine="native"))
    for _ in range(300):
        assert fast.scan() == slow.scan()
        assert bytes(fast.memory.u8) == bytes(slow.memory.u8) and fast.due_ns == slow.due_ns
    assert isinstance(fast.fast_path(), ProgramAlone) and slow.fast_path() is None


CASES = [((0,), 0, True), ((0,), 0, False), ((MS, 0), 300_000, True), ((7000, 0), 10_000, False), ((MS,), 5000, False)]


@pytest.mark.slow
@pytest.mark.parametrize(("delays_ns", "latency_ns", "is_inside"), first_quick(CASES, 2))
def test_a_burst_is_its_scans_one_by_one(delays_ns: tuple[int, ...], latency_ns: int, is_inside: bool) -> None:
    """The plain PLC does what was left out of the last burst when the next one begins: it has waited before the refresh."""
    fast = Rig(image(2), delays_ns, latency_ns, is_inside=is_inside, virtual_time=False, is_told=False)
    slow = Rig(image(2), delays_ns, latency_ns, virtual_time=False)
    plain(slow.plc)
    for _ in range(2):
        now_ns = fast.clock()
        fast.plc.scan(now_ns)
        slow.plc.scan(now_ns)
    scans = 0
    for number in range(80):
        fast.clock.now_ns += (200_000, 1000, 20_000)[number % 3]
        now_ns, waits = fast.clock.now_ns, fast.plc._io.skipped > 0
        for network in (*fast.networks, *slow.networks):
            network.serve(now_ns)
        times = fast.plc.scan_at_once(16, now_ns, fast.time)
        if waits:
            slow.plc._io.refresh(times[0])
        for time_ns in times:
            slow.plc.scan(time_ns)
        assert fast.state == slow.state
        scans += len(times)
    assert isinstance(way(fast), WithUnits if is_inside else ProgramAlone)
    assert scans > 80 and fast.plc.read("D20001") > 3  # type: ignore[operator]


def test_the_page_names_tests_that_there_are() -> None:
    named = re.findall(r"`(tests/[\w/]+\.py)::(\w+)`", PAGE.read_text(encoding="utf-8"))
    assert len(named) > 8
    assert [(file, test) for file, test in named if f"def {test}(" not in (HOUSE / file).read_text(encoding="utf-8")] == []
