"""What `campaign` does when the runs are tests: its bench, its recordings, and how it travels to a cluster."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from fbvm.base.files import resolved
from fbvm.cli.projects.planned_runs import tests_among, written_plan

if TYPE_CHECKING:
    from fbvm.campaign.execution import Result
    from fbvm.campaign.items.bench import ItemsBench
    from fbvm.campaign.plan_file import Written
    from fbvm.campaign.variants import Variant
    from fbvm.campaign.work import AnyBench

FOR_PROGRAMS = {"program": "--program", "libraries": "--library", "cycle_ns": "--cycle", "mappings": "--map",
                "dialect": "--dialect", "write_golden": "--write-golden"}  # fmt: skip
"""Options that only runs of programs have."""


Change = Callable[["Written", "int | None", "dict[str, Any]"], "Written"]


def bench_of_tests(files: Sequence[Path], options: dict[str, Any], change: Change) -> tuple[ItemsBench, Path] | None:
    """The bench of a campaign over tests, if the arguments, or the campaign file that they name, say some; and its folder.

    `change` adds the options of the verb.  Raises UsageError for what does not fit."""
    named = tests_among(files)
    try:
        written, where = written_plan(files, options)
        if not named and not written.about["tests"]:
            return None
        if named and len(named) < len(files):
            raise click.UsageError(f"{files[0]} and {files[-1]}: name tests, or programs, not both")
        context = click.get_current_context()
        given = [said for name, said in FOR_PROGRAMS.items() if name in context.params
                 and context.get_parameter_source(name) is not ParameterSource.DEFAULT]  # fmt: skip
        if given:
            raise click.UsageError(f"tests say themselves what they run: leave out {given[0]}")
        if find_spec("pytest") is None:
            raise click.UsageError("tests need pytest: pip install pytest")
        from fbvm.campaign.items.bench import ItemsBench, plan_of_tests
        from fbvm.cli.shared.files import writing

        folder = where.parent if where else Path()
        plan = plan_of_tests(change(written, None, options), named or written.about["tests"])
        with writing(folder):
            return ItemsBench.of(plan, resolved(folder)), folder
    except ValueError as error:
        raise click.UsageError(str(error)) from None


def record_test(bench: AnyBench, variant: Variant, path: Path) -> tuple[Result, str]:
    """Executes a run and records its PLCs.  Returns its result, and what pytest says."""
    from fbvm.campaign.items.bench import ItemsBench
    from fbvm.cli.shared.files import writing

    assert isinstance(bench, ItemsBench)
    with writing(path):
        return bench.recorded_apart(variant, path)


def travelling(bench: AnyBench) -> Any:
    """What the workers of a cluster get: the bench, for tests with the files of their project."""
    from fbvm.campaign.work import Bench

    if isinstance(bench, Bench):
        return bench
    from fbvm.campaign.items.bench import ItemsBench
    from fbvm.campaign.project_copies import TooLarge, pack_project
    from fbvm.campaign.shipped import Shipped

    assert isinstance(bench, ItemsBench)
    folder = Path(bench.folder)
    try:
        return Shipped(bench, folder.name, pack_project(folder))
    except TooLarge as error:
        raise click.UsageError(str(error)) from None
