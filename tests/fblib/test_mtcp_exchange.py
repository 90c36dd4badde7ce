"""One exchange of MTCP_ETN_Fn03, Fn06 and Fn10, scan by scan, and the frames of the sheet's examples in D memory."""

from __future__ import annotations

import pytest
from mtcp_rig import Rig, answering
from rows import each_of

from fbvm.net.peers import Fin, Say, ScriptedPeer

PINS = ("rd_Cmd", "rd.Rcv_Counter", "rd.Error")
WORDS = ("CIO 1519.03", "CIO 1519.04", "CIO 1509.13", "D30001", "D30023")
READ = "Fn03(Register_Address := 1000, Register_Qty := 3, RespData_DM := 200)"
WRITE_ONE = "Fn06(Register_Address := 2000, Value := 16#3AC5)"
WRITE = "Fn10(Register_Address := 1000, Register_Qty := 2, DataAddress_DM := 300)"


def reading(**options: object) -> Rig:
    rig = Rig(rd=READ, **options).connect()  # type: ignore[arg-type]
    for offset, value in enumerate((0xAB12, 0x5678, 0x9713)):
        rig.server.holding_registers[1000 + offset] = value
    return rig


# --- charts: one column is the memory at the end of a scan, after its I/O refresh -------------------------------------


def test_fn03() -> None:
    rig = reading()
    rig.set("rd_Cmd", True)
    assert (
        rig.chart(6, *PINS, *WORDS, "D200", "D202")
        == """
        Main.rd_Cmd          ######
        Main.rd.Rcv_Counter  0   |1
        Main.rd.Error        ......
        CIO1519.03           #.....       Send Request Switch
        CIO1519.04           ..#...       Receive Request Switch
        CIO1509.13           .#....       TCP Data Received Flag
        D30001               0||0         = 0, 15, 0   Number of Bytes Received
        D30023               12|15        Number of Bytes to Send or Receive
        D200                 0   |43794
        D202                 0   |38675
    """
    )


@pytest.mark.slow
def test_fn06() -> None:
    rig = Rig(rd=WRITE_ONE).connect()
    rig.set("rd_Cmd", True)
    assert (
        rig.chart(6, *PINS, *WORDS)
        == """
        Main.rd_Cmd          ######
        Main.rd.Rcv_Counter  0   |1
        Main.rd.Error        ......
        CIO1519.03           #.....   Send Request Switch
        CIO1519.04           ..#...   Receive Request Switch
        CIO1509.13           .#....   TCP Data Received Flag
        D30001               0||0     = 0, 12, 0   Number of Bytes Received
        D30023               12       Number of Bytes to Send or Receive
    """
    )
    assert rig.server.holding_registers[2000] == 0x3AC5


def test_fn10() -> None:
    rig = Rig(rd=WRITE).connect()
    rig.fill(300, [0x3AC5, 0x9713])
    rig.set("rd_Cmd", True)
    assert (
        rig.chart(6, *PINS, *WORDS)
        == """
        Main.rd_Cmd          ######
        Main.rd.Rcv_Counter  0   |1
        Main.rd.Error        ......
        CIO1519.03           #.....   Send Request Switch
        CIO1519.04           ..#...   Receive Request Switch
        CIO1509.13           .#....   TCP Data Received Flag
        D30001               0||0     = 0, 12, 0   Number of Bytes Received
        D30023               17|12    Number of Bytes to Send or Receive
    """
    )
    assert list(rig.server.holding_registers[1000:1002]) == [0x3AC5, 0x9713]


def test_fn03_when_the_reply_is_an_exception() -> None:
    """Fifteen bytes were expected and nine came: first the six up to the length, then the rest."""
    rig = Rig(rd=READ.replace("1000", "65534")).connect()
    rig.set("rd_Cmd", True)
    assert (
        rig.chart(8, *PINS, "rd.Error_Code", *WORDS)
        == """
        Main.rd_Cmd          ########
        Main.rd.Rcv_Counter  0     |1
        Main.rd.Error        ......##
        Main.rd.Error_Code   0000h |0002h
        CIO1519.03           #.......       Send Request Switch
        CIO1519.04           ..#.#...       Receive Request Switch
        CIO1509.13           .#.#....       TCP Data Received Flag
        D30001               0||||0         = 0, 9, 0, 3, 0   Number of Bytes Received
        D30023               12|6|3         Number of Bytes to Send or Receive
    """
    )


def test_fn03_when_the_reply_comes_in_pieces() -> None:
    """A block does not ask for bytes that are not there yet."""
    pieces = answering(lambda frame: [Say(frame[:4]), Say(frame[4:9], 30_000_000), Say(frame[9:], 60_000_000)])
    rig = reading(peer=pieces)
    rig.set("rd_Cmd", True)
    assert (
        rig.chart(12, *PINS, *WORDS, "D200")
        == """
        Main.rd_Cmd          ############
        Main.rd.Rcv_Counter  0        |1
        Main.rd.Error        ............
        CIO1519.03           #...........      Send Request Switch
        CIO1519.04           ....#..#....      Receive Request Switch
        CIO1509.13           .###.##.....      TCP Data Received Flag
        D30001               0|4|||||0         = 0, 4, 9, 0, 3, 9, 0   Number of Bytes Received
        D30023               12  |6 |9         Number of Bytes to Send or Receive
        D200                 0        |43794
    """
    )


# --- the sheet's examples ---------------------------------------------------------------------------------------------

