"""Conditions of transitions that are drawn.

A block that is wired to a transition, or stands in the diagram of a named transition, is executed in every call of the chart:
in an action that the initial step stores, behind the tests of transitions.  So the timer of a step that is not active is reset,
and a test reads what the call before has left (`PLCGenerator.py` of Beremiz and OpenPLC Editor).  Functions are computed there,
too, in a document of these tools; else they stand in the condition.
"""

from __future__ import annotations

from collections.abc import Iterable

from fbvm.interchange.markup import Element
from fbvm.interchange.plcopen.read.diagram import Diagram, Object, read_diagram
from fbvm.interchange.plcopen.read.document import Body, Reading
from fbvm.interchange.plcopen.read.networks import Network, networks
from fbvm.interchange.plcopen.read.scope import Scope
from fbvm.interchange.plcopen.read.statements import Statements
from fbvm.interchange.plcopen.read.values import Unexecutable

_WRITING = ("coil", "outVariable", "inOutVariable", "block")
"""Kinds of objects that change something beside the condition of a transition."""


class NotImportable(Exception):
    """The chart cannot be taken over; the arguments are an element, a message and a hint."""


class Conditions:
    """Writes the drawn conditions of one chart.  `statements` grows by those that are executed in every call."""

    def __init__(self, reading: Reading, scope: Scope) -> None:
        self.reading, self.scope = reading, scope
        self.statements: list[str] = []
        self._known: dict[str, str] = {}
        """By localId of a transition, its condition, where that needs statements."""

    def compute(self, diagram: Diagram) -> None:
        """Write the statements that conditions of transitions need; a block that several need is called once.  Raises
        NotImportable."""
        conditions = [item for item in diagram.objects if item.kind == "condition" and self._needs_statements(item)]
        if conditions:
            made = self._written(conditions, self.statements, apart=True)
            self._known.update((item.id, made[item]) for item in conditions)

    def drawn(self, name: str, element: Element, diagram: Diagram) -> tuple[str, list[str]]:
        """The condition that is wired to a transition: an expression, or lines that assign to `name`.  Raises NotImportable."""
        number = element.get("localId")
        if number in self._known:
            return self._known[number], []
        condition = next((item for item in diagram.objects if item.kind == "condition" and item.id == number), None)
        if condition is None or not condition.inputs[0].connected:
            raise NotImportable(element, f"transition {number} has no condition", "")
        lines: list[str] = []
        expression = self._written([condition], lines, apart=False)[condition]
        return (expression, []) if not lines else ("", [*lines, f"{name} := {expression};"])

    def named(self, name: str, body: Body) -> str:
        """The condition in the diagram of the transition `name`, if that needs statements; else "".  Raises NotImportable."""
        diagram = read_diagram(Reading(self.reading.source, self.reading.producer), body.element)
        sinks = [item for item in diagram.objects if item.kind in ("coil", "outVariable") and item.text.upper() == name.upper()]
        if len(sinks) != 1 or not self._needs_statements(sinks[0]):
            return ""
        fed = set(feeding(sinks))
        for item in diagram.objects:
            if item.kind in _WRITING and item not in fed:
                self.reading.report("X0203", item.element, f"{item.text or item.kind} does not belong to the condition of "
                                    f"transition {name}, and is not taken over")
        sinks[0].kind = "condition"
        return self._written(sinks, self.statements, apart=True)[sinks[0]]

    def _needs_statements(self, condition: Object) -> bool:
        """Whether a condition needs calls or the memory of an edge."""
        generates = self.reading.producer.generates
        return any(item.edge or any(pin.edge for pin in item.pins) or (item.kind == "block" and (generates or item.instance))
                   for item in feeding([condition]))

    def _written(self, conditions: list[Object], lines: list[str], apart: bool) -> dict[Object, str]:
        """The expressions of conditions; `lines` grows by the statements that they need."""
        items = feeding(conditions)
        if broken := next((item for item in items if item.broken), None):
            raise NotImportable(broken.element, f"{broken.text or broken.kind} in a condition was not understood", "")
        parts = networks(Diagram(items, []), self.scope, self.reading.producer.order)
        network = Network([item for part in parts for item in part.objects], {wire for part in parts for wire in part.cut},
                          rereads=any(part.rereads for part in parts))
        try:
            made, expressions = Statements(self.reading, self.scope).conditions(network, apart)
        except Unexecutable as refusal:
            item, message, hint = refusal.args
            raise NotImportable(item.element, message, hint) from None
        lines += made
        return expressions


def feeding(sinks: Iterable[Object]) -> list[Object]:
    """Some objects and all that feeds them, in the order of writing."""
    found = dict.fromkeys(sinks)
    todo = list(found)
    while todo:
        for pin in todo.pop().pins:
            for wire in pin.wires:
                if wire.source not in found:
                    found[wire.source] = None
                    todo.append(wire.source)
    return sorted(found, key=lambda item: item.place)
