"""MB_TCP_SERVER: function codes, statuses scan by scan, data areas of any type, connections and their descriptions."""

from __future__ import annotations

import re
from pathlib import Path
from random import Random
from struct import pack, unpack
from typing import Any

import pytest
from mb_tcp_rig import ADDRESS, CYCLE_NS, Rig, image_of
from rows import each_of, first_quick

from fbvm.base.data import data_folder
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.units.port.tianxing import Tianxing
from fbvm.wire.link import Close, Connect, Grant, Send
from fbvm.wire.modbus import Adu

SHEET = """
PROGRAM Main
VAR
    MB_TCP_SERVER_2 : MB_TCP_SERVER; aa : BOOL; config : TCP_CONNECTCONFIG; bb : ARRAY[0..99] OF BOOL;
    dataarea : ARRAY[0..9] OF BYTE; dataarea_holding : ARRAY[1..100] OF INT; reg_datarea : ARRAY[0..9] OF DINT;
    n, dr, error : BOOL; xx : WORD;
END_VAR
MB_TCP_SERVER_2(
disconnect:=aa,
CONNECT:=config,
coil_dataarea:=bb,
discrete_dataarea:=dataarea,
holding_reg_dataarea:=dataarea_holding,
input_reg_dataarea:=reg_datarea,
NDR=>n,
DR=>dr,
ERROR=>error,
STATUS=>xx
);
END_PROGRAM
"""
"""The call of the sheet, its four slips mended: a blank in the name, a comma, a blank in dataarea_holding, input_."""


RUNG = (Path(__file__).resolve().parents[2] / "examples" / "mb_tcp_server.st").read_text(encoding="utf-8")
"""The same call as a rung."""


@pytest.mark.slow
@pytest.mark.parametrize("text", [SHEET, RUNG], ids=["text", "rung"])
def test_the_call_of_the_sheet(text: str) -> None:
    rig = Rig(text=text)
    rig.set("dataarea_holding[1]", -2)
    rig.set("reg_datarea[0]", 0x12345678)
    rig.set("bb[3]", True)
    client = rig.client().connect()
    assert client.ask("03 0000 0001") == "03 02 FF FE"
    assert client.ask("04 0000 0002") == "04 04 56 78 12 34"
    assert client.ask("01 0000 0008") == "01 01 08"
    assert client.ask("10 0001 0001 02 0102") == "10 00 01 00 01"
    assert rig.get("dataarea_holding[2]") == 0x0102
    assert (rig.get("n"), rig.get("dr"), rig.get("error"), rig.get("xx")) == (True, False, False, 0x7005)
    client.step()
    assert (rig.get("n"), rig.get("dr"), rig.get("error"), rig.get("xx")) == (False, False, False, 0x7006)


# --- function codes -----------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_each_function_code() -> None:
    rig = Rig()
    for number in (0, 2, 3, 9, 99):
        rig.set(f"coils[{number}]", True)
    rig.set("inputs[0]", 0b10110101)
    rig.set("inputs[9]", 0x80)
    rig.set("holding[0]", 0x1234)
    rig.set("registers[199]", 0xABCD)
    client = rig.client().connect()
    assert client.ask("01 0000 000A") == "01 02 0D 02"
    assert client.ask("01 0063 0001") == "01 01 01"
    assert client.ask("02 0000 0008") == "02 01 B5"
    assert client.ask("02 0002 0003") == "02 01 05"
    assert client.ask("02 004F 0001") == "02 01 01"
    assert client.ask("03 0000 0002") == "03 04 12 34 00 00"
    assert client.ask("04 00C7 0001") == "04 02 AB CD"
    assert client.ask("05 0001 FF00") == "05 00 01 FF 00"
    assert client.ask("05 0000 0000") == "05 00 00 00 00"
    assert client.ask("06 0001 BEEF") == "06 00 01 BE EF"
    assert client.ask("0F 0014 000A 02 CD01") == "0F 00 14 00 0A"
    assert client.ask("10 0010 0002 04 3AC5 9713") == "10 00 10 00 02"
    assert [rig.get(f"coils[{number}]") for number in range(4)] == [False, True, True, True]
    coils = [rig.get(f"coils[{number}]") for number in range(20, 31)]
    assert coils == [bool(0x1CD >> bit & 1) for bit in range(10)] + [False]
    assert [rig.get(f"holding[{number}]") for number in (1, 16, 17)] == [0xBEEF, 0x3AC5, 0x9713]


