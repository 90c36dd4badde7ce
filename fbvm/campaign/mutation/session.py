"""Mutation testing of a project: its mutants, what the tests make of each, and how many they find.

Each process has a copy of the project in a temporary folder, which is removed at the end; the project itself is only read.
The processes are of this machine, or of the workers of a cluster."""

from __future__ import annotations

import random
import re
import subprocess
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

from fbvm.base.diagnostics import Source
from fbvm.campaign.mutation.mutants import COUNTED, EQUAL, FOUND, KILLED, SURVIVED, TIMED_OUT, Mutant, Tried, line_of
from fbvm.campaign.mutation.operators import changes
from fbvm.campaign.mutation.trial import NO_TESTS, AsItIs, Bench, Equality, Result, Task
from fbvm.campaign.processes import Crashed, Late, Pool
from fbvm.campaign.project_copies import copy_project, files_of, pack_project
from fbvm.campaign.shipped import Shipped
from fbvm.run.time_limit import stopwatch
from fbvm.syntax import tree
from fbvm.syntax.parser import parse
from fbvm.syntax.text import read

LEAST_LIMIT_NS = 10_000_000_000
TIMES_AS_LONG = 10
"""How long tests may take with a mutant: ten times as long as without one, and ten seconds at least."""
FIRST_LIMIT_NS = 600_000_000_000
"""How long they may take without one."""
PROOF_SLACK_NS = 5_000_000_000
"""How much later than its budget a proof is ended by force."""
_HUNK = re.compile(r"^@@ -\S+ \+(\d+)(?:,(\d+))? @@", re.M)


class NotPossible(Exception):
    """Mutants cannot be tried; the message says why, in words."""


@dataclass(frozen=True)
class Settings:
    """How mutants are tried: in `jobs` processes, by pytest with `arguments`, each for `limit_ns` at most (0: by the time that
    the tests take without one).  Survivors are compared with the program for `budget_ns`, scans `cycle_ns` apart."""

    jobs: int = 1
    arguments: tuple[str, ...] = ()
    limit_ns: int = 0
    budget_ns: int = 5_000_000_000
    cycle_ns: int = 10_000_000


@dataclass
class Outcome:
    """What came of mutants so far, by number; `known` is how many there are."""

    known: int
    tried: dict[int, Tried] = field(default_factory=dict)

    @property
    def rows(self) -> list[Tried]:
        """The results in the order of the mutants, whatever order the processes had."""
        return [self.tried[number] for number in sorted(self.tried)]

    @property
    def counts(self) -> Counter[str]:
        return Counter(each.result for each in self.tried.values())

    @property
    def score(self) -> float:
        """The part of the mutants that count which the tests have found, from 0 to 1; 1 without any."""
        counts = self.counts
        counted = sum(counts[result] for result in COUNTED)
        return sum(counts[result] for result in FOUND) / counted if counted else 1.0


# --- which mutants ----------------------------------------------------------------------------------------------------


def sources_of(folder: Path) -> list[str]:
    """The sources of a project that are mutated unless some are named: ST files that are no tests, by names with `/`."""
    found = (file for file in files_of(folder) if file.suffix.lower() == ".st")
    return [file.as_posix() for file in found if not file.name.startswith("test_") and "tests" not in file.parts]


def read_source(folder: Path, name: str) -> Source:
    """A source of a project.  Raises NotPossible."""
    found = read(folder / name, name)
    if not isinstance(found, Source):
        raise NotPossible(found.render())
    return found


def mutants_of(sources: Sequence[Source], lines: dict[str, set[int]] | None = None) -> list[Mutant]:
    """All mutants of some sources in the order of the texts; with `lines`, only those at these lines of each file."""
    found: list[Mutant] = []
    for source in sources:
        for node in parse(source)[0].everything():
            for change in changes(source.text, node) if isinstance(node, tree.Pou) else ():
                line = line_of(source, change)
                if lines is None or line in lines.get(source.name, ()):
                    found.append(Mutant(len(found) + 1, source.name, line, change))
    return found


def sample(mutants: Sequence[Mutant], most: int, seed: int) -> list[Mutant]:
    """At most so many of some mutants, drawn with a seed, in their order."""
    chosen = random.Random(seed).sample(range(len(mutants)), min(most, len(mutants)))
    return [mutants[number] for number in sorted(chosen)]


def changed_lines(folder: Path, revision: str, names: Sequence[str]) -> dict[str, set[int]]:
    """The lines of files that differ from a revision of Git, by file.  Raises NotPossible."""
    found = {}
    _check_revision(folder, revision)
    for name in names:
        command = ["git", "diff", "--no-color", "--no-ext-diff", "-U0", "--end-of-options", revision, "--", name]
        hunks = _HUNK.findall(_git(command, folder))
        found[name] = {int(first) + more for first, count in hunks for more in range(int(count or 1))}
    return found


