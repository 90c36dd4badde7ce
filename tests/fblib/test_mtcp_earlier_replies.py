"""Replies to requests that have been given up: they may come later, whole or in pieces, of another block and another size,
and nobody takes one for the reply to a later request."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from mtcp_rig import SECOND_NS, Rig, answering

from fbvm.net.peers import Action, Say
from fbvm.units.etn21.map import Switch
from fbvm.units.etn21.unit import Fault

ONE = "Fn03(Register_Address := 1000, Register_Qty := 1, RespData_DM := 200)"
THREE = "Fn03(Register_Address := 2000, Register_Qty := 3, RespData_DM := 210)"
WRITE = "Fn06(Register_Address := 3000, Value := 16#3AC5)"
HELD = [0xAB12, 0x5678, 0x9713]
GAP_NS = 50_000_000
REPLY_NS = 500_000_000


class LateRig(Rig):
    """A rig whose server keeps the right replies in `kept` and does what `said` returns for the number of the request."""

    def __init__(self, **blocks: str) -> None:
        self.kept: list[bytes] = []
        super().__init__(answering(self._reply), **blocks)
        for name in blocks:
            self.set(f"{name}.Reply_Time", REPLY_NS)
        self.server.holding_registers[1000] = 0x1111
        for offset, value in enumerate(HELD):
            self.server.holding_registers[2000 + offset] = value
        self.connect()

    def _reply(self, frame: bytes) -> list[Action]:
        self.kept.append(frame)
        return self.said(len(self.kept))

    def said(self, request: int) -> list[Action]:
        raise NotImplementedError

    def end_of(self, name: str) -> str:
        """What one command ends with, "ok" or its code."""
        assert self.command(name, max_s=3)
        return self.code(name) or "ok"


@pytest.mark.slow
@pytest.mark.parametrize("late", ["one", "three", "wr"])
@pytest.mark.parametrize("asked", ["one", "three", "wr"])
@pytest.mark.parametrize("surplus", [-3, 0, 4])
def test_a_late_reply_in_pieces_of_the_size_that_is_expected(late: str, asked: str, surplus: int) -> None:
    """What arrives first is as long as the reply that is waited for, and ends within one of the two frames."""

    class Rig(LateRig):
        def said(self, request: int) -> list[Action]:
            if request == 1:
                return []
            stream = b"".join(self.kept)
            first = min(len(stream), len(self.kept[1]) + surplus)
            return [Say(stream[:first]), Say(stream[first:], GAP_NS)]

    rig = Rig(one=ONE, three=THREE, wr=WRITE)
    assert rig.end_of(late) == "0080"
    assert rig.end_of(asked) == "ok"
    assert rig.words(200, 1) == ([0x1111] if asked == "one" else [0])
    assert rig.words(210, 3) == (HELD if asked == "three" else [0] * 3)
    assert rig.get("conn.ENO"), "the connection has not been opened again"


@pytest.mark.parametrize("asked", ["one", "three", "wr"])
@pytest.mark.parametrize("there", [6, 8, 10])
def test_a_late_reply_of_which_a_part_is_there_when_the_next_command_comes(there: int, asked: str) -> None:
    """The command waits for its end and is sent then."""

    class Rig(LateRig):
        def said(self, request: int) -> list[Action]:
            if request > 1:
                return [Say(self.kept[-1])]
            return [Say(self.kept[0][:there], REPLY_NS + 2 * GAP_NS), Say(self.kept[0][there:], REPLY_NS + 4 * GAP_NS)]

    rig = Rig(one=ONE, three=THREE, wr=WRITE)
    assert rig.end_of("one") == "0080"
    rig.run_until(f"D30001 = {there}", max_s=1)
    assert rig.end_of(asked) == "ok"
    assert rig.words(200, 1) == ([0x1111] if asked == "one" else [0])
    assert rig.words(210, 3) == (HELD if asked == "three" else [0] * 3)
    assert rig.get("conn.ENO"), "the connection has not been opened again"


@pytest.mark.parametrize("there", [1, 5])
def test_less_than_a_header_of_a_late_reply_holds_no_command_up(there: int) -> None:
    """How long that reply is, is not known yet; its rest comes in front of the reply that is waited for."""

    class Rig(LateRig):
        def said(self, request: int) -> list[Action]:
            if request > 1:
                return [Say(self.kept[0][there:] + self.kept[1])]
            return [Say(self.kept[0][:there], REPLY_NS + 2 * GAP_NS)]

    rig = Rig(one=ONE, three=THREE)
    assert rig.end_of("one") == "0080"
    rig.run_until(f"D30001 = {there}", max_s=1)
    assert rig.end_of("three") == "ok"
    assert (rig.words(200, 1), rig.words(210, 3)) == ([0], HELD)
    assert rig.get("conn.ENO"), "the connection has not been opened again"


def test_behind_a_whole_late_reply_a_command_is_sent_without_a_pause() -> None:
    """Frames are told apart by their transactions; the pause of 100 ms is for what nobody has asked for."""

    class Rig(LateRig):
        def said(self, request: int) -> list[Action]:
            return [Say(self.kept[-1], 0 if request > 1 else REPLY_NS + 2 * GAP_NS)]

    rig = Rig(one=ONE, three=THREE)
    assert rig.end_of("one") == "0080"
    rig.run_until("D30001 = 11", max_s=1)
    began_ns = rig.plc.elapsed_ns
    rig.set("three_Cmd", True)
    while len(rig.kept) < 2:
        rig.scan()
    assert rig.plc.elapsed_ns - began_ns < 90_000_000
    assert rig.end_of("three") == "ok"


@pytest.mark.parametrize("surplus", [-3, 0, 4])
def test_a_reply_that_comes_two_requests_later(surplus: int) -> None:
    """A reply to the second request does not mean that the one to the first will not come."""

    class Rig(LateRig):
        def said(self, request: int) -> list[Action]:
            if request == 1:
                return []
            if request == 2:
                return [Say(self.kept[1])]
            stream = self.kept[0] + self.kept[2]
            first = len(self.kept[2]) + surplus
            return [Say(stream[:first]), Say(stream[first:], GAP_NS)]

    rig = Rig(one=ONE, three=THREE, wr=WRITE)
    assert [rig.end_of(name) for name in ("one", "wr", "three")] == ["0080", "ok", "ok"]
    assert (rig.words(200, 1), rig.words(210, 3)) == ([0], HELD)


@pytest.mark.slow
def test_a_reply_is_taken_in_one_piece_when_nothing_else_can_come() -> None:
    """One receive for the whole frame, two when an earlier reply may still come: first the bytes up to its length."""

    class Rig(LateRig):
        def said(self, request: int) -> list[Action]:
            return [] if request == 3 else [Say(self.kept[-1])]

    rig = Rig(one=ONE, three=THREE)
    asked = []
    for name in ("three", "one", "three", "three", "one"):
        rig.set(f"{name}_Cmd", True)
        sizes = []
        for _ in range(60):
            before = rig.plc.read("CIO 1519.04")
            rig.scan()
            if rig.plc.read("CIO 1519.04") and not before:
                sizes.append(rig.plc.read("D30023"))
        rig.set(f"{name}_Cmd", False)
        rig.scan()
        asked.append((rig.code(name), sizes))
    assert asked == [("", [15]), ("", [11]), ("0080", []), ("", [6, 9]), ("", [6, 5])]


# --- what an interrupted command leaves -------------------------------------------------------------------------------


class Interrupted(LateRig):
    """Block `three` is not executed any more when it has taken the beginning of its reply, `first` bytes; `rest_ns` later
    the rest comes."""

    def __init__(self, rest_ns: int | None, first: int = 8, until: str = "MTCP_ETN_Line.Rest = 9") -> None:
        self.rest_ns, self.first = rest_ns, first
        super().__init__(three=THREE, wr=WRITE)
        self.set("three_Cmd", True)
        self.run_until(until, 1)
        self.set("three_EN", False)

    def said(self, request: int) -> list[Action]:
        if request > 1:
            return [Say(self.kept[-1])]
        rest: Sequence[Action] = [] if self.rest_ns is None else [Say(self.kept[0][self.first:], self.rest_ns)]
        return [Say(self.kept[0][:self.first]), *rest]


@pytest.mark.slow
@pytest.mark.parametrize("rest_ns", [GAP_NS, REPLY_NS // 2])
def test_the_rest_of_a_frame_is_taken_before_the_next_request(rest_ns: int) -> None:
    rig = Interrupted(rest_ns)
    assert rig.end_of("wr") == "ok"
    assert rig.server.holding_registers[3000] == 0x3AC5
    assert (rig.result("three"), rig.words(210, 3)) == ((0, ""), [0] * 3)


@pytest.mark.parametrize(("code", "stays"), [(0x2211, True), (0x004B, False), (0x0045, False)])
def test_a_fault_of_the_unit_while_the_rest_is_taken(code: int, stays: bool) -> None:
    """The command ends with the unit's code; below 0100 the connection is opened again."""
    rig = Interrupted(GAP_NS)
    rig.unit.faults.append(Fault(code, Switch.RECEIVE, 1))
    assert rig.end_of("wr") == f"{code:04X}"
    assert rig.server.holding_registers[3000] == 0
    assert len(rig.kept) == 1, "its request has not been sent"
    assert not rig.unit.faults
    assert rig.get("conn.ENO") == stays
    rig.run_until("Main.conn.ENO", 3)
    rig.scan()
    assert rig.end_of("wr") == "ok"


def test_the_beginning_of_a_frame_is_looked_at_before_the_next_request() -> None:
    """The interrupted block has asked for six bytes, which are no beginning of a frame: nothing is sent behind them."""

    class Garbled(Interrupted):
        def said(self, request: int) -> list[Action]:
            return [Say(b"HTTP/1.1")] if request == 1 else [Say(self.kept[-1])]

    rig = Garbled(None, until="MTCP_ETN_Line.Taking")
    assert rig.end_of("wr") == "0045"
    assert len(rig.kept) == 1, "its request has not been sent"


@pytest.mark.parametrize("first", [6, 8])
def test_a_rest_that_does_not_come(first: int) -> None:
    rig = Interrupted(None, first)
    began_ns = rig.plc.now_ns
    assert rig.end_of("wr") == "0080"
    assert REPLY_NS <= rig.plc.now_ns - began_ns < REPLY_NS + SECOND_NS // 2
    rig.run_until("NOT Main.conn.ENO", 1)
    rig.run_until("Main.conn.ENO", 3)
    rig.scan()
    assert rig.end_of("wr") == "ok"
