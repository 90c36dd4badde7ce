"""Random programs with __NEW and __DELETE do on every engine what the same objects do in Python."""

from __future__ import annotations

from dataclasses import dataclass, field
from random import Random

import pytest
from depth import times

from fbvm.code.compiler import compile_text
from fbvm.engine.native.engine import available
from fbvm.machine.plc import Plc

PARTS, PROGRAMS = 3, 1
SLOTS, STATEMENTS, SCANS = 6, 40, 3
BLOCKS = """\
VAR_GLOBAL total : DINT; END_VAR
INTERFACE I_Next
METHOD Next : DINT
END_METHOD
END_INTERFACE
{attribute 'enable_dynamic_creation'}
FUNCTION_BLOCK Plain IMPLEMENTS I_Next
VAR_INPUT v : DINT := 7; END_VAR
VAR at : POINTER_TO_OWN := ADR(v); END_VAR
METHOD FB_init : BOOL
VAR_INPUT bInitRetains, bInCopyCode : BOOL; a : DINT; END_VAR
    v := v + a;
END_METHOD
METHOD Next : DINT
    at^ := v * 3 + 1; Next := v;
END_METHOD
METHOD FB_exit : BOOL
VAR_INPUT bInCopyCode : BOOL; END_VAR
    total := total + v;
END_METHOD
END_FUNCTION_BLOCK
{attribute 'enable_dynamic_creation'}
FUNCTION_BLOCK Other EXTENDS Plain
VAR inner : Plain(a := 5); END_VAR
METHOD Next : DINT
    Next := SUPER^.Next() - inner.Next();
END_METHOD
END_FUNCTION_BLOCK
{attribute 'enable_dynamic_creation'}
FUNCTION_BLOCK Owner EXTENDS Plain
VAR child : POINTER TO Plain; END_VAR
METHOD FB_init : BOOL
VAR_INPUT bInitRetains, bInCopyCode : BOOL; a : DINT; END_VAR
    child := __NEW(Other(a := a * 2));
END_METHOD
METHOD Next : DINT
    Next := v + child^.Next();
END_METHOD
METHOD FB_exit : BOOL
VAR_INPUT bInCopyCode : BOOL; END_VAR
    __DELETE(child); total := total - 1;
END_METHOD
END_FUNCTION_BLOCK
""".replace("at : POINTER_TO_OWN", "own : POINTER TO DINT").replace("at^", "own^")


def wrapped(value: int) -> int:
    """A number as a DINT keeps it."""
    return (value + (1 << 31)) % (1 << 32) - (1 << 31)


class World:
    """What the blocks of a program do, in Python."""

    def __init__(self) -> None:
        self.total = 0


@dataclass
class Plain:
    """An instance."""

    world: World
    given: int
    v: int = 7
    parts: list[Plain] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.v = wrapped(self.v + self.given)

    def next(self) -> int:
        self.v = wrapped(self.v * 3 + 1)
        return self.v

    def exit(self) -> None:
        self.world.total = wrapped(self.world.total + self.v)


class Other(Plain):
    def __post_init__(self) -> None:
        super().__post_init__()
        self.parts = [Plain(self.world, 5)]

    def next(self) -> int:
        return wrapped(super().next() - self.parts[0].next())

    def exit(self) -> None:
        self.parts[0].exit()
        super().exit()


class Owner(Plain):
    def __post_init__(self) -> None:
        super().__post_init__()
        self.parts = [Other(self.world, wrapped(self.given * 2))]

    def next(self) -> int:
        return wrapped(self.v + self.parts[0].next())

    def exit(self) -> None:
        self.parts[0].exit()
        self.world.total = wrapped(self.world.total - 1)
        super().exit()


KINDS: dict[str, type[Plain]] = {"Plain": Plain, "Other": Other, "Owner": Owner}


