"""A document as source files: one for each POU, for types, for each list of globals, and for each configuration."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

from fbvm.interchange.plcopen.read.bodies import Bodies
from fbvm.interchange.plcopen.read.charts import NamedAction, with_new_names
from fbvm.interchange.plcopen.read.document import Configuration, DataType, Document, Pou, Reading, Resource, Variable, VarList
from fbvm.interchange.plcopen.read.types import remark
from fbvm.interchange.source_files import SourceFiles

GLOBALS = "globals"
"""Name of the file for lists of globals without a name."""
TYPES = "types"
OUTSIDE = "extensions"
"""Name of the file for globals that other files of a project of Beremiz declare."""
SERVED = ("PYTHON_EVAL", "PYTHON_POLL", "PYTHON_GEAR", "CSV_READ_BY_STRING", "CSV_READ_BY_INT", "CSV_RELOAD")
"""Blocks that ask a program on the host of the PLC (Beremiz, py_ext)."""
WINDOWS = ("BUTTON", "LED", "TEXTCTRL")
"""Blocks that stand for a part of a window on the host (Beremiz up to 1.2, svgui)."""
_WHOLE = re.compile(r"(?is)\s*(FUNCTION_BLOCK|FUNCTION|PROGRAM)\s+(\w+)\b.*\bEND_\1\s*;?\s*")
"""A body that is a whole POU."""


def sources(reading: Reading, document: Document) -> dict[str, str]:
    """Texts by the names of their files."""
    files = SourceFiles()
    if document.types:
        files.add(TYPES, [line for data_type in document.types for line in _data_type(data_type)])
    lists: dict[str, list[str]] = {}
    for listed in document.globals:
        lists.setdefault(listed.name or GLOBALS, []).extend(_section(listed))
    for name, lines in lists.items():
        files.add(name, lines)
    for pou in document.pous:
        reading.where = pou.name
        files.add(pou.name, _pou(reading, document, pou))
    reading.where = ""
    _outside(reading, document, files)
    for configuration in document.configurations:
        lines = _configuration(configuration)
        if lines:
            files.add(configuration.name, lines)
    return files.texts()


def _served(reading: Reading, document: Document, pou: Pou) -> None:
    """Name the blocks of a POU that stand for programs on the host of the PLC."""
    for variable in (variable for listed in pou.lists for variable in listed.variables):
        kind, reading.where = variable.type.upper(), pou.name
        if kind in SERVED:
            reading.report("X0292", pou.element, f"{variable.name} is a {variable.type}, which a program on the host of the "
                           "PLC serves: here it never acknowledges")
        elif kind in WINDOWS and reading.producer.family == "beremiz" and kind not in document.pous_by_name:
            reading.report("X0292", pou.element, f"{variable.name} is a {variable.type} of svgui, a part of a window on the "
                           "host of the PLC: here nobody sees or presses it")


def _outside(reading: Reading, document: Document, files: SourceFiles) -> None:
    """Declare what POUs expect of other files of a project, and say so; name the blocks that other programs serve."""
    missing: dict[str, Variable] = {}
    for pou in document.pous:
        _served(reading, document, pou)
        for variable in (v for listed in pou.lists if listed.kind == "VAR_EXTERNAL" for v in listed.variables):
            if variable.name.upper() not in document.globals_by_name:
                missing.setdefault(variable.name.upper(), variable)
    reading.where = ""
    known = {name: reading.beside[name] for name in missing if name in reading.beside}
    for name in known:
        del missing[name]
    if known:
        names = ", ".join(variable.name for variable in known.values())
        reading.report("X0292", document.pous[0].element, f"{names}: files of Python or C beside the document declare them; "
                       "their code is not executed, so nothing but the program writes them")
        files.add(f"{OUTSIDE}_code", _section(VarList("VAR_GLOBAL", (), tuple(known.values()))))
    if missing and reading.producer.family == "beremiz":
        names = ", ".join(variable.name for variable in missing.values())
        reading.report("X0292", document.pous[0].element, f"no global list has {names}: another file of the project declares "
                       "them, such as one for Modbus, MQTT or Python; here nothing but the program writes them")
        outside = tuple(replace(variable, initial="", address="") for variable in missing.values())
        files.add(OUTSIDE, _section(VarList("VAR_GLOBAL", (), outside)))


def _data_type(data_type: DataType) -> list[str]:
    initial = f" := {data_type.initial}" if data_type.initial else ""
    extends = f" EXTENDS {', '.join(data_type.extends)}" if data_type.extends else ""
    return [*data_type.attributes, f"TYPE{remark(data_type.note)}", f"{data_type.name}{extends} : {data_type.text}{initial};",
            "END_TYPE", ""]


def _section(listed: VarList) -> list[str]:
    head = " ".join((listed.kind, *listed.qualifiers))
    return [*listed.attributes, head, *(_variable(variable) for variable in listed.variables), "END_VAR", ""]


def _variable(variable: Variable) -> str:
    address = f" AT {variable.address}" if variable.address else ""
    initial = f" := {variable.initial}" if variable.initial else ""
    return f"{variable.name}{address} : {variable.type}{initial};{remark(variable.note)}"


# --- POUs -------------------------------------------------------------------------------------------------------------


def _pou(reading: Reading, document: Document, pou: Pou) -> list[str]:
    if whole := _whole_text(reading, pou):
        return whole
    bodies = Bodies(reading, document, pou)
    main = bodies.lines(pou.body) if pou.body else []
    actions = [(name, [with_new_names(line, bodies.renamed) for line in bodies.lines(body)]) for name, body in pou.actions]
    if pou.transitions and (pou.body is None or pou.body.language != "SFC"):
        names = ", ".join(name for name, _ in pou.transitions)
        reading.report("X0203", pou.element, f"without a chart transitions are not taken over: {names}")
    made = [VarList(section, (), tuple(Variable(name, kind) for name in names))
            for (section, kind), names in bodies.scope.made.items()]
    lines = [f"// {pou.note}"] if pou.note else []
    lines += [*pou.head.attributes, _head(pou)]
    lines += [line for listed in [*pou.lists, *_gathered(made)] for line in _section(listed)[:-1]]
    lines += main
    for name, inner in _ordered([*actions, *bodies.actions], main, reading.producer.generates):
        lines += ["", f"ACTION {name}:", *inner, "END_ACTION"]
    for member in pou.members:
        lines += ["", *(_pou(reading, document, member))]
    return [*lines, f"END_{pou.kind}"]


def _whole_text(reading: Reading, pou: Pou) -> list[str]:
    """The lines of a body that is a whole POU, from PROGRAM to END_PROGRAM, as some tools write it; none for another body."""
    text = pou.body.element.text if pou.body is not None and pou.body.language == "ST" else ""
    found = _WHOLE.fullmatch(text)
    if found is None or (found[1].upper(), found[2].upper()) != (pou.kind, pou.name.upper()) or pou.body is None:
        return []
    if pou.lists or pou.actions or pou.members:
        reading.report("X0203", pou.body.element, f"the body is a whole {pou.kind}, and beside it the document declares parts of "
                       "it", "leave out one of the two")
        return [f"{pou.kind} {pou.name}", f"END_{pou.kind}"]
    reading.report("X0292", pou.body.element, f"the body is a whole {pou.kind}, which is taken as it is")
    return text.expandtabs(4).strip().splitlines()


def _head(pou: Pou) -> str:
    """The head of a POU, a method or a property, or the word of an accessor."""
    if pou.kind in ("GET", "SET"):
        return " ".join((*pou.head.words, pou.kind))
    bases = "".join(f" {word} {', '.join(names)}" for word, names in (("EXTENDS", pou.head.extends),
                                                                      ("IMPLEMENTS", pou.head.implements)) if names)
    return " ".join((pou.kind, *pou.head.words, pou.name)) + bases + (f" : {pou.result}" if pou.result else "")


def _ordered(actions: list[NamedAction], chart: list[str], generates: bool) -> list[NamedAction]:
    """The ACTIONs of a POU in the order in which they are executed.  Where a generator makes text of the document, that is the
    order in which its steps name them."""
    if not generates:
        return actions
    named = [name.upper() for line in chart if (name := line.strip().partition("(")[0]) != line.strip()]
    place = {name: at for at, name in reversed(list(enumerate(named)))}
    return sorted(actions, key=lambda action: place.get(action[0].upper(), len(named)))


def _gathered(lists: list[VarList]) -> Iterator[VarList]:
    """One list for each kind."""
    for kind in dict.fromkeys(listed.kind for listed in lists):
        yield VarList(kind, (), tuple(v for listed in lists if listed.kind == kind for v in listed.variables))


# --- configurations ---------------------------------------------------------------------------------------------------


def _configuration(configuration: Configuration) -> list[str]:
    """A configuration; nothing if no program of it runs and it declares nothing."""
    resources = [resource for resource in configuration.resources if resource.instances or resource.globals]
    if not resources:
        return [line for listed in configuration.globals for line in _section(listed)]
    lines = [f"CONFIGURATION {configuration.name}"]
    lines += [line for listed in configuration.globals for line in _section(listed)[:-1]]
    for resource in resources:
        lines += _resource(resource)
    for word, settings in (("VAR_ACCESS", configuration.accesses), ("VAR_CONFIG", configuration.settings)):
        if settings and any(resource.instances for resource in resources):
            lines += [word, *settings, "END_VAR"]
    return [*lines, "END_CONFIGURATION"]


def _resource(resource: Resource) -> Iterator[str]:
    yield f"RESOURCE {resource.name} ON PLC"
    for listed in resource.globals:
        yield from _section(listed)[:-1]
    for task in resource.tasks:
        settings = [f"SINGLE := {task.single}"] if task.single else []
        settings += [f"INTERVAL := {task.interval}"] if task.interval else []
        settings += [f"PRIORITY := {task.priority}"] if task.priority else []
        yield f"TASK {task.name} ({', '.join(settings)});"
    for instance in resource.instances:
        bound = f" WITH {instance.task}" if instance.task else ""
        yield f"PROGRAM {instance.name}{bound} : {instance.type};"
    yield "END_RESOURCE"
