"""Whatever network, server and program do: a destination is either right or untouched, and nobody is stuck."""

from __future__ import annotations

import pytest
from depth import times
from hypothesis import given, settings
from hypothesis import strategies as st
from mtcp_rig import SERVER, Rig

from fbvm.machine.plc import Mode
from fbvm.net.faults import Fault
from fbvm.net.peers import Action, Fin, Leave, Reset, Say

READS = {
    "a": "Fn03(Register_Address := 10, Register_Qty := 2, RespData_DM := 100)",
    "b": "Fn03(Register_Address := 20, Register_Qty := 2, RespData_DM := 110)",
    "c": "Fn04(Register_Address := 30, Register_Qty := 5, RespData_DM := 120)",
    "w": "Fn10(Register_Address := 40, Register_Qty := 2, DataAddress_DM := 130)",
}
DOCUMENTED = {0x0045, 0x004B, 0x0080, 0x0081, 0x110C, 0x2210, 0x220F, 0x0020, 0x004A}
TIMINGS = st.sampled_from(["exact", "real"])
SEEDS = st.integers(0, 10**6)


def prepared(timing: str, seed: int, wired: bool = True) -> Rig:
    rig = Rig(timing=timing, seed=seed, wired=wired, **READS)  # type: ignore[arg-type]
    for register in range(50):
        rig.server.holding_registers[register] = 1000 + register
        rig.server.input_registers[register] = 2000 + register
    rig.fill(130, [1, 2])
    for name in READS:
        rig.set(f"{name}.Reply_Time", 500_000_000)
    return rig


def destinations(rig: Rig) -> list[list[int]]:
    return [rig.words(100, 2), rig.words(110, 2), rig.words(120, 5)]


RIGHT = [[1010, 1011], [1020, 1021], [2030, 2031, 2032, 2033, 2034]]
UNTOUCHED = [[0] * 2, [0] * 2, [0] * 5]


def nothing_wrong(rig: Rig) -> None:
    """Each destination is whole, and nothing else has changed."""
    for got, right, untouched in zip(destinations(rig), RIGHT, UNTOUCHED, strict=True):
        assert got in (right, untouched)
    words = rig.all_words()
    assert not any(words[:100]) and not any(words[132:])
    for name in READS:
        assert rig.get(f"{name}.Error_Code") in {0, *DOCUMENTED}


def works_by_itself(rig: Rig) -> None:
    """With a good network and a good server everything is right again."""
    rig.network.faults.clear()
    rig.peer.reply = lambda frame: [Say(frame)]
    for name in READS:
        rig.set(f"{name}_EN", True)
        rig.set(f"{name}_Cmd", False)
        rig.set(f"{name}.Reply_Time", 5_000_000_000)
    rig.set("Connect", True)
    busy = " OR ".join(f"Main.{name}.Exchange.State <> 0" for name in READS)
    rig.scan(200)
    rig.run_until(f"Main.conn.ENO AND NOT ({busy})", 100)
    rig.scan(50)
    rig.command(*READS, max_s=20)
    assert {rig.result(name)[1] for name in READS} == {""}
    assert destinations(rig) == RIGHT
    assert list(rig.server.holding_registers[40:42]) == [1, 2]


@pytest.mark.slow
@given(TIMINGS, SEEDS, st.integers(1, 40), st.integers(0, 30_000_000))
@settings(max_examples=times(12), deadline=None)
def test_any_cut_of_the_stream(timing: str, seed: int, segment_bytes: int, gap_ns: int) -> None:
    rig = prepared(timing, seed)
    for name in READS:
        rig.set(f"{name}.Reply_Time", 5_000_000_000)
    rig.network.faults.append(Fault(segment_bytes=segment_bytes, random_cut=True, gap_ns=gap_ns))
    rig.connect()
    rig.command(*READS, max_s=20)
    assert {rig.result(name) for name in READS} == {(1, "")}
    assert destinations(rig) == RIGHT


ENDS = st.sampled_from([[], [], [Fin()], [Leave()], [Reset()]])


