"""The log of requests: one line for each reply, whatever pieces the streams come in."""

from __future__ import annotations

import io
import json

from fbvm.record.trace.requests import RequestLog
from fbvm.wire import modbus
from fbvm.wire.fins.tcp import Kind, Message, client_node
from fbvm.wire.link import Peer
from fbvm.wire.modbus import Adu, exception_reply
from fbvm.wire.tap import TapEvent, TapKind

UNIT = Peer("192.168.250.21", 502)
CLIENT, OTHER = Peer("127.0.0.1", 50001), Peer("127.0.0.1", 50002)


class Told:
    """A log, and what it has written."""

    def __init__(self) -> None:
        self.file = io.StringIO()
        self.scans = 7
        self.log = RequestLog(self.file, 1_700_000_000_000_000_000, lambda: self.scans)

    def data(self, out: bool, data: bytes, remote: Peer = CLIENT) -> None:
        self.log.tap(500_000_000, UNIT.host, TapEvent(TapKind.DATA, UNIT, remote, out, data))

    def end(self, what: TapKind = TapKind.RST) -> None:
        self.log.tap(0, UNIT.host, TapEvent(what, UNIT, CLIENT, True))

    def rows(self) -> list[dict[str, object]]:
        return [json.loads(line) for line in self.file.getvalue().splitlines()]


def adu(pdu: bytes, number: int = 1) -> bytes:
    return Adu(number, 1, pdu).to_bytes()


def test_a_request_and_its_reply() -> None:
    told = Told()
    told.data(False, adu(modbus.read(3, 1000, 2)))
    assert told.rows() == [], "until it is answered"
    told.data(True, adu(b"\3\4\0\1\0\2"))
    assert told.rows() == [
        {"time": 1_700_000_000.5, "peer": "127.0.0.1:50001", "function": 3, "address": 1000, "count": 2, "result": 0,
         "scan": 7},
    ]  # fmt: skip


def test_writes_exceptions_and_functions_without_address() -> None:
    told = Told()
    for request, reply in (
        (modbus.write_register(5, 7), modbus.write_register(5, 7)),
        (modbus.write_registers(0, [1, 2]), exception_reply(16, 2)),
        (b"\x41", exception_reply(0x41, 1)),
        (b"\x08\0\0\1\2", b"\x08\0\0\1\2"),
    ):
        told.data(False, adu(request))
        told.data(True, adu(reply))
    found = [(row["function"], row["address"], row["count"], row["result"]) for row in told.rows()]
    assert found == [(6, 5, 1, 0), (16, 0, 2, 2), (0x41, None, None, 1), (8, None, None, 0)]


def test_pieces_pipelines_and_two_clients() -> None:
    told = Told()
    both = adu(modbus.read(3, 1, 1)) + adu(modbus.read(3, 2, 1))
    for start in range(0, len(both), 5):
        told.data(False, both[start : start + 5])
    told.data(False, adu(modbus.read(4, 9, 1)), OTHER)
    told.data(True, adu(b"\3\2\0\0"))
    told.data(True, adu(b"\4\2\0\0"), OTHER)
    told.data(True, adu(b"\3\2\0\0")[:4])
    told.data(True, adu(b"\3\2\0\0")[4:])
    assert [(row["peer"], row["address"]) for row in told.rows()] == [
        ("127.0.0.1:50001", 1), ("127.0.0.1:50002", 9), ("127.0.0.1:50001", 2),
    ]  # fmt: skip


def test_frames_of_another_protocol_are_no_requests() -> None:
    told = Told()
    told.data(False, b"\0\1\0\7\0\6\1\3\0\1\0\1" + adu(modbus.read(3, 2, 1)))
    told.data(True, adu(b"\3\2\0\0"))
    assert [row["address"] for row in told.rows()] == [2]


def test_a_new_connection_begins_anew() -> None:
    for what in (TapKind.RST, TapKind.OPEN):
        told = Told()
        told.data(False, adu(modbus.read(3, 1, 1)) + b"\0\1\0")
        told.end(what)
        told.data(False, adu(modbus.read(3, 5, 1)))
        told.data(True, adu(b"\3\2\0\0"))
        assert [row["address"] for row in told.rows()] == [5]


def test_a_reply_that_nobody_asked_for() -> None:
    told = Told()
    told.data(True, adu(b"\3\2\0\0"))
    assert told.rows() == []


FINS = Peer("192.168.250.21", 9600)


def fins(code: str, service: int = 1, icf: str = "80", node: int = 25) -> bytes:
    return bytes.fromhex(f"{icf} 00 02 00 01 00 00 {node:02X} 00 {service:02X} {code}")


def answer(code: str, service: int = 1, node: int = 25) -> bytes:
    return bytes.fromhex(f"C0 00 02 00 {node:02X} 00 00 01 00 {service:02X} {code}")


def says(told: Told, out: bool, data: bytes, kind: TapKind = TapKind.UDP) -> None:
    told.log.tap(500_000_000, FINS.host, TapEvent(kind, FINS, CLIENT, out, data))


def test_a_fins_command_and_its_response() -> None:
    told = Told()
    says(told, False, fins("0101 82 0064 00 0003"))
    assert told.rows() == [], "until it is answered"
    says(told, True, answer("0101 0000 0001 0002 0003"))
    assert told.rows() == [
        {"time": 1_700_000_000.5, "peer": "127.0.0.1:50001", "command": "0101", "says": "memory area read, D100, 3 elements",
         "result": "0000", "scan": 7},
    ]  # fmt: skip


def test_fins_responses_belong_to_their_service_numbers_and_nodes() -> None:
    told = Told()
    for service, node, code in ((1, 25, "0701"), (1, 26, "0601"), (2, 25, "0402")):
        says(told, False, fins(code, service, node=node))
    for service, node, code in ((2, 25, "0402 2102"), (1, 26, "0601 0000"), (1, 25, "0701 0000"), (9, 25, "0701 0000")):
        says(told, True, answer(code, service, node))
    assert [(row["command"], row["result"]) for row in told.rows()] == [("0402", "2102"), ("0601", "0000"), ("0701", "0000")]


def test_a_fins_command_that_wants_no_response_and_bytes_that_are_none() -> None:
    told = Told()
    says(told, False, fins("0402", icf="81"))
    for wrong in (b"", b"GET / HTTP/1.1", fins("")[:-1]):
        says(told, False, wrong)
    assert [(row["command"], row["says"], row["result"]) for row in told.rows()] == [("0402", "stop", None)]


def test_fins_over_tcp_in_any_pieces() -> None:
    told = Told()
    asked = client_node().to_bytes() + Message(Kind.FRAME, fins("0701", 5)).to_bytes()
    for start in range(0, len(asked), 7):
        says(told, False, asked[start : start + 7], TapKind.DATA)
    says(told, True, Message(Kind.FRAME, answer("0701 0000 26 11 22 13 44 04 00", 5)).to_bytes(), TapKind.DATA)
    assert [(row["command"], row["result"]) for row in told.rows()] == [("0701", "0000")]
    says(told, False, b"", TapKind.RST)
    says(told, False, b"GET / HTTP/1.1", TapKind.DATA)
    assert len(told.rows()) == 1


def test_commands_that_nobody_answers_are_forgotten() -> None:
    told = Told()
    for number in range(3000):
        says(told, False, fins("0701", number % 256, node=1 + number // 256))
    for number in (0, 2999):
        says(told, True, answer("0701 0000", number % 256, 1 + number // 256))
    assert len(told.rows()) == 1
