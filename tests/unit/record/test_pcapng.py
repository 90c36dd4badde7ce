"""Capture files: what a tap heard becomes frames that Wireshark has nothing to say against."""

from __future__ import annotations

import io
import shutil
import struct
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from fbvm.net.faults import Fault
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import Fin, ModbusPeer, Reset, Say, ScriptedPeer, Station
from fbvm.record.export import frames
from fbvm.record.export.frames import ACK, FIN, PSH, RST, SYN
from fbvm.record.export.pcapng import Capture
from fbvm.wire import modbus
from fbvm.wire.link import Bind, Close, Connect, Event, Grant, Listen, Peer, Received, Send, SendTo
from fbvm.wire.modbus import Adu
from fbvm.wire.tap import TapEvent, TapKind

SERVER = Peer("192.168.250.1", 502)
UNIT = "192.168.250.2"
MS = 1_000_000
TSHARK = shutil.which("tshark")


def blocks(content: bytes) -> Iterator[tuple[int, bytes]]:
    start = 0
    while start < len(content):
        kind, size = struct.unpack_from("<II", content, start)
        assert struct.unpack_from("<I", content, start + size - 4) == (size,)
        assert size % 4 == 0
        yield kind, content[start + 8 : start + size - 4]
        start += size


def segments(content: bytes) -> list[tuple[int, str, int, bytes]]:
    """(time, sending address, TCP flags, data) of each frame."""
    found = []
    for kind, body in blocks(content):
        if kind == 6:
            _, high, low, size, _ = struct.unpack_from("<IIIII", body)
            frame = body[20 : 20 + size]
            assert frame[12:14] == b"\x08\x00" and frames.checksum(frame[14:34]) == 0
            offset = 34 + (frame[46] >> 4) * 4
            found.append((high << 32 | low, ".".join(map(str, frame[26:30])), frame[47], frame[offset:]))
    return found


def test_what_was_written_is_seen_when_the_capture_is_flushed(tmp_path: Path) -> None:
    """Of a quiet network too, whose few frames a buffer would keep for minutes; where nothing was written, nothing is done."""
    path = tmp_path / "quiet.pcapng"
    flushed = 0

    class File(io.BufferedWriter):
        def flush(self) -> None:
            nonlocal flushed
            flushed += 1
            super().flush()

    with File(io.FileIO(path, "wb")) as file:
        capture = Capture(file)
        capture.tap(MS, UNIT, TapEvent(TapKind.UDP, Peer(UNIT, 9600), SERVER, True, b"abc"))
        assert path.stat().st_size == 0
        capture.flush()
        assert [b"abc" in body for kind, body in blocks(path.read_bytes()) if kind == 6] == [True]
        capture.flush()
        assert flushed == 1


def test_one_exchange_frame_by_frame() -> None:
    file = io.BytesIO()
    network = LoopNetwork(latency_ns=MS)
    network.tap = Capture(file, epoch_ns=1_700_000_000 * 10**9).tap
    network.place(SERVER, ScriptedPeer([Say(b"pong")]))
    link = network.attach(UNIT)
    link.submit([Connect(1, SERVER), Grant(1, 10)], 0)
    link.events(5 * MS)
    link.submit([Send(1, b"ping")], 5 * MS)
    link.events(10 * MS)
    link.submit([Close(1)], 10 * MS)
    link.events(20 * MS)
    there, here = SERVER.host, UNIT
    times_ms = [(time_ns - 1_700_000_000 * 10**9) / MS for time_ns, *_ in segments(file.getvalue())]
    assert times_ms == [0, 2, 2, 5, 5, 7, 7, 10, 10, 12, 12]
    assert [rest for _, *rest in segments(file.getvalue())] == [
        [here, SYN, b""],
        [there, SYN | ACK, b""],
        [here, ACK, b""],
        [here, PSH | ACK, b"ping"],
        [there, ACK, b""],
        [there, PSH | ACK, b"pong"],
        [here, ACK, b""],
        [here, FIN | ACK, b""],
        [there, ACK, b""],
        [there, FIN | ACK, b""],
        [here, ACK, b""],
    ]


def test_each_connection_has_sequence_numbers_of_its_own_the_same_in_each_run() -> None:
    def first_numbers() -> list[int]:
        """Of both ends of three connections."""
        file = io.BytesIO()
        capture = Capture(file)
        for port in (1024, 1025, 1026):
            capture.tap(MS, UNIT, TapEvent(TapKind.SYN, Peer(UNIT, port), SERVER, True))
            capture.tap(MS, UNIT, TapEvent(TapKind.OPEN, Peer(UNIT, port), SERVER, True))
        written = [body[20:] for kind, body in blocks(file.getvalue()) if kind == 6]
        return [int.from_bytes(frame[38:42], "big") for frame in written if frame[47] & SYN]

    numbers = first_numbers()
    assert len(set(numbers)) == 6 and numbers == first_numbers()


