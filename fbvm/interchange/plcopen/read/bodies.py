"""Bodies of a document as lines of a source file: ST as it is, ladder as LADDER .. END_LADDER and statements, FBD and CFC as
statements, charts in their textual form."""

from __future__ import annotations

from fbvm.interchange.plcopen.read.accesses import accesses, swapped
from fbvm.interchange.plcopen.read.charts import Chart, NamedAction
from fbvm.interchange.plcopen.read.conditions import NotImportable
from fbvm.interchange.plcopen.read.diagram import Diagram, read_diagram
from fbvm.interchange.plcopen.read.document import Body, Document, Pou, Reading
from fbvm.interchange.plcopen.read.networks import RAILS, Network, networks
from fbvm.interchange.plcopen.read.producer import BY_NUMBER, GENERATED, GIVEN, ORDERS
from fbvm.interchange.plcopen.read.rung_steps import rung_steps
from fbvm.interchange.plcopen.read.scope import Scope
from fbvm.interchange.plcopen.read.sequence import sequence
from fbvm.interchange.plcopen.read.spans import divided
from fbvm.interchange.plcopen.read.statements import Statements
from fbvm.interchange.plcopen.read.values import Unexecutable

NOTE = "//"
LEAVING = ("jump", "label", "return")


class Bodies:
    """Writes the bodies of one POU; `scope.made` grows by the variables that the POU must declare for them."""

    def __init__(self, reading: Reading, document: Document, pou: Pou) -> None:
        self.reading, self.pou = reading, pou
        self.scope = Scope(document, pou)
        self.rungs = 0
        self.actions: list[NamedAction] = []
        """The ACTIONs that charts of the POU need."""
        self.renamed: dict[str, str] = {}
        """By name in capitals, the new names of steps of charts that are written already."""
        self.places: list[tuple[int, int]] = []
        """Of the diagram that was written last, at which line each network begins, and its number."""

    def lines(self, body: Body) -> list[str]:
        """The lines of a body."""
        if body.language in ("ST", "IL"):
            return _text(body.element.text)
        if body.language == "SFC":
            return self._chart(body)
        diagram = read_diagram(self.reading, body.element)
        if len({(item.x, item.y) for item in diagram.objects}) > 1:
            self._lose_places(body)
        if body.language == "CFC" and (leaving := next((item for item in diagram.objects if item.kind in LEAVING), None)):
            self.reading.report("X0203", leaving.element, f"a CFC with <{leaving.kind}> is not taken over",
                                "put the elements that it skips into a block with EN")
            return [f"{NOTE} the CFC was not taken over: it has a {leaving.kind}"]
        return self._diagram(body, diagram)

    def _lose_places(self, body: Body) -> None:
        self.reading.count("positions and sizes of drawings are not taken over", body.element)

    def _chart(self, body: Body) -> list[str]:
        if len({tuple(p.attributes.values()) for child in body.element.children for p in child.all("position")}) > 1:
            self._lose_places(body)
        try:
            chart = Chart(self.reading, self.scope, self.pou, self.lines)
            lines = chart.lines(body.element)
            self.actions += chart.actions
            self.renamed.update(chart.renamed)
            return lines
        except NotImportable as refusal:
            self.reading.report("X0203", *refusal.args)
            return [f"{NOTE} the sequential function chart was not taken over: {refusal.args[1]}"]

    def _diagram(self, body: Body, diagram: Diagram) -> list[str]:
        """A body in LD, FBD or CFC: consecutive rungs stand in one LADDER .. END_LADDER, statements between these."""
        self._check_jumps(diagram)
        self._declare_instances(diagram)
        ours = any(item.mnemonic for item in diagram.objects)
        found = networks(diagram, self.scope, BY_NUMBER) if body.language == "CFC" else self._networks(diagram)
        rungs = [rung_steps(network, self.scope, ours) if body.language == "LD" and not network.broken
                 and not (self.reading.producer.generates and _falls(network)) else None for network in found]
        among = divided(rungs)
        lines: list[str] = []
        in_ladder = False
        statements = Statements(self.reading, self.scope)
        self.places = []
        for place, network in enumerate(found):
            self.places.append((len(lines), network.number))
            rung = self._rung(network, rungs[place])
            if place in among and not network.broken:
                item = network.objects[0]
                self.reading.report("X0202", item.element, "the network cannot be written as a rung, and stands among rungs "
                                    "that belong together, such as those from IL to ILC")
                item.broken = True
            if in_ladder != (rung is not None):
                lines.append("END_LADDER" if in_ladder else "LADDER")
                in_ladder = not in_ladder
            lines += rung if rung is not None else self._written(statements, network)
        return [*lines, "END_LADDER"] if in_ladder else lines

    def _networks(self, diagram: Diagram) -> list[Network]:
        """The networks in the order of the tool that wrote the document; jumps are left out where that tool executes none."""
        producer = self.reading.producer
        if producer.generates:
            for item in diagram.objects:
                if item.kind in LEAVING:
                    self.reading.report("X0292", item.element, f"Beremiz and OpenPLC Editor do not execute <{item.kind}>",
                                        "`--order network` executes it")
            diagram.objects = [item for item in diagram.objects if item.kind not in LEAVING]
            if producer.because != GIVEN:
                self._compare_orders(diagram)
        return networks(diagram, self.scope, producer.order)

    def _compare_orders(self, diagram: Diagram) -> None:
        """Warn if the generators that Beremiz and OpenPLC Editor have had evaluate the diagram with another effect."""
        producer = self.reading.producer
        items = [item for item in diagram.objects if item.kind not in RAILS]
        known = accesses(items, self.scope)
        taken, _ = sequence(items, producer.order)
        for other in GENERATED:
            if other != producer.order and (pair := swapped(taken, sequence(items, other)[0], known)):
                first, second = (f"{item.kind} {item.instance or item.text} ({item.id})" for item in pair)
                self.reading.report("X0292", pair[1].element, f"{first} is evaluated before {second} by the order "
                                    f"{producer.order!r}, which was taken since {producer.because}; by {other!r} it is behind",
                                    f"`--order {other}`, if the PLC is built with {ORDERS[other].partition(':')[0]}")
                return

    def _declare_instances(self, diagram: Diagram) -> None:
        """Declare instances that nothing in a whole project declares, as tools do that keep them with their boxes."""
        if not self.scope.document.configurations or self.scope.is_function:
            return
        for item in diagram.objects:
            if item.kind == "block" and item.instance.isidentifier() and self.scope.is_block(item.text) \
                    and not self.scope.is_taken(item.instance):  # fmt: skip
                self.scope.declare(item.instance, item.text)
                self.reading.report("X0292", item.element, f"nothing declares {item.instance}: it becomes a variable of "
                                    f"{self.pou.name} of the type {item.text}")

    def _check_jumps(self, diagram: Diagram) -> None:
        """Report jumps to labels that do not exist."""
        labels = {item.text.upper() for item in diagram.objects if item.kind == "label"}
        for item in diagram.objects:
            if item.kind == "jump" and item.text.upper() not in labels:
                said = f"there is no label {item.text}" if item.text else "the jump names no label"
                self.reading.report("X0202", item.element, said)
                item.broken = True

    def _rung(self, network: Network, steps: list[str] | None) -> list[str] | None:
        """A rung with its headline and notes."""
        if steps is None:
            return None
        self.rungs += 1
        first, *more = [" ".join(line.split()) for comment in network.comments for line in comment.splitlines()
                        if line.strip()] or [""]
        return [f"RUNG {self.rungs} {first}".rstrip(), *(f"    '{line}" for line in more), *(f"    {step}" for step in steps)]

    def _written(self, statements: Statements, network: Network) -> list[str]:
        """A network as statements, under a comment with its number; one that cannot be executed as a comment."""
        comments = [line.strip() for comment in network.comments for line in comment.splitlines() if line.strip()]
        before = {key: list(names) for key, names in self.scope.made.items()}
        if network.broken:
            return [*(f"{NOTE} {line}" for line in comments), f"{NOTE} network {network.number} was not taken over"]
        try:
            made = statements.write(network)
        except Unexecutable as refusal:
            item, message, hint = refusal.args
            self.reading.report("X0202", item.element, message, hint)
            self.scope.made = before
            made = [f"{NOTE} was not taken over: {message}"]
        if not made:
            return []
        return [f"{NOTE} network {network.number}", *(f"{NOTE} {line}" for line in comments), *made]


def _text(text: str) -> list[str]:
    """The lines of a textual body with their indentation, without empty lines around them."""
    lines = text.expandtabs(4).splitlines()
    while lines and not lines[0].strip():
        lines.pop(0)
    while lines and not lines[-1].strip():
        lines.pop()
    return [line.rstrip() for line in lines]


def _falls(network: Network) -> bool:
    """Whether a network has a falling edge: to Beremiz that is an F_TRIG, whose first call can have an edge, and a rung's has
    none."""
    return any("falling" in (item.edge, *(pin.edge for pin in item.pins)) for item in network.objects)
