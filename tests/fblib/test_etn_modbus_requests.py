"""What the server answers: the examples of the sheet to the byte, all functions at their limits, counters, switches."""

from __future__ import annotations

from array import array
from functools import cache

import pytest
from etn_modbus_rig import OWN_CIO, Client, Model, Rig
from rows import each_of

from fbvm.wire.modbus import Adu

EXAMPLES = {  # section of the sheet: words before, request, reply, words after
    "5.3.1": ({"CIO 1": 0xBCD0, "CIO 2": 0x0056}, "01 00 14 00 13", "01 03 CD 6B 05", {}),
    "5.3.2": ({"CIO 1": 0xBCD0, "CIO 2": 0x0056}, "02 00 14 00 13", "02 03 CD 6B 05", {}),
    "5.3.3": ({"D1000": 0xAB12, "D1001": 0x5678, "D1002": 0x9713}, "03 03 E8 00 03", "03 06 AB 12 56 78 97 13", {}),
    "5.3.4": ({"CIO 1000": 0xAB12, "CIO 1001": 0x5678, "CIO 1002": 0x9713}, "04 03 E8 00 03",
              "04 06 AB 12 56 78 97 13", {}),
    "5.3.5": ({}, "05 00 22 FF 00", "05 00 22 FF 00", {"CIO 2": 0x0004}),
    "5.3.6": ({}, "06 07 D0 3A C5", "06 07 D0 3A C5", {"D2000": 0x3AC5}),
    "5.3.7": ({}, "08 00 00 A5 37", "08 00 00 A5 37", {}),
    "5.3.8": ({}, "10 03 E8 00 02 04 3A C5 97 13", "10 03 E8 00 02", {"D1000": 0x3AC5, "D1001": 0x9713}),
}  # fmt: skip


@pytest.mark.slow
@each_of("timing", ["exact", "real"])
@each_of("section", EXAMPLES)
def test_the_examples_of_the_sheet(section: str, timing: str) -> None:
    before, request, reply, after = EXAMPLES[section]
    rig = Rig(timing=timing)
    client = rig.client()
    for place, word in before.items():
        rig.plc.write(place, word)
    frame = Adu(0x1234, 7, bytes.fromhex(request)).to_bytes()
    client.say(frame)
    [answer] = client.frames(1)
    assert answer.to_bytes() == Adu(0x1234, 7, bytes.fromhex(reply)).to_bytes()
    assert {place: rig.plc.read(place) for place in after} == after
    head = b"".join(word.to_bytes(2, "big") for word in rig.words("CIO")[6001:6143])
    assert head.startswith(answer.to_bytes()), "the reply stands in the area for sending"


@cache
def _served(pins: str) -> tuple[Rig, Client]:
    rig = Rig(pins)
    return rig, rig.client()


def served_with(pins: str, seed: int) -> tuple[Rig, Client]:
    """A rig with these pins and its client, used by one test after the other, and any values in its words."""
    rig, client = _served(pins)
    rig.fill(seed)
    return rig, client


@pytest.fixture
def served() -> tuple[Rig, Client]:
    return served_with("", 1)


def limits(area_size: int, most: int) -> list[tuple[int, int]]:
    """Addresses and quantities: one, some, all that go into one reply, the last ones, and one too many of each."""
    middle = most // 2 + 1
    return [
        (0, 1), (0, middle), (0, most), (5, most), (area_size - 1, 1), (area_size - middle, middle),
        (area_size - most, most), (0, 0), (0, most + 1), (0, 65535), (area_size - 1, 2), (area_size - most + 1, most),
        (65535, 2), (65535, most), (area_size & 0xFFFF, 1), (area_size - 1, 0), (area_size - 1, most + 1),
    ]  # fmt: skip


READS = [(1, 65536, 2000), (2, 5120, 2000), (3, 32768, 125), (4, 5801, 125)]


@pytest.mark.parametrize(
    ("code", "address", "quantity"), [(code, *at) for code, size, most in READS for at in limits(size, most)]
)
def test_reads_at_their_limits(code: int, address: int, quantity: int, served: tuple[Rig, Client]) -> None:
    rig, client = served
    model = Model(rig)
    pdu = bytes((code, *address.to_bytes(2, "big"), *quantity.to_bytes(2, "big")))
    assert client.exchange(pdu) == model.answer(pdu)
    assert model.agrees(rig)


@pytest.mark.parametrize("bit", range(16))
def test_bits_from_any_bit_on(bit: int, served: tuple[Rig, Client]) -> None:
    rig, client = served
    model = Model(rig)
    for quantity in (1, 7, 8, 9, 15, 16, 17, 31, 33):
        pdu = bytes((1, 0, 32 + bit, 0, quantity))
        assert client.exchange(pdu) == model.answer(pdu)


