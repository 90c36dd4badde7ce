"""Waveforms as a value change dump (IEEE 1364), for GTKWave, Surfer and others; needs the package pyvcd.

Programs and instances are scopes, areas are scopes of their addresses, and the number of the scan is a signal.  A
value changes at the time of the scan at whose end it is new.  Times of the program are integers of nanoseconds.
"""

from __future__ import annotations

import re
from itertools import chain
from typing import Any, TextIO

from fbvm.base.types import Elementary, EnumType, RefType, StringType, Type, base, families
from fbvm.record.trace.recorder import Signal
from fbvm.record.trace.samples import Samples
from fbvm.watch.values import Value

AREAS_SCOPE = "memory"
COMMENT = "fbvm"


def write_vcd(samples: Samples, file: TextIO) -> None:
    """Writes the values of signals as VCD to a text file, scan by scan: `waveforms`, or what `samples` goes through.

    Raises ModuleNotFoundError without the package pyvcd."""
    import vcd  # type: ignore[import-not-found,unused-ignore]

    signals, steps = samples.signals, samples.steps()
    first = next(steps, None)
    with vcd.VCDWriter(file, timescale="1 ns", date="", comment=COMMENT) as writer:
        number = writer.register_var(COMMENT, "scan", "integer", 64, init=first[0] if first else 0)
        begun = dict(first[2]) if first else {}
        variables = [_register(writer, signal, begun.get(at)) for at, signal in enumerate(signals)]
        end_ns = 0
        for scan, end_ns, changed in chain([first] if first else [], steps):
            writer.change(number, end_ns, scan)
            for at, value in changed:
                writer.change(variables[at], end_ns, _plain(signals[at], value))
        if first:
            writer.close(end_ns)


def _register(writer: Any, signal: Signal, value: Value) -> Any:
    scope, name = _scope(signal)
    kind, size = _kind(signal)
    init = _plain(signal, value) if value is not None else None
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
