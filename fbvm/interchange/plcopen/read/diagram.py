"""The elements of a graphical body (LD, FBD) and the wires between them, as one flat list: the schema knows no networks.

A wire is stored at its consumer.  Connectors and continuations are replaced by wires; a coil passes on the power that
reaches it, so a wire from a coil becomes a wire from what feeds the coil.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, isfinite
from typing import NamedTuple

from fbvm.base.digits import whole_number
from fbvm.interchange.markup import Element
from fbvm.interchange.plcopen.read.document import Reading
from fbvm.interchange.plcopen.read.types import own_text
from fbvm.interchange.plcopen.schema import MNEMONIC

OBJECTS = {"leftPowerRail", "rightPowerRail", "contact", "coil", "block", "inVariable", "outVariable", "inOutVariable",
           "label", "jump", "return"}
"""Elements that can be executed, or carry power."""
SFC_OBJECTS = {"step", "macroStep", "jumpStep", "transition", "selectionDivergence", "selectionConvergence",
               "simultaneousDivergence", "simultaneousConvergence", "actionBlock"}
NAMELESS = ("", "none")
"""Names that stand for a pin without a name (CODESYS exporters)."""


class Wire(NamedTuple):
    """Where a value comes from: an object and the name of its pin, "" for its only one."""

    source: Object
    pin: str


@dataclass(eq=False)
class Pin:
    """A place at an object where wires end or begin; `expression` is an operand that was typed there."""

    name: str
    negated: bool = False
    edge: str = ""
    storage: str = ""
    wires: list[Wire] = field(default_factory=list)
    expression: str = ""
    raw: list[tuple[str, str, Element]] = field(default_factory=list)
    """References as they were written: localId, pin, and the element that says so."""

    @property
    def connected(self) -> bool:
        return bool(self.wires or self.expression)


@dataclass(eq=False)
class Object:
    """An element of a diagram.  `text` is its variable, expression, label, name or type; `order` its executionOrderId, 0 if
    none; `inputs` and `outputs` its pins, `in_outs` those that are both."""

    kind: str
    id: str
    place: int
    x: float
    y: float
    order: int
    text: str
    element: Element
    instance: str = ""
    negated: bool = False
    edge: str = ""
    storage: str = ""
    inputs: list[Pin] = field(default_factory=list)
    in_outs: list[Pin] = field(default_factory=list)
    outputs: list[Pin] = field(default_factory=list)
    mnemonic: str = ""
    """The mnemonic of the ladder instruction, if fbvm has drawn the block."""
    code: str = ""
    """The statements inside of a block EXECUTE (CODESYS)."""
    broken: bool = False
    """Whether something about it was not understood, and has a diagnostic."""

    @property
    def pins(self) -> list[Pin]:
        """The pins at which wires end."""
        return [*self.inputs, *self.in_outs]

    def pin(self, name: str) -> Pin | None:
        """The input of a block of that name."""
        return next((pin for pin in self.inputs if pin.name.upper() == name.upper()), None)


@dataclass
class Diagram:
    """The objects of one body in the order of writing, and its comments; titles, which are boxes without wires, are comments."""

    objects: list[Object]
    comments: list[Object]


def read_diagram(reading: Reading, body: Element, chart: bool = False) -> Diagram:
    """The diagram in an element LD or FBD; what cannot be understood is reported.

    With `chart`, `body` is an element SFC: steps and the like are left out, and an object of kind "condition" stands for
    each transition whose condition is drawn."""
    return _DiagramReader(reading, body, chart).diagram()


class _DiagramReader:
    """Reads one body: first its elements, then the wires between them."""

    def __init__(self, reading: Reading, body: Element, chart: bool) -> None:
        self.reading, self.body, self.chart = reading, body, chart
        self.objects: list[Object] = []
        self.comments: list[Object] = []
        self.known: dict[str, Object] = {}
        """Objects by localId."""
        self.connectors: dict[str, Object] = {}
        """Connectors by name in capitals."""

    def diagram(self) -> Diagram:
        for place, element in enumerate(self.body.children):
            if element.name not in ("addData", "documentation") and not _is_settings(element):
                self._add(element, place)
        for item in self.objects:
            for pin in item.pins:
                self._leave_out_loose(item, pin)
                for number, name, at in pin.raw:
                    item.broken |= not self._connect(pin, number, name, at)
        used = {wire.source for item in self.objects for pin in item.pins for wire in pin.wires}
        titles = [item for item in self.objects
                  if item.kind == "vendorElement" and item not in used and not item.inputs[0].raw]
        kept = [item for item in self.objects if item.kind not in ("connector", "continuation") and item not in titles]
        for item in kept:
            for pin in item.pins:
                pin.wires = _followed(pin.wires)
        return Diagram(kept, self.comments + titles)

    def _add(self, element: Element, place: int) -> None:
        """Add the object of an element; `place` is the number of the element in the body."""
        made = _object(self.reading, element, place)
        if made.kind == "comment":
            self.comments.append(made)
        elif self.chart and element.name in SFC_OBJECTS:
            self.objects += _conditions(element, place)
        else:
            if element.name in SFC_OBJECTS:
                made.broken = True
                self.reading.report("X0202", element, f"{element.name} stands in a body of {self.body.name}")
            self.objects += [made, *_typed_outputs(made)]
            self._register(made)

    def _register(self, made: Object) -> None:
        """Note an object by its localId, a connector also by its name."""
        if not made.id.isdecimal():
            if made.element.name != "vendorElement":
                made.broken = True
                self.reading.report("X0105", made.element, f"<{made.element.name}> has no number as its localId")
        elif made.id in self.known:
            made.broken = self.known[made.id].broken = True
            self.reading.report("X0105", made.element, f"localId {made.id} is there twice",
                                "each element of a body has a number of its own")
        self.known.setdefault(made.id, made)
        if made.kind == "connector" and made.text:  # one without a name is a bend in a wire (CFC)
            other = self.connectors.setdefault(made.text.upper(), made)
            if other is not made:
                made.broken = other.broken = True
                self.reading.report("X0202", made.element, f"there are two connectors {made.text}")

    def _leave_out_loose(self, item: Object, pin: Pin) -> None:
        """Leave out wires that come from nothing, where the generator does: it refuses only a contact without another wire."""
        loose = [row for row in pin.raw if row[0] not in self.known]
        if not loose or not self.reading.producer.generates or item.kind == "contact" and len(loose) == len(pin.raw):
            return
        for number, _, at in loose:
            self.reading.report("X0292", at, f"a wire comes from element {number!r}, which there is not: Beremiz and OpenPLC "
                                "Editor leave it out", "draw the wire once more")
        pin.raw = [row for row in pin.raw if row[0] in self.known]

    def _connect(self, pin: Pin, number: str, name: str, at: Element) -> bool:
        """Add the wire from output `name` of element `number` to a pin; whether there is such an output."""
        source = self.known.get(number)
        if source is None:
            self.reading.report("X0201", at, f"a wire comes from element {number!r}, which there is not",
                                "draw the wire once more")
            return False
        if source.kind == "continuation":
            joined = self.connectors.get(source.text.upper())
            if joined is None:
                self.reading.report("X0201", source.element, f"there is no connector {source.text}")
                return False
            if joined.broken:  # of two of one name nobody knows which is meant
                return False
            source = joined
        elif source.kind == "block":
            found = self._output(source, name, at)
            if found is None:
                return False
            name = found
        pin.wires.append(Wire(source, name if source.kind == "block" else ""))
        return True

    def _output(self, block: Object, name: str, at: Element) -> str | None:
        """The output of a block that a wire names; its first one but ENO if the wire names none; None if there is no such
        output, which is reported."""
        outputs = [*block.outputs, *block.in_outs]
        if not name:
            named = [pin for pin in outputs if pin.name.upper() != "ENO"]
            return (named or outputs)[0].name if outputs else ""
        if any(output.name.upper() == name.upper() for output in outputs):
            return name
        has = ", ".join(output.name for output in outputs if output.name) or "none"
        self.reading.report("X0201", at, f"a wire comes from output {name} of {block.text}, which there is not",
                            f"its outputs are {has}")
        return None


def _is_settings(element: Element) -> bool:
    """Whether an element is a box of CODESYS or TwinCAT with settings of the editor, which stands in front of an FBD."""
    return element.name == "vendorElement" and any(
        inner.name == "data" and inner.get("name").endswith("/implementationattributes") for inner in element.walk())


def _followed(wires: list[Wire]) -> list[Wire]:
    """The wires, each once, with the wires into a connector or a coil in place of a wire that comes from it."""
    found: dict[Wire, None] = {}
    seen: set[Object] = set()
    todo = wires[::-1]
    while todo:
        wire = todo.pop()
        if wire.source.kind not in ("connector", "coil"):
            found[wire] = None
        elif wire.source not in seen:
            seen.add(wire.source)
            todo += [inner for pin in wire.source.inputs for inner in pin.wires[::-1]]
    return list(found)


def _conditions(element: Element, place: int) -> list[Object]:
    """The object with the condition of a transition as its input; none if the condition is not drawn."""
    condition = element.one("condition")
    points = condition.all("connectionPointIn") if condition else []
    if not points:
        return []
    negated = condition is not None and _true(condition, "negated")
    made = Object("condition", element.get("localId"), place, inf, inf, 0, "", element, negated=negated, inputs=[Pin("")])
    for point in points:
        _wire_in(made.inputs[0], point)
    return [made]


# --- one element ------------------------------------------------------------------------------------------------------


def placed(element: Element) -> tuple[float, float]:
    """The x and y at which an element is drawn; 0 for a coordinate that is no number."""
    position = element.one("position")
    return (_number(position.get("x")), _number(position.get("y"))) if position else (0.0, 0.0)


def _number(text: str) -> float:
    try:
        return number if isfinite(number := float(text)) else 0.0
    except ValueError:
        return 0.0


def _object(reading: Reading, element: Element, place: int) -> Object:
    x, y = placed(element)
    order = element.get("executionOrderId") or element.get("executionId")  # the name in TC6 1.x
    made = Object(element.name, element.get("localId"), place, x, y, whole_number(order) if order.isdecimal() else 0,
                  _text(element), element, element.get("instanceName").strip(), _true(element, "negated"), _word(element, "edge"),
                  _word(element, "storage"))
    if element.name == "block":
        if not made.text:
            made.broken = True
            reading.report("X0105", element, "<block> has no typeName")
        holders = {"inputVariables": made.inputs, "inOutVariables": made.in_outs, "outputVariables": made.outputs}
        for holder, pins in holders.items():
            for variable in (v for found in element.all(holder) for v in found.all("variable")):
                pins.append(_pin(variable, variable.one("connectionPointIn"), pin_name(variable.get("formalParameter"))))
        _merge_in_outs(made)
        made.mnemonic = own_text(element, MNEMONIC)
        made.code = _code(element)
    elif element.name == "inOutVariable":
        made.inputs = [Pin("", _true(element, "negatedIn"), _word(element, "edgeIn"), _word(element, "storageIn"))]
        _wire_in(made.inputs[0], element.one("connectionPointIn"))
        made.negated, made.edge = _true(element, "negatedOut"), _word(element, "edgeOut")
    elif element.name in ("coil", "outVariable", "contact", "jump", "return", "connector", "rightPowerRail", "vendorElement"):
        made.inputs = [Pin("")]
        for point in element.walk():
            if point.name == "connectionPointIn":
                _wire_in(made.inputs[0], point)
    elif element.name not in (*OBJECTS, "continuation", "comment", "error"):
        made.inputs = [Pin("")]
        for point in element.all("connectionPointIn"):
            _wire_in(made.inputs[0], point)
    return made


def _typed_outputs(block: Object) -> list[Object]:
    """Output variables for the operands that are typed at outputs of a block (CODESYS)."""
    made = []
    for element in block.element.walk():
        point = element.one("connectionPointOut") if element.name == "variable" else None
        typed = point.one("expression") if point is not None and block.kind == "block" else None
        if typed is not None and typed.text.strip():
            pin = Pin("", raw=[(block.id, pin_name(element.get("formalParameter")), element)])
            made.append(Object("outVariable", block.id, block.place, block.x, block.y, block.order, typed.text.strip(), element,
                               inputs=[pin]))
    return made


def _code(element: Element) -> str:
    """The statements that a block EXECUTE of CODESYS keeps in `addData`; "" for another block."""
    found = [inner for inner in element.walk() if inner.name == "STCode"]
    return found[0].text.expandtabs(4).strip("\r\n").rstrip() if found else ""


def _text(element: Element) -> str:
    """The variable, expression, label, name or text of an element."""
    attribute = {"block": "typeName", "label": "label", "jump": "label", "connector": "name", "continuation": "name"}
    if element.name in attribute:
        return element.get(attribute[element.name]).strip()
    inner = element.one({"contact": "variable", "coil": "variable", "comment": "content", "vendorElement": "alternativeText",
                         "error": "content"}.get(element.name, "expression"))
    text = inner.text.strip() if inner else ""
    return text.rstrip("; \t\r\n") if element.name in ("inVariable", "contact") else text  # CODESYS lets a condition end so


def _merge_in_outs(made: Object) -> None:
    """Make in-outs of pairs of an input and an output of one name, as Beremiz before 2.01 writes in-outs."""
    outputs = {pin.name.upper(): pin for pin in made.outputs}
    for pin in [pin for pin in made.inputs if pin.name and pin.name.upper() in outputs]:
        made.inputs.remove(pin)
        made.outputs.remove(outputs[pin.name.upper()])
        made.in_outs.append(pin)


def pin_name(text: str) -> str:
    """The name of a pin, "" for those that have none."""
    return "" if text.strip().lower() in NAMELESS else text.strip()


def _pin(element: Element, point: Element | None, name: str) -> Pin:
    pin = Pin(name, _true(element, "negated"), _word(element, "edge"), _word(element, "storage"))
    _wire_in(pin, point)
    return pin


def _wire_in(pin: Pin, point: Element | None) -> None:
    """Note the wires, or the typed operand, of a connectionPointIn."""
    if point is None:
        return
    for connection in point.all("connection"):
        pin.raw.append((connection.get("refLocalId"), pin_name(connection.get("formalParameter")), connection))
    if (typed := point.one("expression")) and typed.text.strip():
        pin.expression = typed.text.strip()


def _true(element: Element, name: str) -> bool:
    return element.get(name).lower() in ("true", "1")


def _word(element: Element, name: str) -> str:
    """An enumerated attribute; "none" is the same as nothing."""
    word = element.get(name).lower()
    return "" if word == "none" else word
