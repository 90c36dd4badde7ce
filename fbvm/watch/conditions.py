"""Conditions about a running PLC: `Main.done AND D200 >= 5`, `NOT CIO 1509.15 OR Main.timer.ET > 1.5s`.

Operators and precedence as in Structured Text: OR, XOR, AND or &, = <>, < <= > >=, + -, * / MOD, NOT and minus.  Names
are paths or addresses as `paths` reads them, also members of the enumeration on the other side.  Integers are exact:
nothing wraps, and `/` truncates toward zero; what is computed with a REAL is a REAL.  Reads only, never calls.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fbvm.base.types import Elementary, EnumType, StringType, base, fold
from fbvm.syntax.st.literals import ELEMENTARY
from fbvm.watch.paths import Place, Span, UnknownPlace
from fbvm.watch.scanner import ConditionError as ConditionError
from fbvm.watch.scanner import tokens
from fbvm.watch.terms import LEVEL_OF, Read, Term, inverted, literal_term, pair, signed
from fbvm.watch.values import sort_of

Find = Callable[[str], Place | Span]
DEEPEST, MOST_OPERATORS = 50, 250
"""Parentheses and NOTs within each other; operators of two operands in one condition, which may stand in one row."""


@dataclass(frozen=True)
class Condition:
    """A parsed condition and the places it names."""

    text: str
    term: Term
    places: tuple[Place, ...] = ()

    def holds(self, read: Read) -> bool:
        """True if the condition is TRUE now.  What cannot be computed (1 / 0, a null reference) is FALSE."""
        try:
            return self.term.value(read) is True
        except (ArithmeticError, TypeError):
            return False


def parse_expression(text: str, find: Find) -> Term:
    """The expression that `text` writes, of any type.  Raises ConditionError."""
    parser = _Parser(text, find)
    term = parser.level(0).resolved()
    if parser.kind:
        raise ConditionError(f"{parser.word!r} is not expected in {text!r}")
    return term


def parse_condition(text: str, find: Find) -> Condition:
    """The condition that `text` writes.  `find` finds places by name.  Raises ConditionError for a text that is no condition, or
    a comparison that can never hold."""
    parser = _Parser(text, find)
    term = parser.level(0).resolved()
    if parser.kind:
        raise ConditionError(f"{parser.word!r} is not expected in {text!r}")
    if term.sort != "BOOL":
        raise ConditionError(f"{text!r} is no condition: it is not BOOL; compare it with something")
    return Condition(text, term, tuple(parser.places))


def split_condition(text: str) -> tuple[str, str]:
    """A place and the condition behind the word IF, "" without one.

    >>> split_condition("pump.st:12 IF Main.n > 5"), split_condition("CIO 0.00")
    (('pump.st:12', 'Main.n > 5'), ('CIO 0.00', ''))
    """
    words = text.split()
    at = next((number for number, word in enumerate(words) if word.upper() == "IF"), len(words))
    return " ".join(words[:at]), " ".join(words[at + 1:])


class _Parser:
    def __init__(self, text: str, find: Find) -> None:
        self.text = text
        self.find = find
        self.rest = list(tokens(text))
        self.places: list[Place] = []
        self.depth = 0
        self.operators = 0

    @property
    def kind(self) -> str:
        return self.rest[0][0] if self.rest else ""

    @property
    def word(self) -> str:
        return self.rest[0][1] if self.rest else ""

    def level(self, loosest: int) -> Term:
        """Operators of level `loosest` and those that bind closer."""
        left = self.unary()
        while self.kind in ("word", "sign") and LEVEL_OF.get(self.word, -1) >= loosest:
            sign = self.rest.pop(0)[1]
            self.operators += 1
            if self.operators > MOST_OPERATORS:
                raise ConditionError(f"the condition has more than {MOST_OPERATORS} operators")
            left = pair(sign, left, self.level(LEVEL_OF[sign] + 1), self.text)
        return left

    def unary(self) -> Term:
        """A term with the signs and NOTs before it."""
        if not self.rest:
            raise ConditionError(f"{self.text!r} ends too early")
        kind, word = self.rest.pop(0)
        self.depth += 1
        if self.depth > DEEPEST:
            raise ConditionError("the condition is nested too deep")
        try:
            if word == "NOT" and kind == "word":
                return inverted(self.unary(), self.text)
            if word in ("-", "+") and kind == "sign":
                return signed(word, self.unary(), self.text)
            return self._atom(kind, word)
        finally:
            self.depth -= 1

    def _atom(self, kind: str, word: str) -> Term:
        if word == "(" and kind == "sign":
            inner = self.level(0)
            if self.word != ")":
                raise ConditionError(f"a parenthesis is not closed in {self.text!r}")
            self.rest.pop(0)
            return inner
        if kind == "place":
            return self._named(word)
        if kind in ("literal", "text") or word in ("TRUE", "FALSE"):
            return literal_term(word)
        raise ConditionError(f"{word!r} is not expected in {self.text!r}")

    def _named(self, word: str) -> Term:
        prefix, mark, _ = word.partition("#")
        if mark and fold(prefix) in ELEMENTARY:
            return literal_term(word)
        try:
            place = self.find(word)
        except UnknownPlace as error:
            if fold(word) in ("ON", "OFF"):
                return literal_term(word)
            reason = f"{word} stands beside nothing of its enumeration in {self.text!r}" if mark else str(error)
            return Term(word, lambda read: None, "", unknown=reason)
        if not isinstance(place, Place) or not isinstance(base(place.type), Elementary | StringType | EnumType):
            raise ConditionError(f"{word} is no single value and cannot be compared")
        self.places.append(place)
        return Term(word, lambda read: read(place), sort_of(place.type), place.type, place=place)
