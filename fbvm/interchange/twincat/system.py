"""A system of TwinCAT (`.tsproj`): the PLC project that it runs, and the cycles of its tasks.

    TcSmProject/Project/System/Tasks/Task        Priority and CycleTime (in 100 ns), the name in an element of its own
    TcSmProject/Project/Plc/Project              PrjFilePath, or File: a file of `_Config/PLC` (`.xti`) that has it
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path, PureWindowsPath

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.base.files import SOURCE_BYTES, read_file, reason, resolved
from fbvm.interchange.imported import Imported
from fbvm.interchange.markup import Element, parse_markup
from fbvm.interchange.twincat import PROJECT_SUFFIX
from fbvm.interchange.twincat.project import TaskSettings, read_project

ROOT, PART = "TcSmProject", "TcSmItem"
PARTS = Path("_Config", "PLC")
"""Where the parts of a system lie that have files of their own."""
CYCLE_UNIT_NS = 100


def read_system(path: Path) -> Imported:
    """Reads a system and the PLC project that it runs, which lies in its folder or below.

    Raises OSError if the file of the system cannot be read; all else that is wrong is a diagnostic."""
    parsed = parse_markup(read_file(path, SOURCE_BYTES), str(path))
    if isinstance(parsed, Diagnostic):
        return Imported({}, [parsed])
    xml, root = parsed
    if root.name != ROOT:
        return _refused(xml, root, "the file is no system of TwinCAT", f"a .tsproj has a <{ROOT}> with <Plc> in it")
    found, said = [], list[Diagnostic]()
    for element in (row for each in root.all("Project") for plc in each.all("Plc") for row in plc.all("Project")):
        made = _project(path, xml, element)
        if isinstance(made, Diagnostic):
            said.append(made)
        else:
            found.append(made)
    if said or not found:
        return Imported({}, said) if said else _refused(xml, root, "the system has no PLC project")
    found = _not_used(found) or found
    if len(found) > 1:
        names = " ".join(project.name for project in found)
        return _refused(xml, root, f"the system has {len(found)} PLC projects: {names}",
                        "name the one that is to run, and behind it those that it uses as libraries")  # fmt: skip
    try:
        return read_project(found[0], dict(_tasks(root)))
    except OSError as error:
        return _refused(xml, root, f"{found[0]} cannot be read: {reason(error)}")


def _not_used(found: list[Path]) -> list[Path]:
    """Of several PLC projects those that no other one refers to as a library; none if one cannot be read."""
    if len(found) == 1:
        return found
    try:
        made = [read_project(path) for path in found]
    except OSError:
        return []
    used = {resolved(path) for each in made for path in each.uses}
    return [path for path in found if resolved(path) not in used]


def _refused(xml: Source, element: Element, message: str, hint: str = "") -> Imported:
    return Imported({}, [_diagnostic(xml, element, message, hint)])


def _diagnostic(xml: Source, element: Element, message: str, hint: str = "") -> Diagnostic:
    return Diagnostic("X0501", xml, element.at, element.at + 1, message, hint)


def _project(system: Path, xml: Source, element: Element) -> Path | Diagnostic:
    """The file of a PLC project: the element names it, or the file that has the rest of the element."""
    folder, written = system.parent, element.get("PrjFilePath")
    if not written and (part := element.get("File")):
        if len(PureWindowsPath(part).parts) != 1:
            return _diagnostic(xml, element, f"{part} lies outside of {PARTS}")
        path = folder / PARTS / part
        try:
            parsed = parse_markup(read_file(path, SOURCE_BYTES), str(path))
        except OSError as error:
            return _diagnostic(xml, element, f"{path} cannot be read: {reason(error)}")
        if isinstance(parsed, Diagnostic):
            return parsed
        (xml, root), folder = parsed, path.parent
        inside = [row.get("PrjFilePath") for row in root.all("Project") if row.get("PrjFilePath")]
        if root.name != PART or len(inside) != 1:
            return _diagnostic(xml, root, "the file is no part of a system with one PLC project")
        element, written = root, inside[0]
    inner = PureWindowsPath(written)
    path = folder.joinpath(*inner.parts)
    if not written or inner.suffix.lower() != PROJECT_SUFFIX:
        return _diagnostic(xml, element, "the PLC project has no PrjFilePath with a .plcproj")
    if inner.anchor or not resolved(path).is_relative_to(resolved(system.parent)):
        return _diagnostic(xml, element, f"{written} lies outside of the system's folder", "name the .plcproj itself")
    return path


def _tasks(root: Element) -> Iterator[tuple[str, TaskSettings]]:
    """By the name of each task its cycle in microseconds and its priority."""
    for task in (row for project in root.all("Project") for system in project.all("System")
                 for tasks in system.all("Tasks") for row in tasks.all("Task")):  # fmt: skip
        named, cycle, priority = task.one("Name"), task.get("CycleTime"), task.get("Priority")
        if named is not None and all(text.isascii() and text.isdigit() and len(text) < 16 for text in (cycle, priority)):
            yield named.text.strip(), TaskSettings(int(cycle) * CYCLE_UNIT_NS // 1000, int(priority))
