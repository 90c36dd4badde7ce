"""Every literal form of tables 5 to 9, decoded to the last nanosecond; and what is no literal."""

from __future__ import annotations

from datetime import date, datetime, timedelta

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.syntax.parser import parse
from fbvm.syntax.st import literals
from fbvm.syntax.tree import Assign, Literal, Pou

SECOND = 1_000_000_000
DAY = 86_400 * SECOND


def literal(text: str) -> tuple[Literal, list[str]]:
    """The literal that the parser makes of a text, and the codes of its errors."""
    tree, diagnostics = parse(Source("x", f"PROGRAM p x := {text}; END_PROGRAM"))
    pou = tree.declarations[0]
    assert isinstance(pou, Pou)
    statement = pou.body[0]
    assert isinstance(statement, Assign) and isinstance(statement.value, Literal)
    return statement.value, [d.code for d in diagnostics if d.severity == "error"]


GOOD = [
    ("0", "int", 0, None), ("007", "int", 7, None), ("123_456", "int", 123456, None), ("2#1010_1010", "int", 170, None),
    ("8#377", "int", 255, None), ("16#Ff", "int", 255, None), ("16#FFFF_FFFF_FFFF_FFFF", "int", 2**64 - 1, None),
    ("18446744073709551615", "int", 2**64 - 1, None),
    ("INT#-5", "int", -5, "INT"), ("int#+5", "int", 5, "INT"), ("SINT#-128", "int", -128, "SINT"),
    ("ULINT#16#FFFF_FFFF_FFFF_FFFF", "int", 2**64 - 1, "ULINT"), ("LINT#-9223372036854775808", "int", -2**63, "LINT"),
    ("WORD#16#FF", "int", 255, "WORD"), ("BYTE#2#1", "int", 1, "BYTE"), ("USINT#1_0", "int", 10, "USINT"),
    ("1.5", "real", 1.5, None), ("1E3", "real", 1000.0, None), ("1_0.2_5e-1", "real", 1.025, None), ("0.1", "real", 0.1, None),
    ("REAL#1", "real", 1.0, "REAL"), ("LREAL#-1.5E+3", "real", -1500.0, "LREAL"), ("REAL#16#10", "real", 16.0, "REAL"),
    ("TRUE", "bool", True, None), ("false", "bool", False, None), ("BOOL#1", "bool", True, "BOOL"),
    ("BOOL#0", "bool", False, "BOOL"), ("bool#True", "bool", True, "BOOL"),
    ("''", "string", "", None), ("'a$'b$$'", "string", "a'b$", None), ("'$41$e9$00'", "string", "Aé\0", None),
    ("'$L$n$P$R$t'", "string", "\n\n\f\r\t", None), ("'\"'", "string", '"', None), ("'é'", "string", "é", None),
    ('"a$"b\'"', "wstring", "a\"b'", None), ('"$20AC$D83D"', "wstring", "€\ud83d", None),
    ('"\N{GRINNING FACE}"', "wstring", "\ud83d\ude00", None),
    ("STRING#'x'", "string", "x", "STRING"), ("WSTRING#'$0041'", "wstring", "A", "WSTRING"),
    ('WSTRING#"x"', "wstring", "x", "WSTRING"), ("CHAR#'$''", "string", "'", "CHAR"), ('WCHAR#"$0041"', "wstring", "A", "WCHAR"),
    ("T#0s", "time", 0, "TIME"), ("T#25h", "time", 90_000 * SECOND, "TIME"), ("t#1.5s", "time", 1_500_000_000, "TIME"),
    ("TIME#1d2h3m4s5ms6us7ns", "time", 93_784_005_006_007, "TIME"), ("T#-1h_30m", "time", -5400 * SECOND, "TIME"),
    ("LT#-5us300ns", "time", -5300, "LTIME"), ("LTIME#0.000_000_001s", "time", 1, "LTIME"),
    ("T#+1ms", "time", 1_000_000, "TIME"),
    ("T#1_000MS", "time", SECOND, "TIME"), ("T#106751d23h47m16s854ms775us807ns", "time", 2**63 - 1, "TIME"),
    ("T#-106751d23h47m16s854ms775us808ns", "time", -2**63, "TIME"), ("T#90m30s", "time", 5430 * SECOND, "TIME"),
    ("D#1970-01-01", "date", 0, "DATE"), ("LDATE#2000-3-1", "date", 11_017 * DAY, "LDATE"),
    ("d#1969-12-31", "date", -DAY, "DATE"),
    ("LD#2024-02-29", "date", 19_782 * DAY, "LDATE"),
    ("TOD#10:00", "tod", 36_000 * SECOND, "TIME_OF_DAY"), ("TIME_OF_DAY#0:0:0.5", "tod", SECOND // 2, "TIME_OF_DAY"),
    ("LTOD#23:59:59.999999999", "tod", DAY - 1, "LTIME_OF_DAY"), ("LTIME_OF_DAY#1:2:3", "tod", 3723 * SECOND, "LTIME_OF_DAY"),
    ("DT#1970-01-02-00:00:01", "dt", DAY + SECOND, "DATE_AND_TIME"),
    ("LDT#1969-12-31-23:59:59.5", "dt", -SECOND // 2, "LDATE_AND_TIME"),
    ("DATE_AND_TIME#2262-04-11-23:47:16.854775807", "dt", 2**63 - 1, "DATE_AND_TIME"),
]


@each_of(("text", "kind", "value", "type_name"), GOOD, ids=[ascii(g[0]) for g in GOOD])
def test_a_literal_is_decoded_exactly(text: str, kind: str, value: object, type_name: str | None) -> None:
    found, errors = literal(text)
    assert (found.kind, found.value, found.type_name, found.text, errors) == (kind, value, type_name, text, [])
    assert type(found.value) is type(value)


BAD = [
    ("12__3", "S0105"), ("12_", "S0105"), ("1x", "S0105"), ("1.5x", "S0105"), ("2#2", "S0105"), ("8#8", "S0105"),
    ("16#G", "S0105"), ("16#", "S0105"), ("16#_1", "S0105"), ("3#1", "S0105"), ("1.5E", "S0105"), ("INT#", "S0105"),
    ("INT#x", "S0105"), ("INT#1.5", "S0105"), ("INT#-16#1", "S0105"), ("BOOL#2", "S0105"), ("T#", "S0105"), ("T#5", "S0105"),
    ("T#1s1m", "S0105"), ("T#1s1s", "S0105"), ("T#1.5m1s", "S0105"), ("T#1__0s", "S0105"), ("T#1x", "S0105"),
    ("D#2023-02-29", "S0105"), ("D#1900-02-29", "S0105"), ("D#2024-00-01", "S0105"), ("D#2024-04-31", "S0105"),
    ("D#2024", "S0105"),
    ("TOD#24:00", "S0105"), ("TOD#0:60", "S0105"), ("TOD#0:0:60", "S0105"), ("DT#2024-01-01", "S0105"), ("DT#10:00", "S0105"),
    ("'$q'", "S0104"), ("'$4'", "S0104"), ('"$041"', "S0104"), ("CHAR#''", "S0105"), ("CHAR#'ab'", "S0105"),
    ('STRING#"x"', "S0105"), ("STRING#5", "S0105"),
    ("18446744073709551616", "S0108"), ("INT#32768", "S0108"), ("INT#-32769", "S0108"), ("UINT#-1", "S0108"),
    ("BYTE#16#100", "S0108"), ("REAL#3.5E38", "S0108"), ("1E309", "S0108"), ("LREAL#-1E309", "S0108"), ("T#0.5ns", "S0108"),
    ("T#106752d", "S0108"), ("D#1677-09-20", "S0108"), ("D#2262-04-12", "S0108"), ("DT#2262-04-11-23:47:17", "S0108"),
    ("TOD#0:0:0.0000000001", "S0108"), ("9" * 500, "S0108"), ("T#" + "9" * 500 + "s", "S0105"),
]


@each_of(("text", "code"), BAD, ids=[b[0][:40] for b in BAD])
def test_what_is_no_literal_has_one_error(text: str, code: str) -> None:
    _, errors = literal(text)
    assert errors == [code]


def test_the_literal_of_a_typed_name_that_is_no_type_is_one_of_an_enumeration() -> None:
    _, diagnostics = parse(Source("x", "PROGRAM p x := Color#Red; y := Color#5; END_PROGRAM"))
    assert [d.code for d in diagnostics] == ["S0105"]


def test_a_string_beyond_latin_1_becomes_utf_8_bytes_with_a_warning() -> None:
    tree, diagnostics = parse(Source("x", "PROGRAM p x := 'Ω'; END_PROGRAM"))
    value = tree.declarations[0].body[0].value.value  # type: ignore[attr-defined]
    assert (value, [d.code for d in diagnostics]) == ("Î©", ["S0192"])


@pytest.mark.slow
@given(st.dates(date(1678, 1, 1), date(2262, 4, 10)))
def test_dates_agree_with_the_calendar(day: date) -> None:
    assert literals.typed("D", day.isoformat())[1] == (day - date(1970, 1, 1)).days * DAY


@pytest.mark.slow
@given(st.datetimes(datetime(1678, 1, 1), datetime(2262, 4, 10)))
def test_moments_agree_with_the_calendar(moment: datetime) -> None:
    since = (moment - datetime(1970, 1, 1)) // timedelta(microseconds=1) * 1000
    assert literals.typed("LDT", moment.strftime("%4Y-%m-%d-%H:%M:%S.%f").lstrip("0"))[1] == since


@pytest.mark.slow
@given(st.integers(-2**63 + 1, 2**63 - 1))
def test_durations_of_all_units_add_up(total: int) -> None:
    rest, text = abs(total), "-" if total < 0 else ""
    for unit, size in literals.UNITS_NS.items():
        count, rest = divmod(rest, size)
        text += f"{count}{unit}"
    assert literals.duration(text) == total


@pytest.mark.slow
@given(st.integers(0, 2**64 - 1), st.sampled_from([(2, "b"), (8, "o"), (16, "X")]))
def test_based_numbers_agree_with_python(value: int, form: tuple[int, str]) -> None:
    assert literals.number(f"{form[0]}#{value:{form[1]}}") == ("int", value, None)


@pytest.mark.slow
@given(st.floats(allow_nan=False, allow_infinity=False, min_value=0))
def test_reals_are_read_to_the_nearest(value: float) -> None:
    text = repr(value) if "." in repr(value) or "e" in repr(value) else repr(value) + ".0"
    assert literals.number(text) == ("real", value, None)
