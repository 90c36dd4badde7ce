"""What an Image keeps of a sequential function chart for those who draw it."""

from __future__ import annotations

from collections.abc import Callable

from fbvm.base.types import StructType, fold
from fbvm.check.facts import Pou
from fbvm.code.image import SfcPicture
from fbvm.syntax.tree import Assign, Node, sfc


def sfc_picture(chart: sfc.Sfc, pou: Pou, site: Callable[[Node], int]) -> SfcPicture:
    """The picture of a chart, conditions as they are written."""
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
    """What says when a transition fires: of statements the value that is assigned, if that is all they do."""
    body = transition.body or ()
    only = body[0] if len(body) == 1 else None
    return only.value if isinstance(only, Assign) else transition.condition


def _flag(pou: Pou, step: sfc.Step) -> int:
    """Where in an instance the flag of a step lies."""
    variable = pou.variables[fold(step.name.text)]
    assert isinstance(variable.type, StructType)
    return variable.offset + variable.type.fields["X"].offset
