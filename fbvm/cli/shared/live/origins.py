"""Where the PLCs of a page come from: files or a project, built at the start and again after a change of the files."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

from fbvm.base.diagnostics import Diagnostic, Source, errors
from fbvm.cli.shared import status
from fbvm.cli.shared.doors import say_doors, unusable
from fbvm.cli.shared.given_sources import given_sources, inputs
from fbvm.cli.shared.project_arguments import read_given_project
from fbvm.cli.shared.run_recording import program_text
from fbvm.cli.shared.sources import report_diagnostics, show_diagnostic
from fbvm.cli.shared.terminal import say
from fbvm.code.compiler import compile_files
from fbvm.code.image import Image
from fbvm.interchange.formats.given import given_sources as sources_within
from fbvm.interchange.formats.given import inputs as inputs_within
from fbvm.live.changes import ProgramFiles
from fbvm.machine.plc import Plc
from fbvm.record.recording.program_text import ProgramText
from fbvm.record.trace.source_texts import source_texts
from fbvm.run.picture_rows import Picture
from fbvm.run.plant import Plant
from fbvm.run.project import PlcRow, Project
from fbvm.run.running import Running

GROUPS_FILE = "watch.toml"
"""Beside the file of a project; beside a program with its name in front: pump.watch.toml."""


@dataclass
class SeenPlc:
    """A PLC that a page shows, with the texts of its sources by name, and its program for the recording."""

    plc: Plc
    texts: dict[str, str]
    text: ProgramText
    watch: tuple[str, ...] = ()
    """What a page watches at first."""


@dataclass
class Built:
    """PLCs that are about to run, by the names that pages show, with their bounds; `close` ends their network."""

    plcs: dict[str, SeenPlc]
    runs: list[Running]
    close: Callable[[], None] = lambda: None
    repeated: tuple[Sequence[Path], str | None] | None = None
    """The files and the program with which a test can do the run again; None where none can."""


class Origin(Protocol):
    """What a page runs."""

    @property
    def files(self) -> Sequence[Path]:
        """The files whose change makes another program; none for a program that is not begun again."""

    @property
    def groups_file(self) -> Path | None:
        """Where groups of watched names are kept; None if nowhere."""

    def matters(self, changed: Sequence[Path]) -> bool:
        """True if these changed files make another program."""

    def programs(self) -> Sequence[ProgramFiles] | list[Diagnostic]:
        """What is compiled, or the errors of the file that says it."""

    def mistakes(self) -> list[Diagnostic]:
        """Compiles everything as `build` does; returns the errors."""

    def build(self) -> Built:
        """Makes the PLCs.  Ends the verb for a network that cannot be used."""


@dataclass
class BuiltOrigin:
    """PLCs that have been built already, and are not begun again."""

    built: Built
    files: Sequence[Path] = ()
    groups_file: Path | None = None

    def matters(self, changed: Sequence[Path]) -> bool:
        return False

    def programs(self) -> list[ProgramFiles]:
        return []

    def mistakes(self) -> list[Diagnostic]:
        return []

    def build(self) -> Built:
        return self.built


@dataclass
class FileOrigin:
    """Programs in files, with their units and a network, as `fbvm run` and `fbvm live` take them.

    `image` is the program as it was compiled first; `wire` attaches units and a network to a PLC with it, and returns what closes
    these; `bound` says how the PLC runs; `options` are those of `compile_files`."""

    given: Sequence[Path]
    libraries: Sequence[Path]
    image: Image | None
    wire: Callable[[Image], tuple[Plc, Callable[[], None]]]
    bound: Callable[[Plc], Running]
    options: dict[str, Any] = field(default_factory=dict)
    repeatable: bool = False

    @property
    def files(self) -> Sequence[Path]:
        return self.given

    @property
    def groups_file(self) -> Path:
        return self.given[0].with_name(f"{self.given[0].stem}.{GROUPS_FILE}")

    def matters(self, changed: Sequence[Path]) -> bool:
        return bool(changed)

    def programs(self) -> list[ProgramFiles]:
        names = ("program", "resource", "dialect")
        chosen = {name: self.options[name] for name in names if self.options.get(name) is not None}
        return [ProgramFiles(lambda: inputs(self.given)[0], self.libraries, **chosen)]

    def mistakes(self) -> list[Diagnostic]:
        sources, found = inputs(self.given)
        if errors(found):
            return errors(found)
        made = compile_files(sources, libraries=self.libraries, runnable=True, lint=False, **self.options)
        self.image = made.image
        return errors(made.diagnostics)

    def build(self) -> Built:
        assert self.image is not None, "it was compiled before"
        plc, close = self.wire(self.image)
        own = {file.name: file for file in self.given} | given_sources(self.given)
        texts = source_texts(plc.image, own, self.libraries)
        seen = SeenPlc(plc, texts, program_text(self.given, self.libraries, **self.options))
        repeated = (self.given, self.options.get("program")) if self.repeatable else None
        return Built({self.given[0].stem: seen}, [self.bound(plc)], close, repeated)


@dataclass
class ProjectOrigin:
    """All PLCs of a project; `net`, `for_ns` and `scans` take the place of what its file says.

    `mistakes` has to be called, and to return none, before `build`."""

    file: Path
    net: str | None
    bound: Callable[[Running], Running]
    for_ns: int | None = None
    scans: int | None = None
    project: Project | None = None

    @property
    def files(self) -> Sequence[Path]:
        rows = self.project.plcs if self.project else ()
        return [self.file, *(source for row in rows for source in row.sources)]

    @property
    def groups_file(self) -> Path:
        return self.file.with_name(GROUPS_FILE)

    def matters(self, changed: Sequence[Path]) -> bool:
        if any(file != self.file for file in changed) or self.project is None:
            return bool(changed)
        found = read_given_project(self.file)
        old = self.project  # which pictures it has is no matter of the program
        return bool(changed) and (not isinstance(found, Project)
                                  or replace(found, source=old.source, pictures=old.pictures) != old)  # fmt: skip

    def pictures(self) -> Sequence[Picture] | list[Diagnostic]:
        """The pictures as the file says them now, or its errors."""
        found = read_given_project(self.file)
        return found.pictures if isinstance(found, Project) else found

    def programs(self) -> Sequence[ProgramFiles] | list[Diagnostic]:
        found = read_given_project(self.file)
        if not isinstance(found, Project):
            return errors(found)
        return [ProgramFiles(_given(row), row.libraries, row.program, row.resource, row.dialect) for row in found.plcs]

    def mistakes(self) -> list[Diagnostic]:
        found = read_given_project(self.file)
        if not isinstance(found, Project):
            return found
        try:
            tried = Plant(found, net="loop")
        except OSError:  # it is said when the project is built
            self.project = found
            return []
        tried.close()
        self.project = found
        return errors([*tried.diagnostics, *found.wrong_on(self.net or found.net)])

    def build(self) -> Built:
        assert self.project is not None, "it was read before"
        try:
            plant = Plant(self.project, net=self.net, for_ns=self.for_ns, scans=self.scans)
        except OSError as error:
            unusable(error)
        for diagnostic in plant.diagnostics:
            show_diagnostic(diagnostic)
        for message in plant.missing_units():
            say(message, fg="yellow", err=True)
        say_doors(plant.doors)
        plcs = {}
        for kind in plant.kinds:
            row = kind.row
            own = {path.name: path for path in row.sources} | sources_within(row.sources, row.resource)
            texts = source_texts(kind.runs[0].plc.image, own, row.libraries)
            text = program_text(row.sources, row.libraries, program=row.program, resource=row.resource, dialect=row.dialect,
                                heap=row.heap)  # fmt: skip
            for name, run in zip(kind.names, kind.runs, strict=True):
                plcs[name] = SeenPlc(run.plc, texts, text, tuple(row.watch))
        return Built(plcs, [self.bound(run) for run in plant.runs], plant.close)


def _given(row: PlcRow) -> Callable[[], Sequence[Path | Source]]:
    return lambda: inputs_within(row.sources, row.resource)[0]


def project_origin(file: Path, net: str | None, bound: Callable[[Running], Running],
                   for_ns: int | None = None, scans: int | None = None) -> ProjectOrigin:  # fmt: skip
    """A project that can be built.  Ends the verb with status 3 if it has errors."""
    origin = ProjectOrigin(file, net, bound, for_ns, scans)
    if found := origin.mistakes():
        report_diagnostics(found, False)
        sys.exit(status.PROGRAM_ERRORS)
    return origin
