"""Two things of one name in a POU: mistakes, but where a dialect keeps them apart."""

from __future__ import annotations

from fbvm.base.dialects import takers
from fbvm.base.types import fold
from fbvm.check.expressions.scope import Scope
from fbvm.check.symbols.facts import Pou, Variable


def hides_result(scope: Scope, pou: Pou, variable: Variable) -> bool:
    """Whether a variable may have the name of its function `pou`: a local one in some dialects; else that is reported."""
    is_local = variable.kind in ("VAR", "VAR_TEMP", "VAR_INST")
    text = f"{variable.name} is the name of the function itself"
    if is_local and scope.dialect.locals_hide_results:
        scope.project.report.add("S0193", variable.source, variable.node, f"{text}, whose result it hides")
        return True
    hint = f", or take {takers('locals_hide_results')}" if is_local else ""
    scope.project.report.add("S0202", variable.source, variable.node, text,
                             f"that name stands for the result; rename the variable{hint}")
    pou.failed_names.add(fold(variable.name))
    return False


def declared_twice(scope: Scope, pou: Pou, variable: Variable, other: Variable) -> None:
    """Report that `pou` declares `variable` and, above it, `other` of the same name.

    In some dialects the flags of a step stand beside a variable of its name.  Their own name gets a space then, so that a
    program names them by `name.X` and `name.T` only."""
    is_step, there = variable.role == "step" and not other.role, (other.source, other.node.start, "first declared here")
    if not is_step or not scope.dialect.steps_apart:
        scope.project.report.add("S0202", variable.source, variable.node, f"{variable.name} is declared twice in {pou.name}",
                                 f"rename one, or take {takers('steps_apart')}" if is_step else "", there)
        return
    name = variable.name
    scope.project.report.add("S0193", variable.source, variable.node,
                             f"a variable is called {name}, too: {name}.X and {name}.T are flags of the step", "", there)
    variable.name = f"{name} step"
    pou.variables[fold(variable.name)] = other.step = variable
    pou.order.append(variable)
