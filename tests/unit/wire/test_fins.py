"""The codec of FINS: there and back, any bytes, areas, and what a decoder says."""

from __future__ import annotations

import pytest
from fins_rig import FinsRig, TcpClient
from hypothesis import given
from hypothesis import strategies as st
from rows import each_of

from fbvm.base.areas import AREAS, E_NAMES
from fbvm.wire.fins.areas import SPANS, WORD_CODES, place_of, span_at, spans_of
from fbvm.wire.fins.codes import COMMANDS, END_CODES, EndCode, command_name, meaning_of
from fbvm.wire.fins.frames import (
    ANY_ETHERNET_UNIT,
    CPU_BUS_UNITS,
    CPU_UNIT,
    EVERY_NODE,
    LAST_NODE,
    MAX_DATA_BYTES,
    MAX_FRAME_BYTES,
    MAX_PARAMETER_BYTES,
    MIN_COMMAND_BYTES,
    MIN_RESPONSE_BYTES,
    PORT,
    Address,
    Command,
    Damaged,
    Header,
    Response,
    parse_frame,
)
from fbvm.wire.fins.tcp import ERRORS, Error, Kind, Message, Splitter, Unreadable, client_node, server_node
from fbvm.wire.fins.text import described, described_message

BYTE = st.integers(0, 255)
ADDRESSES = st.builds(Address, BYTE, BYTE, BYTE)


@pytest.mark.slow
@given(ADDRESSES, ADDRESSES, BYTE, st.sampled_from([0x80, 0x81]), st.integers(0, 0xFFFF), st.binary(max_size=50))
def test_a_command_comes_back(to: Address, by: Address, service: int, icf: int, code: int, parameters: bytes) -> None:
    command = Command(Header(to, by, service, icf), code, parameters)
    assert parse_frame(command.to_bytes()) == command
    answer = Response(command.header.answer(), code, 0x1103, parameters)
    assert parse_frame(answer.to_bytes()) == answer
    assert answer.header.destination == by and answer.header.service == service
    assert answer.header.is_response and not answer.header.wants_response


@pytest.mark.slow
@given(st.binary(max_size=60))
def test_any_bytes_are_a_frame_or_damaged_and_can_be_described(data: bytes) -> None:
    frame = parse_frame(data)
    assert isinstance(frame, Damaged) or frame.to_bytes() == data
    assert described(frame)


@pytest.mark.slow
@given(st.binary(max_size=200), st.integers(1, 20))
def test_any_stream_is_cut_alike_wherever_tcp_cuts_it(data: bytes, size: int) -> None:
    stream = Message(Kind.FRAME, data).to_bytes() + data
    whole, cut = Splitter(), Splitter()
    found = whole.feed(stream)
    parts = [each for at in range(0, len(stream), size) for each in cut.feed(stream[at : at + size])]
    messages = [each for each in found if isinstance(each, Message)]
    assert [each for each in parts if isinstance(each, Message)] == messages
    assert whole.broken == cut.broken
    for message in messages:
        assert described_message(message)


def test_the_spans_of_a_code_do_not_meet_and_lie_in_their_areas() -> None:
    for span in SPANS:
        for number in (span.first, span.first + span.count - 1):
            assert [each for each in spans_of(span.code) if each.first <= number < each.first + each.count] == [span]
        size = 32768 if span.area in E_NAMES else AREAS[span.area].count
        assert span.count <= size, span
    assert place_of(0x82, 0, 1) is None and place_of(0x30, 0, 16) is None and place_of(0x77, 0, 0) is None


def test_words_that_are_sent_have_a_code_of_cs_mode() -> None:
    assert {area: f"{code:02X} {first:04X}" for area, (code, first) in WORD_CODES.items() if area not in E_NAMES} == {
        "CIO": "B0 0000", "W": "B1 0000", "H": "B2 0000", "A": "B3 0000", "D": "82 0000", "T": "89 0000", "C": "89 8000"}
    assert [WORD_CODES[name][0] for name in E_NAMES] == [0xA0 + bank for bank in range(13)]


