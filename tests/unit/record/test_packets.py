"""What passed the network, in words, and in a trace."""

from __future__ import annotations

import io

import pytest
from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Phase, Plc
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import ModbusPeer
from fbvm.record.trace.events import Event, NetworkEvent
from fbvm.record.trace.packets import Dissector, add_tap
from fbvm.record.trace.reader import Moment, Trace
from fbvm.record.trace.writer import TraceWriter
from fbvm.units.etn21.unit import Etn21
from fbvm.wire import modbus
from fbvm.wire.link import Peer
from fbvm.wire.tap import TapEvent, TapKind

UNIT, SERVER = Peer("192.168.250.21", 49152), Peer("192.168.250.1", 502)
PROGRAM = """
PROGRAM Main
VAR c : MTCP_ETN_Connect; r : MTCP_ETN_Fn03; END_VAR
    c(IP_Address1 := 192, IP_Address2 := 168, IP_Address3 := 250, IP_Address4 := 1, Connect := TRUE);
    r(EN := c.ENO, Register_Address := 7, Register_Qty := 1, RespData_DM := 200, Cmd_Read := TRUE, SlaveID := 1);
END_PROGRAM
"""


def said(*events: TapEvent) -> list[str]:
    reader = Dissector()
    return [packet.info for event in events for packet in reader.dissect(0, event)]


def data(out: bool, content: bytes) -> TapEvent:
    return TapEvent(TapKind.DATA, UNIT, SERVER, out, content)


def test_frames_are_put_together_however_they_were_cut() -> None:
    asked = modbus.Adu(1, 1, modbus.read(3, 7, 1)).to_bytes()
    reply = modbus.Adu(1, 1, modbus.data_reply(3, b"\0\5")).to_bytes()
    opening = TapEvent(TapKind.SYN, UNIT, SERVER, True)
    assert said(opening, data(True, asked[:5]), data(True, asked[5:] + asked), data(False, reply)) == [
        "asks for a connection", "5 bytes, a frame in part",
        "Modbus 1, unit 1: 03 read holding registers, address 7, quantity 1",
        "Modbus 1, unit 1: 03 read holding registers, address 7, quantity 1",
        "Modbus 1, unit 1: 03 read holding registers, data 00 05",
    ]  # fmt: skip


def test_a_server_is_who_was_called_on_whatever_port_and_also_if_that_is_the_unit() -> None:
    """Both ask from, and are called at, other ports than that of Modbus; a new call begins anew."""
    asked, reply = (modbus.Adu(1, 1, pdu).to_bytes() for pdu in (modbus.read(3, 7, 1), modbus.data_reply(3, b"\0\5")))
    here, there = Peer("192.168.250.21", 5020), Peer("192.168.250.1", 49_152)
    for calls in (False, True):
        events = [TapEvent(kind, here, there, out is calls, content) for kind, out, content in (
            (TapKind.SYN, True, b""), (TapKind.DATA, True, asked), (TapKind.DATA, False, reply), (TapKind.DATA, True, asked[:3]),
            (TapKind.SYN, True, b""), (TapKind.DATA, True, asked))]  # fmt: skip
        lines = [line.rpartition(": ")[2] for line in said(*events)]
        assert lines[1] == lines[-1] == "03 read holding registers, address 7, quantity 1"
        assert lines[2] == "03 read holding registers, data 00 05"


def test_without_its_beginning_a_conversation_is_known_by_the_port() -> None:
    asked = modbus.Adu(1, 1, modbus.read(3, 7, 1)).to_bytes()
    assert said(data(True, asked))[0].endswith("address 7, quantity 1")
    assert said(data(False, modbus.Adu(1, 1, modbus.exception_reply(3, 2)).to_bytes())) == [
        "Modbus 1, unit 1: 03 read holding registers, exception 02 illegal data address"]


@each_of(("code", "words"), [
    (1, "illegal function"), (2, "illegal data address"), (3, "illegal data value"), (4, "server device failure"),
    (5, "acknowledge"), (6, "server device busy"), (8, "memory parity error"), (10, "gateway path unavailable"),
    (11, "gateway target device failed to respond"),
])  # fmt: skip
def test_exceptions_have_the_words_of_the_specification(code: int, words: str) -> None:
    """MODBUS Application Protocol Specification V1.1b3, section 7."""
    reply = modbus.Adu(1, 1, modbus.exception_reply(3, code)).to_bytes()
    assert said(data(False, reply)) == [f"Modbus 1, unit 1: 03 read holding registers, exception {code:02X} {words}"]


