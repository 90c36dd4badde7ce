"""What the sweeps over folders of somebody's projects share: how far each project came, why not further, and runs with inputs
at random."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from random import Random
from typing import Any

from fbvm.base.diagnostics import Diagnostic
from fbvm.base.types import BOOL, StructType, Type, base
from fbvm.code.image import Image
from fbvm.machine.plc import Plc

SCANS, CYCLE_NS, BUDGET = 50, 20_000_000, 200_000
EVERY = 5
"""Scans between two changes of the inputs."""
_NAMED = re.compile(r"'[^']*'|\"[^\"]*\"|\b[\w.$]*[\d_.$][\w.$]*\b")


@dataclass
class Sweep:
    """How many projects reached each stage, and the causes that kept the others from it, with the projects that have them."""

    stages: Sequence[str]
    reached: Counter[str] = field(default_factory=Counter)
    causes: dict[tuple[str, str], list[str]] = field(default_factory=dict)

    def note(self, stage: str, project: str, cause: str = "") -> bool:
        """Note that a project reached a stage, or the cause for which it did not; returns whether it did."""
        if cause:
            self.causes.setdefault((stage, cause), []).append(project)
        else:
            self.reached[stage] += 1
        return not cause

    def report(self, most: int = 40) -> str:
        """The counts in one line, then the causes, the commonest first."""
        lines = [", ".join(f"{stage} {self.reached[stage]}" for stage in self.stages)]
        rows = sorted(self.causes.items(), key=lambda row: (self.stages.index(row[0][0]), -len(row[1]), row[0][1]))
        lines += [f"{len(projects):>4}  not {stage}: {cause}  [{projects[0]}]" for (stage, cause), projects in rows[:most]]
        return "\n".join(lines)


def cause(diagnostics: Sequence[Diagnostic]) -> str:
    """The first of some errors, without the names that it mentions, so that one cause is one row."""
    if not diagnostics:
        return ""
    return f"{diagnostics[0].code} {_NAMED.sub('..', diagnostics[0].message)}"


def compare(first: Plc, second: Plc, seed: int = 1) -> str:
    """Run two PLCs side by side with the same inputs; the first variable that differs, or the trap, "" if all was the same."""
    random = Random(seed)
    common = [name for name in first.image.symbols if name in second.image.symbols and " " not in name]
    inputs = [name for name in _bools(first.image) if name in set(_bools(second.image))]
    for scan in range(1, SCANS + 1):
        if scan % EVERY == 1:
            for name in inputs:
                value = random.random() < 0.5
                for plc in (first, second):
                    plc.write(name, value)
        traps = [_trap(plc) for plc in (first, second)]
        if traps[0] != traps[1]:
            return f"one stops: {traps[0] or traps[1]}"
        if traps[0]:
            return ""
        for name in common:
            if not _same(first.read(name), second.read(name)):
                return f"a value differs after scan {scan}"
    return ""


def run(plc: Plc, seed: int = 1) -> str:
    """Run a PLC with inputs at random; the code of the trap that stops it, "" if none does."""
    random = Random(seed)
    inputs = _bools(plc.image)
    for scan in range(SCANS):
        if scan % EVERY == 0:
            for name in inputs:
                plc.write(name, random.random() < 0.5)
        if trap := _trap(plc):
            return trap
    return ""


def _trap(plc: Plc) -> str:
    trap = plc.scan()
    return trap.code if trap is not None else ""


def _bools(image: Image) -> list[str]:
    """The BOOL variables of programs, and those that are global: inputs at random go to all of them."""
    found = []
    for symbol in image.symbols.values():
        fields = symbol.type.fields.values() if isinstance(symbol.type, StructType) else ()
        names = [f"{symbol.name}.{field.name}" for field in fields if _is_bool(field.type) and not field.constant
                 and not field.reference]
        found += names or ([symbol.name] if _is_bool(symbol.type) and not symbol.constant else [])
    return [name for name in found if not set("$ ") & set(name)]


def _is_bool(kind: Type) -> bool:
    return base(kind) == BOOL


def _same(before: Any, after: Any) -> bool:
    """Whether values are equal, apart from what only one of them has."""
    if isinstance(before, dict) and isinstance(after, dict):
        return all(_same(value, after[name]) for name, value in before.items() if name in after)
    return repr(before) == repr(after)
