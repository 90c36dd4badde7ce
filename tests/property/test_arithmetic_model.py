"""Arithmetic of every type and every operator against a model in plain Python, on all engines."""

from __future__ import annotations

import math
import struct
from functools import cache
from typing import Any

import pytest
from depth import times
from hypothesis import example, given, settings
from hypothesis import strategies as st
from rows import first_quick

from fbvm.code.compiler import compile_text
from fbvm.engine.native import engine as native
from fbvm.machine.plc import Plc

SIGNED = {"SINT": 8, "INT": 16, "DINT": 32, "LINT": 64}
UNSIGNED = {"USINT": 8, "UINT": 16, "UDINT": 32, "ULINT": 64}
BITS = {"BYTE": 8, "WORD": 16, "DWORD": 32, "LWORD": 64}
WIDTHS = {**SIGNED, **UNSIGNED, **BITS}
ENGINES = ("python", "native") if native.available() else ("python",)
Results = dict[str, Any]


@cache
def plcs(declarations: str, body: str) -> list[Plc]:
    """One PLC for each engine with a program of these variables and statements."""
    made = compile_text(f"PROGRAM Main\nVAR {declarations} END_VAR\n{body}\nEND_PROGRAM\n")
    assert made.image is not None, made.errors[0].render()
    return [Plc(made.image, engine=engine) for engine in ENGINES]


def compare(declarations: str, body: str, inputs: Results, wanted: Results) -> None:
    """Run a program once with these inputs and compare what it writes."""
    for engine, plc in zip(ENGINES, plcs(declarations, body), strict=True):
        for name, value in inputs.items():
            plc.write(f"Main.{name}", value)
        assert plc.scan() is None, plc.trap
        seen = {name: plc.read(f"Main.{name}") for name in wanted}
        assert {name: bits(value) for name, value in seen.items()} == {
            name: bits(value) for name, value in wanted.items()}, (engine, inputs)


def bits(value: Any) -> Any:
    """Equal for equal values only: -0.0 is not 0.0, TRUE is not 1, one NaN is as good as another."""
    if isinstance(value, float):
        return "NaN" if value != value else struct.pack("<d", value)
    return value if isinstance(value, list) else (type(value), value)


def span(kind: str) -> tuple[int, int]:
    width = WIDTHS[kind]
    return (-(1 << width - 1), (1 << width - 1) - 1) if kind in SIGNED else (0, (1 << width) - 1)


def wrapped(kind: str, number: int) -> int:
    width = WIDTHS[kind]
    number &= (1 << width) - 1
    return number - (1 << width) if kind in SIGNED and number >> width - 1 else number


def whole(kind: str) -> st.SearchStrategy[int]:
    """Numbers of an integer type, those at its edges more often."""
    low, high = span(kind)
    edges = sorted({low, low + 1, high, high - 1, 0, 1} | ({-1} if low else set()))
    return st.one_of(st.sampled_from(edges), st.integers(low, high), st.integers(max(low, -10), 10))


def toward_zero(a: int, b: int) -> int:
    return abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)


COMPARED = "lt := a < b; le := a <= b; gt := a > b; ge := a >= b; eq := a = b; ne := a <> b; mx := MAX(a, b); mn := MIN(a, b);"


def compared(a: Any, b: Any) -> Results:
    return {"lt": a < b, "le": a <= b, "gt": a > b, "ge": a >= b, "eq": a == b, "ne": a != b, "mx": max(a, b), "mn": min(a, b)}


@pytest.mark.slow
@pytest.mark.parametrize("kind", [*SIGNED, *UNSIGNED])
def test_integers(kind: str) -> None:
    declared = f"a, b, sum, dif, pro, quo, rem, neg, mag, lim, mx, mn : {kind}; lt, le, gt, ge, eq, ne : BOOL;"
    body = f"""sum := a + b; dif := a - b; pro := a * b; IF b <> 0 THEN quo := a / b; rem := a MOD b; END_IF
        mag := ABS(a); lim := LIMIT(b, a, sum); neg := -a; {COMPARED}"""

    @settings(max_examples=times(120), deadline=None)
    @given(whole(kind), whole(kind))
    def check(a: int, b: int) -> None:
        total = wrapped(kind, a + b)
        wanted = {"sum": total, "dif": wrapped(kind, a - b), "pro": wrapped(kind, a * b), "mag": wrapped(kind, abs(a)),
                  "lim": min(max(a, b), total), "neg": wrapped(kind, -a), **compared(a, b)}
        if b:
            quotient = toward_zero(a, b)
            wanted |= {"quo": wrapped(kind, quotient), "rem": wrapped(kind, a - quotient * b)}
        compare(declared, body, {"a": a, "b": b}, wanted)

    check()


@pytest.mark.slow
@pytest.mark.parametrize("kind", BITS)
def test_bit_strings(kind: str) -> None:
    declared = f"a, b, both, one, other, inv, l, r, rl, rr, mx, mn : {kind}; n : INT; lt, le, gt, ge, eq, ne : BOOL;"
    body = f"both := a AND b; one := a OR b; other := a XOR b; inv := NOT a; l := SHL(a, n); r := SHR(a, n); " \
           f"rl := ROL(a, n); rr := ROR(a, n); {COMPARED}"
    width, full = BITS[kind], (1 << BITS[kind]) - 1

    @settings(max_examples=times(120), deadline=None)
    @given(whole(kind), whole(kind), st.integers(0, 70))
    def check(a: int, b: int, n: int) -> None:
        turn = n % width
        wanted = {"both": a & b, "one": a | b, "other": a ^ b, "inv": a ^ full, "l": a << n & full, "r": a >> n,
                  "rl": (a << turn | a >> width - turn) & full, "rr": (a >> turn | a << width - turn) & full, **compared(a, b)}
        compare(declared, body, {"a": a, "b": b, "n": n}, wanted)

    check()


