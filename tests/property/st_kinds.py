"""The types of programs that are made at random, what converts to what, standard blocks, and the parts of a program.

A type is a name: elementary ones as they are written, `STRING 20`, `ARRAY 0 3 INT`, `REF INT`, `PTR INT`, `REFERENCE INT`,
`OPEN INT` (ARRAY [*]), names of structures, unions and blocks.  Written from the tables of IEC 61131-3, not from the compiler."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

Node = tuple[Any, ...]
BITS = {"BOOL": 1, "SINT": 8, "INT": 16, "DINT": 32, "LINT": 64, "USINT": 8, "UINT": 16, "UDINT": 32, "ULINT": 64,
        "BYTE": 8, "WORD": 16, "DWORD": 32, "LWORD": 64, "REAL": 32, "LREAL": 64, "TIME": 64, "LTIME": 64, "CHAR": 8,
        "WCHAR": 16, "DATE": 64, "LDATE": 64, "TOD": 64, "LTOD": 64, "DT": 64, "LDT": 64}
SIGNED, UNSIGNED = ("SINT", "INT", "DINT", "LINT"), ("USINT", "UINT", "UDINT", "ULINT")
INTEGERS, BIT_STRINGS, REALS = SIGNED + UNSIGNED, ("BYTE", "WORD", "DWORD", "LWORD"), ("REAL", "LREAL")
DURATIONS, DAYS, DAYTIMES, MOMENTS = ("TIME", "LTIME"), ("DATE", "LDATE"), ("TOD", "LTOD"), ("DT", "LDT")
DATES = DAYS + DAYTIMES + MOMENTS
CHARACTERS, TEXTS = ("CHAR", "WCHAR"), ("STRING", "WSTRING")
NUMBERS = INTEGERS + BIT_STRINGS + REALS
COMMON = ("BOOL", *NUMBERS, "TIME", "STRING")
RARE = ("LTIME", *DATES, *CHARACTERS, "WSTRING")
ELEMENTARY = COMMON + RARE
MEMBERS = {0: "Red", 5: "Green", 6: "Blue"}
"""Of the enumeration E0."""
DAY_NS = 86_400 * 10**9

WIDER = {"SINT": ("INT", "DINT", "LINT", "REAL", "LREAL"), "INT": ("DINT", "LINT", "REAL", "LREAL"), "DINT": ("LINT", "LREAL"),
         "USINT": ("UINT", "UDINT", "ULINT", "INT", "DINT", "LINT", "REAL", "LREAL"),
         "UINT": ("UDINT", "ULINT", "DINT", "LINT", "REAL", "LREAL"), "UDINT": ("ULINT", "LINT", "LREAL"), "REAL": ("LREAL",),
         "BYTE": ("WORD", "DWORD", "LWORD"), "WORD": ("DWORD", "LWORD"), "DWORD": ("LWORD",), "TIME": ("LTIME",),
         "DATE": ("LDATE",), "TOD": ("LTOD",), "DT": ("LDT",), "CHAR": ("STRING",), "WCHAR": ("WSTRING",)}
"""Implicit conversions (the standard's figure 11)."""
MATH = ("SQRT", "LN", "LOG", "EXP", "SIN", "COS", "TAN", "ASIN", "ACOS", "ATAN")
LEVEL = {"**": 7, "*": 6, "/": 6, "MOD": 6, "+": 5, "-": 5, "<": 4, ">": 4, "<=": 4, ">=": 4, "=": 3.5, "<>": 3.5, "AND": 3,
         "&": 3, "AND_THEN": 3, "XOR": 2, "OR": 1, "OR_ELSE": 1}
"""Precedence of operators (table 71); unary ones have 8, what needs no parentheses 9."""
PARTS = {"BOOL": "X", "BYTE": "B", "WORD": "W", "DWORD": "D"}
"""Types of parts of a bit string, with their letters (table 17)."""
GENERIC = {"ANY_NUM": INTEGERS + REALS, "ANY_BIT": ("BOOL", *BIT_STRINGS), "ANY_ELEMENTARY": COMMON[:-1]}
"""Generic types of functions, and for which types they are called."""


def limits(kind: str) -> tuple[int, int]:
    """Least and greatest value of an integer, a bit string or a time."""
    if kind in SIGNED or kind in DURATIONS or kind in DATES:
        return -(1 << BITS[kind] - 1), (1 << BITS[kind] - 1) - 1
    return 0, (1 << BITS[kind]) - 1


@dataclass(frozen=True)
class Variable:
    """A declaration: section, name, type as written and its type here, initial value or None, where it is located.

    A location is (area, byte, bit): bit None for what fills bytes; a span is that of a subrange."""

    section: str
    name: str
    written: str
    kind: str
    initial: Any = None
    at: tuple[str, int, int | None] | None = None
    span: tuple[int, int] | None = None


@dataclass(frozen=True)
class Pou:
    """A program, function block or function with its result type; actions are (name, block)."""

    kind: str
    name: str
    result: str
    variables: tuple[Variable, ...]
    body: tuple[Node, ...]
    actions: tuple[tuple[str, tuple[Node, ...]], ...] = ()


@dataclass(frozen=True)
class Task:
    """A task of the configuration, with the instance that it runs: interval in ms, or the global BOOL of SINGLE."""

    instance: str
    priority: int
    interval_ms: int = 0
    single: str = ""


@dataclass(frozen=True)
class Program:
    """Structures and unions (whose names begin with U) as (name, ((member, type), ...)), and POUs, the program last."""

    structs: tuple[tuple[str, tuple[tuple[str, str], ...]], ...]
    pous: tuple[Pou, ...]
    variables: tuple[Variable, ...] = ()
    """Global ones."""
    tasks: tuple[Task, ...] = ()
    """All of them run instances of the program; without any it runs in each scan, as an instance of its own name."""


def _block(name: str, inputs: str, outputs: str) -> Pou:
    rows = [Variable(section, row.partition(":")[0], row.partition(":")[2], row.partition(":")[2])
            for section, text in (("VAR_INPUT", inputs), ("VAR_OUTPUT", outputs)) for row in text.split()]
    return Pou("FUNCTION_BLOCK", name, "", tuple(rows), ())


STANDARD = {pou.name: pou for pou in (
    _block("TON", "IN:BOOL PT:TIME", "Q:BOOL ET:TIME"), _block("TOF", "IN:BOOL PT:TIME", "Q:BOOL ET:TIME"),
    _block("TP", "IN:BOOL PT:TIME", "Q:BOOL ET:TIME"), _block("CTU", "CU:BOOL R:BOOL PV:INT", "Q:BOOL CV:INT"),
    _block("CTD", "CD:BOOL LD:BOOL PV:INT", "Q:BOOL CV:INT"),
    _block("CTUD", "CU:BOOL CD:BOOL R:BOOL LD:BOOL PV:INT", "QU:BOOL QD:BOOL CV:INT"),
    _block("R_TRIG", "CLK:BOOL", "Q:BOOL"), _block("F_TRIG", "CLK:BOOL", "Q:BOOL"),
    _block("SR", "S1:BOOL R:BOOL", "Q1:BOOL"), _block("RS", "S:BOOL R1:BOOL", "Q1:BOOL"))}
"""Standard blocks and their pins (tables 43 to 46)."""


def here(kind: str) -> str:
    """Type of a member or element as places have it: a text of its own length."""
    return f"{kind} 80" if kind in TEXTS else kind


def plain(kind: str) -> str:
    """Type of the value at a place."""
    return kind.split()[0] if kind.startswith(TEXTS) else kind


def array_text(kind: str) -> str:
    """How the type of an array is written."""
    _, low, high, element = kind.split(" ", 3)
    return f"ARRAY [{low}..{high}] OF {element}"