AREA_CODES = """
30 B0 0000 6144 CIO, 31 B1 0000 512 W, 32 B2 0000 512 H, 33 B3 0000 960 A, 02 82 0000 32768 D, 0A 98 0000 32768 E0
20 A0 0000 32768 E0, 27 A7 0000 32768 E7, 2C AC 0000 32768 EC
00 80 0000 2560 CIO, 00 80 0B00 960 A, - 90 0000 32768 E0, - 97 0000 32768 E7
"""
FLAG_CODES = "09 89 0000 4096 T TF, 09 89 8000 4096 C CNF, 01 81 0000 2048 T TF, 01 81 0800 2048 C CNF"


def test_area_codes_name_what_the_manual_says() -> None:
    """W342 5-2-1 p163, W343 p117; code of bits, code of words, first FINS number, how many words, area."""
    for row in AREA_CODES.replace("\n", ",").split(","):
        if not row:
            continue
        bits, words, first, count, area = row.split()
        start, size = int(first, 16), int(count)
        for outside in (start - 1, start + size):
            found = span_at(int(words, 16), outside)
            assert found is None or found.area != area, row
        for number, at in ((start, 0), (start + size - 1, size - 1)):
            found = span_at(int(words, 16), number)
            assert found is not None and str(found.address(number - start)) == f"{_front(area)}{at}", row
            if bits != "-":
                placed = place_of(int(bits, 16), number, 15)
                assert placed is not None and str(placed[0].address(placed[1])) == f"{_front(area)}{at}.15", row
    for row in FLAG_CODES.split(","):
        flags, words, first, count, area, flag_area = row.split()
        for code, name in ((int(flags, 16), flag_area), (int(words, 16), area)):
            found = span_at(code, int(first, 16) + int(count) - 1)
            assert found is not None and (found.area, found.count) == (name, int(count)), row
            placed = place_of(code, int(first, 16), 0)
            assert placed is not None and str(placed[0].address(placed[1])) in (f"{area}0", f"{area}0000"), row
            assert place_of(code, int(first, 16), 1) is None, "a flag has no bits"


def _front(area: str) -> str:
    """How an area's addresses begin."""
    return "CIO " if area == "CIO" else f"{area}_" if area in E_NAMES else area


LISTED = """
00: 00 01, 01: 01 02 03 04 05 06, 02: 01 02 03 04 05, 03: 01 02 03 04, 04: 01 02, 05: 01 02 03 04, 10: 01 02 03 04 05
11: 00 01 02 03 04 06 09 0A 0B 0C, 20: 02 03 04 05 06 07, 21: 01 02 03 05 06 07 08
22: 01 02 03 04 05 06 07 08 0F 10 11 30 31 32 40, 23: 01 02 03, 24: 01, 25: 02 03 04 05 06 07 09 0A 10
26: 01 02 04 05 06 07 08 09 0A 0B, 30: 01, 40: 01
"""
GIVEN = {
    "NORMAL": "normal end", "NOT_IN_NETWORK": "local node", "NO_UNIT": "no unit", "BUSY": "busy",
    "TIMED_OUT": "time-out", "UNDEFINED": "undefined command", "NOT_SUPPORTED": "not supported",
    "NO_ROUTE": "no routing tables", "TOO_LONG": "too long", "TOO_SHORT": "too short",
    "COUNT": "number of elements", "HEADER": "header", "PARAMETER": "parameter",
    "NO_AREA": "no such area", "FIRST_ADDRESS": "first address",
    "ADDRESS_RANGE": "address range", "NO_PROGRAM": "no such program",
    "RESPONSE_TOO_LONG": "response too long", "OTHER_PARAMETER": "parameter", "READ_ONLY": "read only",
    "PROTECTED": "protected", "CANNOT_CHANGE": "cannot be changed", "IN_PROGRAM": "PROGRAM mode",
    "IN_RUN": "RUN mode", "CONNECTION_EXISTS": "connection exists", "NOT_A_CLIENT": "not a client",
    "ACCESS_RIGHT": "access right",
}  # fmt: skip


def test_the_end_codes_are_those_of_the_lists_and_no_others() -> None:
    """W342 5-1-3 p155, W420 8-5 p223-225, W343 10-6; wireshark and omron-fins agree on those that these leave out."""
    rows = (row.partition(":") for row in LISTED.replace("\n", ",").split(",") if row)
    assert set(END_CODES) == {int(main, 16) << 8 | int(sub, 16) for main, _, subs in rows for sub in subs.split()}
    assert all(END_CODES.values())


