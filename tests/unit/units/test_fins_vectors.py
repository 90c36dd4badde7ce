"""The service against bytes that real clients have sent and taken: request and response, byte for byte."""

from __future__ import annotations

import pytest
from fins_rig import FinsRig, TcpClient

FINS_UDP = "80 00 07 00 01 00 00 19 00 60"
FINS_ANSWER = "C0 00 02 00 19 00 00 01 00 60"
DRIVER = "80 00 07 00 00 00 00 01 00 00"
OMRON_FINS = "80 00 02 00 01 00 00 19 00 01"
OMRON_ANSWER = "C0 00 02 00 19 00 00 01 00 01"


@pytest.fixture
def rig() -> FinsRig:
    made = FinsRig()
    made.plc.write("D100..D103", [0x1230, 0x1231, 0x1232, 0x1233])
    return made


def test_fins_reads_one_word(rig: FinsRig) -> None:
    assert rig.ask(f"{FINS_UDP} 01 01 82 00 64 00 00 01") == f"{FINS_ANSWER} 01 01 00 00 12 30"


def test_fins_reads_two_reals_low_word_first(rig: FinsRig) -> None:
    assert rig.ask(f"{FINS_UDP} 01 01 82 00 64 00 00 04") == f"{FINS_ANSWER} 01 01 00 00 12 30 12 31 12 32 12 33"


@pytest.mark.parametrize(("request_", "place", "value"), [
    ("01 02 82 00 64 00 00 01 04 D2", "D100", 1234),
    ("01 02 82 00 C8 00 00 02 00 00 3F C0", "D201", 0x3FC0),
    ("01 02 31 00 0A 03 00 01 01", "W10", 8),
])  # fmt: skip
def test_fins_writes(rig: FinsRig, request_: str, place: str, value: int) -> None:
    assert rig.ask(f"{FINS_UDP} {request_}") == f"{FINS_ANSWER} 01 02 00 00"
    assert rig.plc.read(place) == value


def test_fins_reads_a_bit(rig: FinsRig) -> None:
    rig.plc.write("CIO 100.01", True)
    assert rig.ask(f"{FINS_UDP} 01 01 30 00 64 01 00 01") == f"{FINS_ANSWER} 01 01 00 00 01"


def test_fins_asks_for_the_unit_its_status_and_its_modes(rig: FinsRig) -> None:
    data = bytes.fromhex(rig.ask(f"{FINS_UDP} 05 01"))
    assert len(data) == 14 + 159
    assert data[14:34] == b"CJ2M-CPU33-FBVM     "
    assert data[14 + 82 : 14 + 86].hex() == "17800008"
    assert data[14 + 92 : 14 + 94].hex() == "8000"
    status = rig.ask(f"{FINS_UDP} 06 01")
    assert status == f"{FINS_ANSWER} 06 01 00 00 01 02 00 00 00 00 00 00 00 00" + " 20" * 16
    assert rig.ask(f"{FINS_UDP} 04 01") == f"{FINS_ANSWER} 04 01 00 00"
    assert rig.ask(f"{FINS_UDP} 04 02") == f"{FINS_ANSWER} 04 02 00 00"
    assert rig.ask(f"{FINS_UDP} 06 01") == f"{FINS_ANSWER} 06 01 00 00 00 00 00 00 00 00 00 00 00 00" + " 20" * 16


def test_fins_by_tcp_gets_a_node_and_reads(rig: FinsRig) -> None:
    client = TcpClient(rig)
    hello = "46 49 4E 53 00 00 00 10 00 00 00 01 00 00 00 00 00 00 00 EF 00 00 00 01"
    assert client.connect() == hello
    request = "46 49 4E 53 00 00 00 1A 00 00 00 02 00 00 00 00 80 00 07 00 01 00 00 EF 00 60 01 01 82 00 64 00 00 01"
    answer = "46 49 4E 53 00 00 00 18 00 00 00 02 00 00 00 00 C0 00 02 00 EF 00 00 01 00 60 01 01 00 00 12 30"
    assert client.ask(request) == answer


