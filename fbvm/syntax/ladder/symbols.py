"""Tables of symbols as CX-Programmer exports them: name, address, type and comment in a row, in front of rungs.

    Start_PB,0.00,BOOL,,,,"start button";
    Level,D100,INT,,,,"";
    Delay,T0005,TIMER,,,,"";
    Pause,,TIMER,,,,"";

The last one has no number: each instance of the POU has a timer of its own by that name.
"""

from __future__ import annotations

import re

from fbvm.base.digits import whole_number
from fbvm.syntax.ladder.mnemonics import Symbol
from fbvm.syntax.tree import ArraySpec, Literal, Location, Name, NamedType, TypeSpec, VarDecl

_TYPES = {"CHANNEL": "WORD", "UINT_BCD": "WORD", "UDINT_BCD": "DWORD", "ULINT_BCD": "LWORD"}
"""Types of CX-Programmer -> types of IEC 61131-3."""
NUMBERED = ("TIMER", "COUNTER")
_ARRAY = re.compile(r"([A-Z_]+)\[(\d+)\]")


def number(symbol: Symbol) -> str:
    """The timer or counter that a symbol names, as T5 or C5; "" if it names none."""
    if symbol.type not in NUMBERED:
        return ""
    digits = symbol.address.lstrip("TtCc")
    return f"{symbol.type[0]}{whole_number(digits)}" if digits.isdecimal() else ""


def is_own(symbol: Symbol) -> bool:
    """Whether a symbol names a timer or a counter that each instance of the POU has of its own."""
    return bool(symbol.name) and symbol.type in NUMBERED and not symbol.address


def declaration(symbol: Symbol) -> VarDecl:
    """The variable that a row declares; without an address its place is chosen by the compiler.  That of a timer or counter
    of each instance is its completion flag."""
    start, end = symbol.start, symbol.start + len(symbol.name)
    place = Location(start, end, symbol.address) if symbol.address else None
    kind = "BOOL" if is_own(symbol) else symbol.type
    return VarDecl(start, end, (Name(start, end, symbol.name),), place, _spec(kind, start, end), None)


def present_value(symbol: Symbol) -> VarDecl:
    """The variable with the present value of a timer or counter of each instance."""
    start, end = symbol.start, symbol.start + len(symbol.name)
    return VarDecl(start, end, (Name(start, end, value_name(symbol.name)),), None, NamedType(start, end, "WORD"), None)


def value_name(name: str) -> str:
    """The name of the variable with the present value of a timer or counter of this name that each instance has."""
    return f"${name}:value"


def _spec(kind: str, start: int, end: int) -> TypeSpec:
    found = _ARRAY.fullmatch(kind)
    named = NamedType(start, end, _TYPES.get(found[1] if found else kind, found[1] if found else kind))
    if not found:
        return named
    bounds = tuple(Literal(start, end, "int", value, None, str(value)) for value in (0, whole_number(found[2]) - 1))
    return ArraySpec(start, end, ((bounds[0], bounds[1]),), named)
