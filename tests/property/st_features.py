"""What else programs made at random have: globals and tasks, located variables, unions, pointers, jumps, rungs, generic
functions, functions of open arrays.  `Maker` of `st_making` is one of these."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from st_kinds import (
    BITS,
    COMMON,
    DURATIONS,
    GENERIC,
    INTEGERS,
    NUMBERS,
    REALS,
    Node,
    Pou,
    Task,
    Variable,
    array_text,
)
from st_values import Values, width_bytes

WORD_AREAS = ("D", "W", "H", "CIO ")
"""Areas of words that programs use, from word 100 on; `%M` is one of bytes."""
FIRST_WORD, WORDS = 100, 6
CONTACTS = ("LD", "AND", "OR", "LDNOT", "ANDNOT", "ORNOT")
PRESETS_NS = (0, 10_000_000, 15_000_000, 20_000_000, 25_000_000, -1, 10**9)


@dataclass
class Features(Values):
    """Makes them out of values."""

    numbers: int = 0
    globals: tuple[Variable, ...] = ()
    actions: tuple[tuple[str, tuple[Node, ...]], ...] = ()
    located: set[str] = field(default_factory=set)
    """Names of the variables with addresses in this POU."""
    writable: list[Node] = field(default_factory=list)
    open_kinds: list[str] = field(default_factory=list)
    """Types of elements that functions with ARRAY [*] take."""

    def said(self, kind: str, *operands: Any) -> Node:
        """A statement."""
        self.numbers += 1
        return kind, self.numbers, *operands

    def variable(self, section: str, name: str, kind: str, initial: bool = True) -> Variable:
        raise NotImplementedError

    def target(self, kind: str) -> Node | None:
        raise NotImplementedError

    # --- declarations

    def union(self) -> tuple[tuple[str, str], ...]:
        """Members of a union, of numbers and bits."""
        return tuple((f"m{n}", self.pick(("BOOL", *NUMBERS))) for n in range(self.random.randrange(2, 5)))

    def global_variables(self) -> tuple[Variable, ...]:
        rows = [self.variable("VAR_GLOBAL", f"g{n}", self.kind()) for n in range(self.random.randrange(1, 4))]
        return *rows, self.variable("VAR_GLOBAL", "g9", "BOOL")

    def tasks(self) -> tuple[Task, ...]:
        """Two tasks or three, of different priorities, over one program."""
        rows = [Task("I0", 1, 10), Task("I1", 3, self.pick((10, 20, 30)))]
        if self.one_in(2):
            rows.append(Task("I2", 2, self.pick((0, 20)), "g9"))
        return tuple(self.random.sample(rows, len(rows)))

    def located_variables(self) -> list[Variable]:
        """Variables over some words of areas, which overlap now and then."""
        rows = []
        for number in range(self.pick((0, 0, 2, 4))):
            area, name = self.pick(("%M", *WORD_AREAS)), f"l{number}"
            first = 2 * (FIRST_WORD + self.random.randrange(WORDS))
            kind = self.pick(("BOOL", "BOOL", *NUMBERS, *NUMBERS, *DURATIONS))
            if kind == "BOOL":
                bit = self.random.randrange(8 if area == "%M" else 16)
                rows.append(Variable("VAR", name, "BOOL", "BOOL", None, (area, first + bit // 8, bit % 8)))
            elif area == "%M" or BITS[kind] > 8:
                size = width_bytes(kind)
                first -= first % size if area == "%M" else 0
                whole = kind if self.one_in(2) else f"ARRAY 0 {self.random.randrange(3)} {kind}"
                written = kind if whole == kind else array_text(whole)
                rows.append(Variable("VAR", name, written, whole, None, (area, first, None)))
        return rows

    def references(self, rows: list[Variable]) -> list[Variable]:
        """References of each sort, most of them to types that variables have."""
        kinds = [row.kind for row in rows if row.kind in COMMON] or ["INT"]
        elements = [row.kind.split(" ", 3)[3] for row in rows if row.kind.startswith("ARRAY")]
        elements = [kind for kind in elements if kind in NUMBERS] or ["INT"]
        found = [(f"r{n}", "REF_TO", "REF", self.pick(kinds)) for n in range(2)]
        found.append(("y0", "REFERENCE TO", "REFERENCE", self.pick(kinds)))
        found += [(f"z{n}", "POINTER TO", "PTR", self.pick(elements)) for n in range(2)]
        return [Variable("VAR", name, f"{words} {kind}", f"{sort} {kind}") for name, words, sort, kind in found]

    # --- pointers

    def behind(self, place: Node, sort: str) -> Node:
        """What a reference leads to; of a pointer also elements beside it."""
        kind = place[1].partition(" ")[2]
        if sort == "PTR" and self.one_in(3):
            return "beside", kind, place, self.random.randrange(-1, 2)
        return "through" if sort == "REFERENCE" else "deref", kind, place

    def point(self, wanted: Node | None = None) -> Node | None:
        """A pointer to a variable or an element of it, moved now and then, or to what ends with the call."""
        pointers = [place for place in self.writable if place[1].startswith("PTR ") and place[0] == "name"
                    and wanted in (None, place)]
        if not pointers:
            return None
        pointer = self.pick(pointers)
        kind = pointer[1][4:]
        if wanted is None and self.one_in(3):
            return self.said("move", pointer, self.random.randrange(-1, 2))
        own = [place for place in self.writable if place[0] == "name" and place[2] not in self.located]
        found: list[Node] = [place for place in own if place[1] == kind]
        for place in own:
            if place[1].startswith("ARRAY") and place[1].split(" ", 3)[3] == kind:
                low, high = map(int, place[1].split()[1:3])
                found.append(("element", kind, place, ("literal", "INT", self.random.randrange(low, high + 1)), low, high))
        return self.said("point", pointer, self.pick(found)) if found else None

    def through(self) -> Node | None:
        """An assignment of what a reference leads to."""
        sorts = ("REF", "PTR", "REFERENCE")
        found = [place for place in self.places if place[1].partition(" ")[0] in sorts]
        if not found or not self.risks:
            return None
        self.risks = 0
        reference = self.pick(found)
        place = self.behind(reference, reference[1].partition(" ")[0])
        target = self.target(place[1])
        if target and self.one_in(2):
            return self.said("assign", target, ("get", place[1], place))
        return self.said("assign", place, self.fitting(place[1], 2)) if reference[0] == "name" else None

    # --- jumps

    def jumping(self, body: tuple[Node, ...]) -> tuple[Node, ...]:
        """The body with a jump over some statements, and one back that is done a few times."""
        at = sorted(self.random.randrange(len(body) + 1) for _ in range(4))
        self.risks = 0
        over = self.said("if", ((self.value("BOOL", 2), (self.said("jump", "over"),)),), ())
        count: Node = ("name", "INT", "j0")
        again = ("binary", "BOOL", "AND", ("compare", "BOOL", "<", ("get", "INT", count),
                                           ("literal", "INT", self.random.randrange(1, 4))), self.value("BOOL", 2))
        reset = self.said("assign", count, ("literal", "INT", 0))
        more = self.said("assign", count, ("binary", "INT", "+", ("get", "INT", count), ("literal", "INT", 1)))
        back = self.said("if", ((again, (more, self.said("jump", "again"))),), ())
        if self.one_in(2):
            return (reset, *body[:at[0]], self.said("label", "again"), *body[at[0]:at[1]], over, *body[at[1]:at[2]],
                    self.said("label", "over"), *body[at[2]:at[3]], back, *body[at[3]:])
        return (*body[:at[0]], over, *body[at[0]:at[3]], self.said("label", "over"), *body[at[3]:])

    # --- POUs of their own kind

    def generic(self, name: str) -> Pou:
        """A function of a generic type."""
        kind = self.pick(GENERIC)
        rows = [Variable("VAR_INPUT", f"p{n}", kind, kind) for n in range(self.random.randrange(1, 4))]
        places: list[Node] = [("get", kind, ("name", kind, row.name)) for row in rows]
        places.append(("get", kind, ("name", kind, name)))
        body = [self.said("assign", ("name", kind, name), self.generic_value(kind, places[:-1], 2))]
        test = ("compare", "BOOL", self.pick(("<", "=", ">=")), *(self.generic_value(kind, places, 1) for _ in range(2)))
        other = self.said("assign", ("name", kind, name), self.generic_value(kind, places, 2))
        body.append(self.said("if", ((test, (other,)),), ()))
        return Pou("FUNCTION", name, kind, tuple(rows), tuple(body))

    def generic_value(self, kind: str, places: list[Node], depth: int) -> Node:
        if depth == 0 or self.one_in(4):
            return self.either(*places)
        a, b, c = (self.generic_value(kind, places, depth - 1) for _ in range(3))
        chosen = self.either(("call", kind, "MAX", (a, b)), ("call", kind, "MIN", (a, b, c)), ("call", kind, "LIMIT", (a, b, c)),
                             ("call", kind, "SEL", (("compare", "BOOL", "<>", a, b), b, c)))
        if kind == "ANY_NUM":
            return self.either(chosen, ("binary", kind, self.pick("+-*"), a, b), ("call", kind, "ABS", (a,)))
        if kind == "ANY_BIT":
            return self.either(chosen, ("binary", kind, self.pick(("AND", "OR", "XOR")), a, b), ("unary", kind, "NOT", a))
        return chosen

    def open_function(self, name: str) -> Pou:
        """A function that goes through an array of any bounds."""
        kind = self.pick((*INTEGERS, *REALS))
        self.open_kinds.append(kind)
        array, count = ("name", f"OPEN {kind}", "a"), ("name", "DINT", "i0")
        element = ("element", kind, array, ("get", "DINT", count), None, None)
        chosen = ("element", kind, array, ("get", "INT", ("name", "INT", "p0")), None, None)
        result = ("name", kind, name)
        used: list[Node] = [("get", kind, place) for place in (element, result)]
        body = self.said("assign", self.pick((element, result)), self.either(
            ("binary", kind, self.pick("+-*"), *used), ("call", kind, "MAX", tuple(used)), self.literal(kind)))
        bounds = [("bound", "DINT", side, "a") for side in ("LOWER", "UPPER")]
        loop = self.said("for", count, *bounds, None, (body, self.said("assign", result, self.either(*used))))
        last = self.said("assign", result, ("binary", kind, "+", ("get", kind, chosen), ("get", kind, result)))
        rows = (Variable("VAR_IN_OUT", "a", f"ARRAY [*] OF {kind}", f"OPEN {kind}"), Variable("VAR_INPUT", "p0", "INT", "INT"),
                Variable("VAR", "i0", "DINT", "DINT"))
        return Pou("FUNCTION", name, kind, rows, (loop, last) if self.one_in(2) else (loop,))

    def open_call(self) -> Node | None:
        """A call of that function, for a variable that it does not touch."""
        functions = [pou for pou in self.pous if pou.name == "Whole"]
        if not functions:
            return None
        pou = functions[0]
        arrays = [place for place in self.writable if place[1].startswith("ARRAY") and place[2] not in self.located
                  and place[1].split(" ", 3)[3] == pou.result]
        targets = [place for place in self.writable if place[:2] == ("name", pou.result)]
        if not arrays or not targets:
            return None
        array = self.pick(arrays)
        self.risks = 0
        index = self.value("INT", 1) if self.one_in(3) else ("literal", "INT", int(array[1].split()[self.pick((1, 2))]))
        return self.said("open", self.pick(targets), pou.name, array, index)

    def of_anything(self, name: str) -> Pou:
        """A function block that looks at bytes of any variable."""
        rows = (Variable("VAR_IN_OUT", "x", "ANY", "ANY"), Variable("VAR_INPUT", "p0", "DINT", "DINT"),
                Variable("VAR_INPUT", "p1", "BYTE", "BYTE"), Variable("VAR_OUTPUT", "q0", "DINT", "DINT"),
                Variable("VAR_OUTPUT", "q1", "BYTE", "BYTE"))
        return Pou("FUNCTION_BLOCK", name, "", rows, (self.said("any"),))

    def whole(self) -> list[Node]:
        raise NotImplementedError

    def anything(self) -> Node | None:
        """A variable of numbers, or an array of them."""
        found = [place for place in self.whole() if place[0] == "name" and place[1].split()[-1] in (*INTEGERS, *DURATIONS)
                 and place[1].partition(" ")[0] in ("ARRAY", place[1])]
        return self.pick(found) if found else None

    def ladder(self, name: str) -> Pou:
        """A function block of rungs."""
        rows = [Variable("VAR_INPUT", f"p{n}", "BOOL", "BOOL") for n in range(3)]
        rows += [Variable("VAR_OUTPUT", f"q{n}", "BOOL", "BOOL") for n in range(2)]
        rows += [Variable("VAR", f"v{n}", "BOOL", "BOOL") for n in range(3)]
        read, written = [row.name for row in rows], [row.name for row in rows[3:]]
        steps: list[tuple[str, str]] = []
        for _ in range(self.random.randrange(1, 6)):
            steps += self.rung(read, written)
        return Pou("FUNCTION_BLOCK", name, "", tuple(rows), (self.said("ladder", tuple(steps)),))

    def rung(self, read: list[str], written: list[str]) -> list[tuple[str, str]]:
        steps = self.contacts(read)
        if self.one_in(3):
            steps += [*self.contacts(read), (self.pick(("ANDLD", "ORLD")), "")]
        if self.one_in(6):
            steps.append((self.pick(("UP", "DOWN", "NOT")), ""))
        if self.one_in(5):
            return [*steps, *self.contacts(read), ("KEEP", self.pick(written))]
        outputs = ("OUT", "OUT", "OUTNOT", "SET", "RSET", "@SET", "%RSET", "DIFU", "DIFD")
        steps += [(self.pick(outputs), self.pick(written)) for _ in range(self.random.randrange(1, 3))]
        return steps

    def contacts(self, read: list[str]) -> list[tuple[str, str]]:
        """A block of contacts."""
        def edge() -> str:
            return str(self.pick(("", "", "", "@", "%")))

        steps = [(edge() + str(self.pick(("LD", "LDNOT"))), self.pick(read))]
        more = CONTACTS[1:3] + CONTACTS[4:]
        steps += [(edge() + str(self.pick(more)), self.pick(read)) for _ in range(self.random.randrange(3))]
        return steps

    def pin(self, row: Variable) -> Node:
        """The value of an input."""
        if row.name == "PT" and row.kind == "TIME":
            return "literal", "TIME", self.pick(PRESETS_NS)
        if row.name == "PV":
            return "literal", "INT", self.pick((0, 1, 2, 3, -1, 32767))
        if row.kind == "DINT" and self.one_in(2):
            return "literal", "DINT", self.random.randrange(9)
        return self.fitting(row.kind.split()[0], 2)
