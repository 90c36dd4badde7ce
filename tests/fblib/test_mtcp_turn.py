"""Several MTCP_ETN blocks and one socket: each in turn, none lost, none mixed up with another."""

from __future__ import annotations

import pytest
from mtcp_rig import CONNECT, Rig, answering
from rows import each_of, first_quick

from fbvm.net.faults import Fault
from fbvm.net.peers import Say, ScriptedPeer

ALL = {
    "r1": "Fn01(Coil_Address := 16, Coil_Qty := 16, RespData_DM := 100)",
    "r2": "Fn02(Coil_Address := 32, Coil_Qty := 16, RespData_DM := 101)",
    "r3": "Fn03(Register_Address := 30, Register_Qty := 2, RespData_DM := 102)",
    "r4": "Fn04(Register_Address := 40, Register_Qty := 2, RespData_DM := 104)",
    "w5": "Fn05(Coil_Address := 50, Value := TRUE)",
    "w6": "Fn06(Register_Address := 60, Value := 666)",
    "wF": "Fn0F(Coil_Address := 70, Coil_Qty := 4, DataAddress_DM := 106)",
    "w10": "Fn10(Register_Address := 80, Register_Qty := 2, DataAddress_DM := 107)",
}
A = "Fn03(Register_Address := 10, Register_Qty := 2, RespData_DM := 100)"
B = "Fn03(Register_Address := 20, Register_Qty := 5, RespData_DM := 110)"
SIGNALS = ("a.Exchange.State", "b.Exchange.State", "a.Rcv_Counter", "b.Rcv_Counter", "CIO 1519.03", "CIO 1519.04")


def two(segment_bytes: int = 0, **options: object) -> Rig:
    rig = Rig(a=A, b=B, **options)  # type: ignore[arg-type]
    rig.network.faults.append(Fault(segment_bytes=segment_bytes))
    rig.connect()
    for register in range(10, 25):
        rig.server.holding_registers[register] = 1000 + register
    return rig


def both_are_right(rig: Rig) -> bool:
    return rig.words(100, 3) == [1010, 1011, 0] and rig.words(110, 6) == [1020, 1021, 1022, 1023, 1024, 0]


@pytest.mark.slow
def test_two_commands_in_one_scan() -> None:
    """State 1 is waiting, 3 sending, 4 awaiting the reply."""
    rig = two()
    rig.set("a_Cmd", True)
    rig.set("b_Cmd", True)
    assert (
        rig.chart(10, *SIGNALS)
        == """
        Main.a.Exchange.State  3 |4|0
        Main.b.Exchange.State  1   |3|4|0
        Main.a.Rcv_Counter     0   |1
        Main.b.Rcv_Counter     0       |1
        CIO1519.03             #...#.....   Send Request Switch
        CIO1519.04             ..#...#...   Receive Request Switch
    """
    )
    assert both_are_right(rig)


@pytest.mark.slow
@pytest.mark.parametrize("connect_last", [False, True])
@pytest.mark.parametrize("order", [1, -1])
def test_any_order_of_calls(order: int, connect_last: bool) -> None:
    names = list(ALL)[::order]
    names.insert(len(names) if connect_last else 0, "conn")
    rig = Rig(order=names, **ALL).connect()  # type: ignore[arg-type]
    server = rig.server
    server.coils[16:32] = bytes(n % 3 == 0 for n in range(16))
    server.discrete_inputs[32:48] = bytes(n % 5 == 0 for n in range(16))
    for register in range(30, 50):
        server.holding_registers[register] = 1000 + register
        server.input_registers[register] = 2000 + register
    rig.fill(106, [0b1010, 77, 88])
    for number in (1, 2):
        rig.command(*ALL, max_s=2)
        assert {rig.result(name) for name in ALL} == {(number, "")}
    assert len(rig.peer.received) == 16
    assert rig.words(100, 6) == [0b1001001001001001, 0b1000010000100001, 1030, 1031, 2040, 2041]
    assert (server.coils[50], server.holding_registers[60]) == (1, 666)
    assert (bytes(server.coils[70:75]), list(server.holding_registers[80:82])) == (bytes([0, 1, 0, 1, 0]), [77, 88])


@pytest.mark.slow
def test_nobody_is_overtaken() -> None:
    """All blocks command again as soon as they have ended: each gets as many turns as the others."""
    rig = Rig(**ALL).connect()  # type: ignore[arg-type]
    for _ in range(800):
        for name in ALL:
            rig.set(f"{name}_Cmd", rig.get(f"{name}.Exchange.State") == 0 and not rig.get(f"{name}_Cmd"))
        rig.scan()
    served = [rig.result(name)[0] for name in ALL]
    assert min(served) >= 16
    assert max(served) - min(served) <= 1


