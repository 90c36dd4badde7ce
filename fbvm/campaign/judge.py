"""Tells behind each scan of a run whether it is still a good one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from fbvm.base.codes import CODES
from fbvm.campaign.plan import Golden, Judging, Response
from fbvm.machine.plc import Plc
from fbvm.record.trace.recorder import Recorder
from fbvm.run.plc_names import PlcNames
from fbvm.run.running import Running
from fbvm.testing.golden import differences, golden_text
from fbvm.watch.conditions import Condition, parse_condition
from fbvm.watch.paths import Place
from fbvm.watch.values import show_time

TRAP, NEVER, ALWAYS, WITHIN, UNTIL, GOLDEN, CRASHED, TEST = (
    "trap", "never", "always", "within", "until", "golden", "crashed", "test")  # fmt: skip


@dataclass(frozen=True)
class Failure:
    """Why a run is none of the good ones: a kind, and the property, or the title of the trap.

    `plc` is the PLC behind whose scan `scan` it was seen, `now_ns` the time of that scan; `code`, `file`, `pou` and `line` say
    where a trap was, or which statement has made a condition true or false."""

    kind: str
    text: str
    plc: str = ""
    scan: int = 0
    now_ns: int = 0
    code: str = ""
    file: str = ""
    pou: str = ""
    line: int = 0
    detail: str = ""

    @property
    def key(self) -> tuple[str, str, str, str, int]:
        """What failures of the same group have in common."""
        return self.kind, self.text, self.code, self.file, self.line

    @property
    def where(self) -> str:
        """File and line, as far as they are known."""
        return f"{self.file}:{self.line}" if self.file else ""

    def __str__(self) -> str:
        said = f"{self.kind} {self.text}" if self.kind != TRAP else f"trap {self.code} {self.text}"
        return f"{said} ({self.where})" if self.where else said


@dataclass(frozen=True)
class Seen:
    """A failure, and the places whose change has brought it: by PLC, with the scan in which they changed."""

    failure: Failure
    changed: Mapping[str, tuple[int, Sequence[Place]]]


@dataclass
class _Waiting:
    """A response, and since when it is awaited; in which scan of which PLC the trigger came."""

    response: Response
    trigger: Condition
    answer: Condition
    before: bool = False
    since_ns: int = -1
    changed: Mapping[str, tuple[int, Sequence[Place]]] | None = None


class Judge:
    """Judges one run of some PLCs, which have names.  Raises ConditionError, UnknownPlace and TypeError for conditions and names
    that do not fit the programs."""

    def __init__(self, judging: Judging, runs: Mapping[str, Running], alone: bool) -> None:
        self._runs = runs
        self._plcs: dict[str, Plc] = {name: run.plc for name, run in runs.items()}
        self._names = PlcNames({name: (plc.find, plc.reader) for name, plc in self._plcs.items()}, alone)
        self._forbidden = [(NEVER, self._condition(text)) for text in judging.never]
        self._forbidden += [(ALWAYS, self._condition(text)) for text in judging.always]
        self._waiting = [_Waiting(each, self._condition(each.trigger), self._condition(each.answer))
                         for each in judging.responses]  # fmt: skip
        self._until = self._condition(judging.until) if judging.until else None
        self._goldens = [(golden, Recorder(self._plcs[golden.plc], golden.names)) for golden in judging.goldens]
        self.reached = False
        """True if the run has come to its `until`, which ends it."""

    def _condition(self, text: str) -> Condition:
        return parse_condition(text, self._names.find)

    def look(self, now_ns: int) -> Seen | None:
        """Called behind all scans that begin at `now_ns`.  Returns the failure that they are, if they are one."""
        for name, run in self._runs.items():
            if run.plc.trap:
                code, site = run.plc.trap.code, run.plc.trap.site
                failure = Failure(TRAP, CODES[code].title, name, run.plc.scans - 1, now_ns, code, site.file, site.pou, site.line)
                return Seen(failure, {})
        read = self._names.read
        for kind, condition in self._forbidden:
            if condition.holds(read) == (kind == NEVER):
                return self._seen(Failure(kind, condition.text), condition, now_ns)
        for waiting in self._waiting:
            if seen := self._awaited(waiting, now_ns):
                return seen
        self.reached = self._until is not None and self._until.holds(read)
        return None

    def _awaited(self, waiting: _Waiting, now_ns: int) -> Seen | None:
        read = self._names.read
        triggered, response = waiting.trigger.holds(read), waiting.response
        if triggered and not waiting.before and waiting.since_ns < 0:
            waiting.since_ns, waiting.changed = now_ns, self._changed(waiting.trigger, now_ns)
        waiting.before = triggered
        if waiting.since_ns < 0:
            return None
        is_late = now_ns - waiting.since_ns > response.within_ns
        if waiting.answer.holds(read) and not is_late:
            waiting.since_ns = -1
        elif is_late:
            text = f"{response.answer} within {show_time(response.within_ns)[2:]} of {response.trigger}"
            seen = self._seen(Failure(WITHIN, text), waiting.trigger, now_ns)
            return replace(seen, changed=waiting.changed or {})
        return None

    def _seen(self, failure: Failure, condition: Condition, now_ns: int) -> Seen:
        changed = self._changed(condition, now_ns)
        name = next(iter(changed), next(iter(self._plcs)))
        return Seen(replace(failure, plc=name, scan=self._plcs[name].scans - 1, now_ns=now_ns), changed)

    def _changed(self, condition: Condition, now_ns: int) -> dict[str, tuple[int, Sequence[Place]]]:
        """The places of a condition by PLC, of those PLCs that have scanned at `now_ns`."""
        found: dict[str, tuple[int, list[Place]]] = {}
        for place in condition.places:
            owner, own = self._names.owner(place)
            plc = self._plcs[owner]
            if plc.now_ns == now_ns and plc.scans:
                found.setdefault(owner, (plc.scans - 1, []))[1].append(own)
        return dict(found)

    def ended(self) -> Failure | None:
        """Called when the run is over without a failure: what should have been by then."""
        for name, run in self._runs.items():
            if run.reason == "max":
                return Failure(UNTIL, f"{name} has not come to its end", name, run.plc.scans - 1, run.plc.now_ns)
        if self._until and not self.reached:
            name, run = next(iter(self._runs.items()))
            return Failure(UNTIL, self._until.text, name, run.plc.scans - 1, run.plc.now_ns)
        return next(self._other_traces(), None)

    def _other_traces(self) -> Iterator[Failure]:
        for golden, recorder in self._goldens:
            if said := differences(golden.text, golden_text(recorder)):
                plc = self._plcs[golden.plc]
                yield Failure(GOLDEN, f"{golden.file}: {said.splitlines()[0]}", golden.plc, plc.scans - 1, plc.now_ns)

    def traces(self) -> Iterator[tuple[Golden, str]]:
        """The golden traces as they are in this run."""
        for golden, recorder in self._goldens:
            yield golden, golden_text(recorder)
