"""Verdicts about random programs: what is proved is never broken by random runs, and every run that is found breaks the property.

The properties are clauses over the program's own variables, of which some hold always, some never, some now and then."""

from __future__ import annotations

from random import Random

import pytest
from depth import times

from fbvm.code.compiler import compile_text
from fbvm.code.image import Image
from fbvm.machine.plc import Plc
from fbvm.prove.encoding.cells import BIT, NUMBER, Cell
from fbvm.prove.encoding.execution import Refused
from fbvm.prove.prover import Limits, prove
from fbvm.prove.question import NEVER, NO_TRAP, Question
from fbvm.prove.runs import InputWriter, Judge, RandomInputs, repeated

pytestmark = pytest.mark.slow
INPUTS = ("I0", "I1", "I2")
FLAGS = ("F0", "F1", "F2", "F3")
NUMBERS = ("N0", "N1")
PROGRAMS, RUNS, SCANS = 12, 4, 60
"""Programs, random runs of each that is proved, and scans of a run; 300 programs and more with --deep."""

FREE, LONGEST_NS = 3, 40_000_000
"""One program of so many is proved for any time from 10 ms to this between two scans."""


class Maker:
    """Writes one program over BOOL inputs, flags, small numbers, an array, timers and counters."""

    def __init__(self, seed: int) -> None:
        self.random = Random(seed)

    def text(self) -> str:
        body = "".join(self.statement(2) for _ in range(self.random.randint(6, 16)))
        self.body = body
        inputs = "".join(f"    {name} AT %IX0.{bit} : BOOL;\n" for bit, name in enumerate(INPUTS))
        return (f"PROGRAM Main\nVAR\n{inputs}    In AT %IW2 : INT;\n    {', '.join(FLAGS)} : BOOL;\n"
                f"    {', '.join(NUMBERS)} : INT;\n    a : ARRAY [0..3] OF INT;\n"
                f"    t : TON;\n    c : CTU;\n    e : R_TRIG;\nEND_VAR\n{body}END_PROGRAM\n")  # fmt: skip

    def condition(self, depth: int) -> str:
        if depth == 0 or self.random.random() < 0.3:
            name = self.random.choice([*INPUTS, *FLAGS, "t.Q", "c.Q", "e.Q"])
            comparison = f"{self.number(0)} {self.random.choice(['<', '=', '>'])} {self.number(0)}"
            return self.random.choice([name, f"NOT {name}", comparison])
        return f"({self.condition(depth - 1)} {self.random.choice(['AND', 'OR', 'XOR'])} {self.condition(depth - 1)})"

    def number(self, depth: int) -> str:
        if depth == 0 or self.random.random() < 0.4:
            return self.random.choice([*NUMBERS, "In", "a[1]", str(self.random.randint(0, 9))])
        sign = self.random.choice(["+", "-", "MOD 7 +"])
        return f"({self.number(depth - 1)} {sign} {self.number(depth - 1)})"

    def statement(self, depth: int) -> str:
        kind = self.random.randrange(9 if depth else 4)
        if kind < 2:
            return f"{self.random.choice(FLAGS)} := {self.condition(2)};\n"
        if kind < 4:
            return f"{self.random.choice(NUMBERS)} := {self.number(1)};\n"
        if kind < 6:
            otherwise = f"ELSE\n{self.statement(depth - 1)}" if self.random.random() < 0.5 else ""
            return f"IF {self.condition(1)} THEN\n{self.statement(depth - 1)}{otherwise}END_IF\n"
        index = f"LIMIT(0, {self.random.choice([*NUMBERS, 'In'])}, {self.random.choice([3, 3, 4])})"
        return self.random.choice([
            f"t(IN := {self.condition(1)}, PT := T#{self.random.randint(1, 4)}0ms);\n",
            f"c(CU := {self.condition(1)}, R := {self.condition(0)}, PV := {self.random.randint(1, 4)});\n",
            f"e(CLK := {self.condition(1)});\n",
            f"a[{index}] := {self.number(1)};\n",
        ])  # fmt: skip

    def question(self) -> Question:
        if self.random.random() < 0.2:
            return Question(NO_TRAP)
        written = [name for name in FLAGS if f"{name} :=" in self.body]
        written += [f"{block}.Q" for block in "tc" if f"{block}(" in self.body]
        name = self.random.choice(written or FLAGS[:1])
        other = self.random.choice([f"Main.{each}" for each in FLAGS] + ["Main.N0 > 5", "Main.t.ET >= T#30ms", "Main.c.CV > 3"])
        return Question(NEVER, f"Main.{name} AND NOT ({other})")


def broken_at_random(image: Image, question: Question, seed: int) -> bool:
    """Whether random runs break a property."""
    judge = Judge.of(image, question)
    for number in range(RUNS * times(1)):
        plc, random = Plc(image, engine="python"), Random(f"{seed} {number}")
        area = image.layout.areas["I"].offset
        writer = InputWriter(plc, [*(Cell(area, 1, BIT, bit) for bit in range(len(INPUTS))), Cell(area + 4, 2, NUMBER)])
        values = RandomInputs(writer, random)
        for _ in range(SCANS):
            for cell in writer.cells:
                if random.random() < 0.3:
                    writer.write(cell, values.value(cell))
            plc.scan()
            if judge.met(plc):
                return True
            if plc.trap:
                break
    return False


def test_verdicts_about_random_programs() -> None:
    words: dict[str, int] = {}
    for seed in range(PROGRAMS * times(1, 25)):
        maker = Maker(seed)
        text = maker.text()
        compilation = compile_text(text, lint=False)
        assert compilation.image is not None, f"{text}\n{[d.render() for d in compilation.diagnostics]}"
        image, question = compilation.image, maker.question()
        try:
            limits = Limits(scans=80, simulated_scans=60, longest_ns=LONGEST_NS if seed % FREE == 0 else 0)
            verdict = prove(image, question, limits)  # raises for a run that the engine does not do
        except Refused as refused:
            assert "does not trap, for longer than" in refused.reason, text
            continue
        words[verdict.word] = words.get(verdict.word, 0) + 1
        if verdict.word == "proved":
            assert not broken_at_random(image, question, seed), f"{question}\n{text}"
        if verdict.run is not None:
            plc = Plc(image, engine="python")
            repeated(plc, verdict.run)
            assert Judge.of(image, question).met(plc), f"{question}\n{text}"
    assert words.get("proved", 0) >= PROGRAMS // 6 and words.get("broken", 0) >= PROGRAMS // 6, words
