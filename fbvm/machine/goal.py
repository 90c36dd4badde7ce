"""When a run ends: after so many scans, so much time, or when a condition holds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

from fbvm.base.areas import NEVER
from fbvm.engine.trap import Trap
from fbvm.machine.breakpoints import Halt
from fbvm.watch.conditions import Condition, parse_condition
from fbvm.watch.paths import Place, Span
from fbvm.watch.values import Value


class Scanned(Protocol):
    """What the end of a run depends on; a `Plc` has it."""

    scans: int
    cycle_ns: int
    trap: Trap | None

    @property
    def elapsed_ns(self) -> int: ...

    @property
    def halted(self) -> Halt | None: ...

    def find(self, text: str) -> Place | Span: ...

    def read(self, where: str | Place | Span) -> Value: ...


P = TypeVar("P", bound=Scanned)


class Goal(Generic[P]):
    """The end of a run of `plc` that begins now.

    `scans` is how many more scans there may be, `for_ns` how much more time; `until` ends the run after the scan in which it
    becomes true (a function of the PLC, or an expression such as `Main.done AND D200 > 5`); `max_ns` bounds the time of a
    run with `until`.  The first bound that is reached ends the run.

    Raises ValueError if none of `scans`, `for_ns` and `until` is given or a number is negative, UnknownPlace for a name in
    `until` that the program does not have."""

    def __init__(
        self,
        plc: P,
        *,
        scans: int | None = None,
        for_ns: int | None = None,
        until: str | Callable[[P], bool] | None = None,
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
        self.end_ns = self._for_ns if max_ns is None else min(self._for_ns, plc.elapsed_ns + max_ns)
        """The time of the PLC at which the run ends at the latest: no scan begins then."""
        self._until = self._condition(until)
        self.calls_out = callable(until)
        """True if a function is called after each scan, which may do anything."""
        self._started = plc.scans
        self._halted = plc.halted

    def _condition(self, until: str | Callable[[P], bool] | None) -> Callable[[], bool] | None:
        if until is None:
            return None
        if callable(until):
            function = until
            return lambda: bool(function(self._plc))
        condition: Condition = parse_condition(until, self._plc.find)
        return lambda: condition.holds(self._plc.read)

    @property
    def scans_left(self) -> int:
        """How many scans may follow before `reached` has to be asked, however long they take; 1 with `until`."""
        return 1 if self._until else self._last_scan - self._plc.scans

    @property
    def cycles_left(self) -> int:
        """How many scans, each `cycle_ns` long, may follow before `reached` has to be asked; 1 with `until`."""
        plc = self._plc
        return min(self.scans_left, -((plc.elapsed_ns - self.end_ns) // plc.cycle_ns))

    def reached(self) -> str:
        """What ended the run: "break" (a breakpoint), "trap", "until", "scans", "time" (`for_ns`) or "max" (`max_ns`);
        "" while the run goes on."""
        plc = self._plc
        if (halted := plc.halted) and halted is not self._halted:
            return "break"
        if plc.trap:
            return "trap"
        if self._until and plc.scans > self._started and self._until():
            return "until"
        if plc.scans >= self._last_scan:
            return "scans"
        elapsed_ns = plc.elapsed_ns
        if elapsed_ns < self.end_ns:
            return ""
        return "time" if elapsed_ns >= self._for_ns else "max"
