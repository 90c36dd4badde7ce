"""Charts as drawings: steps, actions, transitions, ways that part and meet, jumps, and what a scan did."""

from __future__ import annotations

import random
import re
from collections.abc import Callable

import pytest
from growth import assert_within_s, least_s
from sfc_model import Chart, random_chart, text

from fbvm.code.compiler import compile_text
from fbvm.code.image import SfcPicture
from fbvm.record.draw import sfc_text as drawing
from fbvm.record.draw.ladder_svg import ladder_svg
from fbvm.record.draw.sfc_text import ChartState, sfc_surface, sfc_text
from fbvm.syntax.ladder.drawing.box_lines import Surface

BATCH = """
PROGRAM Main
VAR start, full, hot, empty, valve, heater, pump : BOOL; batches : INT; END_VAR
INITIAL_STEP Idle: END_STEP
TRANSITION FROM Idle TO (Filling, Heating) := start; END_TRANSITION
STEP Filling: valve(N); END_STEP
STEP Heating: heater(L, T#5s, hot); Count(P1); END_STEP
TRANSITION done (PRIORITY := 1) FROM (Filling, Heating) TO Draining := full AND hot; END_TRANSITION
STEP Draining: pump(N); END_STEP
TRANSITION FROM Draining TO Idle := empty; END_TRANSITION
ACTION Count: batches := batches + 1; END_ACTION
END_PROGRAM
"""
CHART = """\
                 ╔══════╗
                 ║ Idle ║
                 ╚═══╤══╝
                     │
                    ╶┼╴ start
                     │
     ══╤═════════════╧══════════════╤══
  ┌────┴────┐  ┌───┬───────┐   ┌────┴────┐  ┌────────┬────────┬─────┐
  │ Filling ├──┤ N │ valve │   │ Heating ├──┤ L T#5s │ heater │ hot │
  └────┬────┘  └───┴───────┘   └────┬────┘  ├────────┼────────┼─────┤
       │                            │       │ P1     │ Count  │     │
       │                            │       └────────┴────────┴─────┘
     ══╧═════════════╤══════════════╧══
                     │
                    ╶┼╴ (1) done: full AND hot
                     │
               ┌─────┴────┐  ┌───┬──────┐
               │ Draining ├──┤ N │ pump │
               └─────┬────┘  └───┴──────┘
                     │
                    ╶┼╴ empty
                     │
                     └► Idle
"""
SELECTION = """\
     ╔═════╗
     ║ One ║
     ╚══╤══╝
   ┌────┴─────┐
   │          │
  ╶┼╴ a      ╶┼╴ b
   │          │
┌──┴──┐       │
│ Two │       │
└──┬──┘       │
   │          │
  ╶┼╴ TRUE    │
   │          │
   └────┬─────┘
    ┌───┴───┐
    │ Three │
    └───┬───┘
        │
       ╶┼╴ a
        │
        └► One
"""


def picture(source: str) -> SfcPicture:
    compilation = compile_text(source, lint=False)
    assert compilation.image is not None, [d.render() for d in compilation.diagnostics]
    return compilation.image.charts[0]


def test_simultaneous_sequences_stand_between_double_lines() -> None:
    assert sfc_text(picture(BATCH)) == CHART.splitlines()


def test_a_scan_shows_its_active_steps_and_what_became_of_conditions() -> None:
    lines = sfc_text(picture(BATCH), seen=ChartState(frozenset({3}), {1: True}))
    assert "● Draining" in "\n".join(lines) and "● Idle" not in "\n".join(lines)
    assert any("╺╋╸ (1) done: full AND hot → TRUE" in line for line in lines)
    waiting = "\n".join(sfc_text(picture(BATCH), seen=ChartState(frozenset({1, 2}), {1: False})))
    assert "╶┼╴ (1) done: full AND hot → FALSE" in waiting and waiting.count("●") == 2


