"""Types, values and sections of the tree as elements of PLCopen XML 2.01."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from fbvm.base.diagnostics import Source
from fbvm.base.digits import whole_number
from fbvm.check.declarations.construction import arguments
from fbvm.interchange.markup import Element, element
from fbvm.interchange.plcopen.schema import CODESYS, ELEMENTARY, LOCATION, QUALIFIERS, SECTIONS
from fbvm.interchange.plcopen.texts import squeezed
from fbvm.interchange.plcopen.write.layout import own_data
from fbvm.syntax import tree
from fbvm.syntax.st.comments import SILENT

LONG = {"DATE_AND_TIME": "DT", "TIME_OF_DAY": "TOD"}
UNSIGNED = {"USINT", "UINT", "UDINT", "ULINT", "BYTE", "WORD", "DWORD", "LWORD"}
COUNTED = ("", "_INT", "_DINT", "_LINT", "_UDINT", "_ULINT")
OUTPUTS = {
    **dict.fromkeys(("TON", "TOF", "TP"), frozenset(("Q", "ET"))),
    **dict.fromkeys((f"{name}{kind}" for name in ("CTU", "CTD") for kind in COUNTED), frozenset(("Q", "CV"))),
    **dict.fromkeys((f"CTUD{kind}" for kind in COUNTED), frozenset(("QU", "QD", "CV"))),
    **dict.fromkeys(("R_TRIG", "F_TRIG"), frozenset("Q")), **dict.fromkeys(("SR", "RS"), frozenset(("Q1",))),
    **dict.fromkeys(("PID", "DERIVATIVE"), frozenset(("XOUT",))), "INTEGRAL": frozenset(("Q", "XOUT")),
    "RAMP": frozenset(("BUSY", "XOUT")), "HYSTERESIS": frozenset("Q"), "RTC": frozenset(("Q", "CDT")),
    "SEMA": frozenset(("BUSY",)),
    **dict.fromkeys(("PYTHON_EVAL", "PYTHON_POLL", "PYTHON_GEAR"), frozenset(("ACK", "RESULT"))),
}
"""The outputs of the blocks of the standard, and of those that Beremiz and OpenPLC Editor add."""
LISTS = {word: name for name, word in SECTIONS.items()}
WORDS = {word: name for name, word in QUALIFIERS.items()}
_SIGNS = re.compile(rf"(?s)({SILENT})|[()]")
_NUMBERED = re.compile(r"([TtCc])(\d+)")
_REMARK = re.compile(r"[ \t]*;?[ \t]*//[ \t]*([^\n]*)")


OTHERS = "other tools do not read it"


class NotExportable(Exception):
    """The format has no form for something; the arguments are the node, a message and a hint."""


class Types:
    """Writes types, values and sections of one source; `foreign` grows by (node, message) for what only fbvm understands."""

    def __init__(self, source: Source, taken: Iterable[str] = (), shared: frozenset[str] = frozenset()) -> None:
        """`taken` are the names of types and POUs that there are, `shared` members of several enumerations that
        statements name alone, in capitals."""
        self.source = source
        self.shared = shared
        self.taken = {name.upper() for name in taken}
        self.foreign: list[tuple[tree.Node, str]] = []
        self.kept: list[tuple[int, int]] = []
        """Parts of the text that are exported as they are."""
        self.numbered: dict[str, str] = {}
        """Variable in capitals -> the timer or counter that it is declared AT."""
        self.instances: dict[str, str] = {}
        """Variable of the POU at work, in capitals -> the name of its type."""
        self.outputs: dict[str, frozenset[str]] = dict(OUTPUTS)
        """By the name of a block in capitals, the names of its outputs in capitals."""
        self.owner = ""
        """The declaration at work, whose name those of its own types begin with."""
        self.made: dict[str, Element] = {}
        """By name, the data types that were made of enumerations and subranges in declarations of variables: other tools read
        these only by name."""

    def text(self, node: tree.Node) -> str:
        """The text of a node, with the brackets around parts of it, which the tree does not have."""
        text, start, end = self.source.text, node.start, node.end
        while any(open_ends := _brackets(text[start:end])):
            if open_ends[1]:
                start = text.rindex("(", 0, start)
            else:
                end = text.index(")", end) + 1
        return squeezed(text[start:end])

    def note(self, sections: Iterable[tree.VarSection]) -> None:
        """Note the variables of these sections that are declared AT timers and counters."""
        for variable in (variable for section in sections for variable in section.variables):
            if variable.location is not None and (found := _NUMBERED.fullmatch(variable.location.text.strip())):
                self.numbered |= {name.text.upper(): f"{found[1].upper()}{whole_number(found[2])}" for name in variable.names}

    # --- types ---

    def spec(self, spec: tree.TypeSpec) -> Element:
        """The element of a type.  Raises NotExportable."""
        if isinstance(spec, tree.NamedType):
            name = LONG.get(spec.text.upper(), spec.text.upper())
            return element(name) if name in ELEMENTARY else element("derived", name=spec.text)
        if isinstance(spec, tree.StringSpec):
            length = {"length": self.text(spec.length)} if spec.length is not None else {}
            return element("wstring" if spec.wide else "string", **length)
        if isinstance(spec, tree.SubrangeSpec):
            name = "subrangeUnsigned" if spec.base.text.upper() in UNSIGNED else "subrangeSigned"
            return element(name, element("range", lower=self.text(spec.low), upper=self.text(spec.high)),
                           element("baseType", self.spec(spec.base)))
        if isinstance(spec, tree.ArraySpec):
            return self._array(spec)
        if isinstance(spec, tree.EnumSpec):
            return self._enumeration(spec)
        if isinstance(spec, tree.StructSpec) and not spec.overlap:
            return self._struct(spec)
        if isinstance(spec, tree.RefSpec):
            return self._reference(spec)
        if isinstance(spec, tree.ConstructedSpec) and spec.values is None:
            return self.spec(spec.base)
        raise self._unknown(spec)

    def _enumeration(self, spec: tree.EnumSpec) -> Element:
        if spec.base is not None and self._is_pou(spec.base):
            return self.spec(spec.base)  # `F(x)` is an instance, and x the argument of FB_init
        values = [element("value", name=name.text, **({"value": self.text(value)} if value is not None else {}))
                  for name, value in spec.members]
        return element("enum", element("values", *values), element("baseType", self.spec(spec.base)) if spec.base else None)

    def _unknown(self, spec: tree.TypeSpec) -> NotExportable:
        return NotExportable(spec, f"the format has no type for {self.text(spec).split('(')[0][:40]}", "")

    def _reference(self, spec: tree.RefSpec) -> Element:
        if spec.kind == "POINTER TO":
            return element("pointer", element("baseType", self.spec(spec.target)))
        target = spec.target.base if isinstance(spec.target, tree.ConstructedSpec) else spec.target  # it constructs nothing
        if spec.kind == "REFERENCE TO" and isinstance(target, tree.NamedType):
            self.foreign.append((spec, "REFERENCE TO is written as CODESYS has it, as the name of a type"))
            return element("derived", name=f"REFERENCE TO {target.text}")
        raise self._unknown(spec)

    def _struct(self, spec: tree.StructSpec) -> Element:
        return element("struct", *(made for member in spec.members for made in self.variables(member)))

    def _array(self, spec: tree.ArraySpec) -> Element:
        dimensions = []
        for dimension in spec.dimensions:
            if dimension is None:
                raise NotExportable(spec, "the format has no arrays of any length", "")
            low, high = dimension
            dimensions.append(element("dimension", lower=self.text(low), upper=self.text(high)))
        return element("array", *dimensions, element("baseType", self.spec(spec.element)))

    # --- values ---

    def value(self, value: tree.Initial) -> Element:
        """The element of a value."""
        if isinstance(value, tree.ArrayInit):
            items = []
            for times, inner in value.items:
                repeated = {"repetitionValue": self.text(times)} if times is not None else {}
                if inner is None:
                    raise NotExportable(value, "the format cannot repeat a default value", "")
                items.append(element("value", self.value(inner), **repeated))
            return element("arrayValue", *items)
        if isinstance(value, tree.StructInit):
            return element("structValue", *(element("value", self.value(inner), member=name.text)
                                            for name, inner in value.fields))
        return element("simpleValue", value=self.text(value))

    # --- variables ---

    def variables(self, declared: tree.VarDecl) -> Iterator[Element]:
        """One element for each name of a declaration."""
        if declared.edge:
            raise NotExportable(declared, "the format has no R_EDGE and F_EDGE", "use R_TRIG or F_TRIG")
        kind = self._kind(declared)
        for name in declared.names:
            made = element("variable", element("type", kind), name=name.text)
            if declared.location is not None:
                self._location(made, declared.location)
            if declared.initial is not None:
                made.content.insert(1, element("initialValue", self.value(declared.initial)))
            if given := self._arguments(declared.spec):
                made.content.append(self._assignments(declared.spec, given))
            if remark := _REMARK.match(self.source.text, declared.end):
                made.content.append(documentation(remark[1].strip()))
            yield made

    def _kind(self, declared: tree.VarDecl) -> Element:
        """The element of a variable's type; an enumeration or subrange without a name gets one.  Raises NotExportable for one
        whose members would be those of several types then."""
        if not isinstance(declared.spec, tree.EnumSpec | tree.SubrangeSpec) or self._arguments(declared.spec):
            return self.spec(declared.spec)
        members = declared.spec.members if isinstance(declared.spec, tree.EnumSpec) else ()
        if twice := next((member.text for member, _ in members if member.text.upper() in self.shared), ""):
            what = f"an enumeration without a name is not exported while another one has {twice}, too"
            raise NotExportable(declared.spec, what, f"declare a TYPE, and write its name in front: Kind#{twice}")
        name = stem = f"{self.owner}_{declared.names[0].text}" if self.owner else f"{declared.names[0].text}_type"
        number = 1
        while name.upper() in self.taken:
            number += 1
            name = f"{stem}_{number}"
        self.taken.add(name.upper())
        self.made[name] = element("dataType", element("baseType", self.spec(declared.spec)), name=name)
        return element("derived", name=name)

    def _is_pou(self, named: tree.NamedType) -> bool:
        return named.text.upper() in self.outputs

    def _arguments(self, spec: tree.TypeSpec) -> tuple[tree.Argument, ...]:
        """What a variable gives FB_init, also those of an array."""
        own = spec
        while isinstance(own, tree.ArraySpec):
            own = own.element
        is_instance = isinstance(own, tree.ConstructedSpec) or \
            isinstance(own, tree.EnumSpec) and own.base is not None and self._is_pou(own.base)
        return arguments(own) if is_instance else ()

    def _assignments(self, spec: tree.TypeSpec, given: tuple[tree.Argument, ...]) -> Element:
        """The arguments of FB_init as CODESYS has them."""
        self.foreign.append((spec, "what the variable gives FB_init is kept as CODESYS has it; other tools do not read it"))
        rows = [element("InputAssignment", element("Name", each.name.text) if each.name is not None else None,
                        element("Value", self.text(each.value))) for each in given if each.value is not None]
        return element("addData", element("data", element("InputAssignments", *rows), name=f"{CODESYS}inputassignments",
                                          handleUnknown="implementation"))

    def _location(self, made: Element, location: tree.Location) -> None:
        text = location.text.strip()
        if re.fullmatch(r"%[IQMiqm][XBWDLxbwdl]?[\d.*]*", text):
            made.attributes["address"] = text
            return
        self.foreign.append((location, f"the address {text} is kept as data of this program; other tools place the variable"))
        made.content.append(own_data(LOCATION, text))

    def section(self, section: tree.VarSection, name: str = "") -> Element:
        """The element of a section.  Raises NotExportable."""
        kind = LISTS.get(section.kind)
        if section.kind == "VAR_STAT":
            kind = LISTS["VAR_GLOBAL"]
            self.foreign.append((section, f"VAR_STAT is written as CODESYS and TwinCAT have it; {OTHERS}"))
        if kind is None:
            raise NotExportable(section, f"the format has no {section.kind}", "")
        marks = {}
        for qualifier in section.qualifiers:
            word = qualifier.text.upper()
            if word not in WORDS:
                raise NotExportable(qualifier, f"the format has no {word}", "")
            marks[WORDS[word]] = "true"
        named = {"name": name} if name else {}
        return element(kind, *(made for declared in section.variables for made in self.variables(declared)), **named, **marks)


def _brackets(text: str) -> tuple[int, int]:
    """How many brackets a text opens and does not close, and how many it closes and does not open."""
    opened = closed = 0
    for match in _SIGNS.finditer(text):
        if match[0] == "(":
            opened += 1
        elif match[0] == ")" and opened:
            opened -= 1
        elif match[0] == ")":
            closed += 1
    return opened, closed


def documentation(text: str) -> Element:
    """An element `documentation`."""
    return element("documentation", element("xhtml:p", text))
