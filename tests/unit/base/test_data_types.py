"""Data types: the memory that they take, what converts to what, what is one type."""

from __future__ import annotations

from rows import each_of

from fbvm.base.types import (
    ANYTHING,
    BOOL,
    BYTE,
    DINT,
    ELEMENTARY,
    INT,
    LREAL,
    NULL,
    REAL,
    TIME,
    WORD,
    Elementary,
    EnumType,
    Field,
    StructType,
    SubrangeType,
    Type,
    array,
    base,
    bound,
    character,
    characters,
    common,
    converts,
    derives,
    families,
    followed,
    interface,
    machine,
    on_bits,
    open_array,
    pointer,
    reference,
    string,
)

BITS = {
    "BOOL": 8, "SINT": 8, "INT": 16, "DINT": 32, "LINT": 64, "USINT": 8, "UINT": 16, "UDINT": 32, "ULINT": 64, "BYTE": 8,
    "WORD": 16, "DWORD": 32, "LWORD": 64, "REAL": 32, "LREAL": 64, "CHAR": 8, "WCHAR": 16, "TIME": 64, "LTIME": 64, "DATE": 64,
    "LDATE": 64,
    "TIME_OF_DAY": 64, "LTIME_OF_DAY": 64, "DATE_AND_TIME": 64, "LDATE_AND_TIME": 64,
}
"""Widths in memory: table 10 of the standard; a BOOL has a byte, times and dates 64 bits of nanoseconds."""
MODE = EnumType("Mode", 2, 2, INT, {"OFF": 0, "ON": 1}, {0: "Off", 1: "On"})
SMALL = SubrangeType("Small", 2, 2, INT, 0, 9)
BASE = StructType("Base", 8, 8, {"A": Field("a", INT, 0)}, True)
OTHER = StructType("Other", 8, 8, {}, True)
DERIVED = StructType("Derived", 8, 8, {"B": Field("b", INT, 0)}, True, {"OLD": "B"}, (OTHER, BASE))
LEAF = StructType("Leaf", 8, 8, {}, True, {}, (DERIVED,))


def test_elementary_types_are_as_wide_as_their_table_says_and_aligned_to_that() -> None:
    assert {name: (8 * kind.size, 8 * kind.align) for name, kind in ELEMENTARY.items()} == {
        name: (bits, bits) for name, bits in BITS.items()}


def test_integers_and_bit_strings_have_the_range_of_their_bits() -> None:
    for kind in ELEMENTARY.values():
        bits = 1 if kind is BOOL else BITS[kind.name]
        assert kind.bits == bits, kind
        if "ANY_REAL" in kind.families:
            continue
        is_signed = bool(kind.families & {"ANY_SIGNED", "ANY_DURATION", "ANY_DATE"})
        assert (kind.low, kind.high) == ((-(1 << bits - 1), (1 << bits - 1) - 1) if is_signed else (0, (1 << bits) - 1)), kind


@each_of("kind, name, size, align", [
    (string(), "STRING[80]", 81, 1), (string(5), "STRING[5]", 6, 1), (string(5, True), "WSTRING[5]", 12, 2),
    (array(((0, 9),), INT), "ARRAY [0..9] OF INT", 20, 2),
    (array(((-1, 1), (5, 8)), LREAL), "ARRAY [-1..1, 5..8] OF LREAL", 96, 8),
    (array(((1, 3),), string(4)), "ARRAY [1..3] OF STRING[4]", 15, 1),
    (characters(string(5)), "ARRAY [0..5] OF BYTE", 6, 1), (characters(string(5, True)), "ARRAY [0..5] OF WORD", 12, 2),
    (on_bits(array(((0, 7),), BOOL)), "ARRAY [0..7] OF BOOL on bits", 1, 1),
    (on_bits(array(((0, 8),), BOOL)), "ARRAY [0..8] OF BOOL on bits", 2, 1),
    (open_array(1, INT), "ARRAY [*] OF INT", 24, 8), (open_array(2, INT), "ARRAY [*, *] OF INT", 40, 8),
    (reference(INT), "REF_TO INT", 8, 8), (pointer(INT), "POINTER TO INT", 8, 8), (bound(INT), "REFERENCE TO INT", 8, 8),
    (interface(BASE), "Base", 8, 8), (NULL, "NULL", 8, 8), (ANYTHING["ANY_INT"], "ANY_INT", 24, 8),
])
def test_what_other_types_take(kind: Type, name: str, size: int, align: int) -> None:
    assert (str(kind), kind.size, kind.align) == (name, size, align)


