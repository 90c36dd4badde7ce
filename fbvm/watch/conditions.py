"""Conditions about a running PLC: `Main.done AND D200 >= 5`, `NOT CIO 1509.15 OR Main.timer.ET > 1.5s`.

Operators and precedence as in Structured Text: OR, XOR, AND or &, = <>, < <= > >=, + -, * / MOD, NOT and minus.  Names
are paths or addresses as `paths` reads them.  Numbers are exact integers or floats: nothing wraps, and `/` of
integers truncates toward zero.  Reads only, never calls.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from fbvm.base.types import BOOL, Elementary, EnumType, StringType, Type, base
from fbvm.watch.paths import Place, Span, UnknownPlace
from fbvm.watch.values import Value, conform, literal

Read = Callable[[Place], Value]
Find = Callable[[str], Place | Span]


class ConditionError(ValueError):
    """The text is no condition; the message says why."""


_TOKEN = re.compile(
    r"\s*(?:"
    r"(?P<text>'[^']*'|\"[^\"]*\")"
    r"|(?P<literal>(?:[A-Z_]+#)?(?:(?:2|8|16)#[0-9A-F_]+|0x[0-9A-F_]+)"
    r"|(?:TIME|LTIME|LT|T)#-?[\d._a-z]+"
    r"|(?:[A-Z_]+#)?\d[\d_]*(?:\.\d+)?(?:(?:ms|us|ns|d|h|m|s)[\d_.dhmsun]*|e[+-]?\d+)?)"
    r"|(?P<place>%\s*[^\W\d]*\d+(?:\.\d+)?|CIO\s*\d+(?:\.\d+)?|[^\W\d]\w*\s*:\s*\d+(?:\.\d+)?"
    r"|[^\W\d]\w*(?:\s*\[[^\]]*\]|\s*\.\s*%?\w+|\s*\^|\#\w+)*)"
    r"|(?P<sign><=|>=|<>|:=|[-+*/=<>&()])"
    r")",
    re.I,
)  # fmt: skip
DEEPEST = 50
"""Parentheses and NOTs within each other."""
_WORDS = frozenset(("AND", "OR", "XOR", "NOT", "MOD", "TRUE", "FALSE"))


def _tokens(text: str) -> Iterator[tuple[str, str]]:
    at = 0
    while at < len(text.rstrip()):
        match = _TOKEN.match(text, at)
        if not match:
            raise ConditionError(f"{text[at:].strip()[:20]!r} is not understood in {text!r}")
        kind, word = match.lastgroup or "", match[0].strip()
        if kind == "place" and word.upper() in _WORDS:
            kind, word = "word", word.upper()
        yield kind, word
        at = match.end()


@dataclass(frozen=True)
class Term:
    """A part of a condition: its value as a function of reading, the type of its place if it is one."""

    value: Callable[[Read], Value]
    type: Type | None
    boolean: bool


@dataclass(frozen=True)
class Condition:
    """A parsed condition and the places it names."""

    text: str
    term: Term

    def holds(self, read: Read) -> bool:
        """True if the condition is TRUE now.  What cannot be computed (1 / 0, a null reference) is FALSE."""
        try:
            return self.term.value(read) is True
        except (ZeroDivisionError, OverflowError, TypeError):
            return False


def parse_condition(text: str, find: Find) -> Condition:
    """The condition that `text` writes.  Raises ConditionError."""
    parser = _Parser(text, find)
    term = parser.level(0)
    if parser.kind:
        raise ConditionError(f"{parser.word!r} is not expected in {text!r}")
    if not term.boolean:
        raise ConditionError(f"{text!r} is no condition: it is not BOOL; compare it with something")
    return Condition(text, term)


def _quotient(a: int | float, b: int | float) -> int | float:
    if isinstance(a, int) and isinstance(b, int):
        return abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)
    return a / b


def _remainder(a: int, b: int) -> int:
    return abs(a) % abs(b) * (-1 if a < 0 else 1)


_LEVELS: tuple[dict[str, Callable[..., Value]], ...] = (
    {"OR": operator.or_},
    {"XOR": operator.xor},
    {"AND": operator.and_, "&": operator.and_},
    {"=": operator.eq, "<>": operator.ne},
    {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge},
    {"+": operator.add, "-": operator.sub},
    {"*": operator.mul, "/": _quotient, "MOD": _remainder},
)
_LEVEL_OF = {sign: number for number, signs in enumerate(_LEVELS) for sign in signs}
_COMPARES = frozenset(("=", "<>", "<", "<=", ">", ">="))
_LOGIC = frozenset(("OR", "XOR", "AND", "&"))


class _Parser:
    def __init__(self, text: str, find: Find) -> None:
        self.text = text
        self.find = find
        self.rest = list(_tokens(text))
        self.depth = 0

    @property
    def kind(self) -> str:
        return self.rest[0][0] if self.rest else ""

    @property
    def word(self) -> str:
        return self.rest[0][1] if self.rest else ""

    def level(self, loosest: int) -> Term:
        """Operators of level `loosest` and those that bind closer."""
        left = self.unary()
        while self.kind in ("word", "sign") and _LEVEL_OF.get(self.word, -1) >= loosest:
            sign = self.rest.pop(0)[1]
            level = _LEVEL_OF[sign]
            left = self._pair(sign, _LEVELS[level][sign], left, self.level(level + 1))
        return left

    def _pair(self, sign: str, function: Callable[..., Value], left: Term, right: Term) -> Term:
        if sign in _LOGIC and not (left.boolean and right.boolean):
            raise ConditionError(f"{sign} joins conditions; one side is not BOOL in {self.text!r}")
        if sign in _COMPARES:
            left, right = self._fitted(left, right), self._fitted(right, left)
            if left.boolean != right.boolean:
                raise ConditionError(f"{sign} compares BOOL with something else in {self.text!r}")
        elif sign not in _LOGIC and (left.boolean or right.boolean):
            raise ConditionError(f"{sign} needs numbers in {self.text!r}")
        boolean = sign in _COMPARES or sign in _LOGIC
        return Term(lambda read: function(left.value(read), right.value(read)), None, boolean)

    def _fitted(self, term: Term, other: Term) -> Term:
        """A literal beside a place of an enumeration or of BOOL takes that type."""
        if other.type is None or term.type is not None:
            return term
        if not isinstance(base(other.type), EnumType) and base(other.type) is not BOOL:
            return term
        try:
            value = conform(other.type, term.value(_nothing), self.text)
        except TypeError as error:
            raise ConditionError(str(error)) from None
        except ValueError:
            return term
        return Term(lambda read: value, None, isinstance(value, bool))

    def unary(self) -> Term:
        if not self.rest:
            raise ConditionError(f"{self.text!r} ends too early")
        kind, word = self.rest.pop(0)
        self.depth += 1
        if self.depth > DEEPEST:
            raise ConditionError("the condition is nested too deep")
        try:
            if word == "NOT" and kind == "word":
                inner = self.unary()
                if not inner.boolean:
                    raise ConditionError(f"NOT needs a BOOL in {self.text!r}")
                return Term(lambda read: not inner.value(read), None, True)
            if word in ("-", "+") and kind == "sign":
                inner = self.unary()
                return Term(lambda read: _signed(word, inner.value(read)), None, inner.boolean)
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
        if kind in ("literal", "text", "word") and word not in ("AND", "OR", "XOR", "MOD"):
            try:
                value, _ = literal(word)
            except ValueError as error:
                raise ConditionError(str(error)) from None
            return Term(lambda read: value, None, isinstance(value, bool))
        raise ConditionError(f"{word!r} is not expected in {self.text!r}")

    def _named(self, word: str) -> Term:
        if "#" in word:
            member = word.rpartition("#")[2]
            return Term(lambda read: member, None, False)
        try:
            place = self.find(word)
        except UnknownPlace as error:
            raise ConditionError(str(error)) from None
        kind = place.type if isinstance(place, Place) else None
        if not isinstance(place, Place) or not isinstance(base(place.type), Elementary | StringType | EnumType):
            raise ConditionError(f"{word} is no single value and cannot be compared")
        return Term(lambda read: read(place), kind, base(place.type) is BOOL)


def _signed(sign: str, value: Value) -> Value:
    return -value if sign == "-" and isinstance(value, int | float) else value


def _nothing(place: Place) -> Value:
    raise TypeError(f"{place.name} is not constant")
