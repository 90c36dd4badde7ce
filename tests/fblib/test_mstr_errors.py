"""MBP_MSTR: every code of CONTROL[2] that something triggers, each provoked; a refused operation sends and changes nothing."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import noc_words
import pytest
from mstr_rig import SERVER, SERVER_IP, Rig
from rows import each_of, first_quick

from fbvm.base.data import data_folder
from fbvm.machine.plc import Mode
from fbvm.net.faults import Fault
from fbvm.net.misdeeds import MISDEEDS, RUDE_PEERS
from fbvm.net.peers import Action, Fin, Leave, ModbusPeer, Reset, Say, ScriptedPeer, Station
from fbvm.units.port.noc import ERRNO, Noc, Statistic
from fbvm.wire.modbus_server import ModbusServer

READ = (2, 0, 3, 1, 0x0700, *SERVER_IP)
WRITE = (1, 0, 3, 1, 0x0700, *SERVER_IP)
BOTH = (23, 0, 3, 1, 0x0700, *SERVER_IP, 3, 1)
REMOTE = (7, 0, 38, 0, 0x07FF, *SERVER_IP)
CLEAR = (8, 0, 0, 0, 0x07FF, *SERVER_IP)
LOCAL = (3, 0, 38, 0, 0x0700)


def changed(control: tuple[int, ...], **words: int) -> tuple[int, ...]:
    """CONTROL with some words changed: `w3=0` is CONTROL[3] = 0."""
    found = list(control)
    for name, value in words.items():
        found[int(name[1:]) - 1] = value
    return tuple(found)


# --- what is refused before anything is sent ----------------------------------------------------------------------------


@pytest.mark.slow
@each_of("operation", [0, 5, 6, 9, 11, 12, 13, 16, 17, 22, 24, 0x7FFF, 0xFFEF, 0xFFF1, 0xFFFF])
def test_2001_operations_that_there_are_not(operation: int) -> None:
    assert refused(changed(READ, w1=operation)) == "2001"


@pytest.mark.slow
@each_of("control", [
    changed(READ, w3=0), changed(READ, w3=126), changed(READ, w3=0xFFFF), changed(WRITE, w3=0), changed(WRITE, w3=124),
    changed(BOTH, w3=0), changed(BOTH, w3=122), changed(BOTH, w10=0), changed(BOTH, w10=126), changed(LOCAL, w3=0),
    changed(LOCAL, w3=39), changed(REMOTE, w3=0), changed(REMOTE, w3=39),
])  # fmt: skip
def test_2003_lengths(control: tuple[int, ...]) -> None:
    assert refused(control) == "2003"


@pytest.mark.slow
@pytest.mark.parametrize("control", [changed(READ, w3=101), changed(WRITE, w3=101), changed(BOTH, w3=101),
                                     changed(BOTH, w10=101)])  # fmt: skip
def test_2003_where_a_library_takes_100_words(control: tuple[int, ...]) -> None:
    assert refused(control, options="Max_Words := 100") == "2003"
    assert Rig(options="Max_Words := 100").operate(*changed(READ, w3=100)) == "0000"


@pytest.mark.slow
def test_2003_a_write_from_a_buffer_that_is_too_short() -> None:
    for control in (WRITE, BOTH):
        assert refused(control, databuf="ARRAY[0..1] OF WORD") == "2003"
    assert Rig(databuf="ARRAY[0..2] OF WORD").operate(*WRITE) == "0000"


@pytest.mark.slow
@pytest.mark.parametrize("control", [READ, changed(BOTH, w3=1), changed(LOCAL, w3=3), changed(REMOTE, w3=3)])
def test_200f_an_answer_that_does_not_fit(control: tuple[int, ...]) -> None:
    """Older libraries know 2003 only."""
    assert refused(control, databuf="ARRAY[0..1] OF WORD") == "200F"
    assert refused(control, databuf="ARRAY[0..1] OF WORD", options="Old_Codes := TRUE") == "2003"


@each_of("control", [changed(READ, w4=0), changed(WRITE, w4=0), changed(BOTH, w4=0), changed(BOTH, w11=0),
                     changed(LOCAL, w3=1, w4=38), changed(REMOTE, w3=1, w4=0xFFFF)])  # fmt: skip
def test_2004_offsets(control: tuple[int, ...]) -> None:
    assert refused(control) == "2004"


@each_of("control", [changed(READ, w4=65535), changed(WRITE, w4=65535), changed(BOTH, w4=65535),
                     changed(BOTH, w11=65535), changed(LOCAL, w4=1), changed(REMOTE, w3=2, w4=37)])  # fmt: skip
def test_2005_length_and_offset_together(control: tuple[int, ...]) -> None:
    assert refused(control) == "2005"


@each_of("control", [READ, WRITE, BOTH, REMOTE, CLEAR])
def test_2009_the_module_itself(control: tuple[int, ...]) -> None:
    assert refused(changed(control, w9=22)) == "2009"


@pytest.mark.slow
def test_200e_what_is_no_array_assumed() -> None:
    rig = Rig(databuf="UINT")
    rig.control(4, 0, 0, 0, 0x0700)
    rig.set("m1_ENABLE", True)
    rig.scan()
    assert (rig.outputs(), rig.status()) == ("E", "200E")


@pytest.mark.slow
@pytest.mark.parametrize(("length", "control"), first_quick([(8, READ), (8, LOCAL), (2, CLEAR), (10, BOTH), (9, BOTH)]))
def test_2010_a_control_array_that_is_too_short(length: int, control: tuple[int, ...]) -> None:
    rig = Rig(control=f"ARRAY[1..{length}] OF INT")
    assert rig.operate(*control[:length]) == "2010"
    assert rig.peer.received == []


@pytest.mark.slow
def test_2010_of_one_word_is_told_by_error_alone() -> None:
    rig = Rig(control="ARRAY[1..1] OF INT")
    rig.control(2)
    rig.set("m1_ENABLE", True)
    rig.scan()
    assert rig.outputs() == "E"


@each_of("octet", range(6, 10))
def test_2011_octets_above_255_assumed(octet: int) -> None:
    assert refused(changed(READ, **{f"w{octet}": 256})) == "2011"


@pytest.mark.slow
@each_of("slot", [0, 6, 8, 16, 17, 100, 253, 254, 255])
@each_of("control", [READ, LOCAL, (4, 0, 0, 0, 0), (10, 0, 0, 0, 0), (0xFFF0, 0, 1, 1, 0, 0, 0, 0, 0)])
def test_6007_slots_without_a_module(slot: int, control: tuple[int, ...]) -> None:
    assert refused(changed(control, w5=slot << 8)) == "6007"


@pytest.mark.parametrize("slot", [0, 16, 254])
def test_other_slots_with_a_module(slot: int) -> None:
    rig = Rig(noc=Noc(slot))
    assert rig.operate(*changed(READ, w5=slot << 8)) == "0000"


@each_of("control", [READ, LOCAL, REMOTE, (4, 0, 0, 0, 0x0700), (10, 0, 0, 0, 0x0700),
                     (0xFFF0, 0, 1, 1, 0x0700, 0, 0, 0, 0)])  # fmt: skip
def test_f002_a_module_without_configuration_assumed(control: tuple[int, ...]) -> None:
    noc = Noc()
    noc.configured = False
    rig = Rig(noc=noc)
    assert rig.operate(*control) == "F002"


@pytest.mark.slow
@pytest.mark.parametrize("control", [READ, LOCAL, (10, 0, 0, 0, 0x0700)])
def test_f001_while_the_module_restarts(control: tuple[int, ...]) -> None:
    rig = Rig(blocks=2)
    rig.control(10, 0, 0, 0, 0x0700, block=2)
    rig.set("m2_ENABLE", True)
    rig.scan(3)
    assert rig.operate(*control) == "F001"


@pytest.mark.slow
def test_f001_what_is_in_progress_when_the_module_restarts() -> None:
    rig = Rig(ScriptedPeer([]), blocks=2)
    rig.control(*READ)
    rig.set("m1_ENABLE", True)
    rig.scan(5)
    assert rig.outputs() == "A"
    rig.control(10, 0, 0, 0, 0x0700, block=2)
    rig.set("m2_ENABLE", True)
    rig.scan(2)
    assert (rig.outputs(), rig.status()) == ("E", "F001")


def test_the_order_of_checks_assumed() -> None:
    """Operation, size of CONTROL, length, offset, both, slot, address."""
    wrong = changed(READ, w1=99, w3=0, w4=0, w5=0x0800, w6=999)
    for fixed, code in (
        ({}, "2001"), ({"w1": 2}, "2003"), ({"w1": 2, "w3": 2}, "2004"), ({"w1": 2, "w3": 3, "w4": 65535}, "2005"),
        ({"w1": 2, "w3": 2, "w4": 1}, "6007"), ({"w1": 2, "w3": 2, "w4": 1, "w5": 0x0700}, "2011"),
    ):  # fmt: skip
        assert refused(changed(wrong, **fixed)) == code


def refused(control: tuple[int, ...], **options: str) -> str:
    """The code with which an operation ends in its first scan without ACTIVE, and without a byte on the wire."""
    rig = Rig(**options)  # type: ignore[arg-type]
    rig.control(*control)
    rig.fill([0xEEEE, 0xDDDD])
    rig.set("m1_ENABLE", True)
    rig.scan()
    assert rig.outputs() == "E"
    code = rig.status()
    rig.set("m1_ENABLE", False)
    rig.scan(5)
    assert rig.databuf(2) == [0xEEEE, 0xDDDD]
    assert rig.peer.received == []
    assert rig.module(noc_words.STATISTICS + Statistic.TRANSMITTER_INTERRUPTS) == 0
    return code


# --- aborted ------------------------------------------------------------------------------------------------------------


def test_1001_aborted() -> None:
    rig = Rig(ScriptedPeer([]))
    rig.control(*READ)
    rig.set("m1_ENABLE", True)
    rig.scan(4)
    rig.set("m1_ABORT", True)
    rig.scan()
    assert (rig.outputs(), rig.status()) == ("E", "1001")
    rig.set("m1_ABORT", False)
    rig.scan()
    assert rig.outputs() == "A"


def test_1001_with_both_inputs_nothing_begins() -> None:
    rig = Rig()
    rig.control(*READ)
    rig.set("m1_ABORT", True)
    rig.set("m1_ENABLE", True)
    rig.scan(3)
    assert (rig.outputs(), rig.status(), rig.peer.received) == ("E", "1001", [])
    rig.set("m1_ENABLE", False)
    rig.scan()
    assert rig.outputs() == ""


@pytest.mark.parametrize("restart", ["warm", "mode"])
def test_1002_aborted_by_a_warm_start(restart: str) -> None:
    rig = Rig(ScriptedPeer([]))
    rig.control(*READ)
    rig.set("m1_ENABLE", True)
    rig.scan(4)
    assert rig.outputs() == "A"
    if restart == "warm":
        rig.plc.warm_start()
    else:
        rig.plc.mode = Mode.PROGRAM
        rig.plc.mode = Mode.RUN
    rig.scan()
    assert (rig.outputs(), rig.status()) == ("E", "1002")
    rig.scan()
    assert rig.outputs() == ""
    rig.scan(4)
    assert rig.operate(*LOCAL) == "0000"


def test_a_cold_start_and_an_operation_that_had_ended_are_no_1002() -> None:
    rig = Rig()
    rig.operate(*READ)
    rig.plc.warm_start()
    rig.scan()
    assert (rig.outputs(), rig.status()) == ("", "0000")
    rig.control(*READ)
    rig.set("m1_ENABLE", True)
    rig.scan(2)
    rig.plc.cold_start()
    rig.scan()
    assert rig.outputs() == ""


@pytest.mark.slow
@each_of("word", [1, 3, 4, 5, 6, 7, 8, 9, 10, 11])
def test_2002_control_changed_while_the_operation_runs(word: int) -> None:
    rig = Rig(ScriptedPeer([]))
    rig.control(*BOTH)
    rig.set("m1_ENABLE", True)
    rig.scan(4)
    rig.set(f"m1_CONTROL[{word}]", 77)
    rig.scan()
    assert (rig.outputs(), rig.status()) == ("E", "2002")


def test_words_that_the_operation_does_not_have_may_change_and_so_may_the_result() -> None:
    rig = Rig(ScriptedPeer([]))
    rig.control(*READ)
    rig.set("m1_ENABLE", True)
    rig.scan(4)
    for word in (2, 10, 11):
        rig.set(f"m1_CONTROL[{word}]", 77)
    rig.scan()
    assert rig.outputs() == "A"


# --- what the server says -----------------------------------------------------------------------------------------------


@pytest.mark.slow
@each_of("exception", [0, 1, 2, 3, 4, 5, 6, 7, 8, 10, 11, 255])
@each_of(("control", "function"), [(READ, 3), (WRITE, 16), (BOTH, 23), (REMOTE, 8), (CLEAR, 8)])
def test_30ss_exceptions(exception: int, control: tuple[int, ...], function: int) -> None:
    """3000, the general failure, is an exception with code 0."""
    rig = Rig(ModbusPeer(ModbusServer(refusals={function: exception}, functions=(3, 8, 16, 23))))
    rig.server.refusals[function] = exception
    rig.fill([0xEEEE])
    assert rig.operate(*control) == f"30{exception:02X}"
    assert rig.databuf(1) == [0xEEEE]
    rig.server.refusals.clear()
    if function != 8:
        assert rig.operate(*control) == "0000"


def test_3001_a_foreign_server_does_not_know_the_statistics() -> None:
    rig = Rig()
    assert rig.operate(*REMOTE) == "3001"
    assert rig.operate(*CLEAR) == "3001"


def test_3002_registers_that_the_server_does_not_have() -> None:
    rig = Rig(ModbusPeer(ModbusServer(holding_registers=10)))
    assert rig.operate(*changed(READ, w4=9)) == "3002"
    assert rig.operate(*changed(READ, w4=8)) == "0000"


def _pdu(change: Callable[[bytes], bytes]) -> ModbusPeer:
    def reply(frame: bytes) -> list[Action]:
        pdu = change(frame[7:])
        return [Say(frame[:4] + (1 + len(pdu)).to_bytes(2, "big") + frame[6:7] + pdu)]

    return ModbusPeer(ModbusServer(functions=(3, 8, 16, 23)), reply)


STATISTICS = bytes.fromhex("08 0015 0003 004C") + bytes(76)
WRONG_ANSWERS: list[tuple[tuple[int, ...], Callable[[bytes], bytes]]] = [
    (READ, lambda pdu: b"\x04" + pdu[1:]),  # another function
    (READ, lambda pdu: b"\x84\x02"),  # an exception to another function
    (READ, lambda pdu: b"\x83\x02\x00"),  # exceptions of wrong sizes
    (READ, lambda pdu: b"\x83"),
    (READ, lambda pdu: pdu[:1] + b"\x05" + pdu[2:]),  # byte counts
    (READ, lambda pdu: pdu[:1] + b"\x04" + pdu[2:6]),
    (READ, lambda pdu: pdu + b"\0"),  # sizes
    (READ, lambda pdu: pdu[:-1]),
    (WRITE, lambda pdu: pdu[:1] + b"\0\1" + pdu[3:]),  # echoes
    (WRITE, lambda pdu: pdu[:3] + b"\0\1"),
    (WRITE, lambda pdu: pdu[:4]),
    (BOTH, lambda pdu: pdu[:1] + b"\x08" + pdu[2:]),
    (BOTH, lambda pdu: pdu[:-2]),
    (REMOTE, lambda pdu: STATISTICS[:-2]),
    (REMOTE, lambda pdu: STATISTICS[:6] + b"\x4a" + STATISTICS[7:]),
    (REMOTE, lambda pdu: STATISTICS[:4] + b"\4" + STATISTICS[5:]),
    (REMOTE, lambda pdu: STATISTICS[:2] + b"\x14" + STATISTICS[3:]),
    (CLEAR, lambda pdu: b"\x08\x00\x15\x00\x03"),
    (CLEAR, lambda pdu: b"\x08\x00\x15\x00\x04\0\0"),
]


@pytest.mark.slow
@each_of("number", range(len(WRONG_ANSWERS)))
def test_4001_answers_that_are_inconsistent(number: int) -> None:
    control, change = WRONG_ANSWERS[number]
    rig = Rig(_pdu(change))
    rig.fill([0xEEEE])
    assert rig.operate(*control) == "4001"
    assert rig.databuf(1) == [0xEEEE]


@each_of("header", ["0000 0001 0005", "0000 0000 0001", "0000 0000 00FF", "0000 0000 FFFF"])
def test_4001_a_stream_that_is_out_of_step(header: str) -> None:
    """The connection is left; the next operation has a new one."""
    replies = [bytes.fromhex(header) + bytes(20)]
    rig = Rig(ModbusPeer(None, lambda frame: [Say(replies.pop() if replies else frame)]))
    assert rig.operate(*READ) == "4001"
    assert rig.operate(*READ) == "0000"


# --- what the network does ----------------------------------------------------------------------------------------------


def test_503d_refused() -> None:
    assert Rig(refused=True).operate(*READ) == "503D"


@pytest.mark.slow
@each_of(("errno", "number"), [(name, number) for name, number in ERRNO.items()])
def test_50xx_an_open_that_fails(errno: str, number: int) -> None:
    rig = Rig()
    rig.network.faults.append(Fault(error=errno))
    assert rig.operate(*READ) == f"50{number:02X}"
    rig.network.faults.clear()
    assert rig.operate(*READ) == "0000"


def test_5031_and_500d_addresses_that_nobody_has() -> None:
    assert Rig().operate(*READ[:5], 0, 0, 0, 0) == "5031"
    assert Rig().operate(*READ[:5], 255, 255, 255, 255) == "500D"


@pytest.mark.parametrize("action", [Reset(), Leave(), Fin()])
def test_5036_the_server_breaks_or_closes_before_it_has_answered(action: Action) -> None:
    rig = Rig(ScriptedPeer([action]))
    assert rig.operate(*READ) == "5036"


def test_5036_in_the_middle_of_a_reply() -> None:
    rig = Rig(ScriptedPeer([Say(bytes.fromhex("0001 0000 0009 00 03 06 00")), Leave()]))
    assert rig.operate(*READ) == "5036"


@pytest.mark.slow
def test_503c_nobody_answers_the_call() -> None:
    class Deaf(Station):
        deaf = True

    rig = Rig(Deaf())
    assert rig.operate(*READ) == "503C"
    assert 10 <= rig.plc.now_ns / 1e9 < 10.2


@pytest.mark.slow
def test_503c_no_reply() -> None:
    rig = Rig(ScriptedPeer([]), options="Reply_Time := T#300ms")
    assert rig.operate(*READ) == "503C"
    assert 0.3 <= rig.plc.now_ns / 1e9 < 0.4


@pytest.mark.slow
def test_a_reply_that_is_late_is_not_taken_for_another_one() -> None:
    late = [300_000_000]
    rig = Rig(ModbusPeer(None, lambda frame: [Say(frame, late.pop() if late else 0)]), options="Reply_Time := T#200ms")
    rig.server.holding_registers[0] = 5
    assert rig.operate(*READ) == "503C"
    rig.server.holding_registers[0] = 6
    assert rig.operate(*READ) == "0000"
    assert rig.databuf(1) == [6]
    rig.scan(40)
    assert rig.operate(*READ) == "0000"


def test_a_reply_to_an_aborted_operation_is_passed_over_on_the_same_connection() -> None:
    late = [50_000_000]
    rig = Rig(ModbusPeer(None, lambda frame: [Say(frame, late.pop() if late else 60_000_000)]))
    rig.server.holding_registers[0] = 5
    rig.control(*READ)
    rig.set("m1_ENABLE", True)
    rig.scan(3)
    rig.set("m1_ABORT", True)
    rig.scan()
    rig.set("m1_ABORT", False)
    rig.set("m1_ENABLE", False)
    rig.scan()
    rig.server.holding_registers[0] = 6
    assert rig.operate(*READ) == "0000"
    assert rig.databuf(1) == [6]
    assert [frame[1] for frame in rig.peer.received] == [1, 2]


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] * ("flood" in name)) for name in MISDEEDS])
def test_misdeeds_of_a_server(name: str) -> None:
    """Right data or a code that the README explains; and the next operation with a good server works."""
    misdeed = [MISDEEDS[name]]
    rig = Rig(ModbusPeer(None, lambda frame: misdeed[0](frame) if misdeed else [Say(frame)]), options="Reply_Time := T#700ms")
    for number in range(3):
        rig.server.holding_registers[number] = 0x1200 + number
    rig.fill([0xEEEE] * 4)
    code = rig.operate(*READ)
    assert rig.databuf(4) == ([0x1200, 0x1201, 0x1202] if code == "0000" else [0xEEEE] * 3) + [0xEEEE]
    assert code == "0000" or code in documented()
    misdeed.clear()
    for _ in range(8):
        rig.scan(100)
        if rig.operate(*READ) == "0000":
            break
    assert rig.operate(*READ) == "0000"
    assert rig.databuf(3) == [0x1200, 0x1201, 0x1202]


@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow) if "floods" in name else name
                                  for name in RUDE_PEERS])
def test_rude_servers(name: str) -> None:
    """Right data or a documented code from a server that misbehaves as a whole, time after time; then a good one serves."""
    server = ModbusServer()
    for number in range(3):
        server.holding_registers[number] = 0x1200 + number
    rig = Rig(RUDE_PEERS[name](server), options="Reply_Time := T#300ms, Open_Time := T#300ms")
    for _ in range(4):
        rig.fill([0xEEEE] * 4)
        code = rig.operate(*READ)
        assert rig.databuf(4) == ([0x1200, 0x1201, 0x1202] if code == "0000" else [0xEEEE] * 3) + [0xEEEE]
        assert code in documented() | {"0000"}
        rig.scan(7)
    rig.network.place(SERVER, ModbusPeer(server))
    assert "0000" in [rig.operate(*READ) for _ in range(3)]
    assert rig.operate(*READ) == "0000"


def documented() -> set[str]:
    """The codes that the library's README explains."""
    readme = (data_folder("fblib") / "schneider" / "mbp_mstr" / "README.md").read_text(encoding="utf-8")
    table = readme.partition("## Results")[2].partition("\n## ")[0]
    assert "3001 to 30FF" in table
    return set(re.findall(r"\b[0-9A-F]{4}\b", table)) | {f"{code:04X}" for code in range(0x3001, 0x3100)}


def test_each_code_that_a_test_provokes_is_documented() -> None:
    text = Path(__file__).read_text(encoding="utf-8")
    provoked = set(re.findall(r'"([0-9A-F]{4})"', text)) | {f"50{number:02X}" for number in ERRNO.values()}
    assert provoked - {"0000"} <= documented()
