"""The frames, the layouts and the server that answers them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_of

from fbvm.wire import modbus, registers
from fbvm.wire.modbus import Adu, Fault, Splitter, decode_reply, decode_request, mismatch
from fbvm.wire.modbus_server import ModbusServer

# PDUs of the published sheets: request, reply, and what the server has to hold.
VECTORS = [
    ("01 00 14 00 13", "01 03 CD 6B 05"),
    ("02 00 14 00 13", "02 03 CD 6B 05"),
    ("03 03 E8 00 03", "03 06 AB 12 56 78 97 13"),
    ("04 03 E8 00 03", "04 06 AB 12 56 78 97 13"),
    ("05 00 22 FF 00", "05 00 22 FF 00"),
    ("06 07 D0 3A C5", "06 07 D0 3A C5"),
    ("08 00 00 A5 37", "08 00 00 A5 37"),
    ("10 03 E8 00 02 04 3A C5 97 13", "10 03 E8 00 02"),
    ("0F 00 14 00 0A 02 3A 01", "0F 00 14 00 0A"),
    ("16 00 04 00 F2 00 25", "16 00 04 00 F2 00 25"),
    ("17 03 E8 00 01 03 E8 00 01 02 12 34", "17 02 12 34"),
    ("03 00 00 00 7E", "83 03"),
    ("2B 0E 04 01", "2B 0E 04 81 00 00 01 01 0C 4D 6F 64 62 75 73 53 65 72 76 65 72"),
]


def a_server(**options: object) -> ModbusServer:
    server = ModbusServer(**options)  # type: ignore[arg-type]
    bits = modbus.unpack_bits(bytes.fromhex("CD6B05"), 19)
    if len(server.coils) >= 39:
        server.coils[20:39] = server.discrete_inputs[20:39] = bytes(bits)
    for offset, value in enumerate((0xAB12, 0x5678, 0x9713)):
        if len(server.holding_registers) > 1003:
            server.holding_registers[1000 + offset] = server.input_registers[1000 + offset] = value
    return server


@each_of(("request_hex", "reply_hex"), VECTORS)
def test_the_sheets_frames(request_hex: str, reply_hex: str) -> None:
    request = bytes.fromhex(request_hex)
    reply = a_server().answer(Adu(7, 1, request).to_bytes())
    assert reply == Adu(7, 1, bytes.fromhex(reply_hex)).to_bytes()
    assert mismatch(request, bytes.fromhex(reply_hex)) == ""


@each_of(
    ("request_hex", "reply_hex"),
    [
        ("07", "87 01"),  # a function that is not served
        ("00", "80 01"),
        ("83 00", "83 01"),
        ("03 00 00 00", "83 03"),  # too short
        ("03 00 00 00 01 00", "83 03"),  # too long
        ("03 00 00 00 00", "83 03"),
        ("03 00 64 00 00", "83 03"),  # quantity before address
        ("03 00 64 00 7E", "83 03"),
        ("03 00 64 00 01", "83 02"),
        ("03 00 63 00 01", "03 02 00 00"),
        ("03 00 63 00 02", "83 02"),
        ("01 00 00 07 D1", "81 03"),
        ("05 00 64 12 34", "85 03"),  # value before address
        ("05 00 64 FF 00", "85 02"),
        ("06 00 64 FF 00", "86 02"),
        ("0F 00 00 00 09 01 00", "8F 03"),  # byte count does not fit the quantity
        ("0F 00 63 00 02 01 00", "8F 02"),
        ("10 00 00 00 02 04 00 00 00", "90 03"),  # byte count does not fit the frame
        ("10 00 00 00 7C F8" + "00" * 248, "90 03"),
        ("16 00 64 00 00 00 00", "96 02"),
        ("17 00 00 00 7E 00 00 00 01 02 00 00", "97 03"),
        ("17 00 00 00 01 00 64 00 01 02 00 00", "97 02"),
        ("17 00 00 00 01 00 00 00 02 02 00 00", "97 03"),
        ("08 00 00", "88 03"),
        ("08 00 00 01", "88 03"),
        ("08 00 15 00 00", "88 01"),
        ("17 00 63 00 01 00 62 00 02 04 00 01 00 02", "17 02 00 02"),
        ("17 00 00 00 01 00 63 00 02 04 00 00 00 00", "97 02"),
        ("17 00 63 00 02 00 00 00 01 02 00 00", "97 02"),
        ("17 00 00 00 00 00 00 00 01 02 00 00", "97 03"),
        ("17 00 00 00 01 00 00 00 00 00", "97 03"),
        ("08 00 0B 12 34", "88 03"),
        ("08 00 0B 00 00 00 00", "88 03"),
        ("2B 0D 01 00", "AB 01"),
        ("2B 0E 05 00", "AB 03"),
        ("2B 0E 00 00", "AB 03"),
        ("2B 0E 01", "AB 03"),
        ("2B 0E 01 00 00", "AB 03"),
        ("2B", "AB 01"),
    ],
)
def test_order_of_the_servers_checks(request_hex: str, reply_hex: str) -> None:
    server = a_server(coils=100, discrete_inputs=100, holding_registers=100, input_registers=100)
    assert server.answer_pdu(bytes.fromhex(request_hex)) == bytes.fromhex(reply_hex)


def test_an_unknown_object_is_told_before_a_wrong_code_assumed() -> None:
    assert a_server().answer_pdu(modbus.identify(4, 99)) == b"\xab\x02"


def test_longest_frames_fit() -> None:
    server = a_server()
    for request, size_bytes in [
        (modbus.read(1, 0, 2000), 259),
        (modbus.read(3, 0, 125), 259),
        (modbus.read_write(0, 125, 0, [1] * 121), 259),
        (modbus.write_coils(0, [1] * 1968), 12),
        (modbus.write_registers(0, [1] * 123), 12),
    ]:
        reply = server.answer(Adu(1, 255, request).to_bytes())
        assert reply is not None
        assert len(reply) == size_bytes
        assert mismatch(request, reply[7:]) == ""
        assert len(request) <= modbus.MAX_PDU_BYTES


def test_writing_changes_the_tables_and_reading_shows_it() -> None:
    server = ModbusServer()
    server.answer_pdu(modbus.write_coils(20, modbus.unpack_bits(b"\x3a\x01", 10)))
    assert [number for number in range(100) if server.coils[number]] == [21, 23, 24, 25, 28]
    server.holding_registers[4] = 0x0012
    server.answer_pdu(modbus.mask_write(4, 0x00F2, 0x0025))
    assert server.holding_registers[4] == 0x0017  # the example of AP 6.16
    assert server.answer_pdu(modbus.read_write(0, 1, 0, [0xBEEF])) == b"\x17\x02\xbe\xef"


def test_unit_ids_refusals_and_counters() -> None:
    server = ModbusServer(unit_ids={1}, refusals={3: 6})
    assert server.answer_pdu(modbus.read(4, 0, 1), unit=2) == b"\x84\x0b"
    assert server.answer_pdu(modbus.read(3, 0, 1), unit=1) == b"\x83\x06"
    assert server.answer_pdu(modbus.read(4, 0, 1), unit=1) == b"\x04\x02\0\0"
    assert server.answer_pdu(bytes.fromhex("08000D0000"), unit=1) == bytes.fromhex("08000D0002")
    assert server.answer_pdu(bytes.fromhex("08000A0000"), unit=1) == bytes.fromhex("08000A0000")
    assert server.answer_pdu(bytes.fromhex("08000B0000"), unit=1) == bytes.fromhex("08000B0001")


def test_long_identity_goes_on_in_the_next_request() -> None:
    server = ModbusServer(identity={0: "a" * 200, 1: "b" * 200, 2: "c"})
    first = server.answer_pdu(modbus.identify(1))
    assert first[3:7] == bytes((0x81, 0xFF, 1, 1))
    assert server.answer_pdu(modbus.identify(1, 1))[3:7] == bytes((0x81, 0, 0, 2))


@each_of("frame", ["", "0001", "000100000002FF", "00010000 0002 FF03 00", "00010001 0002 FF03"])
def test_what_is_no_frame_gets_no_answer(frame: str) -> None:
    assert ModbusServer().answer(bytes.fromhex(frame)) is None


def test_a_foreign_protocol_is_skipped_and_an_impossible_length_ends_the_stream() -> None:
    good = Adu(1, 255, modbus.read(3, 0, 1))
    foreign = b"\0\1\0\7\0\2\xff\3"
    splitter = Splitter()
    assert splitter.feed(foreign + good.to_bytes()) == [Fault("protocol id 7 is not 0", foreign, False), good]
    [fault] = splitter.feed(b"\0\1\0\0\0\1\xff")
    assert isinstance(fault, Fault)
    assert fault.fatal
    assert splitter.broken
    assert splitter.feed(good.to_bytes()) == []


@each_of("length", [0, 1, 255, 65535])
def test_impossible_lengths(length: int) -> None:
    [fault] = Splitter().feed(b"\0\1\0\0" + length.to_bytes(2, "big"))
    assert isinstance(fault, Fault)
    assert str(length) in fault.reason


ADUS = st.lists(
    st.builds(Adu, st.integers(0, 65535), st.integers(0, 255), st.binary(min_size=1, max_size=253)), max_size=5
)


@pytest.mark.slow
@given(ADUS, st.data())
def test_any_cut_gives_the_same_frames(adus: list[Adu], data: st.DataObject) -> None:
    stream = b"".join(adu.to_bytes() for adu in adus)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=20)))
    splitter, found = Splitter(), []
    for start, end in zip([0, *cuts], [*cuts, len(stream)], strict=True):
        found += splitter.feed(stream[start:end])
    assert found == adus
    assert splitter.pending == b""


@pytest.mark.slow
@given(st.binary(max_size=600))
def test_garbage_raises_nothing(garbage: bytes) -> None:
    splitter, whole = Splitter(), Splitter()
    piecewise = [found for byte in garbage for found in splitter.feed(bytes((byte,)))]
    at_once = whole.feed(garbage)
    assert [found for found in piecewise if isinstance(found, Adu)] == [f for f in at_once if isinstance(f, Adu)]
    assert splitter.broken == whole.broken


@pytest.mark.slow
@given(st.binary(min_size=1, max_size=253), st.integers(0, 255))
def test_every_pdu_gets_one_well_formed_answer(pdu: bytes, unit: int) -> None:
    reply = ModbusServer(coils=300, holding_registers=300).answer(Adu(9, unit, pdu).to_bytes())
    assert reply is not None
    assert len(reply) <= modbus.MAX_ADU_BYTES
    assert decode_reply(reply[7:]).fault == ""
    assert reply[7] & 0x7F == pdu[0] & 0x7F
    assert str(decode_request(pdu))


@pytest.mark.slow
@given(st.lists(st.booleans(), max_size=100))
def test_bits_survive_packing(states: list[bool]) -> None:
    assert modbus.unpack_bits(modbus.pack_bits(states), len(states)) == states


@pytest.mark.slow
@given(st.lists(st.integers(0, 65535), max_size=100))
def test_registers_survive_packing(values: list[int]) -> None:
    assert modbus.unpack_registers(modbus.pack_registers(values)) == values


@each_of(
    ("request_hex", "reply_hex", "why"),
    [
        ("03 03 E8 00 03", "04 06 AB 12 56 78 97 13", "function code 04 instead of 03"),
        ("03 03 E8 00 03", "03 04 AB 12 56 78", "4 data bytes instead of 6"),
        ("03 03 E8 00 03", "03 06 AB 12", "byte count 6, 2 follow"),
        ("03 03 E8 00 03", "83", "exception reply without code"),
        ("03 03 E8 00 03", "83 02 00", "wrong length"),
        ("03 03 E8 00 03", "", "no function code"),
        ("03 03 E8 00 03", "63 00", "function code not known"),
        ("06 00 01 00 02", "06 00 01 00 03", "value 3 instead of 2"),
        ("10 00 01 00 01 02 00 00", "10 00 01 00 02", "quantity 2 instead of 1"),
        ("08 00 00 A5 37", "08 00 00 A5 38", "data not echoed"),
        ("03 03 E8 00 03", "83 02", ""),
        ("03", "03 02 00 00", "2 data bytes instead of 0"),
    ],
)
def test_replies_that_do_not_fit(request_hex: str, reply_hex: str, why: str) -> None:
    assert mismatch(bytes.fromhex(request_hex), bytes.fromhex(reply_hex)) == why


def test_messages_read_well() -> None:
    assert str(decode_request(modbus.read(3, 1000, 3))) == "03 read holding registers, address 1000, quantity 3"
    assert str(decode_reply(b"\x83\x02")) == "03 read holding registers, exception 02 illegal data address"
    assert str(decode_request(modbus.write_registers(1, [2]))) == (
        "10 write multiple registers, address 1, quantity 1, data 00 02"
    )
    assert str(decode_request(b"\x03\x00")) == "03 read holding registers, data 00, (too short)"


def test_a_function_that_is_not_known_is_called_by_its_number() -> None:
    assert str(decode_request(b"\x63\x01")) == "63 unknown function, data 01, (function code not known)"
    assert str(decode_reply(b"\x63\x01")) == "63 unknown function, data 01, (function code not known)"
    assert str(decode_request(b"")) == "00 unknown function, (no function code)"


@each_of(("code", "read_max", "write_max"), [
    (0x01, 2000, 0), (0x02, 2000, 0), (0x03, 125, 0), (0x04, 125, 0), (0x0F, 0, 1968), (0x10, 0, 123), (0x17, 125, 121),
])  # fmt: skip
def test_the_most_items_of_a_request(code: int, read_max: int, write_max: int) -> None:
    """MODBUS Application Protocol V1.1b3, 6.1 to 6.17: the server takes as many, and refuses one more with 03."""
    def request(reads: int, writes: int) -> bytes:
        if code == 0x17:
            return modbus.read_write(0, reads, 0, [0] * writes)
        if reads:
            return modbus.read(code, 0, reads)
        return (modbus.write_coils if code == 0x0F else modbus.write_registers)(0, [0] * writes)

    server = a_server()
    assert server.answer_pdu(request(read_max, write_max))[0] == code
    if read_max:
        assert server.answer_pdu(request(read_max + 1, write_max)) == bytes((code | 0x80, 3))
    if write_max:
        assert server.answer_pdu(request(read_max, write_max + 1)) == bytes((code | 0x80, 3))


@each_of("code", [1, 2, 3, 4])
def test_the_tables_of_a_server_have_65536_items(code: int) -> None:
    server = ModbusServer()
    assert server.answer_pdu(modbus.read(code, 65_535, 1))[0] == code
    assert server.answer_pdu(modbus.read(code, 65_535, 2)) == bytes((code | 0x80, 2))


def test_the_words_of_exceptions() -> None:
    """MODBUS Application Protocol V1.1b3, section 7; other codes have no words."""
    words = {
        0x01: "illegal function", 0x02: "illegal data address", 0x03: "illegal data value", 0x04: "server device failure",
        0x05: "acknowledge", 0x06: "server device busy", 0x08: "memory parity error", 0x0A: "gateway path unavailable",
        0x0B: "gateway target device failed to respond",
    }  # fmt: skip
    assert {code: str(decode_reply(bytes((0x83, code)))) for code in range(1, 0x0D)} == {
        code: f"03 read holding registers, exception {code:02X} {words.get(code, 'unknown')}" for code in range(1, 0x0D)}


@each_of(("sub", "count"), [(0x0B, 1), (0x0C, 0), (0x0D, 0), (0x0E, 1), (0x0F, 0), (0x10, 0), (0x11, 0), (0x12, 0)])
def test_every_counter_of_diagnostics_can_be_asked(sub: int, count: int) -> None:
    server = a_server()
    reply = server.answer(Adu(1, 1, bytes((8, 0, sub, 0, 0))).to_bytes())
    assert reply is not None and reply[7:10] == bytes((8, 0, sub))
    assert int.from_bytes(reply[10:12], "big") == count
    assert server.answer(Adu(1, 1, bytes((8, 0, 0x13, 0, 0))).to_bytes()) == Adu(1, 1, b"\x88\x01").to_bytes()


@each_of(("ids", "code", "reply"), [
    ([0, 1, 2], 1, "81 00 00 03 00 01 02"), ([0, 1, 2], 3, "81 00 00 03 00 01 02"), ([0, 2, 3], 1, "82 00 00 02 00 02"),
    ([0, 2, 3], 2, "82 00 00 03 00 02 03"), ([0, 0x7F, 0x80], 2, "83 00 00 02 00 7F"), ([0, 0x80], 3, "83 00 00 02 00 80"),
    ([0, 0x80], 1, "83 00 00 01 00"), ([], 1, "81 00 00 00"),
])  # fmt: skip
def test_the_levels_of_an_identity(ids: list[int], code: int, reply: str) -> None:
    """MODBUS Application Protocol V1.1b3, 6.21: basic to 02, regular to 7F, extended to FF; the conformity says what there is."""
    answer = ModbusServer(identity=dict.fromkeys(ids, "")).answer_pdu(modbus.identify(code))
    head, found = answer[:7], answer[7:]
    assert (head[:3], found[1::2]) == (bytes((0x2B, 0x0E, code)), bytes(len(found) // 2))
    assert (head[3:] + found[::2]).hex(" ").upper() == reply


def test_coils_and_inputs_are_tables_of_their_own() -> None:
    server = ModbusServer(coils=8, discrete_inputs=8, holding_registers=2, input_registers=2)
    server.coils[1], server.discrete_inputs[2], server.holding_registers[0], server.input_registers[0] = 1, 1, 3, 4
    replies = [server.answer_pdu(modbus.read(code, 0, 8 if code < 3 else 1)).hex(" ") for code in (1, 2, 3, 4)]
    assert replies == ["01 01 02", "02 01 04", "03 02 00 03", "04 02 00 04"]


def test_only_exceptions_are_counted_as_exceptions() -> None:
    server = ModbusServer()
    for code in (1, 2, 3, 4):
        server.answer_pdu(modbus.read(code, 0, 1))
    assert server.counts == {"messages": 4, "exceptions": 0}
    server.answer_pdu(modbus.read(2, 0, 0))
    assert server.counts == {"messages": 5, "exceptions": 1}
    server.counts.update(messages=0xFFFF, exceptions=0xFFFF)
    server.answer_pdu(modbus.read(2, 0, 0))
    assert server.counts == {"messages": 0, "exceptions": 0}


def test_an_exception_without_a_code_names_none() -> None:
    assert (decode_reply(b"\x83").exception, decode_reply(b"\x83\x00").fault) == (0, "wrong length")
    assert decode_reply(b"\x83\x00").function == 3


def test_an_identity_that_begins_nowhere_begins_with_its_first_object() -> None:
    server = ModbusServer(identity={0: "a", 1: "b", 2: "c"})
    whole, unknown = (server.answer(Adu(1, 1, bytes((0x2B, 0x0E, 1, first))).to_bytes()) for first in (0, 0x55))
    assert whole == unknown
    assert whole is not None and whole[7:] == bytes.fromhex("2B 0E 01 81 00 00 03 00 01 61 01 01 62 02 01 63")


@pytest.mark.slow
def test_the_values_of_the_peer_show_their_addresses() -> None:
    server = registers.server()
    assert list(server.coils[:7]) == [1, 0, 1, 0, 1, 0, 1]
    assert list(server.discrete_inputs[:7]) == [1, 0, 0, 1, 0, 0, 1]
    assert [server.holding_registers[at] for at in (0, 1, 64_535, 64_536, 65_535)] == [1000, 1001, 65_535, 0, 999]
    assert [server.input_registers[at] for at in (0, 1, 63_535, 63_536, 65_535)] == [2000, 2001, 65_535, 0, 1999]
