"""Conditions about values: what they mean and what is none."""

import pytest

from fbvm.base import types as t
from fbvm.base.areas import AREAS
from fbvm.base.types import EnumType, Field
from fbvm.watch.conditions import ConditionError, parse_condition
from fbvm.watch.paths import Place, Span, find
from fbvm.watch.values import Value

COLOUR = EnumType("Colour", 2, 2, t.INT, {"RED": 0, "GREEN": 5}, {0: "Red", 5: "Green"})
KINDS = {"done": t.BOOL, "n": t.INT, "r": t.REAL, "wait": t.TIME, "text": t.string(), "c": COLOUR,
         "list": t.array(((0, 2),), t.INT)}
SYMBOLS = {name.upper(): Field(name, kind, 180224 + 16 * at) for at, (name, kind) in enumerate(KINDS.items())}
VALUES: dict[str, Value] = {
    "done": True, "n": -7, "r": 0.5, "wait": 1_500_000_000, "text": "ok", "c": 5, "list[1]": 3, "D200": 513,
    "CIO 1509.15": True, "E0_5": 9, "n.0": True,
}  # fmt: skip


def resolve(text: str) -> Place | Span:
    return find(SYMBOLS, AREAS, text)


def holds(text: str) -> bool:
    return parse_condition(text, resolve).holds(lambda place: VALUES[place.name])


@pytest.mark.parametrize("text", [
    "done", "NOT NOT done", "n = -7", "n <> 7", "n < 0 AND D200 > 512", "D200 = 16#201", "D200=513 OR 1 = 2",
    "CIO 1509.15", "cio1509.15 & TRUE", "r >= 0.5", "wait = 1.5s", "wait > T#1s400ms", "text = 'ok'",
    "c = Colour#Green",
    "c = 5", "list[1] = 3", "n / 2 = -3", "n MOD 2 = -1", "D200 - 13 = 5 * 10 * 10",
    "(1 + 2) * 3 = 9", "1 + 2 * 3 = 7", "TRUE OR FALSE AND FALSE", "NOT done OR n < 0", "done = TRUE", "done XOR FALSE",
    "-n = 7", "n.0", "%D200 <= 513", "done = 1", "INT#5 > 4", "n < 1e3",
])  # fmt: skip
def test_holds(text: str) -> None:
    assert holds(text)


@pytest.mark.parametrize("text", ["NOT done", "n > 0", "c = Colour#Red", "1 / 0 = 1", "text < 'a'", "done AND n = 0"])
def test_does_not_hold(text: str) -> None:
    assert not holds(text)


@pytest.mark.parametrize(("text", "message"), [
    ("", "ends too early"),
    ("n", "is no condition: it is not BOOL"),
    ("n + 1", "is no condition"),
    ("n AND done", "AND joins conditions; one side is not BOOL"),
    ("NOT n", "NOT needs a BOOL"),
    ("done = 7", "takes TRUE or FALSE, not 7"),
    ("done < n", "compares BOOL with something else"),
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
])
def test_what_is_no_condition_says_why(text: str, message: str) -> None:
    with pytest.raises(ConditionError) as error:
        parse_condition(text, resolve)
    assert message in str(error.value)
