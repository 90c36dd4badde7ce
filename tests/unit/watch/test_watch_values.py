"""Values on their way in and out, and the places that hold them."""

import math
from datetime import date, datetime, time

import pytest
from rows import each_of

from fbvm.base import types as t
from fbvm.base.areas import AREAS, SLOTS_OFFSET
from fbvm.base.digits import MOST_DIGITS
from fbvm.base.memory import Memory
from fbvm.base.types import EnumType, Field, StructType, SubrangeType, Type
from fbvm.watch import places
from fbvm.watch.paths import Place, UnknownPlace
from fbvm.watch.values import (
    conform,
    in_hexadecimal,
    literal,
    nearest_real,
    parse_time_ns,
    parse_value,
    plain_value,
    show,
    show_time,
    sort_of,
)

COLOUR = EnumType("Colour", 2, 2, t.INT, {"RED": 0, "GREEN": 5}, {0: "Red", 5: "Green"})
LEVEL, FEW = SubrangeType("Level", 2, 2, t.INT, 0, 100), SubrangeType("Few", 2, 2, t.WORD, 1, 5)
CHAR, WCHAR, WIDE = t.ELEMENTARY["CHAR"], t.ELEMENTARY["WCHAR"], t.string(3, wide=True)
PINS = StructType("Block", 16, 8, {name.upper(): Field(name, t.INT, at, section) for at, (name, section) in enumerate(
    [("out", "VAR_OUTPUT"), ("own", "VAR"), ("both", "VAR_IN_OUT"), ("in", "VAR_INPUT")])}, block=True)
PAIR = StructType("Pair", 16, 8, {"N": Field("n", t.INT, 0), "S": Field("s", t.string(5), 2)})
WITH_CONSTANT = {"N": Field("n", t.INT, 0), "LIMIT": Field("limit", t.INT, 2, constant=True), "$EDGE": Field("$edge", t.INT, 4)}
BLOCK, RECORD = (StructType("Kept", 8, 8, WITH_CONSTANT, block=block) for block in (True, False))


@each_of(("text", "time_ns"), [
    ("10ms", 10_000_000), ("1.5s", 1_500_000_000), ("T#10ms", 10_000_000), ("time#1m30s", 90_000_000_000),
    ("LT#5us3ns", 5003), ("-2s", -2_000_000_000), ("T#-2s", -2_000_000_000), ("1d_2h", 93_600_000_000_000), ("0s", 0),
    ("0.5ms", 500_000), ("T#+5s", 5_000_000_000), ("-T#5s", -5_000_000_000), ("ltime#+1us", 1000), (" LT#1ns ", 1),
])  # fmt: skip
def test_times_are_read(text: str, time_ns: int) -> None:
    assert parse_time_ns(text) == time_ns


@each_of("text", [
    "", "10", "ms", "10 ms x", "5s,", "T#", "T#T#1s", "5sT#", "1mT#30s", "+5s", "T#+-5s", "-T#-5s", "--5s", "-", "XT#5s", "T#+"])
def test_what_is_no_time_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="is no time; write 10ms"):
        parse_time_ns(text)


def test_a_time_with_thousands_of_digits_behind_its_point_is_refused() -> None:
    assert parse_time_ns(f"1.{'0' * MOST_DIGITS}s") == 1_000_000_000
    with pytest.raises(ValueError, match="digits behind its point is finer than any clock"):
        parse_time_ns(f"1.{'0' * (MOST_DIGITS + 1)}s")


@each_of(("kind", "sort"), [
    (PAIR, ""), (t.array(((0, 1),), t.INT), ""), (COLOUR, "enumeration"), (CHAR, "text"), (t.string(), "text"), (t.BOOL, "BOOL"),
    (t.ELEMENTARY["LDATE"], "DATE"), (t.ELEMENTARY["LTIME"], "time"), (LEVEL, "number"), (t.WORD, "number"),
])  # fmt: skip
def test_values_of_one_sort_can_be_compared(kind: Type, sort: str) -> None:
    assert sort_of(kind) == sort


@each_of(("time_ns", "text"), [
    (0, "T#0s"), (90_000_000_000, "T#1m30s"), (-1_500_000_000, "T#-1s500ms"), (5003, "T#5us3ns"),
])  # fmt: skip
def test_times_are_shown_as_a_program_writes_them(time_ns: int, text: str) -> None:
    assert show_time(time_ns) == text
    assert parse_time_ns(text) == time_ns


