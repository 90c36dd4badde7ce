"""The server of an Ethernet module: what it answers, clients one after the other and at once, and MBP_MSTR against it:
remote statistics between two modules."""

from __future__ import annotations

from random import Random

import noc_words
import pytest
from depth import times
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mstr_rig import CYCLE_NS, SERVER_IP, Rig, image_of
from rows import each_of
from stream_client import Client

from fbvm.base.areas import AREAS
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.units.port.noc import Noc
from fbvm.wire.link import Close, Connect, Peer, Send
from fbvm.wire.modbus import Adu

HERE = Peer("192.168.250.2", 502)


class Station:
    """A PLC with a module in slot 9 at 192.168.250.2 whose program is a server with these pins."""

    def __init__(self, network: LoopNetwork | None = None, pins: str = "") -> None:
        self.network = network or LoopNetwork()
        text = f"PROGRAM Main VAR Server : MSTR_Server; END_VAR Server(Rack_Slot := 9, {pins}); END_PROGRAM"
        self.plc = Plc(image_of(text.replace(", )", ")")), CYCLE_NS)
        self.noc = Noc(9, HERE.host, mac="00:80:F4:01:02:03", module_type=11)
        self.plc.attach(self.noc, self.network)
        self.scan(2)

    def scan(self, count: int = 1) -> None:
        for _ in range(count):
            trap = self.plc.scan()
            assert trap is None, trap

    def registers(self) -> memoryview:
        """%MW0 on."""
        area = AREAS["M"]
        return self.plc.memory.u8[area.offset : area.offset + area.size_bytes].cast("H")

    def client(self, number: int = 50) -> Client:
        return Client(self.scan, self.plc, self.network.attach(f"192.168.250.{number}"), HERE)


def test_a_line_that_an_operation_has_used_serves_every_caller() -> None:
    """Its partner is the one of the operation until the server claims it."""
    text = "PROGRAM Main VAR Server : MSTR_Server; END_VAR Server(Rack_Slot := 9); END_PROGRAM"
    plc, network = Plc(image_of(text), CYCLE_NS), LoopNetwork()
    for line in range(1, 33):
        for name, value in (("Remote_IP[0]", 0xC0A8), ("Remote_IP[1]", 0xFA63), ("Remote_Port", 502), ("Local_Port", 4000)):
            plc.write(f"MSTR_Lines[{line}].{name}", value)
    plc.attach(Noc(9, HERE.host), network)

    def scan(count: int = 1) -> None:
        for _ in range(count):
            assert plc.scan() is None

    scan(2)
    client = Client(scan, plc, network.attach("192.168.250.50"), HERE).connect()
    assert client.ask("03 0000 0001") == "03 02 00 00"


# --- the CPU ------------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_registers_are_mw() -> None:
    """Register 1, address 0 in the frame, is %MW1."""
    station = Station()
    client = station.client().connect()
    station.plc.write("%MW1", 0x1234)
    station.plc.write("%MW49", 0x5678)
    assert client.ask("03 0000 0001") == "03 02 12 34"
    assert client.ask("03 0030 0001") == "03 02 56 78"
    assert client.ask("06 0001 BEEF") == "06 00 01 BE EF"
    assert client.ask("10 0002 0002 04 0001 8000") == "10 00 02 00 02"
    assert client.ask("17 0000 0005 0004 0001 02 7777") == "17 0A 12 34 BE EF 00 01 80 00 77 77"
    assert station.plc.read("%MW0..%MW6") == [0, 0x1234, 0xBEEF, 1, 0x8000, 0x7777, 0]


@each_of("unit", [0, 1, 6, 254])
def test_units_0_to_254_are_the_cpu(unit: int) -> None:
    client = Station().client().connect()
    assert client.ask("03 0000 0001", unit) == "03 02 00 00"
    assert client.ask("08 0015 0003", unit) == "88 01"


