"""The charts of one POU: that of its body, and those that actions have."""

from __future__ import annotations

from collections.abc import Sequence

from fbvm.base.types import fold
from fbvm.syntax.sfc.elements import Part, SfcElements
from fbvm.syntax.sfc.flags import declared
from fbvm.syntax.sfc.lowering import Evolution, action_flags
from fbvm.syntax.sfc.rules import sound
from fbvm.syntax.st.lexer import Token
from fbvm.syntax.tree import Action, Block, VarSection
from fbvm.syntax.tree.node import changed
from fbvm.syntax.tree.sfc import Sfc, Step, Transition


class Charts:
    """Makes statements of charts.  `sections` fill with what they declare; `actions` are those of the POU, with statements
    in place of their charts."""

    def __init__(self, builder: SfcElements, actions: list[Action], sections: Sequence[VarSection]) -> None:
        self.builder = builder
        self.flags = declared(sections)
        self.actions = actions
        self.sections: list[VarSection] = []
        self._users: dict[str, Action | None] = {}
        """Folded names of actions, and in whose chart they are named: None is the body's."""

    def body(self, word: Token, body: Block, elements: Sequence[Action | Part]) -> Block:
        """The body of the POU, which is a chart if it has steps."""
        parts = [part for part in elements if isinstance(part, Step | Transition)]
        charted, self.builder.charted = self.builder.charted, {}
        if not parts and not charted:
            return body
        first = parts[0] if parts else next(iter(charted))
        if word.type == "FUNCTION":
            self.builder.report("S0111", word.start, word.end, "a FUNCTION has no steps: it remembers nothing",
                                "make it a FUNCTION_BLOCK")
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
        """A chart; one whose text has errors is not looked at as a whole."""
        steps = [part for part in parts if isinstance(part, Step)]
        transitions = [part for part in parts if isinstance(part, Transition)]
        told = self.builder.diagnostics
        damaged = any(each.severity == "error" and start <= each.start <= end for each in told)
        good = not damaged and sound(steps, transitions, self.builder.report)
        for association in (one for step in steps for one in step.associations):
            name = association.action
            if self._users.setdefault(fold(name.text), action) is not action:
                self.builder.report("S0112", name.start, name.end, f"{name.text} is an action of another chart of this POU", "")
        made = Evolution(self.builder, steps, transitions, self.actions, action, self.flags).sfc(start, end, good)
        self.sections += made.sections
        return made
