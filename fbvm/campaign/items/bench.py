"""What a process does for a campaign over tests: executes batches of runs in the folder of the project."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import ClassVar

from fbvm.base.diagnostics import Source
from fbvm.base.version import VERSION
from fbvm.campaign.execution import Result
from fbvm.campaign.executors import LIMIT_NS
from fbvm.campaign.items.execution import ItemsExecution, ItemsSession
from fbvm.campaign.plan import Plan
from fbvm.campaign.plan_file import Written
from fbvm.campaign.planning import Unfit, check_count
from fbvm.campaign.processes import Crashed, Late, Pool
from fbvm.campaign.project_copies import files_of
from fbvm.campaign.runs import ended
from fbvm.campaign.shrinking import Shrunk, shrink
from fbvm.campaign.variants import Variant, draw
from fbvm.campaign.work import Batch, Done, Task
from fbvm.run.project import FILE, Project

READ = (".py", ".st", ".toml", ".ini", ".cfg", ".txt", ".xml")
"""Endings of the files that tests may depend on: sources, settings, golden traces."""
BATCH_NS = 8_000_000_000
"""About how long a batch takes: to start pytest takes up to a second."""


@dataclass(frozen=True)
class ItemsBench:
    """All that a process needs: the plan, and the folder in which it executes the tests."""

    plan: Plan
    folder: str
    mark: str
    """A hash of all that results depend on."""
    batch_ns: int = BATCH_NS
    ends_processes: ClassVar[bool] = True

    @classmethod
    def of(cls, plan: Plan, folder: Path) -> ItemsBench:
        """The bench of a campaign over the tests of a project.  Raises OSError."""
        depends = hashlib.sha256(repr((VERSION, plan)).encode())
        for file in sorted(file for file in files_of(folder) if file.suffix.lower() in READ):
            depends.update(repr((file.as_posix(), (folder / file).read_bytes())).encode())
        return cls(plan, str(folder), depends.hexdigest())

    def in_folders(self, folders: Sequence[str]) -> ItemsBench:
        """The same in another copy of the project."""
        return replace(self, folder=folders[0])

    def prepare(self, number: int) -> None:
        """Makes a process ready."""
        sys.dont_write_bytecode = True

    def execution(self) -> ItemsExecution:
        """What executes runs in this process."""
        return ItemsExecution(self.plan, self.folder)

    def variant(self, number: int) -> Variant:
        """The run with this number."""
        return draw(self.plan, number)

    def work(self, number: int, task: Task) -> Done:
        """Does a task.  Raises NoTests."""
        if isinstance(task, Batch):
            return self.execution().results([self.variant(run) for run in task.numbers])

        def smaller(session: ItemsSession) -> Shrunk:
            return shrink(session, self.variant(task.result.number), task.result)

        return self.execution().within(smaller)

    def recorded_apart(self, variant: Variant, path: Path) -> tuple[Result, str]:
        """Executes a run in a process of its own, which it may end, and leaves traces as `ItemsExecution.recorded` does.  Returns
        its result, and what pytest says of it.  Raises NoTests."""
        path.unlink(missing_ok=True)
        with Pool[Variant, tuple[Result, str]](1, self.prepare, partial(_recorded, self, path.absolute())) as pool:
            ((_, found),) = pool.results([variant], LIMIT_NS)
        return (ended(variant.number, found), "") if isinstance(found, Late | Crashed) else found


def _recorded(bench: ItemsBench, path: Path, number: int, variant: Variant) -> tuple[Result, str]:
    execution = bench.execution()
    return execution.recorded(variant, path)[0], execution.report


def plan_of_tests(written: Written, tests: Sequence[str]) -> Plan:
    """The plan of a campaign over tests, as pytest names them.  Raises Unfit for what only programs and projects have."""
    about = written.about
    if said := next(_of_programs(written), ""):
        raise Unfit(f"tests say that themselves: leave out {said}")
    axes = tuple(replace(axis, path=axis.path or axis.name) for axis in written.axes)
    cuts = tuple(replace(rule, plcs=rule.plcs or ("",)) for rule in written.cuts)
    nothing = Project(Source(FILE, ""), "loop", 0, None, None, (), (), frozenset(), (), ())
    plan = Plan(nothing, about["seed"], about["runs"], about["timing"], about["for"], axes, written.faults, cuts,
                written.judging, about["show"], tuple(tests))  # fmt: skip
    check_count(plan)
    return plan


def _of_programs(written: Written) -> Iterator[str]:
    about = written.about
    yield from ["until"] * bool(about["until"]) + ["golden"] * bool(written.goldens)
    yield from (name for name in ("project", "sources", "program", "dialect", "libraries", "servers") if about[name])