@pytest.mark.slow
@each_of("full_dm", [False, True])
@each_of(
    ("address", "quantity"),
    [*limits(32768, 123), (0x17FF, 1), (0x17FF, 123), (0x1800, 1), (0x1801 - 123, 123), (0x1800 - 10, 20)],
)
def test_10_at_its_limits(address: int, quantity: int, full_dm: bool) -> None:
    rig, client = served_with("Full_DM := TRUE" if full_dm else "", 2)
    model = Model(rig, full_dm=full_dm)
    data = bytes(range(246))[: 2 * quantity]
    pdu = bytes((0x10, *address.to_bytes(2, "big"), *quantity.to_bytes(2, "big"), 2 * quantity & 0xFF, *data))
    reply = client.exchange(pdu[:253])
    assert reply == model.answer(pdu[:253])
    assert model.agrees(rig)
    if (address, quantity) == (0x17FF, 123):
        assert reply == pdu[:5], "only where it begins is limited"


@pytest.mark.slow
@each_of("address", [0, 1, 15, 16, 0x22, 5119, 5120, 65520, 65535])
@each_of("value", [0xFF00, 0x0000, 0x0001, 0xFFFF, 0xFE00, 0x00FF])
def test_05_at_its_limits(address: int, value: int) -> None:
    rig, client = served_with("", 3)
    model = Model(rig)
    pdu = bytes((5, *address.to_bytes(2, "big"), *value.to_bytes(2, "big")))
    assert client.exchange(pdu) == model.answer(pdu)
    assert model.agrees(rig)


@pytest.mark.slow
@each_of("address", [0, 1, 32767, 32768, 65535])
@each_of("value", [0, 1, 0x8000, 0xFFFF])
def test_06_at_its_limits(address: int, value: int) -> None:
    rig, client = served_with("", 4)
    model = Model(rig)
    pdu = bytes((6, *address.to_bytes(2, "big"), *value.to_bytes(2, "big")))
    assert client.exchange(pdu) == model.answer(pdu)
    assert model.agrees(rig)


@pytest.mark.parametrize("size", [0, 1, 2, 3, 4, 125, 126, 249, 250])
def test_08_echoes_whole_words(size: int, served: tuple[Rig, Client]) -> None:
    _, client = served
    data = bytes(value & 0xFF for value in range(1, size + 1))
    right = size > 0 and size % 2 == 0
    pdu = b"\x08\0\0" + data
    assert client.exchange(pdu) == (pdu if right else b"\x88\x03")


@pytest.mark.parametrize("sub", [1, 2, 0x0A, 0x0B, 0x12, 0x15, 0x100, 0xFFFF])
def test_08_knows_sub_function_0_only(sub: int, served: tuple[Rig, Client]) -> None:
    _, client = served
    assert client.exchange(b"\x08" + sub.to_bytes(2, "big") + b"\0\0") == b"\x88\x01"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pins", "codes"),
    [
        ("", {1, 2, 3, 4, 5, 6, 8, 0x10}),
        ("Fn0F := TRUE", {1, 2, 3, 4, 5, 6, 8, 0x0F, 0x10}),
        ("Fn0F := TRUE, Read_Only := TRUE", {1, 2, 3, 4, 8}),
    ],
)
def test_all_other_function_codes_are_refused(pins: str, codes: set[int]) -> None:
    rig = Rig(pins)
    rig.fill(5)
    client, model = rig.client(), Model(rig)
    for code in range(256):
        for rest in (b"", b"\0\0\0\1", b"\0\0\0\1\2\3\4"):
            reply = client.exchange(bytes((code,)) + rest)
            if code not in codes:
                assert reply == bytes((code | 0x80, 1))
            elif not rest:
                assert reply == bytes((code | 0x80, 3))
    if "Read_Only" in pins:
        assert model.agrees(rig)


