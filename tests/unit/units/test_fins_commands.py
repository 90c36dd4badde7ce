"""Commands of the CPU unit and of the ETN21: every end code by the shortest frame that provokes it, edges, and when."""

from __future__ import annotations

from copy import deepcopy

import pytest
from fins_rig import FinsRig, TcpClient, compiled
from rows import each_of

from fbvm.net.loop import LoopNetwork
from fbvm.units.etn21.fins.routing import endpoint_of, learn
from fbvm.units.etn21.fins.state import FinsSettings, FinsState
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.fins.frames import parse_frame
from fbvm.wire.link import Peer


@pytest.fixture
def rig() -> FinsRig:
    return FinsRig()


REFUSED = [
    # command, parameters, header, end code
    (0x0101, "82 0000 00 03E7", {}, "0000"), (0x0101, "82 0000 00 03E8", {}, "110B"), (0x0101, "30 0000 00 07CE", {}, "0000"),
    (0x0101, "30 0000 00 07CF", {}, "110B"), (0x0101, "82 7FFF 00 0002", {}, "1104"), (0x0101, "82 8000 00 0001", {}, "1103"),
    (0x0101, "30 0000 10 0001", {}, "1103"), (0x0101, "82 0000 01 0001", {}, "1103"), (0x0101, "38 0000 00 0001", {}, "1101"),
    (0x0101, "A1 0000 00 0001", {}, "1101"), (0x0101, "A0 0005 00 0001", {}, "0000"), (0x0101, "70 0000 00 0001", {}, "1101"),
    (0x0101, "82 0000 00 00", {}, "1002"), (0x0101, "82 0000 00 0001 00", {}, "1001"), (0x0101, "82 0000 00 0000", {}, "0000"),
    (0x0102, "82 0000 00 0002 1234", {}, "1003"), (0x0102, "82 0000 00 0000", {}, "0000"),
    (0x0102, "B3 01BF 00 0001 1234", {}, "2101"), (0x0102, "B3 01C0 00 0001 1234", {}, "0000"),
    (0x0102, "09 0000 00 0001 01", {}, "2101"), (0x0103, "30 0000 00 0001 0001", {}, "1101"),
    (0x0104, "82 0000 00 82 8000 00", {}, "1103"), (0x0104, "", {}, "0000"), (0x0104, "82 0000", {}, "1002"),
    (0x0104, "82 0000 00" * 167, {}, "0000"), (0x0104, "82 0000 00" * 168, {}, "1001"),
    (0x0105, "82 0000 00 82 7FFF 00 0002", {}, "1104"), (0x0105, "30 0000 00 82 0000 00 0001", {}, "1101"),
    (0x0105, "82 0000 00 30 0000 00 0001", {}, "1101"),
    (0x0201, "", {}, "0402"), (0x0306, "", {}, "0402"), (0x2201, "", {}, "0402"), (0x1234, "", {}, "0401"),
    (0x0801, "01", {}, "0401"), (0x0403, "", {}, "0401"), (0x2730, "", {}, "0401"),
    (0x0401, "0001 02", {}, "1106"), (0x0401, "FFFF 01", {}, "110C"), (0x0401, "FF", {}, "1002"),
    (0x0401, "FFFF0200", {}, "1001"),
    (0x0402, "0005", {}, "1106"), (0x0402, "FF", {}, "1002"), (0x0501, "02", {}, "110C"), (0x0620, "02", {}, "110C"),
    (0x0702, "26 13 22 13 44", {}, "1100"), (0x0702, "26 1A 22 13 44", {}, "1100"), (0x0702, "26 11 22 13", {}, "1002"),
    (0x0C01, "0005", {}, "1106"), (0x2301, "0001 0002 30 0064 01", {}, "1100"), (0x2301, "0002 0001 30 0064 01", {}, "1003"),
    (0x2301, "0001 0001 B0 0064 00", {}, "1101"), (0x2301, "0000", {}, "0000"), (0x2301, "00", {}, "1002"),
    (0x0101, "82 0000 00 0001", {"node": 2}, "1005"), (0x0101, "82 0000 00 0001", {"node": 0}, "0000"),
    (0x0101, "82 0000 00 0001", {"network": 3}, "0502"), (0x0101, "82 0000 00 0001", {"unit": 0x11}, "0202"),
    (0x0801, "", {"unit": 0x10}, "1002"), (0x0801, "01", {"unit": 0xFE}, "0000"), (0x2760, "", {"unit": 0x10}, "0402"),
    (0x0101, "", {"unit": 0x10}, "0401"),
    (0x0501, "00", {"unit": 0x10}, "1001"), (0x0601, "00", {"unit": 0xFE}, "1001"), (0x2102, "0000", {"unit": 0x10}, "1002"),
    (0x2102, "0040 0001", {"unit": 0x10}, "1103"), (0x2102, "0000 0000", {"unit": 0x10}, "110C"),
    (0x2103, "", {"unit": 0x10}, "0000"),
    (0x2730, "0001 C0A8FA02", {"unit": 0x10}, "1002"), (0x2730, "0000 C0A8FA02 2580", {"unit": 0x10}, "1100"),
    (0x2730, "0001 00000000 2580", {"unit": 0x10}, "1100"), (0x2730, "0001 C0A8FA02 0000", {"unit": 0x10}, "1100"),
    (0x2730, "0001 C0A8FA02 2580", {"unit": 0x10}, "2231"), (0x2731, "0000", {"unit": 0x10}, "1100"),
    (0x2731, "0011", {"unit": 0x10}, "1100"), (0x2765, "00", {"unit": 0x10}, "1001"),
]  # fmt: skip


