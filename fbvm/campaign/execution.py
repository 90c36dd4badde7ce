"""Executes one run of a campaign, in virtual time; the same run again gives the same result, to the bit."""

from __future__ import annotations

import zlib
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from fbvm.base.diagnostics import Diagnostic, errors
from fbvm.campaign.judge import Failure, Judge, Seen
from fbvm.campaign.plan import VALUE, Plan
from fbvm.campaign.variants import Cut, Variant, phase_ns, project_of, settings_of
from fbvm.code.image import Image
from fbvm.record.draw.why import why
from fbvm.record.recording.file_writer import fingerprint
from fbvm.record.recording.recording import Recording
from fbvm.record.recording.scans import RecordedScans
from fbvm.run.plant import Plant, value_for
from fbvm.run.plc_names import PlcNames
from fbvm.run.running import Running
from fbvm.watch.paths import Place
from fbvm.watch.values import Value, plain_value


@dataclass(frozen=True, slots=True)
class Result:
    """What came of a run: scans of all PLCs together, the time in which the PLCs stood at the end, values, and a checksum of the
    memory of all PLCs."""

    number: int
    scans: int = 0
    time_ns: int = 0
    memory: int = 0
    failure: Failure | None = None
    shown: tuple[Value, ...] = ()


class Wrong(Exception):
    """A campaign that cannot be executed: its project has errors, which `diagnostics` say."""

    def __init__(self, diagnostics: Sequence[Diagnostic]) -> None:
        super().__init__("\n".join(each.render() for each in diagnostics))
        self.diagnostics = diagnostics


@dataclass
class Execution:
    """Executes runs of a plan; `images` are the compiled programs of its PLCs, by their names in the project."""

    plan: Plan
    images: Mapping[str, Image]
    traces: dict[str, str] = field(default_factory=dict)
    """The golden traces of the last run, by their files."""

    def result(self, variant: Variant) -> Result:
        """What comes of a run.  A run that fails is executed again, to find out which statement has brought that."""
        found, seen = self._run(variant, None)
        if seen is None or not seen.changed:
            return found
        recording = Recording()
        self._run(variant, lambda plant: _all_recorded(plant, recording))
        return replace(found, failure=_with_line(seen, recording))

    def recorded(self, variant: Variant, begin: Callable[[Plant], Recording]) -> Result:
        """Executes a run that `begin` records."""
        return self._run(variant, begin)[0]

    def _run(self, variant: Variant, begin: Callable[[Plant], Recording] | None) -> tuple[Result, Seen | None]:
        plant = Plant(project_of(self.plan, variant), for_ns=self.plan.for_ns, images=self.images)
        if wrong := errors(plant.diagnostics):
            raise Wrong(wrong)
        runs = plant.named_runs
        try:
            recording = begin(plant) if begin else None
            judge = Judge(self.plan.judging, runs, self.plan.alone)
            seen = self._execute(plant, runs, judge, variant)
            if recording:
                recording.close()
            failure = seen.failure if seen else judge.ended()
            self.traces = {golden.file: text for golden, text in judge.traces()} if self.plan.judging.goldens else {}
            return self._summed(variant, runs, failure), seen
        finally:
            plant.close()

    def _execute(self, plant: Plant, runs: Mapping[str, Running], judge: Judge, variant: Variant) -> Seen | None:
        """Scans all PLCs in the order of time, until the end or the first failure."""
        self._begin(plant, variant)
        rows = {name: kind.row.name for kind in plant.kinds for name in kind.names}
        cuts = deque(variant.cuts)
        ends = [run for kind in plant.kinds if kind.row.until is not None for run in kind.runs]
        going = list(runs.values())
        while going and not (ends and all(run.reason for run in ends)):
            now_ns = min(run.due_ns for run in going)
            if cuts and cuts[0].at_ns <= now_ns:
                self._cut(cut := cuts.popleft(), runs[cut.plc], rows[cut.plc], variant)
                continue
            for run in going:
                if run.due_ns == now_ns:
                    run.scan(now_ns)
            if seen := judge.look(now_ns):
                return seen
            if judge.reached:
                return None
            going = [run for run in going if not run.reason]
        return None

    def _begin(self, plant: Plant, variant: Variant) -> None:
        for kind in plant.kinds:
            later_ns = phase_ns(self.plan, variant, kind.row.name)
            for run in kind.runs:
                run.begin(0)
                run.due_ns += later_ns

    def _cut(self, cut: Cut, run: Running, row: str, variant: Variant) -> None:
        """Takes the power from a PLC.  Parameters of its beginning are written again: they are part of the program."""
        if run.reason:
            return
        if cut.is_cold:
            run.plc.cold_start()
        else:
            run.plc.warm_start()
        for axis, value in settings_of(self.plan, variant, row):
            if axis.what == VALUE and not axis.at_ns:
                found = run.plc.find(axis.path)
                run.plc.write(found, value_for(found, value))
        run.due_ns = max(run.due_ns, cut.at_ns + cut.off_ns)

    def _summed(self, variant: Variant, runs: Mapping[str, Running], failure: Failure | None) -> Result:
        plcs = [run.plc for run in runs.values()]
        names = PlcNames({name: (run.plc.find, run.plc.reader) for name, run in runs.items()}, self.plan.alone)
        checksum = 0
        for plc in plcs:
            checksum = zlib.crc32(b"%d" % fingerprint(plc.memory.map[:]), checksum)
        return Result(variant.number, sum(plc.scans for plc in plcs), max(plc.elapsed_ns for plc in plcs), checksum, failure,
                      tuple(_plain(names, names.find(text)) for text in self.plan.shown))  # fmt: skip


def _all_recorded(plant: Plant, recording: Recording) -> Recording:
    for name, run in plant.named_runs.items():
        recording.add(name, run.plc)
    return recording


def _plain(names: PlcNames, place: Place) -> Value:
    """A value that JSON can write."""
    return plain_value(place.type, names.read(place))


def _with_line(seen: Seen, recording: Recording) -> Failure:
    """A failure with the statement that was the last one to change one of the places, as far as a statement was it."""
    for name, (scan, places) in seen.changed.items():
        scans = RecordedScans(recording[name], {}, first=scan)
        changes = [change for place in places if (change := why(scans, place, scan, 0).change) is not None]
        sites = [change for change in changes if change.site is not None]
        if sites:
            site = max(sites, key=lambda change: change.order).site
            assert site is not None
            return replace(seen.failure, file=site.file, pou=site.pou, line=site.line)
    return seen.failure