def test_each_end_code_that_is_given_has_its_words() -> None:
    assert set(EndCode.__members__) == set(GIVEN)
    assert {name: code for name, code in EndCode.__members__.items() if GIVEN[name] not in END_CODES[code.value]} == {}
    assert meaning_of(0x8205) == "response time-out, on the way"
    assert meaning_of(0x00C0).startswith("normal end, with a fatal")
    assert meaning_of(0x7F00) == "end code 7F00"
    assert command_name(0x0999) == "command 0999" and all(map(command_name, COMMANDS))


@each_of(("frame", "said"), [
    ("80 00 02 00 01 00 00 19 00 01 01 02 30 0064 01 0001 01",
     "FINS 25 -> 1, service 1: memory area write, CIO 100.01, 1 element: 01"),
    ("81 00 02 00 01 00 00 19 00 01 01 05 82 0000 00 A0 0064 00 000A",
     "FINS 25 -> 1, service 1: memory area transfer, D0 to E0_100, 10 elements, no response wanted"),
    ("80 00 02 00 01 00 00 19 00 01 04 01 FFFF 04", "FINS 25 -> 1, service 1: run, RUN"),
    ("80 00 02 00 01 00 00 19 00 01 01 01 38 0000 00 0001", "FINS 25 -> 1, service 1: memory area read, area 38 0.00, 1 element"),
    ("C0 00 02 00 19 00 00 01 00 01 01 01 11 03",
     "FINS 1 -> 25, service 1: memory area read: first address not accessible"),
    ("C0 00 02 00 19 00 00 01 00 01 01 01 00 00 12 34", "FINS 1 -> 25, service 1: memory area read: normal end, 2 bytes"),
    ("80 00 02 00 01 00 00 19 00 01 04 01 FFFF 02", "FINS 25 -> 1, service 1: run, MONITOR"),
    ("80 00 02 00 01 00 00 19 00 01 04 01 FFFF 03", "FINS 25 -> 1, service 1: run, mode 03"),
    ("80 00 02 00 01 00 00 19 00 01 04 01 FFFF", "FINS 25 -> 1, service 1: run"),
    ("80 00 02 00 01 00 00 19 00 01 04 02", "FINS 25 -> 1, service 1: stop"),
    ("80 00 02 00 01 00 00 19 00 01 01 02 82 0123 00 0008" + "AB" * 16,
     "FINS 25 -> 1, service 1: memory area write, D291, 8 elements:" + " AB" * 16),
    ("80 00 02 00 01 00 00 19 00 01 01 02 82 7FFF 00 0009" + "AB" * 17,
     "FINS 25 -> 1, service 1: memory area write, D32767, 9 elements:" + " AB" * 16 + " .."),
    ("80 00 02 00 01 00 00 19 00 01 01 03 B1 01FF 00 0001 5555",
     "FINS 25 -> 1, service 1: memory area fill, W511, 1 element: 55 55"),
    ("80 00 02 00 01 00 00 19 00 01 01 04 82 0001 00 30 0010 0F FF",
     "FINS 25 -> 1, service 1: multiple memory area read, D1, CIO 16.15"),
    ("80 00 02 00 01 00 00 19 00 01 07 02 26 11 28 10 30", "FINS 25 -> 1, service 1: clock write, 26 11 28 10 30"),
    ("80 00 02 00 01 00 00 19 00 01 23 01 0003 0001 30 0001 02 8000 B1 0000 00 0000 30 0001 03",
     "FINS 25 -> 1, service 1: forced set or reset, CIO 1.02 ON, W0 released to OFF, CIO 1.03 OFF"),
    ("80 00 02 00 01 00 00 19 00 01 23 01 0003 8001 30 0001 02 FFFF 31 0000 00 1234 30 0001 03",
     "FINS 25 -> 1, service 1: forced set or reset, CIO 1.02 released to ON, W0.00 released, CIO 1.03 1234"),
    ("80 00 02 00 01 00 00 19 00 01 01 01 82 0000 00 00", "FINS 25 -> 1, service 1: memory area read"),
    ("80 00 02 00 01 00 00 19 00 01 01 05 82 0000 00 A0 0064 00 00", "FINS 25 -> 1, service 1: memory area transfer"),
    ("80 00", "no FINS: 2 bytes are less than the 12 of the shortest frame"),
    ("7F 00 02 00 01 00 00 19 00 01 04 02", "no FINS: ICF bit 7 is 0"),
    ("80 01 02 00 01 00 00 19 00 01 04 02", "no FINS: RSV is not 00"),
    ("C0 00 02 00 19 00 00 01 00 01 01 01 11", "no FINS: a response without an end code"),
])  # fmt: skip
def test_what_a_decoder_says(frame: str, said: str) -> None:
    assert described(parse_frame(bytes.fromhex(frame))) == said


