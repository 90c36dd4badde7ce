"""Digits, characters for terminals, and TOML: texts that come from anywhere."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm.base.digits import MOST_DIGITS, TOO_LARGE, whole_number
from fbvm.base.printable import one_line, printable
from fbvm.base.toml import MOST_DEPTH, TomlError, load_toml

NINES = "9" * MOST_DIGITS


@each_of("text, value", [
    ("0", 0), ("-12", -12), ("+7", 7), (NINES, TOO_LARGE - 1), (NINES + "9", TOO_LARGE), ("-" + NINES, 1 - TOO_LARGE),
    ("-" + NINES + "9", -TOO_LARGE), ("0" * 50 + "7", 7), ("-" + "0" * 50 + "7", -7), ("+" + "0" * 50 + NINES, TOO_LARGE - 1),
    ("0" * 50, 0), (" " + "0" * 50 + "12 ", 12), (" -" + "0" * 50 + "12", -12),
])
def test_digits_are_a_number_however_many_there_are(text: str, value: int) -> None:
    assert whole_number(text) == value


@each_of("text", ["", "x", "1.5", "-", "9" * 50 + "x", "--" + "9" * 50, "9" * 30 + " " + "9" * 30])
def test_other_texts_are_no_number(text: str) -> None:
    with pytest.raises(ValueError):
        whole_number(text)


@each_of("text, shown", [
    ("pump", "pump"), ("a\tb\nc", "a\tb\nc"), ("\x1b[31m", "\\x1b[31m"), ("Füllstand \N{INFINITY}", "Füllstand \N{INFINITY}"),
    ("\N{ZERO WIDTH SPACE}x\u202ey", "\\u200bx\\u202ey"), ("\x7f", "\\x7f"), ("ü\x9bü", "ü\\x9bü"), ("a\rb", "a\\rb"),
])
def test_what_a_terminal_would_obey_is_shown(text: str, shown: str) -> None:
    assert printable(text) == shown
    assert one_line(text) == shown.replace("\n", "\\n").replace("\t", "\\t")


@each_of("text, line, column", [
    (f"a = {(1 << 63) - 1}", 0, 0), (f"a = {-(1 << 63)}", 0, 0), (f"a = {1 << 63}", 1, 5), (f"a = {-(1 << 63) - 1}", 1, 6),
    (f"a = 1\nb = [0, {1 << 63}]", 2, 9), (f"a = 1234567890123456\nb = {{x = 0x{1 << 64:X}}}", 2, 12),
    (f"a = 1\nb = {'9' * 5000}", 2, 5),
])
def test_a_number_beyond_64_bits_is_refused_at_its_place(text: str, line: int, column: int) -> None:
    if not line:
        assert load_toml(text)
        return
    with pytest.raises(TomlError, match="a number does not fit 64 bits") as raised:
        load_toml(text)
    assert (raised.value.line, raised.value.column) == (line, column)


def test_values_may_be_nested_so_deep_and_no_deeper() -> None:
    load_toml("a = " + "[" * (MOST_DEPTH - 1) + "1" + "]" * (MOST_DEPTH - 1))
    for text in ("a = " + "[" * MOST_DEPTH + "1" + "]" * MOST_DEPTH, "a = " + "[" * 5000 + "]" * 5000,
                 "[" + ".".join("a" * (MOST_DEPTH + 1)) + "]\n"):
        with pytest.raises(TomlError, match="values are nested too deeply") as raised:
            load_toml(text)
        assert (raised.value.line, raised.value.column) == (1, 1)


@each_of("text, said, line, column", [
    ("a = 1\nb = 'x", "Expected \"'\"", 2, 7), ("a =", "Invalid value", 1, 4), ("a = 1\na = 2", "Cannot overwrite a value", 2, 6),
    ('a = "x\n', "Illegal character", 1, 7),
])
def test_a_text_that_is_no_toml_is_refused_at_its_place(text: str, said: str, line: int, column: int) -> None:
    with pytest.raises(TomlError) as raised:
        load_toml(text)
    assert str(raised.value).startswith(said) and (raised.value.line, raised.value.column) == (line, column)
