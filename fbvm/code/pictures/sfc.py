"""Pictures of sequential function charts: what an Image keeps for those who draw them."""

from __future__ import annotations

from collections.abc import Callable

from fbvm.base.types import StructType, fold
from fbvm.check.symbols.facts import Pou
from fbvm.code.image import SfcPicture
from fbvm.syntax.tree import Assign, Node, sfc


def sfc_picture(chart: sfc.Sfc, pou: Pou, site: Callable[[Node], int]) -> SfcPicture:
    """The picture of a chart, with conditions as they are written in the source.

    chart: the chart, in the body of `pou`.
    site: numbers the place in the source at which a node begins."""
    numbers = {fold(step.name.text): number for number, step in enumerate(chart.steps)}
    text = pou.source.text

    def written(node: Node) -> str:
        return " ".join(text[node.start:node.end].split())

    def rows(step: sfc.Step) -> tuple[tuple[str, str, str], ...]:
        return tuple((" ".join([use.qualifier, *([written(use.time)] if use.time else [])]), use.action.text,
                      ", ".join(map(written, use.indicators))) for use in step.associations)

    steps = tuple((step.name.text, step.initial, _flag(pou, step), rows(step)) for step in chart.steps)
    transitions = tuple(
        (site(one), one.name.text if one.name else "", one.priority or 0,
         tuple(numbers[fold(name.text)] for name in one.sources), tuple(numbers[fold(name.text)] for name in one.targets),
         written(_condition(one))) for one in chart.transitions)
    return SfcPicture(pou.number, site(next(step for step in chart.steps if step.initial)), steps, transitions)


def _condition(transition: sfc.Transition) -> Node:
    """The condition of a transition; where it is written in statements that only assign it, the value that they assign."""
    body = transition.body or ()
    only = body[0] if len(body) == 1 else None
    return only.value if isinstance(only, Assign) else transition.condition


def _flag(pou: Pou, step: sfc.Step) -> int:
    """The offset of the flag of a step (`step.X`) in an instance."""
    variable = pou.variables[fold(step.name.text)]
    variable = variable.step or variable
    assert isinstance(variable.type, StructType)
    return variable.offset + variable.type.fields["X"].offset
