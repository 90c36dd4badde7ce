"""A part of a fleet: a process that runs some of its PLCs, tells figures about once a second, and ends when it is told to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from fbvm.base.diagnostics import errors
from fbvm.base.files import reason
from fbvm.campaign.processes import Line, started
from fbvm.campaign.work import PackedImage, unpacked
from fbvm.machine.scan_times import Lateness, ScanTimes
from fbvm.net.tcp import TcpNetwork
from fbvm.run.loop import run_all
from fbvm.run.plant import Plant
from fbvm.run.project import Project
from fbvm.run.time_limit import stopwatch, time_limit

EVERY_NS = 1_000_000_000
UNHEARD_NS = 30_000_000_000
"""A part that hears nothing for so long ends by itself: who has started it is gone."""
GO_ON, STOP = "go on", "stop"
"""What a part is told."""
BUILDING, RUNNING, OVER, FAILED = "building", "running", "over", "failed"
"""States of a part."""


@dataclass(frozen=True)
class Shard:
    """What a part runs; `images` are its programs, `version` is that of fbvm."""

    number: int
    project: Project
    images: tuple[PackedImage, ...]
    version: str
    for_ns: int | None = None


@dataclass(frozen=True)
class Figures:
    """What a part tells of itself: how many PLCs it has, how many scans they did, how many periods they missed and how many of
    them traps have stopped, and how many connections are open.

    `ended` are the reasons of those that have ended; `doors` says where units can be reached, `scan_time` and `lateness` are of
    all scans, told once it is over.  `message` says why it has failed."""

    number: int
    state: str = BUILDING
    plcs: int = 0
    scans: int = 0
    missed: int = 0
    traps: int = 0
    connections: int = 0
    elapsed_s: float = 0.0
    ended: Mapping[str, int] = field(default_factory=dict)
    doors: Mapping[str, str] = field(default_factory=dict)
    scan_time: Mapping[str, Any] = field(default_factory=dict)
    lateness: Mapping[str, Any] = field(default_factory=dict)
    message: str = ""


def run_shard(shard: Shard, line: Line) -> None:
    """Runs a part, in a process of its own; `line` is told its figures, and tells it to stop."""
    try:
        plant = Plant(shard.project, images=unpacked(shard.images, shard.version), for_ns=shard.for_ns)
    except Exception as error:  # of the host's network, or another version: who has started it tells it
        said = reason(error) if isinstance(error, OSError) else str(error)
        line.send(Figures(shard.number, FAILED, message=said))
        return
    if wrong := errors(plant.diagnostics):
        line.send(Figures(shard.number, FAILED, message="\n".join(each.render() for each in wrong)))
        return
    told = _Told(line)
    elapsed, doors = stopwatch(), {str(unit): str(real) for unit, real in plant.doors.items()}
    tell_again = time_limit(-1)

    def tick() -> None:
        nonlocal tell_again
        told.listen()
        if tell_again():
            tell_again = time_limit(EVERY_NS)
            line.send(replace(figures(shard.number, plant, elapsed), doors=doors))

    try:
        run_all(plant.runs, tick, told)
        final = replace(figures(shard.number, plant, elapsed), state=OVER, doors=doors, **_measures(plant))
    finally:
        plant.close()
    with suppress(OSError):
        line.send(final)
        while not told():
            told.listen(wait_s=1.0)


class _Told:
    """Whether a part has been told to stop, or hears nothing any more."""

    def __init__(self, line: Line) -> None:
        self._line, self._is_over, self._unheard = line, False, time_limit(UNHEARD_NS)

    def __call__(self) -> bool:
        return self._is_over

    def listen(self, wait_s: float = 0.0) -> None:
        """Takes what has come."""
        try:
            while self._line.poll(wait_s):
                self._unheard, wait_s = time_limit(UNHEARD_NS), 0.0
                self._is_over = self._line.recv() == STOP or self._is_over
        except (EOFError, OSError):
            self._is_over = True
        self._is_over = self._is_over or self._unheard()


def figures(number: int, plant: Plant, elapsed: Callable[[], int]) -> Figures:
    """The figures of PLCs that run."""
    runs, network = plant.runs, plant.network
    return Figures(number, RUNNING, len(runs), sum(run.plc.scans for run in runs), sum(run.plc.lateness.missed for run in runs),
                   sum(run.plc.trap is not None for run in runs),
                   network.connections if isinstance(network, TcpNetwork) else 0, elapsed() / 1e9,
                   dict(Counter(run.reason for run in runs if run.reason)))  # fmt: skip


def _measures(plant: Plant) -> dict[str, Any]:
    times, late = ScanTimes(plant.runs[0].plc.cycle_ns), Lateness()
    for run in plant.runs:
        times.add(run.plc.scan_times)
        late.add(run.plc.lateness)
    return {"scan_time": times.as_dict(), "lateness": late.as_dict()}


class ShardProcess:
    """The process of a part, in this process's hands.  It has to be made inside of `signals_held`, until somebody is going to end
    it; `begin` tells it then what to run."""

    def __init__(self, shard: Shard) -> None:
        self._process = started()
        self._shard = shard
        self._said = Figures(shard.number)

    def begin(self) -> None:
        """Awaits the process, and has it begin.  Raises NotStarted."""
        self._process.line.send(partial(run_shard, self._shard))

    def figures(self) -> Figures:
        """What the part has told last; it goes on for some seconds more."""
        line = self._process.line
        try:
            while self._said.state not in (OVER, FAILED) and line.poll():
                self._said = line.recv()
            if self._said.state in (BUILDING, RUNNING):
                line.send(GO_ON)
        except (EOFError, OSError):
            self._said = replace(self._said, state=FAILED, message="its process has ended")
        return self._said

    def stop(self) -> None:
        """Tells the part to stop; its last figures come later."""
        with suppress(OSError):
            self._process.line.send(STOP)

    def end(self) -> None:
        """Ends the process, whatever it does."""
        self._process.end()
