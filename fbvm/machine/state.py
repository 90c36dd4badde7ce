"""The states of a PLC: its mode, the phases of a scan, and all that a snapshot keeps."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from fbvm.base.memory import Snapshot
from fbvm.engine.trap import Trap
from fbvm.machine.scan.tasks import TaskScheduleState
from fbvm.watch.paths import Place
from fbvm.watch.values import Value


class Mode(Enum):
    """The operating mode of a PLC."""

    PROGRAM = "PROGRAM"
    """Scans refresh the units and execute no program."""
    RUN = "RUN"
    """Scans execute the program and refresh the units."""


RUN = Mode.RUN


class Phase(Enum):
    """The phases of a scan; `Plc.phases` are called when one is over."""

    INPUTS = "inputs"
    PROGRAM = "program"
    REFRESH = "I/O refresh"


@dataclass(frozen=True)
class State:
    """What `Plc.snapshot` keeps: memory, time, tasks, forces, mode and trap; neither units nor connections."""

    memory: Snapshot
    now_ns: int
    scans: int
    schedule: TaskScheduleState
    forces: dict[Place, Value]
    mode: Mode
    first: bool
    trap: Trap | None


class Stopped(RuntimeError):
    """The PLC was asked to go on after a trap; `trap` says what stopped it.  Restart it first."""

    def __init__(self, trap: Trap) -> None:
        super().__init__(f"the PLC has stopped: {trap.message}")
        self.trap = trap
