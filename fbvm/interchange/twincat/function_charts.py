"""Continuous function charts (CFC) of TwinCAT's files as the elements of PLCopen XML that say the same.

    CFCInputElement      Text, and an Output pin
    CFCOutputElement     Text, and an Input pin
    CFCBoxElement        KindOfCall; pins in Inputs and Outputs; Texts: the names of both, then type and instance
    CFCConnection        SourcePinId, DestPinId
    CFCCommentElement    nothing that is executed

What is executed comes in the order of the list (in 1,241 of 1,259 wires between boxes of public files the source stands first).
Files of later versions, whose boxes can begin a feedback, may have another order: they are read if all wires lead forwards.
"""

from __future__ import annotations

from fbvm.interchange.markup import Element
from fbvm.interchange.twincat.archive import is_true, listed, member, text
from fbvm.interchange.twincat.networks import Diagram, Unreadable, expression, pin_named, pins_of

ROOT = "CFCImplementationObject"
_CALLS = ("functionblock", "operator", "function", "program")


def read_function_chart(body: Element) -> Diagram | None:
    """The chart in an element CFC; None if there is none in it.  A chart is read as a whole or not at all."""
    root = next((one for one in body.walk() if one.name == "o" and one.get("t") == ROOT), None)
    if root is None:
        return None
    made = Diagram(Element("CFC", "", {}, body.at), {}, {}, [])
    chart = _Chart()
    try:
        chart.read(_entries(root, "Items"))
        made.element.content += chart.elements
    except Unreadable as refusal:
        made.refused.append(refusal)
    return made


def _entries(of: Element, name: str) -> list[tuple[str, Element]]:
    held = member(of, name)
    return listed(held, "InnerList") if held is not None else []


