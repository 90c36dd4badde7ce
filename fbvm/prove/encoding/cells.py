"""Cells: the memory of a PLC as variables of the size in which a program uses them.

A cell is a number of some bytes, a BOOL that fills a byte, or a bit.  Cells never overlap.  What is read across cells is put
together of them; what lies inside one is a part of it.  Bytes that nobody has used yet become a cell at their first use, so the
program is looked at twice: first to see what it uses, then over cells of these sizes."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

from fbvm.prove.encoding.terms import Term, Terms

NUMBER, BOOL, BIT = 0, 1, 2
"""Kinds of cells."""
CHUNK_BYTES = 8
"""The size of cells of bytes that are only copied."""


class Cell(NamedTuple):
    """`size` bytes at `offset` of the memory; of a bit its number in the byte."""

    offset: int
    size: int
    kind: int
    bit: int = 0

    @property
    def width(self) -> int:
        """The width of its terms."""
        return 8 * self.size if self.kind == NUMBER else 0


class Reshape(Exception):
    """A byte that was taken for a BOOL holds other numbers: the encoding starts again with a number there."""

    def __init__(self, offset: int) -> None:
        super().__init__(offset)
        self.offset = offset


class Partition:
    """Which cell each byte belongs to.

    `used` is told every use (offset, size, kind); `numbers` are bytes at which no BOOL may be assumed; in the bytes `bitwise`
    each bit is a cell wherever a bit of them is used, since some bits of a word may be inputs and others not."""

    def __init__(self, numbers: frozenset[int] = frozenset(), bitwise: range = range(0)) -> None:
        self.at: dict[int, tuple[Cell, ...]] = {}
        """The cell of a byte, or the eight bits of it."""
        self.numbers, self.bitwise = numbers, bitwise
        self.used: set[tuple[int, int, int]] = set()

    def shaped(self) -> Partition:
        """A new partition with the cells that fit what was used: numbers first, the largest first."""
        made = Partition(self.numbers, self.bitwise)
        for offset, size, kind in sorted(self.used, key=self._rank):
            if all(at not in made.at for at in range(offset, offset + size)):
                made._create(offset, size, kind)
        made.used = self.used
        return made

    def _rank(self, use: tuple[int, int, int]) -> tuple[int, int, int]:
        offset, size, kind = use
        return (-1 if kind == BIT and offset in self.bitwise else kind), -size, offset

    def cells(self, offset: int, size: int, kind: int) -> tuple[Cell, ...]:
        """The cells of some bytes, from low to high; where there are none yet they are made."""
        known = self.at.get(offset)
        if known is not None and known[0].offset == offset and known[0].size == size:
            if kind != NUMBER or known[0].kind == NUMBER:
                self.used.add((offset, size, kind))
            return known
        self.used.add((offset, size, kind))
        if all(at not in self.at for at in range(offset, offset + size)):
            self._create(offset, size, kind)
        return self.covering(offset, size)

    def covering(self, offset: int, size: int) -> tuple[Cell, ...]:
        """The cells of some bytes; bytes without one become cells of a byte each."""
        found: dict[Cell, None] = {}
        for at in range(offset, offset + size):
            if at not in self.at:
                self._create(at, 1, NUMBER)
            found.update(dict.fromkeys(self.at[at]))
        return tuple(found)

    def _create(self, offset: int, size: int, kind: int) -> None:
        if kind == BOOL and offset in self.numbers:
            kind = NUMBER
        cells = tuple(Cell(offset, 1, BIT, bit) for bit in range(8)) if kind == BIT else (Cell(offset, size, kind),)
        for at in range(offset, offset + size):
            self.at[at] = cells

    def mirror(self, to: int, source: int, size: int) -> None:
        """Gives bytes that are copied the cells that the others have, where one of both has none."""
        at = 0
        while at < size:
            step = 1
            for here, there in ((source + at, to + at), (to + at, source + at)):
                known = self.at.get(here)
                if known and known[0].offset == here and known[0].size <= size - at \
                        and all(there + k not in self.at for k in range(known[0].size)):  # fmt: skip
                    self._create(there, known[0].size, known[0].kind)
                    step = known[0].size
                    break
            else:
                free = 0
                while free < min(CHUNK_BYTES, size - at) and source + at + free not in self.at and to + at + free not in self.at:
                    free += 1
                if free and abs(to - source) >= free:
                    self._create(source + at, free, NUMBER)
                    self._create(to + at, free, NUMBER)
                    step = free
            at += step


class Contents:
    """What cells hold: terms over a partition.  `initial` gives the term of a cell that was not written yet.

    A child has what its parent has until it writes (`child`); a parent is not written while it has children in use."""

    def __init__(self, terms: Terms, partition: Partition, initial: Callable[[Cell], Term],
                 parent: Contents | None = None) -> None:  # fmt: skip
        self.terms, self.partition, self.initial, self.parent = terms, partition, initial, parent
        self.written: dict[Cell, Term] = {}
        self._inherited: dict[Cell, Term] = {}
        """What the parent was found to hold."""

    def child(self) -> Contents:
        return Contents(self.terms, self.partition, self.initial, self)

    def get(self, cell: Cell) -> Term:
        if (found := self.written.get(cell)) is not None:
            return found
        if self.parent is None:
            return self.initial(cell)
        if (found := self._inherited.get(cell)) is None:
            at: Contents | None = self.parent
            while at is not None and found is None:
                found = at.written.get(cell)
                at = at.parent
            found = self._inherited[cell] = self.initial(cell) if found is None else found
        return found

    def written_since(self, ancestor: Contents | None) -> set[Cell]:
        """The cells that were written below an ancestor."""
        found: set[Cell] = set()
        at: Contents | None = self
        while at is not ancestor and at is not None:
            found.update(at.written)
            at = at.parent
        return found

    # --- reading

    def number(self, offset: int, size: int) -> Term:
        """Some bytes, the lowest first, as one bit-vector."""
        found: Term | None = None
        for cell in self.partition.cells(offset, size, NUMBER):
            if cell.kind == BIT:
                part = self.terms.of_boolean(self.get(cell), 1)
            else:
                part = self.get(cell) if cell.kind == NUMBER else self.terms.of_boolean(self.get(cell), 8)
                first, last = max(offset, cell.offset), min(offset + size, cell.offset + cell.size)
                part = self.terms.extract(part, 8 * (first - cell.offset), 8 * (last - first))
            found = part if found is None else self.terms.concat(part, found)
        assert found is not None
        return found

    def boolean(self, offset: int) -> Term:
        """A BOOL that fills a byte: TRUE unless the byte is 0."""
        cells = self.partition.cells(offset, 1, BOOL)
        return self.get(cells[0]) if cells[0].kind == BOOL else self.terms.is_set(self.number(offset, 1))

    def bit(self, offset: int, bit: int) -> Term:
        """A bit of a byte."""
        cells = self.partition.cells(offset, 1, BIT)
        return self.get(cells[bit]) if cells[0].kind == BIT else self.terms.bit(self.number(offset, 1), bit)

    # --- writing

    def write(self, offset: int, size: int, value: Term, guard: Term) -> None:
        """Writes a bit-vector into some bytes where `guard` is TRUE."""
        at = 0
        for cell in self.partition.cells(offset, size, NUMBER):
            if cell.kind == BIT:
                self._put(cell, self.terms.bit(value, at), guard)
                at += 1
                continue
            first, last = max(offset, cell.offset), min(offset + size, cell.offset + cell.size)
            part = self.terms.extract(value, 8 * (first - offset), 8 * (last - first))
            at = 8 * (last - offset)
            if cell.kind == BOOL:
                if part.high > 1:
                    raise Reshape(cell.offset)
                self._put(cell, self.terms.is_set(part), guard)
            else:
                self._put(cell, self._inserted(cell, 8 * (first - cell.offset), part), guard)

    def write_boolean(self, offset: int, value: Term, guard: Term) -> None:
        """Writes a BOOL that fills a byte."""
        cells = self.partition.cells(offset, 1, BOOL)
        if cells[0].kind == BOOL:
            self._put(cells[0], value, guard)
        else:
            self.write(offset, 1, self.terms.of_boolean(value, 8), guard)

    def write_bit(self, offset: int, bit: int, value: Term, guard: Term) -> None:
        """Writes a bit of a byte."""
        cells = self.partition.cells(offset, 1, BIT)
        if cells[0].kind == BIT:
            self._put(cells[bit], value, guard)
        elif cells[0].kind == BOOL:
            raise Reshape(offset)
        else:
            low = 8 * (offset - cells[0].offset) + bit
            self._put(cells[0], self._inserted(cells[0], low, self.terms.of_boolean(value, 1)), guard)

    def copy(self, to: int, source: int, size: int, guard: Term) -> None:
        """Copies bytes as if all were read before any is written."""
        self.partition.mirror(to, source, size)
        cells = self.partition.covering(source, size)
        if all(source <= cell.offset and cell.offset + cell.size <= source + size for cell in cells) \
                and all(self._same_shape(cell, to - source) for cell in cells):  # fmt: skip
            for cell, value in [(cell, self.get(cell)) for cell in cells]:
                self._put(cell._replace(offset=cell.offset + to - source), value, guard)
            return
        for at, value in [(at, self.number(source + at, 1)) for at in range(size)]:
            self.write(to + at, 1, value, guard)

    def _same_shape(self, cell: Cell, distance: int) -> bool:
        there = self.partition.at.get(cell.offset + distance, ())
        return cell._replace(offset=cell.offset + distance) in there

    def _inserted(self, cell: Cell, low: int, part: Term) -> Term:
        """What a cell holds, with `part` in place of its bits from `low` on."""
        if part.width == cell.width:
            return part
        terms, old, high = self.terms, self.get(cell), low + part.width
        value = part if low == 0 else terms.concat(part, terms.extract(old, 0, low))
        return value if high == cell.width else terms.concat(terms.extract(old, high, cell.width - high), value)

    def _put(self, cell: Cell, value: Term, guard: Term) -> None:
        if guard is not self.terms.true:
            value = self.terms.ite(guard, value, self.get(cell))
        self.written[cell] = value


def initial_bytes(parts: Iterable[tuple[int, bytes]]) -> Callable[[int, int], bytes]:
    """A function (offset, size) for the contents of a memory at power-on, of the `initial` of an Image."""
    known: dict[int, int] = {}
    for offset, data in parts:
        known.update((offset + at, value) for at, value in enumerate(data) if value)
        known.update((offset + at, 0) for at, value in enumerate(data) if not value and offset + at in known)
    return lambda offset, size: bytes(known.get(offset + at, 0) for at in range(size))


def constant_of(terms: Terms, cell: Cell, data: bytes) -> Term:
    """The term of a cell whose bytes are `data`."""
    if cell.kind == BIT:
        return terms.boolean(data[0] >> cell.bit & 1)
    if cell.kind == BOOL:
        if data[0] > 1:
            raise Reshape(cell.offset)
        return terms.boolean(data[0])
    return terms.constant(cell.width, int.from_bytes(data, "little"))
