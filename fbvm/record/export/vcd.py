"""Waveforms as a value change dump (IEEE 1364), for GTKWave, Surfer and others; needs the package pyvcd.

Programs and instances are scopes, areas are scopes of their addresses, and the number of the scan is a signal.  A
value changes at the time of the scan at whose end it is new.  Times of the program are integers of nanoseconds.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, TextIO

from fbvm.base.types import Elementary, EnumType, RefType, StringType, Type, base, families
from fbvm.record.trace.recorder import Signal, Track, Waveforms
from fbvm.watch.values import Value

AREAS_SCOPE = "memory"
COMMENT = "fbvm"


def write_vcd(waveforms: Waveforms, file: TextIO) -> None:
    """Writes waveforms as VCD to a text file.  Raises ModuleNotFoundError without the package pyvcd."""
    import vcd  # type: ignore[import-not-found,unused-ignore]

    with vcd.VCDWriter(file, timescale="1 ns", date="", comment=COMMENT) as writer:
        number = writer.register_var(COMMENT, "scan", "integer", 64, init=waveforms.first)
        variables = [_register(writer, track) for track in waveforms.tracks]
        for scan, (now_ns, changed) in _scans(waveforms):
            writer.change(number, now_ns, scan)
            for at, value in changed:
                writer.change(variables[at], now_ns, _plain(waveforms.tracks[at].signal, value))
        if waveforms.times_ns:
            writer.close(waveforms.times_ns[-1])


def _scans(waveforms: Waveforms) -> Iterator[tuple[int, tuple[int, list[tuple[int, Value]]]]]:
    """Scan, time, and the tracks that change in it with their new values."""
    changes: dict[int, list[tuple[int, Value]]] = {}
    for at, track in enumerate(waveforms.tracks):
        for scan, value in track.changes:
            changes.setdefault(scan, []).append((at, value))
    for scan, now_ns in zip(waveforms.scans, waveforms.times_ns, strict=True):
        yield scan, (now_ns, changes.get(scan, []))


def _register(writer: Any, track: Track) -> Any:
    signal = track.signal
    scope, name = _scope(signal)
    kind, size = _kind(signal)
    init = _plain(signal, track.changes[0][1]) if track.changes else None
    if init is None:
        init = {"string": "", "real": 0.0}.get(kind, 0)
    return writer.register_var(scope, name, kind, size, init=init)


def _scope(signal: Signal) -> tuple[str, str]:
    """The scope and the name of a signal; subscripts are written with parentheses, as brackets mean bits in a dump."""
    place = signal.place
    name = re.sub(r"\s", "", place.name.replace("[", "(").replace("]", ")"))
    if place.area:
        return f"{AREAS_SCOPE}.{place.area}", name.replace(".", "_")
    scope, _, name = name.rpartition(".")
    return scope or "globals", name


def _kind(signal: Signal) -> tuple[str, int | None]:
    """Type and width in a dump."""
    kind = base(signal.place.type)
    if signal.is_bit:
        return "wire", 1
    if _is_text(kind):
        return "string", None
    if isinstance(kind, Elementary) and kind.machine in ("f32", "f64"):
        return "real", 64
    signed = isinstance(kind, Elementary) and kind.machine.startswith("i")
    return ("integer" if signed else "wire"), kind.size * 8


def _is_text(kind: Type) -> bool:
    return isinstance(kind, EnumType | RefType | StringType) or "ANY_CHAR" in families(kind)


def _plain(signal: Signal, value: Value) -> Any:
    """A value as pyvcd takes it; text has no blanks in a dump."""
    if _is_text(base(signal.place.type)):
        return re.sub(r"\s", "_", signal.text(value).strip("'\""))
    return int(value) if isinstance(value, bool) else value