def test_each_bit_of_a_register_is_written_and_read_in_its_place() -> None:
    rig = Rig()
    client = rig.client().connect()
    single = "".join(f"{1 << bit:04X}" for bit in range(16))
    assert client.ask(f"10 0000 0010 20 {single}") == "10 00 00 00 10"
    assert [rig.get(f"holding[{bit}]") for bit in range(16)] == [1 << bit for bit in range(16)]
    assert client.ask("03 0000 0010").replace(" ", "") == f"0320{single}"


LONG = {"coils": "ARRAY[0..4000] OF BOOL", "inputs": "ARRAY[0..4000] OF BOOL"}


@pytest.mark.parametrize(("pdu", "head", "bytes_in_all"), [
    ("01 0000 07D0", "01 FA", 252), ("02 0001 07D0", "02 FA", 252), ("03 0000 007D", "03 FA", 252),
    ("04 0000 007D", "04 FA", 252), ("0F 0000 07B0 F6" + 246 * "FF", "0F 00 00 07 B0", 5),
    ("10 0000 007B F6" + 246 * "01", "10 00 00 00 7B", 5),
])  # fmt: skip
def test_the_most_at_once(pdu: str, head: str, bytes_in_all: int) -> None:
    reply = Rig(**LONG).client().connect().ask(pdu)
    assert reply.startswith(head)
    assert len(reply) == 3 * bytes_in_all - 1


def test_of_the_most_at_once_each_is_in_its_place() -> None:
    draw = Random(1)
    bits, words = [bool(draw.getrandbits(1)) for _ in range(4001)], [draw.getrandbits(16) for _ in range(200)]
    rig = Rig(**LONG)
    for name, values in (("coils", bits), ("inputs", bits), ("holding", words), ("registers", words)):
        rig.set(name, values)
    client = rig.client().connect()
    packed = sum(bit << at for at, bit in enumerate(bits[3:2003])).to_bytes(250, "little")
    for code in ("01", "02"):
        assert bytes.fromhex(client.ask(f"{code} 0003 07D0")) == bytes.fromhex(code) + b"\xfa" + packed
    for code in ("03", "04"):
        assert bytes.fromhex(client.ask(f"{code} 0004 007D")) == bytes.fromhex(code) + b"\xfa" + pack(">125H", *words[4:129])
    given = draw.randbytes(246)
    assert client.ask(f"0F 0005 07B0 F6 {given.hex()}") == "0F 00 05 07 B0"
    number = int.from_bytes(given, "little")
    assert rig.get("coils") == bits[:5] + [bool(number >> at & 1) for at in range(1968)] + bits[1973:]
    assert client.ask(f"10 0006 007B F6 {given.hex()}") == "10 00 06 00 7B"
    assert rig.get("holding") == words[:6] + list(unpack(">123H", given)) + words[129:]


