"""A project of TwinCAT (`.plcproj`): the objects that it lists as sources, and its tasks as a CONFIGURATION."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath
from urllib.parse import unquote

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.base.files import SOURCE_BYTES, read_file, reason
from fbvm.interchange.imported import Imported
from fbvm.interchange.markup import Element, parse_markup
from fbvm.interchange.twincat import OBJECT_SUFFIXES, TASK_SUFFIX, TASKS
from fbvm.interchange.twincat.objects import ImportedObject, read_object
from fbvm.interchange.twincat.references import parameters, references, referred, used_projects

SPACE = "// a name that stands in front of other names\nVAR_GLOBAL\nEND_VAR\n"
"""A list of no global variables, whose file's name is known as a name space by that."""
_IDENTIFIER = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*")


@dataclass(frozen=True)
class TaskSettings:
    """How a task runs: its cycle in microseconds, and its priority, of which the smallest number comes first."""

    cycle_us: int
    priority: int


def read_project(path: Path, settings: Mapping[str, TaskSettings] | None = None) -> Imported:
    """Reads a project and the objects that it lists, which lie in its folder or below.

    `settings` are those of the system that runs it, by the names of tasks: they hold, in place of what the tasks' files say.

    Raises OSError if the file of the project cannot be read; what is wrong with an object is a diagnostic."""
    parsed = parse_markup(read_file(path, SOURCE_BYTES), str(path))
    if isinstance(parsed, Diagnostic):
        return Imported({}, [parsed])
    xml, root = parsed
    if root.name != "Project":
        return Imported({}, [Diagnostic("X0501", xml, root.at, root.at + 1, "the file is no project of TwinCAT",
                                        "a .plcproj has a <Project> with <Compile Include=...> for each object")])
    tasks: list[Element] = []
    sources: list[Source] = []
    diagnostics: list[Diagnostic] = []
    for item in (item for group in root.all("ItemGroup") for item in group.all("Compile")):
        if _is_excluded(item):
            continue
        found = _object(path, xml, item)
        diagnostics += found.diagnostics
        sources += [found.source] if found.source else []
        tasks += [found.task] if found.task else []
    sources += [Source(f"{path}/{space}.st", SPACE) for space in _spaces(root)]
    if tasks:
        sources.append(task_source(str(path), tasks, _property(root, "Name"), settings))
        diagnostics += _other_settings(xml, root, tasks, settings or {})
        diagnostics += _of_libraries(xml, root, tasks)
    return Imported({source.name: source.text for source in sources}, diagnostics, "twincat",
                    f"{path.name} is a project of TwinCAT", tuple(map(referred, references(root))),
                    uses=tuple(used_projects(path, root)), parameters=parameters(root))  # fmt: skip


def task_source(name: str, tasks: list[Element], application: str = "",
                settings: Mapping[str, TaskSettings] | None = None) -> Source:  # fmt: skip
    """The source that says when the programs run, for tasks out of a file of this name, in the project `application`."""
    return Source(f"{name}/{TASKS}", configuration(tasks, application, settings))


def _own(task: Element) -> TaskSettings:
    """What the file of a task says."""
    return TaskSettings(_number(task, "CycleTime", 10_000), _number(task, "Priority", 20))


def _other_settings(xml: Source, root: Element, tasks: list[Element],
                    settings: Mapping[str, TaskSettings]) -> Iterator[Diagnostic]:  # fmt: skip
    for task in tasks:
        name, own = task.get("Name"), _own(task)
        if (held := settings.get(name, own)) != own:
            yield Diagnostic("X0292", xml, root.at, root.at + 1,
                             f"the system gives the task {name} {held.cycle_us} us and priority {held.priority}, its own file "
                             f"{own.cycle_us} us and {own.priority}", "the system's hold")  # fmt: skip


def _of_libraries(xml: Source, root: Element, tasks: list[Element]) -> Iterator[Diagnostic]:
    """What is said of programs of libraries that tasks call, such as the one of the visualisation."""
    for task in tasks:
        for call in (name for name in _called(task) if "." in name):
            yield Diagnostic("X0190", xml, root.at, root.at + 1,
                             f"the task {task.get('Name')} calls {call}, a program of a library, and that is left out")