def test_where_the_bounds_of_an_open_array_lie() -> None:
    kind = open_array(2, INT)
    assert [kind.bound_offset(dimension, upper) for dimension in (0, 1) for upper in (False, True)] == [8, 16, 24, 32]


def test_members_have_other_names_and_any_case() -> None:
    field = DERIVED.member("b")
    assert field is not None and DERIVED.member("Old") is field and DERIVED.member("c") is None


@each_of("kind, target, expected", [
    (BASE, BASE, True), (DERIVED, BASE, True), (LEAF, BASE, True), (LEAF, OTHER, True), (BASE, DERIVED, False), (INT, INT, True),
    (INT, BASE, False), (None, BASE, False),
])
def test_what_derives_from_what(kind: Type | None, target: Type | None, expected: bool) -> None:
    assert derives(kind, target) is expected


@each_of("source, target, expected", [
    (INT, DINT, True), (DINT, INT, False), (INT, REAL, True), (DINT, REAL, False), (DINT, LREAL, True), (SMALL, DINT, True),
    (INT, SMALL, True), (BYTE, WORD, True), (BYTE, INT, False), (TIME, ELEMENTARY["LTIME"], True), (INT, MODE, False),
    (MODE, INT, False), (string(3), string(9), True), (string(9), string(3), True), (string(3), string(3, True), False),
    (ELEMENTARY["CHAR"], string(3), True), (ELEMENTARY["WCHAR"], string(3), False), (ELEMENTARY["WCHAR"], string(3, True), True),
    (string(1), ELEMENTARY["CHAR"], False), (INT, string(3), False), (NULL, reference(INT), True), (reference(INT), NULL, False),
    (reference(INT), reference(DINT), False), (reference(DERIVED), reference(BASE), True),
    (reference(BASE), reference(DERIVED), False), (pointer(INT), pointer(DINT), True), (bound(INT), reference(INT), False),
    (interface(DERIVED), interface(BASE), True), (interface(DERIVED), reference(BASE), False), (reference(INT), INT, False),
    (BASE, BASE, True), (BASE, DERIVED, False),
])
def test_what_converts_by_itself(source: Type, target: Type, expected: bool) -> None:
    assert converts(source, target) is expected


@each_of("left, right, expected", [
    ("INT", "INT", "INT"), ("INT", "DINT", "DINT"), ("DINT", "INT", "DINT"), ("INT", "UINT", "DINT"), ("SINT", "USINT", "INT"),
    ("DINT", "UDINT", "LINT"), ("LINT", "ULINT", None), ("UDINT", "REAL", "LREAL"), ("WORD", "INT", None),
    ("BYTE", "LWORD", "LWORD"),
])
def test_the_smallest_type_that_takes_both(left: str, right: str, expected: str | None) -> None:
    found = common(ELEMENTARY[left], ELEMENTARY[right])
    assert (found.name if found is not None else None) == expected


def test_what_a_type_is_to_an_operation() -> None:
    assert [machine(kind) for kind in (BOOL, INT, SMALL, MODE, string(), string(3, True), reference(INT), BASE)] == [
        "b", "i16", "i16", "i16", "s8", "s16", "ref", ""]
    assert (base(SMALL), base(MODE)) == (INT, MODE)
    assert (followed(bound(INT)), followed(reference(INT)), followed(INT)) == (INT, reference(INT), INT)
    assert [character(kind).name for kind in (string(), string(3, True))] == ["CHAR", "WCHAR"]
    assert isinstance(INT, Elementary) and families(SMALL) == families(INT) >= {"ANY_SIGNED", "ANY_INT", "ANY_NUM", "ANY"}
    assert families(string()) == {"ANY_STRING", "ANY_CHARS", "ANY_ELEMENTARY", "ANY"}
    assert families(BASE) == families(MODE) == {"ANY_DERIVED", "ANY"} and not families(ANYTHING["ANY"])
