"""The standard functions: names, parameters, types.  What each does is lowered by `code.builder.functions`, under the same key.

Parameter types: a data type, a generic type, or `T`, a type variable bound to one type for all its places; `T` is limited
to the generic types in `limits`; ENUMERATION adds enumerations, ANY also arrays and structures.  A last parameter with
`..` may repeat.  Sources: IEC 61131-3 ed. 3 tables 22 to 38.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

from fbvm.base.types import ELEMENTARY, SHORT_NAMES, Elementary, StringType, string

RESULT_STRING = 255
"""Characters that the result of a string function can have (as CODESYS)."""


@dataclass(frozen=True)
class Signature:
    """A standard function: key of its lowering, parameters (name, type), whether the last repeats, result type."""

    key: str
    parameters: tuple[tuple[str, str], ...]
    repeats: bool
    result: str
    limits: tuple[str, ...] = ()


_ROWS = """
ABS                                    IN:T                         -> T      ANY_NUM
SQRT LN LOG EXP SIN COS TAN ASIN ACOS ATAN  IN:T                    -> T      ANY_REAL
ATAN2                                  Y:T X:T                      -> T      ANY_REAL
MOVE                                   IN:T                         -> T      ANY
SHL SHR ROL ROR                        IN:T N:ANY_INT               -> T      ANY_BIT ANY_INT
SEL                                    G:BOOL IN0:T IN1:T           -> T      ANY
MAX MIN                                IN1:T ..                     -> T      ANY_ELEMENTARY
LIMIT                                  MN:T IN:T MX:T               -> T      ANY_ELEMENTARY
MUX                                    K:ANY_INT IN0:T ..           -> T      ANY
GT GE LE LT                            IN1:T IN2:T ..               -> BOOL   ANY_ELEMENTARY
EQ                                     IN1:T IN2:T ..               -> BOOL   ANY_ELEMENTARY ENUMERATION
NE                                     IN1:T IN2:T                  -> BOOL   ANY_ELEMENTARY ENUMERATION
LEN                                    IN:T                         -> INT    ANY_STRING
LEFT RIGHT                             IN:T L:ANY_INT               -> T      ANY_STRING
MID                                    IN:T L:ANY_INT P:ANY_INT     -> T      ANY_STRING
CONCAT                                 IN1:T IN2:T ..               -> T      ANY_STRING
INSERT                                 IN1:T IN2:T P:ANY_INT        -> T      ANY_STRING
DELETE                                 IN:T L:ANY_INT P:ANY_INT     -> T      ANY_STRING
REPLACE                                IN1:T IN2:T L:ANY_INT P:ANY_INT -> T   ANY_STRING
FIND                                   IN1:T IN2:T                  -> INT    ANY_STRING
TRUNC                                  IN:T                         -> DINT   ANY_REAL
TIME                                                                -> TIME
LTIME                                                               -> LTIME
IS_VALID                               IN:T                         -> BOOL   ANY_REAL
IS_VALID_BCD                           IN:T                         -> BOOL   ANY_BIT
TO_BIG_ENDIAN TO_LITTLE_ENDIAN         IN:T                         -> T      ANY
FROM_BIG_ENDIAN FROM_LITTLE_ENDIAN     IN:T                         -> T      ANY
__DUE                                  AT:TIME                      ->
__STOP                                                              ->
__PLC_WORDS                            AT:UDINT                     -> UDINT
"""

OTHER_NAMES = {
    "LEN": ("STR",), "LEFT": ("STR", "SIZE"), "RIGHT": ("STR", "SIZE"), "MID": ("STR", "LEN", "POS"), "CONCAT": ("STR1", "STR2"),
    "INSERT": ("STR1", "STR2", "POS"), "DELETE": ("STR", "LEN", "POS"), "REPLACE": ("STR1", "STR2"), "FIND": ("STR1", "STR2"),
}
"""What CODESYS calls the inputs of string functions; both ways of naming them are taken."""
OPERATORS = {"ADD": "+", "SUB": "-", "MUL": "*", "DIV": "/", "MOD": "MOD", "EXPT": "**", "AND": "AND", "OR": "OR",
             "XOR": "XOR", "NOT": "NOT"}
"""Functions that mean an operator; ADD, MUL, AND, OR and XOR take more than two inputs."""
EXTENSIBLE_OPERATORS = frozenset(("ADD", "MUL", "AND", "OR", "XOR"))
_TIME_ROWS = """
ADD_TIME TIME TIME      ADD_TOD_TIME TOD TIME    ADD_DT_TIME DT TIME
SUB_TIME TIME TIME      SUB_TOD_TIME TOD TIME    SUB_DT_TIME DT TIME
SUB_DATE_DATE DATE DATE SUB_TOD_TOD TOD TOD      SUB_DT_DT DT DT
MUL_TIME TIME ANY_NUM   DIV_TIME TIME ANY_NUM    MULTIME TIME ANY_NUM    DIVTIME TIME ANY_NUM
ADD_LTIME LTIME LTIME   ADD_LTOD_LTIME LTOD LTIME ADD_LDT_LTIME LDT LTIME
SUB_LTIME LTIME LTIME   SUB_LTOD_LTIME LTOD LTIME SUB_LDT_LTIME LDT LTIME
SUB_LDATE_LDATE LDATE LDATE SUB_LTOD_LTOD LTOD LTOD SUB_LDT_LDT LDT LDT
MUL_LTIME LTIME ANY_NUM DIV_LTIME LTIME ANY_NUM
"""


def _time_operators(rows: str) -> dict[str, tuple[str, tuple[str, str]]]:
    words = iter(rows.split())
    return {name: (name[:3], (left, right)) for name, left, right in zip(words, words, words, strict=True)}


TIME_OPERATORS = _time_operators(_TIME_ROWS)
"""The typed functions of times: name to the overloaded function and the types of both inputs (table 35)."""

BYTE_ORDER = frozenset(("TO_BIG_ENDIAN", "TO_LITTLE_ENDIAN", "FROM_BIG_ENDIAN", "FROM_LITTLE_ENDIAN"))
"""Functions that change the order of bytes."""


def _parse(rows: str) -> dict[str, Signature]:
    table = {}
    for line in rows.strip().splitlines():
        head, _, tail = line.partition("->")
        words = head.split()
        parameters = [tuple(w.split(":")) for w in words if ":" in w]
        result, *limits = tail.split() or [""]
        for name in (w for w in words if ":" not in w and w != ".."):
            table[name] = Signature(name, tuple((p[0], p[1]) for p in parameters), ".." in words, result, tuple(limits))
    return table


SIGNATURES = _parse(_ROWS)

_CONVERSION = re.compile(r"(?:(?P<source>[A-Z_]+?)_)?(?P<form>TO_BCD|BCD_TO|TRUNC|TO)_(?P<target>[A-Z_]+)")
_CONVERTIBLE = set(ELEMENTARY) | {"STRING", "WSTRING", "TOD", "DT", "LTOD", "LDT"}


def named_type(name: str) -> Elementary | StringType | None:
    """The elementary type that stands in the name of a function (INT in ADD_INT); a string is as long as results are."""
    if name in ("STRING", "WSTRING"):
        return string(RESULT_STRING, name == "WSTRING")
    return ELEMENTARY.get(long_name(name))


def long_name(name: str) -> str:
    """The long form of a type's name (TOD -> TIME_OF_DAY)."""
    return SHORT_NAMES.get(name, name)


