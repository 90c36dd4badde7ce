"""Rungs and charts as text on the terminal: at rest for `fbvm ladder` and `fbvm sfc`, as executed for `fbvm run`."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from itertools import groupby
from typing import TYPE_CHECKING

import click

from fbvm.base.types import Elementary, StructType, fold
from fbvm.cli.shared.run_result import chart_width
from fbvm.cli.shared.terminal import say
from fbvm.code.image import Image, RungPicture
from fbvm.machine.plc import Plc
from fbvm.record.draw.ladder_text import ladder_text
from fbvm.record.draw.power import PowerFlow
from fbvm.record.draw.rung_values import RungValues
from fbvm.record.draw.sfc_recorder import ChartRecorder
from fbvm.record.draw.sfc_text import sfc_text
from fbvm.record.trace.observing import observing
from fbvm.syntax.ladder.drawing.cells import columns, padded
from fbvm.syntax.ladder.drawing.widths import Annotations
from fbvm.watch.names import Names
from fbvm.watch.paths import Place

if TYPE_CHECKING:
    from fbvm.interchange.contents import Contents

SVG_WIDTH = 120
"""Columns of an SVG file."""
_SCANS = re.compile(r"([0-9]{1,18})(?:\.\.([0-9]{1,18}))?")


def print_lines(lines: Iterable[str]) -> None:
    """Prints a drawing and an empty line behind it."""
    for line in lines:
        say(line)
    say()


def say_section(rung: RungPicture) -> None:
    """Names the section that begins with a rung."""
    if rung.section:
        say(f"SECTION {rung.section}")


def symbol_addresses(image: Image, body: int) -> Callable[[str], str]:
    """A function from the name of a variable to its address, "" without one.

    Knows the variables that the POU of body number `body` declares with AT, and global variables.  The other way round, an
    address gives the name of the global variable that lies there."""
    own = image.types.get(fold(image.bodies[body].name))
    names = Names.of(image, image.layout.areas)

    @cache
    def by_address() -> dict[str, str]:
        found = ((names.address(Place(field.name, field.type, field.offset, field.bit)), field.name)
                 for field in image.symbols.values() if field.absolute and isinstance(field.type, Elementary))
        return {place.removeprefix("CIO "): name for place, name in reversed(list(found)) if place}

    def address(symbol: str) -> str:
        name = fold(symbol)
        field = own.fields.get(name) if isinstance(own, StructType) else None
        field = field or image.symbols.get(name)
        if field is None:
            return by_address().get(symbol, "")
        if not field.absolute:
            return ""
        return names.address(Place(field.name, field.type, field.offset, field.bit)).removeprefix("CIO ")

    return address


def rung_lines(image: Image, rungs: Sequence[RungPicture], width: int) -> list[list[str]]:
    """The lines of the rungs of a POU that are not executed, at most `width` columns wide, with addresses of the variables.
    All right rails stand in one column."""
    known = symbol_addresses(image, rungs[0].body)
    return _aligned([(rung, Annotations(None, known, others=known)) for rung in rungs], width)


def _aligned(rungs: Sequence[tuple[RungPicture, Annotations]], width: int) -> list[list[str]]:
    """The lines of rungs, all right rails in one column."""
    widest = rail_column(rungs, width)
    return [ladder_text(rung, width, annotations, widest) for rung, annotations in rungs]


def rail_column(rungs: Sequence[tuple[RungPicture, Annotations]], width: int) -> int:
    """The column in which the right rails of all these rungs can stand: that of the widest."""
    drawn = [ladder_text(rung, width, annotations) for rung, annotations in rungs]
    return max(columns(row) for lines in drawn for row in ("", *lines[1:]) if row[:1] != " ")


def comment_lines(rung: RungPicture, pou: str, address: Callable[[str], str], known: Contents) -> list[str]:
    """What the declarations say of the operands of a rung: name, address and comment, a line each.

    pou: the name of the POU of the rung.  address: finds addresses of names and names of addresses.  known: the declarations."""
    own = {**known.blocks, **known.programs}.get(fold(pou).casefold())
    rows: dict[str, tuple[str, str, str]] = {}
    for operand in (part for _, _, _, operands in rung.steps for text in operands for part in _WORDS.findall(text)):
        other = address(operand)
        is_name = operand.casefold() in known.symbols or own is not None and operand.casefold() in own.declared
        name = operand if is_name or not other else other
        declared = own.declared.get(name.casefold()) if own else None
        declared = declared or known.symbols.get(name.casefold(), (None, None))[1]
        comment = declared.comment if declared else known.addresses.get(operand, "")
        if comment:
            rows.setdefault(name, (name, operand if name == other else other, comment))
    widths = [max((columns(row[column]) for row in rows.values()), default=0) for column in (0, 1)]
    return [f"  {padded(name, widths[0])}  {place:{widths[1]}}  {comment}" for name, place, comment in rows.values()]


_WORDS = re.compile(r"(?:(?<=:=)|(?<==>)|^)[@*]?([^\W]\w*(?:\.\w+)?)$")
"""The name or address in an operand, or behind the sign of a pin."""


def scan_filter(text: str) -> Callable[[int], bool]:
    """The scans that an option such as `3,5..7` names, as a predicate of scan numbers.  Raises UsageError for other texts."""
    ranges: list[range] = []
    for part in text.split(","):
        match = _SCANS.fullmatch(part.strip())
        if not match or not (scans := range(int(match[1]), int(match[2] or match[1]) + 1)):
            raise click.UsageError(f"{text!r} names no scans; write 3 or 3,5..7")
        ranges.append(scans)
    return lambda scan: any(scan in scans for scans in ranges)


@contextmanager
def draw_executed_rungs(plc: Plc, scans: str | None) -> Iterator[None]:
    """Records the rungs that `plc` executes inside the `with` block and prints them, with their power, at its end.

    `scans` is the text of --ladder; without it nothing is recorded."""
    if not scans:
        yield
        return
    values = RungValues(plc.image, plc.memory.areas)
    power = PowerFlow(plc.image.rungs, scan_filter(scans), values.keep, values.finish)
    with observing(plc, power):
        yield
    if not power.executed:
        _warn_nothing_drawn(plc, f"--ladder {scans}", "rung", bool(plc.image.rungs))
    names = Names.of(plc.image, plc.memory.areas)
    for (scan, base), together in groupby(power.executed, lambda made: (made.scan, made.base)):
        say(f"scan {scan}, {names.instance(base)}")
        group = list(together)
        known = symbol_addresses(plc.image, group[0].picture.body)
        rungs = [(made.picture, Annotations(made.states, known, values.of(made), known)) for made in group]
        for (rung, _), lines in zip(rungs, _aligned(rungs, chart_width()), strict=True):
            say_section(rung)
            print_lines(lines)


@contextmanager
def draw_executed_charts(plc: Plc, scans: str | None) -> Iterator[None]:
    """Records the charts that `plc` executes inside the `with` block and prints them, with their active steps, at its end.

    `scans` is the text of --sfc; without it nothing is recorded."""
    if not scans:
        yield
        return
    seen = ChartRecorder(plc.image.charts, scan_filter(scans))
    with observing(plc, seen):
        yield
    if not seen.calls:
        _warn_nothing_drawn(plc, f"--sfc {scans}", "chart", bool(plc.image.charts))
    names = Names.of(plc.image, plc.memory.areas)
    for called in seen.calls:
        say(f"scan {called.scan}, {names.instance(called.base)}")
        print_lines(sfc_text(called.picture, chart_width(), called.state))


def _warn_nothing_drawn(plc: Plc, option: str, part: str, declared: bool) -> None:
    """Says why an option drew nothing: the program has no such `part`, or none was executed in the scans of the option."""
    why = f"no {part} was executed in these scans; the run had scans 0 to {plc.scans - 1}" if declared and plc.scans else \
        f"no {part} was executed" if declared else f"there is no {part} in this program"  # fmt: skip
    say(f"{option}: {why}", fg="yellow", err=True)
