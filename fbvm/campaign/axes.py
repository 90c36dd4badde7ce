"""Parameters of a campaign and their values, as a file or a command line writes them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import isfinite
from typing import Any

from fbvm.campaign.plan import CYCLE, EXACT, PHASE, REAL, SETTINGS, TIMING, VALUE, Axis
from fbvm.run.project_reader import moment_ns, one_of, time_ns
from fbvm.watch.values import parse_time_ns, show_time, split_list

MOST_VALUES = 1_000_000
"""Values of one axis."""


def axis_of(row: Mapping[str, Any]) -> Axis:
    """The axis of a row.  Raises ValueError."""
    what = row["setting"] or VALUE
    values = row["values"] if row["values"] is not None else tuple(_range(row["from"], row["to"], row["step"]))
    if what in (CYCLE, PHASE):
        kind = time_ns if what == CYCLE else moment_ns
        values = tuple(kind.value(value) for value in values)
    elif what == TIMING:
        values = tuple(one_of((EXACT, REAL)).value(value) for value in values)
    name = row["name"] or f"{row['plc']}.{what}".removeprefix(".")
    return Axis(name, what, values, row["plc"], row["name"] or "", row["at"])


def _range(first: Any, last: Any, step: Any) -> Iterator[Any]:
    """The values of a range of numbers or times.  Raises ValueError."""
    if first is None or last is None:
        raise ValueError("values are missing: write values = [...], or from and to")
    if isinstance(first, str):
        first_ns, last_ns, step_ns = (parse_time_ns(str(each)) for each in (first, last, step or "1ms"))
        yield from (show_time(value) for value in _counted(first_ns, last_ns, step_ns))
    else:
        yield from _counted(first, last, 1 if step is None else step)


def _counted(first: Any, last: Any, step: Any) -> Iterator[Any]:
    numbers = first, last, step
    if not all(_is_number(each) for each in numbers) or step <= 0 or last < first:
        raise ValueError(f"{first!r} to {last!r} by {step!r} is no range of numbers or times")
    steps = (last - first) // step  # of any size: floats would not hold it
    if steps >= MOST_VALUES:
        raise ValueError(f"a range has {MOST_VALUES:,} values at most")
    for number in range(int((last - first) / step + 1e-9) + 1):
        value = first + number * step
        yield round(value, 12) if isinstance(value, float) else value


def _is_number(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) or isinstance(value, float) and isfinite(value)


def axis_from_text(written: str) -> Axis:
    """The axis of a command line: `NAME=1,2,5`, `NAME=0..10`, `NAME=T#10ms..T#50ms/10ms`; cycle, phase and timing are settings,
    `PLC.cycle` that of one PLC.  Raises ValueError."""
    name, sign, given = (part.strip() for part in written.partition("="))
    if not sign or not name or not given:
        raise ValueError(f"{written!r} is not NAME=VALUE,VALUE or NAME=FIRST..LAST")
    owner, _, last = name.rpartition(".")
    setting = last if last in SETTINGS else None
    row: dict[str, Any] = {"name": None if setting else name, "setting": setting, "plc": owner if setting else "", "at": 0,
                           "values": None, "from": None, "to": None, "step": None}  # fmt: skip
    if ".." in given:
        bounds, _, step = given.partition("/")
        first, _, to = bounds.partition("..")
        row |= {"from": _number(first), "to": _number(to), "step": _number(step) if step else None}
    else:
        row["values"] = tuple(_number(part) for part in split_list(given))
    return axis_of(row)


def _number(written: str) -> Any:
    """A number as a number; every other text as a literal of a program."""
    for kind in (int, float):
        try:
            return kind(written)
        except ValueError:
            continue
    return written.strip()
