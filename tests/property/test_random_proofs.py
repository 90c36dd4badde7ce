"""Verdicts about random programs: what is proved is never broken by random runs, and every run that is found breaks the property.

The properties are clauses over the program's own variables, of which some hold always, some never, some now and then."""

from __future__ import annotations

from random import Random

import pytest
from depth import times
from random_runs import Broken, RandomRuns, with_drawing

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.prove.encoding.execution import Refused
from fbvm.prove.prover import Limits, prove
from fbvm.prove.question import NEVER, NO_TRAP, PROVED, Question, Verdict
from fbvm.prove.runs import Judge, repeated

pytestmark = pytest.mark.slow
INPUTS = ("I0", "I1", "I2")
FLAGS = ("F0", "F1", "F2", "F3")
NUMBERS = ("N0", "N1")
PROGRAMS, RUNS, SCANS = 12, 4, 60
"""Programs, random runs of each, and scans of a run; 300 programs and 100,000 runs of each with --deep."""
CYCLE_NS = 10_000_000

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


def broken_at_random(text: str, question: Question, scans: int, longest_ns: int) -> Broken | None:
    """A random run of at most so many scans that breaks a property; with --deep of 100,000 runs, in machine code."""
    runs = RandomRuns(with_drawing(text, INPUTS, "In", question.text.replace("Main.", "")), times(1) > 1, CYCLE_NS, longest_ns)
    found = (runs.first_broken(number, scans, question.kind == NO_TRAP) for number in range(times(RUNS, 25_000)))
    return next(filter(None, found), None)


def clear_scans(verdict: Verdict) -> int:
    """In how many scans from power-on on no run breaks the property, by the verdict."""
    if verdict.run is not None:
        return verdict.run.scans - 1 if verdict.run.is_shortest else 0
    return SCANS if verdict.word == PROVED else min(verdict.scans, SCANS)


@pytest.mark.parametrize("first", range(0, times(PROGRAMS, 25), PROGRAMS))
def test_verdicts_about_random_programs(first: int) -> None:
    words: dict[str, int] = {}
    for seed in range(first, first + PROGRAMS):
        maker = Maker(seed)
        text = maker.text()
        compilation = compile_text(text, lint=False)
        assert compilation.image is not None, f"{text}\n{[d.render() for d in compilation.diagnostics]}"
        image, question = compilation.image, maker.question()
        longest_ns = LONGEST_NS if seed % FREE == 0 else 0
        try:
            limits = Limits(CYCLE_NS, scans=80, simulated_scans=60, longest_ns=longest_ns)
            verdict = prove(image, question, limits)  # raises for a run that the engine does not do
        except Refused as refused:
            assert "does not trap, for longer than" in refused.reason, text
            continue
        words[verdict.word] = words.get(verdict.word, 0) + 1
        if clear := clear_scans(verdict):
            found = broken_at_random(text, question, clear, longest_ns)
            assert found is None, f"{question}: {verdict.word} {verdict.how}, broken by {found}\n{text}"
        if verdict.run is not None:
            for engine in ("python", "native"):
                plc = Plc(image, engine=engine)
                repeated(plc, verdict.run)
                assert Judge.of(image, question).met(plc), f"{question} on {engine}\n{text}"
    assert words.get("proved", 0) >= PROGRAMS // 6 and words.get("broken", 0) >= PROGRAMS // 6, words


def test_a_program_that_draws_its_inputs_breaks_what_can_be_broken() -> None:
    head = Maker(0).text().split("END_VAR\n")[0]
    text = f"{head}END_VAR\n    IF I0 AND NOT I1 AND In = 3 THEN N0 := N0 + 1; END_IF\nEND_PROGRAM\n"

    def runs(broken: str, is_native: bool, longest_ns: int) -> list[Broken | None]:
        made = RandomRuns(with_drawing(text, INPUTS, "In", broken), is_native, CYCLE_NS, longest_ns)
        return [made.first_broken(seed, SCANS, False) for seed in range(6)]

    for longest_ns in (0, LONGEST_NS):
        some = runs("N0 > 2", False, longest_ns)
        assert any(some) and all(each.scan > 2 for each in some if each)
        assert runs("N0 > 2", True, longest_ns) == some
        assert not any(runs("N0 < 0", True, longest_ns))
