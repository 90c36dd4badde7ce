"""The values at the ends of scans as columns: a cell a column, in blocks of scans, each compressed by itself.

Of a run of any length only one block is held as it is.  A column that changes in a block is a raw deflate stream of the
differences from scan to scan; of each there is the first value, and its least and greatest one, from which a chart of very
many scans is drawn without any block.  `columns.js` reads what is written here."""

from __future__ import annotations

import zlib
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import compress
from math import isfinite
from mmap import mmap
from operator import ne
from struct import Struct

from fbvm.base.areas import FLAG_AREAS, PAGE_BYTES, Area
from fbvm.base.memory import FORMATS
from fbvm.record.page.cells import BIT, SIZES, TEXT, WORD, Cell
from fbvm.record.trace.scan_source import Moment

BLOCK_SCANS = 4096
LINE = 512
"""Bytes that are compared and kept together."""
MOST_HELD_BYTES = 64 << 20
"""Of the scans of a block; then it ends earlier."""
_PAGE_LINES = PAGE_BYTES // LINE
_SPLIT = Struct(f"{LINE}s" * _PAGE_LINES)
"""Splits a page into its lines."""
LATEST_CHANGES = 64
"""Scans that are known for each cell in which it changed."""
_EXTREMES = {BIT: (0, 1), TEXT: (0, 1)}
"""The least and the greatest value of cells of which nobody wants to know more than that they changed."""
_LETTERS = {BIT: "B", TEXT: "I"} | {code: FORMATS[code] for code in SIZES if code not in (BIT, TEXT)}
_UNSIGNED = {2: "H", 4: "I", 8: "Q"}


@dataclass
class Entry:
    """A cell in a block in which, or before which, it changed: the length of its stream, 0 if it has one value there, the first
    and the last value in bytes, the least and the greatest one."""

    block: int
    length: int
    first: bytes
    last: bytes
    low: float
    high: float


@dataclass
class Column:
    """What is known of a cell: its value at the first scan, and an entry for each block in which it has another one."""

    cell: Cell
    initial: bytes
    entries: list[Entry] = field(default_factory=list)
    changed: list[int] = field(default_factory=list)
    """The latest scans in which it changed."""


