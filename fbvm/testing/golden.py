"""Golden traces: the changes of variables in a run that was checked by its author, as text for version control.

    Running
      scan 0     0s     FALSE
      scan 5     50ms   TRUE
"""

from __future__ import annotations

from itertools import zip_longest
from pathlib import Path

from fbvm.base.files import write_file
from fbvm.record.trace.recorder import Waveforms
from fbvm.watch.values import show_time

OPTION = "--fbvm-golden"
MOST_DIFFERENCES = 5
"""Lines that a difference shows of one variable."""


def golden_text(waveforms: Waveforms) -> str:
    """The text of waveforms: of each variable the scans at whose end it had a new value."""
    lines = [f"scans {waveforms.first} to {waveforms.scans.stop - 1}"]
    for track in waveforms.tracks:
        lines += ["", track.signal.label]
        for scan, value in track.changes:
            when = show_time(waveforms.times_ns[scan - waveforms.first]).removeprefix("T#")
            lines.append(f"  scan {scan:<6} {when:<9} {track.signal.text(value)}")
    return "\n".join(lines) + "\n"


def check(path: Path, waveforms: Waveforms, write: bool) -> None:
    """Raises AssertionError with the difference if a run is not as the file says; with `write`, writes the file."""
    __tracebackhide__ = True
    found = golden_text(waveforms)
    if write:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, found)
        return
    if not path.is_file():
        raise AssertionError(f"{path} is not there; look at this run, then write it with {OPTION}:\n\n{found}")
    said = differences(path.read_text(encoding="utf-8"), found)
    if said:
        raise AssertionError(f"{path.name} was another run; if this one is right, write it with {OPTION}:\n\n{said}")


def differences(expected: str, found: str) -> str:
    """What differs, variable by variable, "" if nothing does."""
    old, new = _parts(expected), _parts(found)
    lines = []
    for name in dict.fromkeys((*old, *new)):
        if name not in new or name not in old:
            lines.append(f"{name}: {'not recorded now' if name not in new else 'was not recorded'}")
            continue
        pairs = [pair for pair in zip_longest(old[name], new[name]) if pair[0] != pair[1]]
        if pairs:
            lines.append(name)
            for was, now in pairs[:MOST_DIFFERENCES]:
                lines += [f"  {sign} {text.strip()}" for sign, text in (("-", was), ("+", now)) if text is not None]
            if len(pairs) > MOST_DIFFERENCES:
                lines.append(f"    and {len(pairs) - MOST_DIFFERENCES} more")
    return "\n".join(lines)


def _parts(text: str) -> dict[str, list[str]]:
    """The lines under each heading."""
    parts: dict[str, list[str]] = {}
    name = ""
    for line in text.splitlines():
        if line.startswith("scans "):
            parts["length"] = [line]
        elif line.startswith(" "):
            parts.setdefault(name, []).append(line)
        elif line:
            name = line
            parts[name] = []
    return parts
