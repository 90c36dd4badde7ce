"""Export to PLCopen TC6 XML 2.01: sources of ours in, a document and a list of what it does not hold out."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from fbvm.base.diagnostics import Diagnostic, Source, errors
from fbvm.interchange.markup import Element, element, written
from fbvm.interchange.plcopen.write import objects
from fbvm.interchange.plcopen.write.pous import add_action, pou
from fbvm.interchange.plcopen.write.structure import structure
from fbvm.interchange.plcopen.write.types import OTHERS, NotExportable, Types
from fbvm.syntax import tree
from fbvm.syntax.parser import parse
from fbvm.syntax.st.pragmas import harmless
from fbvm.syntax.text import read
from fbvm.syntax.tree.node import walk

NAMESPACE = "http://www.plcopen.org/xml/tc6_0201"
XHTML = "http://www.w3.org/1999/xhtml"
BEGINNING = "1970-01-01T00:00:00"
"""The creation time in a document, if none is given."""
_NAME = re.compile(r"[^\W\d]\w*")


@dataclass(frozen=True)
class Exported:
    """The result of an export."""

    text: str | None
    """The PLCopen XML document; None if a source cannot be read."""
    diagnostics: list[Diagnostic]
    """Errors and warnings about the sources, in the order of their places."""

    @property
    def errors(self) -> list[Diagnostic]:
        """Diagnostics about parts of the sources that the document lacks."""
        return errors(self.diagnostics)


@dataclass
class _Parts:
    """The elements of the document, by the place that they go to."""

    types: list[Element] = field(default_factory=list)
    pous: list[Element] = field(default_factory=list)
    globals: list[Element] = field(default_factory=list)
    configurations: list[Element] = field(default_factory=list)
    actions: list[tuple[Types, tree.Action | tree.Actions, str]] = field(default_factory=list)
    """Actions that stand outside of their POU, with the name of the POU that is written in front of them."""
    added: list[Element] = field(default_factory=list)
    """The `data` of the project, such as INTERFACEs."""
    diagnostics: list[Diagnostic] = field(default_factory=list)


def export_xml(sources: Sequence[Source | Path | str], name: str = "project", created: str = BEGINNING) -> Exported:
    """Export files, given by their paths, or texts.

    `created` is the time that the document names, as 2024-03-01T08:00:00.  Never raises for what sources contain."""
    parts = _Parts()
    texts: list[tuple[Source, tree.SourceText]] = []
    for given in sources:
        source = given if isinstance(given, Source) else read(Path(given), str(given))
        if isinstance(source, Diagnostic):
            parts.diagnostics.append(source)
            continue
        text, diagnostics = parse(source)
        wrong = [d for d in errors(diagnostics) if d.code != "S0901"]
        parts.diagnostics += wrong
        if not wrong:  # there will be no document, and a damaged tree has no drawing
            texts.append((source, text))
    pous = (pou for _, text in texts for pou in text.declarations if isinstance(pou, tree.Pou))
    outputs = {pou.name.text.upper(): _outputs(pou) for pou in pous}
    shared = _shared_members(texts)
    for source, text in texts:
        _source(parts, Types(source, _names(text), shared), text, outputs)
    for types, declared, before in parts.actions:
        _actions(parts, types, declared, before)
    unread = [d for d in parts.diagnostics if d.code[0] == "S" and d.severity == "error"]
    found = sorted(parts.diagnostics, key=Diagnostic.order)
    return Exported(None if unread else written(_project(parts, name, created)), found)


def _outputs(pou: tree.Pou) -> frozenset[str]:
    return frozenset(name.text.upper() for section in pou.sections if section.kind == "VAR_OUTPUT"
                     for variable in section.variables for name in variable.names)


def _shared_members(texts: Iterable[tuple[Source, tree.SourceText]]) -> frozenset[str]:
    """What several enumerations have as a member, and statements name alone, in capitals."""
    members, named = Counter[str](), set[str]()
    for node in walk(tuple(text.declarations for _, text in texts)):
        if isinstance(node, tree.EnumSpec):
            members.update(name.text.upper() for name, _ in node.members)
        elif isinstance(node, tree.NameRef):
            named.add(node.text.upper())
    return frozenset(member for member, count in members.items() if count > 1 and member in named)


def _names(text: tree.SourceText) -> Iterator[str]:
    return (each.name.text for each in text.declarations if isinstance(each, tree.Pou | tree.TypeDecl))


def _source(parts: _Parts, types: Types, text: tree.SourceText, outputs: Mapping[str, frozenset[str]]) -> None:
    """Add the elements of a source; `outputs` are those of all POUs that are exported, by their names in capitals."""
    source = types.source
    types.outputs |= outputs
    types.note(declared.section for declared in text.declarations if isinstance(declared, tree.GlobalVars))
    named = Path(source.name).stem
    for declared in text.declarations:
        types.owner = declared.name.text if isinstance(declared, tree.Pou | tree.TypeDecl) else ""
        try:
            _declaration(parts, types, declared, named if _NAME.fullmatch(named) else "")
        except NotExportable as unexportable:
            node, message, hint = unexportable.args
            what = f"{declared.name.text}: " if isinstance(declared, tree.Pou | tree.TypeDecl | tree.Configuration) else ""
            parts.diagnostics.append(Diagnostic("X0301", source, node.start, node.end, f"{what}{message}", hint))
    parts.types += types.made.values()
    for pragma in text.pragmas:
        if any(start <= pragma.start < end for start, end in types.kept):
            continue
        parts.diagnostics.append(Diagnostic("X0301" if _matters(pragma.text) else "X0190", source, pragma.start, pragma.end,
                                            f"the pragma {{{pragma.text.strip()}}} is not exported"))
    said: dict[str, tree.Node] = {}
    for node, message in types.foreign:
        said.setdefault(message, node)
    parts.diagnostics += [Diagnostic("X0390", source, node.start, node.end, message) for message, node in said.items()]


def _declaration(parts: _Parts, types: Types, declared: tree.Declaration, name: str) -> None:
    if isinstance(declared, tree.Pou) and declared.kind == "INTERFACE":
        types.foreign.append((declared.name, f"INTERFACE {declared.name.text} is kept as CODESYS and TwinCAT have it; {OTHERS}"))
        parts.added.append(objects.interface(types, declared))
    elif isinstance(declared, tree.Pou):
        parts.pous.append(pou(types, declared))
    elif isinstance(declared, tree.TypeDecl):
        initial = element("initialValue", types.value(declared.initial)) if declared.initial is not None else None
        bases = declared.spec.bases if isinstance(declared.spec, tree.StructSpec) else ()
        if bases:
            types.foreign.append((bases[0], f"the base of {declared.name.text} is kept as CODESYS and TwinCAT have it; {OTHERS}"))
        head = objects.added(objects.inherited("datatypeinheritance", bases), objects.attributes(types, declared.start))
        parts.types.append(element("dataType", element("baseType", types.spec(declared.spec)), initial, head,
                                   name=declared.name.text))
    elif isinstance(declared, tree.GlobalVars):
        made = types.section(declared.section, name)
        if (head := objects.added(objects.attributes(types, declared.start))) is not None:
            made.content.append(head)
        parts.globals.append(made)
    elif isinstance(declared, tree.Configuration):
        parts.configurations.append(_configuration(types, declared))
    elif isinstance(declared, tree.Namespace | tree.Using):
        raise NotExportable(declared, "NAMESPACE and USING are not exported", "PLCopen XML has none: declare it outside")
    elif isinstance(declared, tree.Action | tree.Actions):
        parts.actions.append((types, declared, parts.pous[-1].get("name") if parts.pous else ""))
    else:
        raise NotExportable(declared, "what stands outside of a CONFIGURATION is not exported", "put VAR_CONFIG into one")


def _actions(parts: _Parts, types: Types, declared: tree.Action | tree.Actions, before: str) -> None:
    """Add actions that stand outside of their POU to its element; `before` is the POU in front of them."""
    owner = declared.owner.text if declared.owner is not None else before
    found = next((each for each in parts.pous if each.get("name").upper() == owner.upper()), None)
    try:
        if found is None:
            raise NotExportable(declared, f"the POU {owner} of this action is not exported", "give its file, too")
        for action in declared.actions if isinstance(declared, tree.Actions) else (declared,):
            add_action(types, found, action)
    except NotExportable as unexportable:
        node, message, hint = unexportable.args
        parts.diagnostics.append(Diagnostic("X0301", types.source, node.start, node.end, message, hint))


def _matters(pragma: str) -> bool:
    """Whether a pragma in front of a declaration changes the meaning of the program."""
    return not harmless(pragma) or bool(objects.ACTING.search(pragma))


# --- configurations ---------------------------------------------------------------------------------------------------


def _configuration(types: Types, declared: tree.Configuration) -> Element:
    resources = [_resource(types, resource) for resource in declared.resources]
    lists = [types.section(section) for section in declared.sections]
    return element("configuration", *resources, *lists, *_settings(types, declared.settings), name=declared.name.text)


def _settings(types: Types, settings: Iterable[tree.AccessVars | tree.ConfigVars]) -> Iterator[Element]:
    """The elements of all VAR_ACCESS, and of all VAR_CONFIG."""
    shared = [_access(types, each) for listed in settings if isinstance(listed, tree.AccessVars) for each in listed.variables]
    given = [_given(types, each) for listed in settings if isinstance(listed, tree.ConfigVars) for each in listed.variables]
    if shared:
        yield element("accessVars", *shared)
    if given:
        yield element("configVars", *given)


def _access(types: Types, shared: tree.Access) -> Element:
    return element("accessVariable", element("type", types.spec(shared.spec)), alias=shared.name.text,
                   instancePathAndName=types.text(shared.path), direction="readWrite" if shared.writable else "readOnly")


def _given(types: Types, given: tree.ConfigVar) -> Element:
    address = {"address": given.location.text.strip()} if given.location is not None else {}
    if address and not address["address"].startswith("%"):
        raise NotExportable(given, f"the address {address['address']} in VAR_CONFIG is not exported", "give one such as %IX0.0")
    initial = element("initialValue", types.value(given.initial)) if given.initial is not None else None
    return element("configVariable", element("type", types.spec(given.spec)), initial, instancePathAndName=types.text(given.path),
                   **address)


def _resource(types: Types, resource: tree.Resource) -> Element:
    for unsaid in resource.settings:
        raise NotExportable(unsaid, "this part of a RESOURCE is not exported", "")
    instances: dict[str, list[Element]] = {}
    for program in resource.programs:
        if program.connections or program.blocks or program.qualifiers:
            raise NotExportable(program, "connections and qualifiers of programs are not exported", "assign in the program")
        task = program.task.text.upper() if program.task else ""
        instances.setdefault(task, []).append(element("pouInstance", name=program.name.text, typeName=program.type_name.text))
    tasks = [_task(types, task, instances.get(task.name.text.upper(), [])) for task in resource.tasks]
    lists = [types.section(section) for section in resource.sections]
    return element("resource", *tasks, *lists, *instances.get("", []), name=resource.name.text if resource.name else "Res0")


def _task(types: Types, task: tree.Task, programs: Iterable[Element]) -> Element:
    marks = {key: types.text(value) for key, value in (("single", task.single), ("interval", task.interval)) if value is not None}
    return element("task", *programs, name=task.name.text, **marks,
                   priority=types.text(task.priority) if task.priority is not None else "0")


def _project(parts: _Parts, name: str, created: str) -> Element:
    """The element `project`, its parts in the order of the schema."""
    if parts.globals and not parts.configurations:
        parts.configurations.append(element("configuration", element("resource", name="Res0"), name="Config0"))
    if parts.globals:
        first = parts.configurations[0]
        place = next((at for at, part in enumerate(first.content) if isinstance(part, Element)
                      and part.name in ("accessVars", "configVars")), len(first.content))
        first.content[place:place] = parts.globals
    interfaces = [inner for data in parts.added for inner in data.all("Interface")]
    named = structure([*parts.types, *parts.pous, *interfaces])
    scaling: Callable[[str], Element] = lambda kind: element(kind, element("scaling", x=1, y=1))  # noqa: E731
    header = element("coordinateInfo", scaling("fbd"), scaling("ld"), scaling("sfc"))
    return element(
        "project",
        element("fileHeader", companyName="", productName="fbvm", productVersion="1", creationDateTime=created),
        element("contentHeader", header, name=name, modificationDateTime=created),
        element("types", element("dataTypes", *parts.types), element("pous", *parts.pous)),
        element("instances", element("configurations", *parts.configurations)), objects.added(*parts.added, named),
        **{"xmlns": NAMESPACE, "xmlns:xhtml": XHTML})
