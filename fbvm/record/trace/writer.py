"""Writes a trace while a PLC runs: the memory at the end of each scan, and events inside the scan to a chosen depth."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import astuple
from enum import Enum
from typing import Any, BinaryIO

from fbvm.base.areas import AREAS
from fbvm.code.image import Image
from fbvm.machine.plc import Phase, Plc
from fbvm.record.trace import results, symbols
from fbvm.record.trace.events import Call, Contact, Cut, Event, Frame, Read, Return, Statement, Write
from fbvm.record.trace.format import (
    BLOCK,
    CONTACT,
    CUT,
    END,
    FRAME,
    HEADER,
    LINE,
    MAGIC,
    NETWORK,
    PHASE,
    PHASES,
    READ,
    SCAN,
    STATEMENT,
    WRITE,
    put,
    write_chunk,
    xor,
)
from fbvm.record.trace.observing import observing
from fbvm.record.trace.outline import outer_statements
from fbvm.record.trace.packets import add_tap
from fbvm.record.trace.selection import select
from fbvm.wire.tap import TapEvent

FORMAT = 1
BLOCK_SCANS = 100
BLOCK_BYTES = 1 << 18
"""The number of scans, or bytes, at which a block is written."""
PIECE, PART = 4096, 512
"""Bytes that are compared at once; of a piece that differs, parts of PART bytes are compared."""
START = AREAS["CF"].offset // LINE * LINE
"""The first byte that is recorded; the system page before it is not."""


class Depth(Enum):
    """What a trace holds.  SCANS: memory at the end of each scan; WRITES: also every write; STATEMENTS: also every statement,
    call and read."""

    SCANS = "scans"
    WRITES = "writes"
    STATEMENTS = "statements"


MOST_EVENTS = 60_000
"""About so many events inside a task are recorded, and how the memory is at its end: of a loop of two million statements nobody
looks at more, and it would take half a minute to write, and again to read."""


class TraceWriter:
    """Records `plc` into `file`, a binary file, from its next scan until `close`.

    `depth` says what is recorded.  `selected` are paths, patterns, addresses and ranges (`Main.*.Q`, `D200..D299`); without
    them all memory is recorded.  `lines` are source lines by file and line number, which readers show.  Raises UnknownPlace
    for a pattern without a match.

        with open("run.fbtrace", "wb") as file:
            writer = TraceWriter(plc, file, Depth.STATEMENTS)
            plc.run(scans=100)
            writer.close()
    """

    def __init__(
        self, plc: Plc, file: BinaryIO, depth: Depth = Depth.SCANS, selected: Sequence[str] = (),
        lines: Mapping[str, Mapping[int, str]] | None = None,
    ) -> None:  # fmt: skip
        self._plc, self._file, self.depth = plc, file, depth
        selection = select(plc.image.symbols, plc.memory.areas, selected)
        self._selection = selection
        size = plc.memory.size
        self._pieces = [at for start, end in selection.extents(START, size, LINE) for at in range(start, end, PIECE)]
        self._ends = [min(at + PIECE, end) for start, end in selection.extents(START, size, LINE)
                      for at in range(start, end, PIECE)]  # fmt: skip
        self._shadow = [bytes(end - at) for at, end in zip(self._pieces, self._ends, strict=True)]
        self._out = bytearray()
        self._first = self._scans = self._last = self._last_ns = 0
        self._open = False
        self._frames: dict[Frame, int] = {}
        self._heads: dict[tuple[int, int, tuple[int, ...]], bytes] = {}
        self._notes: dict[type, Callable[[Any], None]] = {Write: self._note_write, Cut: self._note_cut}
        if depth is Depth.STATEMENTS:
            self._notes |= {Statement: self._note_statement, Read: self._note_read, Call: self._note_began,
                            Return: self._note_ended, Contact: self._note_contact}  # fmt: skip
        self.size_bytes = len(MAGIC)
        file.write(MAGIC)
        head = json.dumps(description(plc, depth, selected, lines or {}), separators=(",", ":"))
        self.size_bytes += write_chunk(file, HEADER, head.encode())
        deque(self._changed(), 0)
        self._attached = ExitStack()
        if depth is not Depth.SCANS:
            self._attached.enter_context(observing(plc, self, most=MOST_EVENTS))
        plc.watchers.append(self._scan_ended)
        self._attached.callback(plc.watchers.remove, self._scan_ended)
        self._tapped: list[tuple[int, TapEvent]] = []
        for network in {id(attached.network): attached.network for attached in plc.units}.values():
            self._attached.callback(setattr, network, "tap", add_tap(network, self._tap))

    def close(self) -> None:
        """Ends the recording and writes the last block; the file stays open."""
        self._attached.close()
        self.flush()

    def flush(self) -> None:
        """Writes the scans that are still in memory, so that a reader sees them."""
        if self._scans:
            self.size_bytes += write_chunk(self._file, BLOCK, bytes(self._out), self._first, self._scans)
        self._out.clear()
        self._scans = 0

    # --- called by the PLC

    def phase(self, plc: Plc, phase: Phase) -> None:
        """Called at the end of a phase."""
        if phase is not Phase.REFRESH:
            self._begin(plc.scans)
            self._changes(phase)

    def _tap(self, now_ns: int, unit: str, event: TapEvent) -> None:
        """Keeps an event of the network at a unit of this PLC until the end of the scan."""
        if any(attached.unit.address == unit for attached in self._plc.units):
            self._tapped.append((now_ns, event))

    def _scan_ended(self, plc: Plc) -> None:
        self._begin(plc.scans - 1)
        for tapped in self._tapped:
            text = json.dumps(_row(*tapped), separators=(",", ":")).encode()
            put(self._out, NETWORK, len(text))
            self._out += text
        self._tapped.clear()
        self._changes(Phase.REFRESH)
        self._open = False
        if self._scans >= BLOCK_SCANS or len(self._out) > BLOCK_BYTES:
            self.flush()

    def _begin(self, scan: int) -> None:
        if self._open:
            return
        if scan < self._last:
            self.flush()
        if not self._scans:
            self._first, self._last, self._last_ns = scan, 0, 0
            self._lines(self._whole())
        put(self._out, SCAN, scan - self._last, self._plc.now_ns - self._last_ns)
        self._last, self._last_ns = scan, self._plc.now_ns
        self._scans += 1
        self._open = True
        self._frames.clear()

    def _changes(self, phase: Phase) -> None:
        put(self._out, PHASE, PHASES.index(phase))
        self._lines(self._changed())

    def _lines(self, lines: Iterator[tuple[int, bytes]]) -> None:
        rows, last = list(lines), 0
        put(self._out, len(rows))
        for number, data in rows:
            put(self._out, number - last)
            self._out += data
            last = number

    def _changed(self) -> Iterator[tuple[int, bytes]]:
        """The lines of memory that have changed since the last call: number, old xor new."""
        buffer, shadow = self._plc.memory.map, self._shadow
        for number, (at, end) in enumerate(zip(self._pieces, self._ends, strict=True)):
            now, old = buffer[at:end], shadow[number]
            if now != old:
                shadow[number] = now
                yield from _different(at, now, old)

    def _whole(self) -> Iterator[tuple[int, bytes]]:
        """The lines of memory that are not zero."""
        for at, known in zip(self._pieces, self._shadow, strict=True):
            if any(known):
                yield from _different(at, known, bytes(len(known)))

    # --- events

    def event(self, plc: Plc, event: Event) -> None:
        """Called for each event."""
        note = self._notes.get(type(event))
        if note is not None:
            note(event)

    def _note_statement(self, event: Statement) -> None:
        self._head(STATEMENT, event.frame, event.site)

    def _note_began(self, event: Call) -> None:
        self._frame(event.frame)

    def _note_ended(self, event: Return) -> None:
        self._head(END, event.frame)

    def _note_read(self, event: Read) -> None:
        _, frame, offset, bit, value = event
        if self._selection.everything or self._selection.covers(offset, len(value), bit):
            self._head(READ, frame, event.site + 1, offset, bit, len(value))
            self._out += value

    def _note_write(self, event: Write) -> None:
        _, frame, offset, bit, old, value = event
        if self._selection.everything or self._selection.covers(offset, len(value), bit):
            self._head(WRITE, frame, event.site + 1, offset, bit, len(value))
            self._out += old
            self._out += value

    def _note_cut(self, event: Cut) -> None:
        put(self._out, CUT)

    def _note_contact(self, event: Contact) -> None:
        text = json.dumps(event.element).encode()
        self._head(CONTACT, event.frame, event.site, int(event.value), len(text))
        self._out += text

    def _head(self, tag: int, frame: Frame, *numbers: int) -> None:
        """Writes tag, frame and numbers; the bytes are kept, since most of them are the same in the next scan."""
        key = (tag, self._frames[frame] if frame in self._frames else self._frame(frame), numbers)
        head = self._heads.get(key)
        if head is None:
            made = bytearray()
            put(made, tag, key[1], *numbers)
            head = self._heads[key] = bytes(made)
        self._out += head

    def _frame(self, frame: Frame) -> int:
        """The number of a frame, which is written at its first event."""
        number = self._frames.get(frame)
        if number is None:
            caller = frame.caller
            above = self._frame(caller) + 1 if caller is not None and caller.caller is not None else 0
            number = self._frames[frame] = len(self._frames)
            put(self._out, FRAME, frame.body, frame.base, frame.site + 1, above)
        return number


def _row(now_ns: int, event: TapEvent) -> list[object]:
    local, remote = event.local, event.remote
    return [now_ns, event.kind.value, local.host, local.port, remote.host, remote.port, int(event.out), int(event.mirrored),
            event.data.hex()]  # fmt: skip


def _different(start: int, now: bytes, old: bytes) -> Iterator[tuple[int, bytes]]:
    """The lines of a piece that differ."""
    for part in range(0, len(now), PART):
        if now[part : part + PART] == old[part : part + PART]:
            continue
        for at in range(part, min(part + PART, len(now)), LINE):
            if now[at : at + LINE] != old[at : at + LINE]:
                yield (start + at) // LINE, xor(now[at : at + LINE], old[at : at + LINE])


def description(plc: Plc, depth: Depth, selected: Sequence[str], lines: Mapping[str, Mapping[int, str]]) -> dict[str, Any]:
    """What readers have to know of a PLC and its program, as plain data (`trace.description`)."""
    image = plc.image
    files = sorted({site.file for site in image.sites})
    known = {address: {str(value): text for value, text in rows.items()} for address, rows in meanings(plc).items()}
    return {
        "format": FORMAT, "image": image.fingerprint, "cycle_ns": plc.cycle_ns, "depth": depth.value,
        "selected": list(selected), "slots": image.layout.slots_size, "e_banks": image.layout.e_banks,
        "heap": image.layout.heap_bytes,
        "mailboxes": [astuple(box) for box in image.layout.mailboxes], "sized": image.layout.sized,
        **symbols.to_data(image.symbols), "objects": image.objects.extents,
        "files": files, "sites": [[files.index(s.file), s.pou, s.line, s.column] for s in image.sites],
        "rungs": [[rung.body, rung.site, rung.number, rung.comment, rung.steps, rung.section] for rung in image.rungs],
        "charts": [astuple(chart) for chart in image.charts],
        "outer": outer_statements(image), "bodies": [[body.name, body.kind] for body in image.bodies],
        "results": results.to_data(results.results_of(image)),
        "described": descriptions(plc), "meanings": known,
        "lines": {file: {str(n): text for n, text in rows.items()} for file, rows in lines.items()},
    }  # fmt: skip


def descriptions(plc: Plc) -> dict[str, str]:
    """The descriptions of words and bits by the units of a PLC, by address."""
    return {address: text for attached in plc.units for address, text in getattr(attached.unit, "descriptions", {}).items()}


def meanings(plc: Plc) -> dict[str, dict[int, str]]:
    """The texts of values of words by the units of a PLC, by address and value."""
    return {address: dict(rows) for attached in plc.units for address, rows in getattr(attached.unit, "meanings", {}).items()}


def source_lines(image: Image, texts: Mapping[str, str]) -> dict[str, dict[int, str]]:
    """The source lines with statements, without their margin, by file and line number; `texts` are sources by name."""
    made: dict[str, dict[int, str]] = {}
    split = {name: text.split("\n") for name, text in texts.items()}
    for site in image.sites:
        rows = split.get(site.file, ())
        if site.line <= len(rows):
            made.setdefault(site.file, {})[site.line] = rows[site.line - 1].strip()
    return made