REFUSED = {
    "01 0000 0001": "81 01", "02 0000 0001": "82 01", "04 0000 0001": "84 01", "05 0000 FF00": "85 01", "07": "87 01",
    "0F 0000 0001 01 01": "8F 01", "16 0000 0000 0000": "96 01", "2B 0E 01 00": "AB 01", "00": "80 01", "FF": "FF 01",
    "03": "83 03", "03 0000 00": "83 03", "03 0000 0001 00": "83 03", "03 0000 0000": "83 03", "03 0000 007E": "83 03",
    "03 7FFF 0001": "83 02", "03 7FFE 0002": "83 02", "03 FFFF 0001": "83 02", "03 FFFF 007E": "83 03",
    "06 0000": "86 03", "06 0000 0000 00": "86 03", "06 7FFF 0000": "86 02", "06 FFFF 0000": "86 02",
    "10 0000 0000 00": "90 03", "10 0000 0001 02 00": "90 03", "10 0000 0001 03 0000": "90 03", "10 0000 0001": "90 03",
    "10 0000 0001 02 0000 00": "90 03", "10 7FFF 0001 02 0000": "90 02", "10 0000 007C F8" + 123 * "0000": "90 03",
    "10 0000 0002 02 0000": "90 03", "10 FFFF 0001 02 0000": "90 02",
    "17 0000 0000 0000 0001 02 0000": "97 03", "17 0000 007E 0000 0001 02 0000": "97 03",
    "17 0000 0001 0000 0000 00": "97 03", "17 0000 0001 0000 0001 02 00": "97 03", "17 0000 0001 0000 0001 01 00": "97 03",
    "17 7FFF 0001 0000 0001 02 0000": "97 02", "17 0000 0001 7FFF 0001 02 0000": "97 02", "17 0000 0001": "97 03",
    "17 0000 0001 0000 007A F4" + 121 * "0000": "97 03",
}  # fmt: skip


@pytest.mark.slow
@each_of("request_pdu", REFUSED)
def test_what_is_refused_changes_nothing(request_pdu: str) -> None:
    station = Station()
    client = station.client().connect()
    words = station.registers()
    for number in range(200):
        words[number] = words[32767 - number] = 7000 + number
    before = words.tolist()
    assert client.ask(request_pdu) == REFUSED[request_pdu]
    assert words.tolist() == before
    assert client.ask("03 0000 0001") == "03 02 1B 59"


@each_of("pdu", ["03 7FFE 0001", "06 7FFE 0001", "10 7F84 007B F6" + 123 * "0001", "03 7F82 007D",
                 "17 7F82 007D 7F86 0079 F2" + 121 * "0001"])  # fmt: skip
def test_the_last_registers(pdu: str) -> None:
    client = Station().client().connect()
    assert client.ask(pdu)[0] != "8"
    assert client.ask(pdu)[0] != "9"


@pytest.mark.slow
@settings(max_examples=times(15), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.integers(0, 2**32), st.integers(1, 40), st.booleans())
def test_reads_and_writes_agree_with_a_model_however_they_are_cut(seed: int, cut: int, is_joined: bool) -> None:
    dice = Random(seed)
    station = Station()
    client = station.client().connect()
    model = [0] * 40
    stream, expected = b"", []
    for number in range(8):
        first, count = dice.randrange(30), dice.randint(1, 10)
        values = [dice.randrange(65536) for _ in range(count)]
        data = b"".join(value.to_bytes(2, "big") for value in values)
        kind = dice.choice((3, 6, 16, 23))
        if kind == 3:
            pdu, reply = bytes((3, 0, first, 0, count)), None
        elif kind == 6:
            model[first], pdu = values[0], bytes((6, 0, first)) + data[:2]
            reply = pdu
        elif kind == 16:
            model[first : first + count] = values
            pdu, reply = bytes((16, 0, first, 0, count, 2 * count)) + data, bytes((16, 0, first, 0, count))
        else:
            model[first : first + count] = values
            pdu, reply = bytes((23, 0, first, 0, count, 0, first, 0, count, 2 * count)) + data, None
        read = b"".join(value.to_bytes(2, "big") for value in model[first : first + count])
        expected.append(Adu(number, 1, reply or bytes((kind, 2 * count)) + read).to_bytes())
        stream += Adu(number, 1, pdu).to_bytes()
    size = len(stream) if is_joined else cut
    for start in range(0, len(stream), size):
        client.submit(Send(1, stream[start : start + size]))
        client.step()
    for _ in range(60):
        client.step()
    assert client.data == b"".join(expected)
    assert station.registers()[1:41].tolist() == model


