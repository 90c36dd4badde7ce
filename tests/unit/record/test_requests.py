"""The log of requests: one line for each reply, whatever pieces the streams come in."""

from __future__ import annotations

import io
import json

from fbvm.record.trace.requests import RequestLog
from fbvm.wire import modbus
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
