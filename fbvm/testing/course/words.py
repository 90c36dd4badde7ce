"""A plugin of pytest for checks of lessons: a failed check is a sentence, without a traceback; what is said of scans stays."""

from __future__ import annotations

from collections.abc import Generator

import pytest

from fbvm.testing.course.lessons import mistake


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Puts the sentence in the place of the traceback; an error of another kind keeps it."""
    report = yield
    if report.failed and call.excinfo is not None and call.excinfo.errisinstance(AssertionError):
        report.longrepr = mistake(item.name, str(call.excinfo.value))
    return report