REFUSED = {
    # 8381, exception 01
    "00": "8381 80 01", "07": "8381 87 01", "08 0000 1234": "8381 88 01", "0B": "8381 8B 01", "11": "8381 91 01",
    "14": "8381 94 01", "16 0000 0000 0000": "8381 96 01", "17 0000 0001 0000 0001 02 0000": "8381 97 01",
    "2B 0E 01 00": "8381 AB 01", "80": "8381 80 01", "FF": "8381 FF 01",
    # 8382, exception 03: sizes, byte counts, quantities
    "01": "8382 81 03", "01 0000 0001 00": "8382 81 03", "01 0000 0000": "8382 81 03", "01 0000 07D1": "8382 81 03",
    "02 0000": "8382 82 03", "02 0000 07D1": "8382 82 03", "03 0000 0000": "8382 83 03", "03 0000 007E": "8382 83 03",
    "03 0000 00": "8382 83 03", "04 0000 007E": "8382 84 03", "05 0000 FF": "8382 85 03", "05 0000 FF00 00": "8382 85 03",
    "06 0000": "8382 86 03", "06 0000 0000 00": "8382 86 03", "0F 0000 0000 00": "8382 8F 03",
    "0F 0000 000A 01 FF": "8382 8F 03", "0F 0000 000A 02 FF": "8382 8F 03", "0F 0000 07B1 F6" + 246 * "00": "8382 8F 03",
    "0F 0000 07B1 F7" + 247 * "00": "8382 8F 03",
    "0F 0000": "8382 8F 03", "10 0000 0001 02 00": "8382 90 03", "10 0000 0001 03 0000": "8382 90 03",
    "10 0000 007C F6" + 246 * "00": "8382 90 03", "10 0000 0001 02 000000": "8382 90 03", "10 0000 0000 00": "8382 90 03",
    # 8384, exception 03: the value of 05
    "05 0000 0001": "8384 85 03", "05 0000 FF01": "8384 85 03", "05 0000 00FF": "8384 85 03", "05 FFFF 1234": "8384 85 03",
    # 8383, exception 02
    "01 0064 0001": "8383 81 02", "01 0063 0002": "8383 81 02", "01 FFFF 0001": "8383 81 02", "02 0050 0001": "8383 82 02",
    "02 004F 0002": "8383 82 02", "03 00C8 0001": "8383 83 02", "03 00C7 0002": "8383 83 02", "04 00C8 0001": "8383 84 02",
    "05 0064 FF00": "8383 85 02", "06 00C8 0000": "8383 86 02", "0F 0063 0002 01 03": "8383 8F 02",
    "10 00C7 0002 04 00000000": "8383 90 02", "10 FFFF 0001 02 0000": "8383 90 02",
}  # fmt: skip


@pytest.mark.parametrize("pdu", REFUSED)
def test_what_is_refused_is_told_for_one_call_and_changes_nothing(pdu: str) -> None:
    status, _, reply = REFUSED[pdu].partition(" ")
    rig = Rig()
    client = rig.client().connect()
    rig.set("holding[0]", 7)
    client.step(2)
    words = [rig.get(f"holding[{number}]") for number in range(200)]
    client.submit(Send(1, Adu(9, 255, bytes.fromhex(pdu)).to_bytes()))
    told = rig.statuses(client, 5)
    assert told.count(f"{status} ERROR") == 1
    assert set(told) <= {"7006", "7005", f"{status} ERROR"}
    assert client.data == Adu(9, 255, bytes.fromhex(reply)).to_bytes()
    assert [rig.get(f"holding[{number}]") for number in range(200)] == words
    assert not any(rig.get(f"coils[{number}]") for number in range(100))


# --- scan by scan -------------------------------------------------------------------------------------------------------


def test_the_statuses_of_a_connection() -> None:
    rig = Rig()
    assert rig.status() == "0000", "before its first call"
    client = rig.client()
    rig.scan(3)
    assert rig.status() == "7002"
    client.submit(Connect(1, client.server))
    assert rig.statuses(client, 4) == ["7002", "7004", "7006", "7006"]
    client.submit(Send(1, Adu(1, 1, bytes.fromhex("10 0000 0001 02 0001")).to_bytes()))
    assert rig.statuses(client, 4) == ["7006", "7005 NDR", "7006", "7006"]
    client.submit(Send(1, Adu(1, 1, bytes.fromhex("03 0000 0001")).to_bytes()))
    assert rig.statuses(client, 4) == ["7006", "7005 DR", "7006", "7006"]
    client.submit(Send(1, Adu(1, 1, bytes.fromhex("03 FFFF 0001")).to_bytes()))
    assert rig.statuses(client, 4) == ["7006", "8383 ERROR", "7006", "7006"]
    client.submit(Close(1))
    assert rig.statuses(client, 5) == ["7006", "7007", "7002", "7002", "7002"]


