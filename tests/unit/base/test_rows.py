"""One test that goes through a table: all rows are tried, and a failure says which."""

from __future__ import annotations

import pytest
from rows import each_of


def test_all_rows_are_tried_and_fixtures_are_left_to_pytest() -> None:
    seen = []

    @each_of("number", [1, pytest.param(2, id="two")])
    @each_of(("text", "more"), [("a", None), ("b", None)], ids=["first", "second"])
    def case(fixture: str, number: int, text: str, more: object) -> None:
        seen.append((fixture, number, text, more))

    case(fixture="f")
    assert seen == [("f", 1, "a", None), ("f", 1, "b", None), ("f", 2, "a", None), ("f", 2, "b", None)]


@pytest.mark.parametrize("fail", [lambda: pytest.fail("odd"), lambda: exec("assert False")])
def test_a_failure_names_its_row(fail: object) -> None:
    assert callable(fail)

    @each_of("number", [1, 2, 4])
    def case(number: int) -> None:
        if number % 2:
            fail()

    with pytest.raises(AssertionError) as failed:
        case()
    assert failed.value.__notes__ == ["row: number=1"]


def test_several_failures_are_told_together() -> None:
    @each_of("number", [1, 2, 3], ids=str)
    def case(number: int) -> None:
        assert number == 2

    with pytest.raises(ExceptionGroup, match="2 of 3 rows") as failed:
        case()
    assert [error.__notes__ for error in failed.value.exceptions] == [["row: 1"], ["row: 3"]]


def test_a_row_with_marks_is_refused() -> None:
    with pytest.raises(AssertionError, match="a test of its own"):
        each_of("number", [pytest.param(1, marks=pytest.mark.slow)])