@each_of(("text", "value"), [
    ("TRUE", True), ("false", False), ("12", 12), ("-1_000", -1000), ("16#FF", 255), ("0xff", 255), ("2#101", 5),
    ("8#17", 15), ("-16#f_f", -255), ("+7_", 7),
    ("INT#5", 5), ("''", ""), ("WORD#16#10", 16), ("1.5", 1.5), ("-2e3", -2000.0), ("'a b'", "a b"), ("T#1s", 1_000_000_000),
    ('"\U0001f600$D83D$DE00"', "\U0001f600" * 2), ('WSTRING#"\U0001f600"', "\U0001f600"),
    ("1s", 1_000_000_000),
])  # fmt: skip
def test_literals(text: str, value: object) -> None:
    assert literal(text)[0] == value
    assert type(literal(text)[0]) is type(value)


@each_of(("kind", "text", "value"), [
    (t.INT, "-5", -5), (t.WORD, "16#FFFF", 65535), (t.BOOL, "TRUE", True), (t.BOOL, "1", True), (t.BOOL, "0", False),
    (t.REAL, "2", 2.0),
    (t.TIME, "10ms", 10_000_000), (t.string(), "a, b", "a, b"), (t.string(), "'x'", "x"), (COLOUR, "green", 5),
    (COLOUR, "Colour#Red", 0), (COLOUR, "Colour.Red", 0), (t.BOOL, "on", True), (t.BOOL, "OFF", False),
    (t.DT, "DT#2024-01-01-00:00:00", 1_704_067_200_000_000_000), (t.DATE, "2024-01-01", 1_704_067_200_000_000_000),
    (t.TOD, "TOD#00:00:01", 1_000_000_000), (t.REAL, "0.1", nearest_real(0.1)), (t.string(), "'a$27b'", "a'b"),
    (t.string(), "a\u00ff", "a\u00ff"),
    (t.array(((1, 3),), t.INT), "1,2,3", [1, 2, 3]), (t.array(((1, 3),), t.INT), "[1, -2, 16#F]", [1, -2, 15]),
    (t.array(((0, 1),), t.array(((0, 1),), t.INT)), "[[1, 2], [3, 4]]", [[1, 2], [3, 4]]),
    (t.array(((1, 2),), t.string()), "'a,b', c", ["a,b", "c"]),
    (t.array(((1, 2),), t.string()), "['a$',b', \"[c\"]", ["a',b", "[c"]),
    (t.array(((1, 2),), t.string()), "it's, $", ["it's", "$"]),
    (t.array(((0, 1),), t.array(((0, 1),), t.INT)), "[1, 2], [3, 4]", [[1, 2], [3, 4]]),
    (COLOUR, "5", 5), (LEVEL, "100", 100),
    (CHAR, "a", "a"), (CHAR, "'", "'"), (CHAR, "'$0A'", "\n"), (CHAR, "CHAR#'x'", "x"), (WCHAR, '"$20AC"', "\u20ac"),
    (WCHAR, "\u20ac", "\u20ac"), (WIDE, '"a$00e9"', "a\u00e9"), (WIDE, "\u20ac1", "\u20ac1"), (WIDE, "WSTRING#'ab'", "ab"),
])  # fmt: skip
def test_text_becomes_a_value_of_the_type(kind: Type, text: str, value: object) -> None:
    assert parse_value(kind, text, "x") == value


@each_of(("kind", "value", "message"), [
    (t.INT, 32768, "x: 32768 is out of range of INT, which holds -32768..32767"),
    (t.WORD, -1, "x: -1 is out of range of WORD, which holds 0..65535"),
    (t.BYTE, -128, "which holds 0..255; for these bits write 128 or 16#80"), (t.BYTE, -129, "x: -129 is out of range of BYTE"),
    (LEVEL, 101, "x: 101 is out of range of Level, which holds 0..100"),
    (t.REAL, 1e39, "x: 1e+39 is out of range of REAL"),
    (t.LREAL, 10**400, "out of range of LREAL"),
    (t.string(3), "four", "x: 4 characters are out of range of STRING[3]"),
    (t.string(3), "\u0100", "cannot hold the character"), (t.string(3), "\u20ac", "cannot hold the character"),
    (t.string(3), "a\0", "cannot hold the character"),
    (WIDE, "four", "x: 4 characters are out of range of WSTRING[3]"),
    (WIDE, "\U0001f600\U0001f600", "x: 4 characters are out of range of WSTRING[3]"),
    (CHAR, "\u0100", "x: CHAR cannot hold the character"), (WCHAR, "\U00010000", "WCHAR cannot hold the character"),
    (CHAR, "\u20ac", "x: CHAR cannot hold the character"), (WCHAR, "\U0001f600", "WCHAR cannot hold the character"),
    (CHAR, "ab", "x is CHAR and takes one character, not 2"), (WCHAR, "", "x is WCHAR and takes one character, not 0"),
    (COLOUR, 1, "1 is no member of Colour; it has Red (0), Green (5)"),
    (COLOUR, "Blue", "Colour has no member Blue"), (COLOUR, False, "False is no member of Colour"),
    (COLOUR, 5.0, "5.0 is no member"),
])
def test_a_value_out_of_range_is_refused(kind: Type, value: object, message: str) -> None:
    with pytest.raises(ValueError) as error:
        conform(kind, value, "x")
    assert message in str(error.value)


