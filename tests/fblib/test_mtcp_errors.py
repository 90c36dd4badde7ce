"""Error codes of the MTCP_ETN_Fn blocks: each one provoked, nothing but the code changed, the next command good."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from mtcp_rig import SERVER, Rig, answering, saying
from rows import each_of

from fbvm.net.peers import Action, Fin, Leave, Reset, Say, ScriptedPeer, Station
from fbvm.units.etn21.faults import Fault as UnitFault
from fbvm.units.etn21.map import Switch

READ = "Fn03(Register_Address := 1000, Register_Qty := 3, RespData_DM := 200)"
WRITE = "Fn10(Register_Address := 1000, Register_Qty := 2, DataAddress_DM := 300)"


def read_fails(peer: Station, expected: str, max_s: float = 6, **options: object) -> Rig:
    """A read that ends with this code and leaves its destination alone."""
    rig = Rig(peer, rd=READ, **options).connect()  # type: ignore[arg-type]
    rig.fill(200, [1, 2, 3])
    rig.command("rd", max_s=max_s)
    assert rig.result("rd")[1] == expected
    assert rig.words(200, 4) == [1, 2, 3, 0]
    return rig


def next_command_is_good(rig: Rig) -> None:
    """A right server takes the peer's place; without any help the block reads from it."""
    rig.network.place(SERVER, rig.peer)
    rig.peer.reply = lambda frame: [Say(frame)]
    rig.connect()
    before = rig.result("rd")[0]
    rig.command("rd")
    assert rig.result("rd") == (before + 1, "")
    assert rig.words(200, 3) == list(rig.server.holding_registers[1000:1003])


# --- the server ------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@each_of("exception", range(1, 12))
def test_an_exception_is_passed_through(exception: int) -> None:
    rig = read_fails(saying(lambda frame: frame[:4] + bytes((0, 3, 255, 0x83, exception))), f"{exception:04X}")
    assert rig.result("rd")[0] == 1, "it was a reply"
    next_command_is_good(rig)


@pytest.mark.slow
def test_exceptions_that_modbus_does_not_know_are_no_answer() -> None:
    """All from 00 to FF, one after the other on one connection: only those of Modbus count as replies."""
    said: list[int] = []
    rig = Rig(saying(lambda frame: frame[:4] + bytes((0, 3, 255, 0x83, said[-1]))), rd=READ).connect()
    rig.set("rd.Reply_Time", 100_000_000)
    known = range(1, 12)
    for exception in range(256):
        said.append(exception)
        rig.command("rd", max_s=1)
        assert rig.result("rd")[1] == (f"{exception:04X}" if exception in known else "0080")
        assert rig.get("conn.ENO"), "the connection stays"
    assert rig.result("rd")[0] == len(known)
    assert rig.words(200, 3) == [0, 0, 0]
    next_command_is_good(rig)


WRONG: dict[str, Callable[[bytes], bytes]] = {
    "transaction": lambda frame: bytes((frame[0] ^ 1,)) + frame[1:],
    "unit": lambda frame: frame[:6] + b"\x01" + frame[7:],
    "function": lambda frame: frame[:7] + b"\x04" + frame[8:],
    "exception of another function": lambda frame: frame[:4] + b"\x00\x03\xff\x84\x02",
    "byte count": lambda frame: frame[:8] + b"\x05" + frame[9:],
    "one register less": lambda frame: frame[:4] + b"\x00\x07\xff\x03\x04" + frame[9:13],
    "one register more": lambda frame: frame[:4] + b"\x00\x0b\xff\x03\x08" + frame[9:] + b"\0\0",
    "function code only": lambda frame: frame[:4] + b"\x00\x02\xff\x03",
    "exception without code": lambda frame: frame[:4] + b"\x00\x02\xff\x83",
    "exception too long": lambda frame: frame[:4] + b"\x00\x04\xff\x83\x02\x00",
}


