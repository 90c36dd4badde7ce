"""When a request was answered, in the log of a server."""

from __future__ import annotations

import io
import json

import pytest

from fbvm.record.trace.requests import RequestLog
from fbvm.wire import modbus
from fbvm.wire.link import Peer
from fbvm.wire.tap import TapEvent, TapKind

HERE, THERE = Peer("192.168.250.1", 502), Peer("192.168.250.9", 40_000)


@pytest.mark.parametrize(("now_ns", "time"), [
    (0, 1_700_000_000.0), (1_600, 1_700_000_000.000002), (123_456_789, 1_700_000_000.123457)])
def test_times_are_seconds_to_a_microsecond(now_ns: int, time: float) -> None:
    file = io.StringIO()
    log = RequestLog(file, 1_700_000_000 * 10**9, lambda: 7)
    for out, pdu in ((False, modbus.read(3, 7, 2)), (True, modbus.data_reply(3, b"\0\5\0\6"))):
        log.tap(now_ns, HERE.host, TapEvent(TapKind.DATA, HERE, THERE, out, modbus.Adu(1, 1, pdu).to_bytes()))
    assert json.loads(file.getvalue()) == {
        "time": time, "peer": "192.168.250.9:40000", "function": 3, "address": 7, "count": 2, "result": 0, "scan": 7}
