"""What a trace or a recording tells of a PLC and its program, read from the plain data that `writer.description` made."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fbvm.base.areas import Mailbox
from fbvm.code.image import Layout, RungPicture, SfcPicture, Site
from fbvm.engine.observation import NO_SITE
from fbvm.record.trace import results, symbols
from fbvm.record.trace.format import LARGEST_BYTES
from fbvm.record.trace.scan_source import ScanSource
from fbvm.record.trace.writer import Depth
from fbvm.watch.names import Names


class DescriptionError(ValueError):
    """The data are no description; the message says in which way."""


def describe(source: ScanSource, head: Mapping[str, Any]) -> int:
    """Gives a source of scans what a description says.  Returns the size of the memory in bytes.

    Raises DescriptionError."""
    try:
        source.symbols = symbols.from_data(head)
        extents = [(int(start), int(end)) for start, end in head.get("objects", ())]
        boxes = tuple(Mailbox(str(name), *map(int, sizes)) for name, *sizes in head["mailboxes"])
        sized = head.get("sized")
        layout = Layout(int(head["slots"]), tuple(head["e_banks"]), boxes, None if sized is None else tuple(sized),
                        int(head.get("heap", 0)))
        source.areas, size = layout.areas, layout.size
        if not 0 <= layout.slots_size <= LARGEST_BYTES:
            raise ValueError(f"{layout.slots_size} bytes of slots")
        source.cycle_ns = int(head["cycle_ns"])
        source.depth = Depth(head["depth"])
        source.selected = tuple(head["selected"])
        source.sites = [Site(head["files"][file], pou, line, column) for file, pou, line, column in head["sites"]]
        source.outer = [int(number) for number in head["outer"]]
        source.bodies = [(str(name), str(kind)) for name, kind in head["bodies"]]
        source.results = results.from_data(head["results"]) if "results" in head else {}
        source.rungs = tuple(_rung(*row) for row in head["rungs"])
        source.charts = tuple(_chart(*row) for row in head.get("charts", ()))
        if len(source.outer) != len(source.sites) or not {*source.outer, *(rung.site for rung in source.rungs)} <= {
                NO_SITE, *range(len(source.sites))}:  # fmt: skip
            raise ValueError("statements do not fit one another")
        source.described = dict(head["described"])
        source.meanings = {
            address: {int(value): str(text) for value, text in known.items()} for address, known in head["meanings"].items()}
        source.lines = {file: {int(n): str(text) for n, text in rows.items()} for file, rows in head["lines"].items()}
    except (ArithmeticError, LookupError, TypeError, ValueError, AttributeError, RecursionError) as error:
        raise DescriptionError(str(error)) from None
    source.names = Names(source.symbols, source.areas, extents, range(layout.heap_at, size) if layout.heap_bytes else range(0))
    return size


def _rung(body: int, site: int, number: int, comment: str, steps: list[Any], section: str = "") -> RungPicture:
    return RungPicture(int(body), int(site), int(number), str(comment),
                       tuple((int(place), str(prefix), str(mnemonic), tuple(map(str, operands)))
                             for place, prefix, mnemonic, operands in steps), section=str(section))  # fmt: skip


def _chart(body: int, site: int, steps: list[Any], transitions: list[Any]) -> SfcPicture:
    return SfcPicture(
        int(body), int(site),
        tuple((str(name), bool(initial), int(flag), tuple((str(a), str(b), str(c)) for a, b, c in rows))
              for name, initial, flag, rows in steps),
        tuple((int(place), str(name), int(priority), tuple(map(int, sources)), tuple(map(int, targets)), str(condition))
              for place, name, priority, sources, targets, condition in transitions))  # fmt: skip