def test_numbers_of_the_manuals() -> None:
    """W421 7-2 p162 and W342 3-5 p57: what fits into a frame; W342 3-4-2 p36: units and nodes."""
    assert MAX_FRAME_BYTES == MIN_COMMAND_BYTES + MAX_PARAMETER_BYTES == MIN_RESPONSE_BYTES + MAX_DATA_BYTES == 2012
    assert (CPU_UNIT, CPU_BUS_UNITS, ANY_ETHERNET_UNIT, LAST_NODE, EVERY_NODE, PORT) == (0x00, 0x10, 0xFE, 254, 0xFF, 9600)
    header = Header(Address(), Address())
    assert (header.service, header.icf, header.gateways, header.reserved) == (0, 0x80, 2, 0)
    assert Response(header, 0x0101).end_code == EndCode.NORMAL and Message(Kind.CONFIRMATION).error == Error.NONE


def test_the_bytes_of_a_frame() -> None:
    """W421 7-2 p162: every field of the header in its place, then the command, the end code, the data."""
    header = Header(Address(1, 2, 3), Address(4, 5, 6), 7, icf=0x81, gateways=8, reserved=9)
    assert Command(header, 0x0A0B, b"\x0c").to_bytes().hex(" ") == "81 09 08 01 02 03 04 05 06 07 0a 0b 0c"
    answer = Response(header.answer(), 0x0A0B, 0x1103, b"\x0c")
    assert answer.to_bytes().hex(" ") == "c0 00 02 04 05 06 01 02 03 07 0a 0b 11 03 0c"
    assert str(header.destination) == "1.2.3"
    assert [Header(Address(), Address(), icf=icf).wants_response for icf in (0x80, 0x81, 0xC0)] == [True, False, False]


@each_of(("message", "said"), [
    (client_node(), "FINS/TCP: asks for a node"), (client_node(25), "FINS/TCP: client node 25"),
    (server_node(25, 1), "FINS/TCP: client node 25, server node 1"),
    (server_node(0, 1, Error.ALL_IN_USE), "FINS/TCP: client node 0, server node 1: all connections are in use"),
    (Message(Kind.CLIENT_NODE, b"\0\0\0"), "FINS/TCP: command"), (Message(Kind.CLIENT_NODE, bytes(5)), "FINS/TCP: command"),
    (Message(Kind.SERVER_NODE, bytes(7)), "FINS/TCP: command"), (Message(Kind.SERVER_NODE, bytes(9)), "FINS/TCP: command"),
    (Message(Kind.ERROR, error=Error.NOT_SUPPORTED), "FINS/TCP: error notification: command not supported"),
    (Message(Kind.CONFIRMATION), "FINS/TCP: connection confirmation"), (Message(9, error=0x99), "FINS/TCP: 9"),
    (Message(Kind.FRAME, bytes.fromhex("800002000100001900010402")), "FINS 25 -> 1, service 1: stop"),
])  # fmt: skip
def test_what_a_decoder_says_of_a_message(message: Message, said: str) -> None:
    assert described_message(message) == said


@each_of(("kind", "least", "most"), [
    (Kind.CLIENT_NODE, 4, 4), (Kind.SERVER_NODE, 8, 8), (Kind.FRAME, 12, 2012), (Kind.ERROR, 0, 0), (Kind.CONFIRMATION, 0, 0),
])  # fmt: skip
def test_a_body_has_the_length_of_its_command(kind: Kind, least: int, most: int) -> None:
    """W421 7-4 p177-181."""
    assert [Message(kind, bytes(size)).is_wrong for size in (least, most, most + 1)] == [False, False, True]
    assert least == 0 or Message(kind, bytes(least - 1)).is_wrong


