"""Makes a failing run small: as few faults, power cuts and changed parameters as still bring a failure of its group.

The method is delta debugging (A. Zeller, R. Hildebrandt, "Simplifying and Isolating Failure-Inducing Input", 2002): halves are
left out, then quarters, and so on, until nothing can be left out alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from fbvm.campaign.execution import Result
from fbvm.campaign.judge import Failure
from fbvm.campaign.plan import EXACT
from fbvm.campaign.variants import STEP_NS, Variant

FAULT, CUT, PARAMETER, UNITS = "fault", "cut", "parameter", "units"
MOST_TRIES = 200
"""Runs that are executed to make one smaller."""
Part = tuple[str, int]
"""What can be left out of a run: its kind and its number."""


@dataclass(frozen=True)
class Shrunk:
    """The smallest failing run that was found, what comes of it, and how many runs were executed to find it."""

    variant: Variant
    result: Result
    tries: int


class Executes(Protocol):
    """What executes runs."""

    def result(self, variant: Variant) -> Result:
        """What comes of a run."""


def shrink(execution: Executes, variant: Variant, result: Result) -> Shrunk:
    """The smallest run with a failure of the same group as that of `variant`, whose result is `result`."""
    assert result.failure
    search = _Search(execution, result.failure, Shrunk(variant, result, 0))
    least(_parts(variant), lambda kept: search.fails(_with(variant, kept)))
    for number, named in enumerate(search.best.variant.faults):
        while (lasts_ns := named.fault.until_ns - named.fault.from_ns) >= 2 * STEP_NS:
            shorter = replace(named.fault, until_ns=named.fault.from_ns + lasts_ns // 2 // STEP_NS * STEP_NS)
            named, faults = replace(named, fault=shorter), list(search.best.variant.faults)
            faults[number] = named
            if not search.fails(replace(search.best.variant, faults=tuple(faults))):
                break
    return replace(search.best, tries=search.tries)


@dataclass
class _Search:
    execution: Executes
    failure: Failure
    best: Shrunk
    tries: int = 0

    def fails(self, variant: Variant) -> bool:
        """True if a run fails as the first one did; then it is the best one so far."""
        if self.tries >= MOST_TRIES:
            return False
        self.tries += 1
        result = self.execution.result(variant)
        if result.failure is None or result.failure.key != self.failure.key:
            return False
        self.best = Shrunk(variant, result, self.tries)
        return True


def least(parts: Sequence[Part], fails: Callable[[Sequence[Part]], bool]) -> Sequence[Part]:
    """Parts of which none can be left out alone so that it still fails; with all of them it does."""
    pieces = 2
    if parts and fails([]):
        return []
    while len(parts) > 1:
        size = -(-len(parts) // pieces)
        rests = [[*parts[:start], *parts[start + size:]] for start in range(0, len(parts), size)]
        if (rest := next((rest for rest in rests if rest and fails(rest)), None)) is not None:
            parts, pieces = rest, max(pieces - 1, 2)
        elif size == 1:
            return parts
        else:
            pieces = min(2 * pieces, len(parts))
    return parts


def _parts(variant: Variant) -> list[Part]:
    return [*((FAULT, number) for number in range(len(variant.faults))), *((CUT, number) for number in range(len(variant.cuts))),
            *((PARAMETER, number) for number, value in enumerate(variant.values) if value),
            *([(UNITS, 0)] if variant.timing != EXACT else [])]  # fmt: skip


def _with(variant: Variant, kept: Sequence[Part]) -> Variant:
    """The run with only these of its parts."""
    held = set(kept)
    return replace(
        variant,
        faults=tuple(fault for number, fault in enumerate(variant.faults) if (FAULT, number) in held),
        cuts=tuple(cut for number, cut in enumerate(variant.cuts) if (CUT, number) in held),
        values=tuple(value if (PARAMETER, number) in held else 0 for number, value in enumerate(variant.values)),
        timing=variant.timing if (UNITS, 0) in held else EXACT,
    )
