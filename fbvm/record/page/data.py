"""The data of the HTML page of a run: the ends of all scans as columns, the inside of scans in windows, packets.

    {"scans": [first, count], "blocks": [scans of each], "signals": [{"name": ..., "cell": ..., "form": ...}, ...],
     "words": {"D": {"200": column}}, "windows": [[first, last], ...], ...}

What is large stands behind this head in parts, each compressed by itself, which the page reads where somebody looks."""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from fbvm.base.types import StructType
from fbvm.machine.plc import Phase
from fbvm.record.page.cells import TEXT, cell_of, form_of
from fbvm.record.page.columns import Columns
from fbvm.record.page.inside import Insides, Window, text_of
from fbvm.record.page.windows import chosen_windows
from fbvm.record.trace.events import Event, NetworkEvent
from fbvm.record.trace.packets import Dissector, Packet
from fbvm.record.trace.recorder import Signal, signals_at
from fbvm.record.trace.samples import chosen_signals
from fbvm.record.trace.scan_source import Moment, ScanSource
from fbvm.record.trace.writer import Depth
from fbvm.watch.paths import UnknownPlace

MOST_ROWS = 24_000
"""Rows of statements and phases that a page carries, about; a program of 400 statements has some 800 rows a scan."""
PROBED_SCANS = 4
"""The last scans, whose rows say about how many a scan has."""
FEW_SIGNALS = 60
"""If there are more signals, those without changes are left out, unless they are named."""
PICTURES_A_PART, FRAMES_A_PART = 64, 512
VERSION = 2


@dataclass
class PageData:
    """What a page shows: its head, as JSON can write it, and the parts that stand behind that, compressed."""

    head: dict[str, Any]
    parts: list[bytes]


class _Ends:
    """Receives the ends of scans and what passed the network."""

    def __init__(self, columns: Columns) -> None:
        self._columns = columns
        self._dissector = Dissector()
        self._rows: list[list[Any]] = []
        self.frames: list[list[int]] = []
        """First scan, last scan and number of packets of each part."""
        self.parts: list[bytes] = []
        self.own = ""
        """The sender of the first packet: the unit."""

    def phase(self, moment: Moment, phase: Phase) -> None:
        """Takes the end of a scan."""
        self._columns.add(moment)

    def event(self, moment: Moment, event: Event) -> None:
        """Takes what passed the network."""
        assert isinstance(event, NetworkEvent)
        rows = frame_rows([(moment.scans, packet) for packet in self._dissector.dissect(event.now_ns, event.tap_event)])
        self._rows += rows
        if rows and not self.own:
            self.own = rows[0][2]
        if len(self._rows) >= FRAMES_A_PART:
            self.end()

    def end(self) -> None:
        """Ends a part."""
        if self._rows:
            self.frames.append([self._rows[0][0], self._rows[-1][0], len(self._rows)])
            self.parts.append(packed(self._rows))
            self._rows = []


def page_data(source: ScanSource, names: Sequence[str] = (), scans: range | None = None, title: str = "", *, prefix: str = "",
              pinned: Sequence[str] = (), inside: Sequence[range] = ()) -> PageData:  # fmt: skip
    """The data of the scans of `source`, or of some of them and some variables.  Raises UnknownPlace, TypeError, TraceError.

    `prefix` is not shown in names; variables that are `pinned` have columns in the scan table, and the last scan is
    shown first.  The scans of `inside` are shown statement by statement even if not all can be; then come the last scans and
    those in which a variable of `names` or `pinned` changed."""
    signals = _shown_signals(source, names, pinned)
    cells = [cell_of(signal, number) for number, signal in enumerate(signals)]
    watched = frozenset(cell for cell, signal in zip(cells, signals, strict=True) if names or signal.place.name in pinned)
    areas = list(source.areas.values())
    columns = Columns(cells, areas, lambda number, moment: text_of(source, signals[number], moment), watched)
    ends, held = _Ends(columns), source.scans
    wanted = held if scans is None else range(max(held.start, scans.start), min(held.stop, scans.stop))
    source.follow_ends(ends, wanted)
    ends.end()
    columns.end()
    every = bool(names) or len(signals) <= FEW_SIGNALS
    kept = [(signal, number) for signal, number in zip(signals, map(columns.number, cells), strict=False)
            if every or columns.columns[number].entries or signal.place.name in pinned] if len(columns) else []  # fmt: skip
    insides = Insides(source, [signal for signal, _ in kept])
    changes = sorted({scan for column in columns.columns for scan in column.changed})
    windows = _windows(source, insides, wanted, inside, changes)
    return _page_data(source, columns, ends, insides, windows, {
        "title": title, "pinned": [name.removeprefix(prefix) for name in pinned],
        "signals": [_signal(signal, number, prefix) for signal, number in kept],
        "names": dict(reversed(list(_located(source, [signal for signal, _ in kept])))),
        "instances": [path.removeprefix(prefix.rstrip(".")).lstrip(".") for path in insides.instances],
    })  # fmt: skip


