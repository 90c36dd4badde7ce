"""What Wireshark's dissector of FINS says of frames by UDP and TCP that a run has captured."""

from __future__ import annotations

from pathlib import Path

import pytest
from fins_rig import UNIT, FinsRig, TcpClient, compiled
from wireshark import TSHARK, tshark

from fbvm.record.export.pcapng import Capture
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.fins.frames import Address, Command, Header

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not TSHARK, reason="tshark is not installed")]
COMMANDS = ["0101 82 0064 00 0003", "0102 82 0064 00 0002 1234 5678", "0103 82 0000 00 000A ABCD", "0104 82 0064 00 30 0064 01",
            "0105 82 0000 00 82 0064 00 000A", "0501", "0501 00", "0501 01", "0502 10 19", "0601", "0620 01", "0701",
            "0702 26 11 22 13 44 04 00", "0C01 FFFF", "0C02 FFFF", "0C03 FFFF", "2101 FFFF", "2102 0000 0001", "2103",
            "2301 0001 0001 30 0064 01", "2302", "0402", "0401 FFFF 02", "0101 82 8000 00 0001", "0801 01 02"]  # fmt: skip


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("fins") / "run.pcapng"
    with path.open("wb") as file:
        rig = FinsRig()
        rig.network.tap = Capture(file, comment=lambda address: f"scan {rig.plc.scans}").tap
        for text in COMMANDS:
            rig.command(int(text[:4], 16), text[4:], unit=0x10 if text.startswith("0801") else 0)
        client = TcpClient(rig)
        client.connect()
        for text in COMMANDS:
            unit = "10" if text.startswith("0801") else "00"
            client.frame(f"80 00 02 00 01 {unit} 00 EF 00 01" + text)
        client.leave()
        rig.plc.run(scans=3)
    return path


def test_nothing_is_malformed_but_what_the_dissector_cannot_read(capture: Path) -> None:
    """A client may ask for the unit's data without a parameter (W342 p190); the dissector wants one.  Every answer is fine."""
    malformed = tshark(capture, "-Y", "_ws.malformed", "-T", "fields", "-e", "omron.command", "-e", "omron.icf")
    assert malformed == ["0x0501", "0x80"] * 2
    assert tshark(capture, "-Y", "tcp.checksum.status == 0 || ip.checksum.status == 0") == []


def test_each_frame_is_a_command_or_a_response_of_fins(capture: Path) -> None:
    codes = tshark(capture, "-Y", "omron", "-T", "fields", "-e", "omron.command")
    asked = [f"0x{text[:4].lower()}" for text in COMMANDS]
    both = [code for code in asked for _ in range(2)]
    assert codes[: len(both)] == both
    assert codes[len(both) :] == both


def test_a_comment_says_the_scan_and_the_frame(capture: Path) -> None:
    said = " ".join(tshark(capture, "-Y", "omron", "-T", "fields", "-e", "frame.comment"))
    assert "scan 2; FINS 25 -> 1, service 7: memory area read, D100, 3 elements" in said
    assert "FINS 1 -> 25, service 7: memory area read: normal end, 6 bytes" in said
    assert "FINS 239 -> 1, service 1: forced set or reset, CIO 100.01 ON" in said


def test_commands_over_a_connection_that_the_unit_opens_are_fins_too(tmp_path: Path) -> None:
    path = tmp_path / "run.pcapng"
    with path.open("wb") as file:
        rig = FinsRig()
        other = compiled()
        desk = Etn21(0, "192.168.250.2", fins=True, fins_clients={"1": UNIT})
        other.attach(desk, rig.network)
        rig.network.tap = Capture(file, comment=lambda address: f"scan {rig.plc.scans}").tap
        for scan in range(12):
            if scan == 6:
                assert desk.send(Command(Header(Address(0, 1), Address(), 7), 0x0101, bytes.fromhex("82 0064 00 0001"))) == 0
            rig.plc.scan()
            other.scan()
    assert tshark(path, "-Y", "_ws.malformed") == []
    said = " ".join(tshark(path, "-Y", "tcp.port == 9600", "-T", "fields", "-e", "frame.comment"))
    assert "FINS/TCP: client node 2, server node 1" in said
    assert "FINS 1 -> 2, service 7: memory area read: normal end, 2 bytes" in said
