"""Which files are one program: those of a PLC in `fbvm.toml`, those of a project of another tool, else a file with those of its
folder that declare what it names."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from urllib.parse import unquote, urlparse
from urllib.request import url2pathname

from fbvm.analysis.program import Program
from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.base.types import fold
from fbvm.check.symbols.library import LibraryError
from fbvm.interchange.formats.given import usual_dialect
from fbvm.interchange.imported import Imported, Place
from fbvm.lsp import foreign
from fbvm.run.project import FILE, read_project
from fbvm.syntax.text import read

_DECLARES = re.compile(r"^[ \t]*(?:FUNCTION_BLOCK|FUNCTION|PROGRAM|TYPE\s+|TYPE)\s+(\w+)", re.I | re.M)
_WORD = re.compile(r"[A-Za-z_]\w*")
_TEST = re.compile(r"test_.*\.st$")
"""Names of files with tests."""
TEST_LIBRARY = Path(__file__).parents[1] / "testing" / "library"
"""The library with ASSERT, which `fbvm.testing` brings."""
SOURCES = "src"
ROOTS = (FILE, "pytest.ini", "pyproject.toml", ".git")
"""What a folder holds above which tests do not look for blocks."""
MOST_FILES = 500
"""Files of a folder without a project file that are looked at."""


@dataclass(frozen=True)
class Settings:
    """What an editor says about files without a project file."""

    dialect: str = "standard"
    libraries: tuple[Path, ...] = ()


@dataclass(eq=False)
class Project:
    """A program and the files on disk that it consists of."""

    program: Program
    paths: list[Path]
    """Its files, which the program knows by `str(path)`."""
    named: list[Path]
    """The files that its project file names, there or not; without one the file with which it was begun, or its container."""
    said: dict[Path, list[Diagnostic]] = field(default_factory=dict)
    """What is said about files of other tools by those who read them."""
    held: tuple[str, ...] = ()
    """Names of sources that lie within files of other tools."""
    resource: str | None = None
    containers: dict[Path, Imported] = field(default_factory=dict)
    """What its containers hold."""
    file: Path | None = None
    """The project file, None without one."""
    plc: str = ""
    """The name of the PLC in the project file."""
    libraries_told: set[Path] = field(default_factory=set)
    """Files of libraries in which the editor shows mistakes."""
    task: object | None = None
    """The check that is under way."""

    @cached_property
    def members(self) -> frozenset[Path]:
        """`paths` as a set, once these are settled: after each key every file of a program is looked for in it."""
        return frozenset(self.paths)


def path_of(uri: str) -> Path:
    """The file of a URI; drive letters of Windows are in lower case."""
    parsed = urlparse(uri)
    text = url2pathname(unquote(parsed.path)) if parsed.scheme == "file" else f"/{parsed.scheme}/{parsed.path}"
    return Path(text[:1].lower() + text[1:] if text[1:2] == ":" else text)


def project_file_above(path: Path) -> Path | None:
    """The nearest `fbvm.toml` in the folder of a file or above."""
    return next((folder / FILE for folder in path.parents if (folder / FILE).is_file()), None)


def _test_libraries(path: Path) -> Iterator[Path]:
    """Where `fbvm test` finds what a test in ST names: ASSERT, and blocks in a `src` beside the test or above it."""
    yield TEST_LIBRARY
    for folder in path.parents:
        if (folder / SOURCES).is_dir():
            yield folder / SOURCES
        if _is_root(folder):
            return


def _is_root(folder: Path) -> bool:
    return any((folder / name).exists() for name in ROOTS)


def _goes_with(other: Path, path: Path) -> bool:
    """True for a file that may be of one program with another one: both are texts, or both are objects of TwinCAT."""
    return foreign.is_object(other) if foreign.is_object(path) else other.suffix == foreign.STRUCTURED_TEXT


class Projects:
    """The programs of the files that are open.  `text_of` gives the text that an editor has of a file, None for others."""

    def __init__(self, text_of: Callable[[Path], str | None]) -> None:
        self._text_of = text_of
        self.settings = Settings()
        self.all: list[Project] = []
        self.wrong: dict[Path, list[Diagnostic]] = {}
        """Diagnostics of project files and libraries, by file."""

    def of(self, path: Path) -> list[Project]:
        """The programs that a file belongs to."""
        return [each for each in self.all if path in each.members]

    def open(self, path: Path) -> list[Project]:
        """The programs that a file belongs to, which are begun if there are none yet."""
        known = self.of(path)
        if known:
            return known
        described = project_file_above(path)
        begun = self._described(described) if described is not None and not self._is_begun(described) else []
        self.all += begun
        if not self.of(path):
            self.all += self._undescribed(path)
        return self.of(path)

    def place_in_container(self, source: Source, offset: int) -> Place | None:
        """Where something of a source within a container stands in the container; None if nobody knows."""
        container = foreign.container_of(source.name)
        made = [each.containers[container] for each in self.all if container in each.containers]
        places = made[0].places.get(source.name, ()) if made else ()
        line = source.place(offset)[0]
        return places[line - 1] if line <= len(places) else None

    def close(self, open_paths: Iterable[Path]) -> list[Project]:
        """Forget the programs of which no file is open any more; returns these."""
        kept = set(open_paths)
        gone = [each for each in self.all if not kept & set(each.paths)]
        self.all = [each for each in self.all if each not in gone]
        return gone

    def forget(self, project_file: Path | None = None) -> list[Project]:
        """Forget the programs of a project file, or all without one, since what says which they are has changed."""
        gone = [each for each in self.all if project_file is None or each.file in (None, project_file)]
        self.all = [each for each in self.all if each not in gone]
        return gone

    def forget_container(self, path: Path) -> list[Project]:
        """Forget the programs that have sources out of a container, of which a file has changed."""
        gone = [each for each in self.all if path in each.paths
                or any(foreign.is_container(named) and named.parent in path.parents for named in each.named)]  # fmt: skip
        self.all = [each for each in self.all if each not in gone]
        return gone

    def forget_regrouped(self, path: Path) -> list[Project]:
        """Forget the programs that consist of other files now that a file has come or gone on disk."""
        gone = [each for each in self.all if path in each.paths or self._concerns(each, path)]
        gone = [each for each in gone if self._files(each) != each.paths]
        self.all = [each for each in self.all if each not in gone]
        return gone

    def _concerns(self, project: Project, path: Path) -> bool:
        if project.file is not None:
            return path in project.named
        begun = project.named[0]
        return begun.parent in path.parents if foreign.is_container(begun) else path.parent == begun.parent

    def _files(self, project: Project) -> list[Path]:
        """The files of which a program consists as the disk is now."""
        paths = project.named if project.file is not None else self._together(project.named[0])
        return [path for path in foreign.gathered(paths, project.resource).paths
                if foreign.is_container(path) or self._read(path) != (None, [])]

    def _is_begun(self, described: Path) -> bool:
        return any(each.file == described for each in self.all)

    def _described(self, described: Path) -> list[Project]:
        """The programs of a project file, one for each PLC."""
        read_in = read_project(described, allow_outside=True, text=self._text_of(described))
        if isinstance(read_in, list):
            self.wrong[described] = read_in
            return []
        self.wrong[described] = []
        made = []
        for plc in read_in.plcs:
            project = self._project(plc.sources, plc.dialect, plc.libraries, plc.program, plc.resource)
            if project is not None:
                project.file, project.plc = described, plc.name
                project.named = [source.absolute() for source in plc.sources]
                made.append(project)
        return made

    def _undescribed(self, path: Path) -> list[Project]:
        libraries = (*self.settings.libraries, *(_test_libraries(path) if _TEST.match(path.name) else ()))
        begun = self._begun_with(path)
        dialect = self.settings.dialect if self.settings.dialect != "standard" else usual_dialect([begun])
        project = self._project(self._together(begun), dialect, libraries, None, None)
        return [project] if project is not None else []

    def _project(self, paths: Iterable[Path], dialect: str, libraries: tuple[Path, ...], program: str | None,
                 resource: str | None) -> Project | None:
        try:
            made = Program(libraries=libraries, dialect=dialect, program=program, resource=resource)
        except LibraryError as error:
            self.wrong[Path(error.described)] = [error.diagnostic]
            made = Program(dialect=dialect, program=program, resource=resource)
        paths = list(paths)
        gathered = foreign.gathered(paths, resource)
        project = Project(made, [], [path.absolute() for path in paths[:1]], gathered.said, tuple(gathered.held), resource,
                          gathered.containers)
        for name, text in gathered.held.items():
            made.replace(name, text)
        project.paths = [path for path in gathered.paths if self.take(project, path) or foreign.is_container(path)]
        return project

    def take(self, project: Project, path: Path) -> bool:
        """Gives a program the present text of a file; returns False if it has none, and nothing is said about it.

        Containers stay as they were read."""
        if foreign.is_container(path):
            return False
        text, said = self._read(path)
        if foreign.is_object(path):
            project.said[path] = said
        if text is None:
            project.program.remove(str(path))
        else:
            project.program.replace(str(path), text)
        return text is not None or bool(said)

    def text(self, path: Path) -> str | None:
        """The Structured Text of a file, unsaved or on disk; None for one that cannot be read."""
        return self._read(path)[0]

    def _read(self, path: Path) -> tuple[str | None, list[Diagnostic]]:
        """The Structured Text of a file, and what is said about a file of another tool."""
        text = self._text_of(path)
        if text is None:
            found = read(path, str(path))
            text = found.text if isinstance(found, Source) else None
        return foreign.structured_text(path, text) if text is not None and foreign.is_object(path) else (text, [])

    def _begun_with(self, path: Path) -> Path:
        """The file with which the program of a file begins: of an object of TwinCAT the project that lists it, if one does."""
        project = foreign.project_with(path, _is_root) if foreign.is_object(path) else None
        return project or path

    def _together(self, path: Path) -> list[Path]:
        """A file, and the files of its folder that declare what it or one of these names.

        A file that declares a name again is left out: a folder may hold many programs that have nothing to do with each other."""
        if foreign.is_container(path):
            return [path]
        beside = [each for each in sorted(path.parent.iterdir()) if _goes_with(each, path)] if path.parent.is_dir() else []
        texts = {other: text for other in beside[:MOST_FILES]
                 if other != path and (text := self.text(other)) is not None}
        declared = {other: {fold(found[1]) for found in _DECLARES.finditer(text)} for other, text in texts.items()}
        own = self.text(path) or ""
        known = {fold(found[1]) for found in _DECLARES.finditer(own)}
        chosen, words = [path], {fold(word) for word in _WORD.findall(own)}
        while True:
            more = [other for other, names in declared.items() if names & (words - known) and not names & known]
            if not more:
                return chosen
            chosen.append(more[0])
            words |= {fold(word) for word in _WORD.findall(texts[more[0]])}
            known |= declared.pop(more[0])