@each_of(("pdu", "told"), [
    ("01 0000 0001", "DR"), ("02 0000 0001", "DR"), ("03 0000 0001", "DR"), ("04 0000 0001", "DR"), ("05 0000 FF00", "NDR"),
    ("06 0000 0001", "NDR"), ("0F 0000 0001 01 01", "NDR"), ("10 0000 0001 02 0001", "NDR"),
])  # fmt: skip
def test_data_read_and_new_data(pdu: str, told: str) -> None:
    """DR also for 02, which the sheet's list leaves out."""
    rig = Rig()
    client = rig.client().connect()
    client.submit(Send(1, Adu(1, 1, bytes.fromhex(pdu)).to_bytes()))
    assert rig.statuses(client, 4)[1:] == [f"7005 {told}", "7006", "7006"]


def test_requests_that_come_together_are_served_one_in_a_call() -> None:
    rig = Rig()
    client = rig.client().connect()
    frames = [Adu(number, 1, bytes.fromhex(pdu)).to_bytes()
              for number, pdu in enumerate(("06 0000 0001", "03 0000 0001", "03 FFFF 0001"))]
    client.submit(Send(1, b"".join(frames)))
    told = rig.statuses(client, 8)
    assert [status for status in told if status not in ("7006", "7005")] == ["7005 NDR", "7005 DR", "8383 ERROR"]
    assert len(client.data) == 12 + 11 + 9


@pytest.mark.slow
def test_a_client_that_does_not_take_its_replies() -> None:
    """7005 until the network takes the reply; the requests behind it wait, and are served when the client reads again."""
    rig = Rig()
    client = rig.client()
    rig.scan(2)
    client.submit(Connect(1, client.server))
    client.step(3)
    frames = [Adu(number, 1, bytes.fromhex("03 0000 007D")).to_bytes() for number in range(400)]
    client.submit(Send(1, b"".join(frames)))
    told = rig.statuses(client, 400)
    assert told[-30:] == ["7005"] * 30
    client.submit(Grant(1, 1 << 20))
    client.step(600)
    assert len(client.data) == 400 * 259


def test_a_frame_in_pieces() -> None:
    rig = Rig()
    client = rig.client().connect()
    frame = Adu(7, 3, bytes.fromhex("10 0000 0002 04 0001 0002")).to_bytes()
    for byte in frame[:-1]:
        client.submit(Send(1, bytes((byte,))))
        assert rig.statuses(client, 1) == ["7006"]
    client.submit(Send(1, frame[-1:]))
    assert "7005 NDR" in rig.statuses(client, 3)
    assert client.data == Adu(7, 3, bytes.fromhex("10 0000 0002")).to_bytes()


def test_disconnect() -> None:
    """A request that is there is not served any more; afterwards a client is waited for again."""
    rig = Rig()
    client = rig.client().connect()
    client.submit(Send(1, Adu(1, 1, bytes.fromhex("06 0000 0001")).to_bytes()))
    client.step()
    rig.set("stop", True)
    assert rig.statuses(client, 4) == ["7007"] * 4
    assert (client.end, rig.get("holding[0]")) == ("FIN", 0)
    client.submit(Close(1), Connect(1, client.server))
    client.step(3)
    assert client.end == "ECONNREFUSED"
    rig.set("stop", False)
    assert rig.statuses(client, 2) == ["7002", "7002"]
    assert client.connect().ask("03 0000 0001") == "03 02 00 00"


def test_an_active_connection_is_refused_as_long_as_it_is_asked_for() -> None:
    rig = Rig()
    client = rig.client().connect()
    rig.set("config.ActiveEstablished", True)
    assert rig.statuses(client, 3) == ["80BB ERROR"] * 3
    assert client.end == "FIN"
    rig.set("config.ActiveEstablished", False)
    assert rig.statuses(client, 2) == ["7002", "7002"]
    rig.set("stop", True)
    rig.set("config.ActiveEstablished", True)
    assert rig.statuses(client, 1) == ["80BB ERROR"], "before DISCONNECT"


def test_frames_that_are_none() -> None:
    """Another protocol is passed over, a length that cannot be ends the connection; nothing is sent."""
    rig = Rig()
    client = rig.client().connect()
    client.submit(Send(1, bytes.fromhex("0001 0001 0006 01 06 0000 0001")))
    assert rig.statuses(client, 4) == ["7006", "8380 ERROR", "7006", "7006"]
    assert (client.data, client.end, rig.get("holding[0]")) == (b"", "", 0)
    for header in ("0001 0000 0001 01", "0001 0000 0000", "0001 0000 00FF 01", "0001 0000 FFFF"):
        client.connect().submit(Send(1, bytes.fromhex(header)))
        assert rig.statuses(client, 4) == ["7006", "8380 ERROR", "7002", "7002"]
        assert (client.data, client.end) == (b"", "FIN")