@dataclass(frozen=True)
class Conversion:
    """`X_TO_Y` and its relatives: source type ("" = the argument's), form (TO, TRUNC, BCD_TO, TO_BCD), target type."""

    source: str
    form: str
    target: str


def conversion(name: str) -> Conversion | None:
    """The conversion that a folded function name means, between elementary types; None if it means none."""
    if name in ("INT_TO_BCD", "UINT_TO_BCD"):  # as CODESYS spells them
        return Conversion(name[:-7], "TO_BCD", "WORD")
    match = _CONVERSION.fullmatch(name)
    if not match:
        return None
    source, form, target = match["source"] or "", match["form"], match["target"]
    if source == "ANY":  # as TwinCAT spells the overloaded form
        source = ""
    if (source == "BCD" or source.endswith("_BCD")) and form == "TO":
        source, form = source.removesuffix("BCD").rstrip("_"), "BCD_TO"
    if target not in _CONVERTIBLE or (source and source not in _CONVERTIBLE):
        return None
    return Conversion(long_name(source), form, long_name(target))


def typed_name(name: str) -> tuple[str, Elementary | StringType] | None:
    """`ADD_INT` as ("ADD", INT) if such a function exists in a typed form, else None."""
    at = name.find("_")
    while at > 0:
        function, kind = name[:at], named_type(name[at + 1:])
        row = SIGNATURES.get(function)
        if kind is not None and (function in OPERATORS or row is not None and row.limits):
            return function, kind
        at = name.find("_", at + 1)
    return None


def is_standard(name: str) -> bool:
    """True for the folded name of a standard function, overloaded or typed."""
    return name in SIGNATURES or name in OPERATORS or name in TIME_OPERATORS or bool(conversion(name) or typed_name(name))


@cache
def names() -> list[str]:
    """All names of standard functions, for hints."""
    return [*SIGNATURES, *OPERATORS, *(f"{a}_TO_{b}" for a in ELEMENTARY for b in ELEMENTARY if a != b)]
