"""Sources that change on disk while their program runs: noticed, checked piece by piece between scans, and told to pages.

It says only whether the changed program could run; whoever runs the PLCs begins the new one."""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fbvm.analysis.program import Program
from fbvm.base.diagnostics import Diagnostic, Source, errors
from fbvm.syntax.text import read

MOST_MISTAKES = 50
"""Errors that pages are told."""
Stamp = tuple[int, int] | None
"""When a file was written, in nanoseconds, and its size; None if it is not there."""


@dataclass(frozen=True)
class ProgramFiles:
    """Sources that are compiled together, and how.  `sources` returns them as they are now; `libraries`, `program`, `resource`
    and `dialect` are those of `compile_files`."""

    sources: Callable[[], Sequence[Path | Source]]
    libraries: Sequence[Path] = ()
    program: str | None = None
    resource: str | None = None
    dialect: str = "standard"

    def check(self) -> Generator[None, None, list[Diagnostic]]:
        """Checks the sources in steps, each of them short; returns the errors."""
        found: list[Diagnostic] = []
        program = Program(libraries=self.libraries, dialect=self.dialect, program=self.program, resource=self.resource)
        for one in self.sources():
            source = one if isinstance(one, Source) else read(one, str(one))
            yield
            if isinstance(source, Diagnostic):
                found.append(source)
            else:
                program.replace(source.name, source.text)
        yield from program.check(lint=False)
        for name in program.files:
            found += program.diagnostics(name)
        return errors([*found, *program.library_errors()])


class SourceChanges:
    """Whether the files of a run are others now than when it began, and what is wrong with them.

    `files` are looked at, `matters` says whether their change makes another program; `programs` returns what is to be checked, or
    the errors of a project file; `compiled` compiles all once more before a restart and returns the errors.

    Raises nothing: files that are gone have changed."""

    def __init__(self, files: Iterable[Path], programs: Callable[[], Sequence[ProgramFiles] | list[Diagnostic]],
                 compiled: Callable[[], list[Diagnostic]],
                 matters: Callable[[Sequence[Path]], bool] = bool) -> None:  # fmt: skip
        self._files, self._programs, self._compiled, self._matters = sorted(set(files)), programs, compiled, matters
        self._begun = self._seen = self._stamps()
        self._checked = self._begun
        """The state of the files about which `state` tells."""
        self._check: Generator[None, None, list[Diagnostic]] | None = None
        self.state: dict[str, Any] | None = None
        """What pages are told: `files` that have changed, `ready` for a restart, and `mistakes`; None without a change."""

    def look(self) -> None:
        """Looks at the files, a few times a second.  A change counts when two looks in a row see the same."""
        stamps, before = self._stamps(), self._seen
        self._seen = stamps
        if stamps != before or stamps == self._checked:
            return
        self._checked, self._check = stamps, None
        if not self._matters(self._changed()):
            self.state = None
            return
        self.state = {"files": self._names(), "ready": False, "mistakes": []}
        self._check = self._steps()

    def step(self) -> None:
        """Goes on with the check of a changed program, for a short time; called between scans."""
        if self._check is None:
            return
        try:
            next(self._check)
        except StopIteration as ended:
            self._check = None
            self._tell(ended.value)

    def compile(self) -> bool:
        """Compiles the changed program as it will run; True if it can."""
        if self.state is None or not self.state["ready"]:
            return False
        self._tell(self._compiled())
        return bool(self.state["ready"])

    def _steps(self) -> Generator[None, None, list[Diagnostic]]:
        rows, found = self._programs(), list[Diagnostic]()
        for row in rows:
            if isinstance(row, Diagnostic):
                found.append(row)
            else:
                found += yield from row.check()
        return errors(found)

    def _tell(self, found: Sequence[Diagnostic]) -> None:
        self.state = {"files": self._names(), "ready": not found, "mistakes": [_row(one) for one in found[:MOST_MISTAKES]]}

    def _changed(self) -> list[Path]:
        return [file for file, old, new in zip(self._files, self._begun, self._stamps(), strict=True) if old != new]

    def _names(self) -> list[str]:
        return [file.name for file in self._changed()]

    def _stamps(self) -> list[Stamp]:
        return [stamp(file) for file in self._files]


def stamp(file: Path) -> Stamp:
    """When a file was written, and its size."""
    try:
        found = os.stat(file)
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size


def _row(mistake: Diagnostic) -> dict[str, Any]:
    """An error as pages show it: beside its line of the changed file."""
    lines = mistake.source.text.splitlines()
    text = lines[mistake.line - 1] if mistake.line <= len(lines) else ""
    return {"file": Path(mistake.source.name).name, "line": mistake.line, "column": mistake.column, "text": text[:200],
            "code": mistake.code, "message": mistake.message + (f"; {mistake.hint}" if mistake.hint else "")}  # fmt: skip
