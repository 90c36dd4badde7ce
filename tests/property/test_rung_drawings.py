"""Rungs at random: drawn at any width and read back they are the same instructions, and fmt draws the same again."""

from __future__ import annotations

from random import Random

import pytest
from depth import times
from hypothesis import given, settings
from hypothesis import strategies as st

from fbvm.syntax.ladder.drawing.box_lines import DOWN, LEFT, RIGHT, UP
from fbvm.syntax.ladder.drawing.diagram import Box, Coil, Contact, Parallel, Pin, Point, Series, StepText, diagram
from fbvm.syntax.ladder.drawing.drawing import drawn, rung_surface, rung_text
from fbvm.syntax.ladder.drawing.steps import steps
from fbvm.syntax.ladder.drawing.widths import Annotations
from fbvm.syntax.ladder.mnemonics import read_rungs
from fbvm.syntax.ladder.text import rung_lines

NAMES = ("a", "Start", "0.00", "W3.15", "Motor_running", "T0010", "P_On", "list[3]", "Pump.Ready", "P_First_Cycle_Task")
MARKS = (" ", " ", " ", "/", "↑", "↓", "/↑", "!", "!/")
COMPARED = ("=", "<>", ">=S", "<L", "TST")
OPERANDS = ("#1", "&200", "D0", "-5", "@D10", "+1.5", "Quantity")
COILS = (" ", " ", "/", "S", "R", "↑", "↓", "@S", "!")
INSTRUCTIONS = (("MOV", 2), ("@MOV", 2), ("++", 1), ("END", 0), ("+B", 3), ("TIM", 2))
COUNTERS = (("CNT", 2, 2), ("KEEP", 1, 2), ("CNTR", 2, 3))


class Maker:
    """Diagrams of a size."""

    def __init__(self, random: Random) -> None:
        self.random = random

    def bar(self) -> Point:
        return Point(Series(), [self.point(2) for _ in range(self.random.choice((1, 1, 1, 2)))])

    def point(self, depth: int) -> Point:
        made = Point(self.series(2, self.random.randint(1, 5)))
        for _ in range(self.random.choice((1, 1, 1, 2, 3))):
            made.outs.append(self.out(depth))
        if len(made.outs) == 1 and isinstance(made.outs[0], Point):
            made.outs.append(self.coil())
        return made

    def out(self, depth: int) -> Coil | Box | Point:
        kind = self.random.random()
        if depth and kind < 0.3:
            return self.point(depth - 1)
        if kind < 0.5:
            name, count = self.random.choice(INSTRUCTIONS)
            return Box(-1, name, self.some(OPERANDS, count))
        if kind < 0.6:
            name, count, inputs = self.random.choice(COUNTERS)
            return Box(-1, name, self.some(OPERANDS, count), tuple(self.series(1, 3) for _ in range(inputs - 1)))
        if kind < 0.67:
            return self.joined()
        return self.coil()

    def joined(self) -> Point:
        """A path to a box whose lower inputs begin where the path does."""
        path = self.series(1, 2) if self.random.random() < 0.8 else Series()
        outs: list[Coil | Box | Point] = [self.coil()] if path.parts and self.random.random() < 0.3 else []
        name, count, inputs = self.random.choice(COUNTERS)
        lower = [Series(self.series(1, 3).parts, True) for _ in range(inputs - 1)]
        return Point(path, [*outs, Box(-1, name, self.some(OPERANDS, count), tuple(lower))])

    def coil(self) -> Coil:
        return Coil(-1, self.random.choice(COILS), self.some(NAMES, 1))

    def some(self, texts: tuple[str, ...], count: int) -> tuple[str, ...]:
        return tuple(self.random.choice(texts) for _ in range(count))

    def series(self, depth: int, most: int) -> Series:
        parts = [self.part(depth) for _ in range(self.random.randint(1, most))]
        if isinstance(parts[0], Box):
            parts.insert(0, self.contact())
        return Series(parts)

    def part(self, depth: int) -> Contact | Box | Parallel:
        kind = self.random.random()
        if depth and kind < 0.3:
            branches = [self.series(depth - 1, 3) for _ in range(self.random.randint(2, 4))]
            for branch in branches:
                if len(branch.parts) == 1 and isinstance(branch.parts[0], Parallel):
                    branch.parts.append(self.contact())
            return Parallel(branches)
        if kind < 0.36:
            return Box(-1, self.random.choice(("NOT", "UP", "DOWN")), through=True)
        if kind < 0.42:
            pins = [Pin(name, self.random.choice(OPERANDS + NAMES), name in "QE")
                    for name in self.random.sample(("IN", "PT", "Q", "E", "Register_Address"), self.random.randint(0, 4))]
            return Box(-1, "TON", (), (), True, self.random.choice(("t", "Delay_of_the_pump")), tuple(pins),
                       (self.random.choice(("EN", "CU")),), self.random.choice(("ENO", "QU")))
        if kind < 0.5:
            return Contact(-1, self.random.choice(COMPARED), self.some(OPERANDS, 2))
        return self.contact()

    def contact(self) -> Contact:
        return Contact(-1, self.random.choice(MARKS), self.some(NAMES, 1))