# --- connections --------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_clients_at_once_and_one_after_the_other() -> None:
    station = Station(pins="Sessions := 2")
    clients = [station.client(number).connect() for number in (50, 51)]
    assert station.plc.read("Main.Server.Clients") == 2
    for client in clients:
        assert client.ask("03 0000 0001") == "03 02 00 00"
    third = station.client(52)
    third.submit(Connect(1, HERE))
    third.step(5)
    assert third.end == "ECONNREFUSED"
    clients[0].submit(Close(1))
    clients[0].step(4)
    assert station.client(53).connect().ask("03 0000 0001") == "03 02 00 00"
    assert station.plc.read("Main.Server.Requests") == 3


def test_a_client_that_leaves_gets_its_replies_first() -> None:
    station = Station()
    client = station.client().connect()
    frames = b"".join(Adu(number, 0, bytes.fromhex("03 0000 0001")).to_bytes() for number in range(5))
    client.submit(Send(1, frames))
    client.step(20)
    assert len(client.data) == 5 * 11


@pytest.mark.slow
def test_a_client_that_breaks_its_connection() -> None:
    station = Station(pins="Sessions := 1")
    client = station.client().connect()
    client.submit(Close(1, reset=True))
    client.step(4)
    assert station.plc.read("Main.Server.Clients") == 0
    assert client.connect().ask("03 0000 0001") == "03 02 00 00"


@pytest.mark.slow
def test_a_client_that_asks_nothing_is_left() -> None:
    station = Station(pins="Idle_Time := T#1s")
    client = station.client().connect()
    client.step(90)
    assert client.end == ""
    client.step(20)
    assert client.end == "ECONNRESET"
    assert client.connect().ask("03 0000 0001") == "03 02 00 00"


@each_of("trash", ["0001 0000 0001", "0001 0000 0000 00 03", "0001 0000 00FF", "0001 0000 FFFF", 300 * "FF"])
def test_a_stream_that_is_out_of_step_is_left(trash: str) -> None:
    client = Station().client().connect()
    client.submit(Send(1, bytes.fromhex(trash)))
    client.step(5)
    assert (client.end, client.data) == ("ECONNRESET", b"")
    assert client.connect().ask("03 0000 0001") == "03 02 00 00"


def test_another_protocol_is_passed_over() -> None:
    client = Station().client().connect()
    client.submit(Send(1, bytes.fromhex("0009 0001 0006 00 03 0000 0001")))
    assert client.ask("03 0000 0001") == "03 02 00 00"


@pytest.mark.slow
def test_a_server_of_a_module_that_restarts_comes_back() -> None:
    station = Station()
    client = station.client().connect()
    station.plc.write(f"NOC{9 * noc_words.HEAD_WORDS + noc_words.RESTART}", 1)
    client.step(3)
    assert client.end == "ECONNRESET"
    station.scan(500)
    assert client.connect().ask("03 0000 0001") == "03 02 00 00"


@pytest.mark.slow
def test_there_are_never_more_servers_than_lines() -> None:
    text = """PROGRAM Main VAR s : ARRAY[1..5] OF MSTR_Server; i : INT; END_VAR
        FOR i := 1 TO 5 DO s[i](Sessions := 8); END_FOR; END_PROGRAM"""
    plc = Plc(image_of(text), CYCLE_NS)
    plc.attach(Noc(), LoopNetwork())
    assert plc.run(scans=5) == "scans"
    owners = [plc.read(f"MSTR_Lines[{number}].Owner") for number in range(1, 33)]
    assert owners == 32 * [3]


