"""Programs in Structured Text made at random, well typed, as trees of tuples.

Expressions are `(operation, type, ...)`, places `(kind, type, ...)`, statements `(kind, number, ...)`, where the number is the
statement's own.  At most one operation that can trap stands in a statement, and none in a call or in a function that is
called within expressions: no rule says whether targets or values, inputs or the bounds and the step of FOR are worked out
first."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from st_features import Features
from st_kinds import (
    BITS,
    INTEGERS,
    PARTS,
    SIGNED,
    STANDARD,
    TEXTS,
    Node,
    Pou,
    Program,
    Variable,
    array_text,
    here,
    limits,
    plain,
)


@dataclass
class Maker(Features):
    """Makes the POUs of one program, one behind the other: each may call those before."""

    counters: list[str] = field(default_factory=list)
    traps: bool = True
    """Whether statements may trap."""

    def program(self) -> Program:
        for number in range(self.random.randrange(3)):
            members = tuple((f"m{n}", self.kind()) for n in range(self.random.randrange(1, 5)))
            self.structs[f"S{number}"] = members
        if self.one_in(3):
            self.structs["U0"] = self.union()
        self.globals = self.global_variables() if self.one_in(2) else ()
        for number in range(self.random.randrange(3)):
            self.pou("FUNCTION", f"F{number}", self.kind(texts=False))
        if self.one_in(3):
            self.pous.append(self.generic("Gen"))
        if self.one_in(3):
            self.pous.append(self.open_function("Whole"))
        if self.one_in(3):
            self.pous.append(self.ladder("L0"))
        if self.one_in(3):
            self.pous.append(self.of_anything("Any0"))
        for number in range(self.random.randrange(3)):
            self.pou("FUNCTION_BLOCK", f"B{number}", "")
        self.pou("PROGRAM", "Main", "")
        return Program(tuple(self.structs.items()), tuple(self.pous), self.globals,
                       self.tasks() if self.globals and self.one_in(2) else ())

    # --- POUs

    def pou(self, kind: str, name: str, result: str) -> None:
        self.traps = kind != "FUNCTION"
        rows = [*self.pins(kind), *self.locals(kind)]
        shared = self.globals if kind != "FUNCTION" else ()
        self.places = [place for row in (*rows, *shared) for place in self.parts(("name", row.kind, row.name))]
        self.located = {row.name for row in rows if row.at}
        written = [row for row in (*rows, *shared) if row.section != "VAR_INPUT" and row.name[0] not in "ikjuc"]
        self.writable = [place for row in written for place in self.parts(("name", row.kind, row.name))]
        self.counters = [row.name for row in rows if row.name.startswith("i")]
        self.actions = ()
        if result:
            self.writable.append(("name", result, name))
            self.places.append(("name", result, name))
        if kind != "FUNCTION" and self.one_in(3):
            self.actions = (("Act0", self.block(self.random.randrange(1, 4), 0)),)
        size = self.random.randrange(2, 5) if kind != "PROGRAM" else self.random.randrange(3, 9)
        bound = [self.bind(place) or self.point(place) for place in self.writable if kind == "PROGRAM" and not self.one_in(6)
                 and place[1].startswith(("REF", "PTR"))]
        body = tuple(node for node in bound if node) + self.block(size, 3 if kind == "PROGRAM" and self.one_in(3) else 2)
        if self.one_in(3):
            body = self.jumping(body)
        if result:
            body += (self.said("assign", ("name", result, name), self.value(result, 3)),)
        self.pous.append(Pou(kind, name, result, tuple(rows), body, self.actions))

    def pins(self, kind: str) -> list[Variable]:
        rows = []
        if kind != "PROGRAM":
            texts = kind == "FUNCTION_BLOCK"
            rows += [self.variable("VAR_INPUT", f"p{n}", self.kind(texts)) for n in range(self.random.randrange(1, 4))]
        if kind == "FUNCTION_BLOCK":
            rows += [self.variable("VAR_OUTPUT", f"q{n}", self.kind()) for n in range(self.random.randrange(1, 3))]
            if self.one_in(2):
                kind_here = "BOOL" if self.one_in(4) else self.kind(texts=False)
                rows.append(self.variable("VAR_IN_OUT", "x", kind_here, initial=False))
            if self.one_in(3):
                target = self.pick(INTEGERS)
                rows += [self.variable("VAR_TEMP", "t0", target),
                         Variable("VAR_OUTPUT", "qp", f"POINTER TO {target}", f"PTR {target}")]
        return rows

    def locals(self, kind: str) -> list[Variable]:
        rows = [self.variable("VAR", f"i{n}", self.pick(INTEGERS), initial=False) for n in range(3)]
        rows += [Variable("VAR", f"{letter}{n}", "INT", "INT") for letter, count in (("k", 3), ("j", 1)) for n in range(count)]
        if kind == "FUNCTION":
            return [*rows, self.variable("VAR", "v0", self.kind())]
        count = 3 if kind == "FUNCTION_BLOCK" else 10
        rows += [self.variable("VAR", f"v{n}", self.kind()) for n in range(count)]
        rows += [Variable("VAR", f"s{n}", name, name) for n, name in enumerate(self.structs)]
        for n in range(2):
            low, element = self.random.randrange(-3, 4), self.pick([self.kind(), *self.open_kinds])
            if n == 0 or not self.one_in(4):
                kind_here = f"ARRAY {low} {low + self.random.randrange(5)} {element}"
            rows.append(Variable("VAR", f"a{n}", array_text(kind_here), kind_here))
        rows += [Variable("VAR", f"{pou.name.lower()}{n}", pou.name, pou.name)
                 for pou in self.pous if pou.kind == "FUNCTION_BLOCK" for n in range(2)]
        rows += [Variable("VAR", f"n{n}", name, name) for n, name in enumerate(self.random.sample(sorted(STANDARD), 2))]
        rows += [Variable("VAR", f"e{n}", "E0", "E0") for n in range(2)]
        rows.append(Variable("VAR", "u0", "INT(-5..20)", "INT", None, None, (-5, 20)))
        if kind == "PROGRAM":
            rows += self.rows_of_many()
            rows += [self.variable("VAR_TEMP", "t0", self.kind()), *self.references(rows), *self.located_variables()]
        return rows

    def variable(self, section: str, name: str, kind: str, initial: bool = True) -> Variable:
        first = self.literal(kind)[2] if initial and self.one_in(2) else None
        written = kind
        if kind in TEXTS:
            size = self.pick((5, 20))
            written, kind = f"{kind}[{size}]", f"{kind} {size}"
            first = None if first is None else first[:size]
        return Variable(section, name, written, kind, first)

    def parts(self, place: Node) -> Iterable[Node]:
        """The places of elementary types in one; of an array the array itself, whose elements are picked when used."""
        kind = place[1]
        if kind in self.structs:
            for name, inner in self.structs[kind]:
                yield "member", here(inner), place, name
        elif kind.startswith("ARRAY"):
            yield place
        elif (pou := self.block_of(kind)) is not None:
            for row in pou.variables:
                if row.section == "VAR_OUTPUT":
                    yield "member", row.kind, place, row.name
        else:
            yield place

    # --- places

    def place(self, kind: str, rows: list[Node], whole: bool = False) -> Node | None:
        """One of the places of a type, also an element, a part, or what a reference leads to."""
        found: list[Callable[[], Node]] = []
        for place in rows:
            sort, _, inner = place[1].partition(" ")
            if plain(place[1]) == kind:
                found.append(lambda place=place: place)  # type: ignore[misc]
            elif whole:
                continue
            elif sort == "ARRAY" and plain(place[1].split(" ", 3)[3]) == kind:
                found.append(lambda place=place: self.element(place))  # type: ignore[misc]
            elif sort == "ARRAY":
                found += [lambda place=place, row=row: ("member", here(row[1]), self.element(place), row[0])  # type: ignore[misc]
                          for row in self.members(place[1].split(" ", 3)[3]) if plain(row[1]) == kind]
            elif sort in ("REF", "PTR", "REFERENCE") and inner == kind and self.risky(1):
                found.append(lambda place=place, sort=sort: self.behind(place, sort))  # type: ignore[misc]
            elif kind in PARTS and sort in PARTED and BITS[sort] > BITS[kind] and self.one_in(4):
                found.append(lambda place=place, sort=sort: (  # type: ignore[misc]
                    "part", kind, place, self.random.randrange(BITS[sort] // BITS[kind])))
        return self.random.choice(found)() if found else None

    def members(self, kind: str) -> Iterable[tuple[str, str]]:
        """Members of a structure, or outputs of a block, with their types."""
        pou = self.block_of(kind)
        outputs = [(row.name, row.kind) for row in pou.variables if row.section == "VAR_OUTPUT"] if pou else []
        return self.structs.get(kind, outputs)

    def rows_of_many(self) -> list[Variable]:
        """Arrays of structures and of instances."""
        kinds = [f"ARRAY 0 {self.random.randrange(3)} {self.pick(names)}" for names in (
            [name for name in self.structs if name[0] == "S"],
            [*(pou.name for pou in self.pous if pou.kind == "FUNCTION_BLOCK"), "TON", "CTU"]) if names]
        return [Variable("VAR", f"{'c' if self.block_of(kind.split()[3]) else 'o'}0", array_text(kind), kind) for kind in kinds]

    def unknown(self) -> Node:
        """A number that no compiler can tell."""
        return "binary", "INT", "+", ("get", "INT", ("name", "INT", "k0")), self.value("INT", 1)

    def element(self, array: Node) -> Node:
        _, low, high, kind = array[1].split(" ", 3)
        if self.risky(6):
            index: Node = self.unknown()
        else:
            count = int(high) - int(low) + 1
            rest = ("binary", "INT", "MOD", self.value("INT", 1), ("literal", "INT", count))
            index = ("binary", "INT", "+", ("literal", "INT", int(low)), ("call", "INT", "ABS", (rest,)))
        return "element", here(kind), array, index, int(low), int(high)

    def target(self, kind: str) -> Node | None:
        fixed = [place for place in self.writable if not (place[0] == "member" and self.block_of(place[2][1]))]
        return self.place(kind, fixed)

    def block_of(self, kind: str) -> Pou | None:
        """The function block of a name."""
        return STANDARD.get(kind) or next((pou for pou in self.pous if pou.name == kind), None)

    # --- statements

    def block(self, count: int, depth: int, loop: bool = False) -> tuple[Node, ...]:
        return tuple(self.statement(depth, loop) for _ in range(count))

    def statement(self, depth: int, loop: bool) -> Node:
        self.risks = 1 if self.traps and self.one_in(3) else 0
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
        if depth > 0 and what == 17 and self.one_in(2):
            return self.said("try", self.inner(depth, loop), self.inner(depth, loop), self.pick(((), self.inner(depth, loop))))
        if what == 7 and self.one_in(4):
            return self.said("if", ((self.value("BOOL", 2), (self.said("return"),)),), ())
        if what in (8, 9, 10, 13, 14):
            makers = (self.block_call, self.block_call, self.bind, self.point, self.open_call, self.through)
            made: Node | None = self.pick(makers)()
            if made:
                return made
        if what == 16 and self.traps:
            self.risks = 1
            if used := self.through():
                return used
        if what == 12 and self.actions and not loop:
            return self.said("act", self.actions[0][0])
        if what in (11, 15) and (copied := self.copy()):
            return copied
        return self.assignment()

    def inner(self, depth: int, loop: bool) -> tuple[Node, ...]:
        return self.block(self.random.randrange(1, 4), depth - 1, loop)

    def assignment(self) -> Node:
        if self.one_in(12):
            named = next((place for place in self.writable if place[1] == "E0"), None)
            if named and self.one_in(2):
                return self.said("assign", named, self.enumerated(2))
            if self.traps and named:
                self.risks = 0
                return self.said("range", ("name", "INT", "u0"), ("binary", "INT", "MOD", self.unknown(), ("literal", "INT", 30)))
        risks, self.risks = self.risks, 0
        if risks and self.one_in(3):
            self.risks, risks = 1, 0
        target = None
        while target is None:
            target = self.target(self.kind())
        self.risks = risks
        kind = plain(target[1])
        return self.said("assign", target, self.fitting(kind, 4))

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
        chosen = self.value(kind, 3)
        if chosen[0] == "get":  # of a subrange all labels would have to lie in it
            chosen = "binary", kind, "+", chosen, ("literal", kind, 0)
        return self.said("case", chosen, tuple(rows), self.pick(((), self.inner(depth, loop))))

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
        self.risks = 0  # no rule says whether an input is stored before the next one traps
        instances = {place[2] for place in self.places if place[0] == "member" and self.block_of(place[2][1])}
        rows = [place for place in self.places if place[1].startswith("ARRAY") and self.block_of(place[1].split(" ", 3)[3])]
        if not instances:
            return None
        instance = self.element(self.pick(rows)) if rows and self.one_in(4) else self.pick(sorted(instances))
        pou = self.block_of(instance[1])
        assert pou
        inputs: list[tuple[str, Node]] = []
        outputs: list[tuple[str, Node]] = []
        for row in pou.variables:
            if row.section == "VAR_INPUT" and not self.one_in(4):
                inputs.append((row.name, self.pin(row)))
            if row.section == "VAR_IN_OUT":
                place = self.place(row.kind, self.whole(), whole=True) if row.kind != "ANY" else self.anything()
                if place is None:
                    return None
                inputs.append((row.name, ("at", place[1], place)))
            if row.section == "VAR_OUTPUT" and self.one_in(2):
                self.risks = 0
                place = self.target(plain(row.kind))
                if place is not None:
                    outputs.append((row.name, place))
        return self.said("run", instance, tuple(inputs), tuple(outputs))

    def bind(self, wanted: Node | None = None) -> Node | None:
        """A reference to a variable that stays; the one that is wanted, or any."""
        references = [place for place in self.writable if place[1].startswith(("REF ", "REFERENCE "))
                      and wanted in (None, place)]
        if not references:
            return None
        reference = self.pick(references)
        place = self.place(reference[1].partition(" ")[2], self.whole(), whole=True)
        return self.said("bind", reference, place) if place else None

    def whole(self) -> list[Node]:
        """Variables of their own, and members of structures."""
        return [place for place in self.writable if not place[1].startswith("PTR") and (
            place[0] == "name" and place[2] not in (*self.located, "t0")
            or place[0] == "member" and place[2][1][0] == "S" and place[2][1] in self.structs)]

    def copy(self) -> Node | None:
        """A whole array or structure."""
        arrays = [place for place in self.writable if place[1].startswith("ARRAY")]
        pairs = [(a, b) for a in arrays for b in arrays if a != b and a[1] == b[1]]
        return self.said("copy", *self.pick(pairs)) if pairs else None


PARTED = (*INTEGERS, "BYTE", "WORD", "DWORD", "LWORD")
"""Types that have parts."""
