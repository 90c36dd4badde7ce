"""The targets of `fbvm step`: a program with its unit, or one PLC of a project.  Stepping back builds the PLC anew."""

from __future__ import annotations

from pathlib import Path

import click

from fbvm.base.diagnostics import Diagnostic, errors
from fbvm.cli.shared import status
from fbvm.cli.shared.networks import build_network, mailbox_names
from fbvm.cli.shared.options import Mapping
from fbvm.cli.shared.project_arguments import read_given_project
from fbvm.cli.shared.sources import report_diagnostics
from fbvm.code.image import Image
from fbvm.interchange.formats.given import given_sources
from fbvm.machine.backplane import usual_units
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.record.trace.packets import Dissector, Packet
from fbvm.run.plant import ENDLESS, Plant
from fbvm.run.project import Project
from fbvm.run.running import Running
from fbvm.wire.tap import TapEvent


class DebugTarget:
    """A program on a PLC with its units and a network in memory.

    `cycle_ns` is the cycle of programs without a TASK, `mappings` are the Modbus servers on the network, `timing` ("exact",
    "real") and `seed` those of the units.  `packets` are those of the PLC that was made last."""

    def __init__(self, image: Image, cycle_ns: int, mappings: tuple[Mapping, ...], timing: str, seed: int) -> None:
        self._image, self._cycle_ns, self._mappings = image, cycle_ns, mappings
        self._timing, self._seed = timing, seed
        self.packets: list[Packet] = []

    def make(self) -> Plc:
        """A new PLC at power-on, equal to all others that this method makes."""
        plc = Plc(self._image, self._cycle_ns)
        network = build_network("loop", self._mappings, self._seed)
        assert isinstance(network, LoopNetwork)
        self._listen(network)
        for unit in usual_units(mailbox_names(self._image), self._timing, self._seed):
            plc.attach(unit, network)
        return plc

    def _listen(self, network: LoopNetwork) -> None:
        self.packets, dissector = [], Dissector(once=True)

        def tap(now_ns: int, unit: str, event: TapEvent) -> None:
            self.packets.extend(dissector.dissect(now_ns, event))

        network.tap = tap


class ProjectTarget(DebugTarget):
    """One PLC of a project; the others scan in its time.

    `file` is the project file, `name` that of the PLC; it may be None if the project has one PLC.  Ends with status 3 if
    the project has errors.  Raises UsageError if it has no PLC of that name."""

    def __init__(self, file: Path, name: str | None) -> None:
        self.packets = []
        project = read_given_project(file)
        if not isinstance(project, Project):
            raise _refused(project)
        self._project = project
        plant = self._plant()
        names = [each for kind in plant.kinds for each in kind.names]
        if (name or names[0]) not in names or (name is None and len(names) > 1):
            said = f"there is no PLC {name}" if name else "there are several PLCs; say which by --plc NAME"
            raise click.UsageError(f"{said}; there is {', '.join(names)}")
        self._number = names.index(name or names[0])
        self.files = {name: one for kind in plant.kinds
                      for name, one in given_sources(kind.row.sources, kind.row.resource).items()}
        self.libraries = tuple(folder for kind in plant.kinds for folder in kind.row.libraries)
        self.image = plant.runs[self._number].plc.image

    def make(self) -> Plc:
        """A new PLC at power-on, with new PLCs of all others beside it."""
        plant = self._plant()
        assert isinstance(plant.network, LoopNetwork)
        self._listen(plant.network)
        chosen = plant.runs[self._number]
        others = [run for run in plant.runs if run is not chosen]
        writes = list(chosen.writes)

        def before_scan(plc: Plc) -> None:
            while writes and writes[0].at_ns <= plc.elapsed_ns:
                write = writes.pop(0)
                plc.write(write.where, write.value)
            _catch_up(others, plc.now_ns if plc.scans else -1)

        before_scan(chosen.plc)
        chosen.plc.watchers.append(before_scan)
        return chosen.plc

    def _plant(self) -> Plant:
        plant = Plant(self._project, net="loop", for_ns=ENDLESS)
        if errors(plant.diagnostics):
            raise _refused(plant.diagnostics)
        return plant


def _catch_up(others: list[Running], now_ns: int) -> None:
    """Runs the scans of the other PLCs that are due at `now_ns`, the earliest first."""
    while due := [run for run in others if run.due_ns <= now_ns and not run.plc.trap]:
        first = min(due, key=lambda run: run.due_ns)
        first.scan(first.due_ns)


def _refused(diagnostics: list[Diagnostic]) -> SystemExit:
    report_diagnostics(diagnostics, False)
    return SystemExit(status.PROGRAM_ERRORS)