@each_of(("value", "message"), [
    (datetime(1600, 1, 1), "not 1600-01-01T00:00:00"), (date(2300, 1, 1), "not 2300-01-01"), (time(12, 30), "not 12:30:00"),
])
def test_dates_of_toml_are_shown_as_they_are_written_there(value: object, message: str) -> None:
    with pytest.raises(TypeError, match=f"x is DATE and takes a date such as D#2024-01-31, {message}$"):
        conform(t.DATE, value, "x")


def test_times_and_dates_may_be_given_as_literals() -> None:
    assert conform(t.TIME, "1.5s", "x") == 1_500_000_000 and conform(t.DATE, "1970-01-02", "x") == 86_400_000_000_000


@each_of(("kind", "value"), [
    (t.INT, 1.0), (t.INT, True), (t.BOOL, 2), (t.BOOL, "TRUE"), (t.REAL, "1"), (t.REAL, True), (t.string(), 5),
    (CHAR, 65), (WCHAR, 65), (WIDE, 5), (PAIR, 5), (t.array(((0, 1),), t.INT), [1, 2]),
])  # fmt: skip
def test_a_value_of_another_kind_is_refused(kind: Type, value: object) -> None:
    with pytest.raises(TypeError, match="x is "):
        conform(kind, value, "x")


@each_of(("kind", "text", "message"), [
    (t.TIME, "10", "x is TIME and takes a time such as 10ms, not 10"),
    (t.INT, "10ms", "x is INT and takes a whole number, not 10ms"),
    (t.INT, "ten", "x: 'ten' is no literal; INT takes a whole number"),
    (t.BOOL, "yes", "x: 'yes' is no literal; BOOL takes TRUE or FALSE"),
    (t.TIME, "soon", "x: 'soon' is no literal; TIME takes a time such as 10ms"),
    (t.WORD, "TRUE", "x is WORD and takes a whole number, not TRUE"),
    (t.INT, "1.5", "x is INT and takes a whole number, not 1.5"),
    (t.WORD, "-1", "x: -1 is out of range of WORD, which holds 0..65535; for these bits write 65535 or 16#FFFF"),
    (t.BOOL, "2", "x is BOOL and takes TRUE or FALSE, not 2"), (t.INT, "1e3", "x is INT and takes a whole number, not 1e3"),
    (t.BYTE, "-129", "x: -129 is out of range of BYTE, which holds 0..255"),
    (FEW, "0", "x: 0 is out of range of Few, which holds 1..5"),
    (COLOUR, "Shape.Red", "x: Colour has no member Shape.Red; it has Red, Green"),
    (t.INT, "INT", "x: 'INT' is no literal; INT takes a whole number"), (t.LREAL, "-1e999", "x: -1e999 is out of range of LREAL"),
    (t.array(((1, 2),), t.INT), "", "x is ARRAY [1..2] OF INT and takes 2 values parted by commas, not 1"),
    (t.array(((1, 2),), t.INT), "1,2,", "x is ARRAY [1..2] OF INT and takes 2 values parted by commas, not 3"),
    (t.INT, "noon", "x: 'noon' is no literal; INT takes a whole number"),
    (t.INT, "2#9", "x: '2#9' is no literal; INT takes a whole number"),
    (t.INT, "8#8", "x: '8#8' is no literal; INT takes a whole number"),
    (t.WORD, "16#_", "x: '16#_' is no literal; WORD takes a whole number"),
    (t.WORD, "0x_", "x: '0x_' is no literal; WORD takes a whole number"),
    (t.INT, "'", "x: \"'\" is no literal; INT takes a whole number"),
    (t.DATE, "DT#2024-01-01-00:00:00",
     "x is DATE and takes a date such as D#2024-01-31, not DT#2024-01-01-00:00:00"),
    (t.array(((1, 3),), t.INT), "1,2",
     "x is ARRAY [1..3] OF INT and takes 3 values parted by commas, not 2"),
    (t.string(), "'a$'", "x: \"'a$'\" ends within an escape"),
])
def test_text_of_another_kind_is_refused(kind: Type, text: str, message: str) -> None:
    with pytest.raises((TypeError, ValueError)) as error:
        parse_value(kind, text, "x")
    assert str(error.value) == message