@pytest.mark.slow
@given(TIMINGS, SEEDS, st.lists(st.tuples(st.binary(max_size=20), st.integers(0, 20), ENDS), min_size=1, max_size=6))
@settings(max_examples=times(40), deadline=None)
def test_a_server_that_says_anything(timing: str, seed: int, says: list[tuple[bytes, int, list[Action]]]) -> None:
    """Some bytes of its own, a part of the right reply, and perhaps the end of the connection."""
    rig = prepared(timing, seed)
    left = list(says)

    def reply(frame: bytes) -> list[Action]:
        if not left:
            return [Say(frame)]
        before, kept, end = left.pop()
        told = before + frame[:kept]
        return [*([Say(told)] if told else []), *end]

    rig.peer.reply = reply
    rig.connect()
    for _ in says:
        for name in READS:
            rig.set(f"{name}_Cmd", True)
        rig.scan(60)
        for name in READS:
            rig.set(f"{name}_Cmd", False)
        rig.scan(60)
        nothing_wrong(rig)
    works_by_itself(rig)


PINS = [*(f"{name}_EN" for name in READS), *(f"{name}_Cmd" for name in READS), "Connect"]
CHANGES = st.lists(st.tuples(st.integers(0, 12), st.sampled_from(PINS)), min_size=3, max_size=40)


@pytest.mark.slow
@given(TIMINGS, SEEDS, st.booleans(), CHANGES)
@settings(max_examples=times(50), deadline=None)
def test_any_play_on_the_pins(timing: str, seed: int, wired: bool, changes: list[tuple[int, str]]) -> None:
    rig = prepared(timing, seed, wired)
    rig.connect()
    for scans, pin in changes:
        rig.set(pin, not rig.get(pin))
        rig.scan(scans)
        nothing_wrong(rig)
    works_by_itself(rig)
    heard = len(rig.peer.received)
    assert sum(rig.result(name)[0] for name in READS) <= heard


EVENTS = st.lists(st.tuples(st.integers(1, 60), st.sampled_from(["gone", "back", "cut", "reset"])), max_size=10)


@pytest.mark.slow
@given(TIMINGS, SEEDS, EVENTS)
@settings(max_examples=times(40), deadline=None)
def test_a_network_that_fails_at_any_scan(timing: str, seed: int, events: list[tuple[int, str]]) -> None:
    rig = prepared(timing, seed)
    rig.connect()
    for scans, event in events:
        for name in READS:
            rig.set(f"{name}_Cmd", not rig.get(f"{name}_Cmd"))
        if event == "gone":
            rig.network.remove(SERVER)
        elif event == "cut":
            rig.network.faults[:] = [Fault(silent=True)]
        elif event == "reset":
            rig.peer.reply = lambda frame: [Say(frame[:9]), Reset()]
        else:
            rig.network.faults.clear()
            rig.network.place(SERVER, rig.peer)
            rig.peer.reply = lambda frame: [Say(frame)]
        rig.scan(scans)
        nothing_wrong(rig)
    rig.network.place(SERVER, rig.peer)
    works_by_itself(rig)


@pytest.mark.slow
@given(TIMINGS, SEEDS, st.integers(0, 60), st.sampled_from(["mode", "unit", "power", "force-close"]))
@settings(max_examples=times(40), deadline=None)
def test_a_restart_of_anything_at_any_scan(timing: str, seed: int, after: int, what: str) -> None:
    rig = prepared(timing, seed)
    if after % 2:
        rig.connect()
    for name in READS:
        rig.set(f"{name}_Cmd", True)
    rig.scan(after)
    if what == "mode":
        rig.plc.mode = Mode.PROGRAM
        rig.scan(after % 5)
        rig.plc.mode = Mode.RUN
    elif what == "power":
        rig.plc.warm_start()
    elif what == "unit":
        rig.plc.write("A501.00", True)
    else:
        rig.plc.write("CIO 1500.02", True)
    rig.scan(10)
    nothing_wrong(rig)
    works_by_itself(rig)
