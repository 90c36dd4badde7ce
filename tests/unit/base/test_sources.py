"""Source texts: lines, places, and what a message shows of them."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm.base.diagnostics import WIDTH, Diagnostic, Source, caret_lines, whole_lines


@each_of("text, read", [
    ("a\rb", "a\nb"), ("a\r\nb", "a\r\nb"), ("a\nb", "a\nb"), ("a\rb\r\nc", "a\nb\r\nc"), ("a\r", "a\n"), ("", ""),
    ("\r\r\n", "\n\r\n"),
])
def test_a_carriage_return_alone_ends_a_line(text: str, read: str) -> None:
    assert (whole_lines(text), Source("a.st", text).text) == (read, read)


def test_places_and_lines_of_a_part_count_from_its_first_line() -> None:
    source = Source("a.st", "one\r\n\nthree", first_line=7)
    assert [source.place(offset) for offset in (-3, 0, 3, 5, 6, 8, 11, 99)] == [
        (7, 1), (7, 1), (7, 4), (8, 1), (9, 1), (9, 3), (9, 6), (9, 6)]
    assert [source.line(number) for number in (7, 8, 9)] == ["one", "", "three"]
    with pytest.raises(IndexError):
        source.line(10)


@each_of("start, end, carets", [
    (0, 3, "^^^"), (4, 4, "    ^"), (4, 9, "    ^^^^^"), (8, 99, "        ^^"), (10, 10, "          ^"),
])
def test_carets_stand_below_what_is_meant(start: int, end: int, carets: str) -> None:
    assert caret_lines(Source("a.st", "abc := 123"), start, end) == ["    abc := 123", f"    {carets}"]


def test_tabs_stay_so_that_carets_stand_right_and_what_cannot_be_shown_is_replaced() -> None:
    assert caret_lines(Source("a.st", "\ta\x1b\tb"), 4, 5) == ["    \ta\N{REPLACEMENT CHARACTER}\tb", "    \t  \t^"]
    assert caret_lines(Source("a.st", ""), 0, 1) == []


@each_of("length, at, first", [
    (WIDTH, WIDTH - 1, 0), (WIDTH + 1, WIDTH, WIDTH // 2), (1000, 10, 0), (1000, 500, 500 - WIDTH // 2), (1000, WIDTH // 2, 0),
    (1000, WIDTH // 2 + 1, 1),
])
def test_of_a_long_line_a_piece_is_shown(length: int, at: int, first: int) -> None:
    text = "".join(chr(ord("a") + number % 26) for number in range(length))
    shown, carets = caret_lines(Source("a.st", text), at, at + 1)
    assert shown == f"    {text[first:first + WIDTH]}"
    assert carets == "    " + " " * (at - first) + "^"


def test_a_message_as_text_and_as_data() -> None:
    source, other = Source("a.st", "x := y;\nz\n"), Source("b.st", "VAR x")
    said = Diagnostic("S0201", source, 5, 6, "unknown name", "declare it", (other, 4, "declared here"))
    assert said.render().splitlines() == [
        "a.st:1:6: error S0201: unknown name", "    x := y;", "         ^", "  b.st:1:5: declared here", "    VAR x", "        ^",
        "  help: declare it"]
    assert said.as_dict() == {
        "code": "S0201", "severity": "error", "file": "a.st", "line": 1, "column": 6, "end_line": 1, "end_column": 7,
        "message": "unknown name", "hint": "declare it",
        "related": {"file": "b.st", "line": 1, "column": 5, "message": "declared here"}}
    bare = Diagnostic("S0290", source, 8, 2, "never used")
    assert bare.render().splitlines() == ["a.st:2:1: warning S0290: never used", "    z", "    ^"]
    assert {"related"} & set(bare.as_dict()) == set() and (bare.as_dict()["end_line"], bare.as_dict()["end_column"]) == (2, 1)
    assert (bare.severity, Diagnostic("S0290", source, 8, 9, "never used", raised=True).severity) == ("warning", "error")