@pytest.mark.slow
@each_of("after", range(1, 10))
def test_a_block_that_is_no_longer_executed_loses_its_turn(after: int) -> None:
    """EN of the first falls: the second is served; when EN returns, the first one's command has ended with 0081."""
    rig = two(segment_bytes=7)
    rig.set("a_Cmd", True)
    rig.set("b_Cmd", True)
    rig.scan(after)
    rig.set("a_EN", False)
    ended = after >= 7
    assert rig.result("a") == (1 if ended else 0, "")
    assert rig.run_until("Main.b.Rcv_Counter = 1", 1) < 0.25
    assert rig.words(110, 5) == [1020, 1021, 1022, 1023, 1024]
    rig.set("a_EN", True)
    rig.scan()
    assert rig.result("a") == ((1, "") if ended else (0, "0081"))
    assert rig.words(100, 2) == ([1010, 1011] if ended else [0, 0])
    rig.set("a_Cmd", False)
    rig.set("b_Cmd", False)
    rig.scan()
    rig.command("b", "a")
    assert (rig.result("a")[1], rig.result("b")) == ("", (2, ""))
    assert both_are_right(rig)


def test_an_edge_in_the_scan_in_which_en_returns_is_served() -> None:
    rig = two(peer=answering(lambda frame: [Say(frame, 100_000_000)]))
    rig.set("a_Cmd", True)
    rig.scan(3)
    rig.set("a_Cmd", False)
    rig.scan()
    rig.set("a_EN", False)
    rig.scan(5)
    rig.set("a_EN", True)
    rig.set("a_Cmd", True)
    rig.scan()
    assert rig.result("a") == (0, "0081")
    rig.run_until("Main.a.Rcv_Counter = 1", 1)
    assert rig.result("a") == (1, "")


def test_a_waiting_block_that_is_no_longer_executed_loses_its_place() -> None:
    rig = two(peer=answering(lambda frame: [Say(frame, 100_000_000)]))
    rig.set("a_Cmd", True)
    rig.set("b_Cmd", True)
    rig.scan(3)
    rig.set("b_EN", False)
    rig.run_until("Main.a.Rcv_Counter = 1", 1)
    rig.scan(20)
    assert len(rig.peer.received) == 1
    rig.set("b_EN", True)
    rig.scan()
    assert rig.result("b") == (0, "0081")


@pytest.mark.slow
def test_a_silent_server_does_not_stop_the_others() -> None:
    rig = Rig(ScriptedPeer(), a=A, b=B).connect()
    rig.set("a_Cmd", True)
    rig.set("b_Cmd", True)
    rig.scan()
    assert rig.run_until("Main.a.Error") == pytest.approx(5)
    assert rig.run_until("Main.b.Error") == pytest.approx(5)
    assert {rig.result("a"), rig.result("b")} == {(0, "0080")}


@pytest.mark.slow
def test_a_stream_out_of_step_hits_only_who_is_served() -> None:
    """The second finds no connection (2210) or is stopped by EN (0081); nobody is stuck."""
    rig = two(peer=answering(lambda frame: [Say(b"\xff" * 20)]), wired=False)
    rig.command("a", "b", max_s=1)
    assert (rig.result("a"), rig.result("b")) == ((0, "0045"), (0, "2210"))


TASKS = """
PROGRAM Fast
VAR_EXTERNAL conn : MTCP_ETN_Connect; a, b : MTCP_ETN_Fn03; a_Cmd, b_Cmd : BOOL; END_VAR
VAR Octet1 : UINT := 192; Connect : BOOL := TRUE; END_VAR
    conn({connect});
    a(EN := conn.ENO, {a}, Cmd_Read := a_Cmd);
END_PROGRAM
PROGRAM Slow
VAR_EXTERNAL conn : MTCP_ETN_Connect; a, b : MTCP_ETN_Fn03; a_Cmd, b_Cmd : BOOL; END_VAR
    b(EN := conn.ENO, {b}, Cmd_Read := b_Cmd);
END_PROGRAM
CONFIGURATION Plant
    VAR_GLOBAL conn : MTCP_ETN_Connect; a, b : MTCP_ETN_Fn03; a_Cmd, b_Cmd : BOOL; END_VAR
    RESOURCE Cpu ON PLC
        TASK Often(INTERVAL := T#10ms, PRIORITY := 1);
        TASK Seldom(INTERVAL := T#{slow}ms, PRIORITY := 2);
        PROGRAM F WITH Often : Fast;
        PROGRAM S WITH Seldom : Slow;
    END_RESOURCE
END_CONFIGURATION
"""


@pytest.mark.slow
@pytest.mark.parametrize("slow", first_quick([10, 20, 50, 100, 150]))
def test_blocks_in_tasks_of_different_intervals(slow: int) -> None:
    """A block that is called seldom keeps its turn, and gets it although another always wants it."""
    text = TASKS.format(connect=CONNECT, a=A[5:-1], b=B[5:-1], slow=slow)
    rig = Rig(text=text)
    for register in range(10, 25):
        rig.server.holding_registers[register] = 1000 + register
    plc = rig.plc
    plc.run(until="conn.ENO", max_ns=10**9)
    served, quiet = 0, 0
    for _ in range(1500):
        plc.write("a_Cmd", not plc.read("a_Cmd"))
        quiet = 0 if plc.read("b.Rcv_Counter") == served else quiet + 1
        if quiet > slow // 10:
            served, quiet = served + 1, 0
        plc.write("b_Cmd", plc.read("b.Rcv_Counter") == served)
        assert plc.scan() is None
        assert plc.read("b.Error_Code") == 0
    assert served > 1500 // (6 * (slow // 10) + 12)
    assert plc.read("a.Rcv_Counter") > 0  # type: ignore[operator]
