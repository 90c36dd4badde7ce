"""The codec of FINS: there and back, any bytes, areas, and what a decoder says."""

from __future__ import annotations

import pytest
from fins_rig import FinsRig, TcpClient
from hypothesis import given
from hypothesis import strategies as st
from rows import each_of

from fbvm.base.areas import AREAS, E_NAMES
from fbvm.wire.fins.areas import SPANS, WORD_CODES, place_of, spans_of
from fbvm.wire.fins.codes import COMMANDS, END_CODES, EndCode, command_name, meaning_of
from fbvm.wire.fins.frames import Address, Command, Damaged, Header, Response, parse_frame
from fbvm.wire.fins.tcp import Kind, Message, Splitter
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
        assert span.start + span.count <= size, span
    assert place_of(0x82, 0, 1) is None and place_of(0x30, 0, 16) is None and place_of(0x77, 0, 0) is None


def test_words_that_are_sent_have_a_code_of_cs_mode() -> None:
    assert {area: f"{code:02X} {first:04X}" for area, (code, first) in WORD_CODES.items() if area not in E_NAMES} == {
        "CIO": "B0 0000", "W": "B1 0000", "H": "B2 0000", "A": "B3 0000", "D": "82 0000", "T": "89 0000", "C": "89 8000"}
    assert [WORD_CODES[name][0] for name in E_NAMES] == [0xA0 + bank for bank in range(13)]


def test_each_end_code_that_is_given_has_its_words() -> None:
    assert {code for code in EndCode if code.value not in END_CODES} == set()
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
    ("80 00", "no FINS: 2 bytes are less than the 12 of the shortest frame"),
])  # fmt: skip
def test_what_a_decoder_says(frame: str, said: str) -> None:
    assert described(parse_frame(bytes.fromhex(frame))) == said


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
