"""Writes runs that break a property, or reach something, as tests of pytest, which need no solver."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from fbvm.code.image import Image
from fbvm.prove.cover import Covered, Reaching
from fbvm.prove.question import ALWAYS, NO_TRAP, REACH, WITHIN, WRITTEN_ONCE, Run, Verdict


def pytest_text(verdicts: Sequence[Verdict], files: Sequence[Path], options: dict[str, str]) -> str:
    """The text of a test module that compiles `files` and repeats the run of each verdict that has one.

    `options` are keyword arguments of `compile_files`.  A test of a property fails until the program keeps it; that of what was
    to be reached passes."""
    given = "".join(f", {name}={value!r}" for name, value in options.items())
    writers = any(verdict.run and verdict.run.writers for verdict in verdicts)
    more = ["from fbvm.testing import double_writes"] * writers
    lines = ['"""Runs that `fbvm prove` has found."""', "", "from fbvm import Plc, compile_files", *more, "",
             f"FILES = [{', '.join(repr(str(file)) for file in files)}]"]  # fmt: skip
    used: set[str] = set()
    for verdict in verdicts:
        if verdict.run is not None:
            name = _test_name(verdict, used)
            lines += ["", "", f"def {name}():", f"    image = compile_files(FILES{given}, runnable=True).image",
                      f"    plc = Plc(image, cycle_ns={verdict.run.cycle_ns:_})", *_statements(verdict, verdict.run)]  # fmt: skip
    return "\n".join(lines) + "\n"


def covering_text(covered: Covered, image: Image, files: Sequence[Path], options: dict[str, str]) -> str:
    """The text of a test module with a test for each run that meets goals of coverage.

    `options` are keyword arguments of `compile_files`, its dialect among them.  What outputs are is what they are today: a test
    says that this has changed, and a person whether it is right."""
    first, *others = (str(file) for file in files)
    subject = f"{first}::{options['program']}" if "program" in options else first
    given = (f", sources={others!r}" if others else "") + f", dialect={options['dialect']!r}"
    lines = ['"""Runs that execute what no other test does, found by `fbvm prove --tests`.', "",
             'The outputs are those of the program as it was: look at them once, whether they are right."""']  # fmt: skip
    used: set[str] = set()
    for each in covered.runs:
        told = [spot.words(image) for spot in each.spots]
        more = f"\n\n    {len(told)} statements and branches" if len(told) > 1 else ""
        lines += ["", "", f"def {_named(f'reaches {Path(told[0]).name}', used)}(plc):", f'    """Executes {told[0]}.{more}"""',
                  f"    machine = plc({subject!r}, {each.run.cycle_ns:_}{given}).plc", *_compared(each)]  # fmt: skip
    return "\n".join(lines) + "\n"


def _compared(each: Reaching) -> Iterator[str]:
    """The scans of a run, with what the outputs are before each change of inputs and at its end."""
    waiting = 0
    for number in range(each.run.scans):
        changes = [*_writes(each.run, number, "machine")]
        if changes and waiting:
            yield from _ended(each, number - 1, waiting)
            waiting = 0
        yield from changes
        waiting += 1
    yield from _ended(each, each.run.scans - 1, waiting)


def _ended(each: Reaching, number: int, scans: int) -> Iterator[str]:
    if number == each.run.scans - 1 and each.run.trap is not None:
        yield f"    assert machine.run(scans={scans}) == 'trap'"
        return
    yield f"    machine.run(scans={scans})"
    for place, value in each.outputs[number].items():
        sign = "is" if isinstance(value, bool) else "=="
        yield f"    assert machine.read({place.name!r}) {sign} {value!r}"


def _test_name(verdict: Verdict, used: set[str]) -> str:
    return _named(str(verdict.question), used)


def _named(text: str, used: set[str]) -> str:
    words = "_".join(re.findall(r"\w+", text.lower()))[:60].rstrip("_")
    name, number = f"test_{words}", 2
    while name in used:
        name, number = f"test_{words}_{number}", number + 1
    used.add(name)
    return name


def _statements(verdict: Verdict, run: Run) -> list[str]:
    """The writes of each scan and the scans between them; the last scan is asked for the property."""
    question = verdict.question
    first_asked = run.scans - 1
    if question.kind == WITHIN:
        first_asked = run.times_ns.index(run.asked_ns)
    lines = list(_scans(run, first_asked))
    if question.kind == NO_TRAP:
        return [*lines, *_writes(run, first_asked), "    assert plc.scan() is None"]
    if question.kind == WRITTEN_ONCE:
        return [*lines, *_writes(run, first_asked), f"    assert double_writes(plc, {question.text!r}) == []"]
    ended = f"plc.run(scans=1, until={question.text!r})"
    if question.kind == WITHIN:
        lines.append("    answers = []")
        for number in range(first_asked, run.scans):
            if run.times_ns[number] - run.asked_ns > question.within_ns:
                break
            lines += [*_writes(run, number), f"    answers.append({ended})"]
        return [*lines, "    assert 'until' in answers"]
    sign = "==" if question.kind in (ALWAYS, REACH) else "!="
    return [*lines, *_writes(run, first_asked), f"    assert {ended} {sign} 'until'"]


def _scans(run: Run, count: int) -> Iterator[str]:
    """The first scans of a run, those between which nothing is written at once."""
    waiting = 0
    for number in range(count):
        if waiting and (changes := [*_writes(run, number)]):
            yield f"    plc.run(scans={waiting})"
            yield from changes
            waiting = 0
        elif not waiting:
            yield from _writes(run, number)
        waiting += 1
    if waiting:
        yield f"    plc.run(scans={waiting})"


def _writes(run: Run, number: int, plc: str = "plc") -> Iterator[str]:
    """What is written before the scan of a number, and how long before it the last one began where that changes."""
    passed_ns = [run.cycle_ns, *run.passed_ns]
    if number and passed_ns[number] != passed_ns[number - 1]:
        yield f"    {plc}.cycle_ns = {passed_ns[number]:_}"
    for place, value in run.writes[number].items():
        yield f"    {plc}.write({place.name!r}, {value!r})"