@each_of(("kind", "value", "text"), [
    (t.BOOL, True, "TRUE"), (t.INT, -5, "-5"), (t.WORD, 255, "255"), (t.TIME, 1_500_000_000, "T#1s500ms"),
    (t.string(), "a", "'a'"), (COLOUR, 5, "Green (5)"), (COLOUR, 3, "? (3)"), (t.REAL, math.inf, "inf"),
    (t.REAL, 0.10000000149011612, "0.1"), (t.LREAL, 0.10000000149011612, "0.10000000149011612"),
    (t.array(((0, 1),), t.BOOL), [True, False], "[TRUE, FALSE]"), (PAIR, {"n": 1, "s": "x"}, "(n := 1, s := 'x')"),
    (BLOCK, {"n": 1, "limit": 2, "$edge": 3}, "(n := 1)"), (RECORD, {"n": 1, "limit": 2}, "(n := 1, limit := 2)"),
    (PAIR, {"s": "x"}, "(s := 'x')"),
    (t.NULL, None, "NULL"), (t.string(), "it's $5\n\x01", "'it$'s $$5$L$01'"), (CHAR, "a", "'a'"), (CHAR, "\0", "'$00'"),
    (t.DATE, 1_749_686_400_000_000_000, "D#2025-06-12"), (t.DT, 1_749_738_615_000_000_000, "DT#2025-06-12-14:30:15"),
    (t.TOD, 52_215_000_000_000, "TOD#14:30:15"),
    (PINS, {"out": 3, "own": 4, "both": 2, "in": 1}, "(in := 1, both := 2, out := 3, own := 4)"),
    (WCHAR, "\u20ac", '"\u20ac"'), (WIDE, 'a"\x07', '"a$"$0007"'),
])  # fmt: skip
def test_values_are_shown(kind: Type, value: object, text: str) -> None:
    assert show(kind, value) == text  # type: ignore[arg-type]


def test_bit_strings_are_shown_in_hexadecimal_on_request() -> None:
    assert [show(kind, 255, hexadecimal=True) for kind in (t.WORD, t.BYTE, t.INT)] == ["16#00FF", "16#FF", "255"]


@each_of(("kind", "value", "plain"), [
    (t.REAL, 0.10000000149011612, 0.1), (t.LREAL, 0.1, 0.1), (t.REAL, math.inf, "inf"), (t.LREAL, -math.inf, "-inf"),
    (PAIR, None, None), (t.array(((0, 1),), t.REAL), None, None), (t.REAL, None, None),  # behind a reference that is null
    (t.LREAL, math.nan, "nan"), (PAIR, {"n": 1}, {"n": 1}), (t.array(((0, 1),), t.REAL), [math.inf, 0.5], ["inf", 0.5]),
])  # fmt: skip
def test_values_become_those_of_json(kind: Type, value: object, plain: object) -> None:
    assert plain_value(kind, value) == plain  # type: ignore[arg-type]


# --- in memory --------------------------------------------------------------------------------------------------------


@pytest.fixture
def memory() -> Memory:
    return Memory(SLOTS_OFFSET + 4096, AREAS)


@pytest.mark.parametrize(("kind", "value"), [
    (t.BOOL, True), (t.LINT, -(1 << 63)), (t.ULINT, (1 << 64) - 1), (t.REAL, 1.5), (t.TIME, -1), (t.string(5), "h\xe9"),
    (t.string(5, True), "h\u20ac"), (t.string(2, True), "\U0001f600"),
    (CHAR, "\xff"), (WCHAR, "\u20ac"), (CHAR, "\0"), (COLOUR, 5), (t.array(((1, 2), (0, 1)), t.INT), [1, -2, 3, 4]),
    (t.array(((0, 1),), PAIR), [{"n": 1, "s": "a"}, {"n": 2, "s": ""}]),
])  # fmt: skip
def test_what_was_written_is_read(memory: Memory, kind: Type, value: object) -> None:
    place = Place("x", kind, SLOTS_OFFSET + 16)
    places.write(memory, place, value)
    assert places.read(memory, place) == value


