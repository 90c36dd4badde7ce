"""Conditions about values: what they mean and what is none."""

import pytest
from rows import each_of

from fbvm.base import types as t
from fbvm.base.areas import AREAS, SLOTS_OFFSET, e_bank
from fbvm.base.types import EnumType, Field
from fbvm.watch.conditions import ConditionError, parse_condition, parse_expression
from fbvm.watch.paths import Place, Span, find
from fbvm.watch.values import Value, nearest_real

COLOUR = EnumType("Colour", 2, 2, t.INT, {"RED": 0, "GREEN": 5}, {0: "Red", 5: "Green"})
SWITCH = EnumType("Switch", 2, 2, t.INT, {"OFF": 0, "ON": 1}, {0: "Off", 1: "On"})
KINDS = {"tenth": t.REAL, "long": t.LREAL, "when": t.DT, "day": t.DATE,
         "done": t.BOOL, "n": t.INT, "r": t.REAL, "wait": t.TIME, "text": t.string(), "c": COLOUR, "s": SWITCH,
         "list": t.array(((0, 2),), t.INT), "wide": t.string(9, wide=True)}
SYMBOLS = {name.upper(): Field(name, kind, 180224 + 16 * at) for at, (name, kind) in enumerate(KINDS.items())}
VALUES: dict[str, Value] = {
    "tenth": nearest_real(0.1), "long": 0.1, "when": 86_400_000_000_000, "day": 0, "W0": 0, "D10": 0, "W0.00": True,
    "done": True, "n": -7, "r": 0.5, "wait": 1_500_000_000, "text": "ok", "c": 5, "s": 1, "list[1]": 3, "D200": 513,
    "CIO 1509.15": True, "E0_5": 9, "n.0": True, "wide": "\u20ac\U0001f600",
}  # fmt: skip


def resolve(text: str) -> Place | Span:
    return find(SYMBOLS, {**AREAS, "E0": e_bank("E0", 2 * SLOTS_OFFSET)}, text)


def holds(text: str) -> bool:
    return parse_condition(text, resolve).holds(lambda place: VALUES[place.name])


@each_of("text", [
    "done", "NOT NOT done", "n = -7", "n <> 7", "n < 0 AND D200 > 512", "D200 = 16#201", "D200=513 OR 1 = 2",
    "CIO 1509.15", "cio1509.15 & TRUE", "r >= 0.5", "wait = 1.5s", "wait > T#1s400ms", "text = 'ok'",
    "c = Colour#Green",
    "c = 5", "list[1] = 3", "n / 2 = -3", "n MOD 2 = -1", "D200 - 13 = 5 * 10 * 10",
    "(1 + 2) * 3 = 9", "1 + 2 * 3 = 7", "TRUE OR FALSE AND FALSE", "NOT done OR n < 0", "done = TRUE", "done XOR FALSE",
    "-n = 7", "+n = -7", "n.0", "%D200 <= 513", "done = 1", "done = 2 - 1", "INT#5 > 4", "n < 1e3",
    "tenth + D200 MOD n < 99", "D200 MOD n > r", "7 / 2.0 = 3.5", "0 MOD 5 = 0", "7.0 / 2 = 3.5",
])  # fmt: skip
def test_holds(text: str) -> None:
    assert holds(text)


@each_of(("text", "described"), [
    ("n + 1", "INT"), ("n / 2.0", "LREAL"), ("0.5 + n", "LREAL"), ("r + 0.5", "REAL"), ("r + n", "REAL"), ("long - n", "LREAL"),
    ("1 + 1", "a number"), ("1 / 2.0", "a number"), ("wait * 1.5", "TIME"), ("n = 1.0", "BOOL"), ("-n", "INT"),
    ("list[0] + DINT#1", "DINT"),
    ("when + 1s", "DATE_AND_TIME"), ("when - when", "TIME"), ("day - 1d", "DATE"), ("'a'", "a text"), ("5s", "a time"),
])
def test_an_expression_has_the_type_of_its_value(text: str, described: str) -> None:
    assert parse_expression(text, resolve).described == described


def test_a_condition_knows_the_places_that_it_reads() -> None:
    assert [place.name for place in parse_condition("n > 1 AND (done OR NOT W 0.00)", resolve).places] == ["n", "done", "W0.00"]


