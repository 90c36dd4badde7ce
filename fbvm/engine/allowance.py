"""The allowance of a run: how much of its step budget it may use up, and who is asked before it goes on.

By it a run is ended after a time, without a clock in generated code: the code compares the steps that are left with `least`, as
it compares them with 0 otherwise, and asks where fewer are left.  `run/watchdog.py` answers by the clock; a replay, which knows
after how many steps a run ended, lets nobody ask."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

NO_MORE = 1 << 62
"""More steps than any budget has: an answer that ends the run."""


@dataclass(frozen=True)
class Allowance:
    """A run ends with R0104 where fewer than `least` steps of its budget are left, unless `ask` says otherwise.

    `ask` is called with the steps that are left.  It returns how many have to be left from now on: if that are more, the run ends
    now.  It must not raise.  Neither number is negative: a run never goes on with fewer than no steps left, and machine code
    counts on that.  Raises ValueError for a negative `least`."""

    least: int = 0
    ask: Callable[[int], int] | None = None

    def __post_init__(self) -> None:
        if self.least < 0:
            raise ValueError(f"at least {self.least} steps left: it cannot be fewer than none")


WHOLE_BUDGET = Allowance()
"""The allowance unless somebody sets another one."""
