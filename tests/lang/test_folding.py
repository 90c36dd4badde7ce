"""What the compiler calculates of constants is what the program calculates of variables, to the bit, traps included."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from fbvm.base.diagnostics import Source
from fbvm.code.compiler import compile_sources
from fbvm.machine.plc import Plc

INTEGERS = {"SINT": -8, "INT": -16, "DINT": -32, "LINT": -64, "USINT": 8, "UINT": 16, "UDINT": 32, "ULINT": 64}
"""Bits of each integer type, negative for the signed ones."""
BITS = {"BYTE": 8, "WORD": 16, "DWORD": 32, "LWORD": 64}
REALS = ("REAL", "LREAL")
QUICK = ("INT", "REAL", "BOOL")
"""A type of each kind of operators is for every run, the others for the long one."""
REAL_TEXTS = ("0.0", "1.0", "-1.0", "0.1", "2.5", "-0.5", "1.0E10", "16777217.0", "3.0E38", "-7.25", "1.0E-40")
TIMES = ("T#0s", "T#1ns", "T#-1ms", "T#1s500ms", "T#25h", "T#106751d", "T#-106751d")


def edges(bits: int) -> list[int]:
    """The values of an integer type where something may go wrong."""
    low, high = (0, (1 << bits) - 1) if bits > 0 else (-(1 << -bits - 1), (1 << -bits - 1) - 1)
    return sorted({low, low + 1, high - 1, high, 0, 1, 2, 7} | ({-1, -2, -7} if bits < 0 else set()))


def literals(kind: str) -> list[str]:
    """Literals of a type, typed."""
    if kind in INTEGERS:
        return [f"{kind}#{n}" for n in edges(INTEGERS[kind])]
    if kind in BITS:
        return [f"{kind}#16#{n:X}" for n in edges(BITS[kind])]
    if kind in REALS:
        return [f"{kind}#{text}" for text in REAL_TEXTS]
    return {"BOOL": ["FALSE", "TRUE"], "TIME": list(TIMES)}[kind]


def binary_cases() -> Iterator[tuple[str, str, str, str]]:
    """Operator, types of both operands, type of the result, one row for each."""
    for kind in INTEGERS:
        yield from ((operator, kind, kind, kind) for operator in ("+", "-", "*", "/", "MOD"))
        yield from ((operator, kind, kind, "BOOL") for operator in ("=", "<", ">="))
    for kind in BITS:
        yield from ((operator, kind, kind, kind) for operator in ("AND", "OR", "XOR"))
        yield from ((operator, kind, kind, "BOOL") for operator in ("<>", ">", "<="))
    for kind in REALS:
        yield from ((operator, kind, kind, kind) for operator in ("+", "-", "*", "/", "**"))
        yield from ((operator, kind, kind, "BOOL") for operator in ("=", "<>", "<", ">"))
    for operator in ("AND", "OR", "XOR", "AND_THEN", "OR_ELSE", "=", "<"):
        yield operator, "BOOL", "BOOL", "BOOL"
    yield from ((operator, "TIME", "TIME", "TIME") for operator in ("+", "-"))
    yield from ((operator, "TIME", kind, "TIME") for operator in ("*", "/") for kind in ("INT", "LREAL"))
    yield from ((operator, "TIME", "TIME", "BOOL") for operator in ("=", "<", ">="))
    for left, right, result in (("SINT", "INT", "INT"), ("USINT", "SINT", "INT"), ("UINT", "INT", "DINT"),
                                ("UDINT", "DINT", "LINT"), ("INT", "REAL", "REAL"), ("DINT", "REAL", "LREAL")):
        yield from ((operator, left, right, result) for operator in ("+", "*", "-"))


def outcomes(declarations: str, lines: list[str], last: str = "") -> list[str]:
    """Main.r after each of the lines and `last`, or the code of the trap, or of the error that the line has."""
    errors: dict[int, str] = {}
    while True:
        branches = [f"{n}: {line}" if n not in errors else "" for n, line in enumerate(lines)]
        head = f"PROGRAM Main VAR {declarations} k : DINT; END_VAR CASE k OF"
        text = "\n".join([head, *branches, f"END_CASE; {last} END_PROGRAM"])
        made = compile_sources([Source("fold.st", text)], runnable=True)
        if made.image is not None:
            break
        assert made.errors and all(1 < error.line < len(lines) + 2 for error in made.errors), made.errors[0].render()
        errors |= {error.line - 2: error.code for error in made.errors}
    plc, results = Plc(made.image), []
    for number in range(len(lines)):
        plc.cold_start()
        plc.write("Main.k", number)
        trap = plc.scan()
        results.append(errors.get(number) or (trap.code if trap else shown(plc.read("Main.r"))))
    return results


def as_variables(declarations: str, expression: str, rows: list[dict[str, str]]) -> list[str]:
    """What `expression` gives for each row of values of its variables."""
    lines = ["".join(f"{name} := {value}; " for name, value in row.items()) for row in rows]
    return outcomes(declarations, lines, f"r := {expression};")


def as_constants(result: str, expressions: list[str]) -> list[str]:
    """What each expression of constants gives."""
    return outcomes(f"r : {result};", [f"r := {expression};" for expression in expressions])


def shown(value: object) -> str:
    return repr(value)


FOUND_EARLIER = {"R0101": {"S0703"}, "R0105": {"S0702", "S0703"}, "R0106": {"S0702", "S0703"},
                 "inf": {"S0703"}, "-inf": {"S0703"}, "nan": {"S0703"}}  # fmt: skip
"""What stops variables, or gives no finite number, may be an error of constants."""


def differences(constants: list[str], variables: list[str], expressions: list[str]) -> list[str]:
    return [
        f"{expression}: {constant} as constants, {variable} as variables"
        for expression, constant, variable in zip(expressions, constants, variables, strict=True)
        if constant != variable and constant not in FOUND_EARLIER.get(variable, ())
    ]


@pytest.mark.parametrize(("operator", "left", "right", "result"), [
    pytest.param(*case, marks=[pytest.mark.slow] * (case[1] not in QUICK)) for case in binary_cases()
])
def test_operators(operator: str, left: str, right: str, result: str) -> None:
    rows = [{"a": a, "b": b} for a in literals(left) for b in literals(right)]
    expressions = [f"{row['a']} {operator} {row['b']}" for row in rows]
    variables = as_variables(f"a : {left}; b : {right}; r : {result};", f"a {operator} b", rows)
    assert differences(as_constants(result, expressions), variables, expressions) == []


def conversions() -> Iterator[tuple[str, str]]:
    """Every pair of types that convert when asked."""
    numbers = [*INTEGERS, *BITS, "BOOL"]
    yield from ((a, b) for a in numbers for b in numbers if a != b)
    for real in REALS:
        yield from (pair for kind in (*INTEGERS, "BOOL") for pair in ((kind, real), (real, kind)))
    yield from (("REAL", "LREAL"), ("LREAL", "REAL"), ("REAL", "DWORD"), ("DWORD", "REAL"), ("LREAL", "LWORD"))
    yield from (pair for kind in (*INTEGERS, *BITS, *REALS) for pair in ((kind, "TIME"), ("TIME", kind)))
    yield from ((kind, "STRING") for kind in (*INTEGERS, *BITS, *REALS, "BOOL", "TIME"))


@pytest.mark.slow
@pytest.mark.parametrize(("source", "target"), list(conversions()))
def test_conversions(source: str, target: str) -> None:
    rows = [{"a": a} for a in literals(source)]
    expressions = [f"{source}_TO_{target}({row['a']})" for row in rows]
    variables = as_variables(f"a : {source}; r : {target};", f"{source}_TO_{target}(a)", rows)
    assert as_variables(f"a : {source}; r : {target};", f"TO_{target}(a)", rows) == variables
    assert differences(as_constants(target, expressions), variables, expressions) == []
