"""The PLCs of a project, built and wired: equal ones share an image and its code, all share one network and one loop."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from ipaddress import IPv4Address

from fbvm.base.data import data_folder
from fbvm.base.diagnostics import Diagnostic, errors
from fbvm.base.files import reason
from fbvm.base.toml import load_toml
from fbvm.check.lint.suppression import ANY, Wanted
from fbvm.code.compiler import compile_files
from fbvm.code.image import Image
from fbvm.engine.native import engine as native
from fbvm.interchange.formats.given import inputs
from fbvm.machine.backplane import KINDS, UNIT_OF_AREA, make_unit
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import ModbusPeer
from fbvm.net.tcp import TcpNetwork
from fbvm.run.project import PlcRow, Project, SetRow, near
from fbvm.run.running import Running, TimedWrite
from fbvm.run.toml_keys import Path, span
from fbvm.watch.paths import Place, Span
from fbvm.watch.values import Value, conform, parse_value
from fbvm.wire.link import Peer
from fbvm.wire.registers import server

MANY = 10
"""From so many equal PLCs on machine code runs from the first scan: together they execute enough for that."""
ENDLESS = 1 << 62
"""So many nanoseconds or scans nobody waits for."""
MOMENT_NS = 1_000_000
"""In real time equal PLCs are spread over their cycle in such steps: those that scan at the same moment wait for one another,
and to wake up for each alone would cost more than its scan."""


@dataclass
class Kind:
    """The PLCs of one row of a project, which share an image, and what is watched of each."""

    row: PlcRow
    runs: list[Running] = field(default_factory=list)
    watched: dict[str, Place | Span] = field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        """A name for each PLC."""
        if self.row.count is None:
            return [self.row.name]
        return [f"{self.row.name}[{number}]" for number in range(self.row.first, self.row.first + self.row.count)]

    def values(self, run: Running) -> dict[str, Value]:
        """The present values of what is watched of one of them, by name."""
        return {name: run.plc.read(place) for name, place in self.watched.items()}


class Plant:
    """The PLCs of a project, compiled, connected and ready for `run_all`.

    `net` ("loop" or "tcp") takes the place of the file's; `for_ns` and `scans`, if one is given, take the place of the file's
    bounds for PLCs that have no end of their own; `wanted` says which warnings are shown.  `images`, by the names of rows, are
    programs that are compiled already: no source is read for them.  Mistakes of the project are in `diagnostics`; if there is an
    error, the plant is closed.  Raises OSError if the host's network cannot be used, or not by a door."""

    def __init__(
        self, project: Project, *, net: str | None = None, for_ns: int | None = None, scans: int | None = None,
        wanted: Wanted = ANY, images: Mapping[str, Image] | None = None,
    ) -> None:  # fmt: skip
        self.project, self._wanted = project, wanted
        self.diagnostics: list[Diagnostic] = []
        self.kinds = [Kind(row) for row in project.plcs]
        self.doors: dict[Peer, Peer] = {}
        """With real connections: the endpoints of units that others reach, and where on the host each is."""
        self.network = _network(project, net or project.net)
        given = for_ns is not None or scans is not None
        self.for_ns = for_ns if given else project.for_ns
        self.scans = scans if given else project.scans
        for kind in self.kinds:
            image = images[kind.row.name] if images else self._image(kind.row)
            if image:
                self._build(kind, image)
        for number, picture in enumerate(() if images else project.pictures):
            if not picture.file.is_file():
                self._report(("picture", number, "file"), f"picture {number + 1}: there is no file {picture.file}")
        if (net or project.net) != project.net:
            self.diagnostics += project.wrong_on(net or project.net)
        if errors(self.diagnostics):
            self.close()
        elif isinstance(self.network, TcpNetwork):
            try:
                self.doors = self.network.try_doors([said for said, _ in project.doors])
            except OSError:
                self.close()
                raise

    @property
    def runs(self) -> list[Running]:
        """All PLCs for `run_all`."""
        return [run for kind in self.kinds for run in kind.runs]

    @property
    def named_runs(self) -> dict[str, Running]:
        """All PLCs by their names."""
        return {name: run for kind in self.kinds for name, run in zip(kind.names, kind.runs, strict=True)}

    def close(self) -> None:
        """End all connections."""
        self.network.close()

    def _report(self, path: Path, message: str, hint: str = "") -> None:
        source = self.project.source
        self.diagnostics.append(Diagnostic("P0103", source, *span(source, path), message, hint))

    def _image(self, row: PlcRow) -> Image | None:
        for folder in row.libraries:
            if not folder.is_dir():
                self._report(("plc", row.name, "libraries"), f"there is no folder {folder}")
                return None
        missing = [source for source in row.sources if not os.path.lexists(source)]
        for source in missing:
            self._report(("plc", row.name, "sources"), f"plc.{row.name}.sources: there is no file {source}", near(source))
        if missing:
            return None
        try:
            sources, said = inputs(row.sources, row.resource)
        except OSError as error:
            self._report(("plc", row.name, "sources"), f"plc.{row.name}.sources: a project cannot be read: {reason(error)}")
            return None
        self.diagnostics += said
        if errors(said):
            return None
        compilation = compile_files(sources, program=row.program, libraries=row.libraries, runnable=True,
                                    resource=row.resource, dialect=row.dialect, no_warn=self._wanted.no_warn,
                                    warnings_as_errors=self._wanted.as_errors, heap=row.heap)
        self.diagnostics += compilation.diagnostics
        return compilation.image

    def _build(self, kind: Kind, image: Image) -> None:
        row, where = kind.row, ("plc", kind.row.name)
        engine = "native" if row.engine == "auto" and (row.count or 1) >= MANY and native.available() else row.engine
        writes: list[TimedWrite] = []
        for number in range(row.count or 1):
            try:
                plc = Plc(image, row.cycle_ns, engine=engine)
            except ValueError as error:
                self._report((*where, "engine"), str(error))
                return
            plc.watch_cycle.time_ns = row.watch_cycle_ns
            if number == 0:
                kind.watched = dict(self._watched(plc, row))
                writes = list(self._writes(plc, row.sets, where))
            if not self._attach(plc, row, number):
                return
            running = self._running(plc, row, writes, number)
            if running is None:
                return
            kind.runs.append(running)

    def _attach(self, plc: Plc, row: PlcRow, number: int) -> bool:
        number += row.first - 1
        for place, unit in enumerate(row.units):
            try:
                address = str(IPv4Address(unit.address) + number)
                options = dict(unit.options)
                if "seed" in KINDS[unit.kind][1]:
                    options["seed"] = options.get("seed", 0) + number
                plc.attach(make_unit(unit.kind, address, options), self.network)
            except ValueError as error:
                self._report(("plc", row.name, "unit", place), str(error))
                return False
        return True

    def missing_units(self) -> Iterator[str]:
        """What a user should know of PLCs whose program talks to a unit that they do not have."""
        for kind in self.kinds:
            attached = {unit.kind for unit in kind.row.units}
            for wanted, library in sorted(units_of(kind.runs[0].plc.image).items() if kind.runs else ()):
                if wanted not in attached:
                    name = kind.row.name
                    yield (f"{name} has no unit of type {wanted}, to which blocks of {library} talk: they reach nobody; "
                           f"write [[plc.{name}.unit]] with its address")

    def _running(self, plc: Plc, row: PlcRow, writes: Iterable[TimedWrite], number: int) -> Running | None:
        phase_ns = row.cycle_ns * number // (row.count or 1) // MOMENT_NS * MOMENT_NS
        try:
            if row.until is not None:
                return Running(plc, until=row.until, max_ns=self.for_ns, writes=writes, pace=row.pace, phase_ns=phase_ns)
        except (LookupError, TypeError, ValueError) as error:
            self._report(("plc", row.name, "until"), str(error))
            return None
        if self.for_ns is None and self.scans is None:
            return Running(plc, until=self._others_ended, writes=writes, pace=row.pace, phase_ns=phase_ns)
        return Running(plc, for_ns=self.for_ns, scans=self.scans, writes=writes, pace=row.pace, phase_ns=phase_ns)

    def _others_ended(self, plc: Plc) -> bool:
        """The end of a PLC that has none: that of all which have one."""
        ends = [run for kind in self.kinds if kind.row.until is not None for run in kind.runs]
        return bool(ends) and all(run.reason for run in ends)

    def _watched(self, plc: Plc, row: PlcRow) -> Iterator[tuple[str, Place | Span]]:
        for name in row.watch:
            try:
                yield name, plc.find(name)
            except LookupError as error:
                self._report(("plc", row.name, "watch"), str(error))

    def _writes(self, plc: Plc, sets: Iterable[SetRow], where: Path) -> Iterator[TimedWrite]:
        for number, row in enumerate(sets):
            try:
                yield TimedWrite(found := plc.find(row.name), value_for(found, row.value), row.at_ns)
            except (LookupError, TypeError, ValueError) as error:
                self._report((*where, "set", number), str(error))


