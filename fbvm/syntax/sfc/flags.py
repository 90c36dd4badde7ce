"""Variables with which CODESYS lets a program steer a chart and look at it: SFCInit, SFCReset, SFCPause and their like.

They are declared in the POU of the chart, and do what is said here where the library of the dialect says so: the function
SFC_FLAG of `fblib/iec` gives FALSE, that of `fblib/codesys/blocks` its argument (CODESYS online help, SFC flags).
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from typing import TYPE_CHECKING

from fbvm.base.types import fold
from fbvm.syntax import tree
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.tree import Expr, Statement

if TYPE_CHECKING:
    from fbvm.syntax.sfc.lowering import Evolution, Used

ASKED = "SFC_FLAG"
BOOLS = ("SFCINIT", "SFCRESET", "SFCPAUSE", "SFCTRANS")
TEXT = "SFCCURRENTSTEP"


def declared(sections: Iterable[tree.VarSection]) -> frozenset[str]:
    """The flags that a POU declares, folded; another variable of such a name has another type."""
    found = set()
    for variable in (variable for section in sections for variable in section.variables):
        is_bool = isinstance(variable.spec, tree.NamedType) and fold(variable.spec.text) == "BOOL"
        wanted = BOOLS if is_bool else (TEXT,) if isinstance(variable.spec, tree.StringSpec) else ()
        found |= {fold(name.text) for name in variable.names} & set(wanted)
    return frozenset(found)


def steered(chart: Evolution, evolved: tree.Block, used: dict[str, Used]) -> tree.Block:
    """What a call does that `evolved` stands for, as the flags of its POU want it; `used` are its actions.

    SFCInit holds the chart in its initial steps, whose actions are not executed; SFCReset begins it anew in every call and
    executes them; SFCPause leaves all as it is, but the times of steps go on (assumed)."""
    rest = [*evolved, *_told(chart)]
    if pause := _asked(chart, "SFCPAUSE"):
        rest = [chart.when(chart.negated(pause), rest)]
    made: list[Statement] = []
    if begins := [flag for flag in map(partial(_asked, chart), ("SFCINIT", "SFCRESET")) if flag]:
        again = [chart.put(chart.begun, False), *(chart.put(chart.flag(step.name, "X"), False) for step in chart.steps)]
        again += [statement for pairs in used.values() for statement in chart.begin_again(pairs)]
        made.append(chart.when(chart.joined("OR", begins), again))
    if init := _asked(chart, "SFCINIT"):
        held = [chart.put(chart.flag(step.name, "X"), True) for step in chart.steps if step.initial]
        rest = [chart.when(init, [*held, *chart.variables(used)], rest)]
    return (*made, *rest)


def _asked(chart: Evolution, name: str) -> Expr | None:
    return chart.function(ASKED, chart.name(name)) if name in chart.flags else None


def _told(chart: Evolution) -> Iterable[Statement]:
    """What the chart tells: whether a transition has fired, and the last step that is active."""
    told: list[Statement] = []
    if "SFCTRANS" in chart.flags:
        fired = chart.joined("OR", [chart.left(step) for step in chart.steps])
        told.append(chart.assign(chart.name("SFCTRANS"), fired))
    for step in chart.steps if TEXT in chart.flags else ():
        text = chart.builder.string_literal(Token("STRING_LITERAL", f"'{step.name.text}'", chart.at, chart.at))
        told.append(chart.when(chart.flag(step.name, "X"), [chart.assign(chart.name(TEXT), text)]))
    if told:
        yield chart.when(chart.function(ASKED, chart.truth(True)), told)
