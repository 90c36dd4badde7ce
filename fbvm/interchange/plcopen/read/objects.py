"""Object-oriented parts of a document, which CODESYS keeps in `addData`: methods, properties, interfaces, inheritance.

    pou/addData/data[name=.../method]/Method            interface, body, addData
    pou/addData/data[name=.../property]/Property        interface with the type, GetAccessor, SetAccessor
    interface/addData/data[name=.../pouinheritance]     Inheritance/Extends, Implements
    .../addData/data[name=.../accessmodifiers]          AccessModifiers, with attributes or elements that name them
    .../addData/data[name=.../attributes]               Attributes/Attribute with Name and Value
    variable/addData/data[name=.../inputassignments]    InputAssignments/InputAssignment/[Name,] Value, for FB_init
    project/addData/data[name=.../interface]/Interface  Methods/Method, Properties/Property, Inheritance, addData

Source: exports of CODESYS V3 and TwinCAT 3.1.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

from fbvm.base.diagnostics import Source
from fbvm.interchange.markup import Element
from fbvm.interchange.plcopen.read.document import Head, Variable, VarList
from fbvm.interchange.plcopen.schema import SECTIONS
from fbvm.syntax import tree
from fbvm.syntax.parser import parse

INTERFACE, METHOD, PROPERTY = "Interface", "Method", "Property"
ACCESSORS = {"GetAccessor": "GET", "SetAccessor": "SET", "Get": "GET", "Set": "SET"}
_KIND = re.compile(r"(?im)^[ \t]*(FUNCTION_BLOCK|FUNCTION|PROGRAM|METHOD)\b")
_OWN_SECTIONS = ("VAR_STAT", "VAR_INST")
"""Sections that the format does not have."""
_WORDS = ("PUBLIC", "PRIVATE", "PROTECTED", "INTERNAL", "ABSTRACT", "FINAL", "OVERRIDE")


def added(element: Element | None) -> list[Element]:
    """The `data` below `addData` of an element."""
    holder = element.one("addData") if element is not None else None
    return holder.all("data") if holder is not None else []


def last_word(data: Element) -> str:
    """The last word of the name of a `data`, in small letters."""
    return data.get("name").rstrip("/").rpartition("/")[2].lower()


def members(element: Element) -> Iterator[Element]:
    """The methods and properties of a POU or an interface."""
    for data in added(element):
        if last_word(data) in ("method", "property"):
            yield from data.all(METHOD, PROPERTY)
    for holder in element.all("Methods", "Properties"):
        yield from holder.all(METHOD, PROPERTY)


def accessors(element: Element) -> Iterator[tuple[str, Element]]:
    """The accessors of a property: GET or SET, and the element."""
    for child in element.children:
        if child.name in ACCESSORS:
            yield ACCESSORS[child.name], child


def property_type(element: Element) -> Element | None:
    """The element that holds the type of a property."""
    interface = element.one("interface")
    within = interface.one("returnType") if interface is not None else None
    return within or element.one("type") or element.one("Type") or element.one("returnType")


def head(element: Element) -> Head:
    """What `addData` of a POU, method or property, and of its interface, says of its head."""
    words: list[str] = []
    extends: list[str] = []
    implements: list[str] = []
    pragmas: list[str] = []
    for own in element.all("Inheritance"):  # INTERFACEs have it without addData
        extends += _names(own, "Extends")
        implements += _names(own, "Implements")
    for data in (*added(element.one("interface")), *added(element)):
        word = last_word(data)
        for inner in data.children:
            if word == "accessmodifiers":
                words += _access(inner)
            elif word in ("pouinheritance", "inheritance", "datatypeinheritance"):
                extends += _names(inner, "Extends")
                implements += _names(inner, "Implements")
            elif word == "attributes":
                pragmas += _pragmas(inner)
    return Head(*(tuple(dict.fromkeys(each)) for each in (words, extends, implements, pragmas)))


def arguments(element: Element) -> str:
    """The arguments of FB_init that a variable gives, as they stand behind its type; "" if it gives none."""
    rows = [(row.one("Name"), row.one("Value")) for data in added(element) if last_word(data) == "inputassignments"
            for row in data.walk() if row.name == "InputAssignment"]
    given = [f"{name.text.strip()} := {value.text.strip()}" if name is not None else value.text.strip()
             for name, value in rows if value is not None]
    return f"({', '.join(given)})" if given else ""


def left_out(element: Element, lists: Iterable[VarList]) -> tuple[VarList, ...]:
    """What the declaration of a POU or a method as plain text has beyond its lists, such as variables of types that the format
    cannot say, and VAR_INST.  Each variable comes once, though a document may repeat the text."""
    known = {variable.name.upper() for listed in lists for variable in listed.variables}
    found: list[VarList] = []
    for source in _declarations(element):
        for section in _sections(source):
            missing = tuple(_as_written(source, variable, name) for variable in section.variables for name in variable.names
                            if name.text.upper() not in known)
            if missing and section.kind in (*SECTIONS.values(), *_OWN_SECTIONS):
                found.append(VarList(section.kind, tuple(word.text.upper() for word in section.qualifiers), missing))
                known.update(variable.name.upper() for variable in missing)
    return tuple(found)


def _declarations(element: Element) -> Iterator[Source]:
    """The declaration of a POU or a method as plain text, as something that can be read: CODESYS keeps it at the interface or at
    one of its lists, TwinCAT at the POU, both at a method."""
    interface = element.one("interface")
    holders = [element, interface, *(interface.children if interface is not None else ())]
    texts = [part.text.strip() for part in element.all("InterfaceAsPlainText")]
    texts += [data.text.strip() for holder in holders for data in added(holder) if last_word(data) == "interfaceasplaintext"]
    for text in dict.fromkeys(texts):
        if kind := _KIND.search(text):
            text = f"{text}\nEND_{kind[1].upper()}\n"
            yield Source("", f"FUNCTION_BLOCK Owner\n{text}END_FUNCTION_BLOCK\n" if kind[1].upper() == "METHOD" else text)


def _sections(source: Source) -> Iterator[tree.VarSection]:
    for pou in parse(source)[0].everything():
        if isinstance(pou, tree.Pou):
            yield from pou.sections
            yield from (section for method in pou.methods for section in method.sections)


def _as_written(source: Source, declared: tree.VarDecl, name: tree.Name) -> Variable:
    """A variable with the texts of its type, first value and address."""
    kind, first, place = ("" if node is None else source.text[node.start:node.end]
                          for node in (declared.spec, declared.initial, declared.location))
    return Variable(name.text, kind, first, place)


def _access(element: Element) -> list[str]:
    said = [name.upper() for name, value in element.attributes.items() if value.strip().lower() in ("true", "1")]
    said += [child.name.upper() for child in element.children if child.text.strip().lower() in ("", "true", "1")]
    return [word for word in _WORDS if word in said]


def _names(element: Element, what: str) -> list[str]:
    return [name.strip() for child in element.all(what) for name in child.text.split(",") if name.strip()]


def _pragmas(element: Element) -> Iterator[str]:
    for attribute in element.all("Attribute"):
        value = attribute.get("Value")
        name = attribute.get("Name").replace("'", "").replace("}", "")
        yield f"{{attribute '{name}' := '{value}'}}" if value and not set(value) & set("'}\n\r") else f"{{attribute '{name}'}}"
