"""What a run of a campaign varies in a test: written parameters, cycles, how units answer, network faults and power cuts.

The fixtures of tests give it to every PLC that the test makes.  Without a campaign a test runs as it is written."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from fbvm.machine.plc import Plc
from fbvm.net.faults import Fault
from fbvm.net.loop import LoopNetwork
from fbvm.run.plant import timed, value_for
from fbvm.run.project import Project
from fbvm.watch.paths import Place, Span, UnknownPlace

EXACT = "exact"


@dataclass(frozen=True)
class Written:
    """A value that is written into the place `name` before the first scan at or after `at_ns`; of the PLC `plc` of a plant, ""
    for all that have such a place."""

    name: str
    value: object
    at_ns: int = 0
    plc: str = ""


@dataclass(frozen=True)
class PowerCut:
    """The power of the PLC `plc` of a plant, "" for the first PLC that the test makes, is off from `at_ns` on for `off_ns`."""

    plc: str
    at_ns: int
    off_ns: int
    is_cold: bool = False


@dataclass(frozen=True)
class Conditions:
    """Under what a test runs.  `cycles_ns` and `phases_ns` are by the name of a PLC of a plant, "" for all; a PLC with a phase
    begins so much later.  `seed` decides what units and networks leave to chance."""

    seed: int = 0
    timing: str = EXACT
    written: tuple[Written, ...] = ()
    cycles_ns: tuple[tuple[str, int], ...] = ()
    phases_ns: tuple[tuple[str, int], ...] = ()
    timings: tuple[tuple[str, str], ...] = ()
    faults: tuple[Fault, ...] = ()
    cuts: tuple[PowerCut, ...] = ()


@dataclass
class VariedPlc:
    """One PLC of a test, and what is still to be done to it."""

    run: VariedRun
    name: str
    plc: Plc
    find: Callable[[str], Place | Span]
    written: list[tuple[Written, Place | Span]]
    cuts: list[PowerCut]
    begins_ns: int = 0
    """When its next scan begins at the earliest: it is switched off until then."""

    @property
    def elapsed_ns(self) -> int:
        """When its next scan begins."""
        return max(self.plc.elapsed_ns, self.begins_ns)

    def before_scan(self) -> None:
        """Called before a scan: cuts the power, which moves `elapsed_ns`, and writes what is due."""
        while self.cuts and self.cuts[0].at_ns <= self.elapsed_ns:
            cut = self.cuts.pop(0)
            if cut.is_cold:
                self.plc.cold_start()
            else:
                self.plc.warm_start()
            self.begins_ns = max(self.elapsed_ns, cut.at_ns + cut.off_ns)
            self._write(lambda row: not row.at_ns)  # parameters of the beginning are part of the program
        self._write(lambda row: self.plc.now_ns < row.at_ns <= self.elapsed_ns)

    def after_scan(self) -> None:
        """Called behind a scan of a PLC that runs alone.  Raises AssertionError if the run is not good any more."""
        if not self.name:
            self.run.scanned(self.plc.now_ns)

    def _write(self, chosen: Callable[[Written], bool]) -> None:
        for row, place in self.written:
            if chosen(row):
                self.plc.write(place, value_for(place, row.value))


@dataclass
class VariedRun:
    """One execution of a test under some conditions; `plcs` are those that it has made so far."""

    conditions: Conditions
    plcs: list[VariedPlc] = field(default_factory=list)
    used: set[str] = field(default_factory=set)
    """The names that were written to some PLC."""
    judge: Callable[[VariedRun, int], None] | None = None
    """Called with the time of a scan behind all scans that begin then; raises AssertionError for a run that is not good."""
    _networks: list[LoopNetwork] = field(default_factory=list)

    def made(self, name: str, plc: Plc, find: Callable[[str], Place | Span], network: LoopNetwork | None) -> VariedPlc:
        """Called with each PLC that the test makes: `name` is that of a PLC of a plant, "" for another one.

        Raises TypeError and ValueError for values that do not fit."""
        given = self.conditions
        if network is not None and all(network is not other for other in self._networks):
            self._networks.append(network)
            network.reseed(given.seed)
            network.faults[:0] = given.faults
        cuts = [cut for cut in given.cuts if cut.plc == name or (not cut.plc and not self.plcs)]
        found = VariedPlc(self, name, plc, find, list(self._places(name, find)), sorted(cuts, key=lambda cut: cut.at_ns))
        found.begins_ns = sum(phase_ns for owner, phase_ns in given.phases_ns if _is_of(name, owner))
        found._write(lambda row: not row.at_ns)
        self.plcs.append(found)
        return found

    def scanned(self, now_ns: int) -> None:
        """Called behind all scans that begin at a time.  Raises AssertionError if the run is not good any more."""
        if self.judge:
            self.judge(self, now_ns)

    def _places(self, name: str, find: Callable[[str], Place | Span]) -> Sequence[tuple[Written, Place | Span]]:
        found = []
        for row in self.conditions.written:
            owner, _, path = row.name.partition(".")
            own = path if name and _is_of(name, owner) else row.name
            try:
                if not name or own != row.name:
                    found.append((row, find(own)))
                    self.used.add(row.name)
            except UnknownPlace:
                continue
        return found

    def cycle_ns(self, name: str, usual_ns: int) -> int:
        """The cycle time of a PLC."""
        return next((cycle_ns for owner, cycle_ns in self.conditions.cycles_ns if _is_of(name, owner)), usual_ns)

    def timing(self, name: str) -> str:
        """How the units of a PLC answer."""
        return next((timing for owner, timing in self.conditions.timings if _is_of(name, owner)), self.conditions.timing)

    def project(self, project: Project) -> Project:
        """A project whose PLCs have the cycles and the units of these conditions."""
        return timed(project, self.conditions.seed, self.timing, self.cycle_ns)


def _is_of(name: str, owner: str) -> bool:
    """True if a PLC with this name is the one that is meant, or one of those: `pump` are all of `pump[1]`, `pump[2]`."""
    return owner in ("", name, name.partition("[")[0])
