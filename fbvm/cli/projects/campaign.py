"""`fbvm campaign`: many runs under faults, power cuts and other parameters, and the ways in which they fail."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import fbvm
from fbvm.cli.projects.cluster import cluster_of, cluster_option
from fbvm.cli.projects.planned_runs import (
    check_parquet,
    check_results,
    plan_options,
    planned,
    processes,
    refuse,
    write_results,
)
from fbvm.cli.projects.runs_of_tests import bench_of_tests, record_test, travelling
from fbvm.cli.projects.shown_progress import PAGE, ShownProgress
from fbvm.cli.shared import status
from fbvm.cli.shared.files import growing_file, writing
from fbvm.cli.shared.options import moment_ns
from fbvm.cli.shared.progress import show_progress
from fbvm.cli.shared.run_recording import record_plant
from fbvm.cli.shared.terminal import named, say, say_json

if TYPE_CHECKING:
    from fbvm.campaign.execution import Result
    from fbvm.campaign.groups import Group
    from fbvm.campaign.plan import Plan
    from fbvm.campaign.plan_file import Written
    from fbvm.campaign.runs import Outcome
    from fbvm.campaign.store import Store
    from fbvm.campaign.variants import Variant
    from fbvm.campaign.work import AnyBench, Bench
    from fbvm.run.plant import Plant

MOST_GROUPS = 20
"""Groups that are printed."""
FOLDER = Path("campaign-results")


@click.command("campaign")
@plan_options
@click.option("--never", multiple=True, metavar="EXPRESSION", help="A run fails when this holds behind a scan.")
@click.option("--always", multiple=True, metavar="EXPRESSION", help="A run fails when this does not hold behind a scan.")
@click.option("--within", nargs=3, multiple=True, metavar="TRIGGER EXPRESSION TIME",
              help="A run fails when EXPRESSION comes later than TIME after TRIGGER.")
@click.option("--runs", type=click.IntRange(min=1), metavar="N",
              help="How many runs are drawn; without it one of each combination of the values of --vary.")
@click.option("--faults", type=click.IntRange(min=0), default=0, metavar="N", help="Faults of the network in each run.")
@click.option("--cuts", type=click.IntRange(min=0), default=0, metavar="N", help="Power cuts in each run.")
@click.option("--timing", type=click.Choice(["exact", "real"]), default=None,
              help="How units answer: real, late and out of step by the seed of the run, is what they do by themselves.")
@cluster_option
@click.option("--out", "folder", type=click.Path(file_okay=False, path_type=Path), default=FOLDER, show_default=True,
              metavar="DIR", help="Where results and recordings are kept; the same campaign goes on there.")
@click.option("--fresh", is_flag=True, help="Begin anew, in place of results that are there.")
@click.option("--only", type=click.IntRange(min=0), metavar="N", help="Execute run N alone, and record it.")
@click.option("--write-golden", is_flag=True, help="Write golden files, from a run with the first values and without faults.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
@click.option("--json-lines", is_flag=True, help="Print a JSON object a line about once a second while it runs; the last is that "
              "of --json.")
def command(files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...], as_json: bool, **options: Any) -> None:
    """Run a program, a project or tests many times, each time under other faults and parameters, in virtual time on all
    processors.

    PROJECT is a folder with an fbvm.toml, CAMPAIGN a file with a table [campaign], or a folder with campaign.toml, TEST a file of
    pytest or FILE::NAME.  A test judges itself; another run fails by a trap, and by what --never, --always, --within and
    --until, or the campaign file, ask for.  Failing runs are grouped by what failed and where, and of each group one run is made
    as small as possible and recorded.

    Status 0 if all runs were good, 1 if some failed, 3 if the program has errors, 5 if the cluster cannot be used."""
    check_parquet(options)
    bench, home = bench_of_tests(files, options, _changed) or _bench(files, program, libraries, options)
    from fbvm.campaign.execution import Wrong
    from fbvm.campaign.runs import Outcome
    from fbvm.campaign.store import Store
    from fbvm.campaign.work import Bench, Mismatch, Unreachable

    outcome = Outcome(bench.plan)
    try:
        if options["write_golden"]:
            assert isinstance(bench, Bench)
            _write_golden(bench, home)
            return
        if options["only"] is not None:
            sys.exit(_execute_one(bench, options["only"], options["folder"]))
        store = _open(Store, options["folder"], bench.mark, options["fresh"])
        outcome.add(store.known)
        shown = ShownProgress(outcome, options["folder"] / PAGE, options["json_lines"])
        try:
            check_results(options)
            _conduct(bench, outcome, store, shown, processes(options["jobs"]), options["cluster"], options["folder"])
        finally:
            _finish(bench, outcome, options, shown, as_json or options["json_lines"])
            store.close()
    except Wrong as error:
        refuse(error.diagnostics)
    except (Mismatch, Unreachable) as error:
        say(str(error), fg="red", err=True)
        sys.exit(status.NETWORK)
    except (LookupError, TypeError, ValueError) as error:
        raise click.UsageError(str(error.args[0] if error.args else error)) from None
    sys.exit(status.FAILED if outcome.failing else status.GOOD)


def _bench(files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...],
           options: dict[str, Any]) -> tuple[Bench, Path]:  # fmt: skip
    """The bench of a campaign over a program or a project, and the folder to which golden files are relative."""
    plan, images, home = planned(files, program, libraries, options,
                                 lambda written, project: _changed(written, project.for_ns, options))  # fmt: skip
    missing = [golden.file for golden in plan.judging.goldens if not golden.text]
    if missing and not options["write_golden"]:
        raise click.UsageError(f"there is no golden file {named(home / missing[0])}: --write-golden writes it")
    from fbvm.campaign.planning import unfit_conditions
    from fbvm.campaign.work import Bench

    for message in unfit_conditions(plan):
        say(message, fg="yellow", err=True)
    return Bench.of(plan, images), home


def _changed(written: Written, usual_ns: int | None, options: dict[str, Any]) -> Written:
    """What a file says, with the options of this verb; `usual_ns` is how long a run takes if neither says it."""
    from fbvm.campaign.plan import Response
    from fbvm.campaign.plan_file import any_cuts, any_faults, with_about

    about = written.about
    for_ns = about["for"] or usual_ns
    if (options["faults"] or options["cuts"]) and for_ns is None:
        raise click.UsageError("say how long a run takes at most, by --for: faults come at any time of it")
    responses = [Response(trigger, answer, moment_ns(limit)) for trigger, answer, limit in options["within"]]
    faults = [any_faults(options["faults"], for_ns or 0)] * bool(options["faults"])
    cuts = [any_cuts(options["cuts"], for_ns or 0)] * bool(options["cuts"])
    written = with_about(written, never=(*about["never"], *options["never"]), always=(*about["always"], *options["always"]),
                         runs=options["runs"] or about["runs"], timing=options["timing"] or about["timing"])  # fmt: skip
    return replace(written, responses=(*written.responses, *responses), faults=(*written.faults, *faults),
                   cuts=(*written.cuts, *cuts))  # fmt: skip


def _open(make: type[Store], folder: Path, mark: str, fresh: bool) -> Store:
    """The results that a folder has, or none yet."""
    from fbvm.campaign.store import InUse, OtherCampaign

    with writing(folder):
        try:
            return make(folder, mark, fresh)
        except InUse as error:
            raise click.UsageError(f"{named(folder)} {error}; wait for it, or name another folder by --out") from None
        except OtherCampaign as error:
            raise click.UsageError(f"{named(folder)} {error}: name another folder by --out, or begin anew by --fresh") from None


def _conduct(bench: AnyBench, outcome: Outcome, store: Store, shown: ShownProgress, jobs: int, cluster: str | None,
             folder: Path) -> None:  # fmt: skip
    """Executes what is left of a campaign, keeps its results in the folder, and shows how it goes."""
    from fbvm.campaign.executors import ByWorkers
    from fbvm.campaign.runs import conduct

    with show_progress("campaign") as update:

        def take(found: Sequence[Result]) -> None:
            with writing(folder):
                store.add(found)
            outcome.add(found)
            update(shown.add(found), len(outcome.results), outcome.plan.count)

        conduct(bench, outcome, jobs, take, ByWorkers(cluster_of(travelling(bench), cluster, jobs)) if cluster else None)


# --- what is left behind ----------------------------------------------------------------------------------------------


def _finish(bench: AnyBench, outcome: Outcome, options: dict[str, Any], shown: ShownProgress, as_json: bool) -> None:
    """Writes table, recordings and the last page, and prints what came of the campaign, also of one that was interrupted."""
    from fbvm.campaign.store import TABLE, write_table

    if not outcome.results:
        return
    folder = options["folder"]
    with writing(folder):
        write_table(folder / TABLE, outcome)
    write_results(outcome, options)
    recordings = {}
    for number, group in enumerate(outcome.groups):
        if group.shrunk:
            recordings[group.first] = path = folder / f"{number + 1}.fbtrace"
            again = _recorded(bench, group.shrunk.variant, path)
            if again != group.shrunk.result:
                say(f"{named(path)}: run {group.first} did not give the same result again", fg="red", err=True)
    shown.end({first: str(path.relative_to(folder)) for first, path in recordings.items() if path.exists()})
    if as_json:
        say_json(_as_dict(outcome, recordings))
    else:
        _print(outcome, recordings)


def _recorded(bench: AnyBench, variant: Variant, path: Path) -> Result:
    """Executes a run and records it in a file.  Returns its result, with the line of its failure."""
    from fbvm.campaign.execution import Execution
    from fbvm.record.recording.file_writer import RecordingWriter
    from fbvm.record.recording.recording import Recording

    execution = bench.execution()
    if not isinstance(execution, Execution):
        return record_test(bench, variant, path)[0]
    about = {"options": {"run": variant.number, "seed": variant.seed}}
    with writing(path), growing_file(path) as file:

        def begin(plant: Plant) -> Recording:
            recording = Recording(1, RecordingWriter(file, fbvm.__version__, True, about))
            record_plant(plant, recording.add, {"selected": (), "depth": "scans"})
            return recording

        execution.recorded(variant, begin)
    return execution.result(variant)


def _print(outcome: Outcome, recordings: dict[int, Path]) -> None:
    groups, done = outcome.groups, len(outcome.results)
    for group in groups[:MOST_GROUPS]:
        say(f"{len(group.numbers):,} of {done:,} runs: {group.failure}", fg="red", bold=True)
        for line in _about(outcome, group, recordings):
            say(f"  {line}")
    if len(groups) > MOST_GROUPS:
        say(f"and {len(groups) - MOST_GROUPS:,} groups more")
    good = done - outcome.failing
    cut = f" of {outcome.plan.count:,}" if done < outcome.plan.count else ""
    said = f", {outcome.failing:,} failed in {len(groups):,} group{'s' * (len(groups) != 1)}" if groups else ""
    say(f"{done:,}{cut} run{'s' * (outcome.plan.count != 1)}: {good:,} good{said}", bold=True)


def _about(outcome: Outcome, group: Group, recordings: dict[int, Path]) -> list[str]:
    """What is said of a group beside its failure."""
    from fbvm.campaign.groups import in_common
    from fbvm.campaign.variants import draw

    plan = outcome.plan
    variant = group.shrunk.variant if group.shrunk else draw(plan, group.first)
    parts = [*_values(plan, variant),
             *map(str, variant.faults), *map(str, variant.cuts), *(["late units"] * (variant.timing == "real"))]  # fmt: skip
    failure = group.shrunk.result.failure if group.shrunk else group.failure
    assert failure
    lines = [f"run {group.first}, {'made smaller' if group.shrunk else 'as it was'}: {', '.join(parts) or 'without any fault'}"]
    if failure.plc:  # a test may fail before it makes one
        lines.append(f"fails in scan {failure.scan} of {failure.plc}")
    if common := in_common(plan, group, outcome.results):
        lines.append(f"all of them, and not all others, have {', '.join(common)}")
    if failure.detail:
        lines.append(failure.detail)
    path = recordings.get(group.first)
    if plan.tests:
        lines.append(f"fbvm chart {named(path)}" if path and path.exists() else f"the same command with --only {group.first}")
    elif path:
        which = f" --plc {failure.plc}" if len(plan.project.plcs) > 1 else ""
        lines.append(f"fbvm replay {named(path)}{which}")
    return lines


def _values(plan: Plan, variant: Variant) -> list[str]:
    """The parameters of a run."""
    return [f"{axis.name} = {axis.text(variant.value(plan, at))}" for at, axis in enumerate(plan.axes)]


def _as_dict(outcome: Outcome, recordings: dict[int, Path]) -> dict[str, Any]:
    """The campaign for --json."""
    return {"runs": outcome.plan.count, "done": len(outcome.results), "good": len(outcome.results) - outcome.failing,
            "failing": outcome.failing, "seed": outcome.plan.seed,
            "groups": [_group_as_dict(outcome, group, recordings) for group in outcome.groups]}  # fmt: skip


def _group_as_dict(outcome: Outcome, group: Group, recordings: dict[int, Path]) -> dict[str, Any]:
    from fbvm.campaign.groups import in_common
    from fbvm.campaign.variants import draw

    plan, path = outcome.plan, recordings.get(group.first)
    variant = group.shrunk.variant if group.shrunk else draw(plan, group.first)
    failure = group.shrunk.result.failure if group.shrunk and group.shrunk.result.failure else group.failure
    return {
        **vars(group.failure), "plc": failure.plc, "scan": failure.scan, "now_ns": failure.now_ns, "runs": len(group.numbers),
        "first": group.first, "seed": variant.seed, "common": in_common(plan, group, outcome.results),
        "values": {axis.name: axis.plain(variant.value(plan, at)) for at, axis in enumerate(plan.axes)},
        "faults": list(map(str, variant.faults)), "power": list(map(str, variant.cuts)), "timing": variant.timing,
        "shrunk": group.shrunk is not None, "recording": str(path) if path and path.exists() else None,
    }  # fmt: skip


# --- one run ----------------------------------------------------------------------------------------------------------


def _execute_one(bench: AnyBench, number: int, folder: Path) -> int:
    """Executes one run, records it and prints what came of it; returns the exit status."""
    if number >= bench.plan.count:
        raise click.UsageError(f"--only {number}: there are runs 0 to {bench.plan.count - 1}")
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
    variant, path = bench.variant(number), folder / f"run{number}.fbtrace"
    result, report = record_test(bench, variant, path) if bench.plan.tests else (_recorded(bench, variant, path), "")
    for line in (*_values(bench.plan, variant), *variant.faults, *variant.cuts):
        say(str(line))
    if result.failure and report:
        say(report)
    say(f"run {number}, seed {variant.seed}: {result.failure or 'good'}{f'; recorded in {named(path)}' * path.exists()}")
    return status.FAILED if result.failure else status.GOOD


def _write_golden(bench: Bench, home: Path) -> None:
    """Writes the golden files from a run in which nothing goes wrong."""
    from fbvm.base.files import write_file

    if not bench.plan.judging.goldens:
        raise click.UsageError("the campaign has no [[golden]] to write")
    execution = bench.execution()
    execution.result(replace(bench.variant(0), values=(0,) * len(bench.plan.axes), faults=(), cuts=(), timing="exact"))
    for name, text in execution.traces.items():
        with writing(home / name):
            write_file(home / name, text)
        say(f"{named(home / name)} is written")
