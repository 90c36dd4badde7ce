"""Memory areas and addresses: how far each area goes, where its bits lie, what is no address."""

from __future__ import annotations

from itertools import pairwise

import pytest
from rows import each_of

from fbvm.base.areas import (
    AREAS,
    E_BANKS,
    E_WORDS,
    SIZED_AREAS,
    SLOTS_OFFSET,
    AddressError,
    Mailbox,
    e_bank,
    parse_address,
    refusal,
    with_sizes_apart,
)

MAILBOX = Mailbox("BOX", 4, 3, 20)


APART = with_sizes_apart(AREAS, SIZED_AREAS.values())


@each_of("text, area, offset, bit, shown", [
    ("%QX3.5", "%QX", 3, 5, "%QX3.5"), ("%Q3.5", "%QX", 3, 5, "%QX3.5"), ("%QB3", "%QB", 3, 0, "%QB3"),
    ("%QW3", "%QW", 6, 0, "%QW3"), ("%ID3", "%ID", 12, 0, "%ID3"), ("%ML3", "%ML", 24, 0, "%ML3"),
    ("%QW3.12", "%QW", 7, 4, "%QW3.12"), ("%MB3.2", "%MB", 3, 2, "%MB3.2"), ("%ML1.63", "%ML", 15, 7, "%ML1.63"),
    ("D7", "D", 14, 0, "D7"),
])
def test_each_size_of_address_has_an_area_where_sizes_are_apart(text: str, area: str, offset: int, bit: int, shown: str) -> None:
    address = parse_address(text, APART)
    assert (address.area, address.byte_offset(), address.bit_in_byte(), str(address)) == (area, offset, bit, shown)
    assert parse_address(shown, APART) == address


@each_of("text, said", [
    ("%QW2048", "%QW ends at 2047; 2048 does not exist"), ("%QB4096", "%QB ends at 4095; 4096 does not exist"),
    ("%QX0.8", "bit 8 does not exist; bits are 0 to 7"), ("%QW0.16", "bit 16 does not exist; bits of %QW0 are 0 to 15"),
    ("QW5", "'QW5' is not an address"),
    ("%Q5", "%Q5 has no size: write %QX5.0 or %QW5"),
    ("%MW1", "the program names no address such as %MW1, and each size of address has memory of its own here"),
])
def test_a_size_that_is_not_there_is_said(text: str, said: str) -> None:
    with pytest.raises(AddressError) as raised:
        parse_address(text, with_sizes_apart(AREAS, [area for name, area in SIZED_AREAS.items() if name != "%MW"]))
    assert str(raised.value) == said


def test_areas_lie_one_behind_the_other() -> None:
    placed = sorted(AREAS.values(), key=lambda area: area.offset)
    for one, other in pairwise(placed):
        assert one.offset + one.size_bytes <= other.offset, (one.name, other.name)
    assert placed[-1].offset + placed[-1].size_bytes == SLOTS_OFFSET


@each_of("last, behind", [
    ("CIO 6143", "CIO 6144"), ("6143.15", "6144.00"), ("W511", "W512"), ("H1535", "H1536"), ("A959", "A960"), ("T4095", "T4096"),
    ("C4095", "C4096"), ("D32767", "D32768"), ("D32767.15", "D32767.16"), ("CF127", "CF128"), ("TF4095", "TF4096"),
    ("CNF4095", "CNF4096"), ("EC_32767", "EC_32768"), ("E0:32767.15", "E0:0.16"), ("EC_0", "ED_0"),
    ("%IB4095", "%IB4096"), ("%IW2047", "%IW2048"), ("%ID1023", "%ID1024"), ("%IL511", "%IL512"), ("%IX4095.7", "%IX4095.8"),
    ("%QB4095", "%QB4096"), ("%QX4095.7", "%QX4096.0"), ("%MB65535", "%MB65536"), ("%ML8191", "%ML8192"),
    ("%MW4.15", "%MW4.16"), ("%MB0.7", "%MB0.8"), ("%ML0.63", "%ML0.64"), ("BOX63", "BOX64"), ("BOX63.15", "BOX0.16"),
])
def test_an_area_has_a_last_place(last: str, behind: str) -> None:
    areas = AREAS | {"BOX": MAILBOX.at(SLOTS_OFFSET)}
    parse_address(last, areas)
    with pytest.raises(AddressError):
        parse_address(behind, areas)


