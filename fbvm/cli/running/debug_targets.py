"""What `fbvm step` steps through: a program with its unit, or one PLC of a project, made anew as often as it takes."""

from __future__ import annotations

from pathlib import Path

import click

from fbvm.base.diagnostics import Diagnostic, errors
from fbvm.cli.shared import status
from fbvm.cli.shared.networks import build_network, mailbox_names
from fbvm.cli.shared.options import Mapping
from fbvm.cli.shared.sources import report
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.record.trace.traffic import Passed, Reader
from fbvm.run.plant import ENDLESS, Plant
from fbvm.run.project import Project, read_project
from fbvm.run.running import Running
from fbvm.units.backplane import usual_units
from fbvm.wire.tap import Happening


class DebugTarget:
    """Makes the PLC with its unit and network, each time the same, and notes what passes the network."""

    def __init__(self, image: Image, cycle_ns: int, mappings: tuple[Mapping, ...], timing: str, seed: int) -> None:
        self._image, self._cycle_ns, self._mappings = image, cycle_ns, mappings
        self._timing, self._seed = timing, seed
        self.passed: list[Passed] = []

    def make(self) -> Plc:
        """A PLC at power-on."""
        plc = Plc(self._image, self._cycle_ns)
        network = build_network("loop", self._mappings, self._seed)
        assert isinstance(network, LoopNetwork)
        self._listen(network)
        for unit in usual_units(mailbox_names(self._image), self._timing, self._seed):
            plc.attach(unit, network)
        return plc

    def _listen(self, network: LoopNetwork) -> None:
        self.passed, reader = [], Reader(once=True)

        def tap(now_ns: int, unit: str, happening: Happening) -> None:
            self.passed.extend(reader.read(now_ns, happening))

        network.tap = tap


class ProjectTarget(DebugTarget):
    """Makes all PLCs of a project; one is stepped through, the others scan along in its time.

    Ends with status 3 if something is wrong with the project, and as a mistake of usage if `name` is none of its PLCs."""

    def __init__(self, file: Path, name: str | None) -> None:
        self.passed = []
        project = read_project(file)
        if not isinstance(project, Project):
            raise _refused(project)
        self._project = project
        plant = self._plant()
        names = [each for kind in plant.kinds for each in kind.names]
        if (name or names[0]) not in names or (name is None and len(names) > 1):
            said = f"there is no PLC {name}" if name else "there are several PLCs; say which by --plc NAME"
            raise click.UsageError(f"{said}; there is {', '.join(names)}")
        self._number = names.index(name or names[0])
        self.files = {str(path): path for kind in plant.kinds for path in kind.row.sources}
        self.libraries = tuple(folder for kind in plant.kinds for folder in kind.row.libraries)
        self.image = plant.runs[self._number].plc.image

    def make(self) -> Plc:
        """The PLC at power-on."""
        plant = self._plant()
        assert isinstance(plant.network, LoopNetwork)
        self._listen(plant.network)
        chosen = plant.runs[self._number]
        others = [run for run in plant.runs if run is not chosen]
        sets = list(chosen.writes)

        def along(plc: Plc) -> None:
            while sets and sets[0].at_ns <= plc.elapsed_ns:
                write = sets.pop(0)
                plc.write(write.where, write.value)
            _catch_up(others, plc.now_ns if plc.scans else -1)

        along(chosen.plc)
        chosen.plc.watchers.append(along)
        return chosen.plc

    def _plant(self) -> Plant:
        plant = Plant(self._project, net="loop", for_ns=ENDLESS)
        if errors(plant.diagnostics):
            raise _refused(plant.diagnostics)
        return plant


def _catch_up(others: list[Running], now_ns: int) -> None:
    """Everybody else scans until a time, the earliest first."""
    while due := [run for run in others if run.due_ns <= now_ns and not run.plc.trap]:
        first = min(due, key=lambda run: run.due_ns)
        first.scan(first.due_ns)


def _refused(diagnostics: list[Diagnostic]) -> SystemExit:
    report(diagnostics, False)
    return SystemExit(status.PROGRAM_ERRORS)
