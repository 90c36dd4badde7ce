"""Bytes to names, and values at places that have been found."""

from __future__ import annotations

import pytest

from fbvm.base.areas import AREAS, e_bank
from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.watch.names import Names, _address, is_single
from fbvm.watch.paths import Place
from fbvm.watch.places import parse_for, read_found, write_found
from fbvm.watch.values import parse_time_ns

TEXT = """TYPE Pair : STRUCT low : INT; high : ARRAY[1..2] OF DINT; END_STRUCT END_TYPE
PROGRAM Main
VAR a : INT; pairs : ARRAY[0..1] OF Pair; t : TON; flag AT CIO 1.04 : BOOL; END_VAR
a := 1;
END_PROGRAM
"""


@pytest.fixture
def plc() -> Plc:
    made = compile_text(TEXT).image
    assert made is not None
    return Plc(made)


@pytest.mark.parametrize("name", ["Main.a", "Main.pairs[1].high[2]", "Main.pairs[0].low", "Main.t.ET", "Main.flag", "D7",
                                  "CIO 3.12", "CIO 3.02", "T3"])
def test_a_byte_has_the_name_of_the_single_value_in_it(plc: Plc, name: str) -> None:
    names, place = Names.of(plc.image, plc.memory.areas), plc.find(name)
    found = names.at(place.offset, place.bit)
    assert found is not None and found.name == name and is_single(found)


def test_structures_arrays_and_instances_are_not_single(plc: Plc) -> None:
    for name in ("Main.pairs", "Main.pairs[0]", "Main.pairs[0].high", "Main.t"):
        assert is_single(plc.find(name)) is False
    assert is_single(plc.find("Main.a")) is True


def test_an_instance_is_known_by_its_first_byte(plc: Plc) -> None:
    names = Names.of(plc.image, plc.memory.areas)
    assert names.instance(plc.find("Main.t").offset) == "Main.t"
    assert names.instance(plc.find("Main.a").offset) == ""


def test_values_are_written_where_they_were_found(plc: Plc) -> None:
    one, several = plc.find("Main.a"), plc.find("D200..D202")
    write_found(plc.memory, one, 7)
    write_found(plc.memory, several, [1, 2, 3])
    assert (read_found(plc.memory, one), read_found(plc.memory, several)) == (7, [1, 2, 3])
    for wrong in ([1, 2], 5, "abc"):
        with pytest.raises(ValueError, match=r"D200\.\.D202 takes a list of 3 values"):
            write_found(plc.memory, several, wrong)
    assert parse_for(one, "-3") == -3 and parse_for(several, "4, 16#5, 6") == [4, 5, 6]
    with pytest.raises(ValueError, match="takes 3 values parted by commas, 2 given"):
        parse_for(several, "1,2")


def test_the_longest_time_has_64_bits() -> None:
    assert parse_time_ns("9223372036854775807ns") == (1 << 63) - 1
    with pytest.raises(ValueError, match="64 bits of nanoseconds"):
        parse_time_ns("9223372036854775808ns")


def test_a_reader_reads_what_read_does_now_and_later() -> None:
    """Of every kind of place: numbers, bits of words, characters, texts, members behind references, whole structures."""
    image = compile_text("""TYPE Pair : STRUCT a : INT; b : BOOL; END_STRUCT END_TYPE
        PROGRAM Main VAR
            b : BOOL; bit AT W5.03 : BOOL; s : SINT; ui : UINT; d : DINT; ul : ULINT; r : REAL; lr : LREAL; t : TIME;
            w : WORD := 5; c : CHAR; text : STRING[5]; pair : Pair; list : ARRAY[1..3] OF DINT; point : REF_TO Pair;
            one : (Off, On);
        END_VAR
            b := NOT b; bit := b; s := s - 1; ui := ui - 1; d := d - 1; ul := ul - 1;
            r := r + REAL#0.1; lr := lr - 0.1; t := t + T#1s;
            w := ROL(w, 1); c := 'x'; text := 'abc'; pair.a := DINT_TO_INT(d); pair.b := b; list[2] := d;
            point := REF(pair); one := On;
        END_PROGRAM""").image
    assert image is not None
    plc = Plc(image)
    names = ["b", "bit", "s", "ui", "d", "ul", "r", "lr", "t", "w", "c", "text", "pair", "pair.a", "pair.b", "list", "list[2]",
             "point", "point^.a", "one"]  # fmt: skip
    places = [plc.find(f"Main.{name}") for name in names]
    readers = [plc.reader(place) for place in places if isinstance(place, Place)]
    assert len(readers) == len(names)
    for _ in range(3):
        found = [(type(value), value) for value in (read() for read in readers)]
        assert found == [(type(value), value) for value in map(plc.read, places)]
        plc.scan()


@pytest.mark.slow
def test_each_byte_and_each_bit_of_an_area_has_an_address() -> None:
    areas = {**AREAS, "E2": e_bank("E2", 1 << 20)}
    for area in areas.values():
        end = area.offset + area.size_bytes
        for offset in {*range(area.offset, area.offset + 8), *range(end - 8, end)}:
            for bit in (None, *range(8)):
                found = _address(areas, area, offset, bit)
                assert found.offset <= offset < found.offset + max(1, found.type.size), (area.name, offset, bit, found)