def test_what_is_no_modbus_is_counted() -> None:
    assert said(data(True, b"\0\0\0\0\xff\xff!"), data(True, b"more")) == [
        "7 bytes, no Modbus: length 65535 outside 2..254", "4 bytes"]
    assert said(TapEvent(TapKind.UDP, UNIT, SERVER, True, b"x")) == ["datagram of 1 byte"]
    twice = TapEvent(TapKind.DATA, UNIT, SERVER, False, b"told twice", True)
    assert said(twice)[0].startswith("10 bytes")
    assert list(Dissector(once=True).dissect(0, twice)) == []


class Noted:
    """Follows a trace and notes what passed, with its scan and the phases that were over."""

    def __init__(self) -> None:
        self.rows: list[tuple[int, int, str]] = []
        self._phases = 0

    def phase(self, moment: Moment, phase: Phase) -> None:
        self._phases = 0 if phase is Phase.REFRESH else self._phases + 1

    def event(self, moment: Moment, event: Event) -> None:
        if isinstance(event, NetworkEvent):
            self.rows.append((moment.scans, event.now_ns, str(event.tap_event)))


@pytest.mark.slow
def test_a_trace_keeps_what_passed() -> None:
    image = compile_text(PROGRAM).image
    assert image is not None
    plc, network, heard = Plc(image), LoopNetwork(), list[tuple[int, int, str]]()
    network.place(SERVER, ModbusPeer())
    plc.attach(Etn21(0, UNIT.host), network)
    network.tap = lambda now_ns, unit, event: heard.append((plc.scans, now_ns, str(event)))
    before, file = network.tap, io.BytesIO()
    writer = TraceWriter(plc, file)
    plc.run(scans=250)
    writer.close()
    assert network.tap is before
    noted = Noted()
    Trace(io.BytesIO(file.getvalue())).follow(noted)
    assert len(heard) == 4
    assert noted.rows == heard


def test_several_may_listen() -> None:
    network, first, second = LoopNetwork(), list[TapEvent](), list[TapEvent]()
    assert add_tap(network, lambda now_ns, unit, event: first.append(event)) is None
    before = add_tap(network, lambda now_ns, unit, event: second.append(event))
    network.tell_unit(UNIT.host, TapKind.SYN, UNIT, SERVER, True)
    network.tap = before
    network.tell_unit(UNIT.host, TapKind.SYN, UNIT, SERVER, True)
    assert (len(first), len(second)) == (2, 1)


def test_fins_is_told_by_its_port_and_by_the_head_of_its_streams() -> None:
    dissector, unit, client = Dissector(), Peer("192.168.250.1", 9600), Peer("192.168.250.25", 5000)
    asked = bytes.fromhex("800002000100001900010101820064000003")
    told = bytes.fromhex("C00002001900000100010101000012301231 1232")
    [command] = dissector.dissect(0, TapEvent(TapKind.UDP, unit, client, False, asked))
    [response] = dissector.dissect(0, TapEvent(TapKind.UDP, unit, client, True, told))
    assert str(command) == ("192.168.250.25:5000 -> 192.168.250.1:9600  "
                            "FINS 25 -> 1, service 1: memory area read, D100, 3 elements")
    assert response.info == "FINS 1 -> 25, service 1: memory area read: normal end, 6 bytes"
    elsewhere = Peer("192.168.250.1", 9700)
    stream = bytes.fromhex("46494E530000000C000000000000000000000000") + b"GET "
    packets = list(dissector.dissect(0, TapEvent(TapKind.DATA, elsewhere, client, False, stream)))
    assert [packet.info for packet in packets] == [
        "FINS/TCP: asks for a node", "4 bytes, no FINS/TCP: the message does not begin with FINS"]
    [part] = dissector.dissect(0, TapEvent(TapKind.DATA, elsewhere, client, True, b"FINS\0\0"))
    assert part.info == "6 bytes, a FINS/TCP message in part"
