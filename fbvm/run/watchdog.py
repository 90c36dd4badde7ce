"""Ends a scan that takes longer in real time than the watch cycle time of its PLC.

There is no clock in generated code and no thread beside it.  A scan may charge some thousand steps; then its engine asks here
whether it may go on (`engine/allowance.py`), and is told how many more steps it may charge before it asks again.  A scan of
ordinary length never asks."""

from __future__ import annotations

import time

from fbvm.base.areas import NOW
from fbvm.engine.allowance import NO_MORE, WHOLE_BUDGET, Allowance
from fbvm.machine.plc import Plc

FIRST_STEPS = 4096
"""Steps that each scan may charge before it asks for the first time: a millisecond in Python."""
LOOKS = 8
"""A scan asks at least so many times in a watch cycle time, and so is ended at most by an eighth of that too late."""


class Watchdog:
    """Watches the scans of one PLC.  Whoever runs it calls `begin` before and `end` after each scan or burst."""

    def __init__(self, plc: Plc) -> None:
        self._plc = plc
        self._system = plc.memory.views["i64"]
        self._allowance = WHOLE_BUDGET
        self._budget = -1
        self._began_ns = 0
        """When the scan or burst began, by the host's monotonic clock."""
        self._asks = False
        """True if the scan has asked."""
        self._scan_ns = 0
        """The time of the scan that has asked, as its program knows it: by it scans of a burst are told from each other."""
        self._failure: BaseException | None = None
        self._is_in_batch = False
        """True if nobody calls `begin` before each scan."""

    def begin(self, now_ns: int) -> None:
        """A scan begins at `now_ns` of the host's monotonic clock.

        Where breakpoints are set, a person looks at the scan and it is not ended."""
        self._began_ns, self._is_in_batch = now_ns, False
        plc = self._plc
        if plc.budget != self._budget:
            self._budget = plc.budget
            self._allowance = Allowance(max(0, plc.budget - FIRST_STEPS), self._ask)
        allowance = WHOLE_BUDGET if plc.breakpoints.armed else self._allowance
        if plc.engine.allowance is not allowance:
            plc.engine.allowance = allowance

    def end(self) -> None:
        """The scan has ended; the next one may charge its first steps again without a question.

        Raises what a signal has raised while the scan asked."""
        if self._asks or self._failure:
            self._asks = False
            self._plc.engine.allowance = self._allowance
            failure, self._failure = self._failure, None
            if failure:
                raise failure

    def begin_batch(self) -> None:
        """From now on nobody calls `begin` before a scan, which then begins when it asks for the first time."""
        self._is_in_batch = True

    def stop(self) -> None:
        """Nobody watches the PLC any more."""
        self._plc.engine.allowance = WHOLE_BUDGET

    def _ask(self, left: int) -> int:
        try:
            return self._answer(left)
        except BaseException as failure:  # Ctrl-C: machine code cannot pass it on
            self._failure = failure
            return NO_MORE

    def _answer(self, left: int) -> int:
        """How many steps have to be left from now on, in a scan that has so many left now."""
        if left < 0:
            return 0
        now_ns, scan_ns = time.monotonic_ns(), self._system[NOW // 8]
        if not self._asks:
            self._asks, self._scan_ns = True, scan_ns
            if self._is_in_batch:
                self._began_ns = now_ns
        elif scan_ns != self._scan_ns:  # a later scan of the burst, or of the batch
            self._scan_ns, self._began_ns = scan_ns, now_ns
        taken_ns, watch_ns = now_ns - self._began_ns, self._plc.watch_cycle.time_ns
        if taken_ns >= watch_ns:
            return NO_MORE
        charged = self._budget - left
        more = min(charged, charged * watch_ns // (LOOKS * max(1, taken_ns)))
        return max(0, left - max(1, more))
