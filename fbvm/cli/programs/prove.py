"""`fbvm prove`: whether a property holds in every run, and the shortest run in which it does not."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from fbvm.base.files import write_file
from fbvm.cli.programs.prove_tests import answering, told, write_tests
from fbvm.cli.shared import status
from fbvm.cli.shared.files import check_outputs, writing
from fbvm.cli.shared.given_sources import inputs, sources_of
from fbvm.cli.shared.options import CYCLE_NS, time_ns
from fbvm.cli.shared.run_recording import described, program_text, record_run, write_page
from fbvm.cli.shared.run_result import chart_width
from fbvm.cli.shared.sources import compile_options, compile_or_exit, report_diagnostics, source_arguments
from fbvm.cli.shared.terminal import say, say_json
from fbvm.cli.shared.traces import statement_lines
from fbvm.code.compiler import compile_files
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.prove import equality
from fbvm.prove.cycle import cycle_bounds, show_cycle
from fbvm.prove.prover import Limits
from fbvm.prove.pytest_text import pytest_text
from fbvm.prove.question import ALWAYS, NEVER, NO_TRAP, REACH, WITHIN, Names, Question, Verdict
from fbvm.prove.ready import at_most_one, handshake, written_once
from fbvm.prove.report import details, headline
from fbvm.prove.runs import repeated
from fbvm.prove.stored import proved_once
from fbvm.run.time_limit import time_limit
from fbvm.watch.paths import UnknownPlace
from fbvm.watch.values import plain_value

BUDGET_NS = 60_000_000_000
_COLOURS = {"proved": "green", "reached": "green"}
_FILE = click.Path(dir_okay=False, path_type=Path)


def _cycle(value: str) -> tuple[int, int]:
    """The shortest and the longest time between two scans.  Raises BadParameter."""
    try:
        return cycle_bounds(value)
    except ValueError as error:
        raise click.BadParameter(str(error)) from None


def _unit(value: str) -> tuple[int, int]:
    """The number of a unit and of one of its sockets.  Raises BadParameter."""
    unit, _, socket = value.partition(":")
    if not unit.isdecimal() or not socket.isdecimal() or int(unit) > 15 or int(socket) not in range(1, 9):
        raise click.BadParameter(f"{value!r} is not UNIT:SOCKET, a unit number 0 to 15 and a socket 1 to 8: write 0:1")
    return int(unit), int(socket)


@click.command("prove")
@source_arguments
@click.option("--never", multiple=True, metavar="EXPRESSION", help="It never holds behind a scan: 'Main.Up AND Main.Down'.")
@click.option("--always", multiple=True, metavar="EXPRESSION", help="It holds behind every scan.")
@click.option("--reach", multiple=True, metavar="EXPRESSION", help="Find the shortest run to a scan behind which it holds.")
@click.option("--at-most-one", multiple=True, metavar="EXPRESSION,EXPRESSION...", help="Never two of them hold behind a scan.")
@click.option("--handshake", multiple=True, metavar="INSTANCE",
              help="Of its outputs Done, Busy, Error never two are TRUE, nor ENO and Error.")
@click.option("--written-once", multiple=True, metavar="NAME|ADDRESS|FIRST..LAST,...",
              help="Never two statements write the same output, or bit of it, in one scan.")
@click.option("--no-trap", is_flag=True, help="No scan ends in a trap.")
@click.option("--within", nargs=3, multiple=True, metavar="TRIGGER EXPRESSION TIME",
              help="When TRIGGER becomes true, EXPRESSION holds behind a scan that begins TIME later at most.")
@click.option("--equal", "pairs", nargs=2, multiple=True, metavar="BLOCK BLOCK",
              help="Two function blocks or functions give the same outputs for the same inputs.")
@click.option("--assume", multiple=True, metavar="EXPRESSION", help="Look only at runs in which it holds behind every scan.")
@click.option("--free", multiple=True, metavar="NAME|ADDRESS|FIRST..LAST",
              help="Takes any value in each scan, as inputs do.")
@click.option("--unit-rules", type=_unit, multiple=True, metavar="UNIT:SOCKET",
              help="The words of this socket of an ETN21 change as its manuals say, and not otherwise: 0:1.")
@click.option("--lemma", multiple=True, metavar="EXPRESSION",
              help="It holds behind every scan, too: it is proved as well, and helps to prove the property.")
@click.option("--cycle", type=_cycle, default=str(CYCLE_NS // 1_000_000) + "ms", metavar="TIME|TIME..TIME", show_default="10ms",
              help="How often the PLC scans; 5ms..50ms: any time within these bounds passes between two scans.")
@click.option("--scans", type=click.IntRange(min=1), default=1000, show_default=True, metavar="N",
              help="Look no further than N scans after power-on where there is no proof for all.")
@click.option("--budget", "budget_ns", type=time_ns, default=BUDGET_NS, show_default="1m", metavar="TIME",
              help="Give up a property after this time on the clock of the wall.")
@click.option("--seed", type=int, default=0, metavar="N", help="What random runs begin with.")
@click.option("--trace", type=_FILE, metavar="FILE", help="Record the first run that is found for `fbvm chart`, `table`, `why`.")
@click.option("--html", type=_FILE, metavar="FILE", help="Write the first run that is found as a page for a browser.")
@click.option("--test", "test_file", type=_FILE, metavar="FILE", help="Write each run that is found as a test of pytest.")
@click.option("--tests", "tests_file", type=_FILE, metavar="FILE",
              help="Write tests that execute every statement and every IF and CASE without a branch.")
@click.option("--covered", type=_FILE, metavar="FILE", help="With --tests: what tests execute already, by `--fbvm-cov-xml FILE`.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(files: tuple[Path, ...], program: str | None, libraries: tuple[Path, ...], as_json: bool, **options: Any) -> None:
    """Prove properties of a program for all inputs and all scans, or draw the shortest run that breaks one.

    Conditions are written as for `fbvm run --until`.  Inputs are free in each scan: %I, CIO that the program reads and never
    writes, VAR_INPUT of the PROGRAM.

    Proofs are kept on disk until the program or the property changes; --no-cache makes them anew.

    Status 0 if all is proved or reached, 1 if a property is broken or undecided, 3 if the program has errors or cannot be
    followed."""
    questions, pairs = _questions(options), options["pairs"]
    needs_names = options["handshake"] or options["written_once"]
    _refuse_mixed(options, bool(questions or pairs or needs_names))
    check_outputs(*(options[name] for name in ("trace", "html", "test_file", "tests_file")))
    if options["tests_file"]:
        sys.exit(write_tests(files, program, libraries, as_json, options))
    asked = [_equality(pair, files, libraries, options["assume"]) for pair in pairs]
    if questions or needs_names:
        image = compile_or_exit(files, program, libraries, runnable=True, as_json=as_json)
        questions += _ready(lambda: _named(Names(image), options))
        asked += [(image, question) for question in questions]
    verdicts: list[Verdict] = []
    found: list[Verdict] = []
    for image, plain in asked:
        question = replace(plain, units=options["unit_rules"], lemmas=options["lemma"])
        verdict = _answered(image, question, options)
        verdicts.append(verdict)
        if verdict.run is not None and len(verdicts) > len(pairs):  # kept before it is told: who reads may have gone
            found.append(verdict)
            _keep(image, found, options, files, libraries, program)
        if not as_json:
            _print(image, verdict)
    if as_json:
        cycle_ns, longest_ns = options["cycle"]
        rows = [_as_dict(verdict) for verdict in verdicts]
        say_json({"cycle_ns": cycle_ns, "longest_cycle_ns": longest_ns, "properties": rows})
    sys.exit(status.GOOD if all(verdict.is_good for verdict in verdicts) else status.FAILED)


def _refuse_mixed(options: dict[str, Any], asks: bool) -> None:
    """Raises UsageError for options that do not go together, and where nothing is asked."""
    if options["tests_file"] and asks:
        raise click.UsageError("--tests stands alone: ask for properties in a call of its own")
    if options["tests_file"] and options["lemma"]:
        raise click.UsageError("--lemma helps to prove a property, which --tests has none of")
    if options["covered"] and not options["tests_file"]:
        raise click.UsageError("--covered says what --tests may leave out, which is not given")
    if not asks and not options["tests_file"]:
        raise click.UsageError("say what to prove: --never, --always, --reach, --no-trap, --within, --at-most-one, --handshake, "
                               "--written-once, --equal or --tests")  # fmt: skip


def _questions(options: dict[str, Any]) -> list[Question]:
    """What the options ask that needs no program to be written down."""
    assumed, free = options["assume"], options["free"]
    kinds = [(NEVER, options["never"]), (ALWAYS, options["always"]), (REACH, options["reach"])]
    found = [Question(kind, text, assumed, free) for kind, texts in kinds for text in texts]
    found += [Question(WITHIN, text, assumed, free, trigger=trigger, within_ns=time_ns(limit))
              for trigger, text, limit in options["within"]]  # fmt: skip
    found += [Question(NO_TRAP, "", assumed, free)] * options["no_trap"]
    return found + _ready(lambda: [at_most_one([each.strip() for each in text.split(",")], assumed, free)
                                   for text in options["at_most_one"]])  # fmt: skip


def _named(names: Names, options: dict[str, Any]) -> list[Question]:
    """What the options ask of names.  Raises UnknownPlace."""
    given = options["assume"], options["free"]
    found = [handshake(names, path, *given) for path in options["handshake"]]
    return found + [question for text in options["written_once"] for question in written_once(names, text, *given)]


def _ready(make: Callable[[], list[Question]]) -> list[Question]:
    """Properties in words.  Raises UsageError for names and numbers that do not fit."""
    try:
        return make()
    except (UnknownPlace, ValueError) as error:
        raise click.UsageError(str(error)) from None


def _equality(pair: tuple[str, str], files: Sequence[Path], libraries: Sequence[Path],
              assumed: tuple[str, ...]) -> tuple[Image, Question]:  # fmt: skip
    """The program that calls two blocks, and the question whether they are equal.  Ends the verb for blocks that cannot be
    compared."""
    try:
        caller = equality.pair(sources_of(files), pair, libraries)
        made = compile_files([*inputs(files)[0], caller], program=equality.PROGRAM, libraries=libraries, runnable=True,
                             lint=False, **compile_options(files))
        if made.image is None:
            report_diagnostics(made.diagnostics, False)
            sys.exit(status.PROGRAM_ERRORS)
        return made.image, equality.equality(made.image, pair, assumed)
    except equality.Unlike as error:
        raise click.UsageError(str(error)) from None


def _answered(image: Image, question: Question, options: dict[str, Any]) -> Verdict:
    """The answer to one question, a proof from the cache.  Ends the verb for one that cannot be answered."""
    cycle_ns, longest_ns = options["cycle"]
    limits = Limits(cycle_ns, options["scans"], options["seed"], time_limit(options["budget_ns"]), longest_ns=longest_ns)
    with answering(image, str(question)), told(str(question)) as tell:
        return proved_once(image, question, limits, tell)


def _print(image: Image, verdict: Verdict) -> None:
    """What a person reads: the verdict, what limits the answer, the run as a chart."""
    say(headline(verdict), fg=_COLOURS.get(verdict.word, "red"), bold=True)
    for line in details(image, verdict, chart_width()):
        say(line)


def _as_dict(verdict: Verdict) -> dict[str, object]:
    """One property for --json; the values of inputs by scan, only where they change."""
    found: dict[str, object] = {"kind": verdict.question.kind, "expression": verdict.question.text, "verdict": verdict.word,
                                "how": verdict.how, "clear_scans": verdict.scans, "notes": list(verdict.notes),
                                "from_cache": verdict.is_kept}  # fmt: skip
    if run := verdict.run:
        found["run"] = {
            "scans": run.scans, "shortest": run.is_shortest, "trap": run.trap.code if run.trap else None,
            "times_ns": [*run.times_ns], "writers": [*run.writers],
            "writes": [{"scan": number, "values": {place.name: plain_value(place.type, value) for place, value in writes.items()}}
                       for number, writes in enumerate(run.writes) if writes],
        }  # fmt: skip
    return found


def _keep(image: Image, found: Sequence[Verdict], options: dict[str, Any], files: Sequence[Path], libraries: Sequence[Path],
          program: str | None) -> None:  # fmt: skip
    """Writes the runs that were found, the last one just now, into the files that --test, --trace and --html name."""
    if options["test_file"]:
        chosen = ({"program": program} if program else {}) | compile_options(files)
        with writing(options["test_file"]):
            write_file(options["test_file"], pytest_text(found, files, chosen))
    if len(found) == 1 and (options["trace"] or options["html"]):
        _record(image, found[0], options, files, libraries, program)


def _record(image: Image, verdict: Verdict, options: dict[str, Any], files: Sequence[Path], libraries: Sequence[Path],
            program: str | None) -> None:  # fmt: skip
    """Writes the run of a verdict as a recording, and as a page."""
    assert verdict.run is not None
    about = {"journal": None, "trace": options["trace"], "selected": (), "verify": False, "depth": "scans"}
    plc = Plc(image, verdict.run.cycle_ns)
    with record_run(about, {"proof": str(verdict.question), "cycle": show_cycle(*options["cycle"])},
                    in_memory=bool(options["html"])) as recorded:  # fmt: skip
        text = program_text(files, libraries, program=program, drawn=False, e_banks=(), **compile_options(files))
        recorded.add(files[0].stem, plc, described(plc, text, about, files, libraries))
        repeated(plc, verdict.run)
        if options["html"]:
            write_page(recorded, options["html"], statement_lines(image, files, libraries))


