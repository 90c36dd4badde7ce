"""Values as they are shown: in the base that a client asks for, of variables and of what is computed."""

from __future__ import annotations

from pathlib import Path

import pytest
from dap_client import Client, RefusedError
from rows import each_of

TEXT = """\
TYPE Mode : (Off, Slow, Fast); END_TYPE
PROGRAM Main
VAR
    flags : ARRAY[1..3] OF WORD := [16#12, 16#AB, 255];
    counts : ARRAY[1..2] OF INT := [10, -1];
    byte_ : BYTE := 16#C; long : LWORD := 16#1_0000_0000; n : INT := -2; u : UDINT := 100;
    on : BOOL := TRUE; said : STRING := 'a'; r : REAL := 1.5; mode : Mode := Mode#Fast; t : TIME := T#50ms;
    word_ AT D100 : WORD := 16#1F; coil AT CIO 100.01 : BOOL;
END_VAR
    coil := on;
END_PROGRAM
"""
SHOWN = {
    "flags": ("[18, 171, 255]", "[16#0012, 16#00AB, 16#00FF]"), "flags[2]": ("171", "16#00AB"),
    "counts": ("[10, -1]", "[10, -1]"), "counts[2]": ("-1", "16#FFFF"), "byte_": ("12", "16#0C"),
    "long": ("4294967296", "16#0000000100000000"), "n": ("-2", "16#FFFE"), "u": ("100", "16#00000064"), "on": ("TRUE", "TRUE"),
    "said": ("'a'", "'a'"), "r": ("1.5", "1.5"), "mode": ("Fast (2)", "Fast (2)"), "t": ("T#50ms", "T#50ms"),
    "word_": ("31", "16#001F"), "D100": ("31 (16#001F)", "16#001F"), "coil": ("FALSE", "FALSE"),
}  # fmt: skip


@pytest.fixture
def client(tmp_path: Path) -> Client:
    (tmp_path / "values.st").write_text(TEXT, encoding="utf-8")
    made = Client()
    made.begin(program=str(tmp_path / "values.st"))
    return made


def test_values_are_shown_in_the_base_that_is_asked_for(client: Client) -> None:
    found = {name: tuple(client.ask("evaluate", expression=name, format={"hex": hexadecimal})["result"] for hexadecimal in (
        False, True)) for name in SHOWN}  # fmt: skip
    assert found == SHOWN
    reference = client.scopes()["Locals"]["variablesReference"]
    for number, said in enumerate(({"hex": False}, {"hex": True})):
        rows = client.rows(reference, format=said)
        assert {name: rows[name]["value"] for name in rows} == {name: SHOWN[name][number] for name in rows}
        assert set(rows) == {name for name in SHOWN if "[" not in name and name != "D100"}


COMPUTED = {
    "TRUE": ("TRUE", "BOOL"), "NOT TRUE": ("FALSE", "BOOL"), "1 = 1": ("TRUE", "BOOL"), "2 + 3": ("5", "a number"),
    "1.5 * 2": ("3.0", "a number"), "'a$'b'": ("'a$'b'", "a text"), "T#1500ms": ("T#1s500ms", "a time"),
    "D#2024-01-31": ("D#2024-01-31", "a date"), "TOD#12:30:00": ("TOD#12:30:00", "a time_of_day"), "INT#3": ("3", "INT"),
    "DT#2024-01-31-12:30:00": ("DT#2024-01-31-12:30:00", "a date_and_time"), "n + 1": ("-1", "INT"), "r * 2": ("3.0", "REAL"),
    "n = -2 AND on": ("TRUE", "BOOL"), "mode = Mode#Fast": ("TRUE", "BOOL"), "t > T#40ms": ("TRUE", "BOOL"),
    "D100 + 1": ("32", "WORD"), "- n": ("2", "INT"), "16#FF": ("255", "a number"),
}  # fmt: skip


def test_what_is_computed_is_shown_as_a_program_writes_it(client: Client) -> None:
    found = {text: client.ask("evaluate", expression=text) for text in COMPUTED}
    assert {text: (row["result"], row["type"]) for text, row in found.items()} == COMPUTED
    assert client.ask("evaluate", expression="D100..D101") == {"result": "[31 (16#001F), 0 (16#0000)]", "variablesReference": 0}


@each_of(("text", "said"), [
    ("", "there is nothing to evaluate"), ("1 / 0", "division by zero in '1 / 0'"), ("n / 0", "division by zero in 'n / 0'"),
    ("nobody", "there is no nobody; known here: Main"), ("n > 'a'", "n is INT and takes a whole number, not 'a'"),
    ("n / (n + 2)", "n / (n + 2) cannot be computed: division by zero"),
    ("n MOD (n + 2)", "n MOD (n + 2) cannot be computed: division by zero"),
    ("r / (r - 1.5)", "r / (r - 1.5) cannot be computed: division by zero"),
])
def test_what_cannot_be_computed_is_refused_in_words(client: Client, text: str, said: str) -> None:
    with pytest.raises(RefusedError) as refused:
        client.ask("evaluate", expression=text, context="watch")
    assert str(refused.value) == said