@pytest.mark.slow
@pytest.mark.parametrize("what", WRONG)
def test_a_reply_in_which_something_does_not_fit_is_no_answer(what: str) -> None:
    rig = read_fails(saying(WRONG[what]), "0080")
    assert rig.result("rd")[0] == 0
    assert rig.get("conn.ENO"), "the connection is good"
    next_command_is_good(rig)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("block", "echo"),
    [
        ("Fn05(Coil_Address := 34, Value := TRUE)", 10),
        ("Fn06(Register_Address := 34, Value := 5)", 11),
        (WRITE, 9),
        ("Fn0F(Coil_Address := 34, Coil_Qty := 5, DataAddress_DM := 300)", 11),
    ],
)
def test_a_wrong_echo_is_no_answer(block: str, echo: int) -> None:
    wrong = saying(lambda frame: frame[:echo] + bytes((frame[echo] ^ 1,)) + frame[echo + 1 :])
    rig = Rig(wrong, rd=block).connect()
    rig.command("rd")
    assert rig.result("rd") == (0, "0080")


@pytest.mark.slow
@each_of(
    "wrong",
    [
        lambda frame: frame[:2] + b"\x00\x01" + frame[4:],
        lambda frame: frame[:4] + b"\x00\x00" + frame[6:],
        lambda frame: frame[:4] + b"\x00\x01" + frame[6:],
        lambda frame: frame[:4] + b"\x00\xff" + frame[6:],
        lambda frame: frame[:4] + b"\xff\xff" + frame[6:],
    ],
    ids=["protocol", "length 0", "length 1", "length 255", "length 65535"],
)
def test_a_stream_out_of_step_is_opened_anew(wrong: Callable[[bytes], bytes]) -> None:
    rig = read_fails(saying(wrong), "0045", max_s=1)
    rig.run_until("NOT Main.conn.ENO", 1)
    assert rig.get("conn.Error_Code") == 0x45
    next_command_is_good(rig)


# --- time -------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_no_reply_in_five_seconds() -> None:
    rig = Rig(ScriptedPeer(), rd=READ).connect()
    rig.set("rd_Cmd", True)
    rig.scan()
    assert rig.run_until("Main.rd.Error") == pytest.approx(5.0)
    assert rig.result("rd") == (0, "0080")
    assert rig.get("conn.ENO")


def test_the_time_is_a_variable_of_the_block() -> None:
    rig = Rig(ScriptedPeer(), rd=READ).connect()
    rig.set("rd.Reply_Time", 250_000_000)
    rig.set("rd_Cmd", True)
    rig.scan()
    assert rig.run_until("Main.rd.Error") == pytest.approx(0.25)


@pytest.mark.slow
def test_a_late_reply_is_passed_over() -> None:
    """It comes while the next command waits, just before that one's own reply, and in one piece with it."""
    held: list[bytes] = []

    def late(frame: bytes) -> list[Action]:
        held.append(frame)
        return [Say(b"".join(held))] if len(held) == 2 else []

    rig = read_fails(answering(late), "0080")
    rig.server.holding_registers[1000] = 77
    rig.command("rd")
    assert (rig.result("rd"), rig.words(200, 1)) == ((1, ""), [77])


def test_the_previous_reply_again() -> None:
    sent: list[bytes] = []

    def again(frame: bytes) -> list[Action]:
        sent.append(frame)
        return [Say(b"".join(sent[-2:]))]

    rig = Rig(answering(again), rd=READ).connect()
    for number in range(1, 5):
        rig.server.holding_registers[1000] = number
        rig.command("rd")
        assert (rig.result("rd"), rig.words(200, 1)) == ((number, ""), [number])


@pytest.mark.slow
@pytest.mark.parametrize("size", range(1, 15))
def test_half_a_reply_and_nothing_more(size: int) -> None:
    """Nobody knows where the next frame would begin, so the connection is opened anew."""
    rig = read_fails(saying(lambda frame: frame[:size]), "0080")
    rig.run_until("NOT Main.conn.ENO", 1)
    assert rig.get("conn.Error_Code") == 0x80
    next_command_is_good(rig)


