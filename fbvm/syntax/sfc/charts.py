"""The charts of one POU: the chart of its body, and the charts of its actions."""

from __future__ import annotations

from collections.abc import Sequence

from fbvm.base.types import fold
from fbvm.syntax.sfc.context import Associations, action_flags
from fbvm.syntax.sfc.elements import Part, SfcElements
from fbvm.syntax.sfc.flags import declared
from fbvm.syntax.sfc.lowering import ChartLowering
from fbvm.syntax.sfc.rules import sound
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.tree import Action, Block, VarSection
from fbvm.syntax.tree.node import changed
from fbvm.syntax.tree.sfc import Association, Sfc, Step, Transition


class Charts:
    """Puts the nodes of charts in place of their elements.

    `sections` grows by the variables that the charts need; `actions` are the actions of the POU, each with its chart as
    its body."""

    def __init__(self, builder: SfcElements, actions: list[Action], sections: Sequence[VarSection]) -> None:
        self.builder = builder
        self.flags = declared(sections)
        self.actions = actions
        self.sections: list[VarSection] = []
        self._users: dict[str, Action | None] = {}
        """By folded name of an action, the action whose chart has an association with it; None for the chart of the body."""
        self._controls: dict[str, str] = {}
        """By folded name of an action, the variable that is its control: charts that act on one variable share it."""
        self._associations: list[tuple[Action | None, Step, Association]] = []
        """All associations of the POU, with the action whose chart they stand in."""

    def body(self, word: Token, body: Block, elements: Sequence[Action | Part]) -> Block:
        """The body of a POU with steps, which begins with `word`: the chart, or `body` as it is if only actions have steps."""
        parts = [part for part in elements if isinstance(part, Step | Transition)]
        charted, self.builder.charted = self.builder.charted, {}
        first = parts[0] if parts else next(iter(charted))
        if word.type == "FUNCTION":
            self.builder.report("S0111", word.start, word.end, "a FUNCTION has no steps: it remembers nothing",
                                "make it a FUNCTION_BLOCK")
        for inside, inner in ((None, parts), *charted.items()):
            self._associations += [(inside, step, one) for step in inner if isinstance(step, Step) for one in step.associations]
        if parts:
            self._alone(body, "in an ACTION of a step, or in a POU of its own")
            body = (self._chart(parts, elements[0].start, elements[-1].end, None),)
        for action, inner in charted.items():
            self._alone(action.body, "in another ACTION")
            chart = self._chart(inner, inner[0].start, inner[-1].end, action)
            self.actions = [changed(each, body=(chart,)) if each is action else each for each in self.actions]
        self.sections.append(action_flags(first.start, first.end, self.actions))
        return body

    def _alone(self, body: Block, where: str) -> None:
        if body:
            self.builder.report("S0111", body[0].start, body[0].end, "statements stand in front of a chart",
                                f"what is to be executed in every scan belongs {where}")

    def _chart(self, parts: Sequence[Part], start: int, end: int, action: Action | None) -> Sfc:
        """The node of a chart.  The rules for whole charts are checked only if its text has no errors."""
        steps = [part for part in parts if isinstance(part, Step)]
        transitions = [part for part in parts if isinstance(part, Transition)]
        told = self.builder.diagnostics
        damaged = any(each.severity == "error" and start <= each.start <= end for each in told)
        good = not damaged and sound(steps, transitions, self.builder.report)
        coded = {fold(each.name.text) for each in self.actions}
        for association in (one for step in steps for one in step.associations):
            name = association.action
            if self._users.setdefault(fold(name.text), action) is not action and fold(name.text) in coded:
                self.builder.report("S0112", name.start, name.end, f"{name.text} is an action of another chart of this POU", "")
        elsewhere: dict[str, Associations] = {}
        for inside, step, association in self._associations:
            if inside is not action and fold(association.action.text) not in coded:
                elsewhere.setdefault(fold(association.action.text), []).append((step, association))
        made = ChartLowering(self.builder, steps, transitions, self.actions, action, self.flags, self._controls,
                             elsewhere).sfc(start, end, good)
        self.sections += made.sections
        return made
