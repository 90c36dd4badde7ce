"""Values as text and back."""

from __future__ import annotations

import math
import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_of

from fbvm.base.arithmetic import Undefined
from fbvm.base.types import ELEMENTARY
from fbvm.syntax.st.texts import from_text, to_text

WRITTEN = sorted(name for name, kind in ELEMENTARY.items() if "ANY_CHAR" not in kind.families)

SHOWN = [
    ("BOOL", 1, "TRUE"), ("BOOL", False, "FALSE"), ("INT", -5, "-5"), ("ULINT", 2**64 - 1, "18446744073709551615"),
    ("WORD", 255, "255"), ("REAL", 1.5, "1.5"), ("REAL", 1.0, "1.0"),
    ("REAL", struct.unpack("f", struct.pack("f", 1e20))[0], "1E+20"),
    ("REAL", struct.unpack("f", struct.pack("f", 0.1))[0], "0.1"), ("REAL", -0.0, "-0.0"),
    ("REAL", struct.unpack("f", struct.pack("f", 16777217.0))[0], "16777216.0"), ("REAL", 2.0**-149, "1E-45"),
    ("LREAL", 0.1, "0.1"), ("LREAL", 1 / 3, "0.3333333333333333"), ("LREAL", 1e20, "1E+20"),
    ("TIME", 1_500_000_000, "T#1s500ms"), ("TIME", 0, "T#0s"), ("TIME", -1_000_000, "T#-1ms"),
    ("TIME", 93_784_005_006_007, "T#1d2h3m4s5ms6us7ns"), ("LTIME", 1, "LT#1ns"),
    ("DATE", 86_400_000_000_000, "D#1970-01-02"), ("DATE", -1, "D#1969-12-31"),
    ("TOD", 37_230_000_000_000, "TOD#10:20:30"), ("LTIME_OF_DAY", 1, "LTOD#00:00:00.000000001"),
    ("DATE_AND_TIME", 1_500_000_000, "DT#1970-01-01-00:00:01.5"), ("LDT", 0, "LDT#1970-01-01-00:00:00"),
    ("LDATE", 0, "LD#1970-01-01"),
]


@each_of(("data_type", "value", "text"), SHOWN)
def test_a_value_as_text_and_back(data_type: str, value: Any, text: str) -> None:
    assert to_text(data_type, value).decode() == text
    if (data_type, value) != ("DATE", -1):
        assert repr(from_text(data_type, text.encode())) in (repr(value), repr(bool(value)))


@pytest.mark.parametrize(("value", "text"), [(math.nan, "NaN"), (math.inf, "INF"), (-math.inf, "-INF")])
def test_what_no_literal_says_has_a_word_assumed(value: float, text: str) -> None:
    for data_type in ("REAL", "LREAL"):
        assert to_text(data_type, value).decode() == text
        assert repr(from_text(data_type, text.encode())) == repr(value)


@each_of(("data_type", "text", "wanted"), [
    ("INT", "  42  ", 42), ("INT", "INT#42", 42), ("INT", "int#-1_000", -1000), ("INT", "+7", 7), ("INT", "16#7F", 127),
    ("WORD", "WORD#16#FFFF", 65535), ("BYTE", "2#1010_1010", 170), ("BOOL", "1", True), ("BOOL", "BOOL#false", False),
    ("REAL", "5", 5.0), ("REAL", "REAL#1.5e3", 1500.0), ("LREAL", "-1E-3", -0.001), ("TIME", "T#1m30s", 90 * 10**9),
    ("TIME", "TIME#-2.5ms", -2_500_000), ("TIME", "1h", 3600 * 10**9), ("LTIME", "LTIME#1ns", 1),
    ("DATE", "1970-01-03", 2 * 86_400 * 10**9), ("TOD", "TIME_OF_DAY#00:00:01", 10**9),
])
def test_a_literal_with_or_without_prefix(data_type: str, text: str, wanted: Any) -> None:
    assert from_text(data_type, text.encode()) == wanted


@each_of(("data_type", "text", "code"), [
    ("INT", "", "R0111"), ("INT", "   ", "R0111"), ("INT", "1.5", "R0111"), ("INT", "DINT#5", "R0111"),
    ("INT", "32768", "R0105"), ("USINT", "-1", "R0105"), ("INT", "16#FFFF", "R0105"), ("BOOL", "2", "R0111"),
    ("BOOL", "yes", "R0111"), ("REAL", "1e39", "R0105"), ("REAL", "x", "R0111"), ("TIME", "5", "R0111"),
    ("TIME", "LT#5s", "R0111"), ("TIME", "T#300000d", "R0105"), ("DATE", "2023-02-30", "R0111"),
    ("TOD", "25:00:00", "R0111"),
    ("INT", "1\xe92", "R0111"), ("INT", "9" * 1000, "R0105"), ("INT", "INT#STRING#'1'", "R0111"),
    ("INT", "STRING#'1'", "R0111"),
])
def test_other_text_is_refused(data_type: str, text: str, code: str) -> None:
    with pytest.raises(Undefined) as caught:
        from_text(data_type, text.encode("latin-1"))
    assert (caught.value.code, caught.value.values) == (code, (text.encode("latin-1"), data_type))


@pytest.mark.slow
@given(data_type=st.sampled_from(WRITTEN), data=st.data())
def test_every_value_reads_back(data_type: str, data: st.DataObject) -> None:
    kind = ELEMENTARY[data_type]
    if kind.machine[0] == "f":
        value: Any = data.draw(st.floats(width=32 if kind.machine == "f32" else 64))
    elif "DAY" in data_type:
        value = data.draw(st.integers(0, 86_400 * 10**9 - 1))
    else:
        value = data.draw(st.integers(kind.low, kind.high))
    if data_type in ("DATE", "LDATE"):
        value = (abs(value) // (86_400 * 10**9)) * 86_400 * 10**9
    elif "DATE_AND" in data_type:
        value = max(value, -(2**63) + 86_400 * 10**9)
    assert repr(from_text(data_type, to_text(data_type, value))) in (repr(value), repr(bool(value)))


@pytest.mark.slow
@given(data_type=st.sampled_from(WRITTEN), text=st.binary(max_size=30))
def test_any_text_is_a_value_or_undefined(data_type: str, text: bytes) -> None:
    try:
        value = from_text(data_type, text)
    except Undefined as undefined:
        assert undefined.code in ("R0105", "R0111")
    else:
        assert from_text(data_type, to_text(data_type, value)) == value or value != value