@each_of("begun", ["00", "0001 0000 00", "0001 0000 0006", "0001 0000 0006 01 06 0000"])
def test_a_frame_that_never_ends(begun: str) -> None:
    rig = Rig()
    client = rig.client().connect()
    client.submit(Send(1, bytes.fromhex(begun)), Close(1))
    assert rig.statuses(client, 6) == ["7006", "8380 ERROR", "7007", "7002", "7002", "7002"]


def test_a_connection_that_breaks() -> None:
    rig = Rig()
    client = rig.client().connect()
    client.submit(Close(1, reset=True))
    assert rig.statuses(client, 4) == ["7006", "7007", "7002", "7002"]
    again = rig.client(51)
    again.submit(Connect(1, again.server))
    assert rig.statuses(again, 4) == ["7002", "7004", "7006", "7006"], "the program is told of the new one"


@each_of("end", [Close(1), Close(1, reset=True), Send(1, bytes.fromhex("0001 0000 00FF 01"))])
def test_the_program_is_told_of_each_new_connection(end: Close | Send) -> None:
    """However the one before has ended: by the client, by a reset, by the server when a frame cannot be one."""
    rig = Rig()
    client = rig.client().connect()
    client.submit(end)
    assert rig.statuses(client, 5)[-1] == "7002"
    again = rig.client(51)
    again.submit(Connect(1, again.server))
    assert rig.statuses(again, 4) == ["7002", "7004", "7006", "7006"]


@each_of("pin", ["stop", "config.ActiveEstablished"])
def test_the_program_is_told_of_the_connection_after_one_that_it_has_ended(pin: str) -> None:
    rig = Rig()
    client = rig.client().connect()
    rig.set(pin, True)
    client.step(3)
    rig.set(pin, False)
    assert rig.statuses(client, 3)[-1] == "7002"
    again = rig.client(51)
    again.submit(Connect(1, again.server))
    assert rig.statuses(again, 4) == ["7002", "7004", "7006", "7006"]


# --- data areas ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "value", "registers"), first_quick([
    ("ARRAY[5..6] OF INT", "holding[5]", [0x8001, 0]), ("UINT", "holding", [0x8001]), ("WORD", "holding", [0x8001]),
    ("DINT", "holding", [0x8001, 0]), ("ARRAY[0..3] OF BYTE", "holding[0]", [0x0001, 0]), ("LINT", "holding", [0x8001, 0, 0, 0]),
]))  # fmt: skip
def test_registers_of_any_type_the_low_half_first(kind: str, value: str, registers: list[int]) -> None:
    rig = Rig(holding=kind)
    rig.set(value, {"ARRAY[5..6] OF INT": -32767, "ARRAY[0..3] OF BYTE": 1}.get(kind, 0x8001))
    client = rig.client().connect()
    count = len(registers)
    words = " ".join(f"{word >> 8:02X} {word & 255:02X}" for word in registers)
    assert client.ask(f"03 0000 {count:04X}") == f"03 {2 * count:02X} {words}"
    assert client.ask(f"03 0000 {count + 1:04X}") == "83 02"


@pytest.mark.slow
def test_a_real_a_structure_and_an_odd_number_of_bytes() -> None:
    text = """
    TYPE Tank : STRUCT level : REAL; full : BOOL; END_STRUCT END_TYPE
    PROGRAM Main
    VAR s : MB_TCP_SERVER; config : TCP_CONNECTCONFIG; c, d : BOOL; t : Tank := (level := 1.0, full := TRUE);
        b : ARRAY[0..2] OF BYTE; END_VAR
        s(CONNECT := config, COIL_DATAAREA := c, DISCRETE_DATAAREA := d, HOLDING_REG_DATAAREA := t, INPUT_REG_DATAAREA := b);
    END_PROGRAM
    """
    rig = Rig(text=text)
    rig.set("b[1]", 0x12)
    client = rig.client().connect()
    assert client.ask("03 0000 0003") == "03 06 00 00 3F 80 00 01"
    assert client.ask("10 0000 0002 04 0000 4049") == "10 00 00 00 02"
    assert rig.get("t.level") == 3.140625
    assert client.ask("04 0000 0001") == "04 02 12 00"
    assert client.ask("04 0000 0002") == "84 02"
    assert client.ask("05 0000 FF00") == "05 00 00 FF 00"
    assert client.ask("01 0000 0001") == "01 01 01"
    assert client.ask("01 0001 0001") == "81 02"
    assert rig.get("c") is True


