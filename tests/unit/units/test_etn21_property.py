"""Whatever a program switches and a network tells: the unit stays in its words and clears every switch in the end."""

from __future__ import annotations

import pytest
from common_unit_tests import answer, events
from depth import times
from etn21_rig import CIO, D, Rig
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fbvm.units.etn21.map import Switch
from fbvm.units.etn21.unit import Etn21, Fault
from fbvm.wire.link import Close, Closed, Event, Peer, Request

n, m = 1500, 30000
STATUS = {("CIO", word) for word in (*range(n + 1, n + 19), n + 23)} | {("D", word) for word in range(m + 1, m + 18)}
SWITCHES = {("CIO", word) for word in (n, *range(n + 19, n + 23))}
RESULTS = {("D", m + 18 + 10 * area + offset) for area in range(8) for offset in (1, 2, 3, 4, 5, 9)}
DATA = {("D", word) for word in range(1000, 1992)} | {("CIO", word) for word in range(100, 1092)}

areas = st.integers(1, 8)
parameters = st.fixed_dictionaries(
    {
        "socket": st.sampled_from([1, 1, 2, 2, 3, 0, 9]),
        "option": st.integers(0, 3),
        "local_port": st.sampled_from([0, 502, 3000]),
        "remote": st.builds(Peer, st.sampled_from(["0.0.0.0", "192.168.250.7"]), st.sampled_from([0, 502])),
        "count": st.sampled_from([0, 1, 12, 1984, 1985]),
        "address": st.sampled_from([(D, 1000, 0), (CIO, 100, 0), (0x30, 0, 0), (D, 1000, 7)]),
        "timeout": st.sampled_from([0, 1, 100]),
    }
)
turns = st.tuples(areas, st.sampled_from(Switch), parameters)
cycles = st.tuples(
    st.lists(turns, max_size=3),
    st.lists(events(st.integers(1, 3)), max_size=3),
    st.booleans(),
    st.booleans(),
    st.sampled_from([10, 10, 10, 200, 80_000]),
)
timings = st.sampled_from(["exact", "real"])
Turns = list[tuple[int, Switch, dict[str, object]]]
Script = list[tuple[Turns, list[Event], bool, bool, int]]
"""Of each cycle: what the program asks, what the network tells, whether it answers, a force close, and the ms that it takes."""


def has_only_cleared_switches(rig: Rig, before: dict[str, bytes]) -> bool:
    old = memoryview(before["CIO"]).cast("H")
    return all(rig.cio[word] & ~old[word] == 0 for area, word in SWITCHES)


@pytest.mark.slow
@settings(max_examples=times(150), deadline=None)
@given(st.lists(cycles, max_size=25), timings, st.integers(0, 9))
def test_any_order_of_switches_and_events(
    script: Script,
    timing: str,
    seed: int,
) -> None:
    rig = Rig(Etn21(timing=timing, seed=seed, faults=[Fault(0x2211, Switch.SEND), Fault(0x0302, socket=2)]))
    asked: list[Request] = []
    for program, told, is_answered, force, cycle_ms in script:
        for area, switch, values in program:
            rig.parameters(area, **values)  # type: ignore[arg-type]
            rig.turn_on(switch, area)
        if force:
            rig.cio[n] |= 1 << 2
        before = rig.memory.snapshot()
        replies = answer(asked) if is_answered else []
        asked = [] if is_answered else asked
        rig.cycle_ns = cycle_ms * 1_000_000
        asked += rig.scan(*told, *replies)
        assert set(rig.memory.differences(before)) <= STATUS | SWITCHES | RESULTS | DATA
        assert has_only_cleared_switches(rig, before)
    settle(rig, asked)
    assert [rig.cio[n + 19 + word] for word in range(4)] == [0] * 4
    assert rig.cio[n] & 4 == 0
    assert [rig.cio[n + word] & 0xF for word in range(1, 17)] == [0] * 16


