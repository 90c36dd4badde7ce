"""Makes a trace of a CSV table, as `csv_writer` or another program writes it."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Any, BinaryIO, TextIO, TypeAlias

from fbvm.base.areas import SLOTS_OFFSET, AddressError, parse_address
from fbvm.base.digits import whole_number
from fbvm.base.types import BOOL, LINT, LREAL, TIME, ULINT, Field, StringType, StructType, Type, array, fold, string
from fbvm.check.symbols.size_limits import MAX_SIZE
from fbvm.code.image import Image, Layout
from fbvm.machine.plc import Plc
from fbvm.record.trace.csv_writer import MS, SCAN, TIME_MS
from fbvm.record.trace.writer import TraceWriter

LONGEST_TEXT = 254
_PATH = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*|\[-?\d+(, ?-?\d+)*\])*")
_STEP = re.compile(r"(\w+)|\[([^\]]+)\]")
_SUBSCRIPTS = re.compile(r"\[[-\d, ]*\]")
_INTEGER = re.compile(r"[+-]?\d+")
_NUMBER = re.compile(r"[+-]?\d+(\.\d*)?([eE][+-]?\d+)?")
Step = str | tuple[int, ...]
"""The name of a member, or subscripts."""
Parts: TypeAlias = "dict[Step, Parts | Type]"
"""The members or the elements of a variable."""


class CsvError(ValueError):
    """The text is no table of scans; the message names the line."""


@dataclass(frozen=True)
class Column:
    """A variable of a table: its path or address, its type, and the function that reads a cell."""

    name: str
    type: Type
    read: Callable[[str], Any]


def read_csv(file: TextIO, out: BinaryIO) -> int:
    """Writes a trace with the scans of a CSV table to `out`; returns the number of scans.  Raises CsvError.

    Scans follow one another, as in every trace.  An empty cell is the empty text, and leaves other values as they are."""
    table = csv.reader(file)
    rows, line = [], 1
    try:
        for row in table:
            rows += [(line, row)] if row else []
            line = table.line_num + 1
    except csv.Error as error:
        raise CsvError(f"line {table.line_num}: {error}") from None
    headings = rows.pop(0)[1] if rows else []
    if headings[:2] != [SCAN, TIME_MS]:
        raise CsvError(f"line 1: the first two columns are {SCAN} and {TIME_MS}")
    for number, row in rows:
        if len(row) != len(headings):
            raise CsvError(f"line {number}: {len(row)} cells, {len(headings)} expected")
    columns = _columns(headings, [row for _, row in rows])
    plc = Plc(_image(columns), engine="python")
    writer = TraceWriter(plc, out, selected=[column.name for column in columns])
    for number, row in rows:
        try:
            scan = _scan(row[0])
            if number != rows[0][0] and scan != plc.scans:
                raise ValueError(f"scan {scan} stands where scan {plc.scans} belongs")
            plc.scans = scan
            for column, cell in zip(columns, row[2:], strict=True):
                if cell or isinstance(column.type, StringType):
                    plc.write(column.name, column.read(cell))
            plc.scan(_nanoseconds(row[1]))
        except (ValueError, TypeError, ArithmeticError) as error:
            raise CsvError(f"line {number}: {error}") from None
    writer.close()
    return len(rows)


def _scan(text: str) -> int:
    if not _INTEGER.fullmatch(text) or not 0 <= (number := whole_number(text)) < LINT.high:
        raise ValueError(f"{text!r} is no number of a scan")
    return number


def _nanoseconds(text: str) -> int:
    """The nanoseconds of a number of milliseconds.  Raises ValueError."""
    if not _NUMBER.fullmatch(text):
        raise ValueError(f"{text!r} is no number of milliseconds")
    try:
        value = Decimal(text).scaleb(6)
    except ArithmeticError:
        value = Decimal("inf")
    if abs(value) >= 1 << 63:
        raise ValueError(f"{text} ms are more than 64 bits of nanoseconds hold")
    return int(value)


def _columns(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> list[Column]:
    """The variables; elements of one array are of one type."""
    alike = [_SUBSCRIPTS.sub("[]", heading) for heading in headings[2:]]
    cells: dict[str, list[str]] = {}
    for at, name in enumerate(alike, 2):
        cells.setdefault(name, []).extend(row[at] for row in rows if row[at])
    kinds = {name: _kind(name, filled) for name, filled in cells.items()}
    return [Column(heading.removesuffix(MS), *kinds[name]) for heading, name in zip(headings[2:], alike, strict=True)]


def _kind(heading: str, cells: Sequence[str]) -> tuple[Type, Callable[[str], Any]]:
    """The narrowest type that holds all cells of a column, and the function that reads one."""
    if heading.endswith(MS):
        return TIME, _nanoseconds
    if all(cell in ("TRUE", "FALSE") for cell in cells):
        return BOOL, lambda cell: cell == "TRUE"
    if all(_INTEGER.fullmatch(cell) for cell in cells):
        return (ULINT if any(whole_number(cell) > LINT.high for cell in cells) else LINT), whole_number
    if all(_NUMBER.fullmatch(cell) or cell in ("nan", "inf", "-inf") for cell in cells):
        return LREAL, float
    return string(min(LONGEST_TEXT, max(map(len, cells), default=1))), str


def _image(columns: Iterable[Column]) -> Image:
    """The image of a program without code that declares these variables."""
    tree: Parts = {}
    addresses: set[str] = set()
    spelled: dict[tuple[str, ...], str] = {}
    for column in columns:
        address = _address(column.name)
        if not address:
            _insert(tree, column, spelled)
        elif address in addresses:
            raise CsvError(f"line 1: {column.name} stands there twice")
        addresses.add(address)
    symbols, at = {}, SLOTS_OFFSET
    for name, what in tree.items():
        kind = _type(str(name), what)
        at += -at % kind.align
        symbols[fold(str(name))] = Field(str(name), kind, at, absolute=True)
        at += kind.size
    return Image(Layout(at - SLOTS_OFFSET), (), (), symbols, (), (), ())


def _address(name: str) -> str:
    """The address that a column names, as it is usually written; "" if it names none."""
    try:
        return str(parse_address(name))
    except AddressError:
        return ""


def _insert(tree: Parts, column: Column, spelled: dict[tuple[str, ...], str]) -> None:
    """Adds a variable to the tree of all variables; `spelled` are the names at the ends of paths as they stood there first."""
    if not _PATH.fullmatch(column.name):
        raise CsvError(f"line 1: {column.name!r} is neither a path of names nor an address")
    steps: list[Step] = [name or tuple(map(int, subscripts.split(","))) for name, subscripts in _STEP.findall(column.name)]
    inner, owner = tree, ""
    path: tuple[str, ...] = ()
    for number, step in enumerate(steps):
        if inner and type(step) is not type(next(iter(inner))):
            raise CsvError(f"line 1: {owner} has elements and members")
        owner = step if isinstance(step, str) else owner
        path = (*path, fold(step) if isinstance(step, str) else "[]")
        step = spelled.setdefault(path, step) if isinstance(step, str) else step
        if number == len(steps) - 1:
            if step in inner:
                raise CsvError(f"line 1: {column.name} stands there twice")
            inner[step] = column.type
            return
        below = inner.setdefault(step, {})
        if isinstance(below, Type):
            raise CsvError(f"line 1: {owner} is a variable and has members")
        inner = below


def _type(name: str, what: Parts | Type) -> Type:
    """The type of a variable with these members or elements."""
    if isinstance(what, Type):
        return what
    subscripts = [step for step in what if isinstance(step, tuple)]
    if subscripts:
        if len({len(one) for one in subscripts}) > 1:
            raise CsvError(f"line 1: the elements of {name} differ")
        bounds = tuple((min(along), max(along)) for along in zip(*subscripts, strict=True))
        kind = array(bounds, _type(name, _merged(name, list(what.values()))))
        if kind.size > MAX_SIZE:
            raise CsvError(f"line 1: {name} has {kind.count} elements, and no memory holds them")
        return kind
    fields, at = {}, 0
    for inner, part in what.items():
        kind_of = _type(str(inner), part)
        at += -at % kind_of.align
        fields[fold(str(inner))] = Field(str(inner), kind_of, at)
        at += kind_of.size
    return StructType(name, at + -at % 8, 8, fields)


def _merged(name: str, elements: list[Parts | Type]) -> Parts | Type:
    """The members of the element type of an array: those of all its elements."""
    first, *more = elements
    for other in more:
        if isinstance(first, Type) or isinstance(other, Type):
            if first != other:
                raise CsvError(f"line 1: the elements of {name} differ")
            continue
        first = {step: _merged(name, [part[step] for part in (first, other) if step in part]) for step in (*first, *other)}
    return first