def _called(task: Element) -> list[str]:
    """The programs that a task calls, in their order."""
    calls = [named.text.strip() for call in task.all("PouCall") for named in call.all("Name")]
    return [call for call in calls if _IDENTIFIER.fullmatch(call)]


def _property(root: Element, name: str) -> str:
    """A property of the project; "" if it is not given."""
    return next((found.text.strip() for group in root.all("PropertyGroup") if (found := group.one(name)) is not None), "")


def _spaces(root: Element) -> list[str]:
    """The names that may stand in front of names of this project, where others use it, and of the libraries it refers to."""
    named = [found.text.strip() for item in references(root) if (found := item.one("Namespace")) is not None]
    named.append(_property(root, "DefaultNamespace") or _property(root, "Title"))
    return [name for name in dict.fromkeys(named) if _IDENTIFIER.fullmatch(name) and "." not in name]


def _is_excluded(item: Element) -> bool:
    excluded = item.one("ExcludeFromBuild")
    return excluded is not None and excluded.text.strip().lower() == "true"


def _object(project: Path, xml: Source, item: Element) -> ImportedObject:
    """The object that an entry of a project names."""
    written = item.get("Include")
    inside = PureWindowsPath(unquote(written))  # MSBuild writes ( and other signs as %28
    suffix = inside.suffix.lower()

    def refused(code: str, message: str, hint: str = "") -> ImportedObject:
        return ImportedObject(diagnostics=[Diagnostic(code, xml, item.at, item.at + len("<Compile"), message, hint)])

    if inside.anchor or ".." in inside.parts:
        return refused("X0501", f"{written} lies outside of the project", "copy it into the project's folder")
    if suffix not in (*OBJECT_SUFFIXES, TASK_SUFFIX):
        return refused("X0190", f"{written} holds no program, and is left out")
    file = _file(project.parent, inside.parts)
    try:
        return read_object(read_file(file, SOURCE_BYTES), str(file))
    except OSError as error:
        return refused("X0501", f"{written} cannot be read: {reason(error)}")


def _file(folder: Path, parts: tuple[str, ...]) -> Path:
    """A file below a folder: where the system tells small letters from large ones, any that Windows takes for the same."""
    found = folder.joinpath(*parts)
    if found.exists():
        return found
    here = folder
    for part in parts:
        try:
            like = [each for each in sorted(here.iterdir()) if each.name.lower() == part.lower()]
        except OSError:
            return found
        if not like:
            return found
        here = here / part if (here / part) in like else like[0]
    return here


def configuration(tasks: list[Element], application: str = "", settings: Mapping[str, TaskSettings] | None = None) -> str:
    """The text of a CONFIGURATION with these tasks (`Task` of a `.TcTTO`): CycleTime is in microseconds, the smallest Priority
    comes first, PouCall names the programs in their order.  The configuration is named as the project, `application`.
    `settings` of a task, by its name, hold in place of its own."""
    name = application if _IDENTIFIER.fullmatch(application) and "." not in application else "TwinCAT"
    lines = [f"CONFIGURATION {name}", "RESOURCE PLC ON fbvm"]
    programs: list[str] = []
    for number, task in enumerate(tasks):
        name = task.get("Name") if _IDENTIFIER.fullmatch(task.get("Name")) else f"Task_{number + 1}"
        held = (settings or {}).get(task.get("Name"), _own(task))
        lines.append(f"    TASK {name}(INTERVAL := T#{held.cycle_us}us, PRIORITY := {held.priority});")
        programs += [f"    PROGRAM {call} WITH {name} : {call};" for call in _called(task) if "." not in call]
    return "\n".join([*lines, *programs, "END_RESOURCE", "END_CONFIGURATION", ""])


def _number(task: Element, name: str, default: int) -> int:
    found = task.one(name)
    text = found.text.strip() if found else ""
    return int(text) if text.isascii() and text.isdigit() and len(text) < 16 else default
