"""Coverage of PLC code: how often tests have executed each statement, and each branch of IF and CASE.

`coverage_report` formats the counts.  Files of fbvm's own libraries are counted only if a test names them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fbvm.base.data import data_folder
from fbvm.base.files import resolved
from fbvm.code.image import Site
from fbvm.machine.counting import Counting
from fbvm.record.trace.branches import Branch, branches, statements
from fbvm.testing.subject import LIBRARY, Subject

Position = tuple[int, int]
"""Line and column."""
SKIPPED: Position = (0, 0)
"""The branch to none of the statements of an IF or CASE."""


@dataclass
class FileCoverage:
    """The counts of one file: executions of each statement, and, of each IF and CASE, of each branch by its first statement."""

    statements: dict[Position, int] = field(default_factory=dict)
    branches: dict[Position, dict[Position, int]] = field(default_factory=dict)

    @property
    def lines(self) -> dict[int, int]:
        """The executions of each line with statements: those of its least executed statement."""
        made: dict[int, int] = {}
        for (line, _), count in self.statements.items():
            made[line] = min(count, made.get(line, count))
        return made

    @property
    def missing(self) -> list[int]:
        """Lines with a statement that was not executed."""
        return sorted(line for line, count in self.lines.items() if not count)

    @property
    def partial(self) -> dict[int, list[int]]:
        """By line of an executed IF or CASE the lines of its branches that were not taken; 0 is the branch to none."""
        made: dict[int, list[int]] = {}
        for (line, column), ways in self.branches.items():
            if self.statements.get((line, column)):
                made.setdefault(line, []).extend(way[0] for way, count in ways.items() if not count)
        return {line: sorted(set(to)) for line, to in made.items() if to}

    def rate(self) -> float:
        """The part of statements and branches that were executed, 0 to 1; 1 for a file without statements."""
        counts = [*self.statements.values(), *(count for ways in self.branches.values() for count in ways.values())]
        return sum(count > 0 for count in counts) / len(counts) if counts else 1.0

    def add(self, other: FileCoverage) -> None:
        """Adds the counts of another process."""
        for spot, count in other.statements.items():
            self.statements[spot] = self.statements.get(spot, 0) + count
        for spot, ways in other.branches.items():
            mine = self.branches.setdefault(spot, {})
            for way, count in ways.items():
                mine[way] = mine.get(way, 0) + count


class Coverage:
    """Coverage of all files, by absolute path."""

    def __init__(self) -> None:
        self.files: dict[str, FileCoverage] = {}

    def add_run(self, subject: Subject, counts: Counting | None = None) -> None:
        """Adds what a run of a program has executed; without counts all of its statements and branches, with 0."""
        rows = _Rows(self, subject)
        if counts:
            rows.add(counts)

    def add(self, other: Coverage) -> None:
        """Adds the counts of another process."""
        for name, coverage in other.files.items():
            self.files.setdefault(name, FileCoverage()).add(coverage)

    def to_data(self) -> dict[str, Any]:
        """The counts as lists, for another process."""
        return {name: [[[*spot, count] for spot, count in each.statements.items()],
                       [[*spot, *way, count] for spot, ways in each.branches.items() for way, count in ways.items()]]
                for name, each in self.files.items()}  # fmt: skip

    @classmethod
    def from_data(cls, data: Mapping[str, Any]) -> Coverage:
        """The counts that `to_data` has returned."""
        made = cls()
        for name, (rows, ways) in data.items():
            each = made.files[name] = FileCoverage({(line, column): count for line, column, count in rows})
            for line, column, to_line, to_column, count in ways:
                each.branches.setdefault((line, column), {})[to_line, to_column] = count
        return made


class _Rows:
    """Where the counts of the counters of a program go; all of them are 0 as long as nothing has run."""

    def __init__(self, coverage: Coverage, subject: Subject) -> None:
        image = subject.image
        self._statements: dict[int, tuple[FileCoverage, Position]] = {}
        self._branches: dict[int, tuple[FileCoverage, Position, Branch]] = {}
        self._sites = image.sites
        paths = {name: _path(name, subject) for name in {site.file for site in image.sites}}
        for number in statements(image):
            site = image.sites[number]
            if path := paths[site.file]:
                each = coverage.files.setdefault(path, FileCoverage())
                self._statements[number] = each, _spot(site)
                each.statements.setdefault(_spot(site), 0)
        for branch in branches(image):
            if branch.site in self._statements:
                each, spot = self._statements[branch.site]
                self._branches[branch.site] = each, spot, branch
                ways = each.branches.setdefault(spot, {})
                for way in (*(_spot(self._sites[way]) for way in branch.targets), *([SKIPPED] if branch.may_skip else [])):
                    ways.setdefault(way, 0)

    def add(self, counts: Counting) -> None:
        """Adds the counts of a run."""
        executed, skipped = counts.executed(), counts.skipped()
        for site, (each, spot) in self._statements.items():
            each.statements[spot] += executed[site]
        for site, (each, spot, branch) in self._branches.items():
            for target in branch.targets:
                each.branches[spot][_spot(self._sites[target])] += executed[target]
            if branch.may_skip:  # what a jump is made of stands at the statement behind it, and is no branch of that
                each.branches[spot][SKIPPED] += (executed if site in branch.targets else skipped).get(site, 0)


def _spot(site: Site) -> Position:
    return site.line, site.column


def covered_files(subject: Subject) -> set[str]:
    """The files whose statements are part of coverage, by their names in sites."""
    return {name for name in {site.file for site in subject.image.sites} if _path(name, subject)}


def _path(name: str, subject: Subject) -> str:
    """The file of a source, "" for one that is no file or came with fbvm."""
    if name in subject.sources:
        return str(resolved(Path(name))) if Path(name).is_file() else ""
    if (data_folder("fblib") / name).is_file():
        return ""
    for shelf in subject.libraries:
        for path in (shelf / name, shelf.parent / name):
            if path.is_file() and shelf != LIBRARY:
                return str(resolved(path))
    return ""
