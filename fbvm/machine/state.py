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
    """PROGRAM: units are refreshed, the program stands.  RUN: the program is executed."""

    PROGRAM = "PROGRAM"
    RUN = "RUN"


RUN = Mode.RUN


class Phase(Enum):
    """What a scan consists of, for those who look inside: each is told when it is over."""

    INPUTS = "inputs"
    PROGRAM = "program"
    REFRESH = "I/O refresh"


@dataclass(frozen=True)
class State:
    """All that `Plc.snapshot` keeps: memory, time, schedule, forces, mode and trap.  Not units and connections."""

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
