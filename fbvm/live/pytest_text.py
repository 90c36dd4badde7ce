"""Writes what was done by hand as a pytest that does the same again."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from pathlib import Path

from fbvm.live.plcs import LivePlc
from fbvm.live.workbench import Act
from fbvm.machine.plc import Plc
from fbvm.net.faults import ANY, Fault

_CALLS = {"write": "plc.write({name!r}, {value})", "keep": "plc.write({name!r}, {value})",
          "force": "plc.force({name!r}, {value})", "mode": "plc.mode = Mode({value!r})",
          "start": "plc.{value}_start()"}  # fmt: skip
"""The statement of an act by its kind, after which it takes place before the next scan."""


DOCSTRING = '"""Written from the page of a running PLC: does again what was done by hand."""'
Seen = Sequence[tuple[LivePlc, str]]
"""Names that the page sees, each with its PLC."""


def pytest_text(acts: Sequence[Act], live: LivePlc, seen: Seen, files: Sequence[Path], program: str | None = None) -> str:
    """The text of a test module: compiles `files`, repeats the acts before their scans, and asserts the values of the names
    `seen` as they are now.  Of what is done inside a scan, at a breakpoint, a line says that it is not repeated."""
    plc = live.plc
    acts = [act for act in acts if act.plc == live.name]
    sources = ", ".join(repr(str(file)) for file in files)
    chosen = f", program={program!r}" if program else ""
    lines = [*_head(["Plc", "compile_files", *["LoopNetwork"] * bool(plc.units)], acts, bool(plc.units)),
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
        lines += [f"    {line}" for line in _statements(act, plc)]
    if plc.scans > at:
        lines.append(f"    plc.run(scans={plc.scans - at})")
    lines += [f"    assert plc.read({name!r}) == {_literal(plc.read(name))}" for owner, name in seen if owner is live]
    if not any(owner is live for owner, _ in seen):
        lines.append(f"    assert plc.scans == {plc.scans} and plc.trap is None")
    return "\n".join(lines) + "\n"


def plant_text(acts: Sequence[Act], live: LivePlc, seen: Seen, file: Path, plcs: Mapping[str, LivePlc]) -> str:
    """As `pytest_text`, of all PLCs of the project `file`, by the fixture `plant`; a fault of the network is noted by each PLC,
    and repeated as that of `live`."""
    acts = [act for act in acts if act.plc == live.name or act.what not in ("fault", "mend")]
    lines = [*_head([], acts, False), "def test_what_was_done_by_hand(plant):", f"    made = plant({str(file)!r})",
             *["    network = made.network"] * any(act.what in ("fault", "mend", "cable") for act in acts)]  # fmt: skip
    last = [Act(name, found.plc.scans, 0, "", "") for name, found in plcs.items()]
    before = ""
    for act in [*acts, *last]:
        if act.plc != before:
            lines.append(f"    plc = made[{act.plc!r}].plc")
            before = act.plc
        if act.scan:
            lines += [f"    while plc.scans < {act.scan}:", "        made.scan()"]
        lines += [f"    {line}" for line in _statements(act, plcs[act.plc].plc)] if act.what else []
    lines += [f"    assert made[{owner.name!r}].plc.read({name!r}) == {_literal(owner.plc.read(name))}" for owner, name in seen]
    if not seen:
        lines.append("    assert all(rig.plc.trap is None for rig in made.rigs.values())")
    return "\n".join(lines) + "\n"


def _head(names: Sequence[str], acts: Sequence[Act], has_units: bool) -> list[str]:
    """The lines before the test: what it is, and its imports."""
    done = {act.what for act in acts}
    used = {*names, *["Mode"] * ("mode" in done)}
    if "cable" in done or any(isinstance(act.value, Fault) and act.value.peer != ANY for act in acts):
        used.add("Peer")
    lines = [f"from fbvm import {', '.join(sorted(used))}"] if used else []
    if has_units:
        lines.append("from fbvm.machine.backplane import usual_units")
    if done & {"fault", "cable"}:
        lines.append("from fbvm.net.faults import Fault")
    return [DOCSTRING, *(["", *lines] if lines else []), "", ""]


def _literal(value: object) -> str:
    """A value as Python writes it; numbers that are no literals by their names."""
    return f"float({str(value)!r})" if isinstance(value, float) and not math.isfinite(value) else repr(value)


def _statements(act: Act, plc: Plc) -> list[str]:
    """The lines of an act, after which it takes place before the next scan."""
    if act.what == "release":
        return [f"plc.unforce({act.name!r})" if act.name else "plc.unforce()"]
    if act.what in _CALLS:
        value = _literal(act.value) if act.what in ("write", "keep", "force") else act.value
        return [_CALLS[act.what].format(name=act.name, value=value)]
    if isinstance(act.value, Fault):
        return [f"network.faults.append({_fault(act.value)})"]
    if act.what == "mend":
        return ["network.faults.clear()" if act.value is None else f"del network.faults[{act.value}]"]
    if act.what == "cable":
        return _cable(act, plc)
    return [f"# not repeated: {act.text.splitlines()[0] if act.text else act.what}"]


def _cable(act: Act, plc: Plc) -> list[str]:
    """Pulls or plugs the cable of a unit, as `Workbench.cable` does."""
    number, unit = next((number, attached.unit) for number, attached in enumerate(plc.units) if attached.unit.name == act.name)
    row = f"Fault(Peer({unit.address!r}, 0), silent=True)"
    lines = [f"network.faults[:] = [row for row in network.faults if row != {row}]" if act.value
             else f"network.faults.insert(0, {row})"]  # fmt: skip
    if "link_up" in unit.settings:
        made = f"plc.units[{number}].unit"
        lines.append(f"{made}.settings = {{**{made}.settings, 'link_up': {act.value}}}")
    return lines


def _fault(row: Fault) -> str:
    """A row of faults as Python writes it, with what is not as usual."""
    values = {each.name: repr(getattr(row, each.name)) for each in fields(row) if getattr(row, each.name) != each.default}
    if "peer" in values:
        values["peer"] = f"Peer({row.peer.host!r}, {row.peer.port})"
    given = [f"{name}={value}" for name, value in values.items()]
    return f"Fault({', '.join(given)})"