# --- statistics between two modules -------------------------------------------------------------------------------------


def pair() -> tuple[Rig, Station]:
    network = LoopNetwork()
    station = Station(network)
    rig = Rig(network=network, refused=True)
    watchers = rig.plc.watchers
    watchers.append(lambda plc: station.scan())
    return rig, station


def test_remote_statistics() -> None:
    rig, _ = pair()
    rig.scan(2)
    assert rig.operate(7, 0, 38, 0, 0x07FF, *SERVER_IP) == "0000"
    table = rig.databuf(38)
    assert table[:3] == [0x0080, 0xF401, 0x0203]
    assert table[3] == 0x8000 | 0x1000 | 11 << 4 | 7
    assert table[36:38] == [0xFA02, 0xC0A8]
    assert table[4:6] == [2, 0], "the call and this request"
    assert rig.operate(7, 0, 2, 36, 0x07FF, *SERVER_IP) == "0000"
    assert rig.databuf(3) == [0xFA02, 0xC0A8, table[2]]


def test_clearing_remote_statistics() -> None:
    rig, station = pair()
    rig.scan(2)
    for _ in range(3):
        assert rig.operate(2, 0, 1, 1, 0x0700, *SERVER_IP) == "0000"
    head = 9 * noc_words.HEAD_WORDS + noc_words.STATISTICS
    assert station.plc.read(f"NOC{head + 4}") == 4
    assert rig.operate(8, 0, 0, 0, 0x07FF, *SERVER_IP) == "0000"
    assert station.plc.read(f"NOC{head + 4}") == 0
    assert station.plc.read(f"NOC{head + 36}") == 0xFA02


@pytest.mark.parametrize("unit", [0, 1, 254])
def test_the_cpu_does_not_know_statistics(unit: int) -> None:
    """The sheet's note: identifier 255 is needed for what the module itself has to say."""
    rig, _ = pair()
    rig.scan(2)
    assert rig.operate(7, 0, 38, 0, 0x0700 | unit, *SERVER_IP) == "3001"
    assert rig.operate(8, 0, 0, 0, 0x0700 | unit, *SERVER_IP) == "3001"


@pytest.mark.slow
def test_the_module_does_not_know_registers() -> None:
    rig, _ = pair()
    rig.scan(2)
    assert rig.operate(2, 0, 1, 1, 0x07FF, *SERVER_IP) == "3001"


def test_on_the_wire() -> None:
    station = Station()
    client = station.client().connect()
    reply = client.ask("08 0015 0003", 255)
    assert reply.startswith("08 00 15 00 03 00 4C 00 80 F4 01 02 03 90 B7 ")
    assert len(reply) == 3 * 83 - 1
    assert client.ask("08 0015 0004", 255) == "08 00 15 00 04"
    for pdu, refusal in (("08 0000 1234", "88 01"), ("08 0016 0003", "88 01"), ("08 0015 0005", "88 03"),
                         ("08 0015", "88 03"), ("08 0015 0003 00", "88 03"), ("08 00", "88 03"), ("08", "88 03"),
                         ("03 0000 0001", "83 01")):  # fmt: skip
        assert client.ask(pdu, 255) == refusal


def test_all_operations_between_two_plcs() -> None:
    rig, station = pair()
    rig.scan(2)
    rig.fill([1, 2, 3])
    assert rig.operate(1, 0, 3, 100, 0x0700, *SERVER_IP) == "0000"
    assert station.plc.read("%MW100..%MW102") == [1, 2, 3]
    rig.fill([9, 9, 9])
    assert rig.operate(2, 0, 2, 101, 0x0700, *SERVER_IP) == "0000"
    assert rig.databuf(3) == [2, 3, 9]
    assert rig.operate(23, 0, 1, 102, 0x0700, *SERVER_IP, 3, 100) == "0000"
    assert rig.databuf(3) == [1, 2, 2]
    assert rig.operate(2, 0, 1, 32768, 0x0700, *SERVER_IP) == "3002"
