"""The output of a run: a progress bar, then charts and values, or one JSON object."""

from __future__ import annotations

import shutil
import sys
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING

from fbvm.cli.shared import status
from fbvm.cli.shared.terminal import say, say_json
from fbvm.engine.trap import Trap
from fbvm.machine.breakpoints import Halt
from fbvm.machine.plc import Plc
from fbvm.record.draw.chart import draw
from fbvm.record.trace.recorder import Recorder
from fbvm.watch.names import Names
from fbvm.watch.paths import Place, Span
from fbvm.watch.values import Value, in_hexadecimal, plain_value, show, show_time

if TYPE_CHECKING:
    from rich.live import Live

MS_NS = 1_000_000
PIPE_WIDTH = 100
"""Width of charts that do not go to a terminal."""
EXIT_STATUS = {"max": status.FAILED, "differs": status.FAILED, "trap": status.STOPPED, "interrupted": status.INTERRUPTED}


@dataclass(frozen=True)
class RunResult:
    """The result of a run: `reason` is the word with which it ended; the rest are the options about its output."""

    plc: Plc
    reason: str
    places: dict[str, Place | Span]
    recorder: Recorder | None
    as_json: bool
    until: str
    scan_time: bool = False
    """True if the durations of scans are printed."""

    @property
    def status(self) -> int:
        """The exit status of the command."""
        return EXIT_STATUS.get(self.reason, status.GOOD)

    def print(self) -> None:
        """Prints values and charts on stdout, a trap on stderr."""
        if self.as_json:
            say_json(self._as_dict())
            return
        if self.recorder:
            say(draw(self.recorder, width=chart_width(), ruler=True, compress=True), nl=False)
        names = Names.of(self.plc.image, self.plc.memory.areas)
        for text, place in self.places.items():
            say(f"{text} = {value_text(place, names.read(self.plc.read, place))}")
        if not self.places and not self.recorder and sys.stderr.isatty():  # else a run would end wordless
            say(f"{scans_in(self.plc.scans, self.plc.scans, self.plc.elapsed_ns)}, ended by {self.reason}", err=True)
        if self.scan_time:
            say(str(self.plc.scan_times), err=True)
            if self.plc.lateness.count:
                say(str(self.plc.lateness), err=True)
        if self.plc.trap:
            say(self.plc.trap.told(names.instance), fg="red", err=True)
        elif self.reason == "max":
            passed_ns = round(self.plc.elapsed_ns / MS_NS) * MS_NS
            say(f"{self.until} did not hold in {show_time(passed_ns)[2:]}", fg="yellow", err=True)

    def _as_dict(self) -> dict[str, object]:
        plc, names = self.plc, Names.of(self.plc.image, self.plc.memory.areas)
        return {
            "scans": plc.scans,
            "time_ms": plc.elapsed_ns // 1_000_000 if plc.elapsed_ns % 1_000_000 == 0 else plc.elapsed_ns / 1e6,
            "stopped": self.reason,
            "values": {text: json_value(place, names.read(plc.read, place)) for text, place in self.places.items()},
            **({"break": _json_halt(plc.halted)} if plc.halted else {}),
            "trap": json_trap(plc.trap),
            **({"scan_time": plc.scan_times.as_dict(), "lateness": plc.lateness.as_dict()} if self.scan_time else {}),
        }  # fmt: skip


def scans_in(least: int, most: int, lasted_ns: int, each: str = "") -> str:
    """How many scans were executed, by the PLC with the fewest and the one with the most, and how long that was."""
    scans = f"{least:,}" if least == most else f"{least:,} to {most:,}"
    return f"{scans} scan{'s' * (most != 1)}{each} in {show_time(lasted_ns // MS_NS * MS_NS)[2:]}"


def json_trap(trap: Trap | None) -> dict[str, object] | None:
    """A trap as an object of JSON."""
    return None if trap is None else {
        "code": trap.code, "file": trap.site.file, "pou": trap.site.pou, "line": trap.site.line, "column": trap.site.column,
        "message": trap.message,
    }  # fmt: skip


def _json_halt(halt: Halt) -> dict[str, object]:
    """A scan that has stopped at a breakpoint, as an object of JSON."""
    site = halt.site
    return {
        "scan": halt.scan, "file": site and site.file, "pou": halt.frames[0].pou, "line": site and site.line,
        "column": site and site.column, "reasons": list(halt.reasons),
    }  # fmt: skip


def value_text(place: Place | Span, value: Value) -> str:
    """A value as a literal; words of addresses, and variables with the pragma for it, also in hexadecimal."""
    if isinstance(place, Span) and isinstance(value, list):
        return " ".join(show(part.type, item) for part, item in zip(place.places, value, strict=True))
    if not isinstance(place, Place):
        return ""
    text = show(place.type, value)
    if place.hexadecimal and isinstance(value, int):
        return f"{text} ({in_hexadecimal(place.type, value)})"
    return f"{text} ({show(place.type, value, hexadecimal=True)})" if place.area and isinstance(value, int) \
        and not isinstance(value, bool) else text  # fmt: skip


def json_value(place: Place | Span, value: Value) -> Value:
    """A value that JSON can write."""
    return plain_value(place.type, value) if isinstance(place, Place) else value


def chart_width() -> int:
    """The width of charts in columns: that of the terminal, or PIPE_WIDTH."""
    return shutil.get_terminal_size((PIPE_WIDTH, 24)).columns


class RunProgress:
    """A progress bar on the terminal; nothing in a pipe, and nothing without a PLC."""

    def __init__(self, plc: Plc | None, scans: int | None, for_ns: int | None) -> None:
        self._shows = plc is not None and sys.stderr.isatty()
        self._live: Live | None = None
        self._scans, self._for_ns = scans, for_ns

    def __enter__(self) -> RunProgress:
        return self

    def __exit__(self, *_: type[BaseException] | BaseException | TracebackType | None) -> None:
        if self._live:
            self._live.stop()

    def update(self, plc: Plc) -> None:
        """Shows the progress of the run.  The bar appears with the first call, so a short run has none."""
        if not self._shows:
            return
        from rich.console import Console
        from rich.live import Live
        from rich.progress_bar import ProgressBar
        from rich.table import Table

        if self._live is None:
            self._live = Live(console=Console(stderr=True), auto_refresh=False, transient=True)
            self._live.start()
        total, done = (self._scans, plc.scans) if self._scans else (self._for_ns, plc.elapsed_ns)
        row = Table.grid(padding=(0, 1))
        row.add_row(ProgressBar(total=total, completed=done, width=40, pulse=total is None),
                    f"{plc.scans} scans, {plc.elapsed_ns / 1e9:.1f} s")  # fmt: skip
        self._live.update(row, refresh=True)
