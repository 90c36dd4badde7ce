"""MBP_MSTR: each operation with its CONTROL words, DATABUF, and every byte on the wire; the sheet's examples among them."""

from __future__ import annotations

import noc_words
import pytest
from mstr_rig import SERVER_IP, Rig
from rows import each_of, first_quick

from fbvm.net.peers import Leave, ModbusPeer, Say
from fbvm.units.port.noc import Noc
from fbvm.wire.link import Peer

READ, WRITE, READ_WRITE = 2, 1, 23
SHEET = (192, 168, 1, 7)
"""The address in the sheet's notes: octet 4 (most significant) 192, 3 168, 2 1, 1 7."""


# --- the worked examples of the sheet, byte for byte --------------------------------------------------------------------


def sheet_rig() -> tuple[Rig, ModbusPeer]:
    rig, peer = Rig(refused=True), ModbusPeer()
    rig.network.place(Peer("192.168.1.7", 502), peer)
    return rig, peer


@each_of(("control", "sent", "replied"), [
    # read from %MW1 and from %MW49
    ((READ, 0, 1, 1, 0x0700), "00 01 00 00 00 06 00 03 00 00 00 01", [0]),
    ((READ, 0, 3, 49, 0x0700), "00 01 00 00 00 06 00 03 00 30 00 03", [48, 49, 50]),
    # slot 7 and MET index 6 in the routing register
    ((READ, 0, 1, 49, 0x0706), "00 01 00 00 00 06 06 03 00 30 00 01", [48]),
    ((READ, 0, 125, 1, 0x0700), "00 01 00 00 00 06 00 03 00 00 00 7D", list(range(125))),
])  # fmt: skip
def test_reading_as_the_sheet_has_it(control: tuple[int, ...], sent: str, replied: list[int]) -> None:
    rig, peer = sheet_rig()
    for number in range(200):
        peer.server.holding_registers[number] = number
    assert rig.operate(*control, *SHEET) == "0000"
    assert [frame.hex(" ").upper() for frame in peer.received] == [sent]
    assert rig.databuf(len(replied)) == replied


@pytest.mark.parametrize(("control", "sent"), [
    ((WRITE, 0, 1, 1, 0x0700), "00 01 00 00 00 09 00 10 00 00 00 01 02 12 34"),
    ((WRITE, 0, 3, 49, 0x0706), "00 01 00 00 00 0D 06 10 00 30 00 03 06 12 34 FF FF 00 01"),
])
def test_writing_as_the_sheet_has_it(control: tuple[int, ...], sent: str) -> None:
    rig, peer = sheet_rig()
    rig.fill([0x1234, 0xFFFF, 0x0001])
    assert rig.operate(*control, *SHEET) == "0000"
    assert [frame.hex(" ").upper() for frame in peer.received] == [sent]
    first = control[3] - 1
    assert list(peer.server.holding_registers[first : first + control[2]]) == [0x1234, 0xFFFF, 0x0001][: control[2]]


def test_reading_and_writing_as_the_sheet_has_it() -> None:
    """Written to %MW1, read from %MW49; the written words stand in DATABUF, the read ones come there."""
    rig, peer = sheet_rig()
    for number in range(100):
        peer.server.holding_registers[number] = number
    rig.fill([0xABCD, 0x0102, 7])
    assert rig.operate(READ_WRITE, 0, 2, 1, 0x0700, *SHEET, 3, 49) == "0000"
    assert [frame.hex(" ").upper() for frame in peer.received] == [
        "00 01 00 00 00 0F 00 17 00 30 00 03 00 00 00 02 04 AB CD 01 02"]
    assert rig.databuf(4) == [48, 49, 50, 0]
    assert list(peer.server.holding_registers[:3]) == [0xABCD, 0x0102, 2]


def test_it_writes_before_it_reads() -> None:
    rig = Rig()
    rig.fill([11, 22])
    assert rig.operate(READ_WRITE, 0, 2, 5, 0x0700, *SERVER_IP, 3, 4) == "0000"
    assert rig.databuf(3) == [0, 11, 22]


# --- lengths and registers at their limits ------------------------------------------------------------------------------


def test_the_last_registers_are_read_while_others_are_written() -> None:
    rig = Rig()
    rig.server.holding_registers[65534], rig.server.holding_registers[65535] = 0x1111, 0x2222
    assert rig.operate(READ_WRITE, 0, 1, 1, 0x0700, *SERVER_IP, 2, 65535) == "0000"
    assert rig.databuf(2) == [0x1111, 0x2222]


