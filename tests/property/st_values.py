"""Expressions made at random, of a type that is wanted: `Maker` of `st_making` is one of these."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from random import Random
from typing import Any

from st_kinds import (
    BIT_STRINGS,
    BITS,
    CHARACTERS,
    COMMON,
    DATES,
    DAY_NS,
    DAYS,
    DAYTIMES,
    DURATIONS,
    GENERIC,
    INTEGERS,
    MATH,
    MEMBERS,
    MOMENTS,
    NUMBERS,
    RARE,
    REALS,
    SIGNED,
    TEXTS,
    WIDER,
    Node,
    Pou,
    limits,
    plain,
)

TEXT_LITERALS = ("", "a", "Pump", "x$y'z", "0123456789", "AB" * 9, "B", "\xe9\"")
NUMERALS = ("0", " 42 ", "-7", "16#1F", "INT#5", "1e2", "x1", "", "300", "99999999999999999999", "TRUE", "2.5", "+3", "1_000")
"""Texts that conversions to numbers read, or do not."""
DAY_NUMBERS = (0, 1, 59, 11_016, 19_782, 25_000, -1, -400)
NANOSECONDS = (0, 1, -1, 10**9, 1_500_000, -250_000_000, 3600 * 10**9, 7, 10_000_000, DAY_NS - 1)


@dataclass
class Values:
    """Makes expressions over the places of the POU that is being made."""

    random: Random
    structs: dict[str, tuple[tuple[str, str], ...]] = field(default_factory=dict)
    pous: list[Pou] = field(default_factory=list)
    places: list[Node] = field(default_factory=list)
    risks: int = 0
    """How many operations that can trap may still come in this statement."""

    def pick(self, items: Iterable[Any]) -> Any:
        return self.random.choice(tuple(items))

    def either(self, *nodes: Node) -> Node:
        return self.random.choice(nodes)

    def one_in(self, count: int) -> bool:
        return not self.random.randrange(count)

    def kind(self, texts: bool = True) -> str:
        """A type, the common ones more often."""
        found = str(self.pick(RARE if self.one_in(5) else COMMON))
        return found if texts or found not in TEXTS else "INT"

    def risky(self, one_in: int) -> bool:
        """True if an operation that can trap may come here, and does."""
        if self.risks <= 0 or not self.one_in(one_in):
            return False
        self.risks -= 1
        return True

    def place(self, kind: str, rows: list[Node], whole: bool = False) -> Node | None:
        raise NotImplementedError

    # --- values

    def literal(self, kind: str) -> Node:
        if kind == "BOOL":
            return "literal", kind, self.one_in(2)
        if kind == "E0":
            return "literal", kind, self.pick(MEMBERS)
        if kind in TEXTS:
            return "literal", kind, self.pick((*TEXT_LITERALS, *(("\u20ac1",) if kind == "WSTRING" else ())))
        if kind in CHARACTERS:
            return "literal", kind, self.pick("aZ0$\xe9")
        if kind in REALS:
            number = self.pick((0.0, 1.0, -1.5, 0.1, 2.5, 1e10, -1e-10, 3.0e38, 1e-40, 255.5, 32767.5, 0.5))
            return "literal", kind, number
        if kind in DURATIONS:
            return "literal", kind, self.pick(NANOSECONDS)
        if kind in DATES:
            day = self.pick(DAY_NUMBERS) * DAY_NS if kind not in DAYTIMES else 0
            second = self.pick((0, 1, 86_399, 43_200)) * 10**9 + self.pick((0, 0, 500_000_000, 1)) if kind not in DAYS else 0
            return "literal", kind, day + second
        low, high = limits(kind)
        number = self.pick((0, 1, 2, -1, 7, 100, low, high, low + 1, high // 2, 10**9, -1000, 86_400_000))
        return "literal", kind, number if low <= number <= high else self.pick((low, high))

    def value(self, kind: str, depth: int) -> Node:
        """A value of a type.  Constant expressions are rare: the compiler refuses those that trap."""
        node = self.operation(kind, depth)
        if node[0] not in ("literal", "get") and not self.one_in(8) and "'name'" not in repr(node) and "'user'" not in repr(node):
            return self.literal(kind)
        return node

    def fitting(self, kind: str, depth: int) -> Node:
        """A value of a type, or one that converts to it by itself."""
        narrow = [source for source, wider in WIDER.items() if kind in wider]
        if narrow and self.one_in(5):
            return "widen", kind, self.value(self.pick(narrow), depth)
        return self.value(kind, depth)

    def operation(self, kind: str, depth: int) -> Node:
        if depth <= 0 or self.one_in(4):
            place = None if self.one_in(3) else self.place(kind, self.places)
            return ("get", kind, place) if place else self.literal(kind)
        if self.one_in(9):
            return self.chosen(kind, depth - 1)
        functions = [pou for pou in self.pous if pou.kind == "FUNCTION" and not any(
            row.section == "VAR_IN_OUT" for row in pou.variables) and kind in GENERIC.get(pou.result, (pou.result,))]
        if functions and self.one_in(3):
            pou = self.pick(functions)
            taken = [row for row in pou.variables if row.section == "VAR_INPUT"]
            enabled = pou.result not in GENERIC and self.one_in(4)
            if enabled:
                self.risks = 0  # no rule says whether operands are worked out where EN is FALSE
            operands = tuple(self.value(kind if row.kind in GENERIC else plain(row.kind), depth - 2) for row in taken)
            if enabled:
                return "enabled", kind, pou.name, (self.value("BOOL", 1), *operands)
            return "user", kind, pou.name, operands
        return self.made(kind, depth - 1)

    def made(self, kind: str, d: int) -> Node:
        """An operation that yields the type."""
        if kind == "BOOL":
            return self.truth(d)
        if kind in TEXTS:
            return self.text(kind, d)
        if kind in CHARACTERS:
            return self.character(kind, d)
        if kind in DURATIONS:
            return self.duration(kind, d)
        if kind in DATES:
            return self.date(kind, d)
        return self.real(kind, d) if kind in REALS else self.number(kind, d)

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

    def enumerated(self, d: int) -> Node:
        """A value of the enumeration."""
        place = self.place("E0", self.places)
        if place is None or self.one_in(3):
            return self.literal("E0")
        if d > 0 and self.one_in(2):
            return "call", "E0", "SEL", (self.value("BOOL", d), self.enumerated(d - 1), self.enumerated(d - 1))
        return "get", "E0", place

    # --- numbers

    def number(self, kind: str, d: int) -> Node:
        v, what = self.value, self.random.randrange(14)
        if what == 12 and (read := self.numeral(kind)):
            return read
        if what == 13:
            return ("named", kind, self.enumerated(d)) if kind == "INT" and self.one_in(2) else self.of_times(kind, d)
        if kind in BIT_STRINGS:
            return self.bits(kind, d)
        if what < 4:
            return "binary", kind, self.pick("+-*"), v(kind, d), self.fitting(kind, d)
        if what == 4:
            divisor = v(kind, d) if self.risky(1) else ("literal", kind, self.pick((1, 2, 3, 7)))
            return "binary", kind, self.pick(("/", "MOD")), v(kind, d), divisor
        if what == 5 and kind in SIGNED:
            return self.either(("unary", kind, "-", v(kind, d)), ("call", kind, "ABS", (v(kind, d),)))
        if what == 6 and kind == "INT":
            text = self.pick(TEXTS)
            return self.either(("call", kind, "LEN", (v(text, d),)), ("call", kind, "FIND", (v(text, d), v(text, d))),
                               ("widen", kind, ("call", "USINT", "DAY_OF_WEEK", (v("DATE", d),))))
        if what == 7 and self.risky(1):
            source = self.pick(REALS)
            return self.either(("convert", kind, v(source, d)), ("truncate", kind, v(source, d)))
        if what == 8 and kind not in SIGNED and self.risky(1):
            return "bcd", kind, v(self.pick(BIT_STRINGS), d)
        return self.converted(kind, (*INTEGERS, *BIT_STRINGS, "BOOL"), d)

    def bits(self, kind: str, d: int) -> Node:
        v, what = self.value, self.random.randrange(12)
        if what < 5:
            return "binary", kind, self.pick(("AND", "OR", "XOR", "&")), v(kind, d), self.fitting(kind, d)
        if what < 7:
            return "unary", kind, "NOT", v(kind, d)
        if what < 9:
            count = v("INT", d) if self.risky(2) else self.pick((("literal", "INT", self.random.randrange(70)),
                                                                 ("widen", "INT", v("USINT", d))))
            return "call", kind, self.pick(("SHL", "SHR", "ROL", "ROR")), (v(kind, d), count)
        if what == 9 and self.risky(1):
            return "to_bcd", kind, v(self.pick(("USINT", "UINT", "UDINT")), d)
        if what == 10 and kind in ("DWORD", "LWORD"):
            return "convert", kind, v("REAL" if kind == "DWORD" else "LREAL", d)
        if what == 11 and kind in ("BYTE", "WORD"):
            return "convert", kind, v("CHAR" if kind == "BYTE" else "WCHAR", d)
        return self.converted(kind, (*INTEGERS, *BIT_STRINGS, "BOOL"), d)

    def of_times(self, kind: str, d: int) -> Node:
        """Times as numbers: milliseconds in 32 bits, nanoseconds of long types in 64."""
        if kind in ("DINT", "UDINT", "DWORD"):
            return "convert", kind, self.value("TIME", d)
        if kind in ("LINT", "ULINT", "LWORD"):
            return "convert", kind, self.value("LTIME", d)
        return self.converted(kind, (*INTEGERS, *BIT_STRINGS, "BOOL"), d)

    def numeral(self, kind: str) -> Node | None:
        """A number that is read from a text, which is no constant."""
        place = self.place("BOOL", self.places)
        if place is None or not self.risky(1):
            return None
        texts = tuple(("literal", "STRING", self.pick(NUMERALS)) for _ in range(2))
        return "convert", kind, ("call", "STRING", "SEL", (("get", "BOOL", place), *texts))

    def converted(self, kind: str, sources: Iterable[str], d: int) -> Node:
        return "convert", kind, self.value(self.pick([source for source in sources if source != kind]), d)

    def real(self, kind: str, d: int) -> Node:
        v, what = self.value, self.random.randrange(13)
        if what < 6:
            return "binary", kind, self.pick("+-*/"), v(kind, d), self.fitting(kind, d)
        if what == 6:
            return self.either(("unary", kind, "-", v(kind, d)), ("call", kind, "ABS", (v(kind, d),)))
        if what == 7:
            return "call", kind, self.pick(MATH), (v(kind, d),)
        if what == 8:
            return "binary", kind, "**", v(kind, d), v(kind, d)
        if what == 9:
            return "convert", kind, v("DWORD" if kind == "REAL" else "LWORD", d)
        if what == 10:
            return "call", kind, "ATAN2", (v(kind, d), v(kind, d))
        return self.converted(kind, (*INTEGERS, "BOOL", *REALS), d)

    def truth(self, d: int) -> Node:
        v, what = self.value, self.random.randrange(10)
        if what == 9:
            return "compare", "BOOL", self.pick(("=", "<>")), self.enumerated(1), self.enumerated(1)
        if what < 4:
            kind = self.kind()
            return "compare", "BOOL", self.pick(("=", "<>", "<", "<=", ">", ">=")), v(kind, d), self.fitting(kind, d)
        if what < 7:
            return "binary", "BOOL", self.pick(("AND", "OR", "XOR", "&", "AND_THEN", "OR_ELSE")), v("BOOL", d), v("BOOL", d)
        if what == 7:
            return "unary", "BOOL", "NOT", v("BOOL", d)
        return self.converted("BOOL", NUMBERS, d)

    # --- times

    def duration(self, kind: str, d: int) -> Node:
        v, what = self.value, self.random.randrange(9)
        if what < 3:
            return "binary", kind, self.pick("+-"), v(kind, d), self.fitting(kind, d)
        if what == 3:
            return "binary", kind, "*", v(kind, d), v(self.pick(INTEGERS), d)
        if what == 4:
            factor = v(self.pick(SIGNED), d) if self.risky(2) else ("literal", "INT", self.pick((1, -2, 7)))
            return "binary", kind, "/", v(kind, d), factor
        if what == 5:
            long = "L" if kind == "LTIME" else ""
            dates = long + self.pick(("DATE", "TOD", "DT"))
            return "apart", kind, v(dates, d), v(dates, d)
        if what == 6:
            return self.converted(kind, ("DINT", "INT", "UDINT", "DWORD") if kind == "TIME" else ("LINT", "ULINT", "LWORD"), d)
        if what == 7:
            return self.converted(kind, DURATIONS, d)
        return "unary", kind, "-", v(kind, d)

    def date(self, kind: str, d: int) -> Node:
        """A date of any sort; what is added to moments is small, so that none leaves its 64 bits."""
        v, long = self.value, "L" if kind[0] == "L" else ""
        if self.one_in(3):
            return self.converted(kind, next(sorts for sorts in (DAYS, DAYTIMES, MOMENTS) if kind in sorts), d)
        if kind in DAYS:
            return "convert", kind, v(f"{long}DT", d)
        step = ("literal", f"{long}TIME", self.pick((0, 1, 10**9, 3_600_000_000_000, 7 * DAY_NS, -1, -DAY_NS, 86_399 * 10**9)))
        moved = "moved", kind, self.pick("+-"), v(kind, d), step
        if kind in DAYTIMES:
            return self.either(moved, ("convert", kind, v(f"{long}DT", d)))
        joined = "call", kind, f"CONCAT_DATE_{long}TOD", (v("DATE", d), v(f"{long}TOD", d))
        return self.either(moved, joined, ("convert", kind, v(f"{long}DATE", d)))

    # --- texts

    def text(self, kind: str, d: int) -> Node:
        v, what, d = self.value, self.random.randrange(9), min(d, 2)
        place = ("literal", "INT", self.random.randrange(1, 9))
        length = v("INT", 1) if self.risky(2) else ("literal", "INT", self.random.randrange(0, 9))
        if what == 0:
            return "call", kind, self.pick(("LEFT", "RIGHT")), (v(kind, d), length)
        if what == 1:
            return "call", kind, self.pick(("MID", "DELETE")), (v(kind, d), length, place)
        if what == 2:
            return "call", kind, "INSERT", (v(kind, d), v(kind, d), length)
        if what == 3:
            return "call", kind, "REPLACE", (v(kind, d), v(kind, d), length, place)
        if what == 8 and self.one_in(3):
            return "named", kind, self.enumerated(1)
        if what < 6:
            return "call", kind, "CONCAT", (v(kind, d), v(kind, d))
        sources = (*INTEGERS, *BIT_STRINGS, "BOOL", *REALS, *DURATIONS, *DATES, *TEXTS, "WCHAR" if kind == "WSTRING" else "CHAR")
        return self.converted(kind, sources, d)

    def character(self, kind: str, d: int) -> Node:
        other = {"CHAR": ("STRING", "WCHAR", "BYTE"), "WCHAR": ("WSTRING", "CHAR")}[kind]
        return self.converted(kind, other, d)


def width_bytes(kind: str) -> int:
    """What SIZEOF gives for a number."""
    return max(1, BITS[kind] // 8)
