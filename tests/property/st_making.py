"""Programs in Structured Text made at random, well typed, as trees of tuples, and their text.

A type is a name.  Expressions are `(operation, type, ...)`, places `(kind, type, ...)`, statements `(kind, number, ...)`, where
the number is the statement's own.  At most one operation that can trap stands in a statement, and none in a call or in a
function: no rule says whether targets or values, inputs or the bounds and the step of FOR are worked out first."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from random import Random
from typing import Any

Node = tuple[Any, ...]
BITS = {"BOOL": 1, "SINT": 8, "INT": 16, "DINT": 32, "LINT": 64, "USINT": 8, "UINT": 16, "UDINT": 32, "ULINT": 64,
        "BYTE": 8, "WORD": 16, "DWORD": 32, "LWORD": 64, "REAL": 32, "LREAL": 64, "TIME": 64}
SIGNED, UNSIGNED = ("SINT", "INT", "DINT", "LINT"), ("USINT", "UINT", "UDINT", "ULINT")
INTEGERS, BIT_STRINGS, REALS = SIGNED + UNSIGNED, ("BYTE", "WORD", "DWORD", "LWORD"), ("REAL", "LREAL")
ELEMENTARY = ("BOOL", *INTEGERS, *BIT_STRINGS, *REALS, "TIME", "STRING")
WIDER = {"SINT": ("INT", "DINT", "LINT", "REAL", "LREAL"), "INT": ("DINT", "LINT", "REAL", "LREAL"), "DINT": ("LINT", "LREAL"),
         "USINT": ("UINT", "UDINT", "ULINT", "INT", "DINT", "LINT", "REAL", "LREAL"),
         "UINT": ("UDINT", "ULINT", "DINT", "LINT", "REAL", "LREAL"), "UDINT": ("ULINT", "LINT", "LREAL"), "REAL": ("LREAL",),
         "BYTE": ("WORD", "DWORD", "LWORD"), "WORD": ("DWORD", "LWORD"), "DWORD": ("LWORD",)}
"""Implicit conversions (the standard's figure 11)."""
MATH = ("SQRT", "LN", "LOG", "EXP", "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN")
LEVEL = {"**": 7, "*": 6, "/": 6, "MOD": 6, "+": 5, "-": 5, "<": 4, ">": 4, "<=": 4, ">=": 4, "=": 3.5, "<>": 3.5, "AND": 3,
         "&": 3, "AND_THEN": 3, "XOR": 2, "OR": 1, "OR_ELSE": 1}
"""Precedence of operators (table 71); unary ones have 8, what needs no parentheses 9."""


def limits(kind: str) -> tuple[int, int]:
    """Least and greatest value of an integer or a bit string."""
    if kind in SIGNED or kind == "TIME":
        return -(1 << BITS[kind] - 1), (1 << BITS[kind] - 1) - 1
    return 0, (1 << BITS[kind]) - 1


@dataclass(frozen=True)
class Variable:
    """A declaration: its section, name, type as written and its type here, initial value or None."""

    section: str
    name: str
    written: str
    kind: str
    initial: Any = None


@dataclass(frozen=True)
class Pou:
    """A program, function block or function with its result type."""

    kind: str
    name: str
    result: str
    variables: tuple[Variable, ...]
    body: tuple[Node, ...]


@dataclass(frozen=True)
class Program:
    """Structures as (name, ((member, type), ...)), and POUs, the program last."""

    structs: tuple[tuple[str, tuple[tuple[str, str], ...]], ...]
    pous: tuple[Pou, ...]


@dataclass
class Maker:
    """Makes the POUs of one program, one behind the other: each may call those before."""

    random: Random
    structs: dict[str, tuple[tuple[str, str], ...]] = field(default_factory=dict)
    pous: list[Pou] = field(default_factory=list)
    places: list[Node] = field(default_factory=list)
    writable: list[Node] = field(default_factory=list)
    counters: list[str] = field(default_factory=list)
    numbers: int = 0
    traps: bool = True
    """Whether statements may trap."""
    risks: int = 0
    """How many operations that can trap may still come in this statement."""

    def program(self) -> Program:
        for number in range(self.random.randrange(3)):
            members = tuple((f"m{n}", self.pick(ELEMENTARY)) for n in range(self.random.randrange(1, 5)))
            self.structs[f"S{number}"] = members
        for number in range(self.random.randrange(3)):
            self.pou("FUNCTION", f"F{number}", self.pick(ELEMENTARY[:-1]))
        for number in range(self.random.randrange(3)):
            self.pou("FUNCTION_BLOCK", f"B{number}", "")
        self.pou("PROGRAM", "Main", "")
        return Program(tuple(self.structs.items()), tuple(self.pous))

    def pick(self, items: Iterable[Any]) -> Any:
        return self.random.choice(tuple(items))

    def either(self, *nodes: Node) -> Node:
        return self.random.choice(nodes)

    def one_in(self, count: int) -> bool:
        return not self.random.randrange(count)

    # --- POUs

    def pou(self, kind: str, name: str, result: str) -> None:
        self.traps = kind != "FUNCTION"  # no rule says whether a function is called before a target's place is found
        rows = [*self.pins(kind), *self.locals(kind)]
        self.places = [place for row in rows for place in self.parts(("name", row.kind, row.name))]
        written = [row for row in rows if row.section != "VAR_INPUT" and not row.name.startswith(("i", "k"))]
        self.writable = [place for row in written for place in self.parts(("name", row.kind, row.name))]
        self.counters = [row.name for row in rows if row.name.startswith("i")]
        if result:
            self.writable.append(("name", result, name))
            self.places.append(("name", result, name))
        size = self.random.randrange(2, 5) if kind != "PROGRAM" else self.random.randrange(4, 14)
        body = self.block(size, 2 if kind != "PROGRAM" else 3)
        if result:
            body += (self.said("assign", ("name", result, name), self.value(result, 3)),)
        self.pous.append(Pou(kind, name, result, tuple(rows), body))

    def pins(self, kind: str) -> list[Variable]:
        rows = []
        if kind != "PROGRAM":
            kinds = ELEMENTARY if kind == "FUNCTION_BLOCK" else ELEMENTARY[:-1]
            rows += [self.variable("VAR_INPUT", f"p{n}", self.pick(kinds)) for n in range(self.random.randrange(1, 4))]
        if kind == "FUNCTION_BLOCK":
            rows += [self.variable("VAR_OUTPUT", f"q{n}", self.pick(ELEMENTARY)) for n in range(self.random.randrange(1, 3))]
            if self.one_in(2):
                rows.append(self.variable("VAR_IN_OUT", "x", self.pick(ELEMENTARY[:-1]), initial=False))
        return rows

    def locals(self, kind: str) -> list[Variable]:
        rows = [self.variable("VAR", f"i{n}", self.pick(INTEGERS), initial=False) for n in range(3)]
        rows += [Variable("VAR", f"k{n}", "INT", "INT") for n in range(3)]
        if kind == "FUNCTION":
            return [*rows, self.variable("VAR", "v0", self.pick(ELEMENTARY))]
        count = 3 if kind == "FUNCTION_BLOCK" else 10
        rows += [self.variable("VAR", f"v{n}", self.pick(ELEMENTARY)) for n in range(count)]
        rows += [Variable("VAR", f"s{n}", name, name) for n, name in enumerate(self.structs)]
        for n in range(2):
            low, element = self.random.randrange(-3, 4), self.pick(ELEMENTARY)
            kind_here = f"ARRAY {low} {low + self.random.randrange(5)} {element}"
            rows.append(Variable("VAR", f"a{n}", _array(kind_here), kind_here))
        rows += [Variable("VAR", f"{pou.name.lower()}{n}", pou.name, pou.name)
                 for pou in self.pous if pou.kind == "FUNCTION_BLOCK" for n in range(2)]
        if kind == "PROGRAM":
            rows += [Variable("VAR", f"r{n}", f"REF_TO {target}", f"REF {target}")
                     for n, target in enumerate((self.pick(ELEMENTARY[:-1]), self.pick(ELEMENTARY[:-1])))]
        return rows

    def variable(self, section: str, name: str, kind: str, initial: bool = True) -> Variable:
        written = f"STRING[{self.pick((5, 20))}]" if kind == "STRING" else kind
        first = self.literal(kind)[2] if initial and self.one_in(2) else None
        if kind == "STRING":
            kind = f"STRING {written[7:-1]}"
            first = None if first is None else first[:int(kind[7:])]
        return Variable(section, name, written, kind, first)

    def parts(self, place: Node) -> Iterable[Node]:
        """The places of elementary types in one; of an array the array itself, whose elements are picked when used."""
        kind = place[1]
        if kind in self.structs:
            for name, inner in self.structs[kind]:
                yield "member", _here(inner), place, name
        elif kind.startswith("ARRAY"):
            yield place
        elif any(pou.name == kind for pou in self.pous):
            pou = next(pou for pou in self.pous if pou.name == kind)
            for row in pou.variables:
                if row.section == "VAR_OUTPUT":
                    yield "member", row.kind, place, row.name
        else:
            yield place

    # --- places

    def place(self, kind: str, rows: list[Node], whole: bool = False) -> Node | None:
        """One of the places of a type, also an element of an array or what a reference leads to."""
        found: list[Callable[[], Node]] = []
        for place in rows:
            if _plain(place[1]) == kind:
                found.append(lambda place=place: place)  # type: ignore[misc]
            elif place[1].startswith("ARRAY") and _plain(place[1].split(" ", 3)[3]) == kind and not whole:
                found.append(lambda place=place: self.element(place))  # type: ignore[misc]
            elif place[1] == f"REF {kind}" and not whole and self.risky(2):
                found.append(lambda place=place: ("deref", kind, place))  # type: ignore[misc]
        return self.random.choice(found)() if found else None

    def element(self, array: Node) -> Node:
        _, low, high, kind = array[1].split(" ", 3)
        if self.risky(6):
            index: Node = ("widen", "INT", self.value("SINT", 1)) if self.one_in(2) else self.value("INT", 1)
        else:
            count = int(high) - int(low) + 1
            rest = ("binary", "INT", "MOD", self.value("INT", 1), ("literal", "INT", count))
            index = ("binary", "INT", "+", ("literal", "INT", int(low)), ("call", "INT", "ABS", (rest,)))
        return "element", _here(kind), array, index, int(low), int(high)

    def target(self, kind: str) -> Node | None:
        fixed = [place for place in self.writable if not (place[0] == "member" and self.block_of(place[2][1]))]
        return self.place(kind, fixed)

    def block_of(self, kind: str) -> bool:
        return any(pou.name == kind for pou in self.pous)

    def risky(self, one_in: int) -> bool:
        """True if an operation that can trap may come here, and does."""
        if self.risks <= 0 or not self.one_in(one_in):
            return False
        self.risks -= 1
        return True

    # --- statements

    def said(self, kind: str, *operands: Any) -> Node:
        self.numbers += 1
        return kind, self.numbers, *operands

    def block(self, count: int, depth: int, loop: bool = False) -> tuple[Node, ...]:
        return tuple(self.statement(depth, loop) for _ in range(count))

    def statement(self, depth: int, loop: bool) -> Node:
        self.risks = 1 if self.traps and self.one_in(4) else 0
        what = self.random.randrange(20)
        if depth > 0 and what < 3:
            rows = tuple((self.value("BOOL", 3), self.inner(depth, loop)) for _ in range(self.random.randrange(1, 3)))
            return self.said("if", rows, self.pick(((), self.inner(depth, loop))))
        if depth > 0 and what == 3:
            return self.case(depth, loop)
        if depth > 0 and what < 6 and len(self.counters) >= 1:
            return self.counted(depth) if what == 4 else self.guarded(depth)
        if loop and what == 6:
            rows = ((self.value("BOOL", 2), (self.said(self.pick(("exit", "continue"))),)),)
            return self.said("if", rows, ())
        if what == 7 and self.one_in(4):
            return self.said("if", ((self.value("BOOL", 2), (self.said("return"),)),), ())
        if what in (8, 9, 10):
            made = self.block_call() or self.bind()
            if made:
                return made
        if what == 11 and (copied := self.copy()):
            return copied
        return self.assignment()

    def inner(self, depth: int, loop: bool) -> tuple[Node, ...]:
        return self.block(self.random.randrange(1, 4), depth - 1, loop)

    def assignment(self) -> Node:
        risks, self.risks = self.risks, 0
        if risks and self.one_in(3):
            self.risks, risks = 1, 0
        target = None
        while target is None:
            target = self.target(self.pick(ELEMENTARY))
        self.risks = risks
        kind = _plain(target[1])
        return self.said("assign", target, self.fitting(kind, 4))

    def fitting(self, kind: str, depth: int) -> Node:
        """A value of a type, or one that converts to it by itself."""
        narrow = [source for source, wider in WIDER.items() if kind in wider]
        if narrow and self.one_in(5):
            return "widen", kind, self.value(self.pick(narrow), depth)
        return self.value(kind, depth)

    def case(self, depth: int, loop: bool) -> Node:
        kind = self.pick(INTEGERS)
        low, high = max(-20, limits(kind)[0]), 40
        cuts = sorted(self.random.sample(range(low, high), 6))
        rows = []
        for first, last in zip(cuts[::2], cuts[1::2], strict=True):
            labels = self.pick((((first, first),), ((first, last - 1),)))
            if last - first > 2 and self.one_in(3):
                labels = (first, first), (last - 1, last - 1)
            rows.append((labels, self.inner(depth, loop)))
        return self.said("case", self.value(kind, 3), tuple(rows), self.pick(((), self.inner(depth, loop))))

    def counted(self, depth: int) -> Node:
        """FOR over a variable that nothing else writes."""
        name = self.pick(self.counters)
        kind = next(place[1] for place in self.places if place[:1] == ("name",) and place[2] == name)
        self.counters.remove(name)
        bounds: list[Node] = [("binary", kind, "MOD", self.value(kind, 2), ("literal", kind, 9)) for _ in range(2)]
        if self.one_in(4):
            top = limits(kind)[1]
            bounds = [("literal", kind, top - self.random.randrange(5)), ("literal", kind, top - self.random.randrange(3))]
        step: Node | None = self.pick((None, ("literal", kind, 1), ("literal", kind, 2), ("literal", kind, 100)))
        if kind in SIGNED and self.one_in(3):
            step = ("literal", kind, self.pick((-1, -3)))
        elif self.risky(2):
            step = ("binary", kind, "MOD", self.value(kind, 1), ("literal", kind, 3))
        made = self.said("for", ("name", kind, name), *bounds, step, self.inner(depth, True))
        self.counters.append(name)
        return made

    def guarded(self, depth: int) -> Node:
        """WHILE or REPEAT that ends after some passes at the latest."""
        name = f"k{depth - 1}"
        guard: Node = ("get", "INT", ("name", "INT", name))
        more = self.said("assign", ("name", "INT", name), ("binary", "INT", "+", guard, ("literal", "INT", 1)))
        reset = self.said("assign", ("name", "INT", name), ("literal", "INT", 0))
        last = ("literal", "INT", self.random.randrange(1, 7))
        body = (more, *self.inner(depth, True))
        if self.one_in(2):
            test = ("binary", "BOOL", "AND", ("compare", "BOOL", "<", guard, last), self.value("BOOL", 2))
            loop = self.said("while", test, body)
        else:
            test = ("binary", "BOOL", "OR", ("compare", "BOOL", ">=", guard, last), self.value("BOOL", 2))
            loop = self.said("repeat", body, test)
        return self.said("if", ((("literal", "BOOL", True), (reset, loop)),), ())

    def block_call(self) -> Node | None:
        """A call of an instance, some inputs left out, some outputs taken."""
        instances = {place[2] for place in self.places if place[0] == "member" and self.block_of(place[2][1])}
        if not instances:
            return None
        instance = self.pick(sorted(instances))
        self.risks = 0  # no rule says whether an input is stored before the next one traps
        pou = next(pou for pou in self.pous if pou.name == instance[1])
        inputs: list[tuple[str, Node]] = []
        outputs: list[tuple[str, Node]] = []
        for row in pou.variables:
            if row.section == "VAR_INPUT" and not self.one_in(4):
                inputs.append((row.name, self.fitting(_plain(row.kind), 2)))
            if row.section == "VAR_IN_OUT":
                place = self.place(row.kind, [p for p in self.writable if p[0] == "name"], whole=True)
                if place is None:
                    return None
                inputs.append((row.name, ("at", row.kind, place)))
            if row.section == "VAR_OUTPUT" and self.one_in(2):
                self.risks = 0
                place = self.target(_plain(row.kind))
                if place is not None:
                    outputs.append((row.name, place))
        return self.said("run", instance, tuple(inputs), tuple(outputs))

    def bind(self) -> Node | None:
        """A reference to a variable that stays."""
        references = [place for place in self.writable if place[1].startswith("REF ")]
        if not references:
            return None
        reference = self.pick(references)
        stays = [place for place in self.writable if place[0] == "name" or not self.block_of(place[2][1])]
        place = self.place(reference[1][4:], stays, whole=True)
        return self.said("bind", reference, place) if place else None

    def copy(self) -> Node | None:
        """A whole array or structure."""
        arrays = [place for place in self.writable if place[1].startswith("ARRAY")]
        pairs = [(a, b) for a in arrays for b in arrays if a != b and a[1] == b[1]]
        return self.said("copy", *self.pick(pairs)) if pairs else None

    # --- values

    def literal(self, kind: str) -> Node:
        if kind == "BOOL":
            return "literal", kind, self.one_in(2)
        if kind == "STRING":
            return "literal", kind, self.pick(("", "a", "Pump", "x$y'z", "0123456789", "AB" * 9, "B"))
        if kind in REALS:
            number = self.pick((0.0, 1.0, -1.5, 0.1, 2.5, 1e10, -1e-10, 3.0e38, 1e-40, 255.5, 32767.5, 0.5))
            return "literal", kind, number
        low, high = limits(kind)
        number = self.pick((0, 1, 2, -1, 7, 100, low, high, low + 1, high // 2, 10**9, -1000, 86_400_000))
        if kind == "TIME":
            number = self.pick((0, 1, -1, 10**9, 1_500_000, -250_000_000, 3600 * 10**9, 7))
        return "literal", kind, number if low <= number <= high else self.pick((low, high))

    def value(self, kind: str, depth: int) -> Node:
        """A value of a type.  Constant expressions are rare: the compiler refuses those that trap."""
        node = self.operation(kind, depth)
        if node[0] not in ("literal", "get") and not self.one_in(8) and "'name'" not in repr(node) and "'user'" not in repr(node):
            return self.literal(kind)
        return node

    def operation(self, kind: str, depth: int) -> Node:
        if depth <= 0 or self.one_in(4):
            place = None if self.one_in(3) else self.place(kind, self.places)
            return ("get", kind, place) if place else self.literal(kind)
        if self.one_in(9):
            return self.chosen(kind, depth - 1)
        functions = [pou for pou in self.pous if pou.kind == "FUNCTION" and pou.result == kind]
        if functions and self.one_in(3):
            pou = self.pick(functions)
            taken = [row for row in pou.variables if row.section == "VAR_INPUT"]
            return "user", kind, pou.name, tuple(self.value(_plain(row.kind), depth - 2) for row in taken)
        makers = {"BOOL": self.truth, "STRING": self.text, "TIME": self.time}
        if kind in makers:
            return makers[kind](depth - 1)
        return self.real(kind, depth - 1) if kind in REALS else self.number(kind, depth - 1)

    def chosen(self, kind: str, d: int) -> Node:
        what = self.random.randrange(4)
        if what == 0:
            return "call", kind, "SEL", (self.value("BOOL", d), self.value(kind, d), self.value(kind, d))
        if what == 1:
            return "call", kind, self.pick(("MIN", "MAX")), tuple(self.value(kind, d) for _ in range(self.random.randrange(2, 4)))
        if what == 2:
            return "call", kind, "LIMIT", tuple(self.value(kind, d) for _ in range(3))
        choices = tuple(self.value(kind, d) for _ in range(3))
        index: Node = ("call", "INT", "ABS", (("binary", "INT", "MOD", self.value("INT", d), ("literal", "INT", 3)),))
        return "call", kind, "MUX", (self.value("INT", d) if self.risky(4) else index, *choices)

    def number(self, kind: str, d: int) -> Node:
        v, what = self.value, self.random.randrange(12)
        if kind in BIT_STRINGS:
            if what < 5:
                return "binary", kind, self.pick(("AND", "OR", "XOR", "&")), v(kind, d), self.fitting(kind, d)
            if what < 7:
                return "unary", kind, "NOT", v(kind, d)
            if what < 9:
                count = v("INT", d) if self.risky(2) else self.pick((("literal", "INT", self.random.randrange(70)),
                                                                     ("widen", "INT", v("USINT", d))))
                return "call", kind, self.pick(("SHL", "SHR", "ROL", "ROR")), (v(kind, d), count)
            return self.converted(kind, (*INTEGERS, *BIT_STRINGS, "BOOL"), d)
        if what < 4:
            return "binary", kind, self.pick("+-*"), v(kind, d), self.fitting(kind, d)
        if what == 4:
            divisor = v(kind, d) if self.risky(1) else ("literal", kind, self.pick((1, 2, 3, 7)))
            return "binary", kind, self.pick(("/", "MOD")), v(kind, d), divisor
        if what == 5 and kind in SIGNED:
            return self.either(("unary", kind, "-", v(kind, d)), ("call", kind, "ABS", (v(kind, d),)))
        if what == 6 and kind == "INT":
            return self.either(("call", kind, "LEN", (v("STRING", d),)), ("call", kind, "FIND", (v("STRING", d), v("STRING", d))))
        if what == 7 and self.risky(1):
            source = self.pick(REALS)
            return self.either(("convert", kind, v(source, d)), ("truncate", kind, v(source, d)))
        return self.converted(kind, (*INTEGERS, *BIT_STRINGS, "BOOL"), d)

    def converted(self, kind: str, sources: Iterable[str], d: int) -> Node:
        return "convert", kind, self.value(self.pick([source for source in sources if source != kind]), d)

    def real(self, kind: str, d: int) -> Node:
        v, what = self.value, self.random.randrange(12)
        if what < 6:
            return "binary", kind, self.pick("+-*/"), v(kind, d), self.fitting(kind, d)
        if what == 6:
            return self.either(("unary", kind, "-", v(kind, d)), ("call", kind, "ABS", (v(kind, d),)))
        if what == 7:
            return "call", kind, self.pick(MATH), (v(kind, d),)
        if what == 8:
            return "binary", kind, "**", v(kind, d), v(kind, d)
        return self.converted(kind, (*INTEGERS, "BOOL", *REALS), d)

    def truth(self, d: int) -> Node:
        v, what = self.value, self.random.randrange(9)
        if what < 4:
            kind = self.pick(ELEMENTARY)
            return "compare", "BOOL", self.pick(("=", "<>", "<", "<=", ">", ">=")), v(kind, d), self.fitting(kind, d)
        if what < 7:
            return "binary", "BOOL", self.pick(("AND", "OR", "XOR", "&", "AND_THEN", "OR_ELSE")), v("BOOL", d), v("BOOL", d)
        if what == 7:
            return "unary", "BOOL", "NOT", v("BOOL", d)
        return self.converted("BOOL", (*INTEGERS, *BIT_STRINGS, *REALS), d)

    def time(self, d: int) -> Node:
        v, what = self.value, self.random.randrange(6)
        if what < 3:
            return "binary", "TIME", self.pick("+-"), v("TIME", d), v("TIME", d)
        if what == 3:
            return "binary", "TIME", "*", v("TIME", d), v(self.pick(INTEGERS), d)
        if what == 4:
            factor = v(self.pick(SIGNED), d) if self.risky(2) else ("literal", "INT", self.pick((1, -2, 7)))
            return "binary", "TIME", "/", v("TIME", d), factor
        return "unary", "TIME", "-", v("TIME", d)

    def text(self, d: int) -> Node:
        v, what, d = self.value, self.random.randrange(9), min(d, 2)
        place = ("literal", "INT", self.random.randrange(1, 9))
        length = v("INT", 1) if self.risky(2) else ("literal", "INT", self.random.randrange(0, 9))
        if what == 0:
            return "call", "STRING", self.pick(("LEFT", "RIGHT")), (v("STRING", d), length)
        if what == 1:
            return "call", "STRING", self.pick(("MID", "DELETE")), (v("STRING", d), length, place)
        if what == 2:
            return "call", "STRING", "INSERT", (v("STRING", d), v("STRING", d), length)
        if what == 3:
            return "call", "STRING", "REPLACE", (v("STRING", d), v("STRING", d), length, place)
        if what < 6:
            return "call", "STRING", "CONCAT", (v("STRING", d), v("STRING", d))
        return self.converted("STRING", (*INTEGERS, *BIT_STRINGS, "BOOL"), d)


def _here(kind: str) -> str:
    """Type of a member or element as places have it: a STRING of its own length."""
    return "STRING 80" if kind == "STRING" else kind


def _plain(kind: str) -> str:
    """Type of the value at a place."""
    return "STRING" if kind.startswith("STRING") else kind


def _array(kind: str) -> str:
    _, low, high, element = kind.split(" ", 3)
    return f"ARRAY [{low}..{high}] OF {element}"
