"""Files of other tools among the sources of a program, which editors show and only those tools write.

An object of TwinCAT is Structured Text at the places at which it stands in the XML, so all that is said of a place holds for the
file.  A container (a project of TwinCAT or CX-Programmer, PLCopen XML) holds sources that are no files, below its own name."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path

from fbvm.base.diagnostics import Diagnostic
from fbvm.interchange.formats.given import CX_SUFFIXES, sources_by_name, within
from fbvm.interchange.imported import Imported, Place
from fbvm.interchange.twincat import OBJECT_SUFFIXES, PROJECT_SUFFIX
from fbvm.interchange.twincat.objects import read_object

CONTAINERS = (PROJECT_SUFFIX, *CX_SUFFIXES, ".xml")
STRUCTURED_TEXT = ".st"


def is_object(path: Path) -> bool:
    """True for an object of TwinCAT."""
    return path.suffix.lower() in OBJECT_SUFFIXES


def is_container(path: Path) -> bool:
    """True for a project of TwinCAT or CX-Programmer, or a document in PLCopen XML."""
    return path.suffix.lower() in CONTAINERS


def is_foreign(path: Path) -> bool:
    """True for a file that another tool writes."""
    return is_object(path) or is_container(path)


def container_of(name: str) -> Path | None:
    """The container below which the name of a source lies; None for a file."""
    return next((path for path in Path(name).parents if is_container(path) and path.is_file()), None)


def structured_text(path: Path, text: str) -> tuple[str | None, list[Diagnostic]]:
    """The text of an object with blanks in place of its XML, and what is said about it; None for a damaged file."""
    made = read_object(text.encode(), str(path))
    return made.source.text if made.source is not None else None, made.diagnostics


@dataclass
class Gathered:
    """The files of a program: those that an editor can open, and the sources within containers."""

    paths: list[Path] = field(default_factory=list)
    """Source files, and the containers."""
    held: dict[str, str] = field(default_factory=dict)
    """Texts of sources that are no files, by name."""
    said: dict[Path, list[Diagnostic]] = field(default_factory=dict)
    """What reading the containers has told, by container."""
    containers: dict[Path, Imported] = field(default_factory=dict)
    """What the containers hold."""


def gathered(paths: Iterable[Path], resource: str | None = None) -> Gathered:
    """The files that some paths stand for: of a container what it holds, of all others themselves."""
    found = Gathered()
    within_all = {}
    for path in (each.absolute() for each in paths):
        made = None
        if path.suffix.lower() != STRUCTURED_TEXT and not is_object(path):
            try:
                made = within(path, resource)
            except OSError:
                continue
        within_all[path] = made
        if made is not None:
            found.containers[path] = made
            said = [each for each in made.diagnostics if Path(each.source.name) == path]
            found.said[path] = said if made.is_text else [replace(each, start=0, end=0) for each in said]
    for name, source in sources_by_name(within_all).items():
        if isinstance(source, Path):
            found.paths.append(source)
        elif container_of(name) is None and Path(name).is_file():
            found.paths.append(Path(name))
        else:
            found.held[name] = source
    found.paths += [path for path in found.said if path not in found.paths]
    return found


def narrowed(place: Place, text: str) -> tuple[int, int]:
    """Start and end of a word in a place of a container; of all of the place if the word does not stand there."""
    word = re.compile(rf"(?<!\w){re.escape(text)}(?!\w)") if text.strip() and "\n" not in text else None
    found = word.search(place.document.text, place.start, place.end) if word is not None else None
    return found.span() if found else (place.start, place.end)


def project_with(path: Path, ends: Callable[[Path], bool]) -> Path | None:
    """The project of TwinCAT that lists an object, in its folder or above; `ends` says of a folder that none above counts."""
    for folder in path.parents:
        for project in sorted(folder.glob(f"*{PROJECT_SUFFIX}")):
            if path in gathered([project]).paths:
                return project
        if ends(folder):
            return None
    return None
