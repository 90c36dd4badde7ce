"""Writes what was done by hand as a pytest that does the same again."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from fbvm.live.plcs import LivePlc
from fbvm.live.workbench import Act
from fbvm.machine.plc import Plc

_CALLS = {"write": "plc.write({name!r}, {value})", "keep": "plc.write({name!r}, {value})",
          "force": "plc.force({name!r}, {value})", "mode": "plc.mode = Mode({value!r})",
          "start": "plc.{value}_start()"}  # fmt: skip
"""The statement of an act by its kind, after which it takes place before the next scan."""


def pytest_text(acts: Sequence[Act], live: LivePlc, seen: Sequence[str], files: Sequence[Path],
                program: str | None = None) -> str:  # fmt: skip
    """The text of a test module: compiles `files`, repeats the acts before their scans, and asserts the values of the names
    `seen` as they are now.  What faults and cables did is not repeated: a line says so."""
    plc = live.plc
    sources = ", ".join(repr(str(file)) for file in files)
    chosen = f", program={program!r}" if program else ""
    lines = ['"""Written from the page of a running PLC: does again what was done by hand."""', "",
             *_imports(plc, acts), "", "",
             "def test_what_was_done_by_hand():",
             f"    image = compile_files([{sources}]{chosen}, runnable=True).image",
             f"    plc = Plc(image, cycle_ns={plc.cycle_ns:_})"]  # fmt: skip
    if plc.units:
        lines += ["    network = LoopNetwork()",
                  f"    for unit in usual_units({[box.name for box in plc.image.layout.mailboxes]!r}):",
                  "        plc.attach(unit, network)"]  # fmt: skip
    at = 0
    for act in acts:
        if act.scan > at:
            lines.append(f"    plc.run(scans={act.scan - at})")
            at = act.scan
        lines.append(f"    {_statement(act)}")
    if plc.scans > at:
        lines.append(f"    plc.run(scans={plc.scans - at})")
    lines += [f"    assert plc.read({name!r}) == {_literal(plc.read(name))}" for name in seen]
    if not seen:
        lines.append(f"    assert plc.scans == {plc.scans} and plc.trap is None")
    return "\n".join(lines) + "\n"


def _imports(plc: Plc, acts: Sequence[Act]) -> list[str]:
    names = ["LoopNetwork"] * bool(plc.units) + ["Mode"] * any(act.what == "mode" for act in acts) + ["Plc", "compile_files"]
    units = ["from fbvm.machine.backplane import usual_units"] * bool(plc.units)
    return [f"from fbvm import {', '.join(names)}", *units]


def _literal(value: object) -> str:
    """A value as Python writes it; numbers that are no literals by their names."""
    return f"float({str(value)!r})" if isinstance(value, float) and not math.isfinite(value) else repr(value)


def _statement(act: Act) -> str:
    if act.what == "release":
        return f"plc.unforce({act.name!r})" if act.name else "plc.unforce()"
    if act.what in _CALLS:
        value = _literal(act.value) if act.what in ("write", "keep", "force") else act.value
        return _CALLS[act.what].format(name=act.name, value=value)
    return f"# not repeated: {act.text.splitlines()[0] if act.text else act.what}"
