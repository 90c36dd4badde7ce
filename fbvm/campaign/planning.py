"""Makes a plan of what a campaign says: a project or a program, compiled, with every name and value looked up."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from fbvm.base.diagnostics import Diagnostic, Source, errors
from fbvm.campaign.execution import Wrong
from fbvm.campaign.judge import Judge
from fbvm.campaign.plan import MOST_RUNS, SETTINGS, VALUE, Axis, Plan
from fbvm.campaign.plan_file import Written
from fbvm.code.image import Image
from fbvm.interchange.formats.given import usual_dialect
from fbvm.machine.backplane import BRINGERS, ETN21_ADDRESS, UNIT_OF_AREA
from fbvm.machine.scan.watch_cycle import USUAL_NS
from fbvm.run.plant import Plant, value_for
from fbvm.run.project import FILE, PlcRow, Project, UnitRow
from fbvm.run.running import CYCLIC
from fbvm.watch.conditions import ConditionError
from fbvm.watch.paths import UnknownPlace

PLC = "plc"
"""The name of the only PLC of a campaign over a program."""
WITHOUT_END = 1
"""Nanoseconds for which a plant is built that does not run."""


class Unfit(ValueError):
    """A campaign does not fit its project; the message says what."""


def program_project(sources: Sequence[Path], about: Mapping[str, Any], folder: Path) -> Project:
    """The project of one PLC with an ETN21 and the units of the mailboxes that its program uses.  Raises Wrong, Unfit."""
    libraries = tuple(folder / library for library in about["libraries"])
    if missing := [source for source in sources if not source.is_file()]:
        raise Unfit(f"there is no file {missing[0]}")
    row = PlcRow(PLC, tuple(sources), about["program"], None, about["dialect"] or usual_dialect(sources), libraries,
                 about["cycle"], USUAL_NS, CYCLIC, "auto", None, None, (), (), ())  # fmt: skip
    servers = tuple((endpoint, None) for endpoint in about["servers"])
    project = Project(Source(FILE, ""), "loop", 0, None, None, servers, (), frozenset(), (), (row,))
    (image,) = images_of(project)[0].values()
    units = [UnitRow("ETN21", ETN21_ADDRESS, {"number": 0})]
    units += [UnitRow(UNIT_OF_AREA[box.name], BRINGERS[box.name]().address, {})
              for box in image.layout.mailboxes if box.name in BRINGERS]  # fmt: skip
    return replace(project, plcs=(replace(row, units=tuple(units)),))


def images_of(project: Project) -> tuple[dict[str, Image], list[Diagnostic]]:
    """The compiled programs of a project by the names of its PLCs, and warnings.  Raises Wrong for errors."""
    plant = Plant(replace(project, net="loop"), for_ns=WITHOUT_END)
    plant.close()
    if wrong := errors(plant.diagnostics):
        raise Wrong(wrong)
    return {kind.row.name: kind.runs[0].plc.image for kind in plant.kinds}, plant.diagnostics


def plan_of(written: Written, project: Project, images: Mapping[str, Image]) -> Plan:
    """The plan of a campaign over a project.  Raises Unfit for names and values that its programs do not have."""
    about = written.about
    for_ns = about["for"] or project.for_ns
    if for_ns is None and project.scans is None and not any(row.until for row in project.plcs):
        raise Unfit('say how long a run takes at most: by for = "10s", or --for')
    plant = Plant(replace(project, net="loop"), for_ns=WITHOUT_END, images=images)
    plant.close()
    plcs = {kind.row.name: kind for kind in plant.kinds}
    everyone = tuple(plant.named_runs)
    cuts = tuple(replace(rule, plcs=_known(rule.plcs, everyone) or everyone) for rule in written.cuts)
    goldens = tuple(replace(golden, plc=_known((golden.plc,), everyone)[0] if golden.plc else everyone[0])
                    for golden in written.judging.goldens)  # fmt: skip
    plan = Plan(
        replace(project, doors=(), backlog=frozenset(), pictures=()), about["seed"], about["runs"], about["timing"], for_ns,
        tuple(_located(axis, list(plcs)) for axis in written.axes), written.faults, cuts,
        replace(written.judging, goldens=goldens), about["show"],
    )  # fmt: skip
    check_count(plan)
    for (*_, name), times in Counter((each.what, each.plc, each.path, each.at_ns, each.name) for each in plan.axes).items():
        if times > 1:
            raise Unfit(f"{name} is varied {times} times: write all of its values in one place")
    for axis in plan.axes:
        for value in axis.values if axis.what == VALUE else ():
            _check(axis, value, plcs[axis.plc].runs[0].plc)
    try:
        Judge(plan.judging, plant.named_runs, plan.alone)
    except (ConditionError, UnknownPlace, TypeError) as error:
        raise Unfit(str(error)) from None
    return plan


def check_count(plan: Plan) -> None:
    """Raises Unfit for more runs than can be done."""
    if plan.count > MOST_RUNS:
        what = f"{plan.runs:,} runs" if plan.runs else f"{plan.combinations:,} combinations of the values"
        raise Unfit(f"{what} are too many: a campaign or a sweep has {MOST_RUNS:,} runs at most")


def _known(names: Sequence[str], there: Sequence[str]) -> tuple[str, ...]:
    """These names, if all of them are there.  Raises Unfit."""
    for name in names:
        if name not in there:
            raise Unfit(f"there is no PLC {name}; there is {', '.join(there)}")
    return tuple(names)


def _located(axis: Axis, plcs: Sequence[str]) -> Axis:
    """An axis with the PLC that it is about, and the name that it has there.  Raises Unfit."""
    if axis.what != VALUE:
        return replace(axis, plc=_known((axis.plc,), plcs)[0] if axis.plc else "")
    owner, _, path = axis.path.partition(".")
    if owner in plcs:
        return replace(axis, plc=owner, path=path)
    if len(plcs) == 1:
        return replace(axis, plc=plcs[0])
    raise Unfit(f"{axis.path} begins with the name of no PLC; there is {', '.join(plcs)}")


def _check(axis: Axis, value: Any, plc: Any) -> None:
    try:
        value_for(plc.find(axis.path), value)
    except UnknownPlace as error:
        hint = f'; what is varied beside variables is written setting = "{axis.path}"' if axis.path in SETTINGS else ""
        raise Unfit(f"{error}{hint}") from None
    except (TypeError, ValueError) as error:
        raise Unfit(str(error)) from None


def unfit_conditions(plan: Plan) -> Iterator[str]:
    """What a user should know of a plan: nothing is judged but traps."""
    judging = plan.judging
    if not (judging.never or judging.always or judging.responses or judging.until or judging.goldens) and not any(
            row.until for row in plan.project.plcs):  # fmt: skip
        yield "only traps fail: say what a good run is by never, always, until or within"
