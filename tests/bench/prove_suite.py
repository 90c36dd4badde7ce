"""Asks `fbvm.prove` the questions of a published suite of programs with known verdicts.  It gates nothing.

    python tests/bench/prove_suite.py DIR [--table FILE] [--seconds T] [--only TEXT]

DIR is a copy of the "IEC 61131-3 Formal Verification Benchmark Suite" (P. Dantas, L. C. Cordeiro, W. Junior, 2026, DOI
10.5281/zenodo.21642385) or a part of it: folders with `benchmark.yml`, the properties that it names, and programs.  Needs PyYAML.
Nothing of it is kept here; the verdicts are, in prove_suite.md.

A row says of each variant of a task what is expected, what was found, how, and how long it took; runs of violations were done by
the engine.  What is out of scope is a row with its reason.  A proof about a program of which some statements are never executed,
or of variables that nothing changes, is marked as vacuous."""

from __future__ import annotations

import argparse
import re
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

HOUSE = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(HOUSE))

from fbvm.code.compiler import compile_files  # noqa: E402
from fbvm.code.image import Image  # noqa: E402
from fbvm.interchange.plcopen.read.importing import import_xml  # noqa: E402
from fbvm.machine.plc import STEP_BUDGET  # noqa: E402
from fbvm.prove.encoding.execution import Refused  # noqa: E402
from fbvm.prove.encoding.summary import summarize  # noqa: E402
from fbvm.prove.prover import Limits, SpuriousRun, prove  # noqa: E402
from fbvm.prove.question import ALWAYS, BROKEN, NEVER, NO_TRAP, PROVED, REACH, REACHED, UNREACHABLE, Question, Verdict  # noqa: E402
from fbvm.prove.ready import at_most_one  # noqa: E402
from fbvm.run.time_limit import stopwatch, time_limit  # noqa: E402
from fbvm.watch.names import Names as PlaceNames  # noqa: E402
from fbvm.watch.paths import UnknownPlace  # noqa: E402
from fbvm.watch.scanner import ConditionError  # noqa: E402

SIGNS = (("&&", " AND "), ("||", " OR "), ("!=", "<>"), ("==", "="), ("!", " NOT "))
"""How the properties of the suite write what conditions write in words; in this order."""
VACUOUS = ("same value in every scan", "executes ")
HOLDS = {PROVED: True, REACHED: True, BROKEN: False, UNREACHABLE: False}
UNWRITTEN = {"overflow": "integers wrap, by the standard of this house: an overflow is no error"}


class OutOfScope(Exception):
    """What is not asked, and why."""


class Answer(NamedTuple):
    """The answer to one property."""

    name: str
    holds: bool | None
    how: str
    is_vacuous: bool = False


class Row(NamedTuple):
    """What was found of one variant of a task."""

    task: str
    file: str
    language: str
    expected: bool
    answers: tuple[Answer, ...]
    reason: str
    seconds: float

    @property
    def found(self) -> bool | None:
        """True if all properties hold, False if one does not, None if that is not known."""
        held = [answer.holds for answer in self.answers]
        return False if False in held else None if None in held or not held else True

    @property
    def word(self) -> str:
        if self.reason:
            return "out of scope"
        if self.found is None:
            return "undecided"
        good = "vacuous" if self.found and any(answer.is_vacuous for answer in self.answers) else "agrees"
        return good if self.found == self.expected else "differs"

    def cells(self) -> list[str]:
        said = {True: "holds", False: "violated", None: "undecided"}
        how = "; ".join(f"{answer.name} {said[answer.holds]}, {answer.how}" for answer in self.answers) or self.reason
        return [self.task, self.file, self.language, said[self.expected], self.word, how, f"{self.seconds:.1f}"]


def condition(text: str) -> str:
    """A property of the suite as a condition."""
    before, arrow, behind = re.split(r"(->|\bIMPLIES\b|$)", text, maxsplit=1)
    if arrow:
        return f"NOT ({condition(before)}) OR ({condition(behind)})"
    for theirs, ours in SIGNS:
        text = text.replace(theirs, ours)
    return re.sub(r"\s+", " ", text).strip()


def question(prop: dict[str, Any], prefix: str, free: tuple[str, ...]) -> Question:
    """The question that a property of the suite asks, where these variables are inputs.  Raises OutOfScope."""
    return replace(_question(prop), prefix=prefix, free=free)


def _question(prop: dict[str, Any]) -> Question:
    kind = prop["kind"]
    if kind in ("invariant", "reachability", "reachable"):
        ours = {"invariant": ALWAYS, "reachability": NEVER, "reachable": REACH}[kind]
        return Question(ours, condition(prop["expression"]))
    if kind == "mutual_exclusion":
        return at_most_one([*prop["variables"]])
    if kind == "termination" or kind == "absence" and prop.get("subtype") not in UNWRITTEN:
        return Question(NO_TRAP)
    raise OutOfScope(UNWRITTEN.get(prop.get("subtype", ""), f"a property of the kind {kind} is not asked here"))