@each_of("text", [
    "tenth = 0.1", "0.1 = tenth", "tenth + 0.1 = 0.2", "long = 0.1", "tenth = REAL#0.1", "tenth > -0.1", "tenth * 10 = 1",
])  # fmt: skip
def test_a_number_beside_a_real_is_rounded_to_32_bits_as_in_a_program(text: str) -> None:
    assert holds(text)


@pytest.mark.parametrize("text", ["tenth = LREAL#0.1", "tenth + LREAL#0.1 = 0.2", "tenth = long", "long + 0.1 = 0.3"])
def test_64_bits_are_not_rounded(text: str) -> None:
    assert not holds(text)


@each_of("text", [
    "W 0 = 0", "D 10 = 0", "D  10=0 AND W 0 = 0", "W 0.00", "NOT (D 10 <> 0)", "E0 : 5 = 9", "e0_5 = 9", "% D 10 = 0",
    "DM 10 = 0",
])
def test_an_address_may_have_a_space_within(text: str) -> None:
    assert holds(text)


@each_of("text", [
    "c = Green", "green = c", "c = Colour.Green", "c <> Red", "c = c", "s = On", "On = s", "c = Colour#green",
    "(c = Green) = TRUE",
])
def test_a_name_beside_an_enumeration_is_its_member(text: str) -> None:
    assert holds(text)


@each_of("text", [
    "done = ON", "done = BOOL#TRUE", "CIO 1509.15 = on", "done <> OFF",
    "when = DT#1970-01-02-00:00:00", "when > DT#1970-01-01-00:00:00",
    "when + 1d = DT#1970-01-03-00:00:00", "when + 1d > when", "DT#1970-01-02-00:00:00 - 1s < when", "day + 1d = D#1970-01-02",
    "day < D#2024-01-31", "2 * wait = 3s", "wait + 500ms = 2s", "wait * 2 = 3s",
    "when - DT#1970-01-01-00:00:00 = 1d", "text = 'o$6B'", "wait * 1.5 = 2s250ms", "wait / 2.5 = 600ms", "wait * r = 750ms",
    'wide = "\u20ac\U0001f600"', 'wide = "$20AC$D83D$DE00"', 'wide = WSTRING#"\u20ac\U0001f600"', 'wide <> "\u20ac"',
    "3ns * 0.5 = 2ns", "1ns * 0.5 = 0ns", "-3ns / 2.0 = -2ns", "wait / 2 = 750ms", "3ns / 2 = 1ns",
])
def test_literals_are_those_of_a_program(text: str) -> None:
    assert holds(text)


