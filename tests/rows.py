"""Tables of cases: short ones that one test goes through, long ones of which the inner loop tries a few."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from functools import partial, wraps
from typing import Any

import pytest

ROW = type(pytest.param())


def each_of(names: str | tuple[str, ...], table: Iterable[Any],
            ids: Iterable[str] | Callable[[Any], str] | None = None) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """`pytest.mark.parametrize` for cases of a few milliseconds, of which a test of their own would be the larger part.

    All rows are tried; what fails names its row.  Fixtures are made once for all of them."""
    arguments = [name.strip() for name in names.split(",")] if isinstance(names, str) else list(names)
    table = list(table)
    spoken = list(map(ids, table)) if callable(ids) else list(ids or [None] * len(table))
    cases = [_named(arguments, row, name) for row, name in zip(table, spoken, strict=True)]
    assert len(cases) > 0, "a table without rows tests nothing"

    def decorate(test: Callable[..., None]) -> Callable[..., None]:
        @wraps(test)
        def through(*args: Any, **fixtures: Any) -> None:
            go_through((name, partial(test, *args, **fixtures, **values)) for name, values in cases)

        signature = inspect.signature(test)
        through.__signature__ = signature.replace(  # type: ignore[attr-defined]
            parameters=[p for name, p in signature.parameters.items() if name not in arguments])
        return through

    return decorate


def first_quick(table: Iterable[Any], quick: int = 1) -> list[Any]:
    """Rows for `pytest.mark.parametrize`: the first ones for every run, the others for the long one."""
    return [row if number < quick else _slow(row) for number, row in enumerate(table)]


def _slow(row: Any) -> Any:
    if isinstance(row, ROW):
        return pytest.param(*row.values, id=row.id, marks=[*row.marks, pytest.mark.slow])
    return pytest.param(*(row if isinstance(row, tuple) else [row]), marks=pytest.mark.slow)


def go_through(cases: Iterable[tuple[str, Callable[[], None]]]) -> None:
    """Try all of some named cases; what fails names its row."""
    failed: list[Exception] = []
    tried = 0
    for tried, (name, case) in enumerate(cases, 1):  # noqa: B007
        try:
            case()
        except Exception as error:
            error.add_note(f"row: {name}")
            failed.append(error)
        except pytest.fail.Exception as failure:
            failed.append(AssertionError(str(failure)))
            failed[-1].add_note(f"row: {name}")
    assert tried > 0, "no case was tried"
    if len(failed) == 1:
        raise failed[0]
    if failed:
        raise ExceptionGroup(f"{len(failed)} of {tried} rows", failed)


def _named(arguments: list[str], row: Any, name: str | None) -> tuple[str, dict[str, Any]]:
    """A row's name and its values by argument."""
    if isinstance(row, ROW):
        assert not row.marks, "a row with marks is a test of its own"
        name, row = row.id or name, row.values if len(arguments) > 1 else row.values[0]
    values = dict(zip(arguments, row if len(arguments) > 1 else [row], strict=True))
    return str(name) if name else ", ".join(f"{argument}={value!r}" for argument, value in values.items()), values
