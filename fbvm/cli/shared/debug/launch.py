"""What a debugger opens, from the arguments of `launch`: programs, projects, recordings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import click

from fbvm.base.diagnostics import Diagnostic, errors
from fbvm.base.dialects import DIALECTS
from fbvm.base.files import reason
from fbvm.cli.shared.debug.attach import literal
from fbvm.cli.shared.debug.worlds import NetworkPackets, ProgramErrors, ProjectWorld, program_world
from fbvm.cli.shared.e_banks import e_banks_in
from fbvm.cli.shared.options import mapping
from fbvm.cli.shared.paths import sources_in
from fbvm.code.compiler import compile_files
from fbvm.code.image import Image
from fbvm.dap.target import LaunchError, Target, checked
from fbvm.interchange.formats.given import given_sources, inputs, source_files, usual_dialect
from fbvm.machine.plc import Plc
from fbvm.record.recording.container import RecordingError
from fbvm.record.recording.file_reader import RecordingFile
from fbvm.record.recording.file_scans import FileScans
from fbvm.record.recording.scans import RecordedScans
from fbvm.record.trace.source_texts import source_texts
from fbvm.record.trace.writer import Depth
from fbvm.run.project import FILE, Project, project_file, read_project
from fbvm.run.running import TimedWrite
from fbvm.step.past_session import PastSession
from fbvm.step.position import Position
from fbvm.step.session import Session
from fbvm.step.world import World
from fbvm.watch.places import parse_for
from fbvm.watch.values import parse_time_ns

LAUNCH: dict[str, tuple[type, ...]] = {
    "program": (str, list), "project": (str,), "plc": (str,), "main": (str,), "resource": (str,), "libraries": (list,),
    "dialect": (str,), "heap": (int,),
    "cycle": (str,), "timing": (str,), "seed": (int,), "engine": (str,), "map": (list,), "set": (list,),
    "force": (dict,), "stopOnEntry": (bool,), "for": (str,), "scans": (int,), "noDebug": (bool,), "cwd": (str,), "test": (str,),
    "recording": (str,),
}  # fmt: skip
"""The keys of a launch configuration, and what their values are; `docs/howto/debugger.md` describes each."""


def open_launch(arguments: Mapping[str, Any]) -> Target:
    """What `launch` asks for.  Raises LaunchError."""
    given = checked(arguments, LAUNCH, "launch")
    chosen = [key for key in ("program", "project", "test", "recording") if key in given]
    if len(chosen) != 1:
        raise LaunchError("launch has either program (a file, files or a folder), project (an fbvm.toml), test or recording")
    folder = Path(given.get("cwd", "."))
    try:
        if chosen[0] == "recording":
            return _recording(folder / given["recording"], [folder / str(path) for path in given.get("libraries", ())])
        if chosen[0] == "test":
            return _test(given["test"], folder)
        if chosen[0] == "program" and not (isinstance(given["program"], str) and _is_project(folder / given["program"])):
            return _program(given, folder)
        return _project(given, folder / given[chosen[0]])
    except (click.ClickException, LookupError, TypeError, ValueError, OSError) as error:
        said = error.format_message() if isinstance(error, click.ClickException) else str(error)
        raise LaunchError(said) from None


def _is_project(path: Path) -> bool:
    return path.suffix == ".toml" or (path.is_dir() and project_file(path) is not None)


def _sources(given: Mapping[str, Any], folder: Path) -> list[Path]:
    named = given["program"] if isinstance(given["program"], list) else [given["program"]]
    found: list[Path] = []
    for name in named:
        path = folder / str(name)
        found += sources_in(path) if path.is_dir() else [path]
    if not found:
        raise LaunchError(f"there are no sources in {given['program']}")
    for path in found:
        if not path.is_file():
            raise LaunchError(f"there is no file {path}")
    return found


def _program(given: Mapping[str, Any], folder: Path) -> Target:
    """A program on a PLC with its units and a network in memory."""
    if "plc" in given:
        raise LaunchError("plc: it names one of the PLCs of a project; a program is one PLC")
    if given.get("dialect", "standard") not in DIALECTS:
        raise LaunchError(f"there is no dialect {given['dialect']!r}; there are {', '.join(DIALECTS)}")
    files, libraries = _sources(given, folder), [folder / str(path) for path in given.get("libraries", ())]
    try:
        sources, said = inputs(files, given.get("resource"))
    except OSError as error:
        raise LaunchError(f"a project cannot be read: {reason(error)}") from None
    if errors(said):
        raise LaunchError("the project cannot be taken over", _said(said))
    compilation = compile_files(sources, program=given.get("main"), libraries=libraries, runnable=True, drawn=True,
                                resource=given.get("resource"), dialect=given.get("dialect") or usual_dialect(files),
                                heap=given.get("heap"))  # fmt: skip
    image = _image(compilation.image, compilation.diagnostics)
    sets = [_SetRow.of(row) for row in given.get("set", ())]
    image = image.with_e_banks(e_banks_in([row.name for row in sets] + list(given.get("force", {}))))
    cycle_ns = _time_ns(given.get("cycle", "10ms"))
    mappings = tuple(mapping(str(row)) for row in given.get("map", ()))
    timing, seed = given.get("timing", "exact"), given.get("seed", 0)
    if timing not in ("exact", "real"):
        raise LaunchError(f"timing is exact or real, not {timing!r}")
    for row in mappings:
        if row.host is not None:
            raise LaunchError(f"the debugger's network stays in memory: map {row.endpoint}=peer")
    packets = NetworkPackets()
    world = program_world(image, cycle_ns, mappings, timing, seed, packets, given.get("engine", "auto"),
                          lambda name, plc: [row.of_plc(plc) for row in sets])  # fmt: skip
    named = given_sources(files, given.get("resource"))
    texts = source_texts(image, named, libraries)
    return _target(given, world, "plc", texts, source_files(named), packets, _said([*said, *compilation.diagnostics]))


def _recording(path: Path, libraries: Sequence[Path]) -> Target:
    """The PLCs of a recording in a file, from its end backwards."""
    try:
        file = RecordingFile.open(path, libraries)
    except RecordingError as error:
        raise LaunchError(str(error)) from None
    sessions: dict[str, Session | PastSession] = {}
    texts: dict[str, str] = {}
    notes = []
    for name in file:
        recorded = file[name]
        if isinstance(recorded.program, str):
            notes.append(f"{name}: {recorded.program}")
            continue
        sessions[name] = PastSession(FileScans(recorded, Depth.STATEMENTS), name)
        texts |= source_texts(recorded.program, recorded.texts, libraries)
    if not sessions:
        file.close()
        raise LaunchError(f"{path.name} has no scan that can be executed again", "\n".join(notes))
    paths = {name: path for name in texts if (path := Path(name)).is_file()}
    return Target(sessions, texts, paths, notes=notes, close=file.close)


def _test(node: str, folder: Path) -> Target:
    """The recordings of a test that is run now."""
    from fbvm.cli.shared.debug.recorded_item import record_item

    item = record_item(node, folder)
    if not item.recordings:
        raise LaunchError(f"{node} has no rig that did a scan", item.output)
    sessions = {name: PastSession(RecordedScans(recorded, {}), name) for name, recorded in item.recordings.items()}
    paths = {name: folder / name for name in item.texts if (folder / name).is_file()}
    return Target(sessions, item.texts, paths, notes=[item.output], failure=item.reason)


def _project(given: Mapping[str, Any], path: Path) -> Target:
    """The PLCs of a project, which share one time and one network in memory."""
    own = {"main", "resource", "libraries", "dialect", "heap", "cycle", "engine", "timing", "seed", "map"} & set(given)
    if own:
        raise LaunchError(f"{', '.join(sorted(own))}: with a project its file says that")
    project = _read_project(path)
    chosen, sets, packets = given.get("plc"), [_SetRow.of(row) for row in given.get("set", ())], NetworkPackets()
    names: list[str] = []

    def writes(name: str, plc: Plc) -> list[TimedWrite]:
        names.append(name)
        return [row.of_plc(plc) for row in sets] if name == (chosen or names[0]) else []

    try:
        world = ProjectWorld(project, packets, writes)
    except ProgramErrors as error:
        raise LaunchError(str(error), _said(error.diagnostics)) from None
    chosen = chosen or world.names[0]
    if chosen not in world.names:
        raise LaunchError(f"there is no PLC {chosen}; there is {', '.join(world.names)}")
    return _target(given, world, chosen, world.sources.texts, world.sources.paths, packets, _said(world.diagnostics))


def _read_project(path: Path) -> Project:
    """The project of a file or a folder.  Raises LaunchError."""
    file = project_file(path) if path.is_dir() else path
    if file is None or not file.is_file():
        raise LaunchError(f"there is no {FILE} in {path}" if path.is_dir() else f"there is no file {path}")
    project = read_project(file)
    if not isinstance(project, Project):
        raise LaunchError(f"{file.name} has errors", _said(project))
    return project


def _target(given: Mapping[str, Any], world: World, chosen: str, texts: Mapping[str, str], paths: Mapping[str, Path],
            packets: NetworkPackets, notes: str) -> Target:  # fmt: skip
    """The PLCs of a world, the chosen one first, with the forces and the end that are given."""
    names = [chosen, *(name for name in world.names if name != chosen)]
    sessions = {name: Session(world, name) for name in names}
    first = sessions[chosen]
    for name, value in given.get("force", {}).items():
        place = first.find(name)
        parsed = parse_for(place, literal(value))
        first.act(lambda plc, name=name, parsed=parsed: plc.force(name, parsed))  # type: ignore[misc]
    until = None
    if "for" in given or "scans" in given:
        bounds = [given["scans"]] if "scans" in given else []
        cycle_ns = world[chosen].cycle_ns
        until = min([*bounds, *([-(-_time_ns(given["for"]) // cycle_ns)] if "for" in given else [])])
    assert first.here == Position()
    return Target(sessions, texts, paths, lambda: packets.packets, until, given.get("stopOnEntry"), [notes] if notes else [])


class _SetRow:
    """A row of `set`: a name, a value as a text, and when it is written."""

    def __init__(self, name: str, value: str, at_ns: int) -> None:
        self.name, self.value, self.at_ns = name, value, at_ns

    @classmethod
    def of(cls, row: Any) -> _SetRow:
        """The row of an object.  Raises LaunchError."""
        if not isinstance(row, dict) or not {"name", "value"} <= set(row) <= {"name", "value", "at"}:
            raise LaunchError(f'a row of set is {{"name": ..., "value": ..., "at": "50ms"}}, not {row!r}')
        return cls(str(row["name"]), literal(row["value"]), _time_ns(row["at"]) if "at" in row else 0)

    def of_plc(self, plc: Plc) -> TimedWrite:
        """What is written into a PLC."""
        place = plc.find(self.name)
        return TimedWrite(place, parse_for(place, self.value), self.at_ns)


def _time_ns(text: object) -> int:
    return parse_time_ns(str(text))


def _image(image: Image | None, diagnostics: Iterable[Diagnostic]) -> Image:
    """The image.  Raises LaunchError with what the compiler says if there is none."""
    if image is None:
        raise LaunchError("the program has errors", _said(diagnostics))
    return image


def _said(diagnostics: Iterable[Diagnostic]) -> str:
    return "\n".join(diagnostic.render() for diagnostic in diagnostics)