@each_of(("text", "message"), [
    ("wait > 10", "wait is TIME and takes a time such as 10ms, not 10"),
    ("10 < wait", "wait is TIME and takes a time such as 10ms, not 10"),
    ("wait > 5 + 5", "wait is TIME and takes a time such as 10ms, not 5 + 5"),
    ("wait + 5 > 1s", "+ needs numbers"),
    ("wait + 5s > 10", "> compares TIME with a number"),
    ("n = 'a'", "n is INT and takes a whole number, not 'a'"),
    ("text = 5", "text is STRING[80] and takes a text such as 'abc', not 5"),
    ("n = text", "= compares INT with STRING[80]"),
    ("n = wait", "= compares INT with TIME"),
    ("n = 40000", "n: 40000 is out of range of INT, which holds -32768..32767"),
    ("n < 1e9", "out of range of INT"),
    ("D200 = -1", "D200: -1 is out of range of WORD, which holds 0..65535; for these bits write 65535 or 16#FFFF"),
    ("D200 = TRUE", "D200 is WORD and takes a whole number, not TRUE"),
    ("tenth = 1e39", "out of range of REAL"),
    (" * ".join(["1" + "0" * 39] * 9) + " * 1.5 = 1", "* 1.5 cannot be computed: it is out of range of LREAL"),
    ("tenth + 1e39 = 1", "1e39 is out of range of REAL"),
    ("REAL#1e38 * 10 = 1", "REAL#1e38 * 10 cannot be computed: it is out of range of REAL"),
    ("day = D#1677-09-22 - 106751d", "day: -18446572800000000000 is out of range of DATE, which holds 1677-09-22 to 2262-04-11"),
    ("day = D#1600-01-01", "the date 1600-01-01 is outside 1677-09-22 to 2262-04-11"),
    ("n / 0 = 1", "division by zero"), ("r MOD 2 = 1", "MOD needs whole numbers in 'r MOD 2 = 1'"),
    ("n MOD 2.5 = 1", "MOD needs whole numbers"), ("2.5 MOD n = 1", "MOD needs whole numbers"),
    ("n MOD (1 - 1) = 1", "division by zero"),
    ("1 / 0 = 1", "division by zero"),
    ("c = Blue", "there is no Blue; known here"),
    ("c = Blue", "c is Colour, which has Red, Green"),
    ("c = Colour#Blue", "Colour has no member Colour#Blue"),
    ("c = 7", "7 is no member of Colour"),
    ("c = n", "= compares Colour with INT"),
    ("n = Green", "there is no Green"),
    ("n = Colour#Green", "Colour#Green stands beside nothing of its enumeration"),
    ("c = Shape.Green", "there is no Shape"), ("n * wait > text", "> compares TIME with STRING[80]"),
    ("when + 1d = day", "= compares DATE_AND_TIME with DATE"),
    ("day = when", "= compares DATE with DATE_AND_TIME"),
    ("day > 2024", "day is DATE and takes a date such as D#2024-01-31, not 2024"),
    ("day = DT#2024-01-01-00:00:00", "day is DATE and takes a date such as"),
    ("-text = 'a'", "- needs a number"),
    ("'a' = REAL#1.5", "= compares a text with REAL in"), ("REAL#1.5 < 'a'", "< compares REAL with a text in"),
    ("TRUE = r + 1", "= compares BOOL with REAL in"), ("2s > r * 2", "> compares a time with REAL in"),
    ("r + 'a' = 1", "+ needs numbers in"), ("2s < REAL#1.5", "< compares a time with REAL in"),
    ("INT#99999 = n", "out of the range of INT"),
])  # fmt: skip
def test_what_could_never_hold_is_refused(text: str, message: str) -> None:
    with pytest.raises(ConditionError) as error:
        parse_condition(text, resolve)
    assert message in str(error.value)


@each_of("text", ["NOT done", "n > 0", "c = Colour#Red", "1 / (n + 7) = 1", "text < 'a'", "done AND n = 0"])
def test_does_not_hold(text: str) -> None:
    assert not holds(text)


@each_of(("text", "message"), [
    ("", "ends too early"),
    ("n", "is no condition: it is not BOOL"),
    ("n + 1", "is no condition"),
    ("n AND done", "AND joins conditions; one side is not BOOL"),
    ("NOT n", "NOT needs a BOOL"),
    ("done = 7", "takes TRUE or FALSE, not 7"),
    ("done < n", "< compares BOOL with INT"),
    ("done + 1 = 2", "+ needs numbers"),
    ("missing > 1", "there is no missing"),
    ("n = (1", "a parenthesis is not closed"),
    ("n = 1)", "')' is not expected"),
    ("n = 1 2", "'2' is not expected"),
    ("n = ?", "'?' is not understood"),
    ("AND done", "'AND' is not expected"),
    ("list = 3", "list is no single value"),
    ("D200..D201 = 3", "not understood"),
    ("(" * 200 + "done" + ")" * 200, "nested too deep"),
    ("NOT " * 200 + "done", "nested too deep"),
    ("n" + " + n" * 2000 + " > 0", "more than 250 operators"),
])
def test_what_is_no_condition_says_why(text: str, message: str) -> None:
    with pytest.raises(ConditionError) as error:
        parse_condition(text, resolve)
    assert message in str(error.value)


def test_a_condition_has_as_many_operators_as_can_be_computed() -> None:
    text = " OR ".join(["(" * 40 + "n > 32767" + ")" * 40] * 125)
    assert not parse_condition(text, resolve).holds(lambda place: 1)


def test_arithmetic_behind_a_null_reference_holds_for_nothing() -> None:
    for text in ("n + 1 < 99", "1 + n < 99", "n = n", "done AND done", "n <> 1", "1 <> n", "n - 1 <> 5"):
        assert not parse_condition(text, resolve).holds(lambda place: None), text