def image_of(path: Path, into: Path) -> Image:
    """The program of a variant; files of an import are written into a folder.  Raises OutOfScope for what is not read."""
    files = [path]
    if path.suffix == ".xml":
        imported = import_xml(path)
        if imported.errors or not imported.files:
            raise OutOfScope("not imported: " + (imported.errors[0].message if imported.errors else "it holds no program"))
        files = [into / name for name in imported.files]
        for name, text in imported.files.items():
            (into / name).write_text(text, encoding="utf-8")
    elif path.suffix not in (".st", ".il"):
        raise OutOfScope(f"{path.suffix}: the suite's own notation for ladder is not read")
    made = compile_files(files, runnable=True, lint=False)
    if made.image is None:
        first = next(iter(made.diagnostics))
        raise OutOfScope(f"not compiled: {first.code} {first.message}")
    return made.image


def undriven(image: Image) -> tuple[str, ...]:
    """The variables of a program that has no inputs which it reads and never writes: drawings do not say what is an input."""
    summary = summarize(image, STEP_BUDGET)
    if summary.inputs:
        return ()
    names = PlaceNames.of(image, image.layout.areas)
    found = [names.at(cell.offset) for cell in sorted(summary.never_written)]
    return tuple(place.name for place in found if place is not None)


def answered(image: Image, asked: Question, seconds: float) -> Verdict:
    """The verdict about one property.  Raises OutOfScope for one that cannot be followed."""
    limits = Limits(scans=40_000, simulated_scans=40_000, expired=time_limit(int(seconds * 1e9)))
    try:
        return prove(image, asked, limits)
    except (Refused, UnknownPlace, ConditionError) as error:
        raise OutOfScope(f"refused: {error}") from None


def row_of(folder: Path, task: dict[str, Any], variant: dict[str, Any], properties: list[dict[str, Any]], seconds: float) -> Row:
    """What is found of one variant."""
    passed = stopwatch()
    answers: list[Answer] = []
    reason = ""
    try:
        with tempfile.TemporaryDirectory() as into:
            image = image_of(folder / variant["file"], Path(into))
        prefix = f"{image.tasks[0].programs[0].name}."
        free = undriven(image)
        for prop in properties:
            verdict = answered(image, question(prop, prefix, free), seconds)
            is_vacuous = any(mark in note for note in verdict.notes for mark in VACUOUS)
            answers.append(Answer(prop["id"], HOLDS.get(verdict.word), verdict.how, is_vacuous))
    except OutOfScope as error:
        reason = str(error)
    except SpuriousRun as error:
        answers.append(Answer("-", None, f"DEFECT: {error}"))
    return Row(task["id"], variant["file"], task["language"], bool(variant["expected_verdict"]), tuple(answers), reason,
               passed() / 1e9)  # fmt: skip


def rows_of(suite: Path, only: str, seconds: float) -> Iterator[Row]:
    """The rows of all tasks in a folder."""
    import yaml

    for path in sorted(suite.rglob("benchmark.yml")):
        task = yaml.safe_load(path.read_text(encoding="utf-8"))
        if only not in task["id"]:
            continue
        named = path.parent / task.get("properties_file", "props.yaml")
        properties = yaml.safe_load(named.read_text(encoding="utf-8"))["properties"] if named.is_file() else []
        for variant in task["variants"]:
            if (path.parent / variant["file"]).is_file() and properties:
                yield row_of(path.parent, task, variant, properties, seconds)
            else:
                missing = named.name if not properties else variant["file"]
                yield Row(task["id"], variant["file"], task["language"], bool(variant["expected_verdict"]), (),
                          f"{missing} is not there", 0)  # fmt: skip


def table(rows: list[Row]) -> str:
    """The rows in Markdown, with a line that counts them."""
    head = ["task", "file", "language", "expected", "verdict", "found", "s"]
    lines = ["| " + " | ".join(cells) + " |" for cells in (head, ["---"] * len(head), *(row.cells() for row in rows))]
    counts = Counter(row.word for row in rows)
    told = ", ".join(f"{count} {word}" for word, count in sorted(counts.items()))
    return "\n".join([*lines, "", f"{len(rows)} variants: {told}; {sum(row.seconds for row in rows):.1f} s."]) + "\n"


def main() -> int:
    """Status 1 if a verdict differs or a proof is vacuous."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("suite", type=Path, metavar="DIR")
    parser.add_argument("--table", type=Path, metavar="FILE", help="write the table into a file, too")
    parser.add_argument("--seconds", type=float, default=20, help="time for one property (default %(default)s)")
    parser.add_argument("--only", default="", metavar="TEXT", help="only tasks with it in their name")
    options = parser.parse_args()
    rows = []
    for row in rows_of(options.suite, options.only, options.seconds):
        print(" | ".join(row.cells()), flush=True)
        rows.append(row)
    made = table(rows)
    print(made.splitlines()[-1])
    if options.table:
        options.table.write_text(made, encoding="utf-8")
    return int(any(row.word in ("differs", "vacuous") for row in rows))


if __name__ == "__main__":
    sys.exit(main())