@pytest.mark.slow
@each_of(("control", "length"), [
    ((WRITE, 0, 123, 65414, 0x07FE), 259),
    ((READ, 0, 125, 65412, 0x07FF), 12),
    ((READ_WRITE, 0, 121, 65416, 0x0701), 259),
    ((READ, 0, 1, 65535, 0x0700), 12),
    ((READ, 0, 2, 65535, 0x0700), 12),
])  # fmt: skip
def test_the_longest_and_the_last(control: tuple[int, ...], length: int) -> None:
    rig = Rig()
    words = [3 * number + 0x8000 for number in range(125)]
    rig.fill(words)
    last = rig.server.holding_registers
    if control[0] == READ:
        for number in range(control[2]):
            last[control[3] - 1 + number] = words[number] ^ 0xFFFF
    assert rig.operate(*control, *SERVER_IP, 125, 1) == "0000"
    [frame] = rig.peer.received
    assert (len(frame), frame[6]) == (length, control[4] & 0xFF)
    if control[0] == READ:
        assert rig.databuf(control[2]) == [word ^ 0xFFFF for word in words[: control[2]]]
    else:
        assert list(last[control[3] - 1 : control[3] - 1 + control[2]]) == words[: control[2]]


@each_of("unit", [0, 1, 247, 254, 255])
def test_the_unit_identifier_is_the_low_byte_of_the_routing_register(unit: int) -> None:
    rig = Rig()
    assert rig.operate(READ, 0, 1, 1, 0x0700 | unit, *SERVER_IP) == "0000"
    assert rig.peer.received[0][6] == unit


def test_transactions_are_counted_over_all_operations() -> None:
    rig = Rig()
    rig.plc.write("MSTR_Transaction", 0xFFFE)
    for _ in range(3):
        rig.operate(READ, 0, 1, 1, 0x0700, *SERVER_IP)
    assert [frame[:2] for frame in rig.peer.received] == [b"\xff\xff", b"\0\0", b"\0\1"]


def test_one_connection_serves_operations_that_follow_one_another() -> None:
    callers = []

    class Counted(ModbusPeer):
        def accept(self, caller: Peer):  # type: ignore[no-untyped-def]
            callers.append(caller)
            return super().accept(caller)

    rig = Rig(Counted())
    other = Peer("192.168.250.3", 502)
    rig.network.place(other, rig.peer)
    for last in (2, 2, 3, 2, 3):
        assert rig.operate(READ, 0, 1, 1, 0x0700, 192, 168, 250, last) == "0000"
    assert len(callers) == 2
    assert [frame[1] for frame in rig.peer.received] == [1, 2, 3, 4, 5]


def test_a_server_that_has_closed_is_called_again() -> None:
    rig = Rig(ModbusPeer(None, lambda frame: [Say(frame), Leave()]))
    for _ in range(3):
        assert rig.operate(READ, 0, 1, 1, 0x0700, *SERVER_IP) == "0000"
        rig.scan(3)
    assert len(rig.peer.received) == 3


@pytest.mark.slow
def test_the_lines_are_used_again_when_all_are_taken() -> None:
    """32 connections stay open; the next server takes over the first line."""
    rig = Rig(refused=True)
    peer = ModbusPeer()
    for last in range(100, 140):
        rig.network.place(Peer(f"192.168.250.{last}", 502), peer)
    for last in range(100, 140):
        assert rig.operate(READ, 0, 1, 1, 0x0700, 192, 168, 250, last) == "0000"
    assert rig.operate(READ, 0, 1, 1, 0x0700, 192, 168, 250, 139) == "0000"
    assert len(peer.received) == 41


# --- arrays -------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("kind", first_quick(["INT", "UINT", "WORD"]))
@pytest.mark.parametrize("bounds", first_quick(["1..11", "0..10", "-5..5", "100..200"]))
def test_control_and_databuf_of_any_type_and_base(kind: str, bounds: str) -> None:
    rig = Rig(control=f"ARRAY[{bounds}] OF {kind}", databuf=f"ARRAY[{bounds}] OF {kind}")
    rig.fill([0x8001, 0x7FFF])
    assert rig.operate(WRITE, 0, 2, 40001, 0x07FF, *SERVER_IP) == "0000"
    assert list(rig.server.holding_registers[40000:40002]) == [0x8001, 0x7FFF]
    rig.fill([0, 0])
    assert rig.operate(READ, 0, 2, 40001, 0x07FF, *SERVER_IP) == "0000"
    assert rig.databuf(2) == [0x8001, 0x7FFF]
    assert rig.operate(0xFFF0, 0, 1, 1, 0x0700, 2, 0, 0, 0) == "0000"


