"""The options for breakpoints, and the text about a scan that has stopped at one."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import click

from fbvm.machine.breakpoints import Frame, Halt
from fbvm.machine.plc import Plc
from fbvm.watch.conditions import split_condition
from fbvm.watch.names import Names


def breakpoint_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """--break, --watch and --break-if."""
    for decorate in (
        click.option("--break-if", "conditions", multiple=True, metavar="EXPRESSION",
                     help="End inside the scan, as soon as this becomes TRUE.  May be repeated."),
        click.option("--watch", "watched", multiple=True, metavar="NAME|ADDRESS|FIRST..LAST",
                     help="End inside the scan, behind the statement that changed this.  May be repeated."),
        click.option("--break", "lines", multiple=True, metavar="FILE:LINE|POU[ IF EXPRESSION]",
                     help="End inside the scan, before the statement of this line.  May be repeated."),
    ):  # fmt: skip
        function = decorate(function)
    return function


def set_breakpoints(plc: Plc, lines: Sequence[str], watched: Sequence[str], conditions: Sequence[str]) -> None:
    """Sets the breakpoints of the options on a PLC.  Raises ValueError or LookupError for an unknown place."""
    for text in lines:
        where, when = split_condition(text)
        plc.breakpoints.line(where, when)
    for text in watched:
        where, when = split_condition(text)
        plc.breakpoints.change(where, when)
    for text in conditions:
        plc.breakpoints.condition(text)


def halt_lines(plc: Plc, halt: Halt, lines: Mapping[str, Mapping[int, str]]) -> Iterator[str]:
    """The position of a scan that has stopped, the reason, the source line and the call stack.

    `lines` are source lines by file and line number."""
    yield str(halt)
    if halt.site is not None and (text := lines.get(halt.site.file, {}).get(halt.site.line)):
        yield f"  {halt.site.line} | {text}"
    names = Names.of(plc.image, plc.memory.areas)
    rows = [_row(number, frame, names) for number, frame in enumerate(halt.frames)]
    widths = [max(len(row[column]) for row in rows) for column in (0, 1)]
    for first, second, third in rows:
        yield f"  {first:<{widths[0]}}  {second:<{widths[1]}}  {third}".rstrip()


def _row(number: int, frame: Frame, names: Names) -> tuple[str, str, str]:
    place = f"{frame.site.file}:{frame.site.line}" if frame.site else "at its end"
    return f"#{number} {frame.pou}", names.instance(frame.base), place
