"""Other people's Modbus TCP software against the networks and the codec, over real connections on 127.0.0.1."""

from __future__ import annotations

import io
import shutil
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from fbvm.net.tcp import TcpLink, TcpNetwork
from fbvm.record.export.pcapng import Capture
from fbvm.wire import modbus
from fbvm.wire.link import Close, Connect, Event, Grant, Listen, Opened, Peer, PeerClosed, Received, Send
from fbvm.wire.modbus import Adu, Splitter, mismatch
from fbvm.wire.modbus_server import ModbusServer

SERVER = Peer("192.168.250.1", 502)
UNIT = "192.168.250.2"
BOUND_S = 20.0
TSHARK = shutil.which("tshark")

PDUS = [
    modbus.read(1, 0, 2000),
    modbus.read(2, 7, 19),
    modbus.read(3, 0, 125),
    modbus.read(4, 100, 1),
    modbus.write_coil(3, True),
    modbus.write_coil(4, False),
    modbus.write_register(7, 0x3AC5),
    modbus.write_coils(20, [1, 0, 1, 1, 0, 0, 1, 0, 1, 1]),
    modbus.write_coils(0, [1] * 1968),
    modbus.write_registers(1, list(range(123))),
    modbus.read(1, 0, 50),
    modbus.read(3, 0, 20),
    modbus.read(3, 0, 126),
    modbus.read(3, 0, 0),
    modbus.read(1, 0, 2001),
    modbus.read(3, 65535, 2),
    b"\x41\x00",
]


def until(link: TcpLink, events: list[Event], enough: Callable[[list[Event]], bool]) -> None:
    end_s = time.monotonic() + BOUND_S
    while not enough(events):
        assert time.monotonic() < end_s, events
        link.network.wait(0.05)
        events += link.events(time.monotonic_ns())


def exchange(link: TcpLink, request: Adu) -> Adu:
    """Send one frame, give back the one that answers it."""
    link.submit([Grant(1, 4096), Send(1, request.to_bytes())], time.monotonic_ns())
    splitter, frames, events = Splitter(), list[Adu](), list[Event]()

    def answered(events: list[Event]) -> bool:
        for event in events:
            if isinstance(event, Received):
                frames.extend(found for found in splitter.feed(event.data) if isinstance(found, Adu))
        events.clear()
        return bool(frames)

    until(link, events, answered)
    [reply] = frames
    assert reply.transaction == request.transaction
    assert reply.unit == request.unit
    return reply


@pytest.fixture
def foreign_port() -> Iterator[int]:
    """A server of pyModbusTCP with the tables of ours."""
    server_module = pytest.importorskip("pyModbusTCP.server")
    foreign = server_module.ModbusServer(host="127.0.0.1", port=0, no_block=True)
    foreign.start()
    yield foreign._service.server_address[1]
    foreign.stop()


@pytest.mark.slow
def test_a_foreign_server_answers_as_ours_does(foreign_port: int, tmp_path: Path) -> None:
    file = io.BytesIO()
    network = TcpNetwork({SERVER: ("127.0.0.1", foreign_port)})
    network.tap = Capture(file, epoch_ns=time.time_ns() - time.monotonic_ns()).tap
    link, events = network.attach(UNIT), list[Event]()
    link.submit([Connect(1, SERVER)], time.monotonic_ns())
    until(link, events, bool)
    assert isinstance(events[0], Opened)
    ours = ModbusServer()
    for transaction, pdu in enumerate(PDUS):
        request = Adu(transaction, 1, pdu)
        reply = exchange(link, request)
        assert reply.to_bytes() == ours.answer(request.to_bytes())
        assert pdu[0] == 0x41 or mismatch(pdu, reply.pdu) == ""
    link.submit([Close(1)], time.monotonic_ns())
    network.wait(1.0)
    link.events(time.monotonic_ns())
    network.close()
    if TSHARK:
        path = tmp_path / "real.pcapng"
        path.write_bytes(file.getvalue())
        wrong = "_ws.malformed || tcp.analysis.flags || tcp.checksum.status == 0"
        check = ["-o", "tcp.check_checksum:TRUE", "-Y", wrong]
        run = subprocess.run([TSHARK, "-n", "-r", str(path), *check], capture_output=True, text=True, check=True)
        assert run.stdout == ""


@pytest.mark.slow
def test_a_foreign_client_is_content_with_our_server() -> None:
    client_module = pytest.importorskip("pymodbus.client")
    network = TcpNetwork({Peer(UNIT, 502): ("127.0.0.1", 0)})
    link = network.attach(UNIT)
    link.submit([Listen(1, 502), Grant(1, 4096)], time.monotonic_ns())
    where = network.host_endpoint(Peer(UNIT, 502))
    results: list[object] = []

    def ask() -> None:
        with client_module.ModbusTcpClient(where.host, port=where.port, timeout=BOUND_S) as client:
            client.write_registers(10, list(range(100, 223)))
            results.append(client.read_holding_registers(10, count=123).registers)
            client.write_coils(3, [True, False, True])
            results.append(client.read_coils(0, count=8).bits)
            both = client.readwrite_registers(read_address=10, read_count=2, write_address=11, values=[7])
            results.append(both.registers)
            results.append(client.mask_write_register(address=10, and_mask=0xF0, or_mask=0x05).isError())
            results.append(client.read_input_registers(65535, count=2).exception_code)
            results.append(client.diag_query_data(b"\xa5\x37").message)

    thread = threading.Thread(target=ask, daemon=True)
    thread.start()
    server, splitter = ModbusServer(), Splitter()
    open_yet = True
    end_s = time.monotonic() + BOUND_S
    while open_yet and time.monotonic() < end_s:
        network.wait(0.05)
        for event in link.events(time.monotonic_ns()):
            open_yet = not isinstance(event, PeerClosed)
            if isinstance(event, Received):
                for found in splitter.feed(event.data):
                    assert isinstance(found, Adu)
                    answer = server.answer(found.to_bytes())
                    assert answer is not None
                    link.submit([Send(1, answer), Grant(1, 4096)], time.monotonic_ns())
    thread.join(BOUND_S)
    network.close()
    assert results[:5] == [
        list(range(100, 223)), [False, False, False, True, False, True, False, False], [100, 7], False, 2,
    ]  # fmt: skip
    assert bytes(results[5]) == b"\xa5\x37"  # type: ignore[call-overload]
