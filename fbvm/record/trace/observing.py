"""Looks into the scans of a PLC while it executes them: phases and events, for a listener."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Protocol

from fbvm.machine.plc import Phase, Plc
from fbvm.record.trace.events import Event, ObservedEngine


class Listener(Protocol):
    """Receives the phases and events of scans."""

    def phase(self, plc: Plc, phase: Phase) -> None:
        """Called at the end of a phase."""

    def event(self, plc: Plc, event: Event) -> None:
        """Called for each event."""


@contextmanager
def observing(plc: Plc, listener: Listener, stands_still: bool = False, most: int | None = None) -> Iterator[None]:
    """Reports the events of all scans of `plc` to `listener` inside the `with` block.

    At each event the memory of `plc` is as it was at that moment.  A listener that changes the memory says `stands_still`:
    the scan then waits for it at each event.  With `most` a task that loops is reported up to about so many events, then `Cut`;
    not where somebody else observes the PLC, too."""
    program = plc.engine
    report = partial(listener.event, plc)
    if isinstance(program, ObservedEngine):
        report = partial(_both, program.report, report)
        stands_still, most = stands_still or program.stands_still, None
    plc.engine = ObservedEngine(plc.image, plc.memory, report, program, stands_still, most)
    plc.phases.append(listener.phase)
    try:
        yield
    finally:
        plc.phases.remove(listener.phase)
        plc.engine = program


def _both(first: Callable[[Event], None], second: Callable[[Event], None], event: Event) -> None:
    first(event)
    second(event)
