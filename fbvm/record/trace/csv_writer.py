"""Waveforms as CSV: one row a scan, one column a variable.

    scan,time_ms,Main.Start,Main.Delay.ET [ms],D200
    0,0,FALSE,0,7

BOOL is TRUE or FALSE, times are numbers of milliseconds in a column with the suffix [ms], dates are literals, enumerations are
their members' names.
"""

from __future__ import annotations

import csv
from decimal import Decimal
from typing import TextIO

from fbvm.base.arithmetic import shortest
from fbvm.base.types import REAL, EnumType, base, families
from fbvm.record.trace.recorder import Signal
from fbvm.record.trace.samples import Samples
from fbvm.watch.values import Value, show

SCAN, TIME_MS = "scan", "time_ms"
MS = " [ms]"
DURATIONS = frozenset(("TIME", "LTIME"))


def write_csv(samples: Samples, file: TextIO) -> None:
    """Writes the values of signals as CSV to a text file that was opened with `newline=""`, scan by scan: `waveforms`, or what
    `samples` goes through."""
    writer = csv.writer(file, lineterminator="\n")
    signals = samples.signals
    writer.writerow([SCAN, TIME_MS, *(_heading(signal) for signal in signals)])
    cells = [""] * len(signals)
    for scan, now_ns, changed in samples.steps():
        for at, value in changed:
            cells[at] = _cell(signals[at], value)
        writer.writerow([scan, _milliseconds(now_ns), *cells])


def _is_duration(signal: Signal) -> bool:
    return base(signal.place.type).name in DURATIONS


def _heading(signal: Signal) -> str:
    return signal.place.name + (MS if _is_duration(signal) else "")


def _cell(signal: Signal, value: Value) -> str:
    if isinstance(value, bool):
        return "TRUE" if value else "FALSE"
    if _is_duration(signal) and isinstance(value, int):
        return _milliseconds(value)
    kind = base(signal.place.type)
    if isinstance(kind, EnumType):
        return signal.text(value)
    if value is not None and "ANY_DATE" in families(kind):
        return show(kind, value)
    if isinstance(value, float):
        return repr(shortest(value) if kind is REAL else value)
    return "" if value is None else str(value)


def _milliseconds(time_ns: int) -> str:
    text = f"{Decimal(time_ns).scaleb(-6):f}"
    return text.rstrip("0").rstrip(".") if "." in text else text
