"""How far a campaign is, how fast it goes and what has failed so far: for people and programs that look at it while it runs."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from fbvm.campaign.execution import Result
from fbvm.campaign.judge import Failure

NOW_S = 10.0
"""Over how many of the last seconds the present rate is taken."""
SAMPLE_S = 0.5
"""The shortest time between two moments whose results are kept."""
MOST_BINS = 60
"""Rates over time are given for so many parts of the time at most."""
RUNNING, SHRINKING, OVER, INTERRUPTED = "running", "making failing runs smaller", "over", "interrupted"


@dataclass
class FailingGroup:
    """Failures of one group so far: the first that came, how many there are, and the smallest number of a run among them."""

    failure: Failure
    runs: int = 0
    first: int = 0


@dataclass
class Progress:
    """The progress of a campaign of `runs` runs; `elapsed_ns` answers how long it has run, `there` are results that it began
    with."""

    runs: int
    elapsed_ns: Callable[[], int]
    there: Sequence[Result] = ()
    state: str = RUNNING
    done: int = 0
    failing: int = 0
    _groups: dict[object, FailingGroup] = field(default_factory=dict)
    _samples: list[tuple[float, int]] = field(default_factory=list)
    """How many results there were after so many seconds."""

    def __post_init__(self) -> None:
        self.add(self.there)

    def add(self, results: Sequence[Result]) -> None:
        """Takes further results."""
        self.done += len(results)
        for result in results:
            if result.failure:
                self.failing += 1
                group = self._groups.setdefault(result.failure.key, FailingGroup(result.failure, first=result.number))
                group.runs += 1
                if result.number < group.first:
                    group.failure, group.first = result.failure, result.number
        if self.done == self.runs and self.state == RUNNING:
            self.state = SHRINKING
        if len(self._samples) > 1 and self.elapsed_s - self._samples[-2][0] < SAMPLE_S:
            self._samples.pop()
        self._samples.append((self.elapsed_s, self.done))

    @property
    def elapsed_s(self) -> float:
        """Seconds since it was begun, or called again."""
        return self.elapsed_ns() / 1e9

    @property
    def rate(self) -> float:
        """Runs a second, from the beginning to the last result."""
        return _rate(self._samples)

    @property
    def present_rate(self) -> float:
        """Runs a second in the last seconds."""
        return _rate(self._samples[self._index(self._samples[-1][0] - NOW_S):])

    @property
    def left_s(self) -> float | None:
        """In how many seconds the last run will be done, if it goes on like that; None before that is known."""
        return (self.runs - self.done) / self.present_rate if self.present_rate else None

    @property
    def groups(self) -> list[FailingGroup]:
        """The groups of failures; those with most runs come first."""
        return sorted(self._groups.values(), key=lambda group: (-group.runs, group.first))

    @property
    def rates(self) -> list[tuple[float, float]]:
        """Seconds and runs a second then, for equal parts of the time; [] before there is a second result."""
        end_s = self._samples[-1][0]
        marks = [end_s * number / MOST_BINS for number in range(MOST_BINS + 1)]
        return [(last, (self._done_at(last) - self._done_at(first)) / (last - first)) for first, last in pairwise(marks)
                if last > first]  # fmt: skip

    def _done_at(self, at_s: float) -> float:
        """How many results there were at a moment: between two samples they are taken to have come evenly."""
        at = min(max(self._index(at_s), 1), len(self._samples) - 1)
        (first_s, first), (last_s, last) = self._samples[at - 1], self._samples[at]
        return first + (last - first) * min(max((at_s - first_s) / max(last_s - first_s, 1e-9), 0), 1)

    def _index(self, at_s: float) -> int:
        """The number of the first sample at a moment or behind it.  A campaign of a day has 170,000 of them."""
        return bisect_left(self._samples, at_s, key=lambda sample: sample[0])

    def as_dict(self) -> dict[str, Any]:
        """The progress for --json-lines."""
        left_s = self.left_s
        return {
            "state": self.state, "runs": self.runs, "done": self.done, "good": self.done - self.failing, "failing": self.failing,
            "elapsed_s": round(self.elapsed_s, 1), "rate": round(self.rate, 1), "present_rate": round(self.present_rate, 1),
            "left_s": None if left_s is None else round(left_s, 1),
            "groups": [{"kind": group.failure.kind, "text": group.failure.text, "file": group.failure.file,
                        "line": group.failure.line, "code": group.failure.code, "runs": group.runs, "first": group.first}
                       for group in self.groups],
        }  # fmt: skip


def _rate(samples: Sequence[tuple[float, int]]) -> float:
    (first_s, first), (last_s, last) = samples[0], samples[-1]
    return (last - first) / (last_s - first_s) if last_s > first_s else 0.0