def test_selections_part_and_meet_at_single_lines() -> None:
    assert sfc_text(picture("""
        PROGRAM Main
        VAR a, b : BOOL; END_VAR
        INITIAL_STEP One: END_STEP
        TRANSITION FROM One TO Two := a; END_TRANSITION
        TRANSITION FROM One TO Three := b; END_TRANSITION
        STEP Two: END_STEP
        TRANSITION FROM Two TO Three := TRUE; END_TRANSITION
        STEP Three: END_STEP
        TRANSITION FROM Three TO One := a; END_TRANSITION
        END_PROGRAM
    """)) == SELECTION.splitlines()


BRANCHES = """PROGRAM Main
VAR a : BOOL; END_VAR
INITIAL_STEP S: END_STEP
TRANSITION FROM S TO (S1, S2, S3, S4) := a; END_TRANSITION
STEP S1: END_STEP STEP S2: END_STEP STEP S3: END_STEP STEP S4: END_STEP
TRANSITION FROM (S1, S2, S3, S4) TO S := a; END_TRANSITION
END_PROGRAM"""


def test_wide_charts_are_broken_up() -> None:
    one = picture(BATCH)
    for width in (60, 40, 30):
        lines = sfc_text(one, width)
        assert max(map(len, lines)) <= width or width < 50
    assert "done: full AND hot" in "\n".join(sfc_text(one, 40))


def test_branches_are_drawn_apart_until_the_chart_fits() -> None:
    one, seen = picture(BRANCHES), set[str]()
    for width in (28, 29, 34, 35):
        lines = sfc_text(one, width)
        widest = max(map(len, lines))
        seen.add("\n".join(lines))
        assert widest > width or lines == sfc_text(one, widest), "as wide as it is, it needs no more room"
    assert len(seen) > 3


class _Strict(Surface):
    """A surface on which no text may cover another one."""

    def write(self, x: int, y: int, text: str) -> None:
        assert not any((x + at, y) in self.texts for at in range(len(text))), f"{text} covers something"
        super().write(x, y, text)


@pytest.mark.slow
@pytest.mark.parametrize("width", [200, 60])
def test_every_chart_has_a_drawing(width: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drawing, "Surface", _Strict)
    for seed in range(40):
        chart = random_chart(random.Random(seed))
        chart = Chart(chart.steps, chart.ways, chart.uses if seed % 2 else ())
        lines = sfc_text(picture(text(chart)), width)
        drawn = "\n".join(lines)
        assert len(re.findall("[╶╺][┼╋][╴╸]", drawn)) == len(chart.ways), seed
        for step in range(chart.steps):
            assert len(re.findall(rf"[│║] s{step} [│║├╟]", drawn)) == 1, f"s{step} of {seed}\n{drawn}"


def test_a_picture_has_the_same_text() -> None:
    surface = sfc_surface(picture(BATCH), 80, ChartState(frozenset({1}), {0: True}))
    svg = ladder_svg([("PROGRAM Main", surface)])
    assert all(f">{word}<" in svg for word in ("PROGRAM Main", "heater", "L T#5s")) and 'class="power"' in svg


@pytest.mark.slow
def test_the_time_of_a_drawing_grows_with_its_simultaneous_branches() -> None:
    def prepared(count: int) -> Callable[[], object]:
        steps, names = "".join(f"STEP P{at}: END_STEP " for at in range(count)), ", ".join(f"P{at}" for at in range(count))
        moves = f"TRANSITION FROM Z TO ({names}) := x; END_TRANSITION TRANSITION FROM ({names}) TO Z := x; END_TRANSITION"
        image = compile_text(f"PROGRAM Main VAR x : BOOL; END_VAR INITIAL_STEP Z: END_STEP {steps}{moves} END_PROGRAM").image
        assert image is not None
        return lambda: sfc_text(image.charts[0], 80)

    assert_within_s(prepared(160), 9 * least_s(prepared(40)))
