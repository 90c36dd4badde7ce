"""The tables of IEC 61131-3, third edition, and the list of what of them is supported, made of the programs beside it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from lang_corpus import Program, programs

HERE = Path(__file__).resolve().parent
LIST = HERE.parent.parent / "CONFORMANCE.md"
CHOICES = HERE / "choices.txt"
HEAD = """# Conformance to IEC 61131-3, third edition

Feature by feature of the standard's tables: `yes` is executed, on every engine, as the program of that title in
`tests/conformance/` shows; `refused` is understood and refused with a code of its own, which is named. This list is made of
those programs: `FBVM_REWRITE=1 pytest tests/conformance` writes it anew.
"""
TITLES = """
1 Character set | 2 Identifiers | 3 Comments | 4 Pragma | 5 Numeric literals | 6 Character string literals
7 Two-character combinations | 8 Duration literals | 9 Date and time of day literals | 10 Elementary data types
11 User-defined data types and their initial values | 12 Reference operations | 13 Declaration of variables
14 Initialization of variables | 15 Variable-length ARRAY | 16 Directly represented variables | 17 Partial access of ANY_BIT
18 Execution control with EN and ENO | 19 Function declaration | 20 Function call | 21 Typed and overloaded functions
22 Data type conversion functions | 23 Conversion of numeric types | 24 Conversion of bit types
25 Conversion of bit and numeric types | 26 Conversion of date and time types | 27 Conversion of character types
28 Numerical and arithmetic functions | 29 Arithmetic functions | 30 Bit shift functions | 31 Bitwise Boolean functions
32 Selection functions | 33 Comparison functions | 34 Character string functions | 35 Numerical functions of time types
36 Additional functions of time types, CONCAT and SPLIT | 37 Endianness conversion | 38 Functions of enumerations
39 Validate functions | 40 Function block type declaration | 41 Function block instance declaration | 42 Function block call
43 Bistable function blocks | 44 Edge detection function blocks | 45 Counter function blocks | 46 Timer function blocks
47 Program declaration | 48 Class | 49 Class instance declaration | 50 Textual call of methods | 51 Interface
52 Assignment attempt | 53 Object oriented function block | 54 SFC step | 55 SFC transition and condition
56 SFC declaration of actions | 57 Step and action association | 58 Action block | 59 Action qualifiers
60 Action control features | 61 Sequence evolution | 62 Configuration and resource | 63 Task | 64 Namespace
65 Nested namespaces | 66 USING directive | 67 Parenthesized expression of IL | 68 Instruction list operators | 69 Calls of IL
70 Standard function block operators of IL | 71 Operators of Structured Text | 72 Statements of Structured Text
73 Graphic execution control | 74 Power rails and links | 75 Contacts | 76 Coils
"""
GRAPHIC = range(73, 77)
"""Tables of the graphic languages, which no text can show: they are outside of what Structured Text can say."""
_RANGE = re.compile(r"tables?_(\d+)(?:_to_(\d+))?_")


def titles() -> dict[int, str]:
    """The title of each table by its number."""
    rows = (row.strip().partition(" ") for line in TITLES.strip().splitlines() for row in line.split("|"))
    return {int(number): title for number, _, title in rows}


def numbers(path: Path) -> range:
    """The tables that a file is for."""
    match = _RANGE.match(path.name)
    assert match, path
    return range(int(match[1]), int(match[2] or match[1]) + 1)


def status(program: Program) -> str:
    """Whether the feature of a program is executed or refused."""
    refused = sorted({m.code for m in program.diagnostics if m.code == "S0901"})
    return f"refused ({', '.join(refused)})" if refused else "yes"


def listing() -> str:
    """The list as text."""
    return "\n".join([HEAD, *_lines(), *_choices()]) + "\n"


def choices() -> list[tuple[str, str, Path]]:
    """What the standard leaves to the maker: the question, the answer here, and the programs that show it."""
    rows = ([part.strip() for part in line.split(" | ")] for line in CHOICES.read_text(encoding="utf-8").splitlines())
    return [(question, answer, HERE.parent / path) for question, answer, path in rows]


def _choices() -> Iterator[str]:
    yield "## What the standard leaves to the maker\n"
    yield "In the dialect `standard`; `fbvm explain dialects` says what the others change.\n"
    yield "| question | here | shown in |\n|---|---|---|"
    for question, answer, path in choices():
        yield f"| {question} | {answer} | `tests/{path.relative_to(HERE.parent).as_posix()}` |"


def _lines() -> Iterator[str]:
    files: dict[range, list[Program]] = {}
    for program in programs(HERE):
        files.setdefault(numbers(program.path), []).append(program)
    named = titles()
    for tables in sorted([*files, GRAPHIC], key=lambda span: span.start):
        word = f"Table {tables.start}" if len(tables) == 1 else f"Tables {tables.start} to {tables[-1]}"
        yield f"## {word}: {'; '.join(named[number] for number in tables)}\n"
        yield "| feature | |\n|---|---|"
        for program in files.get(tables, []):
            yield f"| {program.title.removeprefix('---').strip()} | {status(program)} |"
        if tables is GRAPHIC:
            yield "| elements of the graphic languages | refused: sources are text |"
        yield ""
