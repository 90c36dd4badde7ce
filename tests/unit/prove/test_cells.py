"""Which cells memory gets by the ways in which a program uses it, and what is read and written across cells."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm.prove.encoding.cells import (
    BIT,
    BOOL,
    NUMBER,
    Cell,
    Contents,
    Partition,
    Reshape,
    constant_of,
    initial_bytes,
)
from fbvm.prove.encoding.terms import Term, Terms

Use = tuple[int, int, int]
KIND = {NUMBER: "n", BOOL: "b", BIT: "bits"}


def cells_of(partition: Partition) -> str:
    """The cells by their first bytes: `0:4n` a number of four bytes at 0, `4:1b` a BOOL, `5:bits` eight bits."""
    found: dict[int, str] = {}
    for cells in partition.at.values():
        cell = cells[0]
        found[cell.offset] = f"{cell.offset}:{'' if cell.kind == BIT else cell.size}{KIND[cell.kind]}"
        assert all(partition.at[at] is cells for at in range(cell.offset, cell.offset + cell.size))
        assert len(cells) == (8 if cell.kind == BIT else 1) and [each.bit for each in cells] == list(range(len(cells)))
    return " ".join(found[at] for at in sorted(found))


@each_of(("uses", "first", "shaped"), [
    ([(0, 4, NUMBER)], "0:4n", "0:4n"),
    ([(0, 1, BOOL), (0, 1, NUMBER)], "0:1b", "0:1b"),  # a copy of a BOOL reads a number
    ([(0, 1, NUMBER), (0, 1, BOOL)], "0:1n", "0:1n"),
    ([(0, 1, BIT), (0, 1, NUMBER)], "0:bits", "0:bits"),
    ([(0, 1, BIT), (0, 2, NUMBER)], "0:bits 1:1n", "0:2n"),  # the larger number counts, once it is known
    ([(0, 2, NUMBER), (1, 1, BIT)], "0:2n", "0:2n"),
    ([(0, 1, NUMBER), (0, 4, NUMBER), (2, 2, NUMBER)], "0:1n 1:1n 2:1n 3:1n", "0:4n"),
    ([(0, 4, NUMBER), (2, 4, NUMBER), (4, 1, NUMBER)], "0:4n 4:1n 5:1n", "0:4n 4:1n"),  # a cell that others were cut into
    ([(2, 4, NUMBER), (0, 4, NUMBER)], "0:1n 1:1n 2:4n", "0:4n"),
    ([(5, 1, BOOL)], "5:1n", "5:1n"),  # a byte that is known to hold other numbers
    ([(8, 2, NUMBER), (8, 1, BIT)], "8:2n", "8:bits"),  # a byte in which bits are inputs
    ([(8, 2, NUMBER), (9, 1, BIT)], "8:2n", "8:2n"),
])  # fmt: skip
def test_cells_fit_what_was_used(uses: list[Use], first: str, shaped: str) -> None:
    partition = Partition(frozenset({5}), range(8, 9))
    for use in uses:
        partition.cells(*use)
    assert cells_of(partition) == first
    made = partition.shaped()
    assert cells_of(made) == shaped and made.used is partition.used


def test_what_was_used_is_kept_but_for_a_number_that_is_read_of_a_boolean() -> None:
    partition = Partition()
    for use in ((0, 1, BOOL), (0, 1, NUMBER), (1, 2, NUMBER), (1, 2, NUMBER), (1, 1, BIT), (4, 1, BIT), (4, 1, NUMBER)):
        partition.cells(*use)
    assert partition.used == {(0, 1, BOOL), (1, 2, NUMBER), (1, 1, BIT), (4, 1, BIT)}


@each_of(("known", "to", "source", "size", "cells"), [
    ([(0, 4, NUMBER)], 16, 0, 4, "0:4n 16:4n"), ([(16, 4, NUMBER)], 16, 0, 4, "0:4n 16:4n"),
    ([(0, 2, NUMBER), (2, 1, BOOL)], 16, 0, 4, "0:2n 2:1b 3:1n 16:2n 18:1b 19:1n"),
    ([(0, 4, NUMBER)], 16, 0, 2, "0:4n"),  # it is more than what is copied
    ([(0, 4, NUMBER), (17, 1, BOOL)], 16, 0, 4, "0:4n 17:1b"),
    ([], 16, 0, 4, "0:4n 16:4n"), ([], 32, 0, 12, "0:8n 8:4n 32:8n 40:4n"),
    ([(4, 1, BIT)], 32, 0, 8, "0:4n 4:bits 5:3n 32:4n 36:bits 37:3n"),
    ([(36, 1, BOOL)], 32, 0, 6, "0:4n 4:1b 5:1n 32:4n 36:1b 37:1n"),
    ([], 2, 0, 4, "2:2n 4:2n"), ([], 1, 0, 4, "3:1n 4:1n"),  # over itself: no cell is copied to itself
])  # fmt: skip
def test_bytes_that_are_copied_get_the_cells_of_the_others(known: list[Use], to: int, source: int, size: int, cells: str) -> None:
    partition = Partition()
    for use in known:
        partition.cells(*use)
    partition.mirror(to, source, size)
    assert cells_of(partition) == cells


class Memory:
    """Contents over the bytes 1, 2, 3 and so on."""

    def __init__(self, *uses: Use) -> None:
        self.terms, self.partition = Terms(), Partition()
        for use in uses:
            self.partition.cells(*use)
        self.contents = Contents(self.terms, self.partition, self.initial)

    def initial(self, cell: Cell) -> Term:
        return constant_of(self.terms, cell, bytes(range(cell.offset + 1, cell.offset + 1 + cell.size)))

    def bytes(self, size: int) -> bytes:
        value = self.contents.number(0, size)
        assert value.is_constant and value.width == 8 * size
        return int(value.value).to_bytes(size, "little")


def test_a_number_is_written_into_parts_of_cells() -> None:
    memory = Memory((0, 4, NUMBER), (4, 1, BIT), (6, 2, NUMBER))
    true, constant = memory.terms.true, memory.terms.constant
    assert memory.bytes(8) == bytes(range(1, 9))
    memory.contents.write(1, 2, constant(16, 0xBBAA), true)
    assert memory.bytes(8) == b"\1\xaa\xbb\4\5\6\7\x08"
    memory.contents.write(3, 4, constant(32, 0x44332211), true)
    assert memory.bytes(8) == b"\1\xaa\xbb\x11\x22\x33\x44\x08"
    memory.contents.write_bit(7, 2, true, true)
    memory.contents.write_bit(4, 7, true, true)
    memory.contents.write_bit(4, 1, memory.terms.false, true)
    assert memory.bytes(8) == b"\1\xaa\xbb\x11\xa0\x33\x44\x0c"
    assert [memory.contents.bit(4, bit) is true for bit in range(8)] == [False] * 5 + [True, False, True]
    memory.contents.write(0, 8, constant(64, 0x0102030405060708), true)
    assert memory.bytes(8) == bytes(range(8, 0, -1))
    assert memory.contents.bit(1, 0) is true and memory.contents.boolean(7) is true


def test_what_is_written_under_a_condition_stays_elsewhere() -> None:
    memory = Memory((0, 2, NUMBER), (2, 1, BOOL))
    terms, guard = memory.terms, memory.terms.variable("guard", 0)
    memory.contents.write(1, 1, terms.constant(8, 9), guard)
    assert memory.contents.number(0, 2) is terms.ite(guard, terms.constant(16, 0x0901), terms.constant(16, 0x0201))
    child = memory.contents.child()
    child.write(0, 2, terms.constant(16, 7), terms.true)
    assert child.number(0, 2).value == 7 and memory.contents.number(0, 1).value == 1
    assert child.written_since(memory.contents) == {Cell(0, 2, NUMBER)} and child.written_since(child) == set()
    assert child.child().number(0, 2).value == 7


def test_a_byte_that_is_no_boolean_begins_the_encoding_again() -> None:
    memory = Memory()
    with pytest.raises(Reshape) as found:
        memory.contents.boolean(3)
    assert found.value.offset == 3
    memory = Memory((0, 1, BOOL), (5, 1, BOOL))
    for value, offset in ((2, 0), (255, 5)):
        with pytest.raises(Reshape) as found:
            memory.contents.write(offset, 1, memory.terms.constant(8, value), memory.terms.true)
        assert found.value.offset == offset
    with pytest.raises(Reshape):
        memory.contents.write_bit(0, 0, memory.terms.true, memory.terms.true)
    memory.contents.write(0, 1, memory.terms.constant(8, 1), memory.terms.true)
    assert memory.contents.boolean(0) is memory.terms.true
    memory.contents.write_boolean(0, memory.terms.false, memory.terms.true)
    assert memory.contents.number(0, 1).value == 0


def test_the_memory_at_power_on() -> None:
    found = initial_bytes([(2, b"\1\0\3"), (3, b"\4\0\5"), (9, b"\0")])
    assert found(0, 10) == b"\0\0\1\4\0\5\0\0\0\0" and found(5, 1) == b"\5"
