"""Results of suites as TcUnit writes them: its form of xUnit, in which `tests` of the whole is the number of successful tests.

Source: TcUnit's user guide, xUnit reports; elements and attributes in the order of its FB_xUnitXmlPublisher."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

from fbvm.base.files import write_file
from fbvm.testing.suites.results import SuiteRun, SuiteTestResult


def write_xunit(path: Path, runs: Sequence[SuiteRun]) -> None:
    """Writes the results of all runs into one file.  Raises OSError."""
    write_file(path, "".join(_lines(runs)))


def _lines(runs: Sequence[SuiteRun]) -> Iterator[str]:
    results = [result for run in runs for result in run.results.values()]
    failed = sum(result.failed for result in results)
    seconds = sum(run.plc.elapsed_ns for run in runs) / 1e9
    yield '<?xml version="1.0" encoding="UTF-8"?>'
    yield f'<testsuites disabled="" failures="{failed}" tests="{len(results) - failed}" time="{seconds}">'
    suites = [(run, suite) for run in runs for suite in dict.fromkeys(suite for suite, _ in run.results)]
    for number, (run, suite) in enumerate(suites):
        own = {name: result for (path, name), result in run.results.items() if path == suite}
        time = max(result.duration_s for result in own.values())
        yield (f'<testsuite id="{number}" name={quoteattr(suite)} tests="{len(own)}" '
               f'failures="{sum(result.failed for result in own.values())}" time="{time}">')
        for name, result in own.items():
            yield from _case(suite, name, result)
        yield "</testsuite>"
    yield "</testsuites>"


def _case(suite: str, name: str, result: SuiteTestResult) -> Iterator[str]:
    status = "FAIL" if result.failed else "SKIP" if result.skipped else "PASS"
    yield f'<testcase name={quoteattr(name)} classname={quoteattr(suite)} time="{result.duration_s}" status="{status}">'
    if result.failed:
        message = result.failures[0].text if result.failures else ""
        yield f'<failure message={quoteattr(message)} type=""></failure>'
    yield "</testcase>"