@each_of("code, parameters, header, end_code", REFUSED)
def test_end_codes(rig: FinsRig, code: int, parameters: str, header: dict[str, int], end_code: str) -> None:
    assert rig.command(code, parameters, **header)[0] == end_code


@pytest.mark.parametrize(("words", "end_code"), [(996, "0000"), (997, "0000"), (998, "1001")])
def test_most_words_of_one_write(rig: FinsRig, words: int, end_code: str) -> None:
    assert rig.command(0x0102, f"82 0000 00 {words:04X}" + "12 34" * words)[0] == end_code
    assert rig.plc.read(f"D{words - 1}") == (0x1234 if end_code == "0000" else 0)


def test_bits_run_on_into_the_next_word_assumed(rig: FinsRig) -> None:
    assert rig.command(0x0102, "30 0000 0F 0002 01 01") == ("0000", "")
    assert rig.plc.read("CIO 0..CIO 1") == [0x8000, 1]
    assert rig.command(0x0101, "30 0000 0E 0004") == ("0000", "00 01 01 00")


def test_areas_of_cv_mode_read_the_same_words(rig: FinsRig) -> None:
    rig.plc.write("CIO 100", 0x1234)
    rig.plc.write("T7", 7)
    rig.plc.write("C7", 8)
    rig.plc.write("E0_5", 9)
    rig.plc.write("A500", 10)
    for address, data in (("80 0064", "12 34"), ("81 0007", "00 07"), ("81 0807", "00 08"), ("90 0005", "00 09"),
                          ("98 0005", "00 09"), ("80 0CF4", "00 0A")):  # fmt: skip
        assert rig.command(0x0101, f"{address} 00 0001") == ("0000", data)


def test_nothing_is_written_if_the_end_does_not_fit(rig: FinsRig) -> None:
    assert rig.command(0x0102, "82 7FFE 00 0003 1111 2222 3333")[0] == "1104"
    assert rig.plc.read("D32766..D32767") == [0, 0]


def test_nothing_is_forced_if_one_address_is_bad(rig: FinsRig) -> None:
    assert rig.command(0x2301, "0002 0001 30 0064 01 0001 30 9999 00")[0] == "1103"
    assert rig.plc.forces == {}


def test_overlapping_words_are_transferred_as_if_through_a_buffer_assumed(rig: FinsRig) -> None:
    rig.plc.write("D0..D3", [1, 2, 3, 4])
    assert rig.command(0x0105, "82 0000 00 82 0001 00 0003")[0] == "0000"
    assert rig.plc.read("D0..D3") == [1, 1, 2, 3]