def test_fins_driver_names_no_node_of_the_plc(rig: FinsRig) -> None:
    assert rig.ask(f"{DRIVER} 01 01 82 00 64 00 00 03") == "C0 00 02 00 01 00 00 00 00 00 01 01 00 00 12 30 12 31 12 32"


def test_fins_driver_fills_reads_several_and_transfers(rig: FinsRig) -> None:
    answer = "C0 00 02 00 01 00 00 00 00 00"
    assert rig.ask(f"{DRIVER} 01 03 82 00 00 00 00 0A AB CD") == f"{answer} 01 03 00 00"
    assert rig.plc.read("D0..D10") == [0xABCD] * 10 + [0]
    rig.plc.write("D100", 0x1234)
    rig.plc.write("CIO 100.01", True)
    rig.plc.write("H5", 0x1234)
    several = "01 04 82 00 64 00 30 00 64 01 B2 00 05 00"
    assert rig.ask(f"{DRIVER} {several}") == f"{answer} 01 04 00 00 82 12 34 30 01 B2 12 34"
    assert rig.ask(f"{DRIVER} 01 05 82 00 00 00 82 00 64 00 00 0A") == f"{answer} 01 05 00 00"
    assert rig.plc.read("D100..D110") == [0xABCD] * 10 + [0]


@pytest.mark.parametrize(("request_", "mode"), [("04 01 FF FF 02", "02"), ("04 01 FF FF 04", "04"), ("04 02", "00")])
def test_fins_driver_changes_the_mode(rig: FinsRig, request_: str, mode: str) -> None:
    assert rig.ask(f"{DRIVER} {request_}").endswith("00 00")
    assert rig.ask(f"{DRIVER} 06 01")[14 * 3 :].split()[1] == mode


def test_fins_driver_forces_and_releases(rig: FinsRig) -> None:
    answer = "C0 00 02 00 01 00 00 00 00 00"
    rig.plc.force("W10.03", True)
    forced = "23 01 00 02 00 01 30 00 64 01 FF FF 31 00 0A 03"
    assert rig.ask(f"{DRIVER} {forced}") == f"{answer} 23 01 00 00"
    assert rig.plc.forces == {"CIO 100.01": True}
    assert rig.ask(f"{DRIVER} 23 02") == f"{answer} 23 02 00 00"
    assert rig.plc.forces == {}


def test_omron_fins_reads_timers_and_counters(rig: FinsRig) -> None:
    rig.plc.write("T5", 0x0102)
    rig.plc.write("C5", 0x0304)
    rig.plc.write("TF5", True)
    for request, data in (("89 00 05 00", "01 02"), ("89 80 05 00", "03 04"), ("09 00 05 00", "01"), ("09 80 05 00", "00")):
        assert rig.ask(f"{OMRON_FINS} 01 01 {request} 00 01") == f"{OMRON_ANSWER} 01 01 00 00 {data}"


def test_omron_fins_writes_two_words(rig: FinsRig) -> None:
    assert rig.ask(f"{OMRON_FINS} 01 02 82 00 64 00 00 02 12 34 56 78") == f"{OMRON_ANSWER} 01 02 00 00"
    assert rig.plc.read("D100..D101") == [0x1234, 0x5678]


@pytest.mark.slow
def test_omron_fins_sets_and_reads_the_clock(rig: FinsRig) -> None:
    assert rig.ask(f"{OMRON_FINS} 07 02 26 11 22 13 44 04 00") == f"{OMRON_ANSWER} 07 02 00 00"
    assert rig.ask(f"{OMRON_FINS} 07 01") == f"{OMRON_ANSWER} 07 01 00 00 26 11 22 13 44 04 00"
    rig.plc.run(for_ns=60_000_000_000)
    assert rig.ask(f"{OMRON_FINS} 07 01") == f"{OMRON_ANSWER} 07 01 00 00 26 11 22 13 45 04 00"


def test_omron_fins_reads_the_first_of_several(rig: FinsRig) -> None:
    assert rig.ask(f"{OMRON_FINS} 01 04 82 00 64 00") == f"{OMRON_ANSWER} 01 04 00 00 82 12 30"


