"""The flags SFCInit, SFCReset, SFCPause and their like, by which a program controls and observes a chart in CODESYS.

The POU of the chart declares them as variables.  Whether they are obeyed is for the dialect to say: the function SFC_FLAG of
`fblib/iec` returns FALSE, that of `fblib/codesys/blocks` its argument (CODESYS online help, SFC flags).
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

from fbvm.base.types import fold
from fbvm.syntax import tree
from fbvm.syntax.sfc.context import Associations, ChartContext
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.tree import Expr, Statement

OBEYED = "SFC_FLAG"
"""The function that says whether the dialect obeys flags."""
BOOLS = ("SFCINIT", "SFCRESET", "SFCPAUSE", "SFCTRANS")
TEXT = "SFCCURRENTSTEP"
"""Flags of the type BOOL, and the flag of the type STRING, folded."""


def declared(sections: Iterable[tree.VarSection]) -> frozenset[str]:
    """Folded names of the flags that a POU declares; a variable with the name of a flag and another type is none."""
    found = set()
    for variable in (variable for section in sections for variable in section.variables):
        is_bool = isinstance(variable.spec, tree.NamedType) and fold(variable.spec.text) == "BOOL"
        wanted = BOOLS if is_bool else (TEXT,) if isinstance(variable.spec, tree.StringSpec) else ()
        found |= {fold(name.text) for name in variable.names} & set(wanted)
    return frozenset(found)


def with_flags(chart: ChartContext, body: tree.Block, used: dict[str, Associations]) -> tree.Block:
    """The statements `body` of one call of a chart, changed so that the flags of its POU are obeyed; `used` are the actions.

    SFCInit holds the chart in its initial steps, whose actions are not executed; SFCReset begins the chart anew in every
    call and executes the actions; with SFCPause nothing is executed, but the times of steps go on (assumed)."""
    rest = [*body, *_report(chart)]
    if pause := _obeyed(chart, "SFCPAUSE"):
        rest = [chart.when(chart.negated(pause), rest)]
    made: list[Statement] = []
    if resets := [flag for flag in map(partial(_obeyed, chart), ("SFCINIT", "SFCRESET")) if flag]:
        again = [chart.put(chart.begun, False), *(chart.put(chart.flag(step.name, "X"), False) for step in chart.steps)]
        again += [statement for pairs in used.values() for statement in chart.reset_action(pairs)]
        made.append(chart.when(chart.join("OR", resets), again))
    if init := _obeyed(chart, "SFCINIT"):
        held = [chart.put(chart.flag(step.name, "X"), True) for step in chart.steps if step.initial]
        rest = [chart.when(init, [*held, *chart.assign_variables(used)], rest)]
    return (*made, *rest)


def _obeyed(chart: ChartContext, name: str) -> Expr | None:
    """The state of a flag; None if the POU does not declare the flag."""
    return chart.function(OBEYED, chart.name(name)) if name in chart.flags else None


def _report(chart: ChartContext) -> Iterable[Statement]:
    """Assign to SFCTrans whether a transition has fired, and to SFCCurrentStep the last step that is active."""
    told: list[Statement] = []
    if "SFCTRANS" in chart.flags:
        fired = chart.join("OR", [chart.exited(step) for step in chart.steps])
        told.append(chart.assign(chart.name("SFCTRANS"), fired))
    for step in chart.steps if TEXT in chart.flags else ():
        text = chart.builder.string_literal(Token("STRING_LITERAL", f"'{step.name.text}'", chart.at, chart.at))
        told.append(chart.when(chart.flag(step.name, "X"), [chart.assign(chart.name(TEXT), text)]))
    if told:
        yield chart.when(chart.function(OBEYED, chart.truth(True)), told)
