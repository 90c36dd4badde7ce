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
    taken: int | None
    """What SET takes off the value; None if it is inherited."""
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
        self.own = {level.name: 0 for level in block.lineage()}
        """The variable that each block of the lineage declares."""

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
        self.own[block.name] = wrapped(self.own[block.name] + block.step)
        self.count = wrapped(self.count + self.own[block.name])

    @property
    def level(self) -> int:
        """The property Level."""
        bonus = next(block.bonus for block in self.block.lineage() if block.bonus is not None)
        return wrapped(self.count * 3 + bonus)

    @level.setter
    def level(self, value: int) -> None:
        taken = next(block.taken for block in self.block.lineage() if block.taken is not None)
        self.count = wrapped(value - taken)


def hierarchy(random: Random) -> list[Block]:
    """Two to seven blocks, the root first."""
    blocks: list[Block] = []
    for number in range(random.randint(2, 7)):
        base = random.choice(blocks) if blocks else None
        own = [m for m in range(METHODS) if base is None or random.random() < 0.5]
        methods = {m: _override(random, m, base is not None) for m in own}
        bonus = random.randint(-50, 50) if base is None or random.random() < 0.4 else None
        taken = random.randint(-9, 9) if base is None or random.random() < 0.4 else None
        block = Block(f"B{number}", base, methods, random.randint(1, 9), base is not None and random.random() < 0.6, bonus, taken)
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
        base = random.choice(one.block.lineage()).name
        pointed, referred = f"p{base} := ADR(o{which}); ", f"r{base} REF= o{which}; "
        way = random.choice(("body", "get", "set", *("call",) * 5))
        if way == "body":
            one.run()
            lines.append(random.choice((f"o{which}();", f"{pointed}p{base}^();", f"{referred}r{base}();", f"Run(o{which});")))
        if way == "set":
            one.level = given
            lines.append(random.choice((f"o{which}.Level := {given};", f"i := o{which}; i.Level := {given};",
                                        f"{pointed}p{base}^.Level := {given};", f"{referred}r{base}.Level := {given};")))
        if way in ("body", "set", "get"):
            results.append(one.level)
            lines.append(random.choice((f"{target}o{which}.Level;", f"{target}LevelOf(o{which});",
                                        f"{referred}{target}r{base}.Level;", f"{target}o{which}.Me.Level;")))
            continue
        results.append(one.call(number, given))
        call = f".m{number}({random.choice(('', 'x := '))}{given});"
        lines.append(random.choice((
            f"{target}o{which}{call}", f"{target}Call{number}(o{which}, {given});", f"i := o{which}; {target}i{call}",
            f"{pointed}{target}p{base}^{call}", f"{referred}{target}r{base}{call}", f"{target}Refer{number}(o{which}, {given});",
            f"list[{which}] := o{which}; {target}list[{which}]{call}",
            f"all[{which}] := ADR(o{which}); {target}all[{which}]^{call}",
            f"{target}o{which}.Itself(){call}", f"{target}o{which}.Me{call}", f"held.i := o{which}; {target}held.i{call}")))
    declared = "".join(f"o{number} : {block.name}; " for number, block in enumerate(instances))
    declared += "".join(f"p{each.name} : POINTER TO {each.name}; r{each.name} : REFERENCE TO {each.name}; " for each in blocks)
    main = f"PROGRAM Main\nVAR {declared}i : I; held : Held; list : ARRAY [0..{len(instances)}] OF I; " \
        f"all : ARRAY [0..{len(instances)}] OF POINTER TO B0; r : ARRAY [0..23] OF DINT; done : BOOL; END_VAR\n" \
        "IF done THEN RETURN; END_IF\ndone := TRUE;\n" + "\n".join(lines)
    return f"{_interface()}{''.join(map(_block, blocks))}{_functions()}{main}\nEND_PROGRAM\n", results


def _interface() -> str:
    heads = "".join(f"METHOD m{m} : DINT VAR_INPUT x : DINT; END_VAR END_METHOD\n" for m in range(METHODS))
    return f"INTERFACE I\n{heads}PROPERTY Level : DINT GET END_GET SET END_SET END_PROPERTY\nEND_INTERFACE\n" \
        "TYPE Held : STRUCT i : I; END_STRUCT END_TYPE\n"


def _functions() -> str:
    calls = "".join(f"FUNCTION Call{m} : DINT VAR_IN_OUT b : B0; END_VAR VAR_INPUT x : DINT; END_VAR Call{m} := b.m{m}(x); "
                    f"END_FUNCTION\nFUNCTION Refer{m} : DINT VAR_INPUT b : REFERENCE TO B0; x : DINT; END_VAR "
                    f"Refer{m} := b.m{m}(x); "
                    "END_FUNCTION\n" for m in range(METHODS))
    return calls + "FUNCTION LevelOf : DINT VAR_INPUT i : I; END_VAR LevelOf := i.Level; END_FUNCTION\n" \
        "FUNCTION Run : BOOL VAR_IN_OUT b : B0; END_VAR b(); END_FUNCTION\n"


def _block(block: Block) -> str:
    head = f"FUNCTION_BLOCK {block.name} " + (f"EXTENDS {block.base.name}" if block.base else "IMPLEMENTS I")
    own = f"\nVAR {'' if block.base else 'count : DINT; '}own{block.name} : DINT; END_VAR"
    parts = [head + own]
    if block.base is None:
        parts += ["METHOD Itself : REFERENCE TO B0 Itself REF= THIS^; END_METHOD",
                  "PROPERTY Me : REFERENCE TO B0 GET Me REF= THIS^; END_GET END_PROPERTY"]
    for number, made in block.methods.items():
        body = f"count := count + 1; t := x * {made.factor} + {made.summand};"
        if made.adds_super:
            body += f" t := t + SUPER.m{number}(x + 1);"
        body += "".join(f" t := t + {how}m{other}(t);" for other, how in made.calls)
        parts.append(f"METHOD m{number} : DINT VAR_INPUT x : DINT; END_VAR VAR t : DINT; END_VAR {body} m{number} := t + count; "
                     "END_METHOD")
    accessors = f"GET Level := count * 3 + {block.bonus}; END_GET " * (block.bonus is not None)
    accessors += f"SET count := Level - {block.taken}; END_SET " * (block.taken is not None)
    if accessors:
        parts.append(f"PROPERTY Level : DINT {accessors}END_PROPERTY")
    run = "SUPER(); " if block.runs_base else ""
    body = f"{run}own{block.name} := own{block.name} + {block.step}; count := count + own{block.name};"
    return "\n".join([*parts, body, "END_FUNCTION_BLOCK\n"])
