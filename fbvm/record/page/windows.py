"""Which scans a page shows statement by statement, if it cannot do so for all of them."""

from __future__ import annotations

from collections.abc import Sequence

AROUND = 2
"""Scans that are shown before and behind one in which a watched variable changed."""
MOST_CHANGES = 20
"""Changes of watched variables that get a window; each costs a look from the keyframe before."""


def chosen_windows(scans: range, room: int, wanted: Sequence[range] = (), changes: Sequence[int] = ()) -> list[range]:
    """The windows of a run of `scans`, in their order and apart from one another, with about `room` scans together.

    First come the scans that are `wanted`; then the last ones, at which a run stops at a trap and a test at a failed assertion;
    those around `changes` of a watched variable, the latest first; and the first ones."""
    if len(scans) <= room:
        return [scans] if scans else []
    chosen: set[int] = set()

    def take(piece: range, most: int) -> None:
        """Chooses scans from the end of a piece, up to `most` together."""
        for scan in reversed(range(max(piece.start, scans.start), min(piece.stop, scans.stop))):
            if len(chosen) >= most:
                return
            chosen.add(scan)

    for window in wanted:
        take(range(window.start, min(window.stop, window.start + room)), room)
    rest = room - len(chosen)
    take(range(scans.stop - max(1, rest // 2), scans.stop), room)
    for scan in list(reversed(changes))[:MOST_CHANGES]:
        take(range(scan - AROUND, scan + AROUND + 1), room - rest // 8)
    take(range(scans.start, scans.start + room - len(chosen)), room)
    return _merged(chosen)


def _merged(scans: set[int]) -> list[range]:
    """Runs of consecutive numbers."""
    runs: list[range] = []
    for scan in sorted(scans):
        if runs and runs[-1].stop == scan:
            runs[-1] = range(runs[-1].start, scan + 1)
        else:
            runs.append(range(scan, scan + 1))
    return runs