def single(value: float) -> float:
    """The nearest REAL; by way of `struct`, which refuses what is too large."""
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)


def divided(a: float, b: float) -> float:
    if b:
        return a / b
    return math.nan if not a or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b)


def root(a: float) -> float:
    return math.nan if a < 0 else math.sqrt(a)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["REAL", "LREAL"])
def test_reals(kind: str) -> None:
    declared = f"a, b, sum, dif, pro, quo, neg, mag, rt, mx, mn, back : {kind}; lt, le, gt, ge, eq, ne, ok : BOOL; t : STRING;"
    body = f"""sum := a + b; dif := a - b; pro := a * b; quo := a / b; neg := -a; mag := ABS(a); rt := SQRT(a); {COMPARED}
        ok := IS_VALID(a); t := {kind}_TO_STRING(a); back := STRING_TO_{kind}(t);"""
    rounded = single if kind == "REAL" else float
    numbers = st.floats(width=32 if kind == "REAL" else 64)

    @settings(max_examples=times(200), deadline=None)
    @given(numbers, numbers)
    @example(0.0, -0.0)
    @example(math.inf, math.inf)
    @example(math.nan, 1.0)
    def check(a: float, b: float) -> None:
        undefined = a != a or b != b
        wanted = {"sum": rounded(a + b), "dif": rounded(a - b), "pro": rounded(a * b), "quo": rounded(divided(a, b)),
                  "neg": -a, "mag": abs(a), "rt": rounded(root(a)), "ok": math.isfinite(a), "back": a,
                  "lt": a < b, "le": a <= b, "gt": a > b, "ge": a >= b, "eq": a == b, "ne": a != b,
                  "mx": math.nan if undefined else a if a >= b else b, "mn": math.nan if undefined else a if a <= b else b}
        compare(declared, body, {"a": a, "b": b}, wanted)

    check()


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["TIME", "LTIME"])
def test_durations(kind: str) -> None:
    declared = f"a, b, sum, dif, pro, quo, neg, mx, mn : {kind}; n : INT; lt, le, gt, ge, eq, ne : BOOL;"
    body = f"sum := a + b; dif := a - b; pro := a * n; IF n <> 0 THEN quo := a / n; END_IF neg := -a; {COMPARED}"

    @settings(max_examples=times(120), deadline=None)
    @given(whole("LINT"), whole("LINT"), whole("INT"))
    def check(a: int, b: int, n: int) -> None:
        wanted = {"sum": wrapped("LINT", a + b), "dif": wrapped("LINT", a - b), "pro": wrapped("LINT", a * n),
                  "neg": wrapped("LINT", -a), **compared(a, b)}
        if n:
            wanted["quo"] = wrapped("LINT", toward_zero(a, n))
        compare(declared, body, {"a": a, "b": b, "n": n}, wanted)

    check()


DAY_NS = 86_400_000_000_000


@pytest.mark.slow
@pytest.mark.parametrize(("clock", "duration"), [("TOD", "TIME"), ("LTOD", "LTIME")])
def test_times_of_day(clock: str, duration: str) -> None:
    declared = f"a, c, later, sooner : {clock}; d, apart : {duration};"

    @settings(max_examples=times(80), deadline=None)
    @given(st.integers(0, DAY_NS - 1), st.integers(0, DAY_NS - 1), st.integers(-3 * DAY_NS, 3 * DAY_NS))
    def check(a: int, c: int, d: int) -> None:
        compare(declared, "later := a + d; sooner := a - d; apart := a - c;", {"a": a, "c": c, "d": d},
                {"later": (a + d) % DAY_NS, "sooner": (a - d) % DAY_NS, "apart": a - c})

    check()


@pytest.mark.slow
@pytest.mark.parametrize("source", first_quick([*WIDTHS]))
def test_conversions_between_integers_and_bits(source: str) -> None:
    targets = [target for target in WIDTHS if target != source]
    declared = f"a : {source}; " + " ".join(f"to_{target} : {target};" for target in targets)
    body = " ".join(f"to_{target} := {source}_TO_{target}(a);" for target in targets)

    @settings(max_examples=times(60), deadline=None)
    @given(whole(source))
    def check(a: int) -> None:
        compare(declared, body, {"a": a}, {f"to_{target}": wrapped(target, a) for target in targets})

    check()


@pytest.mark.slow
@pytest.mark.parametrize("kind", first_quick(UNSIGNED))
def test_decimal_digits_in_nibbles(kind: str) -> None:
    word = {8: "BYTE", 16: "WORD", 32: "DWORD", 64: "LWORD"}[UNSIGNED[kind]]
    declared = f"a, back : {kind}; digits : {word}; ok : BOOL;"
    body = f"digits := {kind}_TO_BCD_{word}(a); back := {word}_BCD_TO_{kind}(digits); ok := IS_VALID_BCD(digits);"

    @settings(max_examples=times(60), deadline=None)
    @given(st.integers(0, 10 ** (UNSIGNED[kind] // 4) - 1))
    def check(a: int) -> None:
        compare(declared, body, {"a": a}, {"digits": int(str(a), 16), "back": a, "ok": True})

    check()
