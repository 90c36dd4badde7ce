"""Integers, bit strings and their conversions against Python's integers, at the edges of every type."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from rows import each_of
from test_folding import BITS, INTEGERS, as_variables, edges, literals

WIDTHS = {**INTEGERS, **BITS, "BOOL": 1}


def wrapped(kind: str, number: int) -> int:
    """`number` as a type of that width holds it: its low bits, the sign read anew."""
    bits = abs(WIDTHS[kind])
    low = number & (1 << bits) - 1
    return low - (1 << bits) if WIDTHS[kind] < 0 and low >> bits - 1 else low


def quotient(a: int, b: int) -> int:
    """Toward zero."""
    return abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)


OPERATORS: dict[str, Callable[[int, int], int]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": quotient,
    "MOD": lambda a, b: a - quotient(a, b) * b,
    "AND": lambda a, b: a & b,
    "OR": lambda a, b: a | b,
    "XOR": lambda a, b: a ^ b,
}


def calculated(operator: str, kind: str, a: int, b: int) -> str:
    if operator in ("/", "MOD") and b == 0:
        return "R0101"
    return str(wrapped(kind, OPERATORS[operator](a, b)))


QUICK = ("INT", "ULINT", "BYTE")
each_kind = pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=[pytest.mark.slow] * (kind not in QUICK)) for kind in (*INTEGERS, *BITS)])


@pytest.mark.slow
@each_kind
def test_operators(kind: str) -> None:
    operators = ("+", "-", "*", "/", "MOD") if kind in INTEGERS else ("AND", "OR", "XOR")
    values = edges(WIDTHS[kind])
    rows = [{"a": a, "b": b} for a in literals(kind) for b in literals(kind)]
    for operator in operators:
        want = [calculated(operator, kind, a, b) for a in values for b in values]
        assert as_variables(f"a : {kind}; b : {kind}; r : {kind};", f"a {operator} b", rows) == want, operator


@pytest.mark.slow
@each_of("source", [*INTEGERS, *BITS])
@each_of("target", [*INTEGERS, *BITS])
def test_conversions(source: str, target: str) -> None:
    rows = [{"a": a} for a in literals(source)]
    function = f"{source}_TO_{target}" if source != target else f"TO_{target}"
    want = [str(wrapped(target, number)) for number in edges(WIDTHS[source])]
    assert as_variables(f"a : {source}; r : {target};", f"{function}(a)", rows) == want


@pytest.mark.slow
@each_kind
def test_unary_and_shifts(kind: str) -> None:
    values, rows = edges(WIDTHS[kind]), [{"a": a} for a in literals(kind)]
    bits, mask = abs(WIDTHS[kind]), (1 << abs(WIDTHS[kind])) - 1
    declared = f"a : {kind}; r : {kind};"
    if kind in INTEGERS:
        assert as_variables(declared, "-a", rows) == [str(wrapped(kind, -n)) for n in values]
        assert as_variables(declared, "ABS(a)", rows) == [str(wrapped(kind, abs(n))) for n in values]
    else:
        assert as_variables(declared, "NOT a", rows) == [str(n ^ mask) for n in values]
    for count in (0, 1, 3, bits - 1, bits, bits + 1, 100):
        turn, plain = count % bits, [n & mask for n in values]
        shifted = {"SHL": [n << count for n in plain], "SHR": [n >> count for n in plain],
                   "ROL": [n << turn | n >> bits - turn for n in plain]}  # fmt: skip
        for name, want in shifted.items():
            assert as_variables(declared, f"{name}(a, {count})", rows) == [str(wrapped(kind, n)) for n in want], name