def _shown_signals(source: ScanSource, names: Sequence[str], pinned: Sequence[str]) -> list[Signal]:
    """The signals of some names, or all, and those that are pinned."""
    signals = chosen_signals(source, names) if names else _in_order(source)
    known = {signal.place.name for signal in signals}
    return signals + [signal for name in pinned if name not in known
                      for signal in signals_at(source.find(name), source.described, source.meanings)]  # fmt: skip


def _signal(signal: Signal, column: int, prefix: str) -> dict[str, Any]:
    return {"name": signal.label.removeprefix(prefix), "bit": int(signal.is_bit), "said": signal.description, "cell": column,
            **form_of(signal)}  # fmt: skip


def _windows(source: ScanSource, insides: Insides, scans: range, inside: Sequence[range], changes: Sequence[int]) -> list[Window]:
    """What happened inside the scans for which there is room."""
    if source.depth is Depth.SCANS or not scans:
        return []
    if len(scans) <= PROBED_SCANS:
        return [window for window in [insides.window(scans, MOST_ROWS)] if window.scans]
    probe = insides.window(scans[-PROBED_SCANS:], MOST_ROWS)
    rows = max(map(len, probe.rows.values()), default=1)
    made: list[Window] = []
    room = MOST_ROWS
    for piece in reversed(chosen_windows(scans, max(PROBED_SCANS, MOST_ROWS // rows), inside, changes)):
        made.insert(0, insides.window(piece, max(1, room), probe if piece.stop == scans.stop else None))
        room -= made[0].count
        if room <= 0:
            break
    return [window for window in made if window.scans]


def _page_data(source: ScanSource, columns: Columns, ends: _Ends, insides: Insides, windows: Sequence[Window],
               head: dict[str, Any]) -> PageData:  # fmt: skip
    """Puts head and parts together; the parts come in the order index, windows, pictures, packets, columns."""
    pictures = insides.pictures
    parts = [packed_bytes(columns.index()),
             *(packed({"rows": window.rows, "ladder": window.ladder}) for window in windows),
             *(packed(pictures[at:at + PICTURES_A_PART]) for at in range(0, len(pictures), PICTURES_A_PART)),
             *ends.parts]  # fmt: skip
    head |= {
        "version": VERSION, "cycle": source.cycle_ns, "depth": source.depth.value,
        "scans": [columns.first, len(columns)], "blocks": columns.blocks,
        "columns": [_column(columns, number) for number in range(len(columns.columns))],
        "words": {area: {str(at): number for at, number in sorted(rows.items())} for area, rows in sorted(columns.words.items())},
        "constants": {area: {str(at): value for at, value in sorted(rows.items())}
                      for area, rows in sorted(columns.constants.items())},
        "described": dict(source.described),
        "meanings": {address: {str(value): text for value, text in known.items()}
                     for address, known in source.meanings.items()},
        "sites": [[site.file, site.line, source.line(site)] for site in (source.sites[number] for number in insides.sites)],
        "windows": [[window.scans[0], window.scans[-1]] for window in windows],
        "frames": ends.frames, "own": ends.own, "pictures": len(pictures), "pictures_a_part": PICTURES_A_PART,
        "parts": [len(part) for part in parts],
    }  # fmt: skip
    return PageData(head, [*parts, *columns.streams])


def _column(columns: Columns, number: int) -> dict[str, Any]:
    """The code of a column; the first value, in hexadecimal, if it has only one; its texts."""
    column = columns.columns[number]
    row: dict[str, Any] = {"code": column.cell.code}
    if not column.entries:
        row["value"] = column.initial.hex()
    if column.cell.code == TEXT:
        row["texts"] = list(columns.texts[number].numbers)
    return row


def packed(value: object) -> bytes:
    """JSON, compressed."""
    return packed_bytes(json.dumps(value, separators=(",", ":")).encode())


def packed_bytes(data: bytes) -> bytes:
    """A raw deflate stream (RFC 1951)."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    return packer.compress(data) + packer.flush()


def frame_rows(rows: Sequence[tuple[int, Packet]]) -> list[list[Any]]:
    """The rows of the page's list of packets: scan, time, source, destination, info and the bytes in hexadecimal."""
    return [[scan, packet.now_ns, str(packet.source), str(packet.destination), packet.info, packet.data.hex()]
            for scan, packet in rows]  # fmt: skip


def _in_order(source: ScanSource) -> list[Signal]:
    """All signals: first the programs' own variables, then members of their instances, described addresses, and the others."""
    programs = {field.name for field in source.symbols.values() if isinstance(field.type, StructType) and field.type.block}

    def rank(signal: Signal) -> int:
        owner, *rest = signal.place.name.split(".")
        return 1 if signal.place.area else len(rest) - 1 if owner in programs else 2

    return sorted((signal for signal in chosen_signals(source, ()) if not signal.place.is_generated), key=rank)


def _located(source: ScanSource, signals: Sequence[Signal]) -> Iterator[tuple[str, str]]:
    """Pairs of an address and the variable that is located there."""
    for signal in signals:
        if not signal.place.area:
            try:
                if address := source.names.address(signal.place):
                    yield address, signal.place.name
            except UnknownPlace:
                continue
