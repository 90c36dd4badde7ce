"""Charts of all shapes beside their drawings, wide and narrow, at rest and in a scan, word for word.  `FBVM_REWRITE=1 pytest` of
this file writes the texts anew; read the difference before you keep it."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path

import pytest

from fbvm.code.compiler import compile_text
from fbvm.code.image import SfcPicture
from fbvm.record.draw.sfc_text import ChartState, sfc_text

TEXTS = Path(__file__).parent / "texts"
CHARTS = {
    "a cycle": "A>B:a B>A:b", "three in a row": "A>B:a B>C:b C>D:c D>A:d", "no way back": "A>B:a B>C:b",
    "two ways that meet": "A>B:a A>C:b B>D:c C>D:d D>A:e", "a way that is left out": "A>B:a A>C:b B>C:c C>A:d",
    "three ways that meet": "A>B:a A>C:b A>D:c B>E:d C>E:e D>E:f E>A:g",
    "two of three meet": "A>B:a A>C:b A>D:c B>E:d C>E:e D>A:f E>A:g",
    "ways that meet one after the other": "A>B:a A>C:b A>D:c B>E:d C>E:e E>F:f D>F:g F>A:a",
    "the outer ones meet": "A>B:a A>C:b A>D:c B>E:d D>E:e C>F:f E>F:g F>A:a", "at once": "A>B,C:a B,C>D:b D>A:c",
    "three at once": "A>B,C,D:a B,C,D>E:b E>A:c", "at once, and one goes on": "A>B,C:a B>D:b C,D>E:c E>A:d",
    "at once within a choice": "A>B:a A>C,D:b B>E:c C,D>E:d E>A:e",
    "a choice within": "A>B,C:a B>D:b B>E:c D>F:d E>F:e C,F>G:f G>A:g",
    "one leaves": "A>B,C:a B>D:b C>E:c D,E>A:d B>A:e", "at once without a meeting": "A>B,C:a B>D:b C>E:c D>A:d E>A:e",
    "back into the middle": "A>B:a B>C:b C>B:c C>A:d", "ways out of a loop": "A>B:a B>A:b B>C:c C>B:d C>D:e D>A:f",
    "a choice of four": "A>B:a A>C:b A>D:c A>E:d B>A:e C>A:f D>A:g E>A:a",
    "joined by two ways": "A>B,C:a B>D:b C>D:c D>A:d",
    "long conditions": "A>B:a_AND_b_OR_c_AND_NOT_d_OR_e_XOR_f "
        "B>C:a_AND_NOT_b_AND_c_AND_d_AND_e_AND_f A>C:g_OR_a C>A:NOT_(a_OR_b_OR_c_OR_d)",
}  # fmt: skip
ACTIONS = {"B": "Count(N); on(S);", "C": "on(L, T#2s);", "E": "on(R);"}
STATES = {"at rest": None, "in a scan": ChartState(frozenset((0, 2)), {0: True, 2: False, 3: True}),
          "in another one": ChartState(frozenset((1,)), {1: True, 4: True, 5: False})}  # fmt: skip


def check(name: str, lines: list[str]) -> None:
    path, text = TEXTS / name, "\n".join(lines) + "\n"
    if os.environ.get("FBVM_REWRITE"):
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8")


@cache
def picture(chart: str) -> SfcPicture:
    """A chart whose transitions are written `FROM,FROM>TO,TO:condition`; A is its first step, every third transition has a name,
    those that leave one step have priorities if there are four of them."""
    ways = [(*way.partition(":")[0].split(">"), way.partition(":")[2].replace("_", " ")) for way in chart.split()]
    names = sorted({name for first, last, _ in ways for name in f"{first},{last}".split(",")})  # of steps: SA, SB ..
    steps = [f"{'INITIAL_STEP' if name == 'A' else 'STEP'} S{name}: {ACTIONS.get(name, '') if len(names) < 7 else ''} END_STEP"
             for name in names]  # fmt: skip
    lines = []
    for number, (first, last, condition) in enumerate(ways):
        sides = [f"(S{side.replace(',', ', S')})" if "," in side else f"S{side}" for side in (first, last)]
        priority = f"(PRIORITY := {9 - number})" if sum(way[0] == first for way in ways) > 3 else ""
        name = f"way{number}" if number % 3 == 1 else ""
        lines.append(f"TRANSITION {name} {priority} FROM {sides[0]} TO {sides[1]} := {condition}; END_TRANSITION")
    text = "\n".join(["PROGRAM Main VAR a, b, c, d, e, f, g, on : BOOL; END_VAR", *steps, *lines, "ACTION Count: ; END_ACTION",
                      "END_PROGRAM"])  # fmt: skip
    made = compile_text(text)
    assert made.image is not None, [found.render() for found in made.errors]
    return made.image.charts[0]


@pytest.mark.slow
@pytest.mark.parametrize(("width", "state"), [(120, "in a scan"), (44, "in another one"), (90, "at rest")])
def test_drawings_of_charts(width: int, state: str) -> None:
    lines = [line for name, chart in CHARTS.items() for line in (f"=== {name}", *sfc_text(picture(chart), width, STATES[state]))]
    check(f"charts {width} {state}.txt", lines)
