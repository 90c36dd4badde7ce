"""One run of a campaign by its number: what is drawn for it, and the project that it executes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from random import Random
from typing import Any

from fbvm.campaign.plan import CYCLE, EXACT, PHASE, TIMING, VALUE, Axis, Moments, Plan
from fbvm.engine.native import engine as native
from fbvm.net.faults import FOREVER, Fault
from fbvm.run.plant import timed
from fbvm.run.project import PlcRow, Project, SetRow
from fbvm.watch.values import show_time

SEED_BITS = 62
STEP_NS = 1_000_000
"""Times are drawn in steps of a millisecond."""


@dataclass(frozen=True)
class NamedFault:
    """A network fault, and what its kind is called."""

    kind: str
    fault: Fault

    def __str__(self) -> str:
        until = "" if self.fault.until_ns == FOREVER else show_time(self.fault.until_ns)[2:]
        return f"{self.kind} {show_time(self.fault.from_ns)[2:]}..{until}"


@dataclass(frozen=True)
class Cut:
    """A power cut of the PLC with this name, and how long it is off."""

    plc: str
    at_ns: int
    off_ns: int
    is_cold: bool = False

    def __str__(self) -> str:
        which = " cold" * self.is_cold + f" {self.plc}" * bool(self.plc)
        return f"power{which} {show_time(self.at_ns)[2:]}..{show_time(self.at_ns + self.off_ns)[2:]}"


@dataclass(frozen=True)
class Variant:
    """What a run is: its number, its seed, the number of the value of each axis, and what goes wrong in it."""

    number: int
    seed: int
    values: tuple[int, ...]
    faults: tuple[NamedFault, ...] = ()
    cuts: tuple[Cut, ...] = ()
    timing: str = EXACT

    def value(self, plan: Plan, axis: int) -> Any:
        """The value of an axis by its number."""
        return plan.axes[axis].values[self.values[axis]]


def draw(plan: Plan, number: int) -> Variant:
    """The run with this number, from 0 on.  It depends on nothing but the plan: every process draws the same."""
    dice = Random(f"{plan.seed} {number}")
    seed = dice.getrandbits(SEED_BITS)
    if plan.runs:
        values = tuple(dice.randrange(len(axis.values)) for axis in plan.axes)
    else:
        values = _combination(plan, number)
    faults = tuple(NamedFault(kind, fault) for rule in plan.faults for begins, lasts in _moments(dice, rule.moments)
                   for kind, fault in [_fault(dice, rule.kinds, rule.choices, begins, begins + lasts)])  # fmt: skip
    cuts = tuple(Cut(dice.choice(rule.plcs), begins, lasts, rule.is_cold)
                 for rule in plan.cuts for begins, lasts in _moments(dice, rule.moments))  # fmt: skip
    return Variant(number, seed, values, faults, tuple(sorted(cuts, key=lambda cut: cut.at_ns)), plan.timing)


def _combination(plan: Plan, number: int) -> tuple[int, ...]:
    """The combination with this number; the last axis changes first."""
    values = []
    for axis in reversed(plan.axes):
        number, value = divmod(number, len(axis.values))
        values.append(value)
    return tuple(reversed(values))


def _moments(dice: Random, moments: Moments) -> Iterator[tuple[int, int]]:
    """When something begins, and how long it lasts, for each time that it happens."""
    for _ in range(moments.count):
        if dice.randrange(100) < moments.chance_percent:
            yield _between(dice, *moments.begins_ns), _between(dice, *moments.lasts_ns)


def _between(dice: Random, first_ns: int, last_ns: int) -> int:
    return first_ns + dice.randrange((last_ns - first_ns) // STEP_NS + 1) * STEP_NS


def _fault(dice: Random, kinds: Any, choices: Any, from_ns: int, until_ns: int) -> tuple[str, Fault]:
    kind, fault = dice.choice(kinds)
    drawn = {name: dice.choice(values) for name, values in choices.items()}
    return kind, replace(fault, from_ns=from_ns, until_ns=max(until_ns, from_ns + 1), **drawn)


# --- the project of a run ---------------------------------------------------------------------------------------------


def project_of(plan: Plan, variant: Variant) -> Project:
    """The project with what a run varies in it."""
    faults = tuple(named.fault for named in variant.faults)

    def setting(plc: str, what: str, usual: Any) -> Any:
        return next((value for axis, value in reversed(list(settings_of(plan, variant, plc))) if axis.what == what), usual)

    project = timed(plan.project, variant.seed, lambda plc: setting(plc, TIMING, variant.timing),
                    lambda plc, usual_ns: setting(plc, CYCLE, usual_ns))  # fmt: skip
    rows = tuple(_row(plan, variant, row) for row in project.plcs)
    return replace(project, net="loop", faults=faults + plan.project.faults, plcs=rows)


def _row(plan: Plan, variant: Variant, row: PlcRow) -> PlcRow:
    sets = [SetRow(axis.path, value, axis.at_ns) for axis, value in settings_of(plan, variant, row.name) if axis.what == VALUE]
    engine = "native" if row.engine == "auto" and native.available() else row.engine
    return replace(row, sets=(*row.sets, *sets), engine=engine)


def settings_of(plan: Plan, variant: Variant, plc: str) -> Iterator[tuple[Axis, Any]]:
    """The axes of a PLC of the project, each with its value."""
    for number, axis in enumerate(plan.axes):
        if axis.plc in ("", plc):
            yield axis, variant.value(plan, number)


def phase_ns(plan: Plan, variant: Variant, plc: str) -> int:
    """How much later than the others a PLC begins."""
    return sum(value for axis, value in settings_of(plan, variant, plc) if axis.what == PHASE)
