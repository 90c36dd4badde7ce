"""What a program says of its variables to those who exchange them: places, sizes, rows by the names of their fields."""

from __future__ import annotations

import pytest

from fbvm.processor.contract import Contract, ContractError
from fbvm.processor.processor import contract
from fbvm.watch.paths import UnknownPlace

TEXT = """
TYPE Kind : UINT (Nothing, Small := 7, Large); END_TYPE
TYPE Inner : STRUCT Low : SINT; High : LINT; END_STRUCT; END_TYPE
TYPE Row : STRUCT What : Kind; Sure : BOOL; Words : ARRAY[1..2] OF WORD; Deep : Inner; Size : UDINT; END_STRUCT; END_TYPE
TYPE Named : STRUCT Name : STRING[5]; END_STRUCT; END_TYPE
VAR_GLOBAL CONSTANT MOST : UINT := 300; LATE : TIME := T#2ms; USUAL : Kind := Kind#Large; END_VAR
VAR_GLOBAL
    Rows : ARRAY[-1..3] OF Row; One : Row; Rings : ARRAY[1..2] OF ARRAY[0..15] OF BYTE; Table : ARRAY[0..1, 0..1] OF INT;
    Names : Named; Last AT %D6.3 : BOOL;
END_VAR
PROGRAM P END_PROGRAM
"""


@pytest.fixture(scope="module")
def own() -> Contract:
    return contract(TEXT)


def test_variables(own: Contract) -> None:
    row = own.record("Rows")
    assert own.array("Rows") == (-1, 5, row.size) and own.array("rings") == (1, 2, 16)
    assert (own.size("Rings"), own.form("Rings"), own.form("Rows"), own.form("LATE")) == (32, "u8", "u8", "i64")
    assert (own.constant("MOST"), own.constant("LATE"), own.constant("USUAL")) == (300, 2_000_000, 8)
    assert own.record("One").size == row.size and own.record("Rows") is row
    assert own.offset("Rows[0]") == own.offset("Rows") + row.size


def test_rows_are_written_and_read_by_name(own: Contract) -> None:
    row, kinds = own.record("Rows"), own.enumeration("Kind")
    table = bytearray(b"\xff" * 3 * row.size)
    pack = row.packer("size", "What", "words[2]", "deep.high")
    for number, kind in enumerate(("nothing", "SMALL", "Large")):
        pack(table, row.size * number, 1000 + number, kinds[kind], 0xABCD, -5)
    names = ("what", "size", "sure", "words[1]", "words[2]", "deep.low", "deep.high")
    rows = row.rows(*names)(memoryview(table))
    assert [*rows] == [(kind, 1000 + number, False, 0, 0xABCD, 0, -5) for number, kind in enumerate((0, 7, 8))]
    for number, fields in enumerate(row.rows(*names)(memoryview(table))):
        assert row.unpacker(*names)(memoryview(table), row.size * number) == fields
    assert row.unpacker("what", "size")(memoryview(table), 2 * row.size) == (8, 1002)
    in_order = row.rows("what", "sure", "size")(memoryview(table))
    assert [*in_order] == [(kind, False, 1000 + number) for number, kind in enumerate((0, 7, 8))]
    assert table.count(0xFF) == 3 * 7, "only what -5 has of them"
    assert row.part("words") == (row["words[1]"].offset, 4) and row.part("deep") == (row["deep.low"].offset, 16)


def test_both_sides_name_the_same(own: Contract) -> None:
    row, kinds = own.record("One"), own.enumeration("Kind")
    row.require(["what", "sure", "words", "deep.low", "deep.high", "size"], "this test")
    kinds.require(["nothing", "small", "large"], "this test")
    with pytest.raises(ContractError, match=r"Row has Sure, Deep\.High in the program, of which this test does not know"):
        row.require(["what", "words", "deep.low", "size"], "this test")
    with pytest.raises(ContractError, match="Kind has Large in the program, of which this test does not know"):
        kinds.require(["nothing", "small"], "this test")
    with pytest.raises(ContractError, match=r"Row has no colour; it has What, Sure, Words\[1\], Words\[2\], "):
        row.require(["colour"], "this test")
    with pytest.raises(ContractError, match="Kind has no huge; it has Nothing, Small, Large"):
        kinds.require(["huge"], "this test")


def test_what_cannot_be_exchanged(own: Contract) -> None:
    for wrong, said in (
        (lambda: own.record("MOST"), "MOST is UINT and has no fields"),
        (lambda: own.array("MOST"), "MOST is UINT, and no array with one subscript"),
        (lambda: own.array("Table"), "no array with one subscript"),
        (lambda: own.record("Names"), "Name is STRING"),
        (lambda: own.enumeration("Row"), "Row is Row and no enumeration"),
        (lambda: own.enumeration("Colour"), "the program uses no type Colour"),
        (lambda: own.record("One").enumeration("size"), "Row.Size is UDINT and no enumeration"),
    ):
        with pytest.raises(ContractError) as raised:
            wrong()
        assert said in str(raised.value)
    with pytest.raises(UnknownPlace):
        own.offset("Nowhere")
    with pytest.raises(ValueError, match="bytes of its own"):
        own.offset("Last")
