"""The time chart: one row a signal, one column a scan, `#` ON and `.` OFF, numbers where a word changes.

    CIO1519.02  ##...       TCP Active Open Request Switch
    D200        0 |12|513   = 0, 12, 513

A `|` stands in the scan at whose end a word has a new value; values without room are listed at the right.
"""

from __future__ import annotations

import itertools
import textwrap
from bisect import bisect_right
from collections.abc import Callable, Iterable, Sequence

from fbvm.machine.plc import Plc
from fbvm.record.trace.recorder import Recorder, Signal, Track, Waveforms, default_signals
from fbvm.watch.values import Value

QUIET_SCANS = 12
"""`compress` shortens longer stretches in which nothing changes."""
GAP = "~"
RULER_STEP = 10
MOST_VALUES = 12
"""Values that the list at the right has at most."""


class Chart(str):
    """The text of a chart.  Equal to any text that differs in the margin and in blanks at line ends only."""

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, str) and _plain(self) == _plain(other)

    def __ne__(self, other: object) -> bool:
        return not self == other

    def __hash__(self) -> int:
        return hash(_plain(self))


def _plain(text: str) -> str:
    lines = [line.rstrip() for line in text.expandtabs().split("\n")]
    while lines and not lines[0]:
        del lines[0]
    while lines and not lines[-1]:
        del lines[-1]
    return textwrap.dedent("\n".join(lines))


def chart(
    plc: Plc,
    scans: int | None = None,
    signals: Iterable[str | tuple[str, str]] | None = None,
    *,
    until: str | Callable[[Plc], bool] | None = None,
    max_scans: int = 1000,
) -> Chart:
    """Runs `plc` for `scans` scans, or until a condition holds, and draws the signals.

    `signals` are paths, addresses, ranges, or pairs of one and its description; without them those signals are drawn that
    units describe or programs declare and that change.  `until` is a condition as text or a function.  Raises UnknownPlace,
    TypeError for an array or a structure, and AssertionError if the condition does not hold within `max_scans` scans."""
    chosen: Iterable[str | tuple[str, str] | Signal] = default_signals(plc) if signals is None else signals
    before = {}
    recorder = Recorder(plc, chosen)
    if signals is None:
        before = {track.signal: plc.read(track.signal.place) for track in recorder.tracks}
    try:
        reason = plc.run(scans=max_scans if scans is None else scans, until=until)
    finally:
        recorder.stop()
    if until is not None and scans is None and reason == "scans":
        raise AssertionError(f"{until} does not hold after {max_scans} scans\n{draw(recorder)}")
    tracks = [track for track in recorder.tracks if signals is not None or _moved(track, before)]
    return draw(recorder, tracks)


def _moved(track: Track, before: dict[Signal, Value]) -> bool:
    return any(value != before[track.signal] for _, value in track.changes)


def draw(
    recorder: Waveforms,
    tracks: Sequence[Track] | None = None,
    *,
    width: int | None = None,
    ruler: bool = False,
    compress: bool = False,
) -> Chart:
    """The chart of waveforms, or of some of its `tracks`.

    `width` in characters wraps the chart, `ruler` adds the numbers of scans, `compress` shortens stretches without changes."""
    tracks = recorder.tracks if tracks is None else tracks
    if not tracks or not recorder.scans:
        return Chart("")
    columns = _columns(recorder.scans, tracks) if compress else list(recorder.scans)
    left = max(len(track.signal.label) for track in tracks) + 2
    right = max(len(track.signal.description) for track in tracks)
    room = len(columns) if width is None else max(20, width - left - (right + 3 if right else 0))
    values = [list(track.values(recorder.scans)) for track in tracks]
    blocks = []
    for start in range(0, len(columns), room):
        piece = columns[start : start + room]
        rows = [(track.signal.label, *_row(track, known, recorder.first, piece))
                for track, known in zip(tracks, values, strict=True)]  # fmt: skip
        wide = max(min(room, len(columns)), *(len(cells) for _, cells, _ in rows))
        lines = [f"{label:<{left}}{cells:<{wide}}   {note}".rstrip() for label, cells, note in rows]
        blocks.append("\n".join([*([" " * left + _ruler(piece)] if ruler else []), *lines]))
    return Chart("\n\n".join(blocks) + "\n")


def _columns(scans: range, tracks: Sequence[Track]) -> list[int | None]:
    """The scans to draw; None stands for scans that are left out because nothing changes."""
    turns = sorted({scan for track in tracks for scan, _ in track.changes} | {scans.stop})
    columns: list[int | None] = []
    for start, end in itertools.pairwise(turns):
        if end - start <= QUIET_SCANS:
            columns += range(start, end)
        else:
            columns += [*range(start, start + QUIET_SCANS // 2), None, *range(end - QUIET_SCANS // 2 + 1, end)]
    return columns


def _row(track: Track, values: Sequence[Value], first: int, piece: Sequence[int | None]) -> tuple[str, str]:
    """The cells of a signal in these scans, and the note at their right; `values` begin with scan `first`."""
    signal = track.signal
    note = signal.description
    if signal.is_bit:
        cells = "".join(GAP if scan is None else "#" if values[scan - first] else "." for scan in piece)
    else:
        texts = [None if scan is None else signal.display(values[scan - first]) for scan in piece]
        cells, complete = _numbers(texts)
        if not complete:
            note = f"{_sequence(track, piece)}   {note}".rstrip()
    return cells, note


def _numbers(texts: Sequence[str | None]) -> tuple[str, bool]:
    """A row of numbers, each from the column of its first scan on; True if there was room for all.

    There is always room for the last one."""
    cells, complete, at = [" "] * len(texts), True, 0
    while at < len(texts):
        end = at + 1
        while end < len(texts) and texts[end] in (texts[at], None):
            end += 1
        text = ("|" if at else "") + (texts[at] or "")
        if len(text) > end - at and end < len(texts):
            text, complete = "|", False
        cells[at : at + len(text)] = text
        for place in range(at, end):
            if texts[place] is None and cells[place] == " ":
                cells[place] = GAP
        at = end
    return "".join(cells), complete


def _sequence(track: Track, piece: Sequence[int | None]) -> str:
    """The values that a word had in these scans, in order: `= 0, 12, 513`."""
    drawn = [scan for scan in piece if scan is not None]
    began, ended = (bisect_right(track.changes, scan, key=lambda change: change[0]) for scan in (drawn[0], drawn[-1]))
    changes = track.changes[max(0, began - 1) : ended]
    more = f", ... ({len(changes)} values)" if len(changes) > MOST_VALUES else ""
    return "= " + ", ".join(track.signal.display(value) for _, value in changes[:MOST_VALUES]) + more


def _ruler(piece: Sequence[int | None]) -> str:
    """Scan numbers above their columns: the first, every tenth, and the one after a gap."""
    cells = [" "] * (len(piece) + 8)
    free = 0
    for at, scan in enumerate(piece):
        wanted = scan is not None and (at == 0 or scan % RULER_STEP == 0 or piece[at - 1] is None)
        if wanted and at >= free:
            text = str(scan)
            cells[at : at + len(text)] = text
            free = at + len(text) + 1
    return "".join(cells).rstrip()
