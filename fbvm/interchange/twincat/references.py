"""Projects of a solution that refer to each other: a `.plcproj` names a library, and another `.plcproj` has that title.

A reference may set constants of the library's lists of parameters (`.TcGVL`), such as the number of suites in TcUnit:

    PlaceholderReference Include="Core"/Parameters/Parameter ListName="Param"/Key, Value
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from itertools import islice
from pathlib import Path, PurePath

from fbvm.base.diagnostics import Diagnostic
from fbvm.base.files import SOURCE_BYTES, read_file, resolved
from fbvm.interchange.imported import Imported
from fbvm.interchange.markup import Element, parse_markup
from fbvm.interchange.twincat import PROJECT_SUFFIX, SYSTEM_SUFFIX

HIGHEST, DEEPEST, MOST_FOLDERS = 4, 5, 2_000
"""Folders above a project in which its solution is looked for, folders below that in which projects are, and how many at most."""
SOLUTION = ".sln"
_SHIPPED = re.compile(r"(?i)tc[23]_\w+|visu\w*|base interfaces|system\w*")
"""Libraries that come with TwinCAT, and are no project of a user's solution."""

Parameters = Mapping[tuple[str, str], str]
"""By the names of a list and of a constant in it, in small letters, the value that a reference sets."""


def references(root: Element) -> list[Element]:
    """The references of a project to libraries."""
    return [item for group in root.all("ItemGroup") for item in group.all("PlaceholderReference", "LibraryReference")]


def referred(item: Element) -> str:
    """The name of the library that a reference names."""
    return item.get("Include").partition(",")[0].strip()


def parameters(root: Element) -> dict[tuple[str, str], str]:
    """The constants that the references of a project set."""
    found = {}
    for row in (row for item in references(root) for group in item.all("Parameters") for row in group.all("Parameter")):
        key, value = row.one("Key"), row.one("Value")
        if key is not None and value is not None:
            found[row.get("ListName").lower(), key.text.strip().lower()] = value.text.strip()
    return found


def titles(root: Element) -> set[str]:
    """The names, in small letters, under which other projects refer to one."""
    groups = root.all("PropertyGroup")
    return {found.text.strip().lower() for group in groups for found in group.all("Title", "Name") if found.text.strip()}


def used_projects(path: Path, root: Element) -> list[Path]:
    """The files of the projects in the same solution that a project refers to."""
    wanted = {referred(item).lower() for item in references(root) if not _SHIPPED.fullmatch(referred(item))}
    solution = _solution(path) if wanted else None
    if solution is None:
        return []
    others = [other for other in _projects_below(solution) if resolved(other) != resolved(path)]
    return [other for other in others if _titles_of(other) & wanted]


def _solution(path: Path) -> Path | None:
    """The folder of the solution that a project belongs to: the nearest with a `.sln` above it, else with a `.tsproj`."""
    above = path.parent
    folders = []
    for _ in range(HIGHEST):
        folders.append(Path(os.path.normpath(above)))
        above = above / ".."
    for suffix in (SOLUTION, SYSTEM_SUFFIX):
        for folder in folders:
            try:
                if any(name.lower().endswith(suffix) for name in os.listdir(folder)):
                    return folder
            except OSError:
                continue
    return None


def _projects_below(folder: Path) -> Iterator[Path]:
    for at, below, files in islice(os.walk(folder), MOST_FOLDERS):
        depth = len(PurePath(os.path.relpath(at, folder)).parts)
        below[:] = sorted(name for name in below if not name.startswith((".", "_Boot"))) if depth < DEEPEST else []
        yield from (Path(os.path.normpath(Path(at, name))) for name in sorted(files) if name.lower().endswith(PROJECT_SUFFIX))


def _titles_of(path: Path) -> set[str]:
    """The names of a project in a file; none if it cannot be read."""
    try:
        about = path.stat()
    except OSError:
        return set()
    return _titles_in(path, about.st_mtime_ns, about.st_size)


@lru_cache(maxsize=64)
def _titles_in(path: Path, changed_ns: int, size: int) -> set[str]:
    try:
        parsed = parse_markup(read_file(path, SOURCE_BYTES), str(path))
    except OSError:
        return set()
    return {path.stem.lower()} if isinstance(parsed, Diagnostic) else titles(parsed[1]) or {path.stem.lower()}


def with_parameters(made: Imported, values: Parameters) -> Imported:
    """The sources of a library with the constants that a reference sets; lines stay where they are."""
    files = {name: _set(name, text, values) for name, text in made.files.items()}
    return replace(made, files=files) if values else made


def _set(name: str, text: str, values: Parameters) -> str:
    for (listed, key), value in values.items():
        if PurePath(name).stem.lower() == listed:
            text = re.sub(rf"(?i)(\b{re.escape(key)}\s*:[^:;=]+:=\s*)[^;]*(?=;)", lambda found: found[1] + value, text)  # noqa: B023
    return text
