"""Small images built by hand, for tests of what runs them."""

from __future__ import annotations

from fbvm.base import types as t
from fbvm.base.areas import AREAS, SLOTS_OFFSET
from fbvm.base.types import Field, StructType
from fbvm.code.image import Body, Image, Layout, ProgramRun, Retained, Site, TaskRow
from fbvm.code.operations import Node

COUNTER = StructType("Counter", 32, 8, {
    "N": Field("n", t.INT, 8),
    "DONE": Field("done", t.BOOL, 10, "VAR_OUTPUT"),
    "KEPT": Field("kept", t.INT, 12),
    "STEP": Field("step", t.INT, 14, "VAR_INPUT"),
    "STARTED": Field("started", t.TIME, 16),
    "LIMIT": Field("limit", t.INT, 24, constant=True),
}, block=True)
"""PROGRAM Counter: n := n + step; kept := kept + step; done := n >= 5; started := time of the scan."""
D200 = AREAS["D"].offset + 400


def counter_image(*tasks: TaskRow, extra: tuple[Node, ...] = ()) -> Image:
    """One program `Main` of type Counter; D200 counts every execution.  `extra` statements end the body."""
    return Image(
        Layout(4096),
        (Body("Counter", "PROGRAM", (*_counting(), *extra), COUNTER.size),),
        tasks or (task("Main"),),
        {"MAIN": Field("Main", COUNTER, SLOTS_OFFSET), "GO": Field("Go", t.BOOL, SLOTS_OFFSET + 100)},
        ((SLOTS_OFFSET + 14, b"\1\0"), (SLOTS_OFFSET + 24, b"\5\0")),
        (Retained("Main.kept", SLOTS_OFFSET + 12, 2),),
        (Site("counter.st", "Counter", 4, 5),),
    )


def task(name: str, priority: int = 0, interval_ns: int = 0, single: str = "") -> TaskRow:
    """A task that runs `Main`."""
    return TaskRow(name, priority, interval_ns, single, (ProgramRun("Main", 0, SLOTS_OFFSET),))


def _counting() -> tuple[Node, ...]:
    step = ("load", "i16", ("self", 14, ()))
    count = tuple(
        ("store", machine, place, ("add", machine, ("load", machine, place), amount))
        for machine, place, amount in (
            ("i16", ("self", 8, ()), step),
            ("i16", ("self", 12, ()), step),
            ("u16", ("abs", D200, ()), ("const", "u16", 1)),
        )
    )
    done = ("ge", "b", "i16", ("load", "i16", ("self", 8, ())), ("const", "i16", 5))
    return (
        ("charge", 4, 0),
        *count,
        ("store", "b", ("self", 10, ()), done),
        ("store", "i64", ("self", 16, ()), ("now", "i64")),
    )
