"""When a run ends: after so many scans, so much time, or when a condition holds."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from fbvm.base.areas import NEVER
from fbvm.watch.conditions import Condition, parse_condition

if TYPE_CHECKING:
    from fbvm.machine.plc import Plc


class Goal:
    """The end of a run that begins now.  Raises ValueError if nothing would ever end it, or a bound makes no sense."""

    def __init__(
        self,
        plc: Plc,
        *,
        scans: int | None = None,
        for_ns: int | None = None,
        until: str | Callable[[Plc], bool] | None = None,
        max_ns: int | None = None,
    ) -> None:
        if scans is None and for_ns is None and until is None:
            raise ValueError("say when to end: scans, for_ns or until")
        for name, bound in (("scans", scans), ("for_ns", for_ns), ("max_ns", max_ns)):
            if bound is not None and bound < 0:
                raise ValueError(f"{name} is {bound}; it cannot be negative")
        self._plc = plc
        self._last_scan = NEVER if scans is None else plc.scans + scans
        self._for_ns = NEVER if for_ns is None else plc.elapsed_ns + for_ns
        self._end_ns = self._for_ns if max_ns is None else min(self._for_ns, plc.elapsed_ns + max_ns)
        self._until = self._condition(until)
        self._started = plc.scans
        self._halted = plc.halted

    def _condition(self, until: str | Callable[[Plc], bool] | None) -> Callable[[], bool] | None:
        if until is None:
            return None
        if callable(until):
            function = until
            return lambda: bool(function(self._plc))
        condition: Condition = parse_condition(until, self._plc.find)
        return lambda: condition.holds(self._plc.read)

    @property
    def scans_left(self) -> int:
        """How many scans come before the goal, whatever time they take; 1 for a condition."""
        return 1 if self._until else self._last_scan - self._plc.scans

    @property
    def cycles_left(self) -> int:
        """How many scans of a cycle each come before the goal; 1 for a condition."""
        plc = self._plc
        return min(self.scans_left, -((plc.elapsed_ns - self._end_ns) // plc.cycle_ns))

    def reached(self) -> str:
        """"trap", "until", "scans", "time", "max" or "break" if that ended the run, else ""."""
        plc = self._plc
        if (halted := plc.breakpoints.halted) and halted is not self._halted:
            return "break"
        if plc.trap:
            return "trap"
        if self._until and plc.scans > self._started and self._until():
            return "until"
        if plc.scans >= self._last_scan:
            return "scans"
        elapsed_ns = plc.elapsed_ns
        if elapsed_ns < self._end_ns:
            return ""
        return "time" if elapsed_ns >= self._for_ns else "max"
