"""Counts what a PLC executes, at the speed of its engine: machine code does the counting, where machine code runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set
from contextlib import contextmanager
from operator import sub

from fbvm.engine.choice.tiers import add_counts, counts_of
from fbvm.engine.counted import Counted, counted
from fbvm.machine.instrumented import instrumented
from fbvm.machine.plc import Plc


class Counting:
    """The counts of a PLC, up to now or up to the end of `counting`."""

    def __init__(self, made: Counted, engine: object) -> None:
        self._made, self._engine = made, engine

    def read(self) -> list[int]:
        """The counts, by number of the counter."""
        return counts_of(self._engine)

    def back_to(self, counts: Sequence[int]) -> None:
        """Makes the counts what `read` has returned, because a scan is done again."""
        add_counts(self._engine, list(map(sub, counts, self.read())))

    def counters_at(self, site: int) -> list[int]:
        """The numbers of the counters of a statement."""
        return [number for number, counter in enumerate(self._made.counters) if counter == (site, False)]

    def executed(self) -> dict[int, int]:
        """By site of each statement and rung how often it was executed."""
        return self._by_site(skipped=False)

    def skipped(self) -> dict[int, int]:
        """By site of an IF or CASE how often none of its branches was executed, or one without statements."""
        return self._by_site(skipped=True)

    def _by_site(self, skipped: bool) -> dict[int, int]:
        found: dict[int, int] = {}
        for counter, count in zip(self._made.counters, self.read(), strict=True):
            if counter.skipped is skipped:
                found[counter.site] = found.get(counter.site, 0) + count
        return found


@contextmanager
def counting(plc: Plc, files: Set[str] | None = None) -> Iterator[Counting]:
    """Counts what `plc` executes inside the `with` block, all or what stands in some files, by their names in sites.

    Raises ValueError if somebody looks into every scan of `plc`."""
    made = counted(plc.image, files)
    with instrumented(plc, made.image) as engine:
        yield Counting(made, engine)