def test_the_file_begins_with_its_section_and_names_its_interfaces() -> None:
    file = io.BytesIO()
    capture = Capture(file)
    for unit in ("10.0.0.1", "10.0.0.2", "10.0.0.1"):
        capture.tap(0, unit, TapEvent(TapKind.UDP, Peer(unit, 1), Peer("10.0.0.9", 2), True, b"x"))
    kinds = [kind for kind, _ in blocks(file.getvalue())]
    assert kinds == [0x0A0D0D0A, 1, 6, 1, 6, 6]
    [first, second] = [body[8:] for kind, body in blocks(file.getvalue()) if kind == 1]
    assert struct.unpack_from("<HH8s", second) == (2, 8, b"10.0.0.2"), "option if_name; draft-ietf-opsawg-pcapng 4.2"
    assert struct.unpack_from("<HH8sHHB", first) == (2, 8, b"10.0.0.1", 9, 1, 9), "then if_tsresol, nanoseconds"


def test_a_comment_names_the_scan() -> None:
    file, said = io.BytesIO(), ""
    capture = Capture(file, comment=lambda address: f"{address}: {said}")
    for scan in (7, 12):
        said = f"scan {scan}"
        capture.tap(0, UNIT, TapEvent(TapKind.UDP, Peer(UNIT, 1), SERVER, True, b"x"))
    packets = [body for kind, body in blocks(file.getvalue()) if kind == 6]
    for body, number in zip(packets, ("7", "12"), strict=True):
        size = struct.unpack_from("<I", body, 12)[0]
        code, length = struct.unpack_from("<HH", body, 20 + size + -size % 4)
        at = 24 + size + -size % 4
        assert (code, body[at : at + length]) == (1, f"{UNIT}: scan {number}".encode())


def test_a_refused_connection_and_a_tap_that_came_late() -> None:
    file = io.BytesIO()
    capture = Capture(file)
    here = Peer(UNIT, 5000)
    for what, out in [(TapKind.SYN, True), (TapKind.RST, False), (TapKind.DATA, True)]:
        capture.tap(0, UNIT, TapEvent(what, here, SERVER, out, b"late" if what is TapKind.DATA else b""))
    other = Peer(UNIT, 5001)
    capture.tap(0, UNIT, TapEvent(TapKind.DATA, other, SERVER, True, b"mid"))
    capture.tap(0, UNIT, TapEvent(TapKind.OPEN, other, SERVER, True))
    assert [(sender, flags, data) for _, sender, flags, data in segments(file.getvalue())] == [
        (UNIT, SYN, b""),
        (SERVER.host, RST | ACK, b""),
        (UNIT, PSH | ACK, b"mid"),
        (SERVER.host, ACK, b""),
    ]


def test_who_has_ended_a_connection_says_no_more_on_it() -> None:
    file = io.BytesIO()
    capture, here = Capture(file), Peer(UNIT, 5000)
    for what, out in [(TapKind.SYN, True), (TapKind.FIN, True), (TapKind.DATA, True), (TapKind.FIN, True), (TapKind.DATA, False),
                      (TapKind.FIN, False), (TapKind.DATA, False)]:  # fmt: skip
        capture.tap(0, UNIT, TapEvent(what, here, SERVER, out, b"more" if what is TapKind.DATA else b""))
    assert [(sender, flags, data) for _, sender, flags, data in segments(file.getvalue())][1:] == [
        (UNIT, FIN | ACK, b""), (SERVER.host, ACK, b""), (SERVER.host, PSH | ACK, b"more"), (UNIT, ACK, b""),
        (SERVER.host, FIN | ACK, b""), (UNIT, ACK, b"")]  # fmt: skip


def test_the_checksum_of_rfc_1071() -> None:
    assert frames.checksum(bytes.fromhex("0001f203f4f5f6f7")) == 0x220D
    assert frames.checksum(b"\x01") == 0xFEFF


