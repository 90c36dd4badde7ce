"""What a run of a campaign varies in each test, by the plan and what was drawn for it."""

from __future__ import annotations

from fbvm.base.diagnostics import Source
from fbvm.campaign.axes import axis_from_text
from fbvm.campaign.items.execution import conditions_of
from fbvm.campaign.plan import VALUE, Axis, Plan
from fbvm.campaign.variants import Cut, NamedFault, Variant
from fbvm.net.faults import fault
from fbvm.run.project import Project
from fbvm.run.varied import Conditions, PowerCut, Written

MS = 1_000_000
NOTHING = Project(Source("fbvm.toml", ""), "loop", 0, None, None, (), (), frozenset(), (), ())


def test_each_axis_varies_what_it_names() -> None:
    n, cycle, phase, timing = map(axis_from_text, ("Main.n=1,2", "cycle=10ms,5ms", "phase=0ms,3ms", "timing=exact,real"))
    axes = (n, cycle, Axis("m later", VALUE, (7, 8, 9), path="Main.m", at_ns=30 * MS), phase, timing)
    variant = Variant(4, 77, (1, 1, 2, 0, 1), (NamedFault("silent", fault("silent")), NamedFault("reset", fault("reset"))),
                      (Cut("pump", 30 * MS, 40 * MS, True), Cut("", 90 * MS, 5 * MS, False)), "real")  # fmt: skip
    assert conditions_of(Plan(NOTHING, axes=axes), variant) == Conditions(
        77, "real", (Written("Main.n", 2), Written("Main.m", 9, 30 * MS)), (("", 5 * MS),), (("", 0),), (("", "real"),),
        (fault("silent"), fault("reset")), (PowerCut("pump", 30 * MS, 40 * MS, True), PowerCut("", 90 * MS, 5 * MS, False)))


def test_a_run_without_axes_has_its_seed_and_what_units_leave_to_chance() -> None:
    assert conditions_of(Plan(NOTHING), Variant(0, 5, ())) == Conditions(5)
