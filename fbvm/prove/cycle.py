"""Times between scans, as people write them: `10ms`, or `5ms..50ms` for any time within bounds."""

from __future__ import annotations

from itertools import groupby

from fbvm.watch.values import parse_time_ns, show_time


def cycle_bounds(text: str) -> tuple[int, int]:
    """The shortest and the longest time between two scans, in nanoseconds.  Raises ValueError for anything else."""
    shortest, _, longest = text.partition("..")
    bounds = parse_time_ns(shortest), parse_time_ns(longest or shortest)
    if bounds[0] <= 0:
        raise ValueError(f"{text}: between two scans some time passes")
    if bounds[1] < bounds[0]:
        raise ValueError(f"{text}: the shorter time comes first")
    return bounds


def show_cycle(cycle_ns: int, longest_ns: int) -> str:
    """Bounds as `cycle_bounds` reads them."""
    shortest = show_time(cycle_ns)[2:]
    return f"{shortest}..{show_time(longest_ns)[2:]}" if longest_ns > cycle_ns else shortest


def show_passed(passed_ns: list[int]) -> str:
    """The times between the scans of a run: `50ms (6 times), 12ms`."""
    rows = ((show_time(each)[2:], len([*some])) for each, some in groupby(passed_ns))
    return ", ".join(f"{each} ({count} times)" if count > 1 else each for each, count in rows)
