"""A rig for all PLCs of a project file, which run together in virtual time.

    plant = plant()                                    # fbvm.toml near the test
    plant.until("client.Main.Done", max="5s")
    assert plant.server["D200"] == 7
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from fbvm.base.diagnostics import Diagnostic, Source, errors
from fbvm.interchange.formats.given import inputs
from fbvm.net.loop import LoopNetwork
from fbvm.record.recording.recording import Recording
from fbvm.run.plant import Kind, Plant
from fbvm.run.plc_names import PlcNames
from fbvm.run.project import FILE, Project, read_project
from fbvm.run.varied import VariedRun
from fbvm.syntax.text import read
from fbvm.testing.rig import DEFAULT_LIMIT, Rig, not_found, to_ns
from fbvm.testing.subject import Subject, SubjectError
from fbvm.watch.conditions import parse_condition
from fbvm.watch.values import show_time


class PlantRig:
    """The PLCs of a project, each a `Rig`: `plant.pump`, `plant["pump[3]"]`; `network` is their network.

    Times are text ("50ms") or integers of nanoseconds."""

    def __init__(self, path: Path, allow_outside: bool = False, varied: VariedRun | None = None) -> None:
        """With `allow_outside` sources may lie outside of the project's folder; `varied` is what a campaign varies.  Raises
        SubjectError with all that is wrong with the project or its programs."""
        __tracebackhide__ = True
        project = read_project(path, allow_outside=allow_outside)
        if not isinstance(project, Project):
            raise _wrong(project)
        self._varied = varied
        self._plant = Plant(varied.project(project) if varied else project, net="loop")
        if errors(self._plant.diagnostics):
            raise _wrong(self._plant.diagnostics)
        assert isinstance(self._plant.network, LoopNetwork)
        self.network = self._plant.network
        self.rigs: dict[str, Rig] = {}
        self._recording = Recording()
        for kind in self._plant.kinds:
            self._add(kind)

    def _add(self, kind: Kind) -> None:
        given, _ = inputs(kind.row.sources, kind.row.resource)
        read_again = [one if isinstance(one, Source) else read(one, str(one)) for one in given]
        sources = {source.name: source for source in read_again if isinstance(source, Source)}
        for name, run in zip(kind.names, kind.runs, strict=True):
            image = run.plc.image
            programs = [program for task in image.tasks for program in task.programs]
            prefix = f"{programs[0].name}." if len(programs) == 1 else ""
            rig = Rig(Subject(name, image, prefix, sources, kind.row.libraries), plc=run.plc, network=self.network,
                      recording=self._recording, plc_name=name, varied=self._varied)
            for row in kind.row.sets:
                rig.at(row.at_ns, {row.name: row.value})
            self.rigs[name] = rig

    def __getitem__(self, name: str) -> Rig:
        if name not in self.rigs:
            raise KeyError(f"there is no PLC {name}; there is {', '.join(self.rigs)}")
        return self.rigs[name]

    def __getattr__(self, name: str) -> Rig:
        try:
            return self[name]
        except KeyError as error:
            raise AttributeError(str(error.args[0])) from None

    @property
    def elapsed_ns(self) -> int:
        """The time of the next scan of the first PLC that is due."""
        return min(rig.elapsed_ns for rig in self.rigs.values())

    def scan(self) -> PlantRig:
        """One scan of each PLC that is due next.  Raises Trapped."""
        __tracebackhide__ = True
        for rig in self.rigs.values():
            rig.disturb()
        now_ns = self.elapsed_ns
        for rig in self.rigs.values():
            if rig.elapsed_ns == now_ns:
                rig.scan()
        if self._varied:
            self._varied.scanned(now_ns)
        return self

    def run(self, time: str | int) -> PlantRig:
        """Executes scans of all PLCs for a time.  Raises Trapped."""
        __tracebackhide__ = True
        end_ns = self.elapsed_ns + to_ns(time)
        while self.elapsed_ns < end_ns:
            self.scan()
        return self

    def until(self, condition: str | Callable[[PlantRig], object], /, *, max: str | int = DEFAULT_LIMIT) -> PlantRig:
        """Executes scans of all PLCs until a condition holds: a function, or names behind those of their PLCs, `pump.Main.Done`.

        Raises AssertionError if it does not hold within `max`, Trapped after a trap."""
        __tracebackhide__ = True
        holds = self._holds(condition)
        end_ns = self.elapsed_ns + to_ns(max)
        while True:
            self.scan()
            if holds():
                return self
            if self.elapsed_ns >= end_ns:
                said = condition if isinstance(condition, str) else getattr(condition, "__name__", "the condition")
                raise AssertionError(f"{said} does not hold within {show_time(to_ns(max))[2:]}")

    def _holds(self, condition: str | Callable[[PlantRig], object]) -> Callable[[], bool]:
        if callable(condition):
            function = condition
            return lambda: bool(function(self))
        names = PlcNames({name: (rig.find, rig.plc.reader) for name, rig in self.rigs.items()})
        parsed = parse_condition(condition, names.find)
        return lambda: parsed.holds(names.read)


def project_near(folders: Sequence[Path], named: str) -> Path:
    """The project file of that name in the nearest folder.  Raises FileNotFoundError."""
    __tracebackhide__ = True
    for folder in folders:
        path = folder / named
        if path.is_dir():
            path /= FILE
        if path.is_file():
            return path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path
    raise not_found(named, folders)


def _wrong(diagnostics: Sequence[Diagnostic]) -> SubjectError:
    return SubjectError("\n".join(message.render() for message in errors(diagnostics)))