def test_the_program_sees_a_write_between_two_scans() -> None:
    """At its first statement and at its last one it sees the same, and a read shows what the refresh left."""
    source = """PROGRAM Main
    VAR Given AT D100 : UINT; First AT D200 : UINT; Last AT D201 : UINT; i : INT; END_VAR
    First := Given; FOR i := 1 TO 10 DO ; END_FOR; Last := Given;
    END_PROGRAM"""
    rig = FinsRig(source)
    assert rig.command(0x0102, "82 0064 00 0001 0007")[0] == "0000"
    assert rig.plc.read("D200..D201") == [0, 0]
    rig.plc.scan()
    assert rig.plc.read("D200..D201") == [7, 7]


def test_two_writes_of_one_servicing_take_effect_in_their_order(rig: FinsRig) -> None:
    for value in ("1111", "2222"):
        rig.say(bytes.fromhex(f"80 00 02 00 01 00 00 19 00 01 01 02 82 00 64 00 00 01 {value}"))
    rig.plc.scan()
    assert len(rig.datagrams()) == 2
    assert rig.plc.read("D100") == 0x2222


def test_a_bit_that_is_written_leaves_its_neighbours_to_the_program() -> None:
    rig = FinsRig("PROGRAM Main VAR Third AT W10.02 : BOOL; END_VAR Third := NOT Third; END_PROGRAM")
    rig.command(0x0102, "31 000A 00 0001 01")
    rig.command(0x0102, "31 000A 01 0001 01")
    assert rig.plc.read("W10") in (3, 7)
    rig.plc.scan()
    assert rig.plc.read("W10") in (3, 7)


def test_stop_and_run_begin_the_program_anew() -> None:
    source = """PROGRAM Main
    VAR n : UINT; First AT A200.11 : BOOL; Starts AT D10 : UINT; Work AT W5 : UINT; Held AT H5 : UINT; END_VAR
    n := n + 1; IF First THEN Starts := Starts + 1; END_IF; Work := n; Held := n;
    END_PROGRAM"""
    rig = FinsRig(source)
    assert rig.command(0x0402) == ("0000", "")
    stood = rig.plc.read("Main.n")
    assert rig.command(0x0620, "01") == ("2203", "")
    assert rig.plc.read("Main.n") == stood
    rig.plc.run(scans=3)
    assert rig.plc.read("Main.n") == stood
    assert rig.command(0x0401) == ("0000", "")
    assert rig.plc.read("W5") == 0
    rig.plc.scan()
    assert (rig.plc.read("Main.n"), rig.plc.read("D10"), rig.plc.read("H5")) == (1, 2, 1)


def test_forces_are_refused_in_run_mode_and_taken_in_monitor_mode_assumed(rig: FinsRig) -> None:
    assert rig.command(0x0401, "FFFF 04") == ("0000", "")
    assert rig.command(0x2301, "0001 0001 30 0064 01")[0] == "2206"
    assert rig.command(0x2302)[0] == "2206"
    assert rig.command(0x0401, "FFFF 02") == ("0000", "")
    assert rig.command(0x2301, "0001 0001 30 0064 01")[0] == "0000"
    assert rig.plc.read("CIO 100.01") is True
    assert rig.command(0x2301, "0001 8000 30 0064 01")[0] == "0000"
    assert (rig.plc.read("CIO 100.01"), rig.plc.forces) == (False, {})


def test_cycle_times_of_the_last_eight_cycles(rig: FinsRig) -> None:
    rig.plc.run(scans=20)
    assert rig.command(0x0620, "01") == ("0000", "00 00 00 64 00 00 00 64 00 00 00 64")
    rig.plc.cycle_ns = 20_000_000
    rig.plc.run(scans=5)
    _, data = rig.command(0x0620, "01")
    average, longest, least = (int(data.replace(" ", "")[at : at + 8], 16) for at in (0, 8, 16))
    assert (longest, least) == (200, 100)
    assert 100 < average < 200
    assert rig.command(0x0620, "00") == ("0000", "")
    rig.plc.run(scans=9)
    assert rig.command(0x0620, "01")[1].split()[3::4] == ["C8", "C8", "C8"]


