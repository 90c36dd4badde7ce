"""Which statements a place in a source means, at which passes a breakpoint stops, and what a log point may say."""

from __future__ import annotations

import pytest
from rows import each_of

from fbvm import compile_text
from fbvm.code.image import Image
from fbvm.machine.messages import parse_message
from fbvm.machine.passes import parse_passes
from fbvm.machine.source_lines import find_lines

TEXT = """\
FUNCTION_BLOCK Base
VAR n : INT; END_VAR
METHOD Add
VAR_INPUT k : INT; END_VAR
  n := n + k;
END_METHOD
PROPERTY Level : INT
GET
  Level := n;
END_GET
SET
  n := Level;
END_SET
END_PROPERTY
  n := n + 1;
END_FUNCTION_BLOCK
FUNCTION_BLOCK Tank EXTENDS Base
VAR inner : Base; x : INT; END_VAR
METHOD Empty
  x := 0;
END_METHOD
  x := x + 1; inner();
END_FUNCTION_BLOCK
PROGRAM Main
VAR a, b : Tank; c : Base; i : INT; END_VAR
  a(); b(); c();
  i := i + 1; i := i + 2;
LADDER
RUNG one
LD P_On
OUT W0.00
RUNG two
LD W0.00
OUT W0.01
END_LADDER
  a.Add(1); b.Empty(); c.Level := 2;
END_PROGRAM
"""


@pytest.fixture(scope="module")
def image() -> Image:
    made = compile_text(TEXT)
    assert made.image is not None, [each.render() for each in made.diagnostics]
    return made.image


def lines(image: Image, where: str) -> tuple[str, set[tuple[int, int]], str | None]:
    """What is shown of a place, lines and columns of its statements, and the only instance that counts."""
    found = find_lines(image, where)
    offsets = {"": None}
    main = image.symbols["MAIN"]
    for name, field in main.type.fields.items():  # type: ignore[attr-defined]
        offsets[name] = main.offset + field.offset
        if name in ("A", "B"):
            offsets[f"{name}.INNER"] = main.offset + field.offset + field.type.fields["INNER"].offset
    named = {offset: name for name, offset in offsets.items()}
    return found.where, {(image.sites[site].line, image.sites[site].column) for site in found.sites}, named[found.base] or None


@each_of("where, shown, places, instance", [
    ("Main", "text.st:26", {(26, 3)}, None), ("text.st:27", "text.st:27", {(27, 3)}, None),
    ("text.st:1", "text.st:5", {(5, 3)}, None),
    ("./x/text.st:27", "text.st:27", {(27, 3)}, None), ("tank", "text.st:22", {(22, 3)}, None),
    ("Base.Add", "text.st:5", {(5, 3)}, None),
    ("Base.Level", "Base.Level", {(9, 3), (12, 3)}, None), ("Base.Level.Get", "text.st:9", {(9, 3)}, None),
    ("Main#2", "text.st:32", {(32, 1)}, None), ("main # 1", "text.st:29", {(29, 1)}, None),
    ("Main.a", "Main.a", {(22, 3)}, "A"), ("Main.b.inner", "Main.b.inner", {(15, 3)}, "B.INNER"),
    ("Main.c", "Main.c", {(15, 3)}, "C"),
    ("Main.b.Empty", "Main.b.Empty", {(20, 3)}, "B"), ("Main.a.Add", "Main.a.Add", {(5, 3)}, "A"),
    ("main.b.inner.add", "main.b.inner.add", {(5, 3)}, "B.INNER"), ("Main.c.Level", "Main.c.Level", {(9, 3), (12, 3)}, "C"),
    ("Main.a.Level.Set", "Main.a.Level.Set", {(12, 3)}, "A"),
])
def test_what_a_place_means(image: Image, where: str, shown: str, places: set[tuple[int, int]], instance: str | None) -> None:
    assert lines(image, where) == (shown, places, instance)


@each_of("where, said", [
    ("Main#3", "'Main#3' is no rung; rungs of Main are 1 to 2"), ("Tank#1", "'Tank#1' is no rung; 'Tank' has no rungs"),
    ("text.st:37", "text.st:37: the last statement of text.st is on line 36"),
    ("other.st:3", "no statement is in 'other.st'; files are text.st"),
    ("xtext.st:3", "no statement is in 'xtext.st'; files are text.st"),
    ("Main.i", "'Main.i' is neither FILE:LINE nor a POU with statements; POUs are "
               "Base, Base.Add, Base.Level.Get, Base.Level.Set, Main, Tank, Tank.Empty"),
    ("Main.c.Empty", "'Main.c.Empty' is neither FILE:LINE nor a POU with statements; POUs are "
                     "Base, Base.Add, Base.Level.Get, Base.Level.Set, Main, Tank, Tank.Empty"),
])
def test_what_is_no_place_is_said_so(image: Image, where: str, said: str) -> None:
    with pytest.raises(ValueError) as raised:
        find_lines(image, where)
    assert str(raised.value) == said


@each_of("text, stops", [
    ("5", [5]), ("= 5", [5]), ("==5", [5]), (">= 9", [9, 10, 11, 12]), ("> 9", [10, 11, 12]), ("% 5", [5, 10]),
    ("%1", list(range(1, 13))),
])
def test_at_which_passes_a_breakpoint_stops(text: str, stops: list[int]) -> None:
    test = parse_passes(text)
    assert test is not None and [number for number in range(1, 13) if test(number)] == stops


def test_an_empty_hit_count_is_none_and_a_wrong_one_is_refused() -> None:
    assert parse_passes("") is None and parse_passes("  ") is None
    for text in ("0", "% 0", "-1", "five", "< 5", "5 6", "!= 5"):
        with pytest.raises(ValueError, match="is no hit count; write 5, = 5, >= 5, > 5 or % 5"):
            parse_passes(text)


@each_of("text, parts, names", [
    ("plain", ("plain",), []), ("", (), []), ("{n}", (("n", False),), ["n"]), ("{{n}}", ("{", "n", "}"), []),
    ("a {n:x} b { m } c", ("a ", ("n", True), " b ", ("m", False), " c"), ["n", "m"]), ("{ n : X }", (("n", True),), ["n"]),
    ("{a:b}", (("a:b", False),), ["a:b"]), ("{D0..D3:x}", (("D0..D3", True),), ["D0..D3"]), ("{:x}", (("", True),), [""]),
])
def test_what_a_message_shows(text: str, parts: tuple[object, ...], names: list[str]) -> None:
    message = parse_message(text)
    assert (message.parts, message.names) == (parts, names)


@each_of("text", ["{", "}", "a {n b", "a n} b", "{}", "{ }", "{{n}"])
def test_a_brace_that_stands_alone_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"write \{name\}, or \{\{ for a brace"):
        parse_message(text)