def busy_network(file: io.BytesIO) -> None:
    """Much of what can happen on a network, captured: Modbus in pieces, refusals, resets, two units, datagrams."""

    class Echo(Station):
        def datagram(self, data: bytes, caller: Peer) -> list[bytes]:
            return [data]

    network = LoopNetwork(3, latency_ns=300_000, faults=[Fault(Peer("192.168.250.9", 502), segment_bytes=5)])
    network.tap = Capture(file).tap
    network.place(SERVER, ModbusPeer())
    network.place(Peer("192.168.250.9", 502), ModbusPeer())
    network.place(Peer("192.168.250.8", 502), ScriptedPeer([Say(bytes(4000)), Reset(MS)]))
    network.place(Peer("192.168.250.7", 502), ScriptedPeer(greeting=[Fin(MS)]))
    network.place(Peer("192.168.250.6", 9600), Echo())
    one, two = network.attach(UNIT), network.attach("192.168.250.3")
    now_ns = 0

    def step(*requests: object) -> list[Event]:
        nonlocal now_ns
        now_ns += 20 * MS
        two.events(now_ns)
        one.submit(requests, now_ns)  # type: ignore[arg-type]
        now_ns += 20 * MS
        return one.events(now_ns) + one.events(now_ns)

    two.submit([Listen(1, 502), Grant(1, 4096), Bind(2, 9600)], 0)
    remotes = [SERVER, *(Peer(f"192.168.250.{last}", 502) for last in (9, 8, 7, 3, 5))]
    step(*(Connect(number, remote) for number, remote in enumerate(remotes, 1)), Bind(9, 9600))
    step(*(Grant(number, 9000) for number in range(1, 6)))
    pdus = [
        modbus.read(3, 0, 125), modbus.read(1, 5, 19), modbus.read(3, 0, 126), modbus.write_coil(3, True),
        modbus.write_register(7, 0x3AC5), modbus.loop_back(b"\xa5\x37"), modbus.write_coils(20, [1, 0, 1]),
        modbus.write_registers(1, list(range(123))), modbus.mask_write(4, 0xF2, 0x25), modbus.read_write(0, 3, 1, [9]),
        modbus.identify(), b"\x41",
    ]  # fmt: skip
    for transaction, pdu in enumerate(pdus):
        frame = Adu(transaction, 255, pdu).to_bytes()
        events = step(Send(1, frame), Send(2, frame), Grant(1, 4096), Grant(2, 4096))
        assert any(isinstance(event, Received) for event in events)
    step(Send(3, b"go"), Send(4, b"to who has left"), Send(5, Adu(1, 1, modbus.read(3, 0, 1)).to_bytes()))
    two.submit([Send(1, Adu(1, 1, b"\x83\x02").to_bytes())], now_ns)
    step(SendTo(9, Peer("192.168.250.6", 9600), bytes(5000)), SendTo(9, Peer("192.168.250.3", 9600), b"hello"))
    two.events(now_ns)
    step(Close(1), Close(2, reset=True), Close(3), Close(4), Close(5), Close(9))
    two.submit([Close(1)], now_ns)
    step()


def tshark(path: Path, *arguments: str) -> list[list[str]]:
    """Fields of each frame that tshark shows."""
    assert TSHARK
    options = ["-o", "tcp.check_checksum:TRUE", "-o", "ip.check_checksum:TRUE", "-o", "udp.check_checksum:TRUE"]
    run = subprocess.run(
        [TSHARK, "-n", "-r", str(path), *options, *arguments], capture_output=True, text=True, check=False, timeout=60
    )
    assert run.returncode == 0, run.stderr
    return [line.split("\t") for line in run.stdout.splitlines()]


@pytest.mark.slow
@pytest.mark.skipif(not TSHARK, reason="tshark is not installed")
def test_tshark_has_nothing_to_say_against_it(tmp_path: Path) -> None:
    file = io.BytesIO()
    busy_network(file)
    path = tmp_path / "busy.pcapng"
    path.write_bytes(file.getvalue())
    wrong = (
        "_ws.malformed || tcp.checksum.status == 0 || ip.checksum.status == 0 || udp.checksum.status == 0"
        " || tcp.analysis.flags || _ws.expert.severity >= 0x800000"
    )
    summary = ["-T", "fields", "-e", "frame.number", "-e", "_ws.col.Info", "-e", "_ws.expert.message"]
    assert tshark(path, "-Y", wrong, *summary) == []
    checked = tshark(path, "-Y", "tcp.checksum.status == 1 && ip.checksum.status == 1", *summary)
    assert len(checked) == len(tshark(path, "-Y", "tcp", *summary)) > 100


@pytest.mark.slow
@pytest.mark.skipif(not TSHARK, reason="tshark is not installed")
def test_tshark_reads_the_same_modbus(tmp_path: Path) -> None:
    file = io.BytesIO()
    busy_network(file)
    path = tmp_path / "busy.pcapng"
    path.write_bytes(file.getvalue())
    shown = tshark(
        path, "-Y", "modbus && ip.addr == 192.168.250.1",
        "-T", "fields", "-e", "ip.src", "-e", "tcp.srcport", "-e", "modbus.func_code", "-e", "modbus.exception_code",
    )  # fmt: skip
    requests = [row[2] for row in shown if row[0] == UNIT]
    replies = [row for row in shown if row[0] == SERVER.host]
    assert requests == ["3", "1", "3", "5", "6", "8", "15", "16", "22", "23", "43", "65"]
    assert [row[2] for row in replies] == requests
    assert {row[1] for row in replies} == {"502"}
    assert [row[3] for row in replies] == ["", "", "3", *[""] * 8, "1"]
    interfaces = tshark(path, "-T", "fields", "-e", "frame.interface_name")
    assert {row[0] for row in interfaces} == {UNIT, "192.168.250.3"}


def test_a_checksum_of_0_is_written_as_ffff_by_udp_alone() -> None:
    """RFC 768: 0 says that there is none; RFC 9293 3.1 knows no such exception."""
    sender = Peer(UNIT, 9600)
    [frame] = frames.udp(sender, SERVER, 1, b"ab\0\0")
    [frame] = frames.udp(sender, SERVER, 1, b"ab" + frame[40:42])
    assert frame[40:42] == b"\xff\xff"
    made = frames.tcp(sender, SERVER, 1, 7, 9, ACK, b"ab\0\0")
    assert frames.tcp(sender, SERVER, 1, 7, 9, ACK, b"ab" + made[50:52])[50:52] == b"\0\0"