@pytest.mark.slow
@pytest.mark.parametrize("kind", first_quick(["WORD", "INT", "ARRAY[0..1] OF BYTE", "ARRAY[0..0] OF UINT"]))
def test_bits_of_what_is_not_bool_are_packed(kind: str) -> None:
    rig = Rig(coils=kind)
    client = rig.client().connect()
    assert client.ask("0F 0000 0010 02 01A0") == "0F 00 00 00 10"
    assert client.ask("01 0000 0010") == "01 02 01 A0"
    assert client.ask("05 0001 FF00") == "05 00 01 FF 00"
    assert client.ask("01 0000 0008") == "01 01 03"
    assert client.ask("01 0010 0001") == "81 02"


@pytest.mark.slow
@pytest.mark.parametrize(("passed", "overlaps"), first_quick([
    ({"coils": "holding"}, True), ({"coils": "holding[199]"}, True), ({"coils": "registers"}, True), ({"coils": "inputs"}, True),
    ({"inputs": "holding"}, True), ({"inputs": "registers"}, True), ({"inputs": "holding[3]", "coils": "holding[4]"}, True),
    ({"registers": "holding"}, True), ({"registers": "holding[0]", "holding": "holding[1]"}, False),
    ({"coils": "inputs[3]", "registers": "inputs[4]", "inputs": "registers"}, False),
    ({"coils": "inputs[4]", "registers": "inputs[3]", "inputs": "registers"}, False),
    ({"coils": "coils[1]", "inputs": "coils[1]"}, True), ({"coils": "coils[1]", "inputs": "coils[2]"}, False), ({}, False),
]))  # fmt: skip
def test_areas_that_overlap(passed: dict[str, str], overlaps: bool) -> None:
    rig = Rig(passed=passed)
    client = rig.client()
    told = rig.statuses(client, 4)
    assert told == (["8389 ERROR"] * 4 if overlaps else ["7002"] * 4)


@pytest.mark.slow
def test_located_areas_that_overlap() -> None:
    text = """
    PROGRAM Main
    VAR s : MB_TCP_SERVER; config : TCP_CONNECTCONFIG; c : BYTE; d : BYTE; a AT %MW10 : ARRAY[0..9] OF WORD;
        b AT %MW19 : ARRAY[0..9] OF WORD; END_VAR
        s(CONNECT := config, COIL_DATAAREA := c, DISCRETE_DATAAREA := d, HOLDING_REG_DATAAREA := a, INPUT_REG_DATAAREA := b);
    END_PROGRAM
    """
    rig = Rig(text=text)
    rig.scan(2)
    assert rig.status() == "8389 ERROR"
    rig = Rig(text=text.replace("%MW19", "%MW20"))
    rig.scan(2)
    assert rig.status() == "7002"


@pytest.mark.slow
def test_an_overlap_ends_a_connection() -> None:
    text = SHEET.replace("MB_TCP_SERVER_2(", "MB_TCP_SERVER_2(").replace("aa : BOOL;", "aa, same : BOOL;")
    both = text.replace("MB_TCP_SERVER_2(", "IF NOT same THEN MB_TCP_SERVER_2(").replace(");\nEND_PROGRAM", """);
    ELSE MB_TCP_SERVER_2(disconnect := aa, CONNECT := config, coil_dataarea := bb, discrete_dataarea := bb,
        holding_reg_dataarea := dataarea_holding, input_reg_dataarea := reg_datarea, STATUS => xx); END_IF;
    END_PROGRAM""")
    rig = Rig(text=both)
    client = rig.client().connect()
    rig.set("same", True)
    client.step(3)
    assert (rig.status("MB_TCP_SERVER_2"), client.end) == ("8389 ERROR", "FIN")


