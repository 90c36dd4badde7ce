"""`fbvm sweep`: one run for each combination of parameters, and a table of results."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fbvm.cli.projects.planned_runs import (
    check_parquet,
    check_results,
    plan_options,
    planned,
    processes,
    refuse,
    tests_among,
    write_results,
)
from fbvm.cli.shared import status
from fbvm.cli.shared.progress import show_progress
from fbvm.cli.shared.terminal import say, say_json

if TYPE_CHECKING:
    from fbvm.campaign.execution import Result
    from fbvm.campaign.runs import Outcome


@click.command("sweep")
@plan_options
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...], as_json: bool, **options: Any) -> None:
    """Run a program or a project once for each combination of the values of --vary, and print a table of what --show names.

    Units answer always alike, unless `timing` is varied.  Status 0, also if --until did not hold; 4 if a trap stopped a run."""
    check_parquet(options)
    if not options["varied"]:
        raise click.UsageError("say what to vary: --vary Main.Gain=1,2,5")
    if tests_among(files):
        raise click.UsageError("sweep varies programs and projects; fbvm campaign varies tests")
    from fbvm.campaign.execution import Wrong
    from fbvm.campaign.plan_file import with_about
    from fbvm.campaign.runs import Outcome, conduct
    from fbvm.campaign.work import Bench

    plan, images, _ = planned(files, program, libraries, options,
                              lambda written, project: with_about(written, runs=0, timing="exact"))  # fmt: skip
    check_results(options)
    outcome = Outcome(plan)
    try:
        with show_progress("sweep") as update:

            def take(found: Sequence[Result]) -> None:
                outcome.add(found)
                update("runs", len(outcome.results), plan.count)

            try:
                conduct(Bench.of(plan, images), outcome, processes(options["jobs"]), take, shrinks=False)
            finally:
                _print(outcome, options, as_json)
    except Wrong as error:
        refuse(error.diagnostics)
    except (LookupError, TypeError, ValueError) as error:
        raise click.UsageError(str(error.args[0] if error.args else error)) from None
    trapped = any(result.failure is not None and result.failure.kind == "trap" for result in outcome.rows)
    sys.exit(status.STOPPED if trapped else status.GOOD)


def _print(outcome: Outcome, options: dict[str, Any], as_json: bool) -> None:
    """The table, aligned; also of a sweep that was interrupted."""
    if not outcome.results:
        return
    try:
        write_results(outcome, options)
    finally:
        _say(outcome, as_json)


def _say(outcome: Outcome, as_json: bool) -> None:
    plan = outcome.plan
    names = [axis.name for axis in plan.axes]
    rows = [_row(outcome, result) for result in outcome.rows]
    if as_json:
        say_json({"runs": plan.count, "rows": rows})
        return
    columns = [*names, *plan.shown, "end", "time"]
    table = [columns, *([_text(cell) for cell in [*row["values"].values(), *row["shown"].values(), row["end"], row["time"]]]
                        for row in rows)]  # fmt: skip
    widths = [max(len(line[at]) for line in table) for at in range(len(columns))]
    for line in table:
        say("  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip())


def _text(cell: object) -> str:
    return str(cell).upper() if isinstance(cell, bool) else str(cell)


def _row(outcome: Outcome, result: Result) -> dict[str, Any]:
    """A run for the table and for --json."""
    from fbvm.campaign.variants import draw
    from fbvm.watch.values import show_time

    plan, failure = outcome.plan, result.failure
    variant = draw(plan, result.number)
    end = f"{failure.code} {failure.where}" if failure and failure.code else "not reached" if failure else "good"
    return {"values": {axis.name: axis.text(variant.value(plan, at)) for at, axis in enumerate(plan.axes)},
            "shown": dict(zip(plan.shown, result.shown, strict=True)), "end": end,
            "time": show_time(result.time_ns)[2:], "scans": result.scans}  # fmt: skip
