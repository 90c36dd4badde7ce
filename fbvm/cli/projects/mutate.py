"""`fbvm mutate`: which small mistakes in the programs of a project its tests would not notice."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fbvm.cli.projects.cluster import cluster_of, cluster_option
from fbvm.cli.projects.planned_runs import MOST_SEED, jobs_option, processes
from fbvm.cli.shared import status
from fbvm.cli.shared.options import CYCLE_NS, moment_ns, time_ns
from fbvm.cli.shared.progress import show_progress
from fbvm.cli.shared.terminal import named, say, say_json

if TYPE_CHECKING:
    from fbvm.base.diagnostics import Source
    from fbvm.campaign.mutation.mutants import Tried
    from fbvm.campaign.mutation.session import Outcome

PROOF_NS = 5_000_000_000
_FILE = click.Path(exists=True, dir_okay=False, path_type=Path)


@click.command("mutate")
@click.argument("files", nargs=-1, type=_FILE, metavar="[FILE]...")
@click.option("--since", metavar="REVISION", help="Only lines that differ from this revision of Git.")
@click.option("--sample", type=click.IntRange(min=1), metavar="N", help="Try N mutants, drawn by --seed.")
@click.option("--seed", type=click.IntRange(0, MOST_SEED), default=0, metavar="N", help="What --sample draws with.")
@jobs_option
@click.option("--limit", "limit_ns", type=time_ns, default=0, metavar="TIME",
              help="How long the tests may take with a mutant; ten times as long as without one by itself.")
@click.option("--budget", "budget_ns", type=moment_ns, default=PROOF_NS, show_default="5s", metavar="TIME",
              help="How long to look for a proof that a mutant which survives is equal; 0s proves nothing.")
@click.option("--cycle", "cycle_ns", type=time_ns, default=CYCLE_NS, metavar="TIME", show_default="10ms",
              help="How often the PLC scans, for these proofs.")
@cluster_option
@click.option("--tests", "arguments", multiple=True, metavar="PATH", help="Tests to run; all of this folder by itself.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object, with all mutants.")
def command(files: tuple[Path, ...], as_json: bool, **options: Any) -> None:
    """Change the programs of this folder in small ways, one at a time, and tell which changes no test notices.

    FILEs are the sources to change; all .st files but tests by themselves.  The tests of the folder run on each mutant in a copy
    of the folder.  A mutant that is proved to give the same outputs does not count, if the solver is there (fbvm[prove]).

    Status 0 if the tests found all mutants, 1 if some survived, 2 if the tests fail without one, 5 if the cluster cannot be
    used."""
    if find_spec("pytest") is None:
        raise click.UsageError("tests need pytest: pip install pytest")
    from fbvm.campaign.mutation.session import (
        NotPossible,
        Outcome,
        Settings,
        changed_lines,
        mutants_of,
        read_source,
        sample,
        sources_of,
        try_mutants,
    )
    from fbvm.campaign.project_copies import TooLarge
    from fbvm.campaign.work import Mismatch, Unreachable

    folder, address = Path.cwd(), options["cluster"]
    _check_tests(options["arguments"])
    try:
        names = _names(files, folder) or sources_of(folder)
        sources = [read_source(folder, name) for name in names]
        lines = changed_lines(folder, options["since"], names) if options["since"] else None
        mutants = mutants_of(sources, lines)
        if options["sample"]:
            mutants = sample(mutants, options["sample"], options["seed"])
        outcome = Outcome(len(mutants))
        settings = Settings(processes(options["jobs"]), options["arguments"], options["limit_ns"],
                            options["budget_ns"], options["cycle_ns"])  # fmt: skip
        try:
            if mutants:
                with show_progress("mutants") as update:
                    try_mutants(folder, mutants, sources, settings, outcome,
                                lambda now: update(_counted(now), len(now.tried), now.known),
                                (lambda bench: cluster_of(bench, address, settings.jobs)) if address else None)  # fmt: skip
        finally:
            if outcome.tried or not mutants:
                _print(outcome, sources, as_json)
    except (NotPossible, TooLarge) as error:
        raise click.UsageError(str(error)) from None
    except (Mismatch, Unreachable) as error:
        say(str(error), fg="red", err=True)
        sys.exit(status.NETWORK)
    sys.exit(status.FAILED if outcome.counts["survived"] else status.GOOD)


def _names(files: tuple[Path, ...], folder: Path) -> list[str]:
    """The names of files as the project has them.  Ends the verb for one that lies elsewhere."""
    names = []
    for file in files:
        path = Path(os.path.abspath(file))
        if not path.is_relative_to(folder):
            raise click.UsageError(f"{named(file)} is not in this folder: go to the folder of its project")
        names.append(path.relative_to(folder).as_posix())
    return names


def _check_tests(arguments: Sequence[str]) -> None:
    """Raises UsageError for a test whose file is not there, which would look like a test that fails."""
    for argument in arguments:
        path = argument.partition("::")[0]
        if path.startswith("-"):  # an option of pytest, whose value may follow
            return
        if not Path(path).exists():
            raise click.UsageError(f"--tests {argument}: there is no {path} in this folder")


def _counted(outcome: Outcome) -> str:
    """How many mutants there were of each result, in words."""
    counts = outcome.counts
    return ", ".join(f"{counts[result]} {result}" for result in RESULTS if counts[result])


def _as_dict(tried: Tried, texts: dict[str, str]) -> dict[str, object]:
    """One mutant for --json."""
    mutant = tried.mutant
    return {"number": mutant.number, "file": mutant.file, "line": mutant.line, "pou": mutant.change.pou,
            "operator": mutant.change.operator, "result": tried.result, "by": tried.by,
            "diff": mutant.diff(texts[mutant.file])}  # fmt: skip


RESULTS = ("killed", "timed out", "survived", "equal", "invalid")


def _print(outcome: Outcome, sources: list[Source], as_json: bool) -> None:
    """All survivors with their diffs, then the counts."""
    texts = {source.name: source.text for source in sources}
    if as_json:
        say_json({"known": outcome.known, "tried": len(outcome.tried), "score": outcome.score,
                  "counts": {result: outcome.counts[result] for result in RESULTS},
                  "mutants": [_as_dict(each, texts) for each in outcome.rows]})  # fmt: skip
        return
    for each in outcome.rows:
        if each.result == "survived":
            change = each.mutant.change
            say(f"{each.mutant.file}:{each.mutant.line}: {change.operator} in {change.pou} survived", fg="red", bold=True)
            say(each.mutant.diff(texts[each.mutant.file]).split("\n", 2)[2])
            say()
    if not outcome.known:
        say("nothing to change")
        return
    cut = f" of {outcome.known}" if len(outcome.tried) < outcome.known else ""
    many = "s" * (outcome.known != 1)
    say(f"{len(outcome.tried)}{cut} mutant{many}: {_counted(outcome)}; the tests find {100 * outcome.score:.0f} %")
