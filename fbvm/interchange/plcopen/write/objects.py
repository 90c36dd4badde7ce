"""Objects as CODESYS keeps them in `addData`: methods, properties, interfaces, inheritance, words of heads, attributes.

The shapes are those that `plcopen/read/objects.py` lists.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence

from fbvm.interchange.markup import Element, element
from fbvm.interchange.plcopen.schema import CODESYS
from fbvm.interchange.plcopen.write.types import OTHERS, NotExportable, Types
from fbvm.syntax import tree

Span = tuple[int, int]
"""The offsets between which something stands in the text."""
BodyWriter = Callable[[tree.Pou, int, int], Element]
"""Writes the element of the body of a method that stands between two offsets."""
ACCESSORS = {"GET": "GetAccessor", "SET": "SetAccessor"}
HINT = "put what other tools are to read into function blocks and functions without objects"
END = re.compile(r"(?i)END_(?:FUNCTION_?BLOCK|FUNCTION|PROGRAM|ACTION|METHOD|GET|SET|PROPERTY)\s*$")
_HALF = re.compile(r"(?i)\bPROPERTY_(?:GET|SET)\s+(?:\w+\s+)*$")
_PROPERTY = re.compile(r"(?i)\bPROPERTY")
_END_PROPERTY = re.compile(r"(?i)\bEND_PROPERTY\b")
_IN_FRONT = re.compile(r"(?:\{[^{}]*\}\s*)+(?:TYPE\s+)?\Z", re.IGNORECASE)
_ATTRIBUTE = re.compile(r"\{\s*attribute\s+'([^']*)'(?:\s*:=\s*'([^']*)')?\s*\}", re.IGNORECASE)
ACTING = re.compile(r"(?i)'(pack_mode|qualified_only|strict|call_after_init|call_after_global_init_slot|global_init_slot|"
                    r"to_string|instance-path)'")
"""Attributes that change what a program does."""
_LONGEST = 2_000
"""Characters in front of a declaration in which its attributes are looked for."""


def data(name: str, *content: Element) -> Element:
    """The element `data` of that name of CODESYS."""
    return element("data", *content, name=f"{CODESYS}{name}", handleUnknown="implementation")


def added(*parts: Element | None) -> Element | None:
    """The element `addData` with these parts; None if there are none."""
    found = [part for part in parts if part is not None]
    return element("addData", *found) if found else None


def inheritance(bases: Sequence[tree.NamedType], interfaces: Sequence[tree.NamedType] = ()) -> Element | None:
    """What stands behind EXTENDS and IMPLEMENTS; None if nothing does."""
    parts = [*(element("Extends", base.text) for base in bases), *(element("Implements", each.text) for each in interfaces)]
    return element("Inheritance", *parts) if parts else None


def inherited(kind: str, bases: Sequence[tree.NamedType], interfaces: Sequence[tree.NamedType] = ()) -> Element | None:
    """The same as a `data` of that kind."""
    made = inheritance(bases, interfaces)
    return data(kind, made) if made is not None else None


def access(words: Sequence[str]) -> Element | None:
    """The words of a head, such as PRIVATE and ABSTRACT; None if there are none."""
    return data("accessmodifiers", element("AccessModifiers", **{word.capitalize(): "true" for word in words})) if words else None


def attributes(types: Types, start: int) -> Element | None:
    """The pragmas `{attribute 'name' := 'value'}` in front of a declaration, which `types.kept` notes; None if there are none."""
    found = [*_pragmas(types, start)]
    types.kept += [match.span() for match in found]
    types.foreign += [(tree.Node(*match.span()), f"the pragma {match[0]} is kept as CODESYS and TwinCAT have it; {OTHERS}")
                      for match in found if ACTING.search(match[0])]
    rows = [element("Attribute", Name=match[1], Value=match[2] or "") for match in found]
    return data("attributes", element("Attributes", *rows)) if rows else None


def _pragmas(types: Types, start: int) -> Iterator[re.Match[str]]:
    first = max(0, start - _LONGEST)
    if front := _IN_FRONT.search(types.source.text, first, start):
        yield from _ATTRIBUTE.finditer(types.source.text, front.start(), start)


def is_object(declared: tree.Pou) -> bool:
    """Whether a POU has something that only `addData` of CODESYS can say."""
    return bool(declared.kind == "INTERFACE" or declared.bases or declared.interfaces or declared.modifiers or declared.methods)


def spans(types: Types, declared: tree.Pou) -> list[Span]:
    """Where the methods and properties of a POU stand, with the pragmas in front of them."""
    text, found = types.source.text, []
    for each in declared.methods:
        start, end = each.start, each.end
        if each.kind in ACCESSORS:
            start = _property_start(text, each)
            if not _END_PROPERTY.search(text, max(0, end - len("END_PROPERTY")), end):
                closing = _END_PROPERTY.search(text, end)
                end = closing.end() if closing else end
        front = _IN_FRONT.search(text, max(0, start - _LONGEST), start)
        found.append((front.start() if front else start, end))
    return sorted(set(found))


def _property_start(text: str, accessor: tree.Pou) -> int:
    """Where the word PROPERTY in front of the name of an accessor stands."""
    first = max(0, accessor.name.start - _LONGEST)
    return [found.start() for found in _PROPERTY.finditer(text, first, accessor.name.start)][-1]


def interface(types: Types, declared: tree.Pou) -> Element:
    """The `data` of an INTERFACE, which stands in the project."""
    made = [*_members(types, declared, None)]
    parts = {name: [one for one in made if one.name == kind]
             for name, kind in (("Methods", "Method"), ("Properties", "Property"))}
    words = [word.text for word in declared.modifiers]
    return data("interface", element("Interface", *(element(name, *some) for name, some in parts.items() if some),
                                     inheritance(declared.bases), added(access(words), attributes(types, declared.start)),
                                     name=declared.name.text))


def members(types: Types, declared: tree.Pou, body: BodyWriter) -> list[Element]:
    """The `data` of the methods and properties of a POU, in their order.  Raises NotExportable."""
    return [data(made.name.lower(), made) for made in _members(types, declared, body)]


def _members(types: Types, declared: tree.Pou, body: BodyWriter | None) -> Iterator[Element]:
    """The elements Method and Property; with no `body`, those of an INTERFACE."""
    accessors: dict[str, list[tree.Pou]] = {}
    for each in declared.methods:
        if each.kind in ACCESSORS:
            accessors.setdefault(each.name.text.upper(), []).append(each)
    for each in declared.methods:
        if each.refused or each.usings or each.accesses:
            raise NotExportable(each.name, f"parts of {each.kind} {each.name.text} are not exported", HINT)
        if each.kind == "METHOD":
            yield _method(types, each, body)
        elif (together := accessors.pop(each.name.text.upper(), None)) is not None:
            yield _property(types, together, body)


def _method(types: Types, method: tree.Pou, body: BodyWriter | None) -> Element:
    result = element("returnType", types.spec(method.result)) if method.result is not None else None
    head = added(access([word.text for word in method.modifiers]), attributes(types, method.start))
    inner = element("body", body(method, *body_span(types, method))) if body else None
    return element("Method", element("interface", result, *lists(types, method), head), inner, name=method.name.text)


def _property(types: Types, accessors: Sequence[tree.Pou], body: BodyWriter | None) -> Element:
    """The element of a property: the words of its head are those that all its accessors have."""
    first = accessors[0]
    words = [word.text for word in first.modifiers if all(word.text in _words(one) for one in accessors)]
    head = added(access(words), attributes(types, _property_start(types.source.text, first)))
    parts = []
    for one in accessors:
        own = added(access([word for word in _words(one) if word not in words]))
        within = element("interface", *lists(types, one), own)
        inner = element("body", body(one, *_accessor_span(types, one, accessors))) if body else None
        parts.append(element(ACCESSORS[one.kind], within, inner))
    return element("Property", element("interface", element("returnType", types.spec(_type(first))), head), *parts,
                   name=first.name.text)


def _words(one: tree.Pou) -> list[str]:
    return [word.text for word in one.modifiers]


def _type(accessor: tree.Pou) -> tree.TypeSpec:
    """The type of a property: the result of GET, and the hidden input of SET."""
    return accessor.result if accessor.result is not None else accessor.sections[0].variables[0].spec


def lists(types: Types, declared: tree.Pou) -> list[Element]:
    """The lists of variables of a POU, a method or an accessor that are written.  Raises NotExportable."""
    return [types.section(section) for section in declared.sections if section.variables and not section.hidden]


# --- where bodies stand -----------------------------------------------------------------------------------------------


def body_span(types: Types, declared: tree.Pou, start: int = 0) -> Span:
    """Where the body of a POU begins and ends in the text, at or behind `start`."""
    heads: list[tree.Node] = [declared.name, *declared.bases, *declared.interfaces,
                              *(section for section in declared.sections if not section.hidden)]
    if declared.result is not None and not start:
        heads.append(declared.result)
    start = max(start, *(node.end for node in heads))
    text = types.source.text
    while text[start:start + 1] in (" ", "\t", ";"):
        start += 1
    found = END.search(text, start, declared.end)
    return start, found.start() if found else declared.end


def _accessor_span(types: Types, accessor: tree.Pou, accessors: Sequence[tree.Pou]) -> Span:
    """Where the body of GET or SET begins and ends: behind that word, which may stand behind the other accessor."""
    text, start = types.source.text, _type(accessor).end
    if not _HALF.search(text, max(0, accessor.name.start - _LONGEST), accessor.name.start):
        start = max([start, *(one.end for one in accessors if one.end < accessor.end and one.start == accessor.start)])
        word = re.compile(rf"(?i)\b{accessor.kind}\b").search(text, start, accessor.end)
        start = word.end() if word else start
    return body_span(types, accessor, start)