def test_a_length_of_eight_bits_ends_in_1003_and_a_notification(rig: FinsRig) -> None:
    client = TcpClient(rig)
    client.connect()
    frame = bytes.fromhex("80 00 02 00 01 00 00 EF 00 01 01 02 82 00 64 00 00 C8") + bytes(400)
    answer = client.ask((b"FINS" + bytes.fromhex("000000AA 00000002 00000000") + frame).hex())
    assert answer == ("46 49 4E 53 00 00 00 16 00 00 00 02 00 00 00 00 C0 00 02 00 EF 00 00 01 00 01 01 02 10 03 "
                      "46 49 4E 53 00 00 00 08 00 00 00 03 00 00 00 01")
    assert client.ended


def test_an_http_request_is_told_that_it_is_no_fins_and_closed(rig: FinsRig) -> None:
    client = TcpClient(rig)
    rig.plc.run(scans=2)
    answer = client.ask(b"GET / HTTP/1.1\r\n\r\n".hex())
    assert answer == "46 49 4E 53 00 00 00 10 00 00 00 01 00 00 00 01 00 00 00 00 00 00 00 00"
    assert client.ended


def test_a_second_node_address_is_an_error(rig: FinsRig) -> None:
    client = TcpClient(rig)
    client.connect()
    assert client.ask("46 49 4E 53 00 00 00 0C 00 00 00 00 00 00 00 00 00 00 00 00") == (
        "46 49 4E 53 00 00 00 08 00 00 00 03 00 00 00 03")
    assert client.ended


def test_a_write_without_response_is_done_in_silence(rig: FinsRig) -> None:
    assert rig.ask(f"81 {OMRON_FINS[3:]} 01 02 82 00 64 00 00 02 12 34 56 78") == ""
    assert rig.plc.read("D100..D101") == [0x1234, 0x5678]


def test_finscommand_reads_990_words_and_then_none(rig: FinsRig) -> None:
    head, answer = "80 00 02 00 01 00 00 7F 00 00", "C0 00 02 00 7F 00 00 01 00 00"
    assert len(bytes.fromhex(rig.ask(f"{head} 01 01 82 00 64 00 03 DE"))) == 14 + 1980
    assert rig.ask(f"{head} 01 01 82 04 42 00 00 00") == f"{answer} 01 01 00 00"


def test_omron_fins_reads_three_words(rig: FinsRig) -> None:
    assert rig.ask(f"{OMRON_FINS} 01 01 82 00 64 00 00 03") == f"{OMRON_ANSWER} 01 01 00 00 12 30 12 31 12 32"


def test_omron_fins_runs_and_stops(rig: FinsRig) -> None:
    assert rig.ask(f"{OMRON_FINS} 04 02") == f"{OMRON_ANSWER} 04 02 00 00"
    assert rig.ask(f"{OMRON_FINS} 04 01") == f"{OMRON_ANSWER} 04 01 00 00"


@pytest.mark.parametrize(("word", "flags"), [("A402", "40"), ("A401", "80")])
def test_an_error_of_the_plc_is_in_the_end_code_beside_its_number_if_that_is_asked_for(word: str, flags: str) -> None:
    for asked in (False, True):
        rig = FinsRig(fins_error_flags=asked)
        rig.plc.write("D100..D101", [0x1230, 0x1231])
        rig.plc.write(word, 0x8000)
        end_code = f"00 {flags}" if asked else "00 00"
        assert rig.ask(f"{OMRON_FINS} 01 01 82 00 64 00 00 02") == f"{OMRON_ANSWER} 01 01 {end_code} 12 30 12 31"
        bad = f"11 {0x03 | int(flags, 16):02X}" if asked else "11 03"
        assert rig.ask(f"{OMRON_FINS} 01 01 82 80 00 00 00 01") == f"{OMRON_ANSWER} 01 01 {bad}"
        unit = rig.ask("80 00 02 00 01 10 00 19 00 01 08 01 55")
        assert unit == "C0 00 02 00 19 00 00 01 10 01 08 01 00 00 55", "of the CPU unit only"