# --- the connection ---------------------------------------------------------------------------------------------------


@pytest.mark.slow
@each_of("size", [0, 3, 6, 8, 14])
@each_of(("end", "expected"), [(Fin(), "0081"), (Leave(), "0081"), (Reset(), "004B")])
def test_the_server_closes_in_mid_reply(size: int, end: Action, expected: str) -> None:
    rig = read_fails(answering(lambda frame: [Say(frame[:size]), end] if size else [end]), expected, max_s=1)
    next_command_is_good(rig)


@pytest.mark.slow
def test_a_command_without_connection() -> None:
    rig = Rig(refused=True, rd=READ, wired=False)
    rig.scan(20)
    rig.command("rd", max_s=1)
    assert rig.result("rd") == (0, "2210")
    next_command_is_good(rig)


def test_the_server_closed_between_two_commands() -> None:
    rig = Rig(answering(lambda frame: [Say(frame), Leave(30_000_000)]), rd=READ, wired=False).connect()
    rig.command("rd")
    assert rig.result("rd") == (1, "")
    rig.run_until("NOT Main.conn.ENO", 1)
    rig.command("rd", max_s=1)
    assert rig.result("rd")[1] == "2210"
    next_command_is_good(rig)


@pytest.mark.slow
@each_of("wired", [True, False])
@each_of("after", range(1, 10))
def test_connect_falls_in_mid_request(after: int, wired: bool) -> None:
    """With EN from ENO the block finds out when EN returns, else at once.  The exchange takes seven scans."""
    rig = Rig(answering(lambda frame: [Say(frame, 30_000_000)]), rd=READ, wired=wired).connect()
    rig.set("rd_Cmd", True)
    rig.scan(after)
    rig.set("Connect", False)
    rig.scan(20)
    rig.set("Connect", True)
    rig.connect()
    assert rig.result("rd") == ((1, "") if after >= 7 else (0, "0081"))
    rig.set("rd_Cmd", False)
    rig.scan()
    next_command_is_good(rig)


# --- before anything is sent ------------------------------------------------------------------------------------------

TOO_MUCH = {
    "Fn03(Register_Address := 0, Register_Qty := 3, RespData_DM := 200, SlaveID := 256)": "1100",
    "Fn06(Register_Address := 0, Value := 3, SlaveID := 16#FFFF)": "1100",
    "Fn10(Register_Address := 0, Register_Qty := 124, DataAddress_DM := 0)": "1100",
    "Fn10(Register_Address := 0, Register_Qty := 65535, DataAddress_DM := 0)": "1100",
    "Fn0F(Coil_Address := 0, Coil_Qty := 1977, DataAddress_DM := 0)": "1100",
    "Fn0F(Coil_Address := 0, Coil_Qty := 65535, DataAddress_DM := 0)": "1100",
    "Fn03(Register_Address := 0, Register_Qty := 3, RespData_DM := 32766)": "1101",
    "Fn03(Register_Address := 0, Register_Qty := 1, RespData_DM := 65535)": "1101",
    "Fn04(Register_Address := 0, Register_Qty := 65535, RespData_DM := 0)": "1101",
    "Fn01(Coil_Address := 0, Coil_Qty := 17, RespData_DM := 32767)": "1101",
    "Fn02(Coil_Address := 0, Coil_Qty := 2000, RespData_DM := 32644)": "1101",
    "Fn10(Register_Address := 0, Register_Qty := 2, DataAddress_DM := 32767)": "1101",
    "Fn0F(Coil_Address := 0, Coil_Qty := 17, DataAddress_DM := 32767)": "1101",
}


