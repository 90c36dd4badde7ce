"""Sequential function charts of a document as steps, transitions and actions of the textual form.

Wires lead upwards from a transition to the steps that must be active, and downwards to the steps that follow.
Divergences, convergences and jumps only pass wires on: the textual form has none.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from fbvm.base.digits import whole_number
from fbvm.interchange.markup import Element
from fbvm.interchange.plcopen.read.conditions import Conditions, NotImportable, feeding
from fbvm.interchange.plcopen.read.diagram import Diagram, placed, read_diagram
from fbvm.interchange.plcopen.read.document import Body, Pou, Reading
from fbvm.interchange.plcopen.read.networks import LARGEST
from fbvm.interchange.plcopen.read.scope import Scope
from fbvm.interchange.plcopen.read.types import duration
from fbvm.interchange.plcopen.texts import squeezed
from fbvm.syntax.tree.sfc import QUALIFIERS

PASSING = ("selectionDivergence", "selectionConvergence", "simultaneousDivergence", "simultaneousConvergence")
COMPUTE = "COMPUTE_FUNCTION_BLOCKS"
"""The action that calls the blocks which conditions need (Beremiz)."""
ENTRY, ACTIVE, EXIT = "entry", "active", "exit"
QUALIFIER = {ENTRY: "P1", ACTIVE: "N", EXIT: "P0"}
STEP_ACTIONS = {"a6b08bd8-b696-47e3-9cbf-7408b61c9ff8": ENTRY, "700a583f-b4d4-43e4-8c14-629c7cd3bec8": ACTIVE,
                "a2621e18-7de3-4ea6-ae6d-89e9e0b7befd": EXIT}
"""Attributes of CODESYS's data at a step (`sfc/element`) that name actions; read off published projects, whose actions are
called accordingly."""
_FLAG = re.compile(r"(?i)(?<![\w.])([^\W\d]\w*)\s*\.\s*(?=[XT]\b)")
"""A flag of a step, up to its X or T."""
_ASSIGNED = re.compile(r"(?s)\s*([^\W\d]\w*)?\s*:=\s*(.*?);?\s*\Z")


@dataclass(eq=False)
class Arrow:
    """A transition with the names of the steps that it leaves and of those that it enters."""

    element: Element
    sources: list[str]
    targets: list[str]


NamedAction = tuple[str, list[str]]
"""The name of an ACTION, and the lines of its body."""


class Chart:
    """Writes one chart.  `write` makes the lines of the body of an inline action or a transition."""

    def __init__(self, reading: Reading, scope: Scope, pou: Pou, write: Callable[[Body], list[str]]) -> None:
        self.reading, self.scope, self.pou, self.write = reading, scope, pou, write
        self.actions: list[NamedAction] = []
        """The ACTIONs that the chart needs, which stand behind those of the POU."""
        self.conditions = Conditions(reading, scope)
        self.indirect: dict[str, str] = {}
        """By text in capitals, the actions that stand for actions and variables of instances."""
        self.renamed: dict[str, str] = {}
        """By name in capitals, the new names of steps whose names stand for something else in the POU, too."""

    def lines(self, body: Element) -> list[str]:
        """Steps, transitions and inline actions.  Raises NotImportable."""
        self._index(body)
        self._check(body)
        steps = body.all("step")
        self._rename(steps)
        self.scope.taken |= {self._name(step).upper() for step in steps}
        diagram = read_diagram(self.reading, body, chart=True)
        if len(body.children) > LARGEST:
            raise NotImportable(body, f"the chart has more than {LARGEST} elements", "")
        arrows = self._arrows(body)
        blocks = {reference: block for block in body.all("actionBlock") for reference in _references(block)}
        self.conditions.compute(diagram)
        ways = [line for arrow in self._tested(body, arrows) for line in self._transition(arrow, diagram)]
        compute = self._free(COMPUTE) if self.conditions.statements else ""
        begin = next(step for step in steps if step.get("initialStep") == "true")
        if self.reading.producer.generates:
            steps = self._generated(steps, arrows)
        lines = [line for step in steps
                 for line in self._step(step, blocks.get(step.get("localId")), compute if step is begin else "")]
        self._report_unused(diagram)
        if compute:
            self.actions.append((compute, list(self.conditions.statements)))
        self.actions = [(name, [with_new_names(line, self.renamed) for line in inner]) for name, inner in self.actions]
        return [with_new_names(line, self.renamed) for line in (*lines, *ways)]

    def _generated(self, steps: list[Element], arrows: list[Arrow]) -> list[Element]:
        """The steps as the generator of Beremiz comes to them: from each initial step along the transitions, depth first."""
        by_name = {self._name(step): step for step in steps}
        todo = [self._name(step) for step in reversed(steps) if step.get("initialStep") == "true"]
        found: dict[str, Element] = {}
        while todo:
            name = todo.pop()
            if name not in found:
                found[name] = by_name[name]
                todo += reversed([target for arrow in arrows if name in arrow.sources for target in arrow.targets])
        return [*found.values(), *(step for step in steps if self._name(step) not in found)]

    def _tested(self, body: Element, arrows: list[Arrow]) -> list[Arrow]:
        """The transitions in the order of their tests."""
        return self._met(body, arrows) if self.reading.producer.generates else sorted(arrows, key=_order(arrows))

    def _met(self, body: Element, arrows: list[Arrow]) -> list[Arrow]:
        """The transitions in the order in which the generator of Beremiz meets them, which is that of their tests: it goes
        through the elements as they are written, and from each against the wires first."""
        by_element = {arrow.element: arrow for arrow in arrows}
        by_name = {self._name(step): step for step in body.all("step")}
        seen: set[Element] = set()
        met: list[Arrow] = []

        def visit(element: Element) -> Iterator[Element]:
            """The elements that come before one."""
            seen.add(element)
            arrow = by_element.get(element)
            if arrow is None:
                yield from self._leading(element)
            else:
                yield from (by_name[name] for name in arrow.sources)
                met.append(arrow)

        for element in body.children:
            todo = [visit(element)] if element.name in ("step", "transition", "jumpStep") and element not in seen else []
            while todo:
                before = next(todo[-1], None)
                if before is None:
                    todo.pop()
                elif before not in seen:
                    todo.append(visit(before))
        return met

    def _leading(self, element: Element) -> list[Element]:
        """The transitions that lead to a step or a jump, in the order of the wires."""
        found: list[Element] = []
        todo, seen = [element], set()
        while todo:
            for reference in _references(todo.pop(0)):
                other = self.known.get(reference)
                if other is not None and other.name == "transition":
                    found.append(other)
                elif other is not None and other.name in PASSING and reference not in seen:
                    seen.add(reference)
                    todo.append(other)
        return found

    def _rename(self, steps: list[Element]) -> None:
        """Give other names to steps that are called like a variable, an action, or a step of another chart of the POU: in
        CODESYS each chart has its own names."""
        for step in steps:
            name = step.get("name")
            if name.upper() in self.scope.taken and name.upper() not in self.renamed:
                self.renamed[name.upper()] = self._free(name)
                self.reading.count("names of steps that a variable, an action or another chart of the POU has, too, are changed",
                                   step)

    def _name(self, step: Element) -> str:
        """What a step is called here."""
        name = step.get("name")
        return self.renamed.get(name.upper(), name)

    def _index(self, body: Element) -> None:
        """Note the elements by localId, and by localId the elements to which wires lead from each."""
        self.known = {child.get("localId"): child for child in body.children if child.get("localId")}
        self.followers: dict[str, list[Element]] = {}
        for child in body.children:
            for reference in _references(child):
                self.followers.setdefault(reference, []).append(child)

    def _check(self, body: Element) -> None:
        """Refuse a chart with macro steps, or without an initial step."""
        for child in body.all("macroStep"):
            raise NotImportable(child, f"the macro step {child.get('name')} is not taken over", "draw its steps in the chart")
        if not any(step.get("initialStep") == "true" for step in body.all("step")):
            raise NotImportable(body, "the chart has no initial step", "")

    def _report_unused(self, diagram: Diagram) -> None:
        """Report what is drawn in the chart and feeds no condition of a transition."""
        used = set(feeding(item for item in diagram.objects if item.kind == "condition"))
        for item in diagram.objects:
            if item not in used and item.kind != "rightPowerRail":
                self.reading.report("X0203", item.element, f"{item.text or item.kind} belongs to no transition of the chart, "
                                    "and is not taken over")

    # --- steps ---

    def _step(self, step: Element, block: Element | None, compute: str) -> list[str]:
        """A step with its actions; `compute` is the action that it stores for the conditions of the chart, if it does."""
        word = "INITIAL_STEP" if step.get("initialStep") == "true" else "STEP"
        if not step.get("name"):
            raise NotImportable(step, "a step has no name", "")
        associations = []
        for number, action in enumerate(block.all("action") if block else [], 1):
            associations.append(self._association(step, action, number))
        associations += [*self._step_actions(step), *([f"{compute}(S);"] if compute else [])]
        return [f"{word} {self._name(step)}:", *(f"    {text}" for text in associations), "END_STEP"]

    def _step_actions(self, step: Element) -> Iterator[str]:
        """The associations for the entry, active and exit action of a step (CODESYS).  The active action is called while the
        step is active, and not once more when it is left."""
        added = step.one("addData")
        listed = (part for data in (added.all("data") if added else ()) if data.get("name").endswith("/sfc/element")
                  for part in data.walk() if part.name == "attribute")
        for attribute in listed:
            kind, called = STEP_ACTIONS.get(attribute.get("guid"), ""), attribute.text.strip()
            if not kind or not called:
                continue
            name = self._free(f"{self._name(step)}_{kind}")
            call = f"{called}();" if kind != ACTIVE else f"IF {self._name(step)}.X THEN {called}(); END_IF;"
            # A step is left in front of what follows being entered.
            self.actions.insert(0 if kind == EXIT else len(self.actions), (name, [call]))
            yield f"{name}({QUALIFIER[kind]});"

    def _association(self, step: Element, action: Element, number: int) -> str:
        qualifier = action.get("qualifier") or "N"
        if qualifier not in QUALIFIERS:
            raise NotImportable(action, f"the qualifier {qualifier} is not executed", f"there are {', '.join(QUALIFIERS)}")
        reference, inline = action.one("reference"), action.one("inline")
        name = reference.get("name").strip() if reference else ""
        if inline is not None and (language := _language(inline)) is not None:
            name = self._free(f"{self._name(step)}_{number}")
            self.actions.append((name, self.write(Body(language.name, language))))
        if "." in name:
            name = self._of_instance(name)
        if not name:
            raise NotImportable(action, f"an action of step {step.get('name')} names nothing", "")
        given = [qualifier]
        if QUALIFIERS[qualifier]:
            given.append(duration(action.get("duration")) or action.get("duration") or "T#0s")
        if action.get("indicator"):
            given.append(action.get("indicator"))
        return f"{name}({', '.join(given)});"

    def _of_instance(self, text: str) -> str:
        """The action that does what `Motor.Stop` says: calls the action of that instance, or gives a BOOL variable of the
        instance the state that the association has."""
        known = self.indirect.get(text.upper())
        if known is None:
            known = self.indirect[text.upper()] = self._free(text.replace(".", "_"))
            statement = f"{text}();" if self.scope.names_action(text) else f"{text} := {known}.Q;"
            self.actions.append((known, [statement]))
        return known

    def _free(self, stem: str) -> str:
        name, number = stem, 1
        while self.scope.is_taken(name):
            number += 1
            name = f"{stem}_{number}"
        self.scope.taken.add(name.upper())
        return name

    # --- transitions ---

    def _arrows(self, body: Element) -> list[Arrow]:
        return [arrow for transition in body.all("transition") if (arrow := self._arrow(transition)) is not None]

    def _arrow(self, transition: Element) -> Arrow | None:
        """Where a transition leads; None if its tool leaves it out."""
        sources = self._above(transition)
        targets = self._below(transition)
        if not sources and self.reading.producer.generates:
            self.reading.report("X0292", transition, f"no step stands above transition {transition.get('localId')}: Beremiz and "
                                "OpenPLC Editor leave it out", "wire it to the step that it leaves")
            return None
        for found, where in ((sources, "above"), (targets, "below")):
            if not found:
                raise NotImportable(transition, f"no step stands {where} transition {transition.get('localId')}", "")
        return Arrow(transition, sources, targets)

    def _above(self, element: Element) -> list[str]:
        """Names of the steps from which wires lead to an element."""
        return self._steps(element, lambda here: [self.known[r] for r in _references(here) if r in self.known])

    def _below(self, element: Element) -> list[str]:
        """Names of the steps to which wires lead from an element; a jump leads to its target."""
        return self._steps(element, lambda here: self.followers.get(here.get("localId"), []))

    def _steps(self, element: Element, beside: Callable[[Element], list[Element]]) -> list[str]:
        found: dict[str, None] = {}
        seen: set[str] = set()
        todo = [element]
        while todo:
            for other in beside(todo.pop(0)):
                if other.name == "step":
                    found[self._name(other)] = None
                elif other.name == "jumpStep":
                    found.update(dict.fromkeys(self._jumped(other)))
                elif other.name in PASSING and other.get("localId") not in seen:
                    seen.add(other.get("localId"))
                    todo.append(other)
        return list(found)

    def _jumped(self, jump: Element) -> list[str]:
        """The step that a jump names, or those behind the simultaneous divergence of that name."""
        name = jump.get("targetName").upper()
        for element in self.known.values():
            is_target = element.name == "step" or element.name == "simultaneousDivergence" and name
            if is_target and element.get("name").upper() == name:
                return [self._name(element)] if element.name == "step" else self._divided(element)
        raise NotImportable(jump, f"there is no step {jump.get('targetName')} to jump to", "")

    def _divided(self, divergence: Element) -> list[str]:
        """The steps directly behind a simultaneous divergence."""
        return [self._name(other) for other in self.followers.get(divergence.get("localId"), ()) if other.name == "step"]

    def _transition(self, arrow: Arrow, diagram: Diagram) -> list[str]:
        element = arrow.element
        priority = element.get("priority")
        marked = f" (PRIORITY := {priority})" if priority.isdecimal() and whole_number(priority) else ""
        way = f"{marked} FROM {_names(arrow.sources)} TO {_names(arrow.targets)}"
        name, condition, body = self._condition(element, diagram)
        if body:
            return [f"TRANSITION {name}{way}:", *(f"    {line}" for line in body), "END_TRANSITION"]
        return [f"TRANSITION{way} := {condition};", "END_TRANSITION"]

    def _condition(self, element: Element, diagram: Diagram) -> tuple[str, str, list[str]]:
        """The name of a transition, and its condition: an expression, or lines that assign to the name."""
        condition = element.one("condition")
        negated = condition is not None and condition.get("negated") == "true"
        name = self._free(f"T{element.get('localId')}")
        if condition is None:
            raise NotImportable(element, f"transition {element.get('localId')} has no condition", "")
        if (reference := condition.one("reference")) is not None:
            name = reference.get("name").strip()
            body = next((body for known, body in self.pou.transitions if known.upper() == name.upper()), None)
            return self._bodied(name, body, negated) if body else (name, _turned(name, negated), [])
        if (inline := condition.one("inline")) is not None:
            name = inline.get("name") if re.fullmatch(r"[^\W\d]\w*", inline.get("name")) else name
            language = _language(inline)
            if language is None:
                raise NotImportable(inline, "the condition is empty", "")
            return self._bodied(name, Body(language.name, language), negated)
        expression, lines = self.conditions.drawn(name, element, diagram)
        return name, expression, lines

    def _bodied(self, name: str, body: Body, negated: bool) -> tuple[str, str, list[str]]:
        """A condition that has a body: an expression, with or without `:=`, or statements that assign to its name."""
        if body.language == "ST":
            text = squeezed(body.element.text)
            match = _ASSIGNED.fullmatch(text)
            plain = match[2] if match else text.rstrip("; ")
            if ";" not in plain and ":=" not in plain and (not match or not match[1] or match[1].upper() == name.upper()):
                return name, _turned(plain or "TRUE", negated), []
        if body.language in ("LD", "FBD") and (made := self.conditions.named(name, body)):
            return name, _turned(made, negated), []
        lines = self.write(body)
        turned = "NOT" if body.language == "IL" else f"{name} := NOT {name};"
        return name, "", [*lines, turned] if negated else lines


def _language(body: Element) -> Element | None:
    return next((child for child in body.children if child.name not in ("addData", "documentation")), None)


def _turned(expression: str, negated: bool) -> str:
    return f"NOT ({expression})" if negated else expression


def _names(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"({', '.join(names)})"


def _references(element: Element) -> list[str]:
    """The localIds from which wires lead into an element of a chart, not counting the wires of its condition."""
    return [wire.get("refLocalId") for point in element.all("connectionPointIn") for wire in point.all("connection")]


def with_new_names(line: str, renamed: dict[str, str]) -> str:
    """A line in which the flags of steps are read by the new names of their steps."""
    return _FLAG.sub(lambda found: f"{renamed[name]}." if (name := found[1].upper()) in renamed else found[0], line)


def _place(element: Element) -> tuple[float, float]:
    x, y = placed(element)
    return y, x


def _order(arrows: list[Arrow]) -> Callable[[Arrow], tuple[float, tuple[str, ...], float, int]]:
    """The key that sorts transitions from top to bottom, and those that leave one step from left to right: without
    priorities that is the order in which they are tested."""
    top = {tuple(arrow.sources): min(_place(other.element)[0] for other in arrows if other.sources == arrow.sources)
           for arrow in arrows}

    def key(arrow: Arrow) -> tuple[float, tuple[str, ...], float, int]:
        return top[tuple(arrow.sources)], tuple(arrow.sources), _place(arrow.element)[1], arrows.index(arrow)

    return key
