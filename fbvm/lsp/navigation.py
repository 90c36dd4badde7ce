"""Questions about a place or a whole: what it is, where it is declared and used, who calls it, what a file holds."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from lsprotocol import types

from fbvm.analysis.declarations import Declared, find
from fbvm.analysis.hover import hover as hover_at
from fbvm.analysis.hover import hover_of_word
from fbvm.analysis.names import Key
from fbvm.analysis.outline import Symbol, outline
from fbvm.analysis.parts import File
from fbvm.analysis.program import Program
from fbvm.analysis.references import Place, called, callers, declared_at, highlights, references, use_at
from fbvm.base.diagnostics import Source
from fbvm.base.types import StructType
from fbvm.lsp import foreign, project_file
from fbvm.lsp.projects import path_of
from fbvm.lsp.server import Server
from fbvm.run.project import FILE

_KINDS = {
    "FUNCTION": types.SymbolKind.Function, "FUNCTION_BLOCK": types.SymbolKind.Class, "PROGRAM": types.SymbolKind.Module,
    "CLASS": types.SymbolKind.Class, "INTERFACE": types.SymbolKind.Interface, "METHOD": types.SymbolKind.Method,
    "PROPERTY": types.SymbolKind.Property, "ACTION": types.SymbolKind.Method,
    "TYPE": types.SymbolKind.Struct, "CONFIGURATION": types.SymbolKind.Package, "NAMESPACE": types.SymbolKind.Namespace,
    "VAR_GLOBAL": types.SymbolKind.Namespace, "variable": types.SymbolKind.Variable, "constant": types.SymbolKind.Constant,
    "member": types.SymbolKind.Field, "enumerator": types.SymbolKind.EnumMember, "rung": types.SymbolKind.Event,
    "step": types.SymbolKind.Event, "task": types.SymbolKind.Event, "instance": types.SymbolKind.Object}
_MOST = 500
"""Symbols that are told of a whole workspace."""


def offset_of(server: Server, file: File, position: types.Position) -> int:
    """The offset of a position in a file."""
    return server.positions(file.source).offset(position)


def location(server: Server, place: Place) -> types.Location:
    """A place in the form of the protocol."""
    return types.Location(server.uri(Path(place.file.name)), server.range(place.file.source, place.start, place.end))


def declared_location(server: Server, program: Program, declared: Declared) -> types.Location | None:
    """Where a declaration stands, in a file of the program or of a library."""
    placed = program.place(declared.source)
    if placed is not None:
        file, base = placed
        return location(server, Place(file, base + declared.node.start, base + declared.node.end))
    path = program.checked.project.libraries.path(declared.source) if program.checked is not None else None
    if path is None:
        return None
    return types.Location(server.uri(path), server.positions(declared.source).range(declared.node.start, declared.node.end))


async def hover(server: Server, params: types.HoverParams) -> types.Hover | None:
    uri = params.text_document.uri
    if path_of(uri).name == FILE:
        source = Source(FILE, server.text(uri))
        said = project_file.meaning_at(source.text, server.positions(source).offset(params.position))
        return types.Hover(types.MarkupContent(types.MarkupKind.Markdown, said)) if said else None
    if foreign.is_container(path_of(uri)):
        return _hover_in_container(server, uri, params.position)
    known = await server.ready(uri)
    if known is None:
        return None
    project, file = known
    found = hover_at(project.program, file.name, offset_of(server, file, params.position))
    if found is None:
        return None
    return types.Hover(types.MarkupContent(types.MarkupKind.Markdown, found.markdown),
                       server.positions(file.source).range(found.start, found.end))


def _hover_in_container(server: Server, uri: str, position: types.Position) -> types.Hover | None:
    """What is known about a word of a container: an address, an instruction, a global name."""
    source = Source("", server.text(uri))
    at = server.positions(source).offset(position)
    for project in server.projects.of(path_of(uri)):
        if found := hover_of_word(project.program, source.text, at):
            return types.Hover(types.MarkupContent(types.MarkupKind.Markdown, found.markdown),
                               server.positions(source).range(found.start, found.end))
    return None


async def definition(server: Server, params: types.DefinitionParams) -> types.Location | None:
    known = await server.ready(params.text_document.uri)
    if known is None:
        return None
    project, file = known
    declared = declared_at(project.program, file.name, offset_of(server, file, params.position))
    return declared_location(server, project.program, declared) if declared is not None else None


async def type_definition(server: Server, params: types.TypeDefinitionParams) -> types.Location | None:
    known = await server.ready(params.text_document.uri)
    if known is None or known[0].program.checked is None:
        return None
    project, file = known
    checker = known[0].program.checked.checker
    declared = declared_at(project.program, file.name, offset_of(server, file, params.position))
    kind = declared.variable.type if declared is not None and declared.variable is not None else None
    if kind is None or declared is None:
        return None
    if isinstance(kind, StructType) and kind.block:
        block = checker.block_of(kind)
        meant = find(checker, ("pou", block.source.library, block.name.upper()))
    else:
        entry = checker.project.type_entry(kind.name, declared.source)
        meant = find(checker, ("type", entry.source.library, kind.name.upper())) if entry is not None else None
    return declared_location(server, project.program, meant) if meant is not None else None


async def find_references(server: Server, params: types.ReferenceParams) -> list[types.Location]:
    known = await server.ready(params.text_document.uri)
    if known is None:
        return []
    project, file = known
    used = use_at(project.program, file.name, offset_of(server, file, params.position))
    places = references(project.program, used[1].key) if used is not None else []
    return [location(server, each) for each in places if each.role != "declared" or params.context.include_declaration]


async def highlight(server: Server, params: types.DocumentHighlightParams) -> list[types.DocumentHighlight]:
    known = await server.ready(params.text_document.uri)
    if known is None:
        return []
    project, file = known
    kinds = {"written": types.DocumentHighlightKind.Write, "declared": types.DocumentHighlightKind.Text}
    return [types.DocumentHighlight(location(server, each).range, kinds.get(each.role, types.DocumentHighlightKind.Read))
            for each in highlights(project.program, file.name, offset_of(server, file, params.position))]


# --- what there is ----------------------------------------------------------------------------------------------------


def file_of(server: Server, uri: str) -> File | None:
    """A file as it is now, which need not be checked."""
    path = path_of(uri)
    return next((file for each in server.projects.of(path) if (file := each.program.files.get(str(path))) is not None), None)


def document_symbols(server: Server, params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
    path = path_of(params.text_document.uri)
    if foreign.is_container(path):
        files = [each.program.files[name] for each in server.projects.of(path)
                 for name in each.held if path in Path(name).parents]  # fmt: skip
    else:
        files = [file for file in (file_of(server, params.text_document.uri),) if file is not None]
    return [_symbol(server, file, each) for file in files for each in outline(file)]


def _symbol(server: Server, file: File, symbol: Symbol) -> types.DocumentSymbol:
    name = server.range(file.source, symbol.name_start, symbol.name_end)
    whole = name if foreign.container_of(file.name) else server.range(file.source, symbol.start, symbol.end)
    return types.DocumentSymbol(
        symbol.name or "?", _KINDS[symbol.kind], whole, name, symbol.detail or None,
        children=[_symbol(server, file, each) for each in symbol.children])


def workspace_symbols(server: Server, params: types.WorkspaceSymbolParams) -> list[types.WorkspaceSymbol]:
    wanted = params.query.lower()
    files = {file.name: file for project in server.projects.all for file in project.program.files.values()}
    found: list[types.WorkspaceSymbol] = []
    for file in files.values():
        for top in outline(file):
            for each in (top, *top.children):
                if wanted in each.name.lower() and len(found) < _MOST:
                    place = location(server, Place(file, each.name_start, each.name_end))
                    found.append(types.WorkspaceSymbol(place, each.name, _KINDS[each.kind],
                                                       container_name=top.name if each is not top else None))
    return found


# --- who calls whom -----------------------------------------------------------------------------------------------------


async def prepare_calls(server: Server, params: types.CallHierarchyPrepareParams) -> list[types.CallHierarchyItem]:
    known = await server.ready(params.text_document.uri)
    if known is None or known[0].program.checked is None:
        return []
    project, file = known
    declared = declared_at(project.program, file.name, offset_of(server, file, params.position))
    if declared is None or declared.pou is None:
        return []
    item = _item(server, project.program, ("pou", declared.pou.source.library, declared.pou.owner.name.upper()))
    return [item] if item is not None else []


def _item(server: Server, program: Program, key: Key) -> types.CallHierarchyItem | None:
    declared = find(program.checked.checker, key) if program.checked is not None else None
    place = declared_location(server, program, declared) if declared is not None else None
    if place is None:
        return None
    assert declared is not None
    assert declared.pou is not None
    return types.CallHierarchyItem(declared.name, _KINDS[declared.pou.kind], place.uri, place.range, place.range,
                                   detail=declared.pou.kind, data=list(key))


def _program_of(server: Server, item: types.CallHierarchyItem) -> tuple[Program, Key] | None:
    key: Key = tuple(item.data or ())
    found = next((each.program for each in server.projects.all if each.program.checked is not None
                  and find(each.program.checked.checker, key) is not None), None)
    return (found, key) if found is not None else None


def incoming_calls(server: Server, params: types.CallHierarchyIncomingCallsParams) -> list[types.CallHierarchyIncomingCall]:
    known = _program_of(server, params.item)
    return [types.CallHierarchyIncomingCall(item, [location(server, place).range])
            for key, place in (callers(*known) if known is not None else ())
            if known is not None and (item := _item(server, known[0], key)) is not None]


def outgoing_calls(server: Server, params: types.CallHierarchyOutgoingCallsParams) -> list[types.CallHierarchyOutgoingCall]:
    known = _program_of(server, params.item)
    return [types.CallHierarchyOutgoingCall(item, [location(server, place).range])
            for key, place in (called(*known) if known is not None else ())
            if known is not None and (item := _item(server, known[0], key)) is not None]


FEATURES: tuple[tuple[str, Any, Callable[..., Any]], ...] = (
    (types.TEXT_DOCUMENT_HOVER, None, hover),
    (types.TEXT_DOCUMENT_DEFINITION, None, definition),
    (types.TEXT_DOCUMENT_TYPE_DEFINITION, None, type_definition),
    (types.TEXT_DOCUMENT_REFERENCES, None, find_references),
    (types.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT, None, highlight),
    (types.TEXT_DOCUMENT_DOCUMENT_SYMBOL, None, document_symbols),
    (types.WORKSPACE_SYMBOL, None, workspace_symbols),
    (types.TEXT_DOCUMENT_PREPARE_CALL_HIERARCHY, None, prepare_calls),
    (types.CALL_HIERARCHY_INCOMING_CALLS, None, incoming_calls),
    (types.CALL_HIERARCHY_OUTGOING_CALLS, None, outgoing_calls),
)
"""Method of the protocol, its options, and the function that answers it."""
