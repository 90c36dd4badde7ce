"""What machine code is told of accesses that never touch the same byte: it has to be true, or values get lost."""

from __future__ import annotations

import random
import re
from itertools import combinations

import pytest

from fbvm.base.areas import PAGE_BYTES
from fbvm.code.operations import Address
from fbvm.engine.native.emit import alias_scopes
from fbvm.engine.native.emit.alias_scopes import FIRST_NUMBER, AliasScopes, resolved
from fbvm.engine.ranges import with_temporaries

AREA, INSTANCES = PAGE_BYTES + 100, PAGE_BYTES + 400
BYTE = ("load", "u8", ("abs", AREA, ()))
"""A subscript of 0 to 255."""


def claims(scopes: AliasScopes) -> set[tuple[int, int]]:
    """The pairs of marked accesses that are said to be apart, by their numbers."""
    marks, lines = scopes.told(FIRST_NUMBER)
    lists: dict[str, set[str]] = {}
    for line in lines:
        if found := re.fullmatch(r"!(\d+) = !\{(.*)\}", line):
            lists[found[1]] = set(re.findall(r"!(\d+)", found[2]))
    said = [found.groups() if (found := re.search(r"alias\.scope !(\d+), !noalias !(\d+)", mark)) else None for mark in marks]
    return {(a, b) for a, one in enumerate(said) for b, other in enumerate(said)
            if one and other and one[0] in lists and lists[other[0]] - {"5"} and lists[other[0]] - {"5"} <= lists[one[1]]}


def touched(address: Address, count: int, instance: int) -> range:
    """The bytes that an access may touch in an instance that begins there."""
    base, low, terms = address
    most = sum(stride * (term[2] if term[0] == "const" else 255) for stride, term in terms)
    least = sum(stride * term[2] for stride, term in terms if term[0] == "const")
    start = low + (instance if base == "self" else 0)
    return range(start + least, start + most + count)


def meet(one: range, other: range) -> bool:
    return one.start < other.stop and other.start < one.stop


def scopes_of(accesses: list[tuple[Address, int]], instances: tuple[int, int], base: int | None) -> AliasScopes:
    scopes = AliasScopes(instances, base, 0)
    for address, count in accesses:
        scopes.mark(address, count)
    return scopes


def drawn(chosen: random.Random) -> tuple[Address, int]:
    base = chosen.choice(("abs", "self"))
    offset = chosen.randrange(40) + (chosen.choice((AREA, INSTANCES, INSTANCES + 300)) if base == "abs" else 0)
    term = chosen.choice((None, None, (1, BYTE), (chosen.randrange(1, 5), ("const", "i16", chosen.randrange(9)))))
    return (base, offset, (term,) if term else ()), chosen.choice((1, 2, 8))


def test_accesses_that_are_said_to_be_apart_never_touch_the_same_byte() -> None:
    chosen, said = random.Random(1), 0
    for _ in range(20):
        several = chosen.random() < 0.7
        instances = (INSTANCES, INSTANCES + (chosen.randrange(2, 60) if several else 1))
        accesses = [drawn(chosen) for _ in range(6)]
        found = claims(scopes_of(accesses, instances, None if several else INSTANCES))
        said += len(found)
        for a, b in found:
            for first, second in ((0, 0), (0, -1), (-1, 0), (-1, -1)):
                one = range(*instances)[first]
                other = one if accesses[a][0][0] == accesses[b][0][0] else range(*instances)[second]
                assert not meet(touched(*accesses[a], one), touched(*accesses[b], other)), (accesses[a], accesses[b], instances)
    assert said > 60


def test_an_instance_is_apart_from_areas_and_ranges_are_from_one_another() -> None:
    accesses: list[tuple[Address, int]] = [
        (("self", 8, ()), 2), (("abs", AREA, ()), 2), (("abs", AREA + 8, ((1, BYTE),)), 1), (("self", 0, ((1, BYTE),)), 1),
        (("abs", INSTANCES + 900, ((1, BYTE),)), 1)]
    found = claims(scopes_of(accesses, (INSTANCES, INSTANCES + 50), None))
    apart = {(0, 1), (0, 2), (0, 4), (1, 2), (1, 3), (1, 4), (2, 3), (2, 4), (3, 4)}
    assert {pair for pair in combinations(range(5), 2) if pair in found and pair[::-1] in found} == apart


