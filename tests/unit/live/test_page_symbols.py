"""What a page finds by a search, and what it sees of a place: its parts, and the row beside its value."""

from __future__ import annotations

from collections.abc import Generator
from typing import Any

import pytest
from browsers import Page
from rows import each_of

from fbvm.live import symbols

NESTED = '''TYPE Color : (Red, Green); P : STRUCT x : INT; c : Color; END_STRUCT END_TYPE
FUNCTION_BLOCK Deep VAR k : DINT; END_VAR k := k + 1; END_FUNCTION_BLOCK
FUNCTION_BLOCK Outer VAR p : P; d : Deep; END_VAR d(); END_FUNCTION_BLOCK
PROGRAM Main VAR o : Outer; z : DINT; a : ARRAY[1..21] OF P; r : REF_TO P; END_VAR o(); z := 1; END_PROGRAM'''


def through(steps: Generator[None, None, Any]) -> tuple[int, Any]:
    """How often it rests, and what it returns."""
    rests = 0
    while True:
        try:
            next(steps)
        except StopIteration as ended:
            return rests, ended.value
        rests += 1


@each_of(("text", "names"), (
    ("main. dint", ["Main.z", "Main.o.d.k"]), ("COLOR", ["Main.o.p.c"]), ("said", ["Main.z"]), ("z SAID z", ["Main.z"]),
    (" Main.a[3].x ", ["Main.a[3].x"]), ("Main.a[22].x", []), ("lamp", ["CIO 5"]), ("cio lamp", ["CIO 5"]), ("lamp x", [])))
def test_a_search_looks_into_names_types_and_descriptions(text: str, names: list[str]) -> None:
    page = Page(NESTED)
    said = {"Main.z": "what is said"}
    _, made = through(symbols.search(page.plc, {"CIO 5": "the Lamp", "CIO 6": ""}, lambda place: said.get(place.name, ""), text))
    assert [row["name"] for row in made["found"]] == names


@each_of(("addresses", "rests"), ((49, 0), (50, 1), (99, 1), (100, 2)))
def test_a_search_rests_behind_each_fifty_descriptions(addresses: int, rests: int) -> None:
    described = {f"CIO {number}": "lamp" for number in range(addresses)}
    rested, made = through(symbols.search(Page(NESTED).plc, described, lambda place: "", "lamp"))
    assert (rested, len(made["found"])) == (rests, addresses)


def test_a_search_goes_no_deeper_where_enough_has_been_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    """Main is one, it has four variables, and these have two members."""
    plc = Page(NESTED).plc
    for most, names in ((1, []), (2, ["Main.z"]), (7, ["Main.z"]), (8, ["Main.z", "Main.o.d.k"])):
        monkeypatch.setattr(symbols, "MOST_SEARCHED", most)
        assert [row["name"] for row in through(symbols.search(plc, {}, lambda place: "", "dint"))[1]["found"]] == names, most


@each_of(("name", "names", "rests"), (
    ("Main.o", ["Main.o.p", "Main.o.d"], 0), ("Main.o.p", ["Main.o.p.x", "Main.o.p.c"], 0), ("Main.z", [], 0),
    ("Main.a", [f"Main.a[{number}]" for number in range(1, 22)], 2), ("Main.a[21]", ["Main.a[21].x", "Main.a[21].c"], 0),
    ("D0..D9", [f"D{number}" for number in range(10)], 1), ("D0..D8", [f"D{number}" for number in range(9)], 0)))
def test_what_has_parts_opens_into_them(name: str, names: list[str], rests: int) -> None:
    assert [rests, names] == [(made := through(symbols.parts(Page(NESTED).plc, lambda place: "", name)))[0],
                              [row["name"] for row in made[1]]]  # fmt: skip


def test_of_many_parts_the_first_are_listed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(symbols, "MOST_PARTS", 2)
    plc = Page(NESTED).plc
    listed = [[row["name"] for row in through(symbols.parts(plc, lambda place: "", name))[1]]
              for name in ("Main.a", "Main", "D0..D8")]
    assert listed == [["Main.a[1]", "Main.a[2]"], ["Main.o", "Main.z"], ["D0", "D1"]]


@each_of(("name", "row"), (
    ("Main.z", {"type": "DINT", "said": "Main.z!", "tree": False, "bytes": 4, "constant": False}),
    ("Main.a", {"type": "ARRAY [1..21] OF P", "said": "Main.a!", "tree": True, "bytes": 84, "constant": False}),
    ("Main.o.p.c", {"type": "Color", "said": "Main.o.p.c!", "tree": False, "bytes": 2, "constant": False,
                    "members": ["Red", "Green"]}),
    ("D0..D3", {"type": "4 x WORD", "said": "", "tree": False})))
def test_what_a_page_shows_beside_a_value(name: str, row: dict[str, Any]) -> None:
    place = Page(NESTED).plc.find(name)
    assert symbols.row(place, lambda place: f"{place.name}!") == {"name": name, **row}