class Texts:
    """The texts of one signal, numbered in the order in which they came; `values` are those of the scans of this block."""

    def __init__(self, cell: Cell, first: str) -> None:
        self.numbers = {first: 0}
        self.values = array("I")
        self._signal, self._latest = cell.signal, 0
        self._lines = set(range(cell.offset // LINE, (cell.offset + cell.size - 1) // LINE + 1)) if cell.size else None

    def add(self, moment: Moment, moved: set[int], text: Callable[[int, Moment], str]) -> None:
        """Adds the text at the end of a scan in which some lines of memory changed."""
        if self._lines is None or not self._lines.isdisjoint(moved):
            self._latest = self.numbers.setdefault(text(self._signal, moment), len(self.numbers))
        self.values.append(self._latest)


class Columns:
    """Collects the ends of scans, one after another.

    `text` gives the text of a signal at a moment.  Cells of `watched` note the scans in which they change."""

    def __init__(self, cells: Sequence[Cell], areas: Sequence[Area], text: Callable[[int, Moment], str],
                 watched: frozenset[Cell] = frozenset()) -> None:  # fmt: skip
        self.columns: list[Column] = []
        self.blocks: list[int] = []
        """How many scans each block has."""
        self.first = 0
        self.texts: dict[int, Texts] = {}
        """What there is besides of columns of texts."""
        self.constants: dict[str, dict[int, int]] = {}
        """Words that are not 0 in the first scan, by area and address."""
        self.words: dict[str, dict[int, int]] = {}
        """Columns of words, by area and address."""
        self.streams: list[bytes] = []
        self._wanted, self._text, self._watched = list(dict.fromkeys(cells)), text, watched
        self._areas = [area for area in areas if area.unit_bits == 16 and area.name not in FLAG_AREAS]
        self._area_lines = {line for area in self._areas
                            for line in range(area.offset // LINE, (area.offset + area.size_bytes - 1) // LINE + 1)}
        self._numbers: dict[Cell, int] = {}
        self._at: dict[int, list[int]] = {}
        """Columns by the bytes that they lie in."""
        self._views: list[memoryview] = []
        """The pages of the memory as it is now."""
        self._pages: list[bytearray] = []
        """The pages as they were after the last scan."""
        self._known: dict[int, tuple[bytes, ...]] = {}
        """The lines of those pages that have ever changed."""
        self._lines: dict[int, tuple[bytes, list[int], list[bytes]]] = {}
        """Of each line that changed in this block: what it was before, places of scans in the block, what it was from then on."""
        self._times = array("q")
        self._moved: set[int] = set()
        """The lines that changed in this scan."""

    def __len__(self) -> int:
        """The number of scans."""
        return sum(self.blocks) + len(self._times)

    def number(self, cell: Cell) -> int:
        """The number of the column of a cell."""
        return self._numbers[cell]

    def add(self, moment: Moment) -> None:
        """Takes the end of a scan."""
        if not self._pages:
            self._begin(moment)
        for number in compress(range(len(self._pages)), map(ne, self._pages, self._views)):
            self._page(number)
        for texts in self.texts.values():
            texts.add(moment, self._moved, self._text)
        self._moved.clear()
        self._times.append(moment.now_ns)
        if len(self._times) >= BLOCK_SCANS or len(self._lines) * LINE * len(self._times) > MOST_HELD_BYTES:
            self._end_block()

    def end(self) -> None:
        """Ends the last block."""
        if self._times:
            self._end_block()
        self._views, self._pages, self._known = [], [], {}

    # --- a block --------------------------------------------------------------------------------------------------------

    def _begin(self, moment: Moment) -> None:
        memory = moment.memory.map
        self.first = moment.scans
        self._views = [moment.memory.u8[at:at + PAGE_BYTES] for at in range(0, moment.memory.size, PAGE_BYTES)]
        self._pages = [bytearray(view) for view in self._views]  # comparing one with a view of bytes copies nothing
        self._new_column(Cell("i64", -1), moment.now_ns.to_bytes(8, "little"))
        for cell in self._wanted:
            if cell.code == TEXT:
                number = self._new_column(cell, bytes(4))
                self.texts[number] = Texts(cell, self._text(cell.signal, moment))
            else:
                self._new_column(cell, _element(memory, cell))
        for area in self._areas:
            for at in range(area.offset, area.offset + area.size_bytes, LINE):
                if any(line := memory[at:min(at + LINE, area.offset + area.size_bytes)]):
                    words = memoryview(line).cast("H")
                    self.constants.setdefault(area.name, {}).update(
                        ((at - area.offset) // 2 + number, word) for number, word in enumerate(words) if word)

    def _new_column(self, cell: Cell, initial: bytes) -> int:
        self._numbers[cell] = number = len(self.columns)
        self.columns.append(Column(cell, initial))
        if cell.offset >= 0 and cell.code != TEXT:
            for at in range(cell.offset, cell.offset + SIZES[cell.code]):
                self._at.setdefault(at, []).append(number)
        return number

    def _page(self, number: int) -> None:
        """Notes the lines of a page that are others now."""
        page, place, first = self._pages[number], len(self._times), number * _PAGE_LINES
        before = self._known.get(number) or _SPLIT.unpack(page)
        page[:] = self._views[number]
        self._known[number] = now = _SPLIT.unpack(page)
        for at in compress(range(_PAGE_LINES), map(ne, before, now)):
            line = first + at
            self._moved.add(line)
            known = self._lines.get(line)
            if known is None:
                known = self._lines[line] = (before[at], [], [])
            known[1].append(place)
            known[2].append(now[at])

    def _end_block(self) -> None:
        count = len(self._times)
        touched, lines = {0}, dict[int, _Lines]()
        for number, (before, places, changed) in sorted(self._lines.items()):
            lines[number] = _Lines(before, places, changed, count)
            for at in lines[number].changed() if number in self._area_lines else ():
                self._word(number * LINE + at, before)
            touched.update(*(self._at.get(at, ()) for at in range(number * LINE, (number + 1) * LINE)))
        for number in sorted(touched | set(self.texts)):
            self._end_column(number, self._values(number, lines, count))
        self.blocks.append(count)
        self._times, self._lines = array("q"), {}
        for texts in self.texts.values():
            texts.values = array("I")

    def _word(self, at: int, before: bytes) -> None:
        """Makes a column for the word of an area in which byte `at` lies, if there is none."""
        for area in self._areas:
            if area.offset <= at < area.offset + area.size_bytes:
                address = (at - area.offset) // 2
                known = self.words.setdefault(area.name, {})
                if address not in known:
                    initial = self.constants.get(area.name, {}).get(address, 0)
                    cell = Cell(WORD, area.offset + 2 * address)
                    found = self._numbers.get(cell)
                    known[address] = self._new_column(cell, initial.to_bytes(2, "little")) if found is None else found

    def _values(self, number: int, lines: dict[int, _Lines], count: int) -> bytes:
        """The values of a column in this block, one behind another."""
        cell = self.columns[number].cell
        if number == 0:
            return self._times.tobytes()
        if cell.code == TEXT:
            return self.texts[number].values.tobytes()
        size = SIZES[cell.code]
        if size == 1:
            column = self._bytes(cell.offset, lines, count)
            return column.translate(_bits(cell.bit)) if cell.code == BIT else column
        line = lines.get(cell.offset // LINE)
        if line and cell.offset % size == 0:
            return line.elements(cell.offset % LINE, size)
        made = bytearray(size * count)
        for at in range(size):
            made[at::size] = self._bytes(cell.offset + at, lines, count)
        return bytes(made)

    def _bytes(self, at: int, lines: dict[int, _Lines], count: int) -> bytes:
        """What one byte of the memory was at the ends of these scans."""
        line = lines.get(at // LINE)
        if line:
            return line.column(at % LINE)
        return bytes(self._pages[at // PAGE_BYTES][at % PAGE_BYTES:at % PAGE_BYTES + 1]) * count

    def _end_column(self, number: int, values: bytes) -> None:
        column, block = self.columns[number], len(self.blocks)
        size = SIZES[column.cell.code]
        count = len(values) // size
        first, before = values[:size], column.entries[-1].last if column.entries else column.initial
        if values == first * count:
            if first != before:
                value = _numbers(first, column.cell.code)[0]
                column.entries.append(Entry(block, 0, first, first, value, value))
                self._note(column, [0])
            return
        differences = _differences(values, size, count)
        packer = zlib.compressobj(6, zlib.DEFLATED, -15)
        stream = packer.compress(differences) + packer.flush()
        self.streams.append(stream)
        low, high = _EXTREMES.get(column.cell.code) or _extremes(values, column.cell.code)
        column.entries.append(Entry(block, len(stream), first, values[-size:], low, high))
        if column.cell in self._watched:
            zero = bytes(size)
            moved = (at for at in range(count - 1, 0, -1) if differences[at * size:(at + 1) * size] != zero)
            latest = [at for _, at in zip(range(LATEST_CHANGES), moved, strict=False)]
            self._note(column, [*([0] if first != before else []), *reversed(latest)])

    def _note(self, column: Column, places: list[int]) -> None:
        if column.cell in self._watched:
            start = self.first + sum(self.blocks)
            column.changed = (column.changed + [start + at for at in places])[-LATEST_CHANGES:]

    # --- what has been collected ------------------------------------------------------------------------------------------

    @property
    def varying(self) -> list[int]:
        """The numbers of the columns that have more than one value."""
        return [number for number, column in enumerate(self.columns) if column.entries]

    def index(self) -> bytes:
        """For each varying column and block the length of the stream; then the first values, each in 8 bytes; then the least,
        then the greatest values."""
        lengths, lows, highs = array("I"), array("d"), array("d")
        firsts: list[bytes] = []
        for number in self.varying:
            column = self.columns[number]
            for entry in _filled(column, len(self.blocks)):
                lengths.append(entry.length)
                firsts.append(entry.first.ljust(8, b"\0"))
                lows.append(entry.low)
                highs.append(entry.high)
        return lengths.tobytes() + b"".join(firsts) + lows.tobytes() + highs.tobytes()


class _Lines:
    """A line of memory at the ends of the scans of a block."""

    def __init__(self, before: bytes, places: list[int], lines: list[bytes], count: int) -> None:
        whole = [before] * places[0]
        for line, start, end in zip(lines, places, [*places[1:], count], strict=True):
            whole += [line] * (end - start)
        self._before, self._distinct, self._whole = before, lines, b"".join(whole)

    def changed(self) -> list[int]:
        """The bytes of the line that are not the same all the time."""
        moved, number = 0, int.from_bytes(self._before, "little")
        for line in self._distinct:
            moved |= number ^ int.from_bytes(line, "little")  # a byte that was never another than at first is 0 here
        return [at for at, byte in enumerate(moved.to_bytes(LINE, "little")) if byte]

    def column(self, at: int) -> bytes:
        """What byte `at` was."""
        return self._whole[at::LINE]

    def elements(self, at: int, size: int) -> bytes:
        """What the element of `size` bytes at `at`, a multiple of its size, was."""
        elements: memoryview = memoryview(self._whole).cast(_UNSIGNED[size])  # type: ignore[call-overload]
        return elements[at // size :: LINE // size].tobytes()


def _filled(column: Column, blocks: int) -> Iterator[Entry]:
    """An entry for each block; where there is none, the value stays."""
    found = iter(column.entries)
    following = next(found, None)
    value = column.initial
    for block in range(blocks):
        if following and following.block == block:
            yield following
            value, following = following.last, next(found, None)
        else:
            number = _numbers(value, column.cell.code)[0]
            yield Entry(block, 0, value, value, number, number)


def _element(memory: mmap, cell: Cell) -> bytes:
    """The bytes of a cell; of a bit one byte 0 or 1."""
    found = memory[cell.offset:cell.offset + SIZES[cell.code]]
    return found.translate(_bits(cell.bit)) if cell.code == BIT else found


@cache
def _bits(bit: int | None) -> bytes:
    """A table for `bytes.translate`: 1 where a bit of a byte is set, or where the byte is not 0."""
    return bytes((byte >> bit & 1) if bit is not None else int(byte != 0) for byte in range(256))


@cache
def _signs(size: int, count: int) -> int:
    """The highest bit of each of `count` numbers of `size` bytes."""
    return int.from_bytes((bytes(size - 1) + b"\x80") * count, "little")


def _differences(values: bytes, size: int, count: int) -> bytes:
    """Each number less the one before it, modulo its size; the first one is 0.

    All at once, as one large integer: the highest bits are kept apart, so that no number borrows from the next one."""
    signs = _signs(size, count)
    number = int.from_bytes(values, "little")
    before = int.from_bytes(values[:size] + values[:-size], "little")
    rest = (number | signs) - (before & ~signs)
    return (rest ^ (number ^ before ^ signs) & signs).to_bytes(size * count, "little")


def _numbers(values: bytes, code: str) -> list[float]:
    """The numbers of a column."""
    return memoryview(values).cast(_LETTERS[code]).tolist()  # type: ignore[call-overload,no-any-return]


def _extremes(values: bytes, code: str) -> tuple[float, float]:
    """The least and the greatest of some numbers, infinities and what is no number left out."""
    numbers = sorted(_numbers(values, code))  # most go up and down in long runs, which is quicker than a look for each end
    low, high = numbers[0], numbers[-1]
    if code in ("f32", "f64") and not all(map(isfinite, numbers)):
        finite = [number for number in numbers if isfinite(number)] or [0.0]
        return min(finite), max(finite)
    return low, high
