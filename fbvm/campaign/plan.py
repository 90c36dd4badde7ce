"""What a campaign varies and how its runs are judged: data that travels to the processes that execute the runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite
from typing import Any

from fbvm.net.faults import Fault
from fbvm.run.project import Project
from fbvm.watch.values import show_time

VALUE, CYCLE, PHASE, TIMING = "value", "cycle", "phase", "timing"
SETTINGS = (CYCLE, PHASE, TIMING)
"""What an axis varies beside variables: the cycle time, how much later than the others a PLC begins, how units answer."""
EXACT, REAL = "exact", "real"
"""Units answer after fixed numbers of scans, or late and out of step by the seed of the run."""
MOST_RUNS = 10_000_000
"""Runs of a campaign, whose results are held in memory."""


@dataclass(frozen=True)
class Axis:
    """A parameter and its values; the first one is what a shrunk run goes back to.

    `what` is VALUE, a variable `path` that is written at `at_ns` after power-on, or one of SETTINGS.  `plc` is the name of a PLC
    of the project, "" for all."""

    name: str
    what: str
    values: tuple[Any, ...]
    plc: str = ""
    path: str = ""
    at_ns: int = 0

    @staticmethod
    def plain(value: Any) -> Any:
        """A value for JSON, which has no infinities and no NaN."""
        return str(value) if isinstance(value, float) and not isfinite(value) else value

    def text(self, value: Any) -> str:
        """A value as people write it."""
        return show_time(value)[2:] if self.what in (CYCLE, PHASE) else str(value)


@dataclass(frozen=True)
class Moments:
    """When something happens in a run: `count` times at most, each with a chance of so many percent; it begins, and it lasts,
    from the first to the second number of nanoseconds."""

    begins_ns: tuple[int, int]
    lasts_ns: tuple[int, int]
    count: int = 1
    chance_percent: int = 100


@dataclass(frozen=True)
class FaultRule:
    """Network faults that are drawn: one of `kinds`, by name, with one of the values of each field in `choices`."""

    moments: Moments
    kinds: tuple[tuple[str, Fault], ...]
    choices: Mapping[str, tuple[Any, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class PowerRule:
    """Power cuts that are drawn, each of one of these PLCs; a cold start loses what is retained, too."""

    moments: Moments
    plcs: tuple[str, ...]
    is_cold: bool = False


@dataclass(frozen=True)
class Response:
    """When `trigger` becomes true, `answer` holds behind that scan or one that begins `within_ns` later at most."""

    trigger: str
    answer: str
    within_ns: int


@dataclass(frozen=True)
class Golden:
    """The changes of some variables of a PLC, as a golden file has them."""

    file: str
    plc: str
    names: tuple[str, ...]
    text: str


@dataclass(frozen=True)
class Judging:
    """What a good run is: no trap; each of `never` holds behind no scan, each of `always` behind all; responses come in time;
    `until`, and what the PLCs of the project run until, holds before the end; the golden traces are those of the run."""

    never: tuple[str, ...] = ()
    always: tuple[str, ...] = ()
    responses: tuple[Response, ...] = ()
    until: str = ""
    goldens: tuple[Golden, ...] = ()


@dataclass(frozen=True)
class Plan:
    """A campaign over a project: `runs` runs, drawn by `seed`; 0 runs are one of each combination of the values.

    `shown` are places whose values behind the last scan are results; with `alone` names need no name of a PLC before them.
    `tests` are executed in place of the project, which is empty then: arguments of pytest."""

    project: Project
    seed: int = 0
    runs: int = 0
    timing: str = REAL
    for_ns: int | None = None
    axes: tuple[Axis, ...] = ()
    faults: tuple[FaultRule, ...] = ()
    cuts: tuple[PowerRule, ...] = ()
    judging: Judging = field(default_factory=Judging)
    shown: tuple[str, ...] = ()
    tests: tuple[str, ...] = ()

    @property
    def combinations(self) -> int:
        """How many combinations of the values there are."""
        count = 1
        for axis in self.axes:
            count *= len(axis.values)
        return count

    @property
    def count(self) -> int:
        """How many runs there are."""
        return self.runs or self.combinations

    @property
    def alone(self) -> bool:
        """True if the name of the PLC may be left out where there is no other: no row of the project numbers its PLCs."""
        return all(row.count is None for row in self.project.plcs)