def test_instances_that_reach_into_a_range_are_not_apart_from_it() -> None:
    accesses: list[tuple[Address, int]] = [(("self", 0, ()), 2), (("abs", INSTANCES + 20, ((1, BYTE),)), 1)]
    for behind, is_apart in ((19, True), (20, False), (300, False)):  # the last instance begins at INSTANCES + behind - 1
        found = claims(scopes_of(accesses, (INSTANCES, INSTANCES + behind), None))
        assert ((0, 1) in found) is is_apart, behind


def test_what_may_lie_on_the_system_page_is_not_said_to_be_apart() -> None:
    scopes = AliasScopes((INSTANCES, INSTANCES + 9), None, 0)
    rows: list[tuple[Address, int, bool]] = [
        (("abs", PAGE_BYTES, ()), 1, True), (("abs", PAGE_BYTES - 1, ()), 2, False), (("self", -500, ()), 1, False),
        (("self", PAGE_BYTES - INSTANCES, ()), 1, True), (("self", PAGE_BYTES - INSTANCES - 1, ()), 1, False),
        (("abs", AREA, ((1 << 40, BYTE),)), 1, False)]
    for address, count, expected in rows:
        assert scopes.is_apart(address, count) is expected, address
        scopes.mark(address, count)
    marks, _ = scopes.told(FIRST_NUMBER)
    assert [bool(mark) for mark in marks] == [row[2] for row in rows]


def test_marks_in_a_text_are_numbered_from_body_to_body() -> None:
    first = scopes_of([(("abs", AREA, ()), 1), (("abs", 8, ()), 1)], (INSTANCES, INSTANCES + 1), INSTANCES)
    second = AliasScopes((INSTANCES, INSTANCES + 1), INSTANCES, first.next)
    third, fourth = second.mark(("abs", AREA, ((1, BYTE),)), 1), second.mark(("self", 0, ()), 1)
    text = f"load a ;0\nstore b ;1\nload c{third}\nload d{fourth}"
    made = resolved(text, [first, second]).splitlines()
    assert made[0] == "load a, !alias.scope !3, !noalias !2" and made[1] == "store b"
    assert made[2].startswith("load c, !alias.scope !1") and made[3].startswith("load d, !alias.scope !1")
    assert made[2].removeprefix("load c") != made[3].removeprefix("load d")
    assert all(re.match(r"!\d+ = ", line) for line in made[4:]) and len(made) == 11


def test_a_checked_subscript_that_was_worked_out_before_stays_within_its_bounds() -> None:
    index = ("check", "i64", ("convert", "i64", "u8", BYTE), 0, 9, "R0102", 1)
    element = ("abs", AREA, ((2, ("tmp", "i64", 1)),)), 2
    behind = ("abs", AREA + 20, ()), 2
    for code, wanted in (((("let", 1, "i64", index),), {(0, 1), (1, 0)}), ((), set())):
        scopes = AliasScopes((INSTANCES, INSTANCES + 1), INSTANCES, 0, with_temporaries(code))
        for access in (element, behind):
            scopes.mark(*access)
        assert claims(scopes) == wanted


@pytest.mark.parametrize(("most", "apart"), [(3, 6), (2, 3), (16, 6)])
def test_of_so_many_ranges_each_is_told_apart_and_of_more_they_are_one(monkeypatch: pytest.MonkeyPatch, most: int,
                                                                       apart: int) -> None:
    """Three arrays and a variable: six pairs, or three between the arrays as one and the variable."""
    monkeypatch.setattr(alias_scopes, "MOST", most)
    accesses: list[tuple[Address, int]] = [(("abs", AREA + 1000 * number, ((1, BYTE),)), 1) for number in range(3)]
    found = claims(scopes_of([*accesses, (("abs", AREA + 5000, ()), 1)], (INSTANCES, INSTANCES + 1), INSTANCES))
    pairs = {pair for pair in combinations(range(4), 2) if pair in found and pair[::-1] in found}
    assert len(pairs) == apart and {(0, 3), (1, 3), (2, 3)} <= pairs
