"""Code made at random from the table of operations: well typed, over all operations, ending by itself or by its budget.

`python tests/property/random_code.py 10000` compares that many programs on all engines."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from random import Random
from typing import Any

if __name__ == "__main__":
    sys.path[:0] = [str(Path(__file__).parents[1] / "unit" / "rigs"), str(Path(__file__).parents[2])]

from hand_image import at, const, image, power_on

from fbvm.base.areas import BUDGET, SLOTS_OFFSET
from fbvm.base.arithmetic import single
from fbvm.base.memory import Memory
from fbvm.base.types import ELEMENTARY
from fbvm.code.image import Image
from fbvm.code.operations import INTEGERS, SIZES, TEXT_UNITS, Address, Block, Node, limits
from fbvm.engine.native.engine import NativeEngine
from fbvm.engine.python.engine import PythonEngine

FLOATS = ("f32", "f64")
NUMBERS = INTEGERS + FLOATS
FORMS = ("b", *NUMBERS)
UNSIGNED = ("u8", "u16", "u32", "u64")
PLACES = 4
"""Slots of each form."""
ROWS = {form: 16 * number for number, form in enumerate((*FORMS, "ref"))}
"""Where the first slot of each form lies; the others follow in steps of 256 bytes."""
TEXT_AT, TEXT_CAPACITY = 1024, 30
ARRAY_AT, ARRAY_LAST = 1536, 15
INSTANCE_BYTES = 512
COUNTERS = 12
EDGES = (0, 1, -1, 2, 7, 127, 128, -128, 255, 32767, -32768, 65535, 2**31 - 1, -(2**31), 2**32 - 1, 2**63 - 1, -(2**63))
REALS = (0.0, -0.0, 1.0, -1.5, 0.1, 2.5, 1e10, -1e-10, 1e38, 3.4e38, 1e-45, 255.5, -128.5, 32767.5, math.inf, -math.inf, math.nan)
LETTERS = (b"", b"a", b"AB", b"12", b"-7", b"1.5", b"TRUE", b"xyzxyz", b"T#1s", b"\xe4$ ", b"INT#5", b"0123456789")
DATA_TYPES = {name: kind.machine for name, kind in ELEMENTARY.items() if "ANY_CHAR" not in kind.families}


class Maker:
    """Makes code.  `body` is the number of the body that is made; it calls bodies of higher numbers only."""

    def __init__(self, random: Random, bodies: int) -> None:
        self.random, self.bodies = random, bodies
        self.body = 0
        self.temporaries: list[tuple[int, str]] = []
        self.count = 0

    def program(self) -> list[Block]:
        """The code of all bodies."""
        made = []
        for number in range(self.bodies):
            self.body = number
            self.temporaries, self.count = [], 0
            made.append((("charge", 1, 1), *self.block(3)))
        return [self.counting(code) for code in made]

    def counting(self, block: Block) -> Block:
        """The same block with counters behind its statements, and in front of most of its branches."""
        out: list[Node] = [("count", self.random.randrange(COUNTERS))] * (self.random.random() < 0.7)
        for node in block:
            if node[0] == "if":
                node = ("if", tuple((c, self.counting(inner)) for c, inner in node[1]), self.counting(node[2]))
            elif node[0] == "case":
                node = (*node[:3], tuple((labels, self.counting(inner)) for labels, inner in node[3]), self.counting(node[4]))
            elif node[0] == "loop":
                node = ("loop", *(self.counting(inner) for inner in node[1:]))
            out += [node, *[("count", self.random.randrange(COUNTERS))] * (self.random.random() < 0.5)]
        return tuple(out)

    def pick(self, items: Any) -> Any:
        return self.random.choice(tuple(items))

    def site(self) -> int:
        return self.random.randrange(30)

    # --- places

    def address(self, form: str) -> Address:
        """Where a value of a form lies: a slot, a member of the instance, an item of an array, behind a reference."""
        offset = ROWS[form] + self.random.randrange(PLACES) * 256
        what = self.random.randrange(8)
        if what < 3:
            return at(offset)
        if what < 5:
            return "self", ROWS[form] + 256 * self.random.randrange(2), ()
        if what < 7:
            size = SIZES[form]
            index = ("check", "i64", self.small_number(ARRAY_LAST, 1), 0, ARRAY_LAST, "R0102", self.site())
            return at(ARRAY_AT, (size, index))
        return (("ref", self.reference(), self.site()), self.pick((0, 0, SIZES[form])), ())

    def reference(self) -> Node:
        if not self.rarely():
            return "reference", "ref", at(ROWS["f64"] + 256 * self.random.randrange(PLACES)), 255
        return "load", "ref", at(ROWS["ref"] + 256 * self.random.randrange(PLACES))

    def flag(self) -> Address:
        """Where a BOOL behind a reference lies: a byte, or a bit."""
        whole = self.reference()
        if self.random.randrange(2):
            whole = "bit_behind", "ref", whole, self.small_number(63, 1)
        return (("ref", whole, self.site()), 0, ())

    def rarely(self) -> bool:
        """True where a trap may come of it: programs shall get far as a rule."""
        return not self.random.randrange(40)

    def small_number(self, last: int, depth: int) -> Node:
        """An i64 from 0 to `last` (one less than a power of two), as a rule."""
        if self.rarely():
            return self.value("i64", depth)
        return "convert", "i64", "u8", ("and", "u8", self.value("u8", depth), const("u8", last))

    def text_place(self) -> Address:
        return at(TEXT_AT + 32 * self.random.randrange(6))

    # --- expressions

    def value(self, form: str, depth: int) -> Node:
        known = [number for number, kind in self.temporaries if kind == form]
        if depth <= 0 or not self.random.randrange(6):
            what = self.random.randrange(3)
            if what == 0:
                return self.constant(form)
            if what == 1 and known:
                return "tmp", form, self.pick(known)
            if form in TEXT_UNITS:
                return "load_text", form, self.text_place(), TEXT_CAPACITY // TEXT_UNITS[form]
            return self.pick(("load", "load", "load_raw")), form, self.address(form)
        if form in TEXT_UNITS:
            return self.text(form, depth - 1)
        if form == "b":
            return self.condition(depth - 1)
        return self.real(form, depth - 1) if form in FLOATS else self.integer(form, depth - 1)

    def constant(self, form: str) -> Node:
        if form == "s8":
            return const("s8", self.pick(LETTERS))
        if form == "s16":
            return const("s16", self.pick(LETTERS).decode("latin-1") + self.pick(("", "", "\u20ac", "\ud83d\ude00")))
        if form in FLOATS:
            number = self.pick(REALS)
            return const(form, single(number) if form == "f32" else number)
        low, high = limits(form)
        number = self.pick(EDGES)
        return const(form, number if low <= number <= high else self.pick((low, high)))

    def either(self, form: str, d: int) -> Node:
        """Operations of any form."""
        what = self.random.randrange(3)
        if what == 0:
            return "select", form, self.value("b", d), self.value(form, d), self.value(form, d)
        if what == 1:
            choices = tuple(self.value(form, d) for _ in range(self.random.randrange(1, 4)))
            choices += (choices[0],) * (4 - len(choices) if not self.rarely() else 0)
            return "mux", form, self.small_number(3, d), choices, self.site()
        return self.pick(("min", "max")), form, self.value(form, d), self.value(form, d)

    def integer(self, form: str, d: int) -> Node:
        what = self.random.randrange(16)
        v, site = self.value, self.site()
        if what < 5:
            return self.pick(("add", "sub", "mul")), form, v(form, d), v(form, d)
        if what == 5:
            divisor = v(form, d)
            if not self.rarely():
                divisor = ("select", form, ("is_set", "b", form, divisor), const(form, 3), divisor)
            return self.pick(("div", "mod")), form, v(form, d), divisor, site
        if what == 6:
            return self.pick(("neg", "abs")), form, v(form, d)
        if what == 7:
            count = self.pick((self.small_number(127, d), const("i64", self.random.randrange(70))))
            return self.pick(("shl", "shr", "rol", "ror")), form, v(form, d), count, site
        if what == 8:
            source = self.pick((*INTEGERS, "b"))
            return "convert", form, source, v(source, d)
        if what == 9:
            source = self.pick(FLOATS)
            number = v(source, d)
            if not self.rarely():
                least, most = (max(-100, limits(form)[0]) - 0.5, 127.4)
                number = ("min", source, ("max", source, number, const(source, single(least))), const(source, single(most)))
                number = ("select", source, ("eq", "b", source, number, number), const(source, 2.5), number)
            return self.pick(("nearest", "truncate")), form, source, number, site
        if what == 10:
            low, high = limits(form)
            if self.rarely():
                low, high = max(low, self.pick((-100, 0, 5))), self.pick((50, 100))
            return "check", form, v(form, d), low + (low < 0), high, "R0103", site
        if what == 11 and form in UNSIGNED:
            return self.pick(((self.pick(("and", "or", "xor")), form, v(form, d), v(form, d)), ("not", form, v(form, d)),
                              ("from_bcd", form, form, ("and", form, v(form, d), const(form, 0x33)), site),
                              ("to_bcd", form, form, ("and", form, v(form, d), const(form, 63)), site)))
        if what == 12:
            return self.special(form, d)
        return self.either(form, d)

    def special(self, form: str, d: int) -> Node:
        site = self.site()
        if form == "i16":
            text = self.pick(TEXT_UNITS)
            return self.pick((("length", "i16", self.value(text, d)), ("find", "i16", self.value(text, d), self.value(text, d))))
        if form in ("u8", "u16") and self.random.randrange(2):
            return "first", form, self.value("s8" if form == "u8" else "s16", d)
        if form == "i64":
            high = self.small_number(63, d)
            wide = self.value("s16", d)
            return self.pick((("now", "i64"), ("characters", "i64", wide), ("units_of", "i64", wide, self.value("i64", d)),
                              ("floor_div", "i64", self.value("i64", d), const("i64", self.pick((1, 3, 1000)))),
                              ("within", "i64", self.small_number(7, d), const("i64", -5), high, "R0102", site)))
        if form in ("u32", "u64"):
            source = {"u32": "f32", "u64": "f64"}[form]
            return "bits", form, source, self.value(source, d)
        return self.read(form, d)

    def read(self, form: str, d: int) -> Node:
        name = self.pick([name for name, kind in DATA_TYPES.items() if kind == form])
        text = self.value("s8", d) if self.rarely() else ("to_text", "s8", name, self.value(form, min(d, 1)))
        if self.rarely():
            return "from_leading", form, name, int(form not in ("b", "i64", "u64", "f64") or self.rarely()), text
        return "from_text", form, name, text, self.site()

    def real(self, form: str, d: int) -> Node:
        what = self.random.randrange(12)
        v = self.value
        if what < 5:
            return self.pick(("add", "sub", "mul")), form, v(form, d), v(form, d)
        if what == 5:
            return "div", form, v(form, d), v(form, d), self.site()
        if what == 6:
            return self.pick(("neg", "abs")), form, v(form, d)
        if what == 7:
            function = self.pick(("sqrt", "ln", "log", "exp", "sin", "cos", "tan", "asin", "acos", "atan"))
            return self.pick((("math", form, function, v(form, d)), (self.pick(("pow", "atan2")), form, v(form, d), v(form, d))))
        if what == 8:
            source = self.pick((*NUMBERS, "b"))
            return "convert", form, source, v(source, d)
        if what == 9:
            source = {"f32": "u32", "f64": "i64"}[form]
            return "bits", form, source, v(source, d)
        if what == 10:
            return self.read(form, d)
        return self.either(form, d)

    def condition(self, d: int) -> Node:
        what = self.random.randrange(9)
        v = self.value
        if what < 3:
            form = self.pick((*FORMS, *TEXT_UNITS))
            return self.pick(("eq", "ne", "lt", "le", "gt", "ge")), "b", form, v(form, d), v(form, d)
        if what < 5:
            return self.pick(("and", "or", "xor", "and_then", "or_else")), "b", v("b", d), v("b", d)
        if what == 5:
            return self.pick((("not", "b", v("b", d)), ("is_set", "b", form := self.pick(FORMS), v(form, d))))
        if what == 6:
            return self.pick((("load_bit", "b", self.address("u8"), self.random.randrange(8)),
                              ("load_flag", "b", self.flag())))
        return self.either("b", d)

    def text(self, form: str, d: int) -> Node:
        what = self.random.randrange(10)
        v, site = self.value, self.site()
        n, p = (self.pick((const("i64", self.random.randrange(1, 8)), ("add", "i64", self.small_number(7, 0), const("i64", 1))))
                for _ in range(2))
        if what == 0:
            return self.pick(("left", "right")), form, v(form, d), n, site
        if what == 1:
            return self.pick(("mid", "delete")), form, v(form, d), n, p, site
        if what == 2:
            return "insert", form, v(form, d), v(form, d), p, site
        if what == 3:
            return "replace", form, v(form, d), v(form, d), n, p, site
        if what == 4:
            return "concat", form, v(form, d), v(form, d)
        if what == 5:
            return "recode", form, v("s16" if form == "s8" else "s8", d)
        if what == 6:
            return "character", form, v("u8" if form == "s8" else "u16", d)
        if what == 7 and form == "s8":
            name = self.pick(DATA_TYPES)
            return "to_text", "s8", name, v(DATA_TYPES[name], min(d, 1))
        if what == 8 and form == "s8":
            return "enum_text", "s8", ((1, "Red"), (-2, "Blue"), (7, "Grün")), v("i64", d)
        return self.either(form, d)

    # --- statements

    def block(self, depth: int) -> Block:
        return tuple(node for _ in range(self.random.randrange(1, 6)) for node in self.statement(depth))

    def statement(self, depth: int) -> Block:
        what = self.random.randrange(16)
        if what < 6:
            return (self.store(),)
        if what < 8:
            return (self.let(),)
        if what == 8:
            return (self.text_store(),)
        if depth <= 0 or what == 9:
            return (self.small(),)
        if what < 12:
            rows = tuple((self.value("b", 2), self.scoped(depth - 1)) for _ in range(self.random.randrange(1, 3)))
            return (("if", rows, self.pick(((), self.scoped(depth - 1)))),)
        if what == 12:
            return (self.case(depth),)
        if what == 13:
            return self.loop(depth)
        if what == 14 and self.body + 1 < self.bodies:
            return (self.call(),)
        return (self.store(),)

    def store(self) -> Node:
        form = self.pick(FORMS)
        if form == "b" and self.random.randrange(2):
            if self.random.randrange(2):
                return "store_bit", self.address("u8"), self.random.randrange(8), self.value("b", 3)
            return "store_flag", self.flag(), self.value("b", 2)
        return self.pick(("store", "store", "store_raw")), form, self.address(form), self.value(form, 4)

    def let(self) -> Node:
        form = self.pick((*FORMS, *TEXT_UNITS))
        value = self.value(form, 3)
        self.count += 1
        self.temporaries.append((self.count, form))
        return "let", self.count, form, value

    def text_store(self) -> Node:
        form = self.pick(TEXT_UNITS)
        return "store_text", self.text_place(), TEXT_CAPACITY // TEXT_UNITS[form], self.value(form, 3)

    def small(self) -> Node:
        place = 64 * self.random.randrange(10)
        return self.pick((
            ("copy", at(place), at(64 * self.random.randrange(10) + self.random.randrange(9)), self.random.randrange(1, 60)),
            ("fill", at(place), self.pick((bytes(9), b"\1\2\3", b"\xff" * 20))), ("charge", 1, self.site()),
            ("reverse", at(place), 60, self.pick((((0, 5, 2, 2),), ((1, 3, 20, 8), (9, 2, 10, 4)), ((3, 7, 8, 3),)))),
            ("due", self.value("i64", 1)), ("if", ((self.value("b", 1), (("raise", ("max", "u32", self.value("u32", 1), const(
                "u32", 4)), self.site()),)),), ()), ("copy", (("ref", self.reference(), self.site()), 0, ()), at(place), 16)))

    def case(self, depth: int) -> Node:
        form = self.pick(INTEGERS)
        rows = []
        for _ in range(self.random.randrange(1, 8)):
            labels = []
            for _ in range(self.random.randrange(1, 3)):
                low = self.random.randrange(0, 100)
                labels.append((low, low + self.pick((0, 0, 3, 20))))
            rows.append((tuple(labels), self.scoped(depth - 1)))
        return "case", form, self.value(form, 2), tuple(rows), self.pick(((), self.scoped(depth - 1)))

    def scoped(self, depth: int) -> Block:
        """A block whose temporaries nobody uses behind it."""
        before = list(self.temporaries)
        block = self.block(depth)
        self.temporaries = before
        return block

    def loop(self, depth: int) -> Block:
        """A loop that counts, with its budget, left now and then."""
        self.count += 1
        number, times = self.count, self.random.randrange(1, 12)
        counter = ("tmp", "i16", number)
        leave = ("if", ((("ge", "b", "i16", counter, const("i16", times)), (("exit",),)),), ())
        before = list(self.temporaries)
        body = self.block(depth - 1)
        if not self.random.randrange(3):
            body += (("if", ((self.value("b", 1), ((self.pick(("exit", "next", "return")),),)),), ()),)
            body += self.block(0)
        self.temporaries = before
        return (("let", number, "i16", const("i16", 0)),
                ("loop", (("charge", 2, self.site()), leave), body,
                 (("let", number, "i16", ("add", "i16", counter, const("i16", 1))),)))

    def call(self) -> Node:
        called = self.random.randrange(self.body + 1, self.bodies)
        place = self.pick((None, at(2048 + INSTANCE_BYTES * self.random.randrange(3)), at(2048, (64, (
            "check", "i64", self.small_number(7, 1), 0, 8, "R0102", self.site()))), ("self", 0, ())))
        address = place if place is not None else at(2048)
        if self.random.randrange(2):
            return "call", called, address
        self.count += 1
        self.temporaries.append((self.count, "u32"))
        return "attempt", called, ("self", 0, ()), self.count, self.pick((False, True))


def before(random: Random) -> dict[int, bytes]:
    """What the slots hold at first: bytes at random, some texts, references to slots."""
    content = {64 * n: bytes(random.choice((0, 1, 2, 127, 128, 255, random.randrange(256))) for _ in range(32))
               for n in range(60)}
    content |= {TEXT_AT + 32 * n: random.choice(LETTERS) + b"\0" for n in range(6)}
    for n in range(PLACES):
        target = random.choice((1 << 40 | SLOTS_OFFSET + 64 * n << 8 | random.choice((255, 3)), 1 << 40 | 255,
                                1 << 40 | BUDGET << 8 | 255))
        content[ROWS["ref"] + 256 * n] = target.to_bytes(8, "little")
    return content


ENGINES = {
    "python plain": lambda program, memory: PythonEngine(program, memory),
    "python observed": lambda program, memory: PythonEngine(program, memory, observed=True),
    "native 0": lambda program, memory: NativeEngine(program, memory, 0),
    "native 2": lambda program, memory: NativeEngine(program, memory, 2),
}
"""What executes an image over a memory, by name; the first one is the reference."""


def run(program: Image, memory: Memory, name: str, scans: int = 3) -> list[tuple[str, bytes, list[int]]]:
    """Trap, memory and counters after each scan of the first task."""
    engine = ENGINES[name](program, memory)
    seen = []
    for _ in range(scans):
        trap = engine.run(0)
        seen.append((repr(trap), bytes(memory.snapshot()), list(engine.counts)))
    return seen


def differing(random: Random) -> tuple[str, list[Block]] | None:
    """Make a program and run it everywhere: the name of an engine that differs, and the code; None if they agree."""
    program = image(*(codes := Maker(random, 3).program()), size=1024, counters=COUNTERS)
    content = before(random)
    wanted: list[tuple[str, bytes, list[int]]] = []
    for name in ENGINES:
        seen = run(program, power_on(program, content, 3000), name)
        wanted = wanted or seen
        if seen != wanted:
            return name, codes
    return None


if __name__ == "__main__":
    from fbvm.base import cache

    cache.switch(False)
    first, count = int(sys.argv[2]) if len(sys.argv) > 2 else 0, int(sys.argv[1])
    for seed in range(first, first + count):
        if found := differing(Random(seed)):
            print(f"seed {seed}: {found[0]} differs")
    print(f"{count} programs compared")
