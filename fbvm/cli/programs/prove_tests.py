"""`fbvm prove --tests`: tests that execute what no test does; and what all ways of asking the prover share."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import click

from fbvm.base.files import resolved, write_file
from fbvm.cli.shared import status
from fbvm.cli.shared.files import writing
from fbvm.cli.shared.progress import show_progress
from fbvm.cli.shared.sources import compile_options, compile_or_exit
from fbvm.cli.shared.terminal import named, say, say_json
from fbvm.code.image import Image, Site
from fbvm.prove.cover import Covered, Known, cover
from fbvm.prove.encoding.execution import Refused
from fbvm.prove.encoding.terms import TimeOver
from fbvm.prove.prover import Limits, SpuriousRun
from fbvm.prove.pytest_text import covering_text
from fbvm.prove.solver import SolverMissing
from fbvm.run.time_limit import time_limit
from fbvm.watch.paths import UnknownPlace
from fbvm.watch.scanner import ConditionError

_WAYS = re.compile(r"\((\d+)/")
"""How many of its ways the line of an IF or CASE has taken: `75% (3/4)`."""


@contextmanager
def answering(image: Image, asked: str) -> Iterator[None]:
    """Ends the verb for a question that cannot be answered."""
    try:
        yield
    except (UnknownPlace, ConditionError, SolverMissing) as error:
        raise click.UsageError(str(error)) from None
    except Refused as refused:
        place = f"{image.sites[refused.site]}: " if refused.site >= 0 else ""
        say(f"{place}{asked}: {refused.reason}", fg="red", err=True)
        sys.exit(status.PROGRAM_ERRORS)
    except SpuriousRun as error:
        say(f"{asked}: {error}", fg="red", err=True)
        sys.exit(status.STOPPED)


@contextmanager
def told(text: str) -> Iterator[Callable[[str], None]]:
    """Shows what is done while a question is open."""
    with show_progress(text) as update:
        yield lambda said: update(said, 0, 1)


def write_tests(files: Sequence[Path], program: str | None, libraries: Sequence[Path], as_json: bool,
                options: dict[str, Any]) -> int:  # fmt: skip
    """Writes the tests, says what they execute and what no run does.  Returns the status."""
    image = compile_or_exit(files, program, libraries, runnable=True, as_json=as_json)
    known = _known(options["covered"]) if options["covered"] else lambda site, others: False
    cycle_ns, longest_ns = options["cycle"]
    limits = Limits(cycle_ns, options["scans"], options["seed"], time_limit(options["budget_ns"]), longest_ns=longest_ns)
    with answering(image, "tests"), told("tests") as tell:
        try:
            found = cover(image, limits, options["assume"], options["free"], known, tell, options["unit_rules"])
        except TimeOver:
            raise click.UsageError("the time is over: one scan has too many ways to follow all of them") from None
    if found.runs:
        chosen = ({"program": program} if program else {}) | compile_options(files)
        with writing(options["tests_file"]):
            write_file(options["tests_file"], covering_text(found, image, files, chosen))
    if as_json:
        say_json(_as_dict(image, found))
    else:
        _print(image, found, options["tests_file"])
    return status.FAILED if found.missed else status.GOOD


def _print(image: Image, found: Covered, file: Path) -> None:
    total = found.met + len(found.never) + len(found.missed)
    count = f"{len(found.runs)} new test{'s' * (len(found.runs) != 1)}"
    by = f", with {count} in {named(file)}" if found.runs else ", no new test is needed"
    say(f"{found.met} of {total} statements and branches are executed{by}", fg="red" if found.missed else "green", bold=True)
    for spot in found.never:
        say(f"  {spot.words(image)}: no run ever does it")
    for spot, scans in found.missed.items():
        what = f"no run of {scans} scan{'s' * (scans > 1)} does it" if scans else "it was not found out whether a run does it"
        say(f"  {spot.words(image)}: {what}")


def _as_dict(image: Image, found: Covered) -> dict[str, object]:
    return {"met": found.met, "tests": [{"scans": each.run.scans, "executes": [spot.words(image) for spot in each.spots]}
                                        for each in found.runs],
            "never": [spot.words(image) for spot in found.never],
            "missed": [{"place": spot.words(image), "scans": scans} for spot, scans in found.missed.items()]}  # fmt: skip


def _known(report: Path) -> Known:
    """What a report of `--fbvm-cov-xml` says to be executed; of the ways of an IF or CASE it has only the number.

    Raises UsageError for what is no such report."""
    try:
        root = ElementTree.parse(report).getroot()
        lines = {(resolved(Path(each.get("filename", ""))), int(line.get("number", "0"))): line
                 for each in root.iter("class") for line in each.iter("line")}  # fmt: skip
    except (OSError, ValueError, ElementTree.ParseError) as error:
        raise click.UsageError(f"{named(report)} is no report of --fbvm-cov-xml: {error}") from None

    def line_of(site: Site) -> ElementTree.Element | None:
        line = lines.get((resolved(Path(site.file)), site.line))
        return line if line is not None and line.get("hits", "0") != "0" else None

    def known(site: Site, others: list[Site]) -> bool:
        if (line := line_of(site)) is None:
            return False
        taken = _WAYS.search(line.get("condition-coverage", ""))
        return not others or taken is not None and int(taken[1]) > sum(line_of(other) is not None for other in others)

    return known
