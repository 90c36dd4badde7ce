"""What the two builds that tell observations say of a run: all of it, with the memory at each."""

from __future__ import annotations

from zlib import crc32

from fbvm.base.areas import AREAS
from fbvm.code.image import Image
from fbvm.engine.observation import Observation
from fbvm.engine.python.engine import PythonEngine
from fbvm.engine.trap import Trap
from fbvm.machine.plc import Plc

BEHIND_SYSTEM_PAGE = AREAS["CF"].offset
WAYS = "observe", "observations"
Moment = tuple[Observation, int]
"""An observation, and a checksum of the memory at that moment."""


class Watched:
    """An engine of a PLC that keeps what is observed, by one of WAYS."""

    machine = None

    def __init__(self, engine: PythonEngine, way: str) -> None:
        self._engine, self._way = engine, way
        self.moments: list[Moment] = []

    def run(self, task_index: int) -> Trap | None:
        told = getattr(self._engine, self._way)(task_index)
        while True:
            try:
                seen = next(told)
            except StopIteration as end:
                trap: Trap | None = end.value
                return trap
            self.moments.append((seen, crc32(self._engine.memory.u8[BEHIND_SYSTEM_PAGE:])))


def moments(image: Image, way: str, scans: int, budget: int, cycle_ns: int = 10_000_000) -> tuple[list[Moment], str, bytes]:
    """What is observed in some scans, the trap that ended them, and the memory after them."""
    plc = Plc(image, cycle_ns, budget=budget, observed=True)
    engine = plc.engine
    assert isinstance(engine, PythonEngine)
    plc.engine = watched = Watched(engine, way)
    for _ in range(scans):
        if plc.trap is None:
            plc.scan()
    return watched.moments, repr(plc.trap), bytes(plc.memory.u8)


def first_difference(image: Image, scans: int = 3, budget: int = 5000, cycle_ns: int = 10_000_000) -> str:
    """Where the two ways differ, in words; "" if they say the same."""
    (stepped, *stepped_end), (logged, *logged_end) = (moments(image, way, scans, budget, cycle_ns) for way in WAYS)
    for number, (one, other) in enumerate(zip(stepped, logged, strict=False)):
        if one != other:
            return f"observation {number}: {one}, and {other}"
    if len(stepped) != len(logged):
        return f"{len(stepped)} observations, and {len(logged)}"
    return "" if stepped_end == logged_end else f"{stepped_end[0]} at the end, and {logged_end[0]}; or another memory"