TOO_MUCH |= {
    f"Fn{function}(Register_Address := 0, Register_Qty := 8, {pin} := {first})": "1101"
    for function, pin, places in (
        ("03", "RespData_DM", (29993, 30000, 30099, 32493, 32500, 32506, 32507, 32515, 32642)),
        ("10", "DataAddress_DM", (32493, 32500, 32506, 32507, 32515, 32642)),
    )
    for first in places
} | {
    "Fn01(Coil_Address := 0, Coil_Qty := 1, RespData_DM := 30018)": "1101",
    "Fn02(Coil_Address := 0, Coil_Qty := 17, RespData_DM := 32499)": "1101",
    "Fn0F(Coil_Address := 0, Coil_Qty := 17, DataAddress_DM := 32499)": "1101",
}  # fmt: skip
"""Data in the words in which the exchange takes place, or where the unit keeps its parameters, would be wrong data."""


@pytest.mark.slow
@each_of("block", TOO_MUCH)
def test_what_cannot_be_sent_fails_at_once(block: str) -> None:
    rig = Rig(rd=block).connect()
    words = list(rig.plc.memory.words("D"))
    rig.set("rd_Cmd", True)
    rig.scan()
    assert rig.result("rd") == (0, TOO_MUCH[block])
    rig.scan(20)
    assert (rig.peer.received, list(rig.plc.memory.words("D"))) == ([], words)


REFUSED = [
    "Fn01(Coil_Address := 0, Coil_Qty := 0, RespData_DM := 200)",
    "Fn01(Coil_Address := 0, Coil_Qty := 2001, RespData_DM := 200)",
    "Fn02(Coil_Address := 0, Coil_Qty := 65535, RespData_DM := 200)",
    "Fn03(Register_Address := 0, Register_Qty := 0, RespData_DM := 200)",
    "Fn03(Register_Address := 0, Register_Qty := 126, RespData_DM := 200)",
    "Fn04(Register_Address := 0, Register_Qty := 255, RespData_DM := 200)",
    "Fn04(Register_Address := 0, Register_Qty := 30000, RespData_DM := 200)",
    "Fn0F(Coil_Address := 0, Coil_Qty := 0, DataAddress_DM := 200)",
    "Fn0F(Coil_Address := 0, Coil_Qty := 1969, DataAddress_DM := 200)",
    "Fn0F(Coil_Address := 0, Coil_Qty := 1976, DataAddress_DM := 200)",
    "Fn10(Register_Address := 0, Register_Qty := 0, DataAddress_DM := 200)",
]


@pytest.mark.slow
@each_of("block", REFUSED)
def test_what_can_be_sent_is_left_to_the_server(block: str) -> None:
    rig = Rig(rd=block).connect()
    rig.command("rd")
    assert (rig.result("rd"), len(rig.peer.received)) == ((1, "0003"), 1)


@pytest.mark.slow
def test_the_longest_request_that_fits_a_frame() -> None:
    rig = Rig(rd="Fn0F(Coil_Address := 0, Coil_Qty := 1976, DataAddress_DM := 200)").connect()
    rig.command("rd")
    assert len(rig.peer.received[0]) == 260
    assert rig.words(32630, 1) == [0]


@pytest.mark.slow
@each_of(
    "block",
    [
        "Fn03(Register_Address := 1000, Register_Qty := 8, RespData_DM := 29992)",
        "Fn03(Register_Address := 1000, Register_Qty := 8, RespData_DM := 30100)",
        "Fn03(Register_Address := 1000, Register_Qty := 8, RespData_DM := 32492)",
        "Fn03(Register_Address := 1000, Register_Qty := 8, RespData_DM := 32643)",
        "Fn10(Register_Address := 1000, Register_Qty := 8, DataAddress_DM := 30018)",
        "Fn10(Register_Address := 1000, Register_Qty := 8, DataAddress_DM := 32492)",
        "Fn10(Register_Address := 1000, Register_Qty := 8, DataAddress_DM := 32643)",
        "Fn05(Coil_Address := 0, Value := TRUE)",
    ],
)
def test_data_beside_the_words_of_blocks_and_unit(block: str) -> None:
    """Also the unit's own words may be written to a server."""
    rig = Rig(rd=block).connect()
    rig.server.holding_registers[1000:1008] = type(rig.server.holding_registers)("H", range(1, 9))
    rig.command("rd")
    assert rig.result("rd") == (1, "")
    if "RespData_DM" in block:
        assert rig.words(rig.number("rd_RespData_DM"), 8) == list(range(1, 9))