@pytest.mark.slow
def test_control_and_databuf_in_mw() -> None:
    """As in Control Expert, where both have to lie there."""
    located = """
    PROGRAM Main
    VAR
        m1 : MBP_MSTR; m1_ENABLE, m1_ABORT : BOOL;
        m1_CONTROL AT %MW100 : ARRAY[1..9] OF INT := [2, 0, 2, 10, 16#0700, 192, 168, 250, 2];
        m1_DATABUF AT %MW110 : ARRAY[1..10] OF INT;
    END_VAR
        m1(ENABLE := m1_ENABLE, ABORT := m1_ABORT, CONTROL := m1_CONTROL, DATABUF := m1_DATABUF);
    END_PROGRAM
    """
    rig = Rig(text=located)
    rig.server.holding_registers[9:11] = type(rig.server.holding_registers)("H", [5, 6])
    assert rig.operate() == "0000"
    assert rig.plc.read("%MW110..%MW112") == [5, 6, 0]


# --- what the module does by itself -------------------------------------------------------------------------------------


def test_local_statistics_end_in_the_same_scan_and_send_nothing() -> None:
    rig = Rig(noc=Noc(address="198.202.137.113"))
    rig.control(3, 0, 38, 0, 0x0700)
    rig.set("m1_ENABLE", True)
    rig.scan()
    assert (rig.outputs(), rig.status()) == ("S", "0000")
    assert rig.databuf(4) == [0x0000, 0x5400, 0x1234, 0x8000 | 0x1000 | 14 << 4 | 7]
    assert rig.databuf(38)[36:] == [0x8971, 0xC6CA]
    assert rig.peer.received == []


@pytest.mark.slow
@each_of(("length", "first"), [(1, 0), (3, 0), (2, 36), (1, 37), (32, 4), (38, 0)])
def test_a_part_of_the_table(length: int, first: int) -> None:
    rig = Rig()
    for number in range(4, 36):
        rig.plc.write(f"MSTR_Modules[8].Statistics[{number}]", 1000 + number)
    rig.fill([0xEEEE] * 50)
    assert rig.operate(3, 0, length, first, 0x0700) == "0000"
    table = [rig.module(noc_words.STATISTICS + number) for number in range(38)]
    assert rig.databuf(50) == table[first : first + length] + [0xEEEE] * (50 - length)


def test_clearing_local_statistics_keeps_addresses_and_status() -> None:
    rig = Rig()
    rig.operate(READ, 0, 1, 1, 0x0700, *SERVER_IP)
    rig.operate(3, 0, 38, 0, 0x0700)
    before = rig.databuf(38)
    assert before[4:8] == [2, 0, 2, 0]
    assert rig.operate(4, 0, 0, 0, 0x0700) == "0000"
    rig.operate(3, 0, 38, 0, 0x0700)
    after = rig.databuf(38)
    assert after[:4] + after[36:] == before[:4] + before[36:]
    assert after[4:36] == [0] * 32


def test_the_counters_are_those_of_what_passed() -> None:
    """Connect and two requests go out; the answer to the connect and two replies come in."""
    rig = Rig()
    for _ in range(2):
        rig.operate(READ, 0, 1, 1, 0x0700, *SERVER_IP)
    rig.operate(3, 0, 4, 4, 0x0700)
    assert rig.databuf(4) == [3, 0, 3, 0]


def test_a_restart_ends_when_the_module_is_ready_again() -> None:
    rig = Rig()
    rig.operate(READ, 0, 1, 1, 0x0700, *SERVER_IP)
    rig.operate(0xFFF0, 0, 1, 1, 0x0700, 0, 0, 0, 0)
    assert rig.module(noc_words.SERVICES) == 0
    rig.control(10, 0xFFFF, 0, 0, 0x0700)
    rig.set("m1_ENABLE", True)
    assert rig.chart(9, "m1.ACTIVE", "m1.SUCCESS", "m1.ERROR", "m1_CONTROL[2]") == """
        Main.m1.ACTIVE      ######.##
        Main.m1.SUCCESS     ......#..
        Main.m1.ERROR       .........
        Main.m1_CONTROL[2]  0
    """
    rig.set("m1_ENABLE", False)
    rig.scan(10)
    assert rig.module(noc_words.SERVICES) == 3
    rig.operate(3, 0, 38, 0, 0x0700)
    assert rig.databuf(38)[16:18] == [2, 0]
    assert rig.operate(READ, 0, 1, 1, 0x0700, *SERVER_IP) == "0000"


# --- operation FFF0 -----------------------------------------------------------------------------------------------------

FTP, HTTP, BOTH = 1, 2, 3


