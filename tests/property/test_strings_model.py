"""String functions of both string types against Python's slices, on all engines."""

from __future__ import annotations

import pytest
from depth import times
from hypothesis import example, given, settings
from hypothesis import strategies as st
from test_arithmetic_model import compare

CAPACITY = 12
LETTERS = {kind: st.characters(min_codepoint=1, max_codepoint=last) for kind, last in (("STRING", 0xFF), ("WSTRING", 0xD7FF))}
COUNTS = st.integers(0, CAPACITY + 3)
POSITIONS = st.integers(1, CAPACITY + 3)
PLAIN = "ab"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["STRING", "WSTRING"])
def test_functions(kind: str) -> None:
    declared = f"a, b, l, r, m, c, i, d, s, mx, mn, chosen : {kind}[{CAPACITY}]; long : {kind}[40]; n, p, size, place : INT; " \
               "lt, eq, ge : BOOL;"
    body = """l := LEFT(a, n); r := RIGHT(a, n); m := MID(a, n, p); c := CONCAT(a, b); long := CONCAT(a, b, a);
        i := INSERT(a, b, n); d := DELETE(a, n, p); s := REPLACE(a, b, n, p); size := LEN(long); place := FIND(a, b);
        lt := a < b; eq := a = b; ge := a >= b; mx := MAX(a, b); mn := MIN(a, b); chosen := SEL(n > 5, a, b);"""
    letters = st.one_of(st.sampled_from(PLAIN), LETTERS[kind])
    texts = st.text(letters, max_size=CAPACITY)

    @settings(max_examples=times(250), deadline=None)
    @given(texts, st.one_of(texts, st.text(st.sampled_from(PLAIN), max_size=2)), COUNTS, POSITIONS)
    @example("abab", "", 0, 1)
    @example("", "", 5, 5)
    def check(a: str, b: str, n: int, p: int) -> None:
        compare(declared, body, {"a": a, "b": b, "n": n, "p": p}, {
            "l": a[:n], "r": a[len(a) - n:] if n < len(a) else a, "m": a[p - 1:p - 1 + n], "c": (a + b)[:CAPACITY],
            "long": a + b + a, "i": (a[:n] + b + a[n:])[:CAPACITY], "d": a[:p - 1] + a[p - 1 + n:],
            "s": (a[:p - 1] + b + a[p - 1 + n:])[:CAPACITY], "size": len(a + b + a), "place": a.find(b) + 1 if b else 0,
            "lt": a < b, "eq": a == b, "ge": a >= b, "mx": max(a, b), "mn": min(a, b), "chosen": b if n > 5 else a})

    check()


@pytest.mark.slow
@settings(max_examples=times(150), deadline=None)
@given(st.text(LETTERS["WSTRING"], max_size=CAPACITY), st.text(LETTERS["STRING"], max_size=CAPACITY))
def test_conversions(wide: str, narrow: str) -> None:
    compare(f"w, wide : WSTRING[{CAPACITY}]; s, narrow, there : STRING[{CAPACITY}]; c : CHAR; d : WCHAR;",
            "wide := STRING_TO_WSTRING(s); narrow := WSTRING_TO_STRING(w); there := WSTRING_TO_STRING(wide); "
            "c := STRING_TO_CHAR(s); d := WSTRING_TO_WCHAR(w);", {"w": wide, "s": narrow},
            {"wide": narrow, "narrow": "".join(letter if ord(letter) < 256 else "?" for letter in wide), "there": narrow,
             "c": narrow[:1] or "\0", "d": wide[:1] or "\0"})
