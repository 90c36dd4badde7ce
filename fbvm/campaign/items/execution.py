"""Executes tests under the conditions of a run of a campaign; the same run again gives the same result.

One session of pytest does many runs.  The tests are collected anew for each, and all fixtures end with it, so that a run finds
nothing of the one before, but for what the modules of the tests keep by themselves."""

from __future__ import annotations

import io
import shutil
import zlib
from collections.abc import Callable, Generator, Sequence
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from os.path import relpath
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

import pytest

from fbvm.base.codes import CODES
from fbvm.campaign.execution import Result
from fbvm.campaign.items.watched import Violated, Watched
from fbvm.campaign.judge import TEST, TRAP, Failure
from fbvm.campaign.plan import CYCLE, PHASE, TIMING, VALUE, Judging, Plan
from fbvm.campaign.processes import Hopeless
from fbvm.campaign.pytest_session import run_pytest
from fbvm.campaign.variants import Variant
from fbvm.record.recording.file_writer import fingerprint
from fbvm.run.varied import Conditions, PowerCut, VariedPlc, VariedRun, Written
from fbvm.testing.rig import Trapped
from fbvm.testing.session import VARIED
from fbvm.testing.st_items import AssertFailed
from fbvm.watch.paths import Place, UnknownPlace
from fbvm.watch.values import Value, plain_value

NO_TESTS = 5
"""Exit status of pytest."""
Made = TypeVar("Made")


class NoTests(Hopeless):
    """The tests cannot be executed, or there are none, or none of their PLCs has what is varied; the message says which."""


def conditions_of(plan: Plan, variant: Variant) -> Conditions:
    """What a run varies in each test."""
    values = [(axis, variant.value(plan, number)) for number, axis in enumerate(plan.axes)]

    def of(what: str) -> tuple[tuple[str, Any], ...]:
        return tuple((axis.plc, value) for axis, value in values if axis.what == what)

    written = tuple(Written(axis.path, value, axis.at_ns) for axis, value in values if axis.what == VALUE)
    return Conditions(
        variant.seed, variant.timing, written,
        of(CYCLE), of(PHASE), of(TIMING), tuple(named.fault for named in variant.faults),
        tuple(PowerCut(cut.plc, cut.at_ns, cut.off_ns, cut.is_cold) for cut in variant.cuts),
    )  # fmt: skip


@dataclass
class ItemsExecution:
    """Executes the runs of a plan over the tests of a folder, in this process; `report` is what pytest said last."""

    plan: Plan
    folder: str
    report: str = ""

    def results(self, variants: Sequence[Variant]) -> list[Result]:
        """What comes of some runs.  Raises NoTests."""
        return self.within(lambda session: [session.result(variant) for variant in variants])

    def result(self, variant: Variant) -> Result:
        """What comes of a run.  Raises NoTests."""
        return self.results([variant])[0]

    def within(self, body: Callable[[ItemsSession], Made], *options: str) -> Made:
        """What `body` makes of a session of pytest, which with further `options` explains failures, too.  Raises NoTests."""
        made: list[Made] = []
        session, said = _Session(self.plan, lambda session: made.append(body(session))), io.StringIO()
        with chdir(self.folder), redirect_stdout(said), redirect_stderr(said):
            status = run_pytest([*options, *self.plan.tests], [session], explained=bool(options))
        self.report = said.getvalue().strip()
        if session.error:
            raise session.error
        if not made:
            why = "no test is there" if status == NO_TESTS else self.report or f"pytest ended with status {status}"
            raise NoTests(f"{' '.join(self.plan.tests)}: {why}")
        return made[0]

    def recorded(self, variant: Variant, path: Path) -> tuple[Result, list[Path]]:
        """Executes a run and leaves a trace of each PLC that it makes by a fixture: that of the one that scanned last at `path`,
        those of others beside it.  Returns the result and the files.  Raises NoTests, OSError."""
        path.unlink(missing_ok=True)  # of an earlier campaign: not every test leaves a trace
        with TemporaryDirectory() as folder:
            result = self.within(lambda session: session.result(variant), "--fbvm-traces", folder)
            traces = sorted(Path(folder).iterdir(), key=lambda trace: trace.stat().st_mtime_ns, reverse=True)
            kept = [path if not number else path.with_suffix(f".{number + 1}{path.suffix}") for number in range(len(traces))]
            for trace, target in zip(traces, kept, strict=True):
                shutil.copyfile(trace, target)
        return result, kept