@pytest.mark.slow
@settings(max_examples=times(60), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(cycles, max_size=25), timings)
def test_the_unit_does_the_same_without_machine_code(
    monkeypatch: pytest.MonkeyPatch,
    script: Script,
    timing: str,
) -> None:
    rigs = [Rig(Etn21(timing=timing, faults=[Fault(0x2211, Switch.SEND)]))]
    with monkeypatch.context() as patched:
        patched.setattr("fbvm.engine.native.engine.available", lambda: False)
        rigs.append(Rig(Etn21(timing=timing, faults=[Fault(0x2211, Switch.SEND)])))
    assert rigs[1].unit.exchanged.processor.machine is None
    for program, told, _, force, cycle_ms in script:
        asked = [turn(rig, program, told, force, cycle_ms) for rig in rigs]
        assert asked[0] == asked[1]
        assert rigs[0].memory.snapshot() == rigs[1].memory.snapshot()
        assert (rigs[0].unit.wake_ns, rigs[0].unit.changed_words) == (rigs[1].unit.wake_ns, rigs[1].unit.changed_words)


@pytest.mark.slow
@settings(max_examples=times(60), deadline=None)
@given(st.lists(cycles, min_size=1, max_size=25), st.lists(cycles, min_size=1, max_size=25), timings)
def test_after_a_reset_a_unit_goes_on_as_one_that_was_never_used(
    before: Script,
    after: Script,
    timing: str,
) -> None:
    """When the network has answered its closes, at the same time, and with the same delays where these are drawn."""
    used, new = (Rig(Etn21(timing=timing, faults=[Fault(0x2211, socket=7)])) for _ in range(2))
    asked: list[Request] = []
    closes: list[Request] = []
    for program, told, is_answered, force, cycle_ms in before:
        asked = turn(used, program, told + (answer(asked) if is_answered else []), force, cycle_ms)
        closes += [request for request in asked if isinstance(request, Close)]
    asked = used.unit.reset(used.memory)
    assert {type(request) for request in asked} <= {Close}
    new.now_ns, new.cycle_ns = used.now_ns, used.cycle_ns
    assert used.scan(*answer([*closes, *asked])) == new.scan() == []
    assert [used.cio[n + 1 : n + 24].tolist(), used.d[m + 1 : m + 18].tolist()] == [
        new.cio[n + 1 : n + 24].tolist(), new.d[m + 1 : m + 18].tolist()]  # fmt: skip
    for words in (used.cio, used.d):
        words[:] = memoryview(bytes(2 * len(words))).cast("H")
    used.cio[n + 17], used.cio[n + 18] = new.cio[n + 17], new.cio[n + 18]
    assert used.unit.exchanged and new.unit.exchanged
    used.unit.exchanged.processor.view("ETN21_Random")[0] = new.unit.exchanged.processor.view("ETN21_Random")[0]
    for program, told, is_answered, force, cycle_ms in after:
        told = told + (answer(asked) if is_answered else [])
        asked = turn(used, program, told, force, cycle_ms)
        assert turn(new, program, told, force, cycle_ms) == asked
        assert used.memory.snapshot() == new.memory.snapshot()
        assert used.unit.wake_ns == new.unit.wake_ns


def turn(
    rig: Rig, program: Turns, told: list[Event], force: bool, cycle_ms: int
) -> list[Request]:
    """One cycle: what the program does, then a refresh in which the network tells something."""
    for area, switch, values in program:
        rig.parameters(area, **values)  # type: ignore[arg-type]
        rig.turn_on(switch, area)
    if force:
        rig.cio[n] |= 1 << 2
    rig.cycle_ns = cycle_ms * 1_000_000
    return rig.scan(*told)


def settle(rig: Rig, asked: list[Request]) -> None:
    """A program that closes what is left, and a network that answers every close."""
    rig.cycle_ns = 1_000_000_000
    for cycle in range(60):
        if cycle % 20 == 0:
            rig.cio[n] |= 1 << 2
        closes = [Closed(request.channel) for request in asked if isinstance(request, Close)]
        asked = rig.scan(*closes)
