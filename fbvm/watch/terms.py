"""Terms of conditions: the types of operators, and the type that a literal takes from the other operand.

A literal takes the type of the other operand, as in a program: beside a REAL it is rounded to 32 bits, beside an
enumeration a name is its member.  A comparison that can never hold is an error, with the message of a write.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import cast

from fbvm.base.arithmetic import nearest, quotient, remainder
from fbvm.base.types import BOOL, DATE, DINT, LREAL, REAL, TIME, EnumType, Type, base, common, families, fold
from fbvm.watch.paths import Place
from fbvm.watch.scanner import ConditionError
from fbvm.watch.values import DATES, Value, conform, literal, nearest_real, refusal, sort_of

Read = Callable[[Place], Value]


@dataclass(frozen=True)
class Term:
    """A part of a condition.  `value` computes it from a function that reads places; `sort` is its class (see `sort_of`).

    `type` is None for a literal, which takes the type of the other operand; `constant` is the value of a term without
    variables; `unknown` is the error of a name that is no variable, and may still be a member of an enumeration."""

    text: str
    value: Callable[[Read], Value]
    sort: str
    type: Type | None = None
    constant: Value = None
    place: Place | None = None
    unknown: str = ""
    sign: str = ""
    parts: tuple[Term, ...] = ()
    """The operator, - and NOT of one operand among them, and its operands, for those who do more with a term than compute it."""

    def resolved(self) -> Term:
        """The same term.  Raises ConditionError for a name that is no variable."""
        if self.unknown:
            raise ConditionError(self.unknown)
        return self

    @property
    def described(self) -> str:
        """The type for messages; of a literal its class."""
        return self.type.name if self.type else self.sort if self.sort == "BOOL" else f"a {self.sort.lower()}"


def literal_term(text: str) -> Term:
    """The term of a literal.  Raises ConditionError."""
    try:
        value, shown = literal(text)
    except ValueError as error:
        raise ConditionError(str(error)) from None
    sort = sort_of(shown) if shown else "text" if isinstance(value, str) else "number"
    return Term(text, lambda read: value, sort, shown if sort == "number" else None, value)


def _quotient(a: int | float, b: int | float) -> int | float:
    _refuse_zero(b)
    if isinstance(a, int) and isinstance(b, int):
        return quotient(a, b)
    return a / b


def _remainder(a: int, b: int) -> int:
    _refuse_zero(b)
    return remainder(a, b)


def _refuse_zero(divisor: float) -> None:
    if not divisor:
        raise ZeroDivisionError("division by zero")


LEVELS: tuple[dict[str, Callable[..., Value]], ...] = (
    {"OR": operator.or_},
    {"XOR": operator.xor},
    {"AND": operator.and_, "&": operator.and_},
    {"=": operator.eq, "<>": operator.ne},
    {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge},
    {"+": operator.add, "-": operator.sub},
    {"*": operator.mul, "/": _quotient, "MOD": _remainder},
)
LEVEL_OF = {sign: number for number, signs in enumerate(LEVELS) for sign in signs}
_LOGIC = frozenset(("OR", "XOR", "AND", "&"))
_COMPARES = frozenset(("=", "<>", "<", "<=", ">", ">="))
_COMPUTES: dict[tuple[str, str], tuple[str, Type]] = {
    # sorts of the operands: signs, type of the result (that of numbers follows from the operands)
    ("number", "number"): ("+ - * / MOD", DINT),
    ("time", "time"): ("+ -", TIME),
    ("date", "time"): ("+ -", DATE),
    ("date", "date"): ("-", TIME),
    ("time", "number"): ("* /", TIME),
    ("number", "time"): ("*", TIME),
}


def pair(sign: str, left: Term, right: Term, whole: str) -> Term:
    """The term `left sign right`, `whole` being the condition.  Raises ConditionError for operands that do not fit."""
    text = f"{left.text} {sign} {right.text}"
    if sign in _LOGIC:
        if not left.resolved().sort == right.resolved().sort == "BOOL":
            raise ConditionError(f"{sign} joins conditions; one side is not BOOL in {whole!r}")
        return _computed(text, sign, left, right, "BOOL", BOOL)
    if sign in _COMPARES:
        left, right = _fitted(left, right).resolved(), _fitted(right, left).resolved()
        if left.sort != right.sort:
            raise ConditionError(f"{sign} compares {left.described} with {right.described} in {whole!r}")
        return _computed(text, sign, left, right, "BOOL", BOOL)
    sorts = ["date" if term.resolved().sort in DATES else term.sort for term in (left, right)]
    signs, kind = _COMPUTES.get((sorts[0], sorts[1]), ("", DINT))
    if sign not in signs.split():
        raise ConditionError(f"{sign} needs numbers in {whole!r}, not {left.described} and {right.described}")
    if sign == "MOD" and (_is_real(left) or _is_real(right)):
        raise ConditionError(f"MOD needs whole numbers in {whole!r}")
    if sign in ("/", "MOD") and right.constant == 0:
        raise ConditionError(f"division by zero in {whole!r}")
    left, right = _rounded(left, right), _rounded(right, left)
    if sort_of(kind) == "number":
        return _computed(text, sign, left, right, "number", _number_type(left, right))
    if kind is DATE:  # the same day or instant, later or earlier
        return _computed(text, sign, left, right, left.sort, left.type)
    return _computed(text, sign, left, right, sort_of(kind), kind)


def _number_type(left: Term, right: Term) -> Type | None:
    """The type of what two numbers make; None for literals alone, and for types that have none in common."""
    known = [term.type for term in (left, right) if term.type]
    found = common(known[0], known[-1]) if known else None
    is_whole = found is not None and "ANY_REAL" not in families(found)
    return LREAL if is_whole and (_is_real(left) or _is_real(right)) else found


def _is_real(term: Term) -> bool:
    """Whether the value of a number is a floating-point one."""
    return "ANY_REAL" in families(term.type) if term.type else isinstance(term.constant, float)


def signed(sign: str, inner: Term, whole: str) -> Term:
    """`-inner` or `+inner`."""
    if inner.resolved().sort not in ("number", "time"):
        raise ConditionError(f"{sign} needs a number in {whole!r}")
    if sign == "+":
        return inner
    constant = None if inner.constant is None else -cast(float, inner.constant)
    return replace(inner, text=f"-{inner.text}", value=lambda read: -cast(float, inner.value(read)), constant=constant,
                   place=None, sign="-", parts=(inner,))  # fmt: skip


def inverted(inner: Term, whole: str) -> Term:
    """`NOT inner`."""
    if inner.resolved().sort != "BOOL":
        raise ConditionError(f"NOT needs a BOOL in {whole!r}")
    return Term(f"NOT {inner.text}", lambda read: not inner.value(read), "BOOL", BOOL, sign="NOT", parts=(inner,))


def _computed(text: str, sign: str, left: Term, right: Term, sort: str, kind: Type | None) -> Term:
    function = LEVELS[LEVEL_OF[sign]][sign]
    single, whole = kind is not None and base(kind) is REAL, sort == "time"

    def value(read: Read) -> Value:
        a, b = left.value(read), right.value(read)
        if a is None or b is None:
            raise TypeError("a reference on the way is null")
        result = function(a, b)
        if whole and isinstance(result, float):
            return nearest(result, "i64")
        return nearest_real(cast(float, result)) if single else result

    constant = None
    if left.constant is not None and right.constant is not None:
        try:
            constant = value(lambda place: None)
        except OverflowError:
            raise ConditionError(f"{text} cannot be computed: it is out of range of {'REAL' if single else 'LREAL'}") from None
        except (ArithmeticError, TypeError) as error:
            raise ConditionError(f"{text} cannot be computed: {error}") from None
    return Term(text, value, sort, kind, constant, sign=sign, parts=(left, right))


def _rounded(term: Term, other: Term) -> Term:
    """An untyped number beside a REAL is a REAL."""
    if term.type or term.constant is None or term.sort != "number" or other.type is None or base(other.type) is not REAL:
        return term
    try:
        value = nearest_real(float(cast(float, term.constant)))
    except OverflowError:
        raise ConditionError(f"{term.text} is out of range of REAL") from None
    return replace(term, value=lambda read: value, constant=value, type=REAL)


def _fitted(term: Term, other: Term) -> Term:
    """A constant in the type of what it is compared with."""
    kind = other.type
    if kind is None:
        return term
    plain = base(kind)
    if isinstance(plain, EnumType):
        return _member(term, plain, other)
    if term.constant is None or term.type:
        return term
    if not other.place:
        return _rounded(term, other)
    try:
        value = _as(kind, term, other.text)
    except (TypeError, ValueError) as error:
        raise ConditionError(str(error)) from None
    return replace(term, value=lambda read: value, constant=value, sort=other.sort, type=kind)


def _as(kind: Type, term: Term, name: str) -> Value:
    """The value of a constant as a place of type `kind` holds it."""
    if term.sort != sort_of(kind) and (term.sort, sort_of(kind)) != ("number", "BOOL"):
        raise refusal(kind, name, term.text)
    value = term.constant
    if isinstance(value, float) and base(kind) not in (REAL, LREAL):
        if not value.is_integer():
            return value
        value = int(value)
    return conform(kind, value, name)


def _member(term: Term, kind: EnumType, other: Term) -> Term:
    """A name, with or without its type in front, or a number as the member of an enumeration."""
    if term.sort == "enumeration":
        return term
    front, dot, last = term.text.rpartition(".")
    name = last if dot and fold(front) == fold(kind.name) else term.text
    if fold(name.rpartition("#")[2]) not in kind.members:
        if term.unknown and "#" not in name:
            members = ", ".join(kind.shown.values())
            raise ConditionError(f"{term.unknown}; {other.text} is {kind.name}, which has {members}")
        if not term.unknown and (term.constant is None or term.sort != "number"):
            return term
    try:
        value = conform(kind, name if term.constant is None or term.sort != "number" else term.constant, other.text)
    except (TypeError, ValueError) as error:
        raise ConditionError(str(error)) from None
    return Term(term.text, lambda read: value, "enumeration", kind, value)
