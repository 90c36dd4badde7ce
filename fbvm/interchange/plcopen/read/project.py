"""The frame of a PLCopen document: where types, POUs, globals and configurations stand, and what is left out.

Elements are found by their local names: TC6 1.x, 2.00 and 2.01 differ in little, and CODESYS keeps most of a project
below `addData` of a resource.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

from fbvm.interchange.markup import Element
from fbvm.interchange.plcopen.read.document import (
    Body,
    Configuration,
    DataType,
    Document,
    Instance,
    Pou,
    Reading,
    Resource,
    Task,
    Variable,
    VarList,
)
from fbvm.interchange.plcopen.read.objects import (
    INTERFACE,
    METHOD,
    accessors,
    added,
    arguments,
    head,
    last_word,
    left_out,
    members,
    property_type,
)
from fbvm.interchange.plcopen.read.types import duration, location, note, type_and_value, type_text, value_text
from fbvm.interchange.plcopen.schema import KINDS, LOCATION, MNEMONIC, QUALIFIERS, SECTIONS

TC6 = "http://www.plcopen.org/xml/tc6"
IEC_10 = "www.iec.ch/public/TC65SC65BWG7TF10"
"""Namespace of IEC 61131-10, another schema (from memory of the family, assumed)."""
LANGUAGES = ("ST", "IL", "LD", "FBD", "SFC")
READ = {"pou", "element", "globalvars", "datatype", "application", "mixedattrsvarlist", "resource", "device", "location",
        "action", "method", "property", "interface", "getaccessor", "setaccessor", "pouinheritance", "inheritance",
        "datatypeinheritance", "accessmodifiers", "attributes", "inputassignments", "stcode", "cfc"}
"""Last words of the names of `addData` whose contents are taken over."""
SETTINGS = {"objectid", "tasksettings", "projectinformation", "projectstructure", "fbdcalltype", "fbdelementtype",
            "interfaceasplaintext", "buildproperties", "inputparamtypes", "outputparamtypes", "cfccalltype",
            "implementationattributes"}
"""Last words of the names of `addData` that repeat what elements say, or concern the tool itself."""
_IDENTIFIER = re.compile(r"[^\W\d]\w*")


def read_project(reading: Reading, root: Element) -> Document | None:
    """The contents of a document; None, with a diagnostic, if it is no document of PLCopen TC6."""
    if root.namespace == IEC_10 or (root.name == "Project" and "61131" in root.namespace):
        reading.report("X0104", root, "this is XML of IEC 61131-10, the successor of PLCopen TC6, which is not read",
                       "let the tool export PLCopen XML (TC6)")
        return None
    if root.name != "project" or not (root.namespace.startswith(TC6) or (not root.namespace and root.one("types"))):
        reading.report("X0104", root, f"the document is <{root.name}> of {root.namespace or 'no namespace'}, no PLCopen project",
                       f"a PLCopen project is <project xmlns=\"{TC6}_0201\">")
        return None
    types: list[DataType] = []
    pous: list[Pou] = []
    lists: list[VarList] = []
    for element, parent in _parts(root):
        if element.name == "dataType":
            types += _data_type(reading, element)
        elif element.name == "pou":
            pous += _pou(reading, element)
        elif element.name == INTERFACE:
            pous += _interface(reading, element)
        elif element.name == "globalVars":
            lists += _var_list(reading, element, parent.get("name"))
    configurations = tuple(_configuration(reading, c) for c in root.walk() if c.name == "configuration")
    _added(reading, root)
    return Document(tuple(types), tuple(pous), tuple(lists), configurations)


def _parts(root: Element) -> Iterator[tuple[Element, Element]]:
    """Types, POUs, and lists of globals that are no part of the standard frame, each with the element around it."""
    todo = [(root, root)]
    while todo:
        element, parent = todo.pop()
        if element.name == "globalVars" and parent.name in ("configuration", "resource", "interface"):
            if element.get("name") and parent.name != "interface":
                yield element, element
        elif element.name in ("dataType", "pou", "globalVars", INTERFACE):
            yield element, parent
        if element.name not in ("pou", "dataType", "globalVars", INTERFACE):
            todo.extend((child, element) for child in reversed(element.children))


def identifier(reading: Reading, element: Element, attribute: str = "name") -> str:
    """The name of an element; "" with a diagnostic if it has none, or one that is no identifier."""
    name = element.get(attribute).strip()
    if not name:
        reading.report("X0105", element, f"<{element.name}> has no {attribute}")
    elif not _IDENTIFIER.fullmatch(name):
        reading.report("X0105", element, f"{name!r} is no name", "a name begins with a letter, and has letters, digits and `_`")
        return ""
    return name


def _data_type(reading: Reading, element: Element) -> Iterator[DataType]:
    name = identifier(reading, element)
    kind = type_text(reading, element.one("baseType"), element)
    if name and kind:
        yield DataType(name, kind, value_text(element.one("initialValue"), kind, reading.producer.family), note(element),
                       head(element).extends, head(element).attributes)


# --- variables --------------------------------------------------------------------------------------------------------


def _var_list(reading: Reading, element: Element, name: str = "") -> Iterator[VarList]:
    """The list of an element.  Where its parts have other qualifiers, CODESYS repeats its variables in lists inside of it."""
    name = element.get("name") or name
    inside = [inner for inner in element.walk() if inner is not element and inner.name == element.name]
    qualifiers = tuple(word for key, word in QUALIFIERS.items() if element.get(key) in ("true", "1"))
    again = {variable.get("name") for inner in inside for variable in inner.all("variable")}
    variables = tuple(v for inner in element.all("variable") if inner.get("name") not in again for v in _variable(reading, inner))
    if variables:
        yield VarList(SECTIONS[element.name], qualifiers, variables, name, head(element).attributes)
    for inner in inside:
        yield from _var_list(reading, inner, name)


def _variable(reading: Reading, element: Element) -> Iterator[Variable]:
    name = identifier(reading, element)
    kind, written = type_and_value(reading, element)
    if name and kind:
        initial = value_text(element.one("initialValue"), kind, reading.producer.family) or written
        yield Variable(name, kind + arguments(element), initial, location(element), note(element))


# --- POUs -------------------------------------------------------------------------------------------------------------


def _pou(reading: Reading, element: Element) -> Iterator[Pou]:
    name, kind = identifier(reading, element), _kind(element.get("pouType"))
    if kind is None:
        reading.report("X0105", element, f"pouType is {element.get('pouType')!r}", f"it is one of {', '.join(KINDS)}")
    if not name or kind is None:
        return
    reading.where = name
    interface = element.one("interface")
    lists = _lists(reading, element)
    returned = interface.one("returnType") if interface else None
    result = type_text(reading, returned, element) if returned and kind == "FUNCTION" else ""
    bodies = element.all("body")
    for other in bodies[1:]:
        reading.report("X0203", other, f"worksheet {other.get('WorksheetName')} is not taken over: the POU has its first body",
                       "one body a POU is read")
    body = _body(reading, bodies[0]) if bodies else None
    yield Pou(kind, name, result, lists, body, _named_bodies(reading, element, "action"),
              _named_bodies(reading, element, "transition"), note(element) or (note(interface) if interface else ""), element,
              head(element), _members(reading, element))
    reading.where = ""


def _lists(reading: Reading, element: Element) -> tuple[VarList, ...]:
    """The sections of variables of a POU or a method.  What the format calls global in a POU is VAR_STAT (CODESYS, TwinCAT)."""
    interface = element.one("interface")
    parts = interface.children if interface else []
    for part in parts:
        if part.name == "accessVars" and part.all("variable"):
            reading.report("X0203", part, "access variables are not taken over")
    lists = tuple(replace(made, kind="VAR_STAT") if made.kind == "VAR_GLOBAL" else made
                  for part in parts if part.name in SECTIONS for made in _var_list(reading, part))
    if more := left_out(element, lists):
        names = ", ".join(variable.name for listed in more for variable in listed.variables)
        reading.report("X0292", element, f"{names}: only the plain text of the declaration has this, and it is taken from there")
    return lists + more


def _members(reading: Reading, element: Element) -> tuple[Pou, ...]:
    """The methods and properties of a POU or an interface."""
    found = []
    for member in members(element):
        name = identifier(reading, member)
        if name and member.name == METHOD:
            interface = member.one("interface")
            returned = interface.one("returnType") if interface else None
            result = type_text(reading, returned, member) if returned else ""
            found.append(_routine(reading, "METHOD", name, result, member))
        elif name and (kind := type_text(reading, property_type(member), member)):
            parts = tuple(_routine(reading, which, name, "", accessor) for which, accessor in accessors(member))
            found.append(Pou("PROPERTY", name, kind, (), None, (), (), note(member), member, head(member), parts))
    return tuple(found)


def _routine(reading: Reading, kind: str, name: str, result: str, element: Element) -> Pou:
    """A method, or an accessor of a property."""
    body = element.one("body")
    interface = element.one("interface")
    return Pou(kind, name, result, _lists(reading, element), _body(reading, body) if body else None, (), (),
               note(element) or (note(interface) if interface else ""), element, head(element))


def _interface(reading: Reading, element: Element) -> Iterator[Pou]:
    name = identifier(reading, element)
    if name:
        yield Pou("INTERFACE", name, "", (), None, (), (), note(element), element, head(element), _members(reading, element))


def _kind(text: str) -> str | None:
    """The kind of a POU that `pouType` names, in whatever case and with or without an underscore; None if it names none."""
    return next((kind for word, kind in KINDS.items() if word.casefold() == text.replace("_", "").strip().casefold()), None)


def _named_bodies(reading: Reading, pou: Element, what: str) -> tuple[tuple[str, Body], ...]:
    """Actions and transitions; CODESYS has actions below `addData`."""
    holders = [*pou.all(f"{what}s"), *(d for d in _data(pou) if d.get("name").endswith(f"/{what}"))]
    found = []
    for element in (inner for holder in holders for inner in holder.children if inner.name.lower() == what):
        name, body = identifier(reading, element), element.one("body")
        made = _body(reading, body) if body else None
        if name and made:
            found.append((name, made))
    return tuple(found)


def _body(reading: Reading, element: Element) -> Body | None:
    """The body in an element; CODESYS and TwinCAT keep a CFC in addData, beside an empty ST."""
    for data in added(element):
        if (chart := data.one("CFC")) is not None:
            return Body(chart.name, chart)
        if last_word(data) not in READ | SETTINGS:
            reading.report("X0203", data, f"the body that the tool keeps in addData {data.get('name')} is not taken over")
    inner = next((part for part in element.children if part.name.upper() in LANGUAGES), None)
    if inner is None:
        strange = next((part for part in element.children if part.name not in ("addData", "documentation")), None)
        if strange is not None:
            reading.report("X0203", strange, f"a body in {strange.name} is not taken over", f"read are {', '.join(LANGUAGES)}")
        return None
    return Body(inner.name.upper(), inner)


# --- configurations ---------------------------------------------------------------------------------------------------


def _configuration(reading: Reading, element: Element) -> Configuration:
    resources = [inner for inner in element.walk() if inner.name == "resource"]
    accesses, settings = (tuple(line for holder in element.all(what) for each in holder.children for line in write(reading, each))
                          for what, write in (("accessVars", _access), ("configVars", _setting)))
    made = Configuration(identifier(reading, element) or "Config0", _unnamed(reading, element),
                         tuple(_resource(reading, r) for r in resources), accesses, settings)
    if (made.accesses or made.settings) and not any(resource.instances for resource in made.resources):
        reading.report("X0203", element, "access and configuration variables are not taken over: no resource has a program")
    return made


def _access(reading: Reading, element: Element) -> Iterator[str]:
    """The line of VAR_ACCESS for an access variable."""
    path, kind = element.get("instancePathAndName").strip(), type_text(reading, element.one("type"), element)
    if (name := identifier(reading, element, "alias")) and path and kind:
        yield f"{name} : {path} : {kind} {'READ_WRITE' if element.get('direction') == 'readWrite' else 'READ_ONLY'};"


def _setting(reading: Reading, element: Element) -> Iterator[str]:
    """The line of VAR_CONFIG for a configuration variable."""
    path, kind = element.get("instancePathAndName").strip(), type_text(reading, element.one("type"), element)
    if path and kind:
        initial = value_text(element.one("initialValue"), kind, reading.producer.family)
        place = element.get("address").strip()
        yield f"{path}{f' AT {place}' if place else ''} : {kind}{f' := {initial}' if initial else ''};"


def _unnamed(reading: Reading, element: Element) -> tuple[VarList, ...]:
    return tuple(made for part in element.all("globalVars") if not part.get("name") for made in _var_list(reading, part))


def _resource(reading: Reading, element: Element) -> Resource:
    tasks, instances = [], []
    for task in element.all("task"):
        name = identifier(reading, task)
        if not name:
            continue
        interval = duration(task.get("interval"))
        if task.get("interval").strip() and not interval:
            reading.report("X0203", task, f"the interval of task {name} is {task.get('interval')!r}, which is no duration",
                           "write a duration such as T#20ms")
        tasks.append(Task(name, interval, task.get("single").strip(), task.get("priority").strip()))
        instances += _instances(reading, task, name)
    instances += _instances(reading, element, "")
    return Resource(identifier(reading, element) or "Res0", _unnamed(reading, element), tuple(tasks), tuple(instances))


def _instances(reading: Reading, holder: Element, task: str) -> list[Instance]:
    found = []
    for element in holder.all("pouInstance"):
        name = identifier(reading, element)
        if name:
            kind = element.get("typeName") or element.get("type")  # TC6 1.x calls it `type`
            found.append(Instance(name, kind.strip() or name, task))
    return found


# --- what is not taken ------------------------------------------------------------------------------------------------


def _data(element: Element) -> list[Element]:
    added = element.one("addData")
    return added.all("data") if added else []


def _added(reading: Reading, root: Element) -> None:
    """Report the `addData` that are not taken over."""
    for element in root.walk():
        if element.name != "data" or not element.get("name"):
            continue
        name = element.get("name")
        last = name.rstrip("/").rpartition("/")[2].lower()
        if last in SETTINGS:
            if reading.producer.family == "fbvm":  # the structure that an export adds for TwinCAT, which is in the elements
                continue
            reading.count("identities and settings of the tool in addData are not taken over", element)
        elif last not in READ and name not in (LOCATION, MNEMONIC):
            reading.count(f"addData {name} is not taken over", element)