def test_the_access_right_keeps_others_from_the_mode(rig: FinsRig) -> None:
    assert rig.command(0x0C01, "FFFF", source=25) == ("0000", "")
    assert rig.command(0x0C01, "FFFF", source=26) == ("3001", "00 19 00")
    assert rig.command(0x0402, source=26) == ("3001", "00 19 00")
    assert rig.command(0x0102, "82 0000 00 0001 0007", source=26) == ("0000", "")
    assert rig.command(0x0C02, "FFFF", source=26) == ("0000", "")
    assert rig.command(0x0402, source=25)[0] == "3001"
    assert rig.command(0x0C03, "FFFF", source=25) == ("0000", "")
    assert rig.command(0x0402, source=25) == ("0000", "")


def test_connection_data_have_the_unit(rig: FinsRig) -> None:
    end_code, data = rig.command(0x0502, "10")
    assert (end_code, bytes.fromhex(data)) == ("0000", bytes((0x81, 0x10)) + b"CJ1W-ETN21          ")
    assert rig.command(0x0502, "11") == ("0000", "80")


def test_the_error_log_is_empty(rig: FinsRig) -> None:
    assert rig.command(0x2101, "FFFF") == ("0000", "")
    assert rig.command(0x2102, "0000 0005") == ("0000", "00 14 00 00 00 00")
    assert rig.command(0x2102, "0003 0005") == ("0000", "")
    assert rig.command(0x2103) == ("0000", "")


def test_the_unit_says_what_it_is(rig: FinsRig) -> None:
    """The node's two bytes, and the mode setting, are assumed."""
    end_code, data = rig.command(0x0501, unit=0x10)
    assert (end_code, bytes.fromhex(data)[:40]) == ("0000", b"CJ1W-ETN21".ljust(20) + b"fbvm".ljust(20))
    assert data[120:] == "C0 A8 FA 01 FF FF FF 00 25 80 00 00 02 00 C0 A8 FA 01"
    assert rig.command(0x2765, unit=0xFE) == ("0000", "00 01 00 01 C0 A8 FA 01")
    assert rig.command(0x2102, "0000 0001", unit=0xFE) == ("0000", "00 40 00 00 00 00")


def test_the_unit_counts_packets_and_shows_the_flags_of_n_18() -> None:
    rig = FinsRig(fins_node=7)
    rig.command(0x0101, "82 0000 00 0001", node=7)
    received, sent = "00 00 00 02", "00 00 00 01"
    nothing = "00 00 00 00"
    assert rig.command(0x0601, unit=0x10, node=7) == ("0000", f"40 00 {received} {nothing} {sent} {nothing} {nothing}")
    copy = deepcopy(rig.unit)
    assert copy.state.other == rig.unit.state.other


def test_the_unit_says_who_is_connected(rig: FinsRig) -> None:
    assert rig.command(0x2731, "0001", unit=0x10)[1] == "00 01 00 03 C0 A8 FA 01 25 80 00 00 00 00 00 00 00 00 00 01"
    TcpClient(rig).connect()
    status = rig.command(0x2731, "0001", unit=0x10)[1]
    assert status.startswith("00 01 00 03 C0 A8 FA 01 25 80 C0 A8 FA ")
    assert status.endswith(" 00 00 00 04")


def test_the_unit_echoes(rig: FinsRig) -> None:
    assert rig.command(0x0801, "01 02 03", unit=0xFE) == ("0000", "01 02 03")


@each_of(("code", "end_code"), [
    *[(code, "0402") for code in (0x0802, 0x0803, 0x2701, 0x2702, 0x2703, 0x2704, 0x2710, 0x2711, 0x2712, 0x2713, 0x2714, 0x2720,
                                  0x2750, 0x2760, 0x2761, 0x2762, 0x2763, 0x2764)],
    *[(code, "0401") for code in (0x0101, 0x0804, 0x2700, 0x2705, 0x2751, 0x2766)]])