# --- the connection's description ---------------------------------------------------------------------------------------


def described(rig: Rig, remote: str = "0.0.0.0", remote_port: int = 0, local: str = "0.0.0.0", local_port: int = 0) -> Rig:
    for name, address in (("RemoteAddress", remote), ("LocalAddress", local)):
        for number, octet in enumerate(address.split(".")):
            rig.set(f"config.{name}[{number}]", int(octet))
    rig.set("config.RemotePort", remote_port)
    rig.set("config.LocalPort", local_port)
    return rig


def test_a_connection_is_probed_when_it_is_silent() -> None:
    rig = Rig()
    rig.scan(3)
    assert rig.plc.read("MB_TCP_Lines[1].Keep_Alive") == 1


@each_of("address", ["RemoteAddress", "LocalAddress"])
def test_an_address_has_four_bytes(address: str) -> None:
    assert described(Rig(), "192.168.250.50", local="192.168.250.50").get(f"config.{address}") == [192, 168, 250, 50]


def is_let_in(rig: Rig, number: int = 50, port: int = 502, own_port: int = 0) -> bool:
    client = rig.client(number, port)
    client.submit(Connect(1, client.server, own_port))
    client.step(5)
    return client.is_open and not client.end


def test_the_local_port() -> None:
    rig = Rig()
    rig.scan()
    assert is_let_in(rig)
    rig = described(Rig(), local_port=1502)
    rig.scan(2)
    assert not is_let_in(rig, 50)
    assert is_let_in(rig, 51, 1502)


@each_of(("remote", "remote_port", "number", "own_port", "expected"), [
    ("192.168.250.50", 0, 50, 0, True), ("192.168.250.50", 0, 51, 0, False), ("0.0.0.0", 5000, 50, 5000, True),
    ("0.0.0.0", 5000, 50, 5001, False), ("192.168.250.50", 5000, 50, 5000, True), ("192.168.250.51", 5000, 50, 5000, False),
])  # fmt: skip
def test_who_may_connect(remote: str, remote_port: int, number: int, own_port: int, expected: bool) -> None:
    rig = described(Rig(), remote, remote_port)
    rig.scan(2)
    assert is_let_in(rig, number, own_port=own_port) == expected


@pytest.mark.parametrize(("local", "expected"), [
    ("0.0.0.0", True), (ADDRESS, True), ("192.168.250.24", False), ("192.169.250.23", False), ("0.0.250.23", False),
    ("192.168.0.0", False), ("0.0.0.1", False), ("23.250.168.192", False),
])  # fmt: skip
def test_the_local_address(local: str, expected: bool) -> None:
    """An address that the controller does not have: nobody is let in, and the block goes on waiting."""
    rig = described(Rig(), local=local)
    rig.scan(2)
    assert rig.status() == "7002"
    assert is_let_in(rig) == expected


def test_a_description_that_changes_is_followed_while_nobody_is_connected() -> None:
    rig = Rig()
    rig.scan(3)
    described(rig, local_port=1502)
    rig.scan(4)
    assert is_let_in(rig, 50, 1502)
    described(rig, local_port=502)
    rig.scan(3)
    assert rig.status() == "7006", "a connection stays"


FIRST = {"remote": "192.168.250.50", "remote_port": 5000, "local_port": 1502}


def after_change(part: dict[str, Any]) -> Rig:
    """A server that has waited for the client described first, when the description has changed in one part."""
    rig = described(Rig(), **FIRST)
    rig.scan(4)
    described(rig, **FIRST | part)
    rig.scan(4)
    return rig


@each_of(("part", "caller"), [
    ({"remote": "192.169.250.50"}, None), ({"remote": "192.168.250.51"}, (51, 1502, 5000)),
    ({"remote_port": 5001}, (50, 1502, 5001)), ({"local_port": 1503}, (50, 1503, 5000)),
    ({"local_port": 0}, (50, 502, 5000)), ({"local": "192.168.250.24"}, None),
])  # fmt: skip
def test_each_part_of_a_description_that_changes_is_followed(part: dict[str, Any], caller: tuple[int, int, int] | None) -> None:
    """Whoever was described first is not let in any more, whoever is described then is."""
    assert is_let_in(after_change({}), 50, 1502, 5000)
    assert not is_let_in(after_change(part), 50, 1502, 5000)
    assert caller is None or is_let_in(after_change(part), *caller)


