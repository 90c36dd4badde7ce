"""Recordings as CSV, and CSV as a trace: one row a scan, one column a variable.

    scan,time_ms,Main.Start,Main.Delay.ET [ms],D200
    0,0,FALSE,0,7

BOOL is TRUE or FALSE, times are numbers of milliseconds in a column that says so, enumerations are their members' names.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Any, BinaryIO, TextIO

from fbvm.base.areas import SLOTS_OFFSET, AddressError, parse_address
from fbvm.base.arithmetic import shortest
from fbvm.base.types import BOOL, LINT, LREAL, REAL, TIME, EnumType, Field, StructType, Type, base, fold, string
from fbvm.code.image import Image, Layout
from fbvm.plc import Plc
from fbvm.record.recorder import Recording, Signal
from fbvm.record.trace_writer import TraceWriter
from fbvm.watch.values import Value

SCAN, TIME_MS = "scan", "time_ms"
MS = " [ms]"
DURATIONS = frozenset(("TIME", "LTIME"))
LONGEST_TEXT = 254
_NAME = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*")
_INTEGER = re.compile(r"[+-]?\d+")
_NUMBER = re.compile(r"[+-]?\d+(\.\d*)?([eE][+-]?\d+)?")


class RowsError(ValueError):
    """The text is no such table; the message names the line."""


# --- out --------------------------------------------------------------------------------------------------------------


def write_rows(recording: Recording, file: TextIO) -> None:
    """Writes a recording; open the file with `newline=""`."""
    writer = csv.writer(file, lineterminator="\n")
    signals = [track.signal for track in recording.tracks]
    writer.writerow([SCAN, TIME_MS, *(_heading(signal) for signal in signals)])
    columns = [track.values(recording.scans) for track in recording.tracks]
    for scan, now_ns, *values in zip(recording.scans, recording.times_ns, *columns, strict=True):
        cells = [_cell(signal, value) for signal, value in zip(signals, values, strict=True)]
        writer.writerow([scan, _milliseconds(now_ns), *cells])


def _is_duration(signal: Signal) -> bool:
    return base(signal.place.type).name in DURATIONS


def _heading(signal: Signal) -> str:
    return signal.place.name + (MS if _is_duration(signal) else "")


def _cell(signal: Signal, value: Value) -> str:
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    if _is_duration(signal) and isinstance(value, int):
        return _milliseconds(value)
    if isinstance(base(signal.place.type), EnumType):
        return signal.text(value)
    if isinstance(value, float):
        return repr(shortest(value) if base(signal.place.type) is REAL else value)
    return "" if value is None else str(value)


def _milliseconds(time_ns: int) -> str:
    text = f"{Decimal(time_ns).scaleb(-6):f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


# --- in ---------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Column:
    """A variable of a table: its path or address, its type, and how a cell is read."""

    name: str
    type: Type
    read: Callable[[str], Any]


def read_rows(file: TextIO, out: BinaryIO) -> int:
    """Writes a trace of the scans that a table describes; returns how many.  Raises RowsError."""
    rows = list(csv.reader(file))
    if not rows or rows[0][:2] != [SCAN, TIME_MS]:
        raise RowsError(f"line 1: the first two columns are {SCAN} and {TIME_MS}")
    for number, row in enumerate(rows[1:], 2):
        if len(row) != len(rows[0]):
            raise RowsError(f"line {number}: {len(row)} cells, {len(rows[0])} expected")
    columns = [_column(name, [row[at] for row in rows[1:]]) for at, name in enumerate(rows[0][2:], 2)]
    plc = Plc(_image(columns), engine="python")
    writer = TraceWriter(plc, out, selected=[column.name for column in columns])
    for number, row in enumerate(rows[1:], 2):
        try:
            plc.scans = int(row[0])
            for column, cell in zip(columns, row[2:], strict=True):
                if cell:
                    plc.write(column.name, column.read(cell))
            plc.scan(_nanoseconds(row[1]))
        except (ValueError, TypeError, ArithmeticError) as error:
            raise RowsError(f"line {number}: {error}") from None
    writer.close()
    return len(rows) - 1


def _nanoseconds(text: str) -> int:
    return int(Decimal(text).scaleb(6))


def _column(heading: str, cells: Sequence[str]) -> Column:
    """The variable of a column; its type is the narrowest that all cells fit."""
    filled = [cell for cell in cells if cell]
    if heading.endswith(MS):
        return Column(heading.removesuffix(MS), TIME, _nanoseconds)
    if all(cell in ("TRUE", "FALSE") for cell in filled):
        return Column(heading, BOOL, lambda cell: cell == "TRUE")
    if all(_INTEGER.fullmatch(cell) for cell in filled):
        return Column(heading, LINT, int)
    if all(_NUMBER.fullmatch(cell) or cell in ("nan", "inf", "-inf") for cell in filled):
        return Column(heading, LREAL, float)
    return Column(heading, string(min(LONGEST_TEXT, max(map(len, filled), default=1))), str)


def _image(columns: Iterable[Column]) -> Image:
    """A program without code that has these variables."""
    tree: dict[str, Any] = {}
    for column in columns:
        if _is_address(column.name):
            continue
        if not _NAME.fullmatch(column.name):
            raise RowsError(f"line 1: {column.name!r} is neither a path of names nor an address")
        *scopes, name = column.name.split(".")
        inner = tree
        for scope in scopes:
            inner = inner.setdefault(scope, {})
            if not isinstance(inner, dict):
                raise RowsError(f"line 1: {scope} is a variable and has members")
        if name in inner:
            raise RowsError(f"line 1: {column.name} stands there twice")
        inner[name] = column.type
    symbols, at = {}, SLOTS_OFFSET
    for name, what in tree.items():
        kind = _type(name, what)
        at += -at % kind.align
        symbols[fold(name)] = Field(name, kind, at, absolute=True)
        at += kind.size
    return Image(Layout(at - SLOTS_OFFSET), (), (), symbols, (), (), ())


def _is_address(name: str) -> bool:
    try:
        parse_address(name)
    except AddressError:
        return False
    return True


def _type(name: str, what: Any) -> Type:
    if not isinstance(what, dict):
        assert isinstance(what, Type)
        return what
    fields, at = {}, 0
    for inner, part in what.items():
        kind = _type(inner, part)
        at += -at % kind.align
        fields[fold(inner)] = Field(inner, kind, at)
        at += kind.size
    return StructType(name, at + -at % 8, 8, fields)
