"""Images built by hand: code in the operations' own notation over a few slots, and how to run it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from fbvm.base.areas import BUDGET, DUE, NEVER, NOW, SLOTS_OFFSET
from fbvm.base.memory import Memory
from fbvm.code.image import Body, Image, Layout, ProgramRun, Site, TaskRow
from fbvm.code.operations import EXPRESSIONS, STATEMENTS, Block, Node
from fbvm.code.shapes import statements
from fbvm.engine.python.engine import PythonEngine
from fbvm.engine.trap import Trap

SLOTS_BYTES = 4096


def at(offset: int, *terms: tuple[int, Node]) -> Any:
    """A place among the slots."""
    return "abs", SLOTS_OFFSET + offset, terms


def own(offset: int, *terms: tuple[int, Node]) -> Any:
    """A place in the instance that is executed."""
    return "self", offset, terms


def behind(reference: Node, offset: int = 0, *terms: tuple[int, Node]) -> Any:
    """A place behind a reference, used at site 9."""
    return ("ref", reference, 9), offset, terms


def const(machine: str, value: Any) -> Node:
    return "const", machine, value


def load(machine: str, offset: int) -> Node:
    return "load", machine, at(offset)


def store(machine: str, offset: int, value: Node) -> Node:
    return "store", machine, at(offset), value


def image(*codes: Block, size: int = 64, counters: int = 2) -> Image:
    """One body for each code, each the body of one program instance in one task; instances lie behind the slots."""
    bodies = tuple(Body(f"Body{n}", "PROGRAM", code, size) for n, code in enumerate(codes))
    runs = tuple(ProgramRun(body.name, n, SLOTS_OFFSET + SLOTS_BYTES + n * size) for n, body in enumerate(bodies))
    tasks = tuple(TaskRow(f"Task{n}", n, 0, "", (run,)) for n, run in enumerate(runs))
    sites = tuple(Site("Main.st", "Main", line, 5) for line in range(40))
    return Image(Layout(SLOTS_BYTES + size * len(codes)), bodies, tasks, {}, (), (), sites,
                 counters=counters if any(node[0] == "count" for code in codes for node in statements(code)) else 0,
                 marks=2 if any(node[0] == "mark" for code in codes for node in statements(code)) else 0)


def operations_in(item: Any) -> set[str]:
    """Names of the operations that a piece of code holds."""
    if not isinstance(item, tuple) or not item:
        return set()
    named = {item[0]} if isinstance(item[0], str) and (item[0] in STATEMENTS or item[0] in EXPRESSIONS) else set()
    return named.union(*map(operations_in, item))


@dataclass
class Rig:
    """A memory and what ran over it."""

    engine: PythonEngine
    memory: Memory
    trap: Trap | None

    def slot(self, machine: str, offset: int = 0) -> Any:
        return self.memory.read(SLOTS_OFFSET + offset, machine)

    def text(self, offset: int, capacity: int = 80) -> bytes:
        return self.memory.read_text(SLOTS_OFFSET + offset, capacity)

    def wide_text(self, offset: int, capacity: int = 80) -> str:
        at = SLOTS_OFFSET + offset
        return bytes(self.memory.u8[at:at + 2 * capacity]).decode("utf-16-le").partition("\0")[0]


def power_on(program: Image, before: dict[int, bytes] | None = None, budget: int = 100_000) -> Memory:
    """A memory with the system page set and `before` written among the slots."""
    memory = Memory(program.layout.size, program.layout.areas)
    memory.write(NOW, "i64", 5_000_000)
    memory.write(DUE, "i64", NEVER)
    memory.write(BUDGET, "i64", budget)
    for offset, data in (before or {}).items():
        memory.u8[SLOTS_OFFSET + offset:SLOTS_OFFSET + offset + len(data)] = data
    return memory


def execute(*codes: Block, before: dict[int, bytes] | None = None, budget: int = 100_000, program: Image | None = None) -> Rig:
    """Run the first body of these codes, or of `program`, once on the plain and on the observed build, which must agree to the
    bit.  Each engine keeps what it makes of a `program` for the next run."""
    program = program or image(*codes)
    memory, other = power_on(program, before, budget), power_on(program, before, budget)
    engine = PythonEngine(program, memory)
    trap = engine.run(0)
    steps = PythonEngine(program, other, observed=True).observe(0)
    seen = None
    while True:
        try:
            next(steps)
        except StopIteration as end:
            seen = end.value
            break
    assert repr(seen) == repr(trap)
    assert bytes(other.snapshot()) == bytes(memory.snapshot())
    return Rig(engine, memory, trap)


def yields(machine: str, expression: Node, before: dict[int, bytes] | None = None) -> Any:
    """The value of an expression, or the code of its trap.

    It is read twice: stored at once, and by way of a temporary, which must agree."""
    if machine == "s8":
        rig = execute((("store_text", at(100), 200, expression),), before=before)
        return rig.trap.code if rig.trap else rig.text(100, 200)
    if machine == "s16":
        rig = execute((("store_text", at(101), 200, expression),), before=before)
        return rig.trap.code if rig.trap else rig.wide_text(101, 200)
    rig = execute((
        store(machine, 104, expression), ("let", 1, machine, expression), store(machine, 112, ("tmp", machine, 1)),
        ("store_raw", machine, at(121), expression)), before=before)
    if rig.trap:
        return rig.trap.code
    assert repr(rig.slot(machine, 104)) == repr(rig.slot(machine, 112)) == repr(rig.slot(machine, 121)), expression
    return rig.slot(machine, 104)