def several(count: int) -> str:
    return f"""
    PROGRAM Main
    VAR s : ARRAY[1..{count}] OF MB_TCP_SERVER; config : ARRAY[1..{count}] OF TCP_CONNECTCONFIG; i : INT;
        c, d : ARRAY[1..{count}] OF BYTE; h, r : ARRAY[1..{count}, 0..9] OF WORD; END_VAR
        FOR i := 1 TO {count} DO
            config[i].LocalPort := INT_TO_UINT(1000 + i);
            h[i, 0] := INT_TO_WORD(i);
            s[i](CONNECT := config[i], COIL_DATAAREA := c[i], DISCRETE_DATAAREA := d[i], HOLDING_REG_DATAAREA := h[i, 0],
                 INPUT_REG_DATAAREA := r[i, 0]);
        END_FOR;
    END_PROGRAM
    """


@pytest.mark.slow
@pytest.mark.parametrize(("model", "at_most"), first_quick([("T3", 8), ("T4", 32)]))
def test_as_many_instances_as_the_controller_has_connections(model: str, at_most: int) -> None:
    """Each on its own port; one more waits for ever."""
    rig = Rig(text=several(at_most + 1), model=model)
    rig.scan(3)
    for number in range(1, at_most + 1):
        assert rig.client(100 + number, 1000 + number).connect().ask("03 0000 0001") == f"03 02 00 {number:02X}"
    assert not is_let_in(rig, 99, 1000 + at_most + 1)
    assert rig.status(f"s[{at_most + 1}]") == "7002"


def test_clients_one_after_the_other_and_no_second_one() -> None:
    rig = Rig()
    first = rig.client(50).connect()
    second = rig.client(51)
    second.submit(Connect(1, second.server))
    second.step(4)
    assert second.end == "ECONNREFUSED"
    first.submit(Close(1))
    assert second.connect().ask("03 0000 0001") == "03 02 00 00"


@pytest.mark.slow
def test_the_same_on_both_engines() -> None:
    pytest.importorskip("llvmlite")
    plcs = []
    for engine in ("python", "native"):
        rig = Rig()
        rig.plc = Plc(image_of(SHEET), CYCLE_NS, engine=engine)
        rig.network = LoopNetwork()
        rig.plc.attach(Tianxing(ADDRESS), rig.network)
        client = rig.client().connect()
        for pdu in ("0F 0003 000B 02 5505", "01 0000 0010", "10 0000 0003 06 0001 8000 FFFF", "03 0000 007D", "05 0001 0002"):
            client.ask(pdu)
        plcs.append(rig.plc.memory.map[:])
    assert plcs[0] == plcs[1]


@pytest.mark.slow
def test_the_program_and_the_chart_of_the_readme() -> None:
    readme = (data_folder("fblib") / "tianxing" / "mb_tcp_server" / "README.md").read_text(encoding="utf-8")
    text = re.findall(r"```\n(PROGRAM.*?)```", readme, re.S)[0]
    rows = re.findall(r"```\n(scan.*?)```", readme, re.S)[0].splitlines()[1:]
    rig = Rig(text=text.replace("    Server", "    s"))
    client = rig.client()
    rig.scan(2)
    asked = {"10 to": "10 0000 0001 02 1267", "03 for": "03 0000 007E"}
    for row in rows:
        status, beside = row[6:18].strip(), row[18:]
        if beside == "a client connects":
            client.submit(Connect(1, client.server))
        elif beside == "it leaves":
            client.submit(Close(1))
        for begin, pdu in asked.items():
            if beside.startswith(begin):
                client.submit(Send(1, Adu(1, 1, bytes.fromhex(pdu)).to_bytes()))
        client.step()
        assert rig.status() == status, row
    assert rig.get("Holding[1]") == 0x1267