class ItemsSession:
    """A session of pytest in which runs are executed."""

    def __init__(self, plan: Plan, session: pytest.Session) -> None:
        self._plan, self._session = plan, session
        self._is_collected = True
        self.failure: Failure | None = None

    def result(self, variant: Variant) -> Result:
        """What comes of a run: the first test that fails ends it.  Raises NoTests."""
        session, watched = self._session, Watched(self._plan.judging)
        run = VariedRun(conditions_of(self._plan, variant), judge=watched if self._plan.judging != Judging() else None)
        if not self._is_collected:
            session.perform_collect()
        self._is_collected, self.failure = False, None
        session.config.stash[VARIED] = run
        try:
            for item in session.items:
                item.config.hook.pytest_runtest_protocol(item=item, nextitem=None)
                if self.failure:
                    break
        finally:
            del session.config.stash[VARIED]
        names = {axis.path for axis in self._plan.axes if axis.what == VALUE}
        if (unknown := sorted(names - run.used)) and not self.failure:
            raise NoTests(f"no PLC that these tests make has {unknown[0]}")
        if run.judge and not watched.judge and not self.failure:
            why = f"the conditions fit no PLC that these tests make: {watched.why}"
            raise NoTests(why if run.plcs else "these tests make no PLC by a fixture, of which conditions could hold")
        return self._summed(variant, run)

    def _summed(self, variant: Variant, run: VariedRun) -> Result:
        checksum = 0
        for varied in run.plcs:
            checksum = zlib.crc32(b"%d" % fingerprint(varied.plc.memory.map[:]), checksum)
        failure = self.failure
        if failure and run.plcs:
            last = max(run.plcs, key=lambda varied: varied.plc.now_ns)
            failure = _placed(failure, last)
        return Result(variant.number, sum(varied.plc.scans for varied in run.plcs),
                      max((varied.plc.elapsed_ns for varied in run.plcs), default=0), checksum, failure,
                      tuple(_shown(run, name) for name in self._plan.shown))  # fmt: skip


def _placed(failure: Failure, varied: VariedPlc) -> Failure:
    """A failure with the last scan of the PLC that was the last one to scan."""
    return Failure(failure.kind, failure.text, varied.name or "plc", varied.plc.scans - 1, varied.plc.now_ns, failure.code,
                   failure.file, failure.pou, failure.line, failure.detail)  # fmt: skip


def _shown(run: VariedRun, name: str) -> Value:
    """The last value of a place of the first PLC that has it; "" if none has it."""
    for varied in run.plcs:
        owner, _, path = name.partition(".")
        try:
            place = varied.find(path if varied.name and owner == varied.name else name)
        except UnknownPlace:
            continue
        if isinstance(place, Place):
            return plain_value(place.type, varied.plc.read(place))
    return ""


@dataclass(eq=False)  # pytest puts plugins into sets
class _Session:
    """A plugin of pytest: in place of executing each test once, it has `body` execute runs."""

    plan: Plan
    body: Callable[[ItemsSession], None]
    error: Exception | None = None
    session: ItemsSession | None = None

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed:
            self.error = NoTests(f"{report.nodeid}: {report.longreprtext.strip()}")

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        if self.error or not session.items:
            return True
        self.session = ItemsSession(self.plan, session)
        try:
            self.body(self.session)
        except Exception as error:  # pytest would say it and go on
            self.error = error
        return True

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_makereport(
        self, item: pytest.Item, call: pytest.CallInfo[None]
    ) -> Generator[None, pytest.TestReport, pytest.TestReport]:
        """Keeps why the first test that fails has failed."""
        report = yield
        assert self.session
        if report.failed and not self.session.failure:
            self.session.failure = _failure(item, call, report)
        return report


def _failure(item: pytest.Item, call: pytest.CallInfo[None], report: pytest.TestReport) -> Failure:
    """A failure with the line that brought it: of the program for a trap or an ASSERT, else of the test."""
    error = call.excinfo.value if call.excinfo else None
    said = call.excinfo.exconly().splitlines()[0] if call.excinfo else report.longreprtext.splitlines()[-1]
    if isinstance(error, Trapped):
        site = error.trap.site
        return Failure(TRAP, CODES[error.trap.code].title, code=error.trap.code, file=site.file, pou=site.pou, line=site.line,
                       detail=f"{item.nodeid}: {said}")  # fmt: skip
    if isinstance(error, Violated):
        return replace(error.failure, file=Path(relpath(item.path)).as_posix(), line=_line(item, call), detail=item.nodeid)
    if isinstance(error, AssertFailed):
        return Failure(TEST, item.nodeid, file=error.site.file, pou=error.site.pou, line=error.site.line, detail=said)
    return Failure(TEST, item.nodeid, file=Path(relpath(item.path)).as_posix(), line=_line(item, call), detail=said)


def _line(item: pytest.Item, call: pytest.CallInfo[None]) -> int:
    """The line of a test in which it has failed; that of its beginning if none of its lines was executed."""
    own = [entry for entry in call.excinfo.traceback if Path(entry.path) == item.path] if call.excinfo else []
    return own[-1].lineno + 1 if own else (item.reportinfo()[1] or 0) + 1
