"""What an observed run says while it happens, in a form that can be compared: phases with the memory, and events."""

from __future__ import annotations

from typing import Any

from fbvm.base.areas import SCANS
from fbvm.machine.plc import Phase, Plc
from fbvm.record.trace.events import Event, Frame


def plain(event: Event) -> tuple[Any, ...]:
    """An event without the identity of its frames."""
    return type(event).__name__, *(_frame(value) if isinstance(value, Frame) else value for value in event)


def _frame(frame: Frame | None) -> tuple[Any, ...]:
    return () if frame is None else (frame.body, frame.base, frame.site, _frame(frame.caller))


class WatchedRun:
    """Writes down each scan: its number, its time, and what happened inside, with the memory when the scan is over."""

    def __init__(self) -> None:
        self.rows: list[tuple[Any, ...]] = []
        self._inside: list[tuple[Any, ...]] = []

    def phase(self, plc: Plc, phase: Phase) -> None:
        self._inside.append((phase.value, contents(plc)))
        if phase is Phase.REFRESH:
            self.rows.append((plc.scans, plc.now_ns, *self._inside))
            self._inside = []

    def event(self, plc: Plc, event: Event) -> None:
        self._inside.append(plain(event))


def contents(plc: Plc) -> bytes:
    """The memory of a PLC, without the number of scans, which is counted when a scan is over."""
    memory = bytearray(plc.memory.u8)
    memory[SCANS : SCANS + 8] = bytes(8)
    return bytes(memory)