def timed(project: Project, seed: int, timing: Callable[[str], str], cycle_ns: Callable[[str, int], int]) -> Project:
    """A project whose network and units take from `seed` what they leave to chance; `timing` says for the name of a PLC how its
    units answer, "exact" or "real", `cycle_ns` for its name and cycle time the cycle time that it gets."""

    def changed(row: PlcRow) -> PlcRow:
        how = timing(row.name)
        units = tuple(replace(unit, options={**unit.options, "timing": how, "seed": seed})
                      if "timing" in KINDS[unit.kind][1] else unit for unit in row.units)  # fmt: skip
        return replace(row, cycle_ns=cycle_ns(row.name, row.cycle_ns), units=units)

    return replace(project, seed=seed, plcs=tuple(map(changed, project.plcs)))


def value_for(where: Place | Span, written: object) -> object:
    """A value of TOML as one of the type of `where`; texts are read as literals of a program.  Raises ValueError, TypeError."""
    if isinstance(where, Span):
        if not isinstance(written, list) or len(written) != len(where.places):
            raise ValueError(f"{where.name} takes a list of {len(where.places)} values")
        return [value_for(place, item) for place, item in zip(where.places, written, strict=True)]
    if isinstance(written, str):
        return parse_value(where.type, written, where.name)
    return conform(where.type, written, where.name)


def units_of(image: Image) -> dict[str, str]:
    """The types of units to which shipped blocks of a program talk, each with what talks to it: a mailbox or a library."""
    found = {UNIT_OF_AREA[box.name]: f"the mailbox {box.name}" for box in image.layout.mailboxes if box.name in UNIT_OF_AREA}
    for folder in sorted({site.file.rpartition("/")[0] for site in image.sites} - {""}):
        described = data_folder("fblib") / folder / "library.toml"
        if described.is_file():
            kind = str(load_toml(described.read_text(encoding="utf-8")).get("unit", "")).partition(",")[0]
            if kind in KINDS:
                found[kind] = f"the library {folder}"
    return found


def _network(project: Project, net: str) -> LoopNetwork | TcpNetwork:
    if net == "tcp":
        rows = {said: real for said, real in project.servers if real is not None} | dict(project.doors)
        return TcpNetwork(rows, backlog=project.backlog, seed=project.seed, faults=project.faults)
    network = LoopNetwork(project.seed, faults=project.faults)
    for said, _ in project.servers:
        network.place(said, ModbusPeer(server()))
    return network
