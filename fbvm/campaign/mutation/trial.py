"""What a process does with a mutant: compiles it, runs the project's tests on it in a copy of the project, or proves it equal."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from fbvm.base.files import write_file
from fbvm.campaign.mutation.equivalence import proof_of_equality
from fbvm.campaign.mutation.mutants import EQUAL, INVALID, KILLED, SURVIVED, Mutant
from fbvm.campaign.pytest_session import run_pytest
from fbvm.code.image import Image
from fbvm.testing.subject import SubjectError, subject

FAILED, GOOD, NO_TESTS = 1, 0, 5
"""Exit statuses of pytest."""


@dataclass(frozen=True)
class AsItIs:
    """A task: the tests without a mutant.  The result is (status of pytest, the first test that failed)."""


@dataclass(frozen=True)
class Equality:
    """A task: the proof that a mutant gives the same outputs.  The result is what was proved, or ""."""

    mutant: Mutant
    cycle_ns: int
    budget_ns: int


Task = AsItIs | Mutant | Equality
Result = tuple[int, str] | tuple[str, str] | str


@dataclass(frozen=True)
class Bench:
    """Copies of a project in `folders`, a process each; `texts` are the sources by name that mutants are made of.

    `arguments` go to pytest, `libraries` are folders of sources by name, relative to the project's folder."""

    folders: tuple[str, ...]
    texts: dict[str, str]
    arguments: tuple[str, ...]
    libraries: tuple[str, ...]

    def in_folders(self, folders: Sequence[str]) -> Bench:
        """The same in other copies of the project."""
        return replace(self, folders=tuple(folders))

    def prepare(self, number: int) -> None:
        """Makes a copy whole again, which a process may have left changed, and goes into it.

        What is compiled goes into a cache beside it, so that mutants do not push what a user needs out of the user's."""
        sys.dont_write_bytecode = True
        os.environ["FBVM_CACHE"] = str(Path(self.folders[number]).parent / "cache")
        os.chdir(self.folders[number])
        for name, text in self.texts.items():
            write_file(Path(name), text)

    def work(self, number: int, task: Task) -> Result:
        """Does a task in the copy of a process."""
        if isinstance(task, AsItIs):
            return run_tests(self.arguments)
        if isinstance(task, Equality):
            return proof_of_equality(task.mutant, self.texts[task.mutant.file], self._shelves(), task.cycle_ns, task.budget_ns)
        return self._tried(task)

    def _shelves(self) -> list[Path]:
        return [Path(folder).absolute() for folder in self.libraries]

    def _tried(self, mutant: Mutant) -> tuple[str, str]:
        """KILLED with the first test that fails, or SURVIVED; EQUAL if the compiled program is the same, INVALID for errors."""
        path, text = Path(mutant.file), self.texts[mutant.file]
        original = self._compiled(mutant)
        with _written(path, mutant.applied(text), text):
            changed = self._compiled(mutant)
            if isinstance(original, Image):
                if not isinstance(changed, Image):
                    return INVALID, changed
                if original.fingerprint == changed.fingerprint:
                    return EQUAL, "the compiled program is the same"
            status, by = run_tests(self.arguments)
        return (KILLED, by) if status else (SURVIVED, "")

    def _compiled(self, mutant: Mutant) -> Image | str:
        """The POU that a mutant changes, compiled as tests do it; the first line of what is wrong if it cannot be."""
        try:
            return subject([Path(mutant.file).absolute()], mutant.change.pou, self._shelves(), alone=True).image
        except SubjectError as error:
            return str(error).split("\n", 1)[0]


@contextmanager
def _written(path: Path, text: str, before: str) -> Iterator[None]:
    """The file has another text inside the `with` block."""
    write_file(path, text)
    try:
        yield
    finally:
        write_file(path, before)


class _First:
    """A plugin of pytest that keeps the name of the first test, or file, that fails."""

    def __init__(self) -> None:
        self.failed = ""

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.failed:
            self.failed = self.failed or report.nodeid

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        if report.failed:
            self.failed = self.failed or report.nodeid


def run_tests(arguments: Sequence[str]) -> tuple[int, str]:
    """Runs pytest in the present folder and process until a test fails: its status, and the name of that test."""
    first = _First()
    status = run_pytest(["-x", *arguments], [first])
    return status, first.failed
