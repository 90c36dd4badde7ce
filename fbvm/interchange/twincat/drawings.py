"""Network diagrams and function charts of a POU as rungs and statements, and at which lines of the file they stand.

Variables that they need are declared in the POU.  A method keeps nothing from one call to the next, so an edge in one is refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.check.calls.functions import is_standard
from fbvm.interchange.markup import Element
from fbvm.interchange.plcopen.read.bodies import Bodies
from fbvm.interchange.plcopen.read.document import Body, Document, Pou, Reading, Variable, VarList
from fbvm.interchange.twincat.function_charts import read_function_chart
from fbvm.interchange.twincat.networks import Diagram, Pins, read_networks
from fbvm.syntax import tree
from fbvm.syntax.parser import parse

_READERS = {"NWL": read_networks, "CFC": read_function_chart}
LANGUAGES = {"NWL": "the network diagram", "CFC": "the function chart"}
"""The elements of drawings that are read, and what they are."""
REFERENCE = "[REF]"
"""What stands behind the type of an in-out of a box."""
_AROUND = {"METHOD": ("FUNCTION_BLOCK _\n", "END_METHOD END_FUNCTION_BLOCK"),
           "GET": ("FUNCTION _\n", "END_FUNCTION"), "SET": ("FUNCTION _\n", "END_FUNCTION")}
"""What makes a whole POU of the declaration of a part of one."""


@dataclass(frozen=True)
class Owner:
    """Whose bodies are drawn: the kind and name of the POU, method or accessor, and the text of its declaration."""

    kind: str
    name: str
    declaration: str


class _Reading(Reading):
    """Says what there is to say without the numbers of elements, which are none of the file."""

    def report(self, code: str, at: Element, message: str, hint: str = "") -> None:
        self.diagnostics.append(Diagnostic(code, self.source, at.at, at.at + 1, message, hint))


class Drawings:
    """The drawings of one POU, method or accessor: `bodies` are the elements that hold them."""

    def __init__(self, xml: Source, owner: Owner, bodies: Sequence[Element]) -> None:
        self.owner = owner
        self.reading = _Reading(xml)
        self.diagrams = {id(body): _READERS[body.name](body) for body in bodies}
        pou = _declared(owner)
        known = {name: pins for diagram in self.diagrams.values() if diagram for name, pins in diagram.pins.items()}
        boxes = tuple(_box(pins) for name, pins in known.items() if not is_standard(name) and name != pou.name.upper())
        self.bodies = Bodies(self.reading, Document((), (pou, *boxes), (), ()), pou)
        self.written = {id(body): self._lines(body) for body in bodies}

    @property
    def diagnostics(self) -> list[Diagnostic]:
        return self.reading.diagnostics

    def variables(self) -> list[str]:
        """The sections with the variables that the rungs and statements need, one a line."""
        return [f"{section} {', '.join(names)} : {kind}; END_VAR" for (section, kind), names in self.bodies.scope.made.items()]

    def _lines(self, body: Element) -> list[tuple[int, str]]:
        """The lines of a body, each with the offset in the file at which its network begins."""
        diagram: Diagram | None = self.diagrams[id(body)]
        if diagram is None:
            self.reading.report("X0203", body, f"{LANGUAGES[body.name]} of {self.owner.name} is empty or damaged",
                                "open it in TwinCAT, and save it again")
            return []
        for refusal in diagram.refused:
            at, why = refusal.args
            what = "a network" if body.name == "NWL" else LANGUAGES[body.name]
            self.reading.report("X0203", at, f"{what} of {self.owner.name} is not read: {why}",
                                "export the object as PLCopen XML, and import that, or write it as Structured Text")
        lines = self.bodies.lines(Body(diagram.element.name, diagram.element))
        places = [(index, diagram.starts.get(number, body.at)) for index, number in self.bodies.places]
        made = []
        for index, line in enumerate(lines):
            begun = [start for first, start in places if first <= index]
            made.append((begun[-1] if begun else body.at, line))
        return made


def _declared(owner: Owner) -> Pou:
    """What the declaration of an owner says of its variables."""
    before, behind = _AROUND.get(owner.kind, ("", f"END_{owner.kind}"))
    text = f"{before}{owner.declaration}\n{behind}"
    found = [one for one in parse(Source("", text))[0].everything() if isinstance(one, tree.Pou)]
    pou = found[0] if found else None
    if pou is not None and owner.kind == "METHOD":
        pou = pou.methods[0] if pou.methods else None
    lists = tuple(VarList(section.kind, (), tuple(
        Variable(name.text, text[one.spec.start:one.spec.end], "", one.location.text if one.location else "")
        for one in section.variables for name in one.names)) for section in (pou.sections if pou else ()))
    result = text[pou.result.start:pou.result.end] if pou is not None and pou.result is not None else ""
    kind = owner.kind if owner.kind in ("PROGRAM", "FUNCTION_BLOCK") else "FUNCTION"
    return Pou(kind, owner.name, result, lists, None, (), (), "", Element("POU", "", {}, 0))


def _box(pins: Pins) -> Pou:
    """The declaration that the pins of a box show."""
    inputs = [Variable(name, kind.removesuffix(REFERENCE)) for name, kind in pins.inputs if name]
    outputs = [Variable(name, kind) for name, kind in pins.outputs]
    result = ""
    if not pins.is_block and outputs:
        result, outputs = outputs[0].type, outputs[1:]
    lists = (VarList("VAR_INPUT", (), tuple(inputs)), VarList("VAR_OUTPUT", (), tuple(one for one in outputs if one.name)))
    return Pou("FUNCTION_BLOCK" if pins.is_block else "FUNCTION", pins.name, result, lists, None, (), (), "",
               Element("POU", "", {}, 0))
