"""Tests written in Structured Text: each PROGRAM of a `test_*.st` is one, and calls ASSERT(condition).

A program is executed in one scan, or, if it declares a BOOL called Done, scan by scan until Done is TRUE.  The first
ASSERT with a FALSE condition ends it.  Blocks are found by the names of their files.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from fbvm.base.diagnostics import Source, errors
from fbvm.base.memory import WHOLE_BYTES
from fbvm.base.types import BOOL, fold
from fbvm.code.image import Site
from fbvm.engine.observation import NO_SITE
from fbvm.machine.counting import Counting, counting
from fbvm.machine.plc import Phase, Plc
from fbvm.record.draw.table import ScanTable
from fbvm.record.recording.recording import Recording
from fbvm.record.trace.branches import statements
from fbvm.record.trace.events import Call, Event, Frame, Read, Statement, Write
from fbvm.record.trace.observing import observing
from fbvm.record.trace.recorder import Signal
from fbvm.run.varied import VariedPlc
from fbvm.syntax import tree
from fbvm.syntax.parser import parse
from fbvm.syntax.text import read
from fbvm.testing.pages import write_page
from fbvm.testing.rig import Trapped
from fbvm.testing.session import add_coverage, covered, explains, failure_page, library_folders, varied_run
from fbvm.testing.subject import LIBRARY, Subject, SubjectError, subject
from fbvm.testing.warning_plugin import warning_plugin
from fbvm.watch.names import Names, is_single
from fbvm.watch.paths import Place
from fbvm.watch.values import Value, show_time

CYCLE_NS = 10_000_000
LIMIT_NS = 60_000_000_000
BANDS, LOOKED_BACK = 4, 100
ASSERT = fold("ASSERT")


class AssertFailed(AssertionError):
    """The condition of an ASSERT was FALSE: its position, the scan, the values that it had read, the scan table before it."""

    def __init__(self, site: Site, scan: int, now_ns: int, values: list[tuple[Signal, Value]]) -> None:
        super().__init__(f"{site}: ASSERT failed in scan {scan}")
        self.site, self.scan, self.now_ns, self.values = site, scan, now_ns, values
        self.table = self.page = ""


class StFile(pytest.File):
    """One file of tests."""

    def collect(self) -> Iterator[StItem]:
        source = read(self.path, self.path.name)
        if not isinstance(source, Source):
            raise self.CollectError(source.render())
        text, diagnostics = parse(source)
        programs = [node for node in text.declarations if isinstance(node, tree.Pou) and node.kind == "PROGRAM"]
        wrong = errors(diagnostics)
        inside = [each for each in wrong if any(node.start < each.start <= node.end for node in programs)]
        if wrong and (len(programs) < 2 or len(inside) < len(wrong)):
            raise self.CollectError("\n".join(message.render() for message in wrong))
        for node in programs:
            yield StItem.from_parent(self, name=node.name.text, line=source.place(node.start)[0])


class StItem(pytest.Item):
    """One program."""

    def __init__(self, *, line: int, **given: Any) -> None:
        super().__init__(**given)
        self.line = line
        self.subject: Subject | None = None

    def runtest(self) -> None:
        near = [self.path.parent] if self.path.parent != self.config.rootpath else []
        shelves = [LIBRARY, *library_folders(self.config, self.path), *near]
        warnings = warning_plugin(self.config)
        dialect = self.config.getini("fbvm_dialect") or "standard"
        compiled = partial(subject, [self.path], self.name, shelves, wanted=warnings.wanted, dialect=dialect)
        try:
            made = compiled()
        except SubjectError:
            made = compiled(alone=True)  # what is wrong with other programs is said by their tests
        self.subject = made
        warnings.add(made)
        varied = varied_run(self.config)
        plc = Plc(made.image, varied.cycle_ns("", CYCLE_NS) if varied else CYCLE_NS)
        watch = Assertions(plc, made.prefix)
        recorded = Recording().add(self.name, plc)
        disturbed = varied.made("", plc, lambda name: plc.find(made.path(name)), None) if varied else None
        try:
            with counting(plc, watch.files | covered(self.config, made)) as counts:
                try:
                    _run(plc, watch, counts, f"{made.prefix}Done", disturbed)
                finally:
                    add_coverage(self.config, made, counts)
        except AssertFailed as failed:
            if not explains(self.config):
                raise
            table = ScanTable(plc.image.sites, watch.names, [signal for signal, _ in failed.values])
            recorded.follow(table, range(max(0, failed.scan - LOOKED_BACK), failed.scan + 1))
            failed.table = table.draw([band for band in table.bands if band.has_changes][-BANDS:]) if failed.values else ""
            asked, said = [signal.place for signal, _ in failed.values], self._assertion(failed)
            failed.page = failure_page(self, "", lambda path: write_page(path, self.nodeid, recorded, made, asked, said))
            raise
        if not counts.executed().get(watch.called):
            raise AssertionError(f"{self.name} ended without one ASSERT")

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException], style: Any = None) -> Any:
        error = excinfo.value
        if isinstance(error, AssertFailed) and self.subject:
            return "\n\n".join(part for part in (self._assertion(error), error.table, error.page) if part)
        if isinstance(error, Trapped | AssertionError | SubjectError):
            return str(error)
        return super().repr_failure(excinfo, style)

    def _assertion(self, error: AssertFailed) -> str:
        """The place and the statement of a failed ASSERT, and the values that its condition had read."""
        site, name = error.site, error.site.file
        line = self.subject.line(name, site.line) if self.subject else ""
        return "\n".join([f"{name}:{site.line}: in {site.pou}, scan {error.scan} ({show_time(error.now_ns)[2:]})", f">   {line}",
                          *(f"E   {signal.label} = {signal.text(value)}" for signal, value in error.values)])  # fmt: skip

    def reportinfo(self) -> tuple[Path, int | None, str]:
        return self.path, self.line - 1, self.name


def _run(plc: Plc, watch: Assertions, counts: Counting, done: str, varied: VariedPlc | None) -> None:
    """Executes one scan, or, for a program with Done, scans until Done is TRUE; `varied` is what a campaign varies.

    A scan in which an ASSERT has failed is done again, for `watch` to see."""
    program = plc.find(done.rpartition(".")[0])
    assert isinstance(program, Place)
    field = program.type.member("Done")  # type: ignore[attr-defined]
    waits = field is not None and field.type is BOOL
    failures, before = counts.counters_at(watch.failing), counts.read()
    while True:
        if varied:
            varied.before_scan()
        now_ns, state = varied.elapsed_ns if varied else None, plc.snapshot()
        trap = plc.scan(now_ns)
        after = counts.read()
        if any(after[number] for number in failures):
            plc.restore(state)
            counts.back_to(before)
            with observing(plc, watch, stands_still=True):  # what stands behind the ASSERT is not executed
                plc.scan(now_ns)
        before = after
        if trap:
            raise Trapped(trap)
        if varied:
            varied.after_scan()
        if not waits or plc.read(done):
            return
        if plc.elapsed_ns >= LIMIT_NS:
            raise AssertionError(f"Done is still FALSE after {show_time(LIMIT_NS)[2:]}")


class Assertions:
    """A listener that raises AssertFailed at the first ASSERT whose condition is FALSE."""

    def __init__(self, plc: Plc, prefix: str) -> None:
        self._prefix = prefix
        inside = [number for number in statements(plc.image) if fold(plc.image.sites[number].pou) == ASSERT]
        self.called, self.failing = inside or (NO_SITE, NO_SITE)
        """The sites of its IF, and of its RETURN, which is executed if the condition is FALSE."""
        self.files = {plc.image.sites[number].file for number in inside}
        """The file that it stands in."""
        self.names = Names.of(plc.image, plc.memory.areas)
        self._bodies = {number for number, body in enumerate(plc.image.bodies) if fold(body.name) == ASSERT}
        self._reads: dict[Frame, list[Place]] = {}
        self._seen: dict[Place, None] = {}
        self._last: Write | None = None

    def phase(self, plc: Plc, phase: Phase) -> None:
        self._reads.clear()

    def event(self, plc: Plc, event: Event) -> None:
        if isinstance(event, Statement):
            self._reads[event.frame] = []
        elif isinstance(event, Read):
            place = self.names.at(event.offset, None if event.bit == WHOLE_BYTES else event.bit)
            if place is not None and is_single(place):
                self._reads.setdefault(event.frame, []).append(place)
        elif isinstance(event, Write):
            self._last = event
        elif isinstance(event, Call) and event.frame.body in self._bodies:
            assert self._last is not None and event.frame.caller is not None
            if self._last.value == b"\0":
                self._fail(plc, event.frame)

    def _fail(self, plc: Plc, frame: Frame) -> None:
        assert frame.caller is not None
        places = self._reads.get(frame.caller, [])
        signals = [Signal(place, place.name.removeprefix(self._prefix)) for place in dict.fromkeys(places)]
        values = [(signal, self.names.read(plc.read, signal.place)) for signal in signals]
        raise AssertFailed(plc.image.sites[frame.site], plc.scans, plc.now_ns, values)
