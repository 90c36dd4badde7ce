"""Verdicts for people: the sentence, what limits the answer, the chart of the run."""

from __future__ import annotations

from collections.abc import Iterator

from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.prove.cycle import show_passed
from fbvm.prove.question import Run, Verdict
from fbvm.prove.runs import repeated
from fbvm.record.draw.chart import draw
from fbvm.record.trace.recorder import Recorder


def headline(verdict: Verdict) -> str:
    """The verdict in one sentence."""
    return f"{verdict.question}: {verdict.word.upper()} {verdict.how}"


def details(image: Image, verdict: Verdict, width: int | None = None) -> Iterator[str]:
    """The lines below the sentence: what limits the answer, the run as a chart of `width` characters, the trap that ends it."""
    yield from (f"  {note}" for note in verdict.notes)
    if verdict.run is not None:
        if verdict.run.has_free_times and verdict.run.passed_ns:
            yield f"  times between its scans: {show_passed(verdict.run.passed_ns)}"
        yield from run_chart(image, verdict, verdict.run, width).splitlines()
        if verdict.run.writers:
            yield f"  written in its last scan by {' and '.join(verdict.run.writers)}"
        if verdict.run.trap is not None:
            yield f"  {verdict.run.trap}"


def run_chart(image: Image, verdict: Verdict, run: Run, width: int | None = None) -> str:
    """The chart of a run: the inputs that change, then what the property names; "" if there is neither."""
    plc = Plc(image, run.cycle_ns)
    inputs = (place.name for writes in run.writes for place in writes)
    names = dict.fromkeys([*inputs, *(place.name for place in verdict.places)])
    if not names:
        return ""
    recorder = Recorder(plc, names)
    repeated(plc, run)
    return str(draw(recorder.relabelled(verdict.question.prefix), width=width, ruler=True, compress=True))