def _check_revision(folder: Path, revision: str) -> None:
    """Raises NotPossible for one that the repository does not have: `git diff` answers that by all of its options."""
    _git(["git", "rev-parse", "--git-dir"], folder)
    try:
        _git(["git", "rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}"], folder)
    except NotPossible:
        raise NotPossible(f"--since {revision}: the repository has no such revision") from None


def _git(command: Sequence[str], folder: Path) -> str:
    """What git answers.  Raises NotPossible."""
    try:
        said = subprocess.run(command, cwd=folder, capture_output=True, encoding="utf-8", check=False)
    except OSError as error:
        raise NotPossible(f"git cannot be started: {error}") from None
    if said.returncode:
        raise NotPossible(f"git: {said.stderr.strip()}")
    return said.stdout


# --- trying them ------------------------------------------------------------------------------------------------------

Tell = Callable[[Outcome], None]


class Workers(AbstractContextManager["Workers"], Protocol):
    """Who tries mutants: processes of this machine, or a cluster."""

    def results(self, tasks: Iterable[Task], limit_ns: int) -> Iterator[tuple[Task, Result | Late | Crashed]]:
        """Each task with what came of it, in the order in which they end."""


Elsewhere = Callable[[Shipped[Task, Result]], Workers]
"""Has a cluster try mutants of a project that travels to it."""


def try_mutants(folder: Path, mutants: Sequence[Mutant], sources: Sequence[Source], settings: Settings, outcome: Outcome,
                tell: Tell = lambda outcome: None, elsewhere: Elsewhere | None = None) -> None:  # fmt: skip
    """Fills `outcome` with what came of each mutant, and calls `tell` after each; what is in it at a KeyboardInterrupt is good.

    `folder` is the project's, `sources` are those that the mutants are made of.  Raises NotPossible if the tests fail, or take
    too long, without a mutant; TooLarge for a folder that is more than a project; OSError."""
    libraries = tuple(dict.fromkeys(Path(name).parent.as_posix() for name in sources_of(folder)))
    bench = Bench((), {source.name: source.text for source in sources}, settings.arguments, libraries)
    if elsewhere:
        with elsewhere(Shipped(bench, folder.name, pack_project(folder))) as workers:
            _try_all(workers, mutants, settings, outcome, tell)
        return
    jobs = max(1, min(settings.jobs, len(mutants)))
    with tempfile.TemporaryDirectory(prefix="fbvm-mutate-", ignore_cleanup_errors=True) as place:
        folders = [str(Path(place, f"copy{number}", folder.name)) for number in range(jobs)]
        for copy in folders:
            copy_project(folder, Path(copy))
        bench = bench.in_folders(folders)
        with Pool[Task, Result](jobs, bench.prepare, bench.work) as pool:
            _try_all(pool, mutants, settings, outcome, tell)


def _try_all(workers: Workers, mutants: Sequence[Mutant], settings: Settings, outcome: Outcome, tell: Tell) -> None:
    usual_ns = _usual_limit(workers)
    for task, result in workers.results(mutants, settings.limit_ns or usual_ns):
        assert isinstance(task, Mutant)
        _enter(outcome, task, result)
        tell(outcome)
    left = [each.mutant for each in outcome.rows if each.result == SURVIVED]
    asked = [Equality(mutant, settings.cycle_ns, settings.budget_ns) for mutant in left if settings.budget_ns]
    for task, result in workers.results(asked, settings.budget_ns + PROOF_SLACK_NS):
        assert isinstance(task, Equality)
        if isinstance(result, str) and result:
            outcome.tried[task.mutant.number] = Tried(task.mutant, EQUAL, result)
        tell(outcome)


def _enter(outcome: Outcome, mutant: Mutant, result: Result | Late | Crashed) -> None:
    if isinstance(result, Late):
        tried = Tried(mutant, TIMED_OUT, "the tests did not end")
    elif isinstance(result, Crashed):
        tried = Tried(mutant, KILLED, "the process of the tests ended")
    else:
        assert isinstance(result, tuple)
        tried = Tried(mutant, str(result[0]), result[1])
    outcome.tried[mutant.number] = tried


def _usual_limit(workers: Workers) -> int:
    """The limit for tests with a mutant, by the time that they take without.  Raises NotPossible if they fail."""
    elapsed = stopwatch()
    (_, result), *_ = workers.results([AsItIs()], FIRST_LIMIT_NS)
    if not isinstance(result, tuple):
        raise NotPossible("the tests do not end, without any mutant")
    status, by = result
    if status == NO_TESTS:
        raise NotPossible("there are no tests: fbvm test runs test_*.py and programs in test_*.st")
    if status:
        raise NotPossible(f"the tests fail without any mutant{': ' * bool(by)}{by}; fbvm test shows why")
    return max(LEAST_LIMIT_NS, TIMES_AS_LONG * elapsed())