ERROR_FIELDS = {
    0x00: "normal", 0x01: "does not begin with FINS", 0x02: "too long", 0x03: "not supported", 0x20: "all connections are in use",
    0x21: "connected already", 0x22: "not permitted", 0x23: "out of range", 0x24: "that of the server", 0x25: "no node is left",
}  # fmt: skip


def test_the_error_fields_of_messages() -> None:
    """W421 7-4 p178."""
    assert {error.value for error in Error} == set(ERROR_FIELDS) == set(ERRORS)
    assert {code: ERRORS[Error(code)] for code, words in ERROR_FIELDS.items() if words not in ERRORS[Error(code)]} == {}


LISTED_COMMANDS = """
0101 0102 0103 0104 0105 0201 0202 0203 0306 0307 0308 0401 0402 0403 0501 0502 0601 0620 0701 0702 0801 0802 0803 0920 0C01 0C02
0C03 2101 2102 2103 2140 2141 2201 2202 2203 2204 2205 2207 2208 220A 220B 220C 2215 2220 2301 2302 2701 2702 2703 2704 2710 2711
2712 2713 2714 2720 2730 2731 2750 2760 2761 2762 2763 2764 2765
"""


def test_the_commands_are_those_of_the_lists() -> None:
    """W342 5-3 p202-203; those of units W420 7-3 and W343 p102."""
    assert set(COMMANDS) == {int(code, 16) for code in LISTED_COMMANDS.split()}


def test_a_stream_ends_at_what_is_no_message() -> None:
    good = client_node(25).to_bytes()
    assert good.hex(" ") == "46 49 4e 53 00 00 00 0c 00 00 00 00 00 00 00 00 00 00 00 19"
    message = server_node(25, 1)
    assert (message.node, message.server) == (25, 1)
    longest, too_long, too_short = (b"FINS" + size.to_bytes(4, "big") for size in (2020, 2021, 7))
    for bad, error in ((b"FINX", Error.NOT_FINS), (too_long, Error.TOO_LONG), (too_short, Error.TOO_LONG)):
        splitter = Splitter()
        assert splitter.feed(good + bad) == [client_node(25), Unreadable(error, bad)]
        assert splitter.broken and splitter.pending == b"" and splitter.feed(good) == []
    splitter = Splitter()
    assert splitter.feed(longest) == [] and splitter.pending == longest and not splitter.broken


@pytest.fixture(scope="module")
def rig() -> FinsRig:
    return FinsRig(fins_access="no-control")


@pytest.mark.slow
@given(st.lists(st.tuples(st.sampled_from([0x0101, 0x0102, 0x0103, 0x0104, 0x0105, 0x0402, 0x0702, 0x0C01, 0x2301, 0x9999]),
                          st.binary(max_size=40)), max_size=8))  # fmt: skip
def test_whatever_a_client_sends_the_next_one_is_served(rig: FinsRig, commands: list[tuple[int, bytes]]) -> None:
    for code, parameters in commands:
        rig.say(Command(Header(Address(0, 1), Address(0, 25)), code, parameters).to_bytes())
    rig.plc.scan()
    assert len(rig.datagrams()) == len(commands)
    assert rig.command(0x2302)[0] == "0000"
    assert rig.plc.trap is None


@pytest.mark.slow
@given(st.lists(st.binary(min_size=1, max_size=40), max_size=6), st.booleans())
def test_whatever_a_connection_says_the_next_one_is_served(rig: FinsRig, parts: list[bytes], greets: bool) -> None:
    numbers = {int(address.rpartition(".")[2]) for address in rig.network._links}
    client = TcpClient(rig, next(number for number in range(60, 250) if number not in numbers))
    if greets:
        client.connect()
    rig.plc.run(scans=2)
    for part in parts:
        client.say(part)
        rig.plc.scan()
    client.leave()
    rig.plc.run(scans=4)
    rig.network._links.pop(client.link.address)
    assert rig.plc.read("CIO 1523") == 0
    assert rig.command(0x0601)[0] == "0000"