class Program:
    """A random program, of statements that fit what is there when they are executed, and what comes of it."""

    def __init__(self, random: Random) -> None:
        self.random, self.world, self.r = random, World(), 0
        self.made: dict[int, Plain] = {}
        self.rows: dict[int, list[int]] = {}
        self.lines = [self._line() for _ in range(STATEMENTS)]
        for slot in sorted(self.made):  # each scan begins without any
            self.lines.append(f"__DELETE(p[{slot}]);")
            self.made.pop(slot).exit()
        self.lines += [f"__DELETE(b[{slot}]);" for slot in sorted(self.rows)]

    def _line(self) -> str:
        slot, number = self.random.randrange(SLOTS), self.random.randrange(-50, 50)
        if self.random.random() < 0.3:
            return self._row(slot, number)
        if slot not in self.made:
            name = self.random.choice(list(KINDS))
            self.made[slot] = KINDS[name](self.world, number)
            return f"p[{slot}] := __NEW({name}(a := {number}));"
        if self.random.random() < 0.35:
            self.made.pop(slot).exit()
            return f"__DELETE(p[{slot}]);"
        self.r = wrapped(self.r + self.made[slot].next())
        call = f"p[{slot}]^.Next()"
        return f"r := r + {call};" if self.random.random() < 0.5 else f"i := p[{slot}]^; r := r + i.Next();"

    def _row(self, slot: int, number: int) -> str:
        row = self.rows.get(slot)
        if row is None:
            count = self.random.randrange(1, 90)
            self.rows[slot] = [0] * count
            return f"b[{slot}] := __NEW(DINT, {count});"
        place = self.random.randrange(len(row))
        if self.random.random() < 0.3:
            del self.rows[slot]
            return f"__DELETE(b[{slot}]);"
        row[place] = wrapped(row[place] + number)
        self.r = wrapped(self.r + row[place])
        return f"b[{slot}][{place}] := b[{slot}][{place}] + {number}; r := r + b[{slot}][{place}];"

    @property
    def text(self) -> str:
        pointers = f"p : ARRAY[0..{SLOTS - 1}] OF POINTER TO Plain; b : ARRAY[0..{SLOTS - 1}] OF POINTER TO DINT;"
        lines = "\n".join(self.lines)
        return f"{BLOCKS}PROGRAM Main\nVAR {pointers} i : I_Next; r : DINT; END_VAR\n{lines}\nEND_PROGRAM\n"


def compared(seed: int, engines: tuple[str, ...]) -> None:
    """Make the program of that number, run it, and compare; what engines leave in memory is equal to the bit."""
    program = Program(Random(seed))
    made = compile_text(program.text, dialect="codesys", lint=False, heap=20_000)
    assert made.image is not None, f"seed {seed}: {[d.render() for d in made.errors]}"
    memories = []
    for engine in engines:
        plc = Plc(made.image, engine="native") if engine == "native" else Plc(made.image, observed=engine == "observed")
        for scan in range(1, SCANS + 1):
            assert plc.scan() is None, f"seed {seed}, {engine}: {plc.trap}\n{program.text}"
            wanted = wrapped(program.r * scan), wrapped(program.world.total * scan)
            assert (plc.read("Main.r"), plc.read("total")) == wanted, f"seed {seed}, {engine}, scan {scan}\n{program.text}"
        start = plc.image.objects.leases_at
        memories.append(bytes(plc.memory.u8[start : plc.image.layout.size]))
    assert all(memory == memories[0] for memory in memories), f"seed {seed}"


def test_a_few_programs() -> None:
    for seed in range(2):
        compared(seed, ("python",))


@pytest.mark.slow
@pytest.mark.parametrize("part", range(PARTS))
def test_programs_on_every_engine(part: int) -> None:
    engines = ("python", "observed", "native") if available() else ("python", "observed")
    count = times(PROGRAMS, 60)
    for seed in range(part * count, (part + 1) * count):
        compared(seed, engines)