def test_a_bit_leaves_its_neighbours(memory: Memory) -> None:
    memory.u8[100] = 0b1010
    places.write(memory, Place("x", t.BOOL, 100, 2), True)
    places.write(memory, Place("x", t.BOOL, 100, 1), False)
    assert memory.u8[100] == 0b1100


def test_a_value_is_written_wholly_or_not_at_all(memory: Memory) -> None:
    place = Place("x", t.array(((0, 2),), t.INT), SLOTS_OFFSET)
    with pytest.raises(ValueError, match=r"x\[2\]: 70000 is out of range"):
        places.write(memory, place, [1, 2, 70000])
    assert places.read(memory, place) == [0, 0, 0]


def test_an_array_takes_as_many_as_it_has(memory: Memory) -> None:
    with pytest.raises(ValueError, match="takes a list of 3 values"):
        places.write(memory, Place("x", t.array(((0, 2),), t.INT), SLOTS_OFFSET), [1])


def test_several_values_are_written_each_to_its_place(memory: Memory) -> None:
    one, other = Place("one", t.INT, SLOTS_OFFSET), Place("other", t.BOOL, SLOTS_OFFSET + 8, 3)
    places.write_all(memory, {one: -5, other: True})
    assert (places.read(memory, one), memory.u8[SLOTS_OFFSET + 8]) == (-5, 8)


def test_an_array_of_bits_goes_on_in_the_next_byte(memory: Memory) -> None:
    bits = Place("bits", t.array(((0, 11),), t.BOOL), SLOTS_OFFSET, 6)
    places.write(memory, bits, [True, False, True, *[False] * 8, True])
    assert list(memory.u8[SLOTS_OFFSET : SLOTS_OFFSET + 3]) == [0x40, 0x01, 0x02]
    assert places.read(memory, bits) == [True, False, True, *[False] * 8, True]


def test_a_structure_takes_some_of_its_members(memory: Memory) -> None:
    place = Place("x", PAIR, SLOTS_OFFSET)
    places.write(memory, place, {"s": "ab"})
    assert places.read(memory, place) == {"n": 0, "s": "ab"}
    with pytest.raises(UnknownPlace, match="x has no t"):
        places.write(memory, place, {"t": 1})


def test_a_reference_is_followed(memory: Memory) -> None:
    memory.write(SLOTS_OFFSET, "ref", 1 << 40 | (SLOTS_OFFSET + 32) << 8 | 255)
    place = Place("x", t.INT, SLOTS_OFFSET, hops=(4,))
    places.write(memory, place, -7)
    assert memory.read(SLOTS_OFFSET + 36, "i16") == -7
    assert places.dereferenced(memory, place) == Place("x", t.INT, SLOTS_OFFSET + 36)
    assert places.read(memory, place) == -7


def test_a_reference_to_a_bit_is_followed(memory: Memory) -> None:
    memory.write(SLOTS_OFFSET, "ref", 1 << 40 | 4096 << 8 | 3)
    places.write(memory, Place("x", t.BOOL, SLOTS_OFFSET, hops=(0,)), True)
    assert memory.u8[4096] == 0b1000


def test_a_null_reference_reads_as_none_and_takes_nothing(memory: Memory) -> None:
    place = Place("x", t.INT, SLOTS_OFFSET, hops=(0,))
    assert places.read(memory, place) is None and places.dereferenced(memory, place) is None
    with pytest.raises(ValueError, match="behind a reference that is null"):
        places.write(memory, place, 1)


def test_a_constant_is_not_written(memory: Memory) -> None:
    with pytest.raises(ValueError, match="x is CONSTANT"):
        places.write(memory, Place("x", t.INT, SLOTS_OFFSET, constant=True), 1)


def test_what_is_declared_to_be_read_in_hexadecimal_is_shown_so_in_an_instance() -> None:
    fields = {"CODE": Field("Code", t.UINT, 0, hexadecimal=True), "N": Field("n", t.UINT, 2)}
    assert show(StructType("Coded", 4, 2, fields), {"Code": 129, "n": 129}) == "(Code := 16#0081, n := 129)"
    assert in_hexadecimal(t.INT, -2) == "16#FFFE"
