"""The build that writes down what it does: bodies append numbers and values to one list, `observations` makes sense of it.

A number is a row of a static table: which observation it is, and where.  Behind it stand only the things that the table cannot
know: an address with subscripts, what was stored, the state of a contact.  Every store is in the list, observed or not, so that
whoever reads it from the memory before has the memory of each moment.  Numbers that follow one another are appended at once,
which is why this build takes some twice the time of the plain one, and not twenty times."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from typing import Any, NamedTuple

from fbvm.base.memory import WHOLE_BYTES, Memory, compare
from fbvm.code.image import Body, Image
from fbvm.code.operations import Address, Node, detail_size
from fbvm.engine.effects import STORES, Effects
from fbvm.engine.observation import NO_SITE, Observation
from fbvm.engine.python.observed import ObservedWriter, names_bit
from fbvm.engine.python.writer import bare
from fbvm.engine.ranges import may_trap

ABSOLUTE, OWN, TOLD = range(3)
"""Where the bytes of a row lie: at a byte of the memory, at a byte of the instance, or at the byte that stands in the list."""
BIT_TOLD = -1
"""In place of a bit: it stands in the list."""
SILENT = ""
"""The kind of a store that nobody observes."""
MOST_ENTRIES = 4_000_000
"""Entries of the list at which a run gives up, and is done again by the build that stands still: they take 32 MB and more."""
VIEWS = {1: "u8", 2: "u16", 4: "u32", 8: "u64"}
"""By size the view of an item whose value stands in the list as a number."""
ENDLESS = 1 << 62
_SHIFTS = {1: 0, 2: 1, 4: 2, 8: 3}


class Row(NamedTuple):
    """What a number of the list means.  `seen` is the observation, if it is always the same.

    `detail` is the type of what is read or written, the number of the body that is called, or the element of a contact.  `stored`
    is the size of an item that was stored as a number, 0 for bytes; None if nothing was stored."""

    kind: str
    site: int
    detail: Any
    where: int = ABSOLUTE
    offset: int = 0
    bit: int = WHOLE_BYTES
    stored: int | None = None
    seen: Observation | None = None


class Full(Exception):
    """The list has become too long."""


class LoggedWriter(ObservedWriter):
    """Writes one body that tells what it does.  `table` gets its rows."""

    def __init__(self, image: Image, constants: dict[str, Any], effects: Effects, table: list[Row]) -> None:
        super().__init__(image, constants, effects)
        self.table = table
        self._waiting: list[str] = []
        self._aligned: Address | None = None

    def store(self, node: Node, told: bool) -> None:
        address, size = STORES[node[0]](node)
        self._aligned = address if node[0] == "store" and not isinstance(address[0], tuple) else None
        super().store(node, told)
        if not told:
            self._stored(SILENT, NO_SITE, None, address, WHOLE_BYTES, size)

    def line(self, text: str) -> None:
        self.flush()
        super().line(text)

    def flush(self) -> None:
        waiting, self._waiting = self._waiting, []
        if waiting:
            super().line(f"note({waiting[0]})" if len(waiting) == 1 else f"notes(({', '.join(waiting)}))")

    def begin_pass(self) -> None:
        self.line("if len(entries) > longest: full()")

    def call_body(self, pou: int, address: Address | None, place: str) -> None:
        where, offset = self._static(address) if address else (ABSOLUTE, 0)
        if where == TOLD:
            name = self.name("v")
            self.line(f"{name} = {place}")
            place = name
        self._note(Row("call", self.site, pou, where, offset), *[place] * (where == TOLD))
        self.line(f"{self.function(pou)}({place})")
        self._note(Row("return", self.site, pou))

    def attempt_body(self, pou: int, place: str, number: str) -> None:
        self.line(f"{self.function(pou)}({place})")
        self.line(f"{number} = 0")

    def after_stop(self, number: str, traps: bool) -> None:
        self.line(f"{number}, _, ended = caught(stopped, {traps})")
        self.line(f"notes([{len(self.table)}] * len(ended))")
        self.table.append(Row("return", self.site, None))

    def observe(self, kind: str, site: int, detail: Any) -> None:
        if kind == "contact":
            element, value = detail
            if may_trap(value):
                self.flush()
            self._note(Row(kind, site, element), bare(self.value(value)))
        elif kind == "write":
            form, address, bit = detail
            size = detail_size(form) if bit == WHOLE_BYTES else 1
            self._stored(kind, site, form, address, bit, size)
        elif kind == "read":
            form, address, bit = detail
            where, offset, told = self._place(address)
            self._note(Row(kind, site, form, where, offset, *self._bit(form, address, bit, told)), *told)
        else:
            self._note(Row(kind, site, detail))

    def _stored(self, kind: str, site: int, form: Any, address: Address, bit: int, size: int) -> None:
        """Notes a store with its value, as the memory has it now."""
        where, offset, told = self._place(address)
        start = told[0].partition(" := ")[0].lstrip("(") if where == TOLD else f"b1 + {offset}" if where == OWN else str(offset)
        bits = self._bit(form, address, bit, told)
        if size in VIEWS and (size == 1 or address == self._aligned):
            index = start if size == 1 else f"{start} >> {_SHIFTS[size]}"
            simple = size > 1 and where != TOLD
            value, stored = self.item(address, VIEWS[size]) if simple else f"{VIEWS[size]}[{bare(index)}]", size
        else:
            end = str(offset + size) if where == ABSOLUTE else f"b1 + {offset + size}" if where == OWN else f"{start} + {size}"
            value, stored = f"buffer[{start}:{end}]", 0
        self._note(Row(kind, site, form, where, offset, *bits, stored), *told, value)

    def _static(self, address: Address) -> tuple[int, int]:
        """Where an address lies, as far as is known here, and its offset there."""
        base, offset, terms = self.known(address)
        return (TOLD, 0) if terms or isinstance(base, tuple) else (OWN if base == "self" else ABSOLUTE, offset)

    def _place(self, address: Address) -> tuple[int, int, list[str]]:
        """Where an address lies, its offset there, and what has to be told about it."""
        where, offset = self._static(address)
        if where != TOLD:
            return where, offset, []
        if may_trap(address):
            self.flush()
        return where, offset, [f"({self.name('v')} := {bare(self.place(address, 1))})"]

    def _bit(self, form: Any, address: Address, bit: int, told: list[str]) -> tuple[int]:
        if not names_bit(form, address, bit):
            return (bit,)
        told.append(f"{bare(self.value(address[0][1]))} & {WHOLE_BYTES}")
        return (BIT_TOLD,)

    def _note(self, row: Row, *told: str) -> None:
        """Has a row written at the next line, with what stands behind its number."""
        self._waiting += [str(len(self.table)), *told]
        self.table.append(row._replace(seen=_ready(row)))


def _ready(row: Row) -> Observation | None:
    """The observation of a row, if it is always the same."""
    if row.kind in ("contact", "call", "return", SILENT) or row.where != ABSOLUTE or row.bit == BIT_TOLD:
        return None
    return Observation(row.kind, row.site, (row.detail, row.offset, row.bit) if row.kind in ("read", "write") else row.detail)


class _Stored(NamedTuple):
    """A row that stores a number at a known item of a view; `seen` is None if nobody observes it."""

    view: memoryview
    item: int
    seen: Observation | None


class Log:
    """The list of one engine, and the memory that it is about.  `names` are what generated code finds it by."""

    def __init__(self, memory: Memory, table: Sequence[Row]) -> None:
        self._memory = memory
        self._items = {size: memory.views[view] for size, view in VIEWS.items()}
        rows = [*table, Row("call", NO_SITE, None, TOLD), Row("return", NO_SITE, None),
                Row("write", NO_SITE, None, TOLD, stored=0), Row(SILENT, NO_SITE, None, TOLD, stored=0)]
        self._table = [self._bound(row) for row in rows]
        self._call, self._return, self._write, self._silent = range(len(table), len(rows))
        self.entries: list[Any] = []
        self.names: dict[str, Any] = {
            "entries": self.entries, "note": self.entries.append, "notes": self.entries.extend, "full": self._full,
            "longest": MOST_ENTRIES}  # fmt: skip
        self.most = 0
        """Entries at which a loop gives up; 0 if nobody wants the list, which is emptied instead."""

    def _bound(self, row: Row) -> Observation | _Stored | Row:
        """A row as `observations` reads it fastest."""
        if row.stored and row.where == ABSOLUTE and (row.seen or row.kind == SILENT):
            return _Stored(self._items[row.stored], row.offset >> _SHIFTS[row.stored], row.seen)
        return row.seen if row.seen and row.stored is None else row

    def _full(self) -> None:
        """Called by loops when the list is long."""
        if not self.most:
            self.entries.clear()
        elif len(self.entries) > self.most:
            raise Full

    def begin(self, body: int, base: int) -> None:
        """Notes that a program begins."""
        self.entries += self._call, base, body

    def end(self) -> None:
        """Notes that a program has ended."""
        self.entries.append(self._return)

    def reporting(self, function: Callable[[int], None], body: Body) -> Callable[[int], None]:
        """A Python function in place of a body: one write of the whole instance, and what else it has changed in the memory."""
        memory, size = self._memory, body.instance_size

        def noted(base: int) -> None:
            before = memory.snapshot()
            function(base)
            for offset, count in compare(before, memory.snapshot()):
                self.entries += self._silent, offset, memory.map[offset : offset + count]
            self.entries += self._write, base, ("", size), memory.map[base : base + size]

        return noted

    def observations(self) -> Generator[Observation, None, None]:
        """The observations of the last run.

        The memory must be as it was before that run.  At each observation it is as it was at that moment, but for the system
        page."""
        bases: list[int] = []
        called: list[tuple[int, int]] = []
        left = iter(self.entries)
        table = self._table
        for number in left:
            row = table[number]
            if row.__class__ is Observation:
                yield row
            elif row.__class__ is _Stored:
                view, item, seen = row
                view[item] = next(left)
                if seen:
                    yield seen
            elif row.kind == "call":
                body, base = _called(row, left, bases)
                bases.append(base)
                called.append((body, base))
                yield Observation("call", row.site, (body, base))
            elif row.kind == "return":
                bases.pop()
                yield Observation("return", row.site, called.pop())
            elif row.kind == "contact":
                yield Observation("contact", row.site, (row.detail, next(left)))
            else:
                seen = self._accessed(row, left, bases)
                if seen:
                    yield seen

    def _accessed(self, row: Row, left: Iterator[Any], bases: list[int]) -> Observation | None:
        """The observation of a read or write, whose value is stored; None for a store that nobody observes."""
        kind, site, detail, where, offset, bit, stored, _ = row
        if where != ABSOLUTE:
            offset = next(left) if where == TOLD else offset + bases[-1]
        if bit == BIT_TOLD:
            bit = next(left)
        if kind == "write" and detail is None:
            detail = next(left)
        if stored:
            self._items[stored][offset >> _SHIFTS[stored]] = next(left)
        elif stored == 0:
            value = next(left)
            self._memory.u8[offset : offset + len(value)] = value
        return Observation(kind, site, (detail, offset, bit)) if kind else None


def _called(row: Row, left: Iterator[Any], bases: list[int]) -> tuple[int, int]:
    """The body that is called, and where its instance begins."""
    base = next(left) if row.where == TOLD else row.offset + bases[-1] if row.where == OWN else row.offset
    return (next(left) if row.detail is None else row.detail), base
