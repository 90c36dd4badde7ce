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
from fbvm.watch.paths import Place, UnknownPlace, find

LIMIT_NS = 60_000_000_000
"""Virtual time after which suites that are not finished count as never finishing."""
CYCLE_NS = 10_000_000
BUDGET = 1 << 32
"""Steps of a cycle: TcUnit's own bookkeeping takes some thousand for each assertion."""
ERROR = 4
"""The kind of message that a failed assertion writes."""
LAST = "| ====================================="
LOG, COUNT, KEPT = "TwinCAT_Log", "TwinCAT_LogCount", 256
MOST_TESTS = 100
"""Tests of a suite that are looked at while TcUnit runs it."""
MOST_AGAIN, MOST_TOGETHER, BEFORE = 10, 5, 20
"""With TcUnit's own sources: scans that are done again to be shown, tests that may fail in one of them, scans in front of it."""
OWN = "TcUnit_Execute"
"""A function that only fbvm's own library of suites has."""
_FAILED = re.compile(r"FAILED TEST '(.+)@(.*?)', (EXP: .*)", re.S)
_ASSERTS = ("FB_TESTSUITE.ASSERT", "TCUNIT_VALUES.ASSERT")
_FAILS = ("FB_TESTSUITE.SETTESTFAILED", "TCUNIT_SUITE.SETTESTFAILED")


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
    recorded: PlcRecording | None = None
    """The scans to show of it if it failed: all of the run, with TcUnit's own sources those up to the one in which it failed."""


@dataclass
class SuiteRun:
    """The results of one run, by path of the suite and name of the test."""

    plc: Plc
    recorded: PlcRecording | None
    """Its scans.  None where TcUnit itself runs the suites, whose memory of a hundred megabytes takes long to keep."""
    results: dict[tuple[str, str], SuiteTestResult]
    is_over: bool
    """False if the run was ended by a trap or by the limit."""


def run_suites(image: Image, suites: Sequence[str], limit_ns: int = LIMIT_NS) -> SuiteRun:
    """Runs a program until its suites have reported, or the limit is reached.

    image: a program that runs suites.  suites: their paths.  limit_ns: virtual time."""
    plc = _plc(image)
    is_light = any(body.name == OWN for body in image.bodies)
    recorded = Recording().add("suites", plc) if is_light else None
    log, failed_in = _Log(plc), _FailedIn(plc, () if is_light else suites)
    while not log.is_over and plc.elapsed_ns < limit_ns and plc.scan() is None:
        failed_in.look()
        log.look()
    if recorded is not None:
        _place(recorded, [each for _, _, each in log.failures])
    tests = {(path, number): (name, result) for path in suites for number, (name, result) in enumerate(_results(plc, path), 1)}
    results = {(path, name): result for (path, _), (name, result) in tests.items()}
    for result in results.values():
        result.recorded = recorded
    for path, name, failure in log.failures:
        if (path, name) in results:
            results[path, name].failures.append(failure)
    _show_again(image, [(scan, tests[key][1]) for key, scan in failed_in.scans.items() if key in tests])
    return SuiteRun(plc, recorded, results, log.is_over)


class _Log:
    """What suites write into the log: failures, and the line that ends the report."""

    def __init__(self, plc: Plc) -> None:
        self.plc = plc
        self.is_over = False
        self.failures: list[tuple[str, str, Failure]] = []
        """Path of the suite, name of the test, and the failure."""
        self._seen = 0

    def look(self) -> None:
        """Read what was written in the last scan."""
        plc = self.plc
        count = _number(plc, COUNT)
        for number in range(max(self._seen, count - KEPT), count):
            text = str(plc.read(f"{LOG}[{number % KEPT}].Text"))
            self.is_over = self.is_over or text.startswith(LAST)
            if (match := _FAILED.match(text)) and plc.read(f"{LOG}[{number % KEPT}].Mask") == ERROR:
                self.failures.append((match[1], match[2], Failure(match[3], plc.scans - 1, plc.now_ns)))
        self._seen = count


class _FailedIn:
    """Notes the scan in which each test has failed, by the path of its suite and its number."""

    def __init__(self, plc: Plc, suites: Sequence[str]) -> None:
        self.plc = plc
        self.scans: dict[tuple[str, int], int] = {}
        self._flags = _flags(plc, suites)

    def look(self) -> None:
        """Look at the flags of all tests."""
        memory, scan = self.plc.memory.u8, self.plc.scans - 1
        failed = [key for key, at in self._flags.items() if memory[at]]
        for key in failed:
            self.scans[key] = scan
            del self._flags[key]


def _plc(image: Image) -> Plc:
    """A PLC at the cycle of its quickest task."""
    intervals = [task.interval_ns for task in image.tasks if task.interval_ns]
    return Plc(image, min(intervals, default=CYCLE_NS), budget=BUDGET)


def _flags(plc: Plc, suites: Sequence[str]) -> dict[tuple[str, int], int]:
    """Where in the memory it stands whether a test has failed, by the path of its suite and its number."""
    found = {}
    for suite in suites:
        for before in range(MOST_TESTS):
            number = before + 1
            try:
                place = find(plc.image.symbols, plc.memory.areas, f"{suite}.Tests[{number}].TestIsFailed")
            except UnknownPlace:
                break
            if isinstance(place, Place) and place.bit is None and not place.hops:
                found[suite, number] = place.offset
    return found


def _show_again(image: Image, failed: list[tuple[int, SuiteTestResult]]) -> None:
    """Does the run again up to the first scans in which tests failed, which are recorded, and finds their places in them.

    failed: scans and the tests that failed in them.  TcUnit tells of a failure some cycles later, and executes some hundred
    thousand statements for it: scans in which many assertions fail are left out."""
    for scan in sorted({scan for scan, _ in failed})[:MOST_AGAIN]:
        here = [test for each, test in failed if each == scan]
        failures = [failure for test in here for failure in test.failures]
        if len(failures) > MOST_TOGETHER:
            continue
        plc = _plc(image)
        plc.run(scans=max(scan - BEFORE, 0))
        recorded = Recording().add("suites", plc)
        plc.run(scans=scan + 1 - plc.scans)
        for failure in failures:
            failure.scan, failure.now_ns = scan, plc.now_ns
        _place(recorded, failures)
        for test in here:
            test.recorded = recorded


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
        self._failing = {number for number, name in names.items() if name in _FAILS}
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
