"""Runs one test and keeps the recordings of its rigs, for a debugger that looks at them afterwards."""

from __future__ import annotations

import contextlib
import io
import sys
from collections.abc import Generator, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from fbvm.base.files import resolved
from fbvm.record.recording.recording import PlcRecording
from fbvm.testing.plugin import RIGS
from fbvm.testing.rig import Rig

OPTIONS = ("-q", "-p", "no:cacheprovider", "--capture=sys", "--no-header", "--import-mode=importlib")
"""The descriptors of the process stay as they are: a debugger speaks to its editor over them."""


@dataclass
class RecordedItem:
    """How a test ended, and what its PLCs did: by name the recording, and the texts of all sources by name."""

    output: str = ""
    """What pytest said."""
    failed: bool = False
    reason: str = ""
    """The last line of the failure, "" if the test passed."""
    recordings: dict[str, PlcRecording] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)


def record_item(node: str, folder: Path) -> RecordedItem:
    """Runs the test with that pytest node id in a folder.  Raises LookupError if there is none, or more than one."""
    kept = _Keeper()
    known = set(sys.modules)
    said = io.StringIO()
    with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said), contextlib.chdir(folder), _without_byte_code():
        code = pytest.main([*OPTIONS, node], [kept])
    for name in set(sys.modules) - known:  # they are imported anew, with what is changed until then
        if (file := getattr(sys.modules[name], "__file__", None)) and resolved(Path(file)).is_relative_to(resolved(folder)):
            del sys.modules[name]
    kept.item.output = said.getvalue()
    if code not in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED) or kept.count != 1:
        what = f"{kept.count} tests" if kept.count > 1 else "no test"
        raise LookupError(f"{node!r} is {what}: name one, such as tests/test_pump.py::test_it_stops\n{kept.item.output}")
    return kept.item


@contextlib.contextmanager
def _without_byte_code() -> Iterator[None]:
    """Byte code of modules is not kept: Python takes it for that of a file with the same size and the same second of change."""
    before, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        yield
    finally:
        sys.dont_write_bytecode = before


class _Keeper:
    """A plugin of pytest that keeps the rigs of a test."""

    def __init__(self) -> None:
        self.item = RecordedItem()
        self.count = 0

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(
        self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Called when a test has ended."""
        report = yield
        if call.when == "call":
            self.count += 1
            self.item.failed = report.failed
            if call.excinfo is not None and report.failed:
                self.item.reason = str(call.excinfo.value).strip().partition("\n")[0]
            for rig in item.stash.get(RIGS, []):
                self._keep(rig)
        return report

    def _keep(self, rig: Rig) -> None:
        if not rig._recorded.scans:
            return
        name, recordings = rig.subject.name, self.item.recordings
        recordings[name if name not in recordings else f"{name} {len(recordings) + 1}"] = rig._recorded
        self.item.texts |= rig.subject.texts