def test_commands_that_an_etn21_has_and_that_are_not_served_are_not_supported(rig: FinsRig, code: int, end_code: str) -> None:
    """Those that it does not have are undefined.  W343 section 10."""
    assert rig.command(code, "", unit=0x10)[0] == end_code


@pytest.mark.slow
def test_a_reset_of_the_unit_takes_its_connections_with_it(rig: FinsRig) -> None:
    client = TcpClient(rig)
    client.connect()
    assert rig.plc.read("CIO 1523") == 1
    assert rig.command(0x0403, unit=0x10) == ("0000", "")
    rig.plc.run(scans=5)
    client.hear()
    assert client.ended
    assert rig.plc.read("CIO 1523") == 0
    rig.plc.run(for_ns=5_000_000_000)
    assert rig.command(0x0101, "82 0000 00 0001") == ("0000", "00 00")
    assert TcpClient(rig, 101).connect().startswith("46 49 4E 53 00 00 00 10 00 00 00 01 00 00 00 00")


@pytest.mark.parametrize(("access", "refused", "taken"), [
    ("read-only", ["0102 82 0000 00 0001 0001", "0103 82 0000 00 0001 0001", "0105 82 0000 00 82 0001 00 0001", "0401", "0402",
                   "0702 26 11 22 13 44", "2101 FFFF", "2103", "2301 0001 0001 30 0064 01", "2302"],
     ["0101 82 0000 00 0001", "0501", "0601", "0701", "0620 01", "2102 0000 0001", "0C01 FFFF"]),
    ("no-control", ["0401", "0402"], ["0102 82 0000 00 0001 0001", "2302"]),
])  # fmt: skip
def test_what_a_protected_unit_refuses(access: str, refused: list[str], taken: list[str]) -> None:
    rig = FinsRig(fins_access=access)
    for end_code, commands in (("2102", refused), ("0000", taken)):
        for text in commands:
            assert rig.command(int(text[:4], 16), text[4:])[0] == end_code, text
    assert rig.command(0x0403, unit=0x10)[0] == "2102"
    assert rig.command(0x2103, unit=0x10)[0] == ("2102" if access == "read-only" else "0000")


def test_a_broadcast_is_executed_and_never_answered(rig: FinsRig) -> None:
    assert rig.command(0x0102, "82 0000 00 0001 0007", node=0xFF) == ("", "")
    assert rig.plc.read("D0") == 7


@pytest.mark.parametrize("data", [
    b"", b"\x80", bytes(11), bytes(12), b"\x80\x01\x02\x00\x01\x00\x00\x19\x00\x01\x01\x01",
    bytes.fromhex("C0 00 02 00 01 00 00 19 00 01 01 01 00 00"), bytes.fromhex("C0 00 02 00 01 00 00 19 00 01 01 01"),
])  # fmt: skip
def test_what_is_no_command_is_met_with_silence(rig: FinsRig, data: bytes) -> None:
    assert rig.ask_bytes(data) == b""


def test_two_clients_with_one_node_get_their_own_answers(rig: FinsRig) -> None:
    """The table of a real unit has one endpoint a node, so that the last to ask would get both answers."""
    from fbvm.wire.link import Bind, Peer, Received, SendTo

    other = rig.network.attach("192.168.250.77")
    other.submit([Bind(1, 6000)], rig.plc.now_ns)
    rig.say(bytes.fromhex("80 00 02 00 01 00 00 19 00 01 01 01 82 00 64 00 00 01"))
    other.submit([SendTo(1, Peer("192.168.250.1", 9600), bytes.fromhex("80 00 02 00 01 00 00 19 00 02 06 01"))], rig.plc.now_ns)
    rig.plc.scan()
    [own] = rig.datagrams()
    [others] = [event.data for event in other.events(rig.plc.now_ns) if isinstance(event, Received)]
    assert (own[9], others[9]) == (1, 2)


