"""Sequential function charts as charts of PLCopen XML: each step is drawn once, every other way to it ends in a jump."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

from fbvm.interchange.markup import Element, element
from fbvm.interchange.plcopen.write.layout import End, wired
from fbvm.interchange.plcopen.write.types import NotExportable, Types
from fbvm.syntax import tree
from fbvm.syntax.tree.il import InstructionList
from fbvm.syntax.tree.sfc import Sfc, Step, Transition

LANE, HIGH, TOP = 320, 160, 40
"""Units of the drawing: the distances of columns and of rows of steps, and the y of the first row."""
STEP_WIDTH, STEP_HEIGHT, ACTION_WIDTH, ACTION_HEIGHT = 80, 30, 140, 20

Body = Callable[[tree.Block, int, int], Element]
"""Makes the element of a body, given the start and end of its text."""
_END = re.compile(r"(?i)END_TRANSITION")


@dataclass
class ChartWriter:
    """Draws one chart.  `named` grows by the elements of transitions that have bodies."""

    types: Types
    chart: Sfc
    body: Body
    elements: list[Element] = field(default_factory=list)
    named: list[Element] = field(default_factory=list)

    def write(self) -> list[Element]:
        """The elements of the chart."""
        self.steps = {step.name.text.upper(): step for step in self.chart.steps}
        self.ids = {name: number for number, name in enumerate(self.steps, 1)}
        self.number, self.lanes = len(self.ids), 0
        self.leaving: dict[str, list[Transition]] = {name: [] for name in self.steps}
        for transition in self.chart.transitions:
            for source in transition.sources:
                self.leaving[source.text.upper()].append(transition)
        self.out = {name: self._next() if len(found) > 1 else self.ids[name] for name, found in self.leaving.items()}
        self.claimed: set[str] = set()
        for step in sorted(self.chart.steps, key=lambda step: not step.initial):
            if step.name.text.upper() not in self.claimed:
                self._from(step)
        return self.elements

    def _next(self) -> int:
        self.number += 1
        return self.number

    def _from(self, first: Step) -> None:
        """Draw a step and all steps behind it that have not been drawn."""
        todo: list[tuple[str, int | None, int, int]] = [(first.name.text.upper(), None, self.lanes, 0)]
        self.claimed.add(todo[0][0])
        self.lanes += 1
        while todo:
            name, source, lane, row = todo.pop(0)
            x, y = 40 + lane * LANE, TOP + row * HIGH
            self._step(self.steps[name], source, x, y)
            if self.out[name] != self.ids[name]:
                self._put("selectionDivergence", self.out[name], [self.ids[name]], x, y + 50)
            branches = 0
            for transition in self.leaving[name]:
                if transition.sources[0].text.upper() != name:
                    continue
                mine = lane if not branches else self.lanes
                self.lanes += 1 if branches else 0
                branches += 1
                self._transition(transition, mine, row, todo)

    # --- elements ---

    def _put(self, kind: str, number: int, sources: list[int], x: int, y: int, *content: Element, **marks: str) -> None:
        """An element with wires into it.  Each way into a convergence ends at a point of its own: Beremiz passes over others."""
        groups = [[source] for source in sources] if kind == "simultaneousConvergence" else [sources]
        into = [_points(group, x, y) for group in groups if group]
        unnamed = kind in ("transition", "simultaneousConvergence")
        out = element("connectionPointOut", **({} if unnamed else {"formalParameter": ""}))
        has_out = kind not in ("jumpStep", "actionBlock")
        self.elements.append(element(kind, element("position", x=x, y=y), *into, out if has_out else None, *content,
                                     localId=number, **marks))

    def _step(self, step: Step, source: int | None, x: int, y: int) -> None:
        name = step.name.text
        self._put("step", self.ids[name.upper()], [] if source is None else [source], x, y,
                  element("connectionPointOutAction", formalParameter=""), name=name,
                  initialStep="true" if step.initial else "false", height=str(STEP_HEIGHT), width=str(STEP_WIDTH))
        if not step.associations:
            return
        actions = []
        for at, association in enumerate(step.associations):
            marks = {"qualifier": association.qualifier}
            if association.time is not None:
                marks["duration"] = self.types.text(association.time)
            if association.indicators:
                marks["indicator"] = ", ".join(self.types.text(one) for one in association.indicators)
            actions.append(element("action", element("relPosition", x=0, y=at * ACTION_HEIGHT),
                                   element("reference", name=association.action.text), localId=self._next(), **marks))
        height = str(ACTION_HEIGHT * len(actions))
        self._put("actionBlock", self._next(), [self.ids[name.upper()]], x + STEP_WIDTH + 20, y, *actions, height=height,
                  width=str(ACTION_WIDTH))

    def _transition(self, transition: Transition, lane: int, row: int, todo: list[tuple[str, int | None, int, int]]) -> None:
        x, y = 40 + lane * LANE, TOP + row * HIGH + 80
        sources = [self.out[source.text.upper()] for source in transition.sources]
        if len(sources) > 1:
            joint = self._next()
            self._put("simultaneousConvergence", joint, sources, x, y - 10)
            sources = [joint]
        number = self._next()
        marks = {"priority": str(transition.priority)} if transition.priority is not None else {}
        self._put("transition", number, sources, x, y, self._condition(transition), **marks)
        if len(transition.targets) > 1:
            number, before = self._next(), number
            self._put("simultaneousDivergence", number, [before], x, y + 30)
        for at, target in enumerate(transition.targets):
            name = target.text.upper()
            here = lane if not at else self.lanes
            self.lanes += 1 if at else 0
            if name in self.claimed:
                self._put("jumpStep", self._next(), [number], 40 + here * LANE, y + 50, targetName=self.steps[name].name.text)
            else:
                self.claimed.add(name)
                todo.append((name, number, here, row + 1))

    def _condition(self, transition: Transition) -> Element:
        """An expression in its place, or the name of a transition that has a body."""
        if transition.body is None:
            text = element("ST", element("xhtml:p", self.types.text(transition.condition)))
            return element("condition", element("inline", text, name=""))
        body = transition.body
        if len(body) == 1 and isinstance(body[0], InstructionList) and not body[0].body:
            written = self.body(body, body[0].start, body[0].end)
            return element("condition", element("inline", written, name=transition.name.text if transition.name else ""))
        assert transition.name is not None
        if not body:
            raise NotExportable(transition, f"the transition {transition.name.text} has no condition that can be exported", "")
        start, end = body[0].start, transition.end
        ends = [found.start() for found in _END.finditer(self.types.source.text, start, end)]
        self.named.append(element("transition", element("body", self.body(body, start, ends[-1] if ends else end)),
                                  name=transition.name.text))
        return element("condition", element("reference", name=transition.name.text))


def _points(sources: list[int], x: int, y: int) -> Element:
    return wired(tuple(End(number, "", x, y) for number in sources), x, y, 0, 0)