EXAMPLES = [
    ("Fn01(Coil_Address := 20, Coil_Qty := 19, RespData_DM := 200)", "01 00 14 00 13", "01 03 CD 6B 05"),
    (READ, "03 03 E8 00 03", "03 06 AB 12 56 78 97 13"),
    ("Fn05(Coil_Address := 34, Value := TRUE)", "05 00 22 FF 00", "05 00 22 FF 00"),
    (WRITE_ONE, "06 07 D0 3A C5", "06 07 D0 3A C5"),
    (WRITE, "10 03 E8 00 02 04 3A C5 97 13", "10 03 E8 00 02"),
    ("Fn0F(Coil_Address := 20, Coil_Qty := 10, DataAddress_DM := 302)", "0F 00 14 00 0A 02 3A 01", "0F 00 14 00 0A"),
]


def adu(transaction: int, pdu: str) -> str:
    size = len(pdu.split()) + 1
    return f"{transaction:04X} 0000 {size:04X} FF".replace(" ", "") + pdu.replace(" ", "")


@pytest.mark.slow
@each_of(("block", "request_pdu", "reply_pdu"), EXAMPLES)
def test_the_examples_of_the_sheet(block: str, request_pdu: str, reply_pdu: str) -> None:
    """The address of the 0F example is 0014: with the sheet's 0013 its bytes do not give its table."""
    rig = Rig(rd=block).connect()
    rig.fill(300, [0x3AC5, 0x9713, 0x013A])
    rig.server.holding_registers[1000:1003] = type(rig.server.holding_registers)("H", [0xAB12, 0x5678, 0x9713])
    for bit in range(19):
        rig.server.coils[20 + bit] = 0x56BCD >> bit & 1
    rig.command("rd")
    request, reply = adu(1, request_pdu), adu(1, reply_pdu)
    assert rig.frame(32500, len(request) // 2).replace(" ", "") == request
    assert rig.frame(32510, len(reply) // 2).replace(" ", "") == reply
    assert [frame.hex().upper() for frame in rig.peer.received] == [request]
    assert rig.result("rd") == (1, "")


def test_nineteen_bits_in_two_words() -> None:
    rig = Rig(rd=EXAMPLES[0][0]).connect()
    rig.fill(200, [0xFFFF] * 3)
    for bit in range(20):
        rig.server.coils[20 + bit] = 0xD6BCD >> bit & 1
    rig.command("rd")
    assert rig.words(200, 3) == [0x6BCD, 0x0005, 0xFFFF]


def test_ten_bits_written() -> None:
    rig = Rig(rd=EXAMPLES[5][0]).connect()
    rig.fill(302, [0xFD3A])
    rig.command("rd")
    assert rig.peer.received[0].hex().upper().endswith("0F0014000A023A01"), "bits behind the last coil are sent as 0"
    assert bytes(rig.server.coils[20:31]) == bytes([0, 1, 0, 1, 1, 1, 0, 0, 1, 0, 0])


# --- commands ---------------------------------------------------------------------------------------------------------


def test_a_command_acts_on_its_rising_edge() -> None:
    rig = reading()
    rig.set("rd_Cmd", True)
    rig.scan(30)
    assert rig.result("rd") == (1, "")
    rig.command("rd")
    assert rig.result("rd") == (1, ""), "it was TRUE before"
    rig.command("rd")
    assert rig.result("rd") == (2, "")


def test_transaction_numbers_differ() -> None:
    rig = reading()
    for _ in range(4):
        rig.command("rd")
    numbers = [frame[:2] for frame in rig.peer.received]
    assert len(set(numbers)) == 4


@pytest.mark.slow
@each_of(("slave", "sent"), [(0, 0xFF), (1, 1), (247, 247), (255, 255)])
def test_the_slave_id(slave: int, sent: int) -> None:
    rig = Rig(rd=READ.replace(")", f", SlaveID := {slave})")).connect()
    rig.command("rd")
    assert rig.peer.received[0][6] == sent
    assert rig.result("rd") == (1, "")


@pytest.mark.slow
def test_inputs_are_taken_at_the_edge() -> None:
    """What the program writes to the pins while a command runs is for the next one."""
    block = "Fn03(Register_Address := 1000, Register_Qty := 1, RespData_DM := Where)"
    rig = Rig(rd=block, more_variables="Where : UINT := 200;").connect()
    rig.server.holding_registers[1000] = 7
    rig.set("rd_Cmd", True)
    rig.scan()
    rig.set("Where", 40000)
    rig.scan(10)
    assert (rig.words(200, 1), rig.result("rd")) == ([7], (1, ""))


def test_en_is_passed_through() -> None:
    rig = reading()
    assert rig.get("rd.ENO")
    rig.set("rd_EN", False)
    rig.scan()
    assert not rig.get("rd.ENO")


def test_the_reply_counter_wraps() -> None:
    rig = reading()
    rig.set("rd.Exchange.Rcv_Counter", 65535)
    rig.command("rd")
    assert rig.result("rd") == (0, "")


def test_reply_and_end_of_the_connection_together() -> None:
    """The reply is taken before the socket is closed."""
    reply = bytes.fromhex("000100000009FF0306AB1256789713")
    rig = Rig(ScriptedPeer([Say(reply), Fin()]), rd=READ).connect()
    rig.set("rd_Cmd", True)
    assert (
        rig.chart(9, "conn.ENO", *PINS, "CIO 1519.04", "CIO 1519.05", "D30009", "D202")
        == """
        Main.conn.ENO        #####....
        Main.rd_Cmd          #########
        Main.rd.Rcv_Counter  0   |1
        Main.rd.Error        .........
        CIO1519.04           ..#......    Receive Request Switch
        CIO1519.05           ......#..    Close Request Switch
        D30009               4|5   ||0    = 4, 5, 8, 0   TCP Connection State
        D202                 0   |38675
    """
    )
