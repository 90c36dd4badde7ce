"""One run of a program of suites in virtual time: what became of each test, and where its assertions failed.

What a test is called, whether it is finished, failed or skipped, how many assertions it made and how long it took is read from
the suites, whose variables TcUnit and fbvm's own library call alike.  Texts and times of failures are those of the log."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from fbvm.code.image import Image, Site
from fbvm.machine.plc import Phase, Plc
from fbvm.record.recording.recording import PlcRecording, Recording
from fbvm.record.trace.events import Call, Event

LIMIT_NS = 60_000_000_000
"""Virtual time after which suites that are not finished count as never finishing."""
CYCLE_NS = 10_000_000
BUDGET = 1 << 32
"""Steps of a cycle: TcUnit's own bookkeeping takes some thousand for each assertion."""
ERROR = 4
"""The kind of message that a failed assertion writes."""
LAST = "| ====================================="
LOG, COUNT, KEPT = "TwinCAT_Log", "TwinCAT_LogCount", 256
OWN = "TcUnit_Execute"
"""A function that only fbvm's own library of suites has."""
_FAILED = re.compile(r"FAILED TEST '(.+)@(.*?)', (EXP: .*)", re.S)
_ASSERTS, _FAILS = "FB_TESTSUITE.ASSERT", "FB_TESTSUITE.SETTESTFAILED"


@dataclass
class Failure:
    """A failed assertion: its text, the scan in which it was written and when that began, its place if that is known."""

    text: str
    scan: int
    now_ns: int
    site: Site | None = None


@dataclass
class SuiteTestResult:
    """What became of a test."""

    finished: bool
    failed: bool
    skipped: bool
    asserts: int
    duration_s: float
    failures: list[Failure] = field(default_factory=list)


@dataclass
class SuiteRun:
    """The results of one run, by path of the suite and name of the test."""

    plc: Plc
    recorded: PlcRecording | None
    """Its scans.  None where TcUnit itself runs the suites: that executes some hundred thousand statements for each failed
    assertion, and tells of it some cycles later, so that nothing of its run is executed again to be shown."""
    results: dict[tuple[str, str], SuiteTestResult]
    is_over: bool
    """False if the run was ended by a trap or by the limit."""


def run_suites(image: Image, suites: Sequence[str], limit_ns: int = LIMIT_NS) -> SuiteRun:
    """Runs a program until its suites have reported, or the limit is reached.

    image: a program that runs suites.  suites: their paths.  limit_ns: virtual time."""
    intervals = [task.interval_ns for task in image.tasks if task.interval_ns]
    plc = Plc(image, min(intervals, default=CYCLE_NS), budget=BUDGET)
    is_light = any(body.name == OWN for body in image.bodies)
    recorded = Recording().add("suites", plc) if is_light else None
    failures: list[tuple[str, str, Failure]] = []
    seen, is_over = 0, False
    while not is_over and plc.elapsed_ns < limit_ns and plc.scan() is None:
        count = _number(plc, COUNT)
        for number in range(max(seen, count - KEPT), count):
            text = str(plc.read(f"{LOG}[{number % KEPT}].Text"))
            is_over = is_over or text.startswith(LAST)
            if (match := _FAILED.match(text)) and plc.read(f"{LOG}[{number % KEPT}].Mask") == ERROR:
                failures.append((match[1], match[2], Failure(match[3], plc.scans - 1, plc.now_ns)))
        seen = count
    if recorded is not None:
        _place(recorded, [each for _, _, each in failures])
    results = {(path, name): result for path in suites for name, result in _results(plc, path)}
    for path, name, failure in failures:
        if (path, name) in results:
            results[path, name].failures.append(failure)
    return SuiteRun(plc, recorded, results, is_over)


def _results(plc: Plc, suite: str) -> Iterator[tuple[str, SuiteTestResult]]:
    for number in range(1, _number(plc, f"{suite}.NumberOfTests") + 1):
        at = f"{suite}.Tests[{number}]"
        finished, failed, skipped = (plc.read(f"{at}.TestIs{name}") is True for name in ("Finished", "Failed", "Skipped"))
        duration = plc.read(f"{at}.Duration")
        assert isinstance(duration, float)
        yield str(plc.read(f"{at}.TestName")), SuiteTestResult(
            finished, failed, skipped, _number(plc, f"{at}.NumberOfAssertions"), duration)


def _number(plc: Plc, path: str) -> int:
    value = plc.read(path)
    assert isinstance(value, int)
    return value


# --- where assertions failed --------------------------------------------------------------------------------------------


MOST_PLACED = 50
"""Scans with failures that are executed again to see where they failed."""


def _place(recorded: PlcRecording, failures: list[Failure]) -> None:
    """Finds the places of failed assertions by executing their scans again."""
    for scan in list(dict.fromkeys(each.scan for each in failures))[:MOST_PLACED]:
        here = [each for each in failures if each.scan == scan]
        seen = _Assertions(recorded.plc)
        recorded.follow(seen, range(scan, scan + 1))
        if len(seen.failed) == len(here):
            for failure, site in zip(here, seen.failed, strict=True):
                failure.site = site


class _Assertions:
    """Listens to a scan: where the assertions that failed were called, in order."""

    def __init__(self, plc: Plc) -> None:
        self._sites = plc.image.sites
        names = {number: body.name.upper() for number, body in enumerate(plc.image.bodies)}
        self._asserting = {number for number, name in names.items() if name.startswith(_ASSERTS)}
        self._failing = {number for number, name in names.items() if name == _FAILS}
        self._last: Site | None = None
        self.failed: list[Site | None] = []

    def phase(self, plc: Plc, phase: Phase) -> None:
        """Nothing happens between the phases of a scan."""

    def event(self, plc: Plc, event: Event) -> None:
        """Notes calls of assertions, and of what one that failed calls."""
        if isinstance(event, Call):
            if event.frame.body in self._asserting:
                self._last = self._sites[event.frame.site]
            elif event.frame.body in self._failing:
                self.failed.append(self._last)
