"""A project of TwinCAT whose program runs suites (`.plcproj`), as a file of tests: each TEST('name') of each suite is one.

The program runs once for all its tests, in virtual time.  TcUnit's own sources are taken where the ini option fbvm_libraries
names a folder with its project; without them fbvm's library stands in its place (`fblib/twincat/tcunit`)."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest

from fbvm.base.diagnostics import Source
from fbvm.base.dialects import dialect as named_dialect
from fbvm.code.compiler import compile_sources
from fbvm.interchange.formats.given import sources_by_name
from fbvm.interchange.twincat import PROJECT_SUFFIX
from fbvm.interchange.twincat.project import read_project
from fbvm.record.recording.recording import PlcRecording
from fbvm.testing.pages import write_page
from fbvm.testing.session import failure_page
from fbvm.testing.subject import Subject, SubjectError
from fbvm.testing.suites.program import FoundTest, find_suites
from fbvm.testing.suites.results import Failure, SuiteRun, SuiteTestResult, run_suites
from fbvm.watch.values import show_time

DIALECT = "twincat"
OTHERS = "(others)"
"""The test for all those whose names are no literals."""
FILES: pytest.StashKey[list[SuitesFile]] = pytest.StashKey()


class SuitesFile(pytest.File):
    """One project."""

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        self.sources: list[Source] = []
        self.suites: list[str] = []
        self.run: SuiteRun | None = None
        self.subject: Subject | None = None
        self._wrong = ""

    def collect(self) -> Iterator[SuiteItem]:
        path = _shown(self.path)
        project = read_project(path)
        used = [Source(name, text) for name, text in sources_by_name({path: project}).items()
                if name not in project.files and isinstance(text, str)]
        found = find_suites(project.sources, used)
        if not found:
            return
        if project.errors:
            raise self.CollectError("\n".join(message.render() for message in project.errors))
        known = {source.name for source in used}
        libraries = [each for each in self._libraries(project.references) if each.name not in known]
        self.sources = [*libraries, *used, *project.sources]
        self.suites = [suite.path for suite in found]
        self.session.stash.setdefault(FILES, []).append(self)
        for suite in found:
            for test in suite.tests:
                yield SuiteItem.from_parent(self, name=f"{suite.path}::{test.name}", suite=suite.path, test=test)
            if suite.has_others:
                others = FoundTest(OTHERS, str(self.path), 1)
                yield SuiteItem.from_parent(self, name=f"{suite.path}::{OTHERS}", suite=suite.path, test=others)

    def _libraries(self, names: Sequence[str]) -> Iterator[Source]:
        """The sources of the libraries that the project refers to, as far as there are projects of them."""
        for folder in self.config.getini("fbvm_libraries"):
            for path in sorted(path for path in Path(folder).rglob(f"*{PROJECT_SUFFIX}") if path.stem in names):
                yield from read_project(_shown(path)).sources

    def results(self) -> SuiteRun:
        """The results of the run, which takes place at the first call.  Raises SubjectError if the program has errors."""
        if self._wrong:
            raise SubjectError(self._wrong)
        if self.run is None:
            made = compile_sources(self.sources, runnable=True, dialect=named_dialect(DIALECT).name)
            if made.image is None:
                self._wrong = "\n".join(message.render() for message in made.errors)
                raise SubjectError(self._wrong)
            self.subject = Subject(self.path.stem, made.image, "", {source.name: source for source in self.sources})
            self.run = run_suites(made.image, self.suites)
        return self.run


def _shown(path: Path) -> Path:
    """A path as messages show it: from the present folder on where that is shorter."""
    try:
        return min(path, Path(os.path.relpath(path)), key=lambda each: len(str(each)))
    except ValueError:  # on another drive
        return path


class SuiteTestFailed(AssertionError):
    """A test has failed: its suite, and what its assertions said."""

    def __init__(self, suite: str, name: str, failures: list[Failure], said: str) -> None:
        super().__init__(said)
        self.suite, self.name, self.failures = suite, name, failures
        self.page = ""


class SuiteItem(pytest.Item):
    """One test of one suite."""

    parent: SuitesFile

    def __init__(self, *, suite: str, test: FoundTest, **given: Any) -> None:
        super().__init__(**given)
        self.suite, self.test = suite, test
        if test.skipped:
            self.add_marker(pytest.mark.skip(reason=f"its name begins with disabled_: {test.name}"))

    def runtest(self) -> None:
        run = self.parent.results()
        for name, result in self._results(run):
            self.user_properties += [("plc_seconds", result.duration_s), ("assertions", result.asserts)]
            if result.failed:
                raise self._failed(name, result.recorded, result.failures, "an assertion failed")
            if not result.finished and not result.skipped:
                raise self._failed(name, run.recorded, [], self._unfinished(run))

    def _results(self, run: SuiteRun) -> list[tuple[str, SuiteTestResult]]:
        """The results that this test is about, by name."""
        own = {name: result for (suite, name), result in run.results.items() if suite == self.suite}
        if self.test.name == OTHERS:
            named = {item.test.name for item in self.session.items if isinstance(item, SuiteItem) and item.suite == self.suite}
            return [(name, result) for name, result in own.items() if name not in named]
        if self.test.name not in own:
            stopped = f"not executed: the program stopped: {run.plc.trap}" if run.plc.trap else "the suite never executed it"
            raise self._failed(self.test.name, run.recorded, [], stopped)
        return [(self.test.name, own[self.test.name])]

    def _unfinished(self, run: SuiteRun) -> str:
        if run.plc.trap:
            return f"not finished: the program stopped: {run.plc.trap}"
        return f"TEST_FINISHED was never reached within {show_time(run.plc.elapsed_ns)[2:]} of the PLC's time"

    def _failed(self, name: str, recorded: PlcRecording | None, failures: list[Failure], said: str) -> SuiteTestFailed:
        made = SuiteTestFailed(self.suite, name, failures, said)
        subject = self.parent.subject
        assert subject is not None
        said = self._said(made)
        if recorded is not None:
            made.page = failure_page(self, "", lambda path: write_page(path, self.nodeid, recorded, subject, [], said))
        return made

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        error = excinfo.value
        if isinstance(error, SuiteTestFailed):
            return "\n\n".join(part for part in (self._said(error), error.page) if part)
        return str(error) if isinstance(error, SubjectError) else super().repr_failure(excinfo, style)

    def _said(self, error: SuiteTestFailed) -> str:
        """Each failed assertion with its place and its statement; what is said of a test without one."""
        head = f"{self.test.file}:{self.test.line}: in {error.suite}, test {error.name}"
        if not error.failures:
            return f"{head}\nE   {error}"
        lines = []
        for failure in error.failures:
            when = f"scan {failure.scan} ({show_time(failure.now_ns)[2:]})"
            site = failure.site
            file, number = (site.file, site.line) if site else (self.test.file, self.test.line_of(failure.text))
            if number is None:
                lines += [f"{head}, {when}", f"E   {failure.text}"]
                continue
            subject = self.parent.subject
            line = subject.line(file, number) if subject is not None else ""
            lines += [f"{file}:{number}: in {error.suite}, test {error.name}, {when}", f">   {line}", f"E   {failure.text}"]
        return "\n".join(lines)

    def reportinfo(self) -> tuple[Path, int | None, str]:
        return Path(self.test.file), self.test.line - 1, self.name
