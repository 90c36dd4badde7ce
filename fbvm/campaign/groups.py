"""Groups of failures that have the same cause as far as one can see: what failed, and the statement."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

from fbvm.campaign.execution import Result
from fbvm.campaign.judge import Failure
from fbvm.campaign.plan import Plan
from fbvm.campaign.shrinking import Shrunk
from fbvm.campaign.variants import draw


@dataclass
class Group:
    """Runs that fail alike: the failure of the first one, and the numbers of all."""

    failure: Failure
    numbers: list[int] = field(default_factory=list)
    shrunk: Shrunk | None = None
    """The smallest such run, once it has been looked for."""

    @property
    def first(self) -> int:
        """The number of the first run of the group."""
        return self.numbers[0]


def grouped(results: Mapping[int, Result]) -> list[Group]:
    """The groups of the failing runs; those with most runs come first."""
    found: dict[object, Group] = {}
    for number in sorted(results):
        if failure := results[number].failure:
            found.setdefault(failure.key, Group(failure)).numbers.append(number)
    return sorted(found.values(), key=lambda group: (-len(group.numbers), group.first))


def in_common(plan: Plan, group: Group, everywhere: Collection[int]) -> list[str]:
    """What all runs of a group have, and not all other runs of those `everywhere`: values of parameters, kinds of faults."""
    members = set(group.numbers)
    inside, outside = Counter[str](), Counter[str]()
    for number in everywhere:
        (inside if number in members else outside).update(_traits(plan, number))
    others = len(everywhere) - len(members)
    return sorted(trait for trait, count in inside.items() if count == len(members) and outside[trait] < others)


def _traits(plan: Plan, number: int) -> set[str]:
    variant = draw(plan, number)
    traits = {f"{axis.name} = {axis.text(variant.value(plan, at))}" for at, axis in enumerate(plan.axes)}
    return traits | {named.kind for named in variant.faults} | {"power cut" for _ in variant.cuts}
