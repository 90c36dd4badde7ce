"""Values on wires: expressions of Structured Text with their precedence and the variables that they read."""

from __future__ import annotations

import re
from dataclasses import dataclass

from fbvm.interchange.plcopen.schema import SIGNS
from fbvm.interchange.plcopen.texts import squeezed

LOOSE, OR, XOR, AND, EQUAL, COMPARE, ADD, MULTIPLY, UNARY, CALL, ATOM = range(11)
"""How tightly an operator binds, the weakest first (IEC 61131-3 table 71); a name or a literal is an atom."""
_LEVELS = {"OR": OR, "XOR": XOR, "AND": AND, "=": EQUAL, "<>": EQUAL, "<": COMPARE, ">": COMPARE, "<=": COMPARE, ">=": COMPARE,
           "+": ADD, "-": ADD, "*": MULTIPLY, "/": MULTIPLY, "MOD": MULTIPLY}
INFIX = {name: (sign, _LEVELS[sign]) for name, sign in SIGNS.items()}
"""Functions that are written as operators."""
CHAINED = ("OR", "XOR", "AND", "ADD", "MUL")
"""Those that take more than two inputs."""
EXTENSIBLE = (*CHAINED, "GT", "GE", "EQ", "LE", "LT", "MAX", "MIN", "CONCAT")
"""Functions that take two inputs or more (IEC 61131-3 tables 29 to 34); the index of MUX makes it another case."""
_ATOM = re.compile(r"[\w.#%\[\]^]+|'[^']*'|\"[^\"]*\"")


class Unexecutable(Exception):
    """The network cannot be executed; the arguments are the object, a message and a hint."""


@dataclass(frozen=True)
class Value:
    """An expression as text, the level of its operator, and the roots of the variables that it reads (`Scope.roots`)."""

    text: str
    level: int = ATOM
    reads: frozenset[str] = frozenset()

    def at(self, level: int) -> str:
        """The text as an operand of an operator of that level: in parentheses if it binds more loosely."""
        return self.text if self.level >= level else f"({self.text})"

    @property
    def is_true(self) -> bool:
        return self.text == "TRUE"

    @property
    def is_false(self) -> bool:
        return self.text == "FALSE"


TRUE, FALSE = Value("TRUE"), Value("FALSE")


def variable(name: str) -> Value:
    """The value of a variable that the import has declared."""
    return Value(name, ATOM, frozenset((name.upper(),)))


def written(text: str, reads: frozenset[str]) -> Value:
    """The value of an expression that stands in the document."""
    text = squeezed(text)
    return Value(text, ATOM if _ATOM.fullmatch(text) else LOOSE, reads)


def joined(name: str, values: list[Value]) -> Value:
    """Two or more values with an operator between them."""
    sign, level = INFIX[name]
    texts = [values[0].at(level), *(value.at(level if name in ("OR", "XOR", "AND") else level + 1) for value in values[1:])]
    return Value(f" {sign} ".join(texts), level, frozenset().union(*(value.reads for value in values)))


def either(values: list[Value]) -> Value:
    """A wired OR of any number of values; FALSE of none."""
    left = [value for value in values if not value.is_false]
    if any(value.is_true for value in left):
        return TRUE
    return joined("OR", left) if len(left) > 1 else left[0] if left else FALSE


def both(first: Value, second: Value) -> Value:
    """The AND of two values: contacts in series."""
    if first.is_false or second.is_false:
        return FALSE
    return second if first.is_true else first if second.is_true else joined("AND", [first, second])


def negation(value: Value) -> Value:
    """The inverse of a BOOL value."""
    if value.is_true or value.is_false:
        return FALSE if value.is_true else TRUE
    if value.level == UNARY and value.text.startswith("NOT "):
        return Value(value.text[4:], ATOM if _ATOM.fullmatch(value.text[4:]) else LOOSE, value.reads)
    return Value(f"NOT {value.at(UNARY)}", UNARY, value.reads)