def texts(bar: Point) -> list[StepText]:
    return [(step.prefix, step.mnemonic, step.operands) for step in steps(bar)]


def read(lines: list[str]) -> tuple[list[StepText], list[str]]:
    """What a drawing says, and how fmt writes it."""
    wrong: list[object] = []
    text = "\n".join(lines) + "\n"
    rungs = read_rungs(text, 0, len(text), lambda *message: wrong.append(message))
    assert wrong == [], "\n".join([*lines, str(wrong)])
    (rung,) = rungs
    found = [(line.step.prefix, line.step.mnemonic, line.step.operands) for line in rung.lines]
    return found, rung_lines([rung])


@pytest.mark.slow
@settings(deadline=None, max_examples=times(60))
@given(st.integers(0, 2**32), st.integers(24, 160), st.booleans())
def test_what_is_drawn_is_read_back(seed: int, width: int, with_places: bool) -> None:
    said = texts(Maker(Random(seed)).bar())
    places = dict.fromkeys(NAMES[1:2] + NAMES[4:5], "100.00") if with_places else {}
    lines = rung_surface(said, width, Annotations(places=lambda symbol: places.get(symbol, ""))).rows()
    found, again = read(["    " + line for line in lines])
    assert found == said, "\n".join(lines)
    assert [line.removeprefix("    ") for line in again] == lines


@pytest.mark.slow
@settings(deadline=None, max_examples=times(60))
@given(st.integers(0, 2**32), st.integers(24, 160))
def test_power_in_a_drawing_is_not_read(seed: int, width: int) -> None:
    random = Random(seed)
    said = texts(Maker(random).bar())
    seen = {step: [random.random() < 0.8] for step in range(len(said))}
    lines = rung_text(said, width, Annotations(seen, values=lambda step, operand: "12" if operand[0] in "DQ" else ""))
    assert read(lines)[0] == said, "\n".join(lines)


@pytest.mark.slow
@settings(deadline=None, max_examples=times(60))
@given(st.integers(0, 2**32), st.integers(24, 160))
def test_lines_meet_and_rails_are_straight(seed: int, width: int) -> None:
    surface = drawn(Maker(Random(seed)).bar(), width)
    rows = surface.rows()
    assert len({len(row) for row in rows}) == 1
    assert {row[0] for row in rows} <= set("│├") and {row[-1] for row in rows} <= set("│┤")
    for (x, y), ways in surface.lines.items():
        for way, (dx, dy, back) in {LEFT: (-1, 0, RIGHT), RIGHT: (1, 0, LEFT), UP: (0, -1, DOWN), DOWN: (0, 1, UP)}.items():
            if ways[way] and (x, y) not in surface.texts and 0 <= y + dy < len(rows):
                beside = surface.lines.get((x + dx, y + dy))
                assert beside is not None and beside[back], f"{x} {y}\n" + "\n".join(rows)


@pytest.mark.slow
@settings(deadline=None, max_examples=times(30))
@given(st.integers(0, 2**32), st.integers(24, 160))
def test_a_drawing_that_is_wider_than_it_must_be_says_the_same(seed: int, least: int) -> None:
    said = texts(Maker(Random(seed)).bar())
    lines = rung_surface(said, 60, least=least).rows()
    assert {len(line) >= least for line in lines} == {True} and len(set(map(len, lines))) == 1
    assert read(lines)[0] == said, "\n".join(lines)


@pytest.mark.slow
@settings(deadline=None, max_examples=times(60))
@given(st.integers(0, 2**32))
def test_a_diagram_is_what_its_instructions_say(seed: int) -> None:
    said = texts(Maker(Random(seed)).bar())
    assert texts(diagram(said)) == said
