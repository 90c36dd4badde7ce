"""Rules of sequential function charts (IEC 61131-3 ed. 3, tables 54 to 59) that need names and types."""

from __future__ import annotations

from fbvm.base.types import BOOL, TIME, base, fold
from fbvm.check.expressions.scope import Scope
from fbvm.check.expressions.writes import writable
from fbvm.check.symbols.facts import Pou
from fbvm.syntax import tree
from fbvm.syntax.tree import sfc


def check(scope: Scope, pou: Pou, chart: sfc.Sfc) -> bool:
    """Check conditions and associations of a chart in a POU; True if the statements that it means can be checked then."""
    rules = _Rules(scope, pou)
    good = [rules.transition(transition) for transition in chart.transitions]
    good += [rules.is_free(variable) for section in chart.sections for variable in section.variables]
    for step in chart.steps:
        good += [rules.association(association) for association in step.associations]
    return all(good)


class _Rules:
    def __init__(self, scope: Scope, pou: Pou) -> None:
        self.scope = scope
        self.facts = scope.facts
        self.error = scope.error
        self.pou = pou

    def is_free(self, declared: tree.VarDecl) -> bool:
        """True if no variable has the name of a step or an action; if one has, that is reported already."""
        name = declared.names[0]
        found = self.pou.variables.get(fold(name.text))
        return found is not None and name in (found.node, found.step.node if found.step is not None else None)

    def transition(self, transition: sfc.Transition) -> bool:
        return self._is_bool(transition.condition, "a transition")

    def association(self, association: sfc.Association) -> bool:
        good = self._action(association.action)
        qualifier = association.qualifier
        if association.time is None and sfc.QUALIFIERS[qualifier]:
            self.error("S0112", association, f"the qualifier {qualifier} needs a time",
                       f"write {association.action.text}({qualifier}, T#5s)")
            good = False
        elif association.time is not None:
            good &= self._time(association.time)
        for indicator in association.indicators:
            good &= self._is_bool(indicator, "an indicator")
        return good

    def _is_bool(self, expr: tree.Expr, what: str) -> bool:
        self.scope.condition(expr, what)
        kind = self.facts.types.get(expr)
        return kind is not None and base(kind) == BOOL

    def _time(self, expr: tree.Expr) -> bool:
        if not self.scope.fit(expr, TIME, "S0112", "the time of an action"):
            return False
        value = self.facts.constants.get(expr)
        if isinstance(value, int) and value < 0:
            self.error("S0112", expr, "the time of an action is below 0")
            return False
        return True

    def _action(self, name: tree.Name) -> bool:
        """An ACTION of the POU, or a BOOL variable that can be written."""
        variable = self.scope.variable(name.text)
        if fold(name.text) in self.pou.actions:
            if variable is not None and variable.role == "action":
                return True
            self.error("S0112", name, f"the ACTION {name.text} stands behind its {self.pou.kind}, where no step sees it",
                       f"write it in front of END_{self.pou.kind}")
            return False
        if variable is None and self.scope.pou is not None and fold(name.text) in self.scope.pou.failed_names:
            return False
        if variable is None or variable.role:
            nearest = self.scope.project.nearest(name.text, (action.tree.name.text for action in self.pou.actions.values()))
            self.error("S0112", name, f"{name.text} is neither an ACTION of {self.pou.name} nor a variable",
                       nearest or f"write ACTION {name.text}: .. END_ACTION")
            return False
        target = tree.NameRef(name.start, name.end, name.text)
        self.scope.infer(target)
        if base(variable.type) != BOOL:
            self.error("S0112", name, f"{name.text} is {variable.type}: a variable that is an action is BOOL")
            return False
        return writable(self.scope, target, "be an action")