def test_a_node_of_the_address_table_has_to_come_from_its_address() -> None:
    rig = FinsRig(fins_nodes={"25": "192.168.250.25", "26": "192.168.250.26:9601"})
    assert rig.command(0x0601, source=25)[0] == "0000"
    assert rig.command(0x0601, source=26)[0] == "2108"
    assert rig.command(0x0601, source=27)[0] == "0000"


def test_a_unit_of_node_0_takes_every_node() -> None:
    rig = FinsRig(fins_node=0)
    assert rig.command(0x0601, node=77)[0] == "0000"


def test_a_node_that_is_not_the_host_part_is_shown_as_disagreement() -> None:
    assert FinsRig().plc.read("CIO 1518") == 0
    rig = FinsRig(fins_node=7)
    assert rig.plc.read("CIO 1518") == 0x4000
    assert rig.command(0x0601, node=7)[0] == "0000"
    assert FinsRig(fins_node=7, fins_nodes={"25": "192.168.250.25"}).plc.read("CIO 1518") == 0


def test_the_unit_shows_its_address_assumed() -> None:
    assert FinsRig().plc.read("D30098..D30099") == [0xC0A8, 0xFA01]


def test_without_fins_nothing_is_opened_and_no_word_is_shown() -> None:
    network, plc = LoopNetwork(), compiled()
    unit = Etn21(0, "192.168.250.1")
    plc.attach(unit, network)
    plc.run(scans=3)
    assert not plc.units[0].link.channels  # type: ignore[attr-defined]
    assert plc.read("D30098..D30099") == [0, 0]
    assert "fins" not in unit.configuration


@pytest.mark.parametrize("given", [{"fins_port": 0}, {"fins_node": 255}, {"fins_nodes": {"x": "1.2.3.4"}},
                                   {"fins_nodes": {"2": "1.2.3"}}, {"fins_nodes": {"255": "1.2.3.4"}},
                                   {"fins_nodes": {"2": "1.2.3.4:x"}}, {"fins_access": "all"}])  # fmt: skip
def test_a_service_that_cannot_be_is_refused(given: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"FINS|node|fins_access"):
        Etn21(0, "192.168.250.1", fins=True, **given)  # type: ignore[arg-type]


def test_what_is_too_short_to_be_a_frame_is_described() -> None:
    assert "11 bytes" in getattr(parse_frame(bytes(11)), "reason", "")


def test_a_node_is_where_the_table_says_or_it_has_sent_from_or_its_number_leads() -> None:
    settings = FinsSettings("192.168.250.3", nodes={7: Peer("10.0.0.7", 9601)})
    state = FinsState(learned={7: Peer("10.0.0.8", 9602), 8: Peer("10.0.0.8", 9602)})
    assert [str(endpoint_of(settings, state, node)) for node in (7, 8, 9, 255)] == [
        "10.0.0.7:9601", "10.0.0.8:9602", "192.168.250.9:9600", "192.168.250.255:9600"]


@each_of("node, remote, code, learned", [
    (8, Peer("10.0.0.9", 1), 0, {8: Peer("10.0.0.9", 1)}), (254, Peer("10.0.0.9", 1), 0, {254: Peer("10.0.0.9", 1)}),
    (255, Peer("10.0.0.9", 1), 0, {}), (0, Peer("10.0.0.9", 1), 0, {}), (3, Peer("10.0.0.9", 1), 0, {}),
    (7, Peer("10.0.0.7", 1), 0, {}), (7, Peer("10.0.0.8", 9601), 0x2108, {}),
])
def test_from_where_a_node_has_sent_is_kept_unless_the_table_has_it(node: int, remote: Peer, code: int,
                                                                    learned: dict[int, Peer]) -> None:  # fmt: skip
    """An IP address table has node 7; 3 is the unit's own, 255 and 0 are none."""
    state = FinsState()
    assert learn(FinsSettings("192.168.250.3", nodes={7: Peer("10.0.0.7", 9601)}), state, node, remote) == code
    assert state.learned == learned
