"""The PLCs that a debugger executes, in memory and virtual time: a program with its units, or all PLCs of a project."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from fbvm.base.diagnostics import Diagnostic, errors
from fbvm.cli.shared.networks import build_network, mailbox_names
from fbvm.cli.shared.options import Mapping as Mapped
from fbvm.code.image import Image
from fbvm.interchange.formats.given import given_sources, source_files
from fbvm.machine.backplane import usual_units
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.record.trace.packets import Dissector, Packet
from fbvm.record.trace.source_texts import source_texts
from fbvm.run.plant import ENDLESS, Plant
from fbvm.run.project import Project
from fbvm.run.running import TimedWrite
from fbvm.step.world import Debugged, World
from fbvm.wire.tap import TapEvent

Writes = Callable[[str, Plc], Sequence[TimedWrite]]
"""What is written into a PLC of that name at times of its own."""


def no_writes(name: str, plc: Plc) -> Sequence[TimedWrite]:
    """Nothing."""
    return ()


class ProgramErrors(Exception):
    """A project cannot be executed: its file or its programs have errors, which are among the `diagnostics`."""

    def __init__(self, diagnostics: Sequence[Diagnostic]) -> None:
        super().__init__("the program has errors")
        self.diagnostics = diagnostics


@dataclass(frozen=True)
class DebugSources:
    """What a debugger shows of PLCs: the files of their sources by name, and all texts by name, those of libraries too."""

    paths: Mapping[str, Path]
    texts: Mapping[str, str]


def plant_sources(plant: Plant) -> DebugSources:
    """The sources of all PLCs of a project."""
    paths: dict[str, Path] = {}
    texts: dict[str, str] = {}
    for kind in plant.kinds:
        given = given_sources(kind.row.sources, kind.row.resource)
        paths |= source_files(given)
        texts |= source_texts(kind.runs[0].plc.image, given, kind.row.libraries)
    return DebugSources(paths, texts)


class NetworkPackets:
    """The packets of the network that was made last."""

    def __init__(self) -> None:
        self.packets: list[Packet] = []

    def listen(self, network: LoopNetwork) -> None:
        """Dissects what passes a network from now on."""
        self.packets, dissector = [], Dissector(once=True)

        def tap(now_ns: int, unit: str, event: TapEvent) -> None:
            self.packets.extend(dissector.dissect(now_ns, event))

        network.tap = tap


def program_world(image: Image, cycle_ns: int, mappings: Sequence[Mapped], timing: str, seed: int, packets: NetworkPackets,
                  engine: str = "auto", writes: Writes = no_writes) -> World:  # fmt: skip
    """A world with one PLC, "plc", that has the units which a program needs.

    `cycle_ns` is the cycle of programs without a TASK, `mappings` are the Modbus servers on the network, `timing` ("exact",
    "real") and `seed` those of the units.  Raises ValueError for an engine that this machine does not have."""

    def make() -> Iterable[Debugged]:
        plc = Plc(image, cycle_ns, engine=engine)
        network = build_network("loop", tuple(mappings), seed)
        assert isinstance(network, LoopNetwork)
        packets.listen(network)
        for unit in usual_units(mailbox_names(image), timing, seed):
            plc.attach(unit, network)
        yield Debugged("plc", plc, writes("plc", plc))

    return World(make)


class ProjectWorld(World):
    """All PLCs of a project by their names, on one network; what the project writes is written.  Raises ProgramErrors."""

    def __init__(self, project: Project, packets: NetworkPackets, writes: Writes = no_writes) -> None:
        self.diagnostics: Sequence[Diagnostic] = ()
        """What the compiler says of all programs."""
        self.sources = DebugSources({}, {})

        def make() -> Iterable[Debugged]:
            plant = Plant(project, net="loop", for_ns=ENDLESS)
            if errors(plant.diagnostics):
                raise ProgramErrors(plant.diagnostics)
            assert isinstance(plant.network, LoopNetwork)
            packets.listen(plant.network)
            self.diagnostics = plant.diagnostics
            if not self.sources.paths:
                self.sources = plant_sources(plant)
            for name, run in plant.named_runs.items():
                yield Debugged(name, run.plc, [*run.writes, *writes(name, run.plc)])

        super().__init__(make)