@each_of("text, said", [
    ("D40000", "D ends at 32767; 40000 does not exist"), ("%MW40000", "%M ends at 32767; 40000 does not exist"),
    ("%QB5000", "%Q ends at 4095; 5000 does not exist"), ("D5.16", "bit 16 does not exist; bits are 0 to 15"),
    ("%IX5.8", "bit 8 does not exist; bits are 0 to 7"), ("%IW5.16", "bit 16 does not exist; bits of %IW5 are 0 to 15"),
    ("TF7.1", "T0007 is a flag and has no bits"), ("CF5.0", "CF005 is a flag and has no bits"),
    ("ED_5", "there is no E bank D; banks are 0 to C"), ("%I5", "%I5 has no size: write %IX5.0 or %IW5"),
    ("BOX1", "'BOX1' is not an address"), ("D", "'D' is not an address"), ("%IX", "'%IX' is not an address"),
    ("D-1", "'D-1' is not an address"), ("", "'' is not an address"),
])
def test_what_is_no_address_is_said_why(text: str, said: str) -> None:
    with pytest.raises(AddressError) as raised:
        parse_address(text)
    assert str(raised.value) == said


@each_of("text, shown, byte, bit", [
    ("D100", "D100", 200, 0), ("dm 7", "D7", 14, 0), ("%D5.09", "D5.09", 11, 1), ("5", "CIO 5", 10, 0),
    ("1519.3", "CIO 1519.03", 3038, 3), ("TF21", "T0021", 2, 5), ("CNF8", "C0008", 1, 0), ("CF113", "CF113", 14, 1),
    ("E3_9", "E3_9", 18, 0), ("ea:9.8", "EA_9.08", 19, 0),
    ("%MB9", "%MB9", 9, 0), ("%MW9", "%MW9", 18, 0), ("%md9", "%MD9", 36, 0), ("%ML9", "%ML9", 72, 0), ("%IX9.6", "%IX9.6", 9, 6),
    ("%QX9", "%QX9.0", 9, 0), ("%MW4.15", "%MX9.7", 9, 7), ("%MD1.16", "%MX6.0", 6, 0), ("BOX3.12", "BOX3.12", 7, 4),
])
def test_where_an_address_lies_and_how_it_is_written(text: str, shown: str, byte: int, bit: int) -> None:
    found = parse_address(text, AREAS | {"BOX": MAILBOX.at(SLOTS_OFFSET)})
    assert (str(found), found.byte_offset(), found.bit_in_byte()) == (shown, byte, bit)


@each_of("mailbox, said", [
    (MAILBOX, ""), (Mailbox("MB", 1, 0, 0), ""), (Mailbox("MAILBOXX", 0, 1, 1 << 20), ""),
    (Mailbox("BOX", 1, 1, 1 << 20), "BOX would have 1048577 words; 1 to 1048576 are possible"),
    (Mailbox("BOX", 0, 5, 0), "BOX would have 0 words; 1 to 1048576 are possible"),
    (Mailbox("BOX", -1, 1, 5), "BOX would have 4 words; 1 to 1048576 are possible"),
    (Mailbox("BOX", 9, -1, -1), "BOX would have 10 words; 1 to 1048576 are possible"),
    (Mailbox("BOX", 9, 1, -1), "BOX would have 8 words; 1 to 1048576 are possible"),
    (Mailbox("DM", 1, 1, 1), "'DM' cannot name an area: write 2 to 8 capitals that no other area has"),
    (Mailbox("CIO", 1, 1, 1), "'CIO' cannot name an area: write 2 to 8 capitals that no other area has"),
    (Mailbox("X", 1, 1, 1), "'X' cannot name an area: write 2 to 8 capitals that no other area has"),
    (Mailbox("box", 1, 1, 1), "'box' cannot name an area: write 2 to 8 capitals that no other area has"),
    (Mailbox("MAILBOXES", 1, 1, 1), "'MAILBOXES' cannot name an area: write 2 to 8 capitals that no other area has"),
])
def test_what_a_mailbox_may_be(mailbox: Mailbox, said: str) -> None:
    assert refusal(mailbox) == said


def test_what_is_kept_over_a_start_and_what_a_program_must_not_write() -> None:
    assert {area.name for area in AREAS.values() if area.retained} == {"H", "A", "CNF", "C", "D"}
    assert {area.name: area.read_only for area in AREAS.values() if area.read_only} == {"CF": 128, "A": 448}
    assert (E_BANKS, E_WORDS) == (13, 32768)
    box, bank = MAILBOX.at(SLOTS_OFFSET), e_bank("E3", SLOTS_OFFSET)
    assert [(area.read_only, area.retained, area.count, area.size_bytes) for area in (box, bank)] == [
        (0, False, 64, 128), (0, True, 32768, 65536)]


@each_of("text, shown", [("%MX3.15", "%MX7.7"), ("%MX3.16", ""), ("%IX0.0", "%IX0.0"), ("%QX1.8", "%QX3.0"), ("%MW3.16", "")])
def test_bits_of_words_where_a_number_counts_words(text: str, shown: str) -> None:
    if shown:
        assert str(parse_address(text, words=True)) == shown
    else:
        with pytest.raises(AddressError, match="bit 16 does not exist; bits of "):
            parse_address(text, words=True)