def test_a_read_up_to_the_last_word() -> None:
    rig = Rig(rd="Fn03(Register_Address := 0, Register_Qty := 125, RespData_DM := 32643)").connect()
    rig.server.holding_registers[0:125] = type(rig.server.holding_registers)("H", range(1, 126))
    rig.command("rd")
    assert (rig.result("rd"), rig.words(32643, 125)) == ((1, ""), list(range(1, 126)))


# --- commands that meet ----------------------------------------------------------------------------------------------


def test_a_command_while_the_last_one_runs() -> None:
    """110C while it runs; what was begun goes on and then says how it ended."""
    rig = Rig(answering(lambda frame: [Say(frame, 100_000_000)]), rd=READ).connect()
    rig.set("rd_Cmd", True)
    rig.scan(2)
    rig.set("rd_Cmd", False)
    rig.scan()
    rig.set("rd_Cmd", True)
    rig.scan()
    assert rig.result("rd") == (0, "110C")
    rig.run_until("Main.rd.Rcv_Counter = 1", 1)
    assert rig.result("rd") == (1, "")
    assert len(rig.peer.received) == 1


def test_error_and_code_hold_until_the_next_command() -> None:
    rig = read_fails(saying(lambda frame: frame[:4] + b"\x00\x03\xff\x83\x02"), "0002")
    rig.scan(100)
    assert rig.result("rd")[1] == "0002"
    rig.set("rd_Cmd", True)
    rig.scan()
    assert rig.result("rd")[1] == ""


# --- codes of the unit ------------------------------------------------------------------------------------------------

UNIT_CODES = ["0302", "1100", "1103", "220F", "2211", "2606", "2607", "0020", "003E", "0045", "004E", "0051", "0053"]


@pytest.mark.slow
@each_of("service", [Switch.SEND, Switch.RECEIVE])
@each_of("expected", UNIT_CODES)
def test_a_code_of_the_unit_is_passed_through(service: Switch, expected: str) -> None:
    """A request that was refused leaves the connection as it was; errors of the stack open it anew."""
    rig = Rig(rd=READ).connect()
    rig.unit.faults.append(UnitFault(int(expected, 16), service))
    rig.command("rd", max_s=1)
    assert rig.result("rd") == (0, expected)
    rig.scan(5)
    assert rig.get("conn.ENO") == (int(expected, 16) >= 0x100)
    next_command_is_good(rig)


@pytest.mark.slow
@each_of("word", [0, 2, 9, 0x0101, 0xFFFF])
@each_of("after", [0, 1, 2, 3, 4])
def test_somebody_overwrites_the_parameter_area(word: int, after: int) -> None:
    """All of it, at any time: a command may fail, the next ones do not."""
    rig = Rig(rd=READ).connect()
    rig.set("rd.Reply_Time", 500_000_000)
    rig.set("rd_Cmd", True)
    rig.scan(after)
    rig.fill(30018, [word] * 10)
    rig.run_until("Main.rd.Exchange.State = 0", 3)
    rig.set("rd_Cmd", False)
    rig.scan(20)
    next_command_is_good(rig)


@pytest.mark.slow
def test_the_socket_kept_busy_by_another_program() -> None:
    """A receive that the program itself requested waits for bytes that never come."""
    rig = Rig(ScriptedPeer(), rd=READ).connect()
    rig.fill(30023, [1, 0x8200, 0, 0])
    rig.plc.write("CIO 1519.04", True)
    rig.scan(2)
    rig.command("rd", max_s=6)
    assert rig.result("rd") == (0, "220F")