class _Chart:
    """Reads one chart: `elements` grows in the order of execution."""

    def __init__(self) -> None:
        self.elements: list[Element] = []
        self.sources: dict[str, str] = {}
        """By the Id of a pin that of the pin that leads to it."""
        self.operands: dict[str, Element] = {}
        """By the Id of its output each input element."""
        self.outputs: dict[str, tuple[int, str]] = {}
        """By the Id of an output of a box the place of the box, and the name of the output."""

    def read(self, entries: list[tuple[str, Element]]) -> None:
        """The elements of a chart.  Raises Unreadable."""
        executed = []
        for kind, entry in entries:
            if kind == "CFCConnection":
                self._connect(entry)
            elif kind == "CFCInputElement":
                self.operands[_id(_one_pin(entry, "Output"))] = entry
            elif kind in ("CFCBoxElement", "CFCOutputElement"):
                executed.append((kind, entry))
            elif kind != "CFCCommentElement":
                raise Unreadable(entry, f"nobody knows what {kind or 'a part without a type'} does")
        for place, (kind, entry) in enumerate(executed, 1):
            for pin, name in _named(entry, "Outputs") if kind == "CFCBoxElement" else []:
                self.outputs[_id(pin)] = (place, name)
        for place, (kind, entry) in enumerate(executed, 1):
            (self._box if kind == "CFCBoxElement" else self._output)(place, entry)

    def _connect(self, entry: Element) -> None:
        begins, ends = text(entry, "SourcePinId"), text(entry, "DestPinId")
        if self.sources.setdefault(ends, begins) != begins:
            raise Unreadable(entry, "two wires end at one pin")

    def _output(self, place: int, entry: Element) -> None:
        pin = _one_pin(entry, "Input")
        point, negated = self._point(pin, place, entry)
        if point is None:
            raise Unreadable(entry, f"nothing is wired to {_text(entry)}")
        self.elements.append(Element("outVariable", "", {**_numbered(place), **_negated(negated)}, entry.at,
                                     [point, expression(_text(entry), entry)]))

    def _box(self, place: int, entry: Element) -> None:
        texts = [text(one, "Text").strip() for _, one in _entries(entry, "Texts")]
        inputs, outputs = _entries(entry, "Inputs"), _entries(entry, "Outputs")
        if len(texts) != len(inputs) + len(outputs) + 2:
            raise Unreadable(entry, "the names of the pins of a box are not all there")
        kind, instance = texts[-2:]
        self._check(entry, kind, instance)
        pins = []
        for number, (pin, name) in enumerate(_named(entry, "Inputs"), 1):
            point, negated = self._point(pin, place, entry)
            pins.append(pin_named(entry, name or f"IN{number}", _negated(negated)))
            pins[-1].content += [point] if point is not None else []
        shown = [pin_named(entry, name, _negated(is_true(pin, "Negated"))) for pin, name in _named(entry, "Outputs")]
        called = {"instanceName": instance} if instance else {}
        self.elements.append(Element("block", "", {**_numbered(place), "typeName": kind, **called}, entry.at,
                                     [pins_of("inputVariables", entry, pins), pins_of("outputVariables", entry, shown)]))

    def _check(self, entry: Element, kind: str, instance: str) -> None:
        """Raises Unreadable for a box with something that is not known."""
        called = text(entry, "KindOfCall").lower()
        if called not in _CALLS:
            raise Unreadable(entry, f"nobody knows what a box {kind} of the kind {called or 'that it does not tell'} does")
        if (called == "functionblock") != bool(instance):
            raise Unreadable(entry, f"the box {kind} has no instance" if not instance else f"the box {kind} has one too many")
        if is_true(entry, "EnEno"):
            raise Unreadable(entry, f"the box {kind} has EN")
        if any(member(one, "Value") is not None for _, one in _entries(entry, "Parameters")):
            raise Unreadable(entry, f"the box {kind} has parameters")

    def _point(self, pin: Element, place: int, of: Element) -> tuple[Element | None, bool]:
        """The point at a pin and whether its value is negated; no point if nothing is wired to it."""
        if text(pin, "SetReset") not in ("", "None") or text(pin, "SetResetRef") not in ("", "None") or \
                is_true(pin, "PretendsToBeConnected"):
            raise Unreadable(of, "a pin has something that is not known")
        negated, source = is_true(pin, "Negated"), self.sources.get(_id(pin))
        if source is None:
            return None, negated
        if (operand := self.operands.get(source)) is not None:
            inverse = is_true(_one_pin(operand, "Output"), "Negated")
            return Element("connectionPointIn", "", {}, of.at, [expression(_text(operand), of)]), negated != inverse
        if source not in self.outputs:
            raise Unreadable(of, "a wire begins nowhere")
        box, name = self.outputs[source]
        if box >= place and member(of, "IsFeedbackStart") is not None:
            raise Unreadable(of, "the order in which it is executed is not told")
        wire = Element("connection", "", {"refLocalId": str(box), "formalParameter": name}, of.at)
        return Element("connectionPointIn", "", {}, of.at, [wire]), negated


def _named(box: Element, name: str) -> list[tuple[Element, str]]:
    """The inputs or the outputs of a box with their names."""
    texts = [text(one, "Text").strip() for _, one in _entries(box, "Texts")]
    before = len(_entries(box, "Inputs")) if name == "Outputs" else 0
    return [(pin, texts[before + at] if before + at < len(texts) else "") for at, (_, pin) in enumerate(_entries(box, name))]


def _one_pin(of: Element, name: str) -> Element:
    found = member(of, name)
    if found is None:
        raise Unreadable(of, "a pin is missing")
    return found


def _id(pin: Element) -> str:
    return text(pin, "Id")


def _text(of: Element) -> str:
    """The name or expression at an element.  Raises Unreadable if it is missing."""
    held = member(of, "Text")
    written = text(held, "Text").strip() if held is not None else ""
    if written in ("", "???"):
        raise Unreadable(of, "an operand is missing")
    return written


def _numbered(place: int) -> dict[str, str]:
    return {"localId": str(place), "executionOrderId": str(place)}


def _negated(is_negated: bool) -> dict[str, str]:
    return {"negated": "true"} if is_negated else {}
