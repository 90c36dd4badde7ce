"""Random instruction lists do what an interpreter of single instructions does: current result, brackets, jumps and labels."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass

import pytest
from depth import times

from fbvm import Plc, compile_text

BITS = ("b0", "b1", "b2", "b3")
NUMBERS = ("n0", "n1", "n2", "n3")
LOGIC: dict[str, Callable[[bool, bool], bool]] = {
    "AND": lambda a, b: a and b, "OR": lambda a, b: a or b, "XOR": lambda a, b: a != b,
    "ANDN": lambda a, b: a and not b, "ORN": lambda a, b: a or not b, "XORN": lambda a, b: a == b,
    "&": lambda a, b: a and b, "&N": lambda a, b: a and not b,
}  # fmt: skip
ARITHMETIC: dict[str, Callable[[int, int], int]] = {
    "ADD": lambda a, b: a + b, "SUB": lambda a, b: a - b, "MUL": lambda a, b: a * b}  # fmt: skip
RELATIONS: dict[str, Callable[[int, int], bool]] = {
    "GT": lambda a, b: a > b, "GE": lambda a, b: a >= b, "EQ": lambda a, b: a == b,
    "NE": lambda a, b: a != b, "LE": lambda a, b: a <= b, "LT": lambda a, b: a < b,
}  # fmt: skip
CHOICES = ("load", "operate", "operate", "operate", "store", "store", "brackets", "jump", "latch", "return")
"""What a step of a random list may be."""
Line = tuple[str, str, str]
"""Label, operator, operand; each may be ""."""
Value = bool | int


def wrapped(value: int) -> int:
    return (value + 2**31) % 2**32 - 2**31


@dataclass
class Writer:
    """Writes a random list; `kind` is the type of the current result."""

    chance: random.Random
    kind: str = ""
    labels: int = 0

    def lines(self, count: int) -> list[Line]:
        made: list[Line] = [("", "LD", self.operand("bit"))]
        self.kind = "bit"
        waiting: list[tuple[int, str, str]] = []
        for at in range(count):
            for row in [row for row in waiting if row[0] <= at and row[2] == self.kind]:
                waiting.remove(row)
                made.append((row[1], "", ""))
            made += self.step(at, waiting)
        for _, label, kind in waiting:
            made += [*self.turn(kind), (label, "", "")]
        return [*made, *self.turn("bit"), ("", "ST", "b3")]

    def step(self, at: int, waiting: list[tuple[int, str, str]]) -> list[Line]:
        chosen = self.chance.choice(CHOICES)
        if chosen == "load":
            self.kind = self.chance.choice(("bit", "number"))
            return [("", "LD", self.operand(self.kind))]
        if chosen == "store":
            target = self.chance.choice(BITS if self.kind == "bit" else NUMBERS)
            return [("", self.chance.choice(("ST", "STN")) if self.kind == "bit" else "ST", target)]
        if chosen == "latch" and self.kind == "bit":
            return [("", self.chance.choice("SR"), self.chance.choice(BITS))]
        if chosen == "brackets":
            return self.brackets(self.chance.randint(1, 3))
        if chosen == "jump":
            self.labels += 1
            label = f"l{self.labels}"
            condition = self.chance.choice(("JMPC", "JMPCN")) if self.kind == "bit" else ""
            if condition:
                waiting.append((at + self.chance.randint(1, 6), label, self.kind))
                return [("", condition, label)]
            return []
        if chosen == "return" and self.kind == "bit" and self.chance.random() < 0.2:
            return [("", self.chance.choice(("RETC", "RETCN")), "")]
        return [self.operation()]

    def turn(self, kind: str) -> list[Line]:
        """What makes a current result of a type."""
        if self.kind == kind:
            return []
        self.kind = kind
        return [("", "GT", "3")] if kind == "bit" else [("", "LD", self.operand("number"))]

    def operation(self) -> Line:
        if self.kind == "bit":
            operator = self.chance.choice((*LOGIC, "NOT"))
            return "", operator, "" if operator == "NOT" else self.operand("bit")
        operator = self.chance.choice((*ARITHMETIC, *ARITHMETIC, *RELATIONS))
        if operator in RELATIONS:
            self.kind = "bit"
        return "", operator, self.operand("number")

    def brackets(self, depth: int) -> list[Line]:
        kind = self.kind
        operator = self.chance.choice(tuple(LOGIC if kind == "bit" else ARITHMETIC))
        made: list[Line] = [("", f"{operator} (", "")]
        inner = Writer(self.chance, kind)
        made.append(("", "LD", self.operand(kind)))
        for _ in range(self.chance.randint(0, 3)):
            if depth > 1 and self.chance.random() < 0.3:
                made += inner.brackets(depth - 1)
            else:
                made.append(inner.operation())
        made += [("", *line[1:]) for line in inner.turn(kind)]
        return [*made, ("", ")", "")]

    def operand(self, kind: str) -> str:
        if kind == "bit":
            return self.chance.choice((*BITS, *BITS, "TRUE", "FALSE"))
        return self.chance.choice((*NUMBERS, *NUMBERS, str(self.chance.randint(-5, 9))))


def interpret(lines: list[Line], memory: dict[str, Value]) -> None:
    """Executes a list instruction by instruction; changes `memory`."""
    labels = {label: at for at, (label, _, _) in enumerate(lines) if label}
    at = 0
    result: Value = False
    outer: list[tuple[str, Value]] = []

    def value(text: str) -> Value:
        if text in memory:
            return memory[text]
        return text == "TRUE" if text in ("TRUE", "FALSE") else int(text)

    def operated(operator: str, left: Value, right: Value) -> Value:
        if operator in ARITHMETIC:
            return wrapped(ARITHMETIC[operator](left, right))
        return RELATIONS[operator](left, right) if operator in RELATIONS else LOGIC[operator](bool(left), bool(right))

    while at < len(lines):
        _, operator, operand = lines[at]
        at += 1
        if operator == "LD":
            result = value(operand)
        elif operator in ("ST", "STN"):
            memory[operand] = not result if operator == "STN" else result
        elif operator in ("S", "R"):
            memory[operand] = operator == "S" if result else memory[operand]
        elif operator == "NOT":
            result = not result
        elif operator in ("JMPC", "JMPCN"):
            at = labels[operand] if bool(result) == (operator == "JMPC") else at
        elif operator in ("RETC", "RETCN"):
            at = len(lines) if bool(result) == (operator == "RETC") else at
        elif operator.endswith("("):
            outer.append((operator.split()[0], result))
        elif operator == ")":
            result = operated(*outer.pop(), result)
        elif operator:
            result = operated(operator, result, value(operand))


def text_of(lines: list[Line]) -> str:
    written = "\n".join(f"{label + ':' if label else ''} {operator} {operand}" for label, operator, operand in lines)
    return (f"PROGRAM Main\nVAR {', '.join(BITS)} : BOOL; {', '.join(NUMBERS)} : DINT; END_VAR\n{written}\nEND_PROGRAM\n")


def check(seed: int, engine: str) -> None:
    chance = random.Random(seed)
    lines = Writer(chance).lines(chance.randint(3, 30))
    text = text_of(lines)
    compilation = compile_text(text, lint=False)
    assert compilation.image, text + "\n".join(d.render() for d in compilation.diagnostics)
    plc = Plc(compilation.image, engine=engine)
    memory: dict[str, Value] = {**dict.fromkeys(BITS, False), **dict.fromkeys(NUMBERS, 0)}
    for _ in range(4):
        name = chance.choice((*BITS, *NUMBERS))
        memory[name] = chance.random() < 0.5 if name in BITS else chance.randint(-100, 100)
        plc.write(f"Main.{name}", memory[name])
        assert plc.scan() is None
        interpret(lines, memory)
        assert {each: plc.read(f"Main.{each}") for each in memory} == memory, f"seed {seed}\n{text}"


def test_a_few_lists() -> None:
    for seed in range(6):
        check(seed, "python")


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["python", "native"])
def test_lists_do_what_their_instructions_say(engine: str) -> None:
    for seed in range(times(150)):
        check(seed, engine)
