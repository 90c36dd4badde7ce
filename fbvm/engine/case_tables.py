"""The labels of a CASE as a table that is searched by halves."""

from __future__ import annotations

from bisect import bisect_right

FEW_VALUES = 8
"""Values up to which a range of a CASE is taken value by value."""


def case_table(rows: list[tuple[tuple[int, int], ...]]) -> tuple[list[int], list[int]]:
    """The labels of a CASE as two lists `(starts, numbers)` for a search by halves.

    `rows` are the ranges (low, high) of each branch, in the order of the branches.  A value belongs to the branch
    `numbers[bisect_right(starts, value)]`; of several branches that fit, the first counts.  A value that fits none has
    `len(rows)`, the number of the ELSE.

    >>> starts, numbers = case_table([((1, 3),), ((7, 7), (9, 12))])
    >>> starts, numbers
    ([1, 4, 7, 8, 9, 13], [2, 0, 2, 1, 2, 1, 2])
    >>> numbers[bisect_right(starts, 10)]
    1
    """
    edges = sorted({edge for labels in rows for low, high in labels for edge in (low, high + 1)})
    numbers = [len(rows)] * (len(edges) + 1)
    for number in range(len(rows) - 1, -1, -1):
        for low, high in rows[number]:
            first, last = bisect_right(edges, low), bisect_right(edges, high)
            numbers[first:last + 1] = [number] * (last + 1 - first)
    return edges, numbers


def single_values(starts: list[int], numbers: list[int], otherwise: int) -> dict[int, int] | None:
    """The branch of each value, if no range is long; None if one is.

    >>> single_values([1, 4, 7, 8], [2, 0, 2, 1, 2], 2)
    {1: 0, 2: 0, 3: 0, 7: 1}
    """
    found: dict[int, int] = {}
    for low, end, number in zip(starts, starts[1:], numbers[1:], strict=False):
        if number != otherwise:
            if end - low > FEW_VALUES:
                return None
            found |= dict.fromkeys(range(low, end), number)
    return found
