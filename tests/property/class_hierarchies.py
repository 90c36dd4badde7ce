"""Random hierarchies of blocks, as text and as Python objects that compute the same: the oracle of `test_class_hierarchies`."""

from __future__ import annotations

from dataclasses import dataclass, field
from random import Random

METHODS = 4
"""Methods that every hierarchy has, m0 to m3; a method calls those behind it, so that no call comes back."""


@dataclass
class Override:
    """The body of one method: factor, summand, whether it adds what SUPER yields, and the methods that it calls."""

    factor: int
    summand: int
    adds_super: bool
    calls: list[tuple[int, str]]


@dataclass
class Block:
    """A block of a hierarchy: its base, its own methods, what its body adds, and what GET adds to the count."""

    name: str
    base: Block | None
    methods: dict[int, Override]
    step: int
    runs_base: bool
    bonus: int | None
    derived: list[Block] = field(default_factory=list)

    def lineage(self) -> list[Block]:
        return [self, *(self.base.lineage() if self.base is not None else [])]


def wrapped(value: int) -> int:
    """A number as a DINT keeps it."""
    return (value + (1 << 31)) % (1 << 32) - (1 << 31)


class Instance:
    """An instance, with the meaning of its methods in Python."""

    def __init__(self, block: Block) -> None:
        self.block, self.count = block, 0

    def call(self, number: int, given: int, above: list[Block] | None = None) -> int:
        """m<number>(given), as seen from the blocks `above`, the most derived first."""
        lineage = above if above is not None else self.block.lineage()
        at = next(position for position, block in enumerate(lineage) if number in block.methods)
        made = lineage[at].methods[number]
        self.count = wrapped(self.count + 1)
        total = wrapped(given * made.factor + made.summand)
        if made.adds_super:
            total = wrapped(total + self.call(number, wrapped(given + 1), lineage[at + 1:]))
        for other, _ in made.calls:
            total = wrapped(total + self.call(other, total))
        return wrapped(total + self.count)

    def run(self, above: list[Block] | None = None) -> None:
        """The body."""
        block, *more = above if above is not None else self.block.lineage()
        if block.runs_base:
            self.run(more)
        self.count = wrapped(self.count + block.step)

    @property
    def level(self) -> int:
        """The property Level."""
        bonus = next(block.bonus for block in self.block.lineage() if block.bonus is not None)
        return wrapped(self.count * 3 + bonus)

    @level.setter
    def level(self, value: int) -> None:
        self.count = wrapped(value - 1)


def hierarchy(random: Random) -> list[Block]:
    """Two to seven blocks, the root first."""
    blocks: list[Block] = []
    for number in range(random.randint(2, 7)):
        base = random.choice(blocks) if blocks else None
        own = [m for m in range(METHODS) if base is None or random.random() < 0.5]
        methods = {m: _override(random, m, base is not None) for m in own}
        bonus = random.randint(-50, 50) if base is None or random.random() < 0.4 else None
        block = Block(f"B{number}", base, methods, random.randint(1, 9), base is not None and random.random() < 0.6, bonus)
        blocks.append(block)
    return blocks


def _override(random: Random, number: int, has_base: bool) -> Override:
    behind = [m for m in range(number + 1, METHODS) if random.random() < 0.4]
    return Override(random.randint(-9, 9), random.randint(-99, 99), has_base and random.random() < 0.5,
                    [(m, random.choice(("", "THIS.", "THIS^."))) for m in behind])


def text(random: Random, blocks: list[Block], instances: list[Block]) -> tuple[str, list[int]]:
    """A program over these blocks, and the results that its array `r` has at the end of the first scan."""
    objects = [Instance(block) for block in instances]
    lines, results = [], []
    for place in range(24):
        which, number, given = random.randrange(len(objects)), random.randrange(METHODS), random.randint(-1000, 1000)
        target, one = f"r[{place}] := ", objects[which]
        way = random.choice(("name", "in-out", "interface", "pointer", "body", "get", "set", "array"))
        if way == "body":
            one.run()
            lines.append(random.choice((f"o{which}();", f"p := ADR(o{which}); p^();", f"Run(o{which});")))
        if way == "set":
            one.level = given
            lines.append(random.choice((f"o{which}.Level := {given};", f"i := o{which}; i.Level := {given};")))
        if way in ("body", "set", "get"):
            results.append(one.level)
            lines.append(target + random.choice((f"o{which}.Level;", f"LevelOf(o{which});")))
            continue
        results.append(one.call(number, given))
        call = f".m{number}({random.choice(('', 'x := '))}{given});"
        lines.append({"name": f"{target}o{which}{call}", "in-out": f"{target}Call{number}(o{which}, {given});",
                      "interface": f"i := o{which}; {target}i{call}", "pointer": f"p := ADR(o{which}); {target}p^{call}",
                      "array": f"list[{which}] := o{which}; {target}list[{which}]{call}"}[way])
    declared = "".join(f"o{number} : {block.name}; " for number, block in enumerate(instances))
    main = f"PROGRAM Main\nVAR {declared}p : POINTER TO B0; i : I; list : ARRAY [0..{len(instances)}] OF I; " \
        f"r : ARRAY [0..23] OF DINT; done : BOOL; END_VAR\nIF done THEN RETURN; END_IF\ndone := TRUE;\n" + "\n".join(lines)
    return f"{_interface()}{''.join(map(_block, blocks))}{_functions()}{main}\nEND_PROGRAM\n", results


def _interface() -> str:
    heads = "".join(f"METHOD m{m} : DINT VAR_INPUT x : DINT; END_VAR END_METHOD\n" for m in range(METHODS))
    return f"INTERFACE I\n{heads}PROPERTY Level : DINT GET END_GET SET END_SET END_PROPERTY\nEND_INTERFACE\n"


def _functions() -> str:
    calls = "".join(f"FUNCTION Call{m} : DINT VAR_IN_OUT b : B0; END_VAR VAR_INPUT x : DINT; END_VAR Call{m} := b.m{m}(x); "
                    "END_FUNCTION\n" for m in range(METHODS))
    return calls + "FUNCTION LevelOf : DINT VAR_INPUT i : I; END_VAR LevelOf := i.Level; END_FUNCTION\n" \
        "FUNCTION Run : BOOL VAR_IN_OUT b : B0; END_VAR b(); END_FUNCTION\n"


def _block(block: Block) -> str:
    head = f"FUNCTION_BLOCK {block.name} " + (f"EXTENDS {block.base.name}" if block.base else "IMPLEMENTS I")
    own = "" if block.base else "\nVAR count : DINT; END_VAR"
    parts = [head + own]
    for number, made in block.methods.items():
        body = f"count := count + 1; t := x * {made.factor} + {made.summand};"
        if made.adds_super:
            body += f" t := t + SUPER.m{number}(x + 1);"
        body += "".join(f" t := t + {how}m{other}(t);" for other, how in made.calls)
        parts.append(f"METHOD m{number} : DINT VAR_INPUT x : DINT; END_VAR VAR t : DINT; END_VAR {body} m{number} := t + count; "
                     "END_METHOD")
    setter = " SET count := Level - 1; END_SET" if block.base is None else ""
    if block.bonus is not None:
        parts.append(f"PROPERTY Level : DINT GET Level := count * 3 + {block.bonus}; END_GET{setter} END_PROPERTY")
    run = "SUPER(); " if block.runs_base else ""
    return "\n".join([*parts, f"{run}count := count + {block.step};", "END_FUNCTION_BLOCK\n"])