def services(rig: Rig, wanted: int) -> str:
    return rig.operate(0xFFF0, 0, 1, 1, 0x0700, wanted, 0, 0, 0)


@pytest.mark.parametrize("wanted", [0, FTP, HTTP])
def test_services_are_turned_off_and_on_again(wanted: int) -> None:
    rig = Rig()
    assert services(rig, wanted) == "0000"
    assert rig.module(noc_words.SERVICES) == wanted
    rig.scan(200)
    assert services(rig, BOTH) == "0000"
    assert rig.module(noc_words.SERVICES) == BOTH
    assert rig.peer.received == []


def test_services_in_the_state_asked_for() -> None:
    rig = Rig()
    assert services(rig, BOTH) == "4001"
    assert rig.module(noc_words.SERVICES) == BOTH


@pytest.mark.slow
def test_a_second_call_within_2_s_whatever_the_first_one_returned() -> None:
    rig = Rig()
    for first in (BOTH, 0, 4):
        rig.scan(201)
        services(rig, first)
        before = rig.module(noc_words.SERVICES)
        assert services(rig, HTTP) == "5068"
        assert rig.module(noc_words.SERVICES) == before
        rig.scan(190)
        assert services(rig, HTTP) == "5068", "the refused call counts, too"


def test_the_2_s_end_after_2_s() -> None:
    rig = Rig()
    services(rig, 0)
    rig.scan(197)
    assert services(rig, BOTH) == "5068"
    rig.scan(198)
    assert services(rig, BOTH) == "0000"


def test_each_module_has_its_own_2_s() -> None:
    rig = Rig()
    rig.plc.attach(Noc(9, "192.168.250.29"), rig.network)
    assert services(rig, 0) == "0000"
    assert rig.operate(0xFFF0, 0, 1, 1, 0x0900, 0, 0, 0, 0) == "0000"
    assert rig.module(noc_words.SERVICES, 9) == 0


@each_of(("configured", "wanted", "expected"), [
    (FTP, BOTH, "5069"), (FTP, HTTP, "5069"), (FTP, 0, "0000"), (FTP, FTP, "4001"), (0, FTP, "5069"), (0, 0, "4001"),
    (HTTP, 0, "0000"), (HTTP, BOTH, "5069"),
])  # fmt: skip
def test_services_that_are_configured_off(configured: int, wanted: int, expected: str) -> None:
    """Row by row of the sheet's table, for the pair; only a change of what is configured off is refused."""
    rig = Rig(noc=Noc(ftp=bool(configured & FTP), http=bool(configured & HTTP)))
    assert services(rig, wanted) == expected
    assert rig.module(noc_words.SERVICES) == (wanted if expected == "0000" else configured)


@pytest.mark.parametrize("wanted", [0, FTP, HTTP, BOTH])
def test_any_action_is_refused_by_the_letter(wanted: int) -> None:
    rig = Rig(options="Strict_5069 := TRUE", noc=Noc(http=False))
    assert services(rig, wanted) == "5069"


@each_of("wrong", [
    (0xFFF0, 0, 0, 1, 0x0700, 0, 0, 0, 0), (0xFFF0, 0, 1, 0, 0x0700, 0, 0, 0, 0), (0xFFF0, 0, 2, 1, 0x0700, 0, 0, 0, 0),
    (0xFFF0, 0, 1, 1, 0x0700, 4, 0, 0, 0), (0xFFF0, 0, 1, 1, 0x0700, 0x8000, 0, 0, 0),
    (0xFFF0, 0, 1, 1, 0x0700, 0, 1, 0, 0), (0xFFF0, 0, 1, 1, 0x0700, 0, 0, 1, 0), (0xFFF0, 0, 1, 1, 0x0700, 0, 0, 0, 1),
])  # fmt: skip
def test_wrong_control_data(wrong: tuple[int, ...]) -> None:
    rig = Rig()
    assert rig.operate(*wrong) == "2004"
    assert rig.module(noc_words.SERVICES) == BOTH


def test_the_order_of_its_checks_assumed() -> None:
    """Wrong data before 5068, that before 5069, that before 4001."""
    rig = Rig(noc=Noc(http=False))
    services(rig, FTP)
    assert rig.operate(0xFFF0, 0, 7, 1, 0x0700, HTTP, 0, 0, 0) == "2004"
    assert services(rig, HTTP) == "5068"
    rig.scan(201)
    assert services(rig, HTTP) == "5069"


def test_a_restart_restores_the_configuration_for_the_services() -> None:
    rig = Rig()
    services(rig, 0)
    rig.operate(10, 0, 0, 0, 0x0700)
    rig.scan(200)
    assert services(rig, BOTH) == "4001"
