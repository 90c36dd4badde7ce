"""Writes runs that break a property, or reach something, as tests of pytest, which need no solver."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from fbvm.prove.question import ALWAYS, NO_TRAP, REACH, WITHIN, Run, Verdict


def pytest_text(verdicts: Sequence[Verdict], files: Sequence[Path], options: dict[str, str]) -> str:
    """The text of a test module that compiles `files` and repeats the run of each verdict that has one.

    `options` are keyword arguments of `compile_files`.  A test of a property fails until the program keeps it; that of what was
    to be reached passes."""
    given = "".join(f", {name}={value!r}" for name, value in options.items())
    lines = ['"""Runs that `fbvm prove` has found."""', "", "from fbvm import Plc, compile_files", "",
             f"FILES = [{', '.join(repr(str(file)) for file in files)}]"]  # fmt: skip
    used: set[str] = set()
    for verdict in verdicts:
        if verdict.run is not None:
            name = _test_name(verdict, used)
            lines += ["", "", f"def {name}():", f"    image = compile_files(FILES{given}, runnable=True).image",
                      f"    plc = Plc(image, cycle_ns={verdict.run.cycle_ns:_})", *_statements(verdict, verdict.run)]  # fmt: skip
    return "\n".join(lines) + "\n"


def _test_name(verdict: Verdict, used: set[str]) -> str:
    words = "_".join(re.findall(r"\w+", str(verdict.question).lower()))[:60].rstrip("_")
    name, number = f"test_{words}", 2
    while name in used:
        name, number = f"test_{words}_{number}", number + 1
    used.add(name)
    return name


def _statements(verdict: Verdict, run: Run) -> list[str]:
    """The writes of each scan and the scans between them; the last scan is asked for the property."""
    if verdict.question.kind == WITHIN:
        return _awaiting(verdict, run)
    lines: list[str] = []
    waiting = 0
    for number, writes in enumerate(run.writes):
        if writes and waiting:
            lines.append(f"    plc.run(scans={waiting})")
            waiting = 0
        lines += [f"    plc.write({place.name!r}, {value!r})" for place, value in writes.items()]
        waiting += number < len(run.writes) - 1
    if waiting:
        lines.append(f"    plc.run(scans={waiting})")
    question = verdict.question
    if question.kind == NO_TRAP:
        return [*lines, "    assert plc.scan() is None"]
    sign = "==" if question.kind in (ALWAYS, REACH) else "!="
    return [*lines, f"    assert plc.run(scans=1, until={question.text!r}) {sign} 'until'"]


def _awaiting(verdict: Verdict, run: Run) -> list[str]:
    """The scans of a run in which an answer is awaited, with what each of the last ones is asked."""
    question = verdict.question
    first = run.scans - 1 - question.waiting_scans(run.cycle_ns)
    lines = ["    answers = []"]
    for number, writes in enumerate(run.writes):
        lines += [f"    plc.write({place.name!r}, {value!r})" for place, value in writes.items()]
        ended = f"plc.run(scans=1, until={question.text!r})"
        lines.append(f"    answers.append({ended})" if number >= first else "    plc.scan()")
    return [*lines, "    assert 'until' in answers"]
