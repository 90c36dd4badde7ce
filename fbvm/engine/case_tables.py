"""The labels of a CASE as a table that is searched by halves."""

from __future__ import annotations

from bisect import bisect_right


def case_table(rows: list[tuple[tuple[int, int], ...]]) -> tuple[list[int], list[int]]:
    """Labels as (starts, numbers): a value belongs to row `numbers[bisect_right(starts, value)]`, the first that fits.

    A value of no row has the number of rows."""
    edges = sorted({edge for labels in rows for low, high in labels for edge in (low, high + 1)})
    numbers = [len(rows)] * (len(edges) + 1)
    for number in range(len(rows) - 1, -1, -1):
        for low, high in rows[number]:
            first, last = bisect_right(edges, low), bisect_right(edges, high)
            numbers[first:last + 1] = [number] * (last + 1 - first)
    return edges, numbers
