"""A time chart as SVG: bits as bars, numbers as steps with their values, packets as arrows; scans and time as rulers.

Plain SVG without scripts, for documents; its colours follow the reader's choice of light or dark.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from html import escape

from fbvm.base.types import EnumType, base
from fbvm.record.trace.packets import Packet
from fbvm.record.trace.recorder import Track, Waveforms
from fbvm.watch.values import Value, show_time

ROW, LETTER, MARGIN = 26, 7.3, 8
RULERS, LANE = 38, 20
"""Heights of the two rulers and of the row with packets."""
WIDEST, NARROWEST, WANTED = 40.0, 0.5, 1000
"""Pixels of a scan at most and at least, and of the whole chart if possible."""
TICK = 70
"""Pixels between two numbers of a ruler at least."""
STYLE = """
:root { color-scheme: light dark }
text { font: 12px ui-monospace, monospace; fill: #1c1f24; paint-order: stroke; stroke: #fcfcfa; stroke-width: 3px }
.dim { fill: #6a717c }
.ground { fill: #fcfcfa } .grid { stroke: #e4e7eb } .on { fill: #1b7f4d } .off { stroke: #c3c8d0; stroke-width: 2 }
.word { stroke: #2f5fb3; fill: none; stroke-width: 1.5 } .out { fill: #7a3fb0 } .in { fill: #0b7285 }
@media (prefers-color-scheme: dark) {
text { fill: #e6e8ec; stroke: #14161a } .dim { fill: #9aa2ae } .ground { fill: #14161a }
.grid { stroke: #2a3038 } .on { fill: #4cc38a }
.off { stroke: #454d59 } .word { stroke: #7aa7f0 } .out { fill: #c39af0 } .in { fill: #5cc8dc } }
"""


class SvgChart:
    """The time chart of a waveforms, and of packets with the numbers of their scans."""

    def __init__(self, waveforms: Waveforms, packets: Sequence[tuple[int, Packet]] = (), title: str = "") -> None:
        self._waveforms, self._title = waveforms, title
        self._scans = waveforms.scans
        self._packets = [row for row in packets if row[0] in self._scans]
        self._unit = str(self._packets[0][1].source.host) if self._packets else ""
        self._step = min(WIDEST, max(NARROWEST, WANTED / max(1, len(self._scans))))
        names = [track.signal.label for track in waveforms.tracks]
        self._left = MARGIN * 2 + LETTER * max([len(name) for name in names] + [8])
        self._top = MARGIN + RULERS + (LANE if self._packets else 0)

    def text(self) -> str:
        """The text of the SVG file."""
        tracks = self._waveforms.tracks
        width = round(self._left + self._step * len(self._scans) + MARGIN)
        height = self._top + ROW * len(tracks) + MARGIN
        rows = [row for at, track in enumerate(tracks) for row in self._row(track, self._top + at * ROW)]
        size = f'width="{width}" height="{height}"'
        return "\n".join([
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" {size} role="img">',
            f"<title>{escape(self._title or 'time chart')}</title><style>{STYLE}</style>",
            f'<rect class="ground" {size}/>', *self._rulers(height), *self._arrows(), *rows, "</svg>\n",
        ])  # fmt: skip

    def _x(self, scan: float) -> float:
        return round(self._left + (scan - self._scans.start) * self._step, 2)

    def _rulers(self, height: int) -> Iterator[str]:
        for y, said in ((MARGIN + 10, "scan"), (MARGIN + 28, "time")):
            yield f'<text class="dim" x="{MARGIN}" y="{y}">{said}</text>'
        step = next(step for digits in range(9) for step in (10**digits, 2 * 10**digits, 5 * 10**digits)
                    if step * self._step >= TICK)  # fmt: skip
        first = -(-self._scans.start // step) * step
        for scan in range(first, self._scans.stop, step):
            x, when = self._x(scan), show_time(self._waveforms.times_ns[scan - self._scans.start]).removeprefix("T#")
            yield f'<line class="grid" x1="{x}" y1="{MARGIN}" x2="{x}" y2="{height - MARGIN}"/>'
            yield f'<text class="dim" x="{x + 3}" y="{MARGIN + 10}">{scan}</text>'
            yield f'<text class="dim" x="{x + 3}" y="{MARGIN + 28}">{escape(when)}</text>'

    def _arrows(self) -> Iterator[str]:
        """An arrow for each packet: up if the unit has sent it, down if the unit has received it."""
        if not self._packets:
            return
        top = MARGIN + RULERS
        yield f'<text class="dim" x="{MARGIN}" y="{top + 13}">network</text>'
        drawn: dict[int, int] = {}
        for scan, packet in self._packets:
            number = drawn[scan] = drawn.get(scan, -1) + 1
            x, out = self._x(scan + 0.5) + 8 * number, packet.source.host == self._unit
            shape = "l-4,7 h3 v9 h2 v-9 h3 z" if out else "l-4,-7 h3 v-9 h2 v9 h3 z"
            yield (f'<path class="{"out" if out else "in"}" d="M{x},{top + (0 if out else 16)} {shape}">'
                   f"<title>scan {scan}: {escape(str(packet))}</title></path>")  # fmt: skip

    def _row(self, track: Track, y: int) -> Iterator[str]:
        label = escape(track.signal.label)
        tip = f"<title>{escape(track.signal.description)}</title>" if track.signal.description else ""
        yield f'<text x="{MARGIN}" y="{y + 17}">{label}{tip}</text>'
        ends = [scan for scan, _ in track.changes[1:]] + [self._scans.stop]
        counts = not track.signal.meanings and not isinstance(base(track.signal.place.type), EnumType)
        levels = _levels([value if counts else 0 for _, value in track.changes])
        for (scan, value), end, level in zip(track.changes, ends, levels, strict=True):
            left, right = self._x(scan), self._x(end)
            if track.signal.is_bit:
                yield (f'<rect class="on" x="{left}" y="{y + 5}" width="{round(right - left, 2)}" height="{ROW - 11}"/>' if value
                       else f'<line class="off" x1="{left}" y1="{y + ROW - 7}" x2="{right}" y2="{y + ROW - 7}"/>')  # fmt: skip
                continue
            height = y + ROW - 6 - level * (ROW - 12)
            yield f'<path class="word" d="M{left},{y + 4} V{y + ROW - 4} M{left},{height:.1f} H{right}"/>'
            if text := _fitting(track.signal.display(value), right - left - 6):
                yield f'<text x="{left + 4}" y="{y + 16}">{escape(text)}</text>'


def _levels(values: Sequence[Value]) -> list[float]:
    """The height of each value, 0 to 1; 0 for a value that is no number."""
    numbers = [float(value) if isinstance(value, int | float) else 0.0 for value in values]
    low, high = min(numbers), max(numbers)
    return [(number - low) / (high - low) if high > low else 0.0 for number in numbers]


def _fitting(text: str, room: float) -> str:
    """The beginning of a text that fits into `room` pixels; "" if there is room for too few letters."""
    letters = int(room / LETTER)
    if letters >= len(text):
        return text
    return f"{text[: letters - 1]}…" if letters >= 4 else ""
