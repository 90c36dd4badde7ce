"""Other users of the same unit: what a program before has left, and programs beside that use the other sockets."""

from __future__ import annotations

import pytest
from depth import times
from hypothesis import given, settings
from hypothesis import strategies as st
from mtcp_rig import Rig

from fbvm.net.peers import ModbusPeer
from fbvm.units.etn21.map import Layout, Switch
from fbvm.wire.link import Peer

READ = "Fn03(Register_Address := 1000, Register_Qty := 125, RespData_DM := 200)"
WRITE = "Fn0F(Coil_Address := 9, Coil_Qty := 1968, DataAddress_DM := 400)"
UNIT = Layout.of(0)
TIMINGS = st.sampled_from(["exact", "real"])
SEEDS = st.integers(0, 10**6)


def services(areas: st.SearchStrategy[tuple[int, int]]) -> st.SearchStrategy[tuple[tuple[int, int], Switch, list[int]]]:
    """Requests of any service by an area for a socket, sensible or not: the words +1 to +8 of the area."""
    words = st.tuples(
        st.sampled_from([0, 502, 6000]), st.just(0xC0A8), st.sampled_from([0xFA02, 0xFA09, 0]),
        st.sampled_from([502, 9, 0]), st.sampled_from([0, 4, 100, 2000]), st.just(0x8200), st.sampled_from([0, 0x6400]),
        st.sampled_from([0, 5, 20]),
    ).map(list)  # fmt: skip
    return st.tuples(areas, st.sampled_from(Switch), words)


def request(rig: Rig, asked: tuple[tuple[int, int], Switch, list[int]]) -> None:
    """Do as a program does that drives the unit itself."""
    (area, socket), switch, words = asked
    rig.fill(UNIT.parameters(area), [socket, *words])
    word, first = UNIT.switches(area)
    rig.plc.memory.words("CIO")[word] |= 1 << first + switch


def prepared(timing: str, seed: int) -> Rig:
    rig = Rig(timing=timing, seed=seed, rd=READ, wr=WRITE)
    rig.server.holding_registers[1000:1125] = type(rig.server.holding_registers)("H", range(1, 126))
    rig.network.place(Peer("192.168.250.9", 502), ModbusPeer())
    return rig


OURS = st.sampled_from([(1, 1), (1, 1), (2, 1), (2, 2), (3, 1)])
"""Area and socket: all but our area for another socket, which only its owner can end."""


@pytest.mark.slow
@given(TIMINGS, SEEDS, st.lists(st.tuples(services(OURS), st.integers(1, 8)), max_size=10), st.booleans())
@settings(max_examples=times(60), deadline=None)
def test_whatever_the_last_program_left_on_the_socket(
    timing: str, seed: int, left: list[tuple[tuple[tuple[int, int], Switch, list[int]], int]], mode_changed: bool
) -> None:
    """Listening, open as UDP, in the middle of a service, by any area: MTCP_ETN_Connect closes it and connects."""
    rig = prepared(timing, seed)
    rig.set("conn_EN", False)
    for asked, scans in left:
        request(rig, asked)
        rig.scan(scans)
    if mode_changed:
        rig.plc.memory.words("CIO")[1500:1525] = memoryview(bytes(50)).cast("H")
    rig.set("conn_EN", True)
    rig.run_until("Main.conn.ENO", 30)
    rig.scan(10)
    rig.command("rd", max_s=10)
    assert rig.result("rd") == (1, "")
    assert rig.words(200, 125) == list(range(1, 126))


THEIRS = st.tuples(st.integers(2, 8), st.integers(2, 8))


@pytest.mark.slow
@given(TIMINGS, SEEDS, st.lists(st.tuples(services(THEIRS), st.integers(1, 6)), min_size=20, max_size=60))
@settings(max_examples=times(20), deadline=None)
def test_a_program_that_uses_the_other_sockets(
    timing: str, seed: int, asked: list[tuple[tuple[tuple[int, int], Switch, list[int]], int]]
) -> None:
    """Right or wrong, it disturbs nobody: every command is served, and the connection stays."""
    rig = prepared(timing, seed).connect()
    for service, scans in asked:
        request(rig, service)
        for name in ("rd", "wr"):
            if rig.get(f"{name}.Exchange.State") == 0:
                rig.set(f"{name}_Cmd", not rig.get(f"{name}_Cmd"))
        rig.scan(scans)
        assert (rig.get("conn.ENO"), rig.code("rd"), rig.code("wr")) == (True, "", "")
    assert rig.words(200, 125) in ([0] * 125, list(range(1, 126)))
    rig.run_until("Main.rd.Rcv_Counter > 0 AND Main.wr.Rcv_Counter > 0", 5)