@pytest.mark.slow
@each_of(
    ("address", "quantity"),
    [*limits(65536, 1968), *[(bit, 40) for bit in range(16)], *[(3, count) for count in range(1, 34)]],
)
def test_0f_where_it_is_switched_on(address: int, quantity: int) -> None:
    rig, client = served_with("Fn0F := TRUE", 6)
    model = Model(rig, fn0f=True)
    size = min((quantity + 7) // 8, 246)
    data = bytes(0xA5 ^ value for value in range(size))
    pdu = bytes((0x0F, *address.to_bytes(2, "big"), *quantity.to_bytes(2, "big"), size, *data))
    assert client.exchange(pdu) == model.answer(pdu)
    assert model.agrees(rig)


@pytest.mark.slow
def test_the_standard_order_of_checks() -> None:
    """Function, then structure and value, then address."""
    client = Rig("Fn0F := TRUE").client()
    wrong_everything = {
        "09 FF FF FF FF": "89 01", "01 FF FF 00 00": "81 03", "01 FF FF 00 02": "81 02", "05 00 00 12 34": "85 03",
        "02 14 00 07 D1": "82 03", "02 14 00 07 D0": "82 02", "10 FF FF 00 01 03 00 00": "90 03",
        "10 FF FF 00 01 02 00 00": "90 02", "06 80 00 00 00 00": "86 03", "06 80 00 00 00": "86 02",
        "0F FF FF 00 02 02 00 00": "8F 03", "0F FF FF 00 02 01 00": "8F 02", "08 00 01 00": "88 01", "08 00": "88 03",
        "08 00 01": "88 01",
    }  # fmt: skip
    assert {pdu: client.ask(pdu) for pdu in wrong_everything} == wrong_everything


def test_0f_of_the_sheet_of_the_client_blocks() -> None:
    rig = Rig("Fn0F := TRUE")
    assert rig.client().ask("0F 00 14 00 0A 02 3A 01") == "0F 00 14 00 0A"
    assert rig.plc.read("CIO 1") == 0x13A0


@each_of("unit", [0, 1, 127, 247, 255])
def test_any_unit_identifier_is_answered_with_the_same(unit: int) -> None:
    assert Rig().client().exchange(b"\x03\0\0\0\1", unit) == b"\x03\x02\0\0"


def test_the_counters_of_the_sheet() -> None:
    rig = Rig()
    client = rig.client()
    assert rig.counters() == [0, 0, 0, 0, 0]
    client.ask("03 00 00 00 01")
    client.ask("03 00 00 00 00")
    client.ask("2B 0E 01 00")
    rig.scan(2)
    assert rig.counters() == [2, 3, 3, 0, 0]
    client.say(b"\0\1\0\5\0\6\xff\3\0\0\0\1")
    client.hear()
    assert rig.counters() == [2, 3, 3, 0, 0], "a frame of another protocol is none of Modbus"
    client.leave(reset=True)
    client.connect()
    assert rig.counters() == [2, 3, 3, 1, 0], "the reset ended a receive with 004B"


def test_the_counters_are_binary_and_begin_again() -> None:
    rig = Rig()
    client = rig.client()
    for name in ("W491", "W492", "W493"):
        rig.plc.write(name, 0xFFFF)
    client.ask("41")
    rig.scan(2)
    assert rig.counters() == [0, 0, 0, 0, 0]


@pytest.mark.slow
@pytest.mark.parametrize("pins", ["", "Sockets := 8, Fn0F := TRUE, Full_DM := TRUE"])
def test_nothing_but_the_words_of_the_sheet_is_used(pins: str) -> None:
    rig = Rig(pins)
    rig.fill(7)
    before = rig.foreign_words()
    first = rig.client()
    others = [rig.client() for _ in range(7 if pins else 0)]
    for client in (first, *others):
        for pdu in ("01 00 00 07 D0", "03 00 00 00 7D", "04 16 2C 00 7D", "08 00 00 12 34", "03 00 00", "99"):
            client.ask(pdu)
        client.say(b"\0\1\0\0\0\xfe\xff\3")
        client.leave()
    rig.scan(100)
    assert rig.foreign_words() == before


def test_a_refused_request_writes_nothing() -> None:
    rig = Rig()
    rig.fill(8)
    client, before = rig.client(), rig.foreign_words()
    refused = [
        "05 00 00 12 34", "05 00 00 FF", "05 00 00 FF 00 00", "06 80 00 12 34", "06 00 00 12", "06 00 00 12 34 56",
        "10 18 00 00 01 02 12 34", "10 00 00 00 00 00", "10 00 00 00 01 03 12 34", "10 00 00 00 02 04 12 34",
        "10 00 00 00 01 02 12 34 56", "10 00 00 00 7C F8" + " 11" * 247, "0F 00 00 00 08 01 55", "16 00 00 00 00 00 00",
        "17 00 00 00 01 00 00 00 01 02 12 34",
    ]  # fmt: skip
    assert [client.ask(pdu) for pdu in refused] == [
        "85 03", "85 03", "85 03", "86 02", "86 03", "86 03",
        "90 02", "90 03", "90 03", "90 03",
        "90 03", "90 03", "8F 01", "96 01", "97 01",
    ]  # fmt: skip
    assert rig.foreign_words() == before


def test_the_inputs_end_before_the_reception_area() -> None:
    """CIO 5800 is an input register; 5801, where requests arrive, is none."""
    rig = Rig()
    rig.words("CIO")[5800] = 0x1234
    client = rig.client()
    assert client.ask("04 16 A8 00 01") == "04 02 12 34"
    assert client.ask("04 16 A8 00 02") == "84 02"
    assert client.ask("04 16 A9 00 01") == "84 02"


def test_the_words_of_the_unit_can_be_read() -> None:
    rig = Rig()
    client = rig.client()
    assert client.ask("04 05 E5 00 01") == "04 02 80 00", "CIO 1509: open, and nothing running"
    assert client.ask("01 5E 5F 00 01") == "01 01 01", "CIO 1509.15"
    assert array("H", rig.words("CIO")[OWN_CIO.start : OWN_CIO.stop])[9] & 0x8000
