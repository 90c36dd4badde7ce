"""What a campaign shows of its progress while it runs: a page beside its results, and lines of JSON."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from fbvm.cli.shared.files import writing
from fbvm.cli.shared.terminal import named, say, say_json

if TYPE_CHECKING:
    from fbvm.campaign.execution import Result
    from fbvm.campaign.runs import Outcome

PAGE = "progress.html"
EVERY_NS = 1_000_000_000
"""How often page and lines are written at most."""


class ShownProgress:
    """The progress of a campaign, as the page `path` and, with `lines`, on standard output."""

    def __init__(self, outcome: Outcome, path: Path, lines: bool) -> None:
        from fbvm.campaign.progress import Progress
        from fbvm.run.time_limit import stopwatch, time_limit

        self._path, self._lines = path, lines
        self._progress = Progress(outcome.plan.count, stopwatch(), tuple(outcome.results.values()))
        self._pause = partial(time_limit, EVERY_NS)
        self._is_due = time_limit(-1)
        if sys.stderr.isatty():
            say(f"progress: {named(path)}", err=True)

    def add(self, found: Sequence[Result]) -> str:
        """Takes further results and shows them, if it is time; returns how far the campaign is, in words."""
        progress = self._progress
        progress.add(found)
        if self._is_due():
            self._write({})
            if self._lines:
                say_json(progress.as_dict())
            self._is_due = self._pause()
        return f"{progress.done:,} of {progress.runs:,} runs, {progress.failing:,} failing, {progress.present_rate:.0f} a second,"

    def end(self, recordings: Mapping[int, str]) -> None:
        """Writes the page of a campaign that is over, or was interrupted."""
        from fbvm.campaign.progress import INTERRUPTED, OVER

        self._progress.state = OVER if self._progress.done == self._progress.runs else INTERRUPTED
        self._write(recordings)

    def _write(self, recordings: Mapping[int, str]) -> None:
        from fbvm.base.files import write_file
        from fbvm.campaign.progress_page import progress_page

        with writing(self._path):
            write_file(self._path, progress_page(self._progress, "Campaign", recordings))
