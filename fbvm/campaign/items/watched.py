"""Judges the PLCs of a test behind their scans, as those of a project: what never holds, always, or within a time."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

from fbvm.campaign.judge import TRAP, Failure, Judge
from fbvm.campaign.plan import Judging
from fbvm.run.running import Running
from fbvm.run.varied import VariedPlc, VariedRun
from fbvm.watch.conditions import ConditionError
from fbvm.watch.paths import UnknownPlace

PLC = "plc"
"""What the only PLC of a test is called."""


class Violated(AssertionError):
    """A condition of the campaign was violated in the middle of a test; `failure` says which."""

    def __init__(self, failure: Failure) -> None:
        super().__init__(f"{failure} behind scan {failure.scan} of {failure.plc}")
        self.failure = failure


class Watched:
    """Judges one run.  Conditions name variables as the test does; they count from the moment on in which all are there."""

    def __init__(self, judging: Judging) -> None:
        self._judging, self._known = judging, 0
        self.judge: Judge | None = None
        self.why = ""
        """Why no PLC is judged yet."""

    def __call__(self, run: VariedRun, now_ns: int) -> None:
        if len(run.plcs) != self._known and self.judge is None:
            self._known = len(run.plcs)
            try:
                self.judge = Judge(self._judging, _as_runs(run), alone=len(run.plcs) == 1)
            except (ConditionError, UnknownPlace, TypeError) as error:
                self.why = str(error)
        if self.judge and (seen := self.judge.look(now_ns)) and seen.failure.kind != TRAP:
            raise Violated(seen.failure)


def _as_runs(run: VariedRun) -> Mapping[str, Running]:
    """The PLCs of a test by their names; those of rigs are called plc, plc2 and so on."""
    names = [varied.name or f"{PLC}{number or ''}" for number, varied in enumerate(run.plcs)]
    return {name: cast(Running, _Run(varied)) for name, varied in zip(names, run.plcs, strict=True)}


class _Run:
    """A PLC of a test where the judge wants one that runs: its variables are found by the names that the test uses."""

    def __init__(self, varied: VariedPlc) -> None:
        self.plc, self.reason = _Named(varied), ""


class _Named:
    def __init__(self, varied: VariedPlc) -> None:
        self._varied = varied
        self.find = varied.find

    def __getattr__(self, name: str) -> Any:
        return getattr(self._varied.plc, name)
