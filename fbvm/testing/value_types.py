"""Values as tests read them: integers that say which member of an enumeration, which time or which date they are."""

from __future__ import annotations

from typing import Any

from fbvm.base.types import TIME, ArrayType, EnumType, StructType, Type, base, fold
from fbvm.watch.values import DATES, Value, parse_time_ns, parse_value, refusal, show, sort_of

TIMES = ("time", *DATES)
"""The sorts of types whose values are nanoseconds."""


class Member(int):
    """A member of an enumeration: its number, which also equals its name, alone or behind the type's, in any case.

    >>> from fbvm.base.types import INT, EnumType
    >>> state = Member(1, EnumType("State", 2, 2, INT, {"IDLE": 0, "RUNNING": 1}, {0: "Idle", 1: "Running"}))
    >>> state, state.name, state == 1, state == "running", state == "State#Idle"
    (State#Running (1), 'Running', True, True, False)
    """

    type: EnumType
    name: str

    def __new__(cls, value: int, kind: EnumType) -> Member:
        made = super().__new__(cls, value)
        made.type, made.name = kind, kind.shown[value]
        return made

    def __eq__(self, other: object) -> bool:
        if isinstance(other, str):
            front, _, name = other.replace(".", "#").rpartition("#")
            return fold(name) == fold(self.name) and fold(front) in ("", fold(self.type.name))
        return int.__eq__(self, other) is True

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = int.__hash__

    def __repr__(self) -> str:
        return f"{self} ({int(self)})"

    def __str__(self) -> str:
        return f"{self.type.name}#{self.name}" if self.type.name.isidentifier() else self.name

    def __format__(self, form: str) -> str:
        return format(int(self), form) if form else str(self)


class Nanoseconds(int):
    """A TIME or a date as an integer of nanoseconds, shown as a program writes it.  Sums and multiples are such values, too.

    >>> ns("50ms"), ns("50ms") == 50_000_000, 2 * ns("1s") - ns("1ms"), ns("1s") / ns("50ms")
    (T#50ms, True, T#1s999ms, 20.0)
    """

    type: Type

    def __new__(cls, value: int, kind: Type = TIME) -> Nanoseconds:
        made = super().__new__(cls, value)
        made.type = kind
        return made

    def __repr__(self) -> str:
        return show(self.type, int(self))

    def __add__(self, other: int) -> Nanoseconds:
        return self._with(int(self) + int(other), other)

    __radd__ = __add__

    def __sub__(self, other: int) -> Nanoseconds:
        dates = self._is_date and isinstance(other, Nanoseconds) and other._is_date
        return Nanoseconds(int(self) - int(other)) if dates else self._with(int(self) - int(other), other)

    def __rsub__(self, other: int) -> Nanoseconds:
        return Nanoseconds(int(other) - int(self))

    def __mul__(self, other: Any) -> Any:
        return Nanoseconds(int(self) * other, self.type) if isinstance(other, int) else int(self) * other

    __rmul__ = __mul__

    def __floordiv__(self, other: int) -> int:
        return int(self) // int(other) if isinstance(other, Nanoseconds) else Nanoseconds(int(self) // other, self.type)

    def __mod__(self, other: int) -> Nanoseconds:
        return Nanoseconds(int(self) % int(other))

    def __neg__(self) -> Nanoseconds:
        return Nanoseconds(-int(self), self.type)

    @property
    def _is_date(self) -> bool:
        return sort_of(self.type) != "time"

    def _with(self, value: int, other: int) -> Nanoseconds:
        """A sum, which is a date if one of both is."""
        return Nanoseconds(value, other.type if isinstance(other, Nanoseconds) and other._is_date else self.type)


def ns(text: str) -> Nanoseconds:
    """Nanoseconds of a duration; the prefix T# may be left out.  Raises ValueError.

    >>> ns("1.5s") == 1_500_000_000, ns("T#1m30s")
    (True, T#1m30s)
    """
    return Nanoseconds(parse_time_ns(text))


def as_read(kind: Type, value: Value) -> Any:
    """A value of type `kind` as a test reads it: members of enumerations, times and dates know their names.

    A number that no member has stays a number."""
    plain = base(kind)
    if isinstance(value, list) and isinstance(plain, ArrayType):
        return [as_read(plain.element, item) for item in value]
    if isinstance(value, dict) and isinstance(plain, StructType):
        return {field.name: as_read(field.type, value[field.name]) for field in plain.fields.values() if field.name in value}
    if isinstance(value, int) and isinstance(plain, EnumType):
        return Member(value, plain) if value in plain.shown else value
    return Nanoseconds(value, plain) if isinstance(value, int) and sort_of(plain) in TIMES else value


def for_writing(kind: Type, value: object, name: str) -> object:
    """A value that a test gives, as a PLC takes it: texts are literals of the type, `"50ms"`, `"16#FF"`.

    Raises ValueError (out of range) and TypeError (another kind of value), also for a bare number where a TIME or a date is
    wanted: 2 may be meant as seconds."""
    plain = base(kind)
    if isinstance(value, str) and sort_of(kind) != "text":
        return parse_value(kind, value, name)
    if isinstance(value, list | tuple) and isinstance(plain, ArrayType):
        return [for_writing(plain.element, item, f"{name}[{at}]") for at, item in enumerate(value)]
    if isinstance(value, dict) and isinstance(plain, StructType):
        fields = {key: plain.member(str(key)) for key in value}
        return {key: for_writing(field.type, item, f"{name}.{field.name}") if (field := fields[key]) else item
                for key, item in value.items()}  # fmt: skip
    if sort_of(kind) in TIMES and isinstance(value, int) and not isinstance(value, Nanoseconds):
        raise refusal(kind, name, repr(value))
    return value
