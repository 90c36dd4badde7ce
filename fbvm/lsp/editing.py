"""Help with changes of a text: completion, the signature of a call, renaming, formatting, quick fixes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from lsprotocol import types
from pygls.exceptions import JsonRpcInvalidParams

from fbvm.analysis.calls import signature
from fbvm.analysis.completion import Item, complete, documentation, nearest
from fbvm.analysis.fixes import fixes
from fbvm.analysis.parts import File, common_beginning
from fbvm.analysis.references import Refusal, rename, use_at
from fbvm.base.diagnostics import Source
from fbvm.check.spelling import OUTSIDE
from fbvm.lsp import foreign, project_file
from fbvm.lsp.navigation import location, offset_of
from fbvm.lsp.projects import path_of
from fbvm.lsp.server import Server
from fbvm.run.project import FILE
from fbvm.syntax.formatter.formatter import formatted

_KINDS = {
    "variable": types.CompletionItemKind.Variable, "pin": types.CompletionItemKind.Property,
    "function": types.CompletionItemKind.Function, "block": types.CompletionItemKind.Class,
    "type": types.CompletionItemKind.Struct, "enumerator": types.CompletionItemKind.EnumMember,
    "keyword": types.CompletionItemKind.Keyword, "address": types.CompletionItemKind.Reference,
    "instruction": types.CompletionItemKind.Operator, "action": types.CompletionItemKind.Method,
    "method": types.CompletionItemKind.Method, "property": types.CompletionItemKind.Property,
    "namespace": types.CompletionItemKind.Module}


# --- completion -----------------------------------------------------------------------------------------------------------


async def completion(server: Server, params: types.CompletionParams) -> types.CompletionList:
    uri = params.text_document.uri
    if path_of(uri).name == FILE:
        return types.CompletionList(False, _of_project_file(server, uri, params.position))
    known = await server.ready(uri)
    if known is None:
        return types.CompletionList(False, [])
    project, file = known
    offset = offset_of(server, file, params.position)
    return types.CompletionList(False, [_item(server, file, offset, each)
                                        for each in nearest(complete(project.program, file.name, offset))])


def _of_project_file(server: Server, uri: str, position: types.Position) -> list[types.CompletionItem]:
    source = Source(FILE, server.text(uri))
    offset = server.positions(source).offset(position)
    return [types.CompletionItem(label, kind=types.CompletionItemKind.Property, documentation=meaning, insert_text=text)
            for label, meaning, text in project_file.completions(source.text, offset)]


def _item(server: Server, file: File, offset: int, item: Item) -> types.CompletionItem:
    made = types.CompletionItem(item.label, kind=_KINDS[item.kind], detail=item.detail or None,
                                sort_text=f"{item.rank}{item.label}", data=item.page or None)
    if item.kind == "address":  # editors take the `%` for the end of a word
        start = offset
        while start > 0 and (file.text[start - 1].isalnum() or file.text[start - 1] in "%._"):
            start -= 1
        made.text_edit = types.TextEdit(server.positions(file.source).range(start, offset), item.label)
        made.filter_text = item.label
    elif item.insert:
        made.insert_text = item.insert if _snippets(server) else item.insert.partition("$")[0] or item.label
        made.insert_text_format = types.InsertTextFormat.Snippet if _snippets(server) else types.InsertTextFormat.PlainText
    return made


def _snippets(server: Server) -> bool:
    """True if the editor takes texts with places to fill in."""
    document = server.client_capabilities.text_document
    known = document.completion.completion_item if document is not None and document.completion is not None else None
    return bool(known is not None and known.snippet_support)


def completion_resolve(server: Server, item: types.CompletionItem) -> types.CompletionItem:
    if isinstance(item.data, str) and (said := documentation(item.data)):
        item.documentation = types.MarkupContent(types.MarkupKind.Markdown, said)
    return item


async def signature_help(server: Server, params: types.SignatureHelpParams) -> types.SignatureHelp | None:
    known = await server.ready(params.text_document.uri)
    if known is None:
        return None
    project, file = known
    found = signature(project.program, file.name, offset_of(server, file, params.position))
    if found is None:
        return None
    parameters = [types.ParameterInformation(each) for each in found.parameters]
    shown = types.SignatureInformation(found.label, found.documentation or None, parameters, found.active)
    return types.SignatureHelp([shown], 0, found.active)


# --- renaming -------------------------------------------------------------------------------------------------------------


async def prepare_rename(server: Server, params: types.PrepareRenameParams) -> types.Range | None:
    known = await server.ready(params.text_document.uri)
    if known is None:
        return None
    project, file = known
    if foreign.is_foreign(path_of(params.text_document.uri)):
        return None
    used = use_at(project.program, file.name, offset_of(server, file, params.position))
    if used is None or used[1].key[1] or used[1].key[0] == "standard":
        return None
    part, use = used
    return server.positions(file.source).range(part.base + use.start, part.base + use.end)


async def rename_symbol(server: Server, params: types.RenameParams) -> types.WorkspaceEdit | None:
    known = await server.ready(params.text_document.uri)
    if known is None:
        return None
    project, file = known
    try:
        places = rename(project.program, file.name, offset_of(server, file, params.position), params.new_name)
    except Refusal as refusal:
        raise JsonRpcInvalidParams(str(refusal)) from None
    for place in places:
        path = foreign.container_of(place.file.name) or Path(place.file.name)
        if foreign.is_foreign(path):
            raise JsonRpcInvalidParams(f"{path.name} uses the name, which another tool writes: rename it there")
    changes: dict[str, list[types.TextEdit]] = {}
    for place in places:
        there = location(server, place)
        changes.setdefault(there.uri, []).append(types.TextEdit(there.range, params.new_name))
    return types.WorkspaceEdit(changes)


# --- formatting -----------------------------------------------------------------------------------------------------------


def format_document(server: Server, params: types.DocumentFormattingParams) -> list[types.TextEdit]:
    return _formatted(server, params.text_document.uri, None)


def format_range(server: Server, params: types.DocumentRangeFormattingParams) -> list[types.TextEdit]:
    return _formatted(server, params.text_document.uri, params.range)


def _formatted(server: Server, uri: str, only: types.Range | None) -> list[types.TextEdit]:
    """The change of a text to its canonical form, or of the declarations that a range touches; none with syntax errors."""
    path = path_of(uri)
    file = next((each.program.files[str(path)] for each in server.projects.of(path) if str(path) in each.program.files), None)
    if file is None or foreign.is_foreign(path):
        return []
    positions = server.positions(file.source)
    start, end = 0, len(file.text)
    if only is not None:
        first, last = positions.offset(only.start), positions.offset(only.end)
        chosen = range(first, max(last, first + 1))  # a cursor stands in front of a character
        touched = [each for each in file.parts if each.base < chosen.stop and first < each.base + len(each.source.text)]
        touched = touched or file.parts[-1:]
        start, end = touched[0].base, touched[-1].base + len(touched[-1].source.text)
    before = file.text[start:end]
    after, wrong = formatted(Source(file.name, before), OUTSIDE)
    if only is not None:  # what stands between two declarations stays
        lead, tail = before[:len(before) - len(before.lstrip())], before[len(before.rstrip()):]
        after = lead + after.strip() + tail
    if wrong or after == before:
        return []
    same = common_beginning(before, after)
    behind = common_beginning(before[same:][::-1], after[same:][::-1])
    return [types.TextEdit(positions.range(start + same, end - behind), after[same:len(after) - behind])]


# --- quick fixes ----------------------------------------------------------------------------------------------------------


async def code_actions(server: Server, params: types.CodeActionParams) -> list[types.CodeAction]:
    uri = params.text_document.uri
    wanted = params.context.only
    if wanted is not None and not any(each in ("", types.CodeActionKind.QuickFix) for each in wanted):
        return []
    known = await server.ready(uri)
    if known is None or not params.context.diagnostics or foreign.is_foreign(path_of(uri)):
        return []
    project, file = known
    positions = server.positions(file.source)
    start, end = positions.offset(params.range.start), positions.offset(params.range.end)
    made = []
    for fix in fixes(project.program, file.name, start, end):
        edits = [types.TextEdit(positions.range(first, last), text) for first, last, text in fix.edits]
        made.append(types.CodeAction(fix.title, types.CodeActionKind.QuickFix, [server.diagnostic(fix.diagnostic, file.source)],
                                     fix.best or None, edit=types.WorkspaceEdit({server.uri(Path(file.name)): edits})))
    return made


FEATURES: tuple[tuple[str, Any, Callable[..., Any]], ...] = (
    (types.TEXT_DOCUMENT_COMPLETION, types.CompletionOptions(trigger_characters=[".", "#", "%", "("], resolve_provider=True),
     completion),
    (types.COMPLETION_ITEM_RESOLVE, None, completion_resolve),
    (types.TEXT_DOCUMENT_SIGNATURE_HELP, types.SignatureHelpOptions(trigger_characters=["(", ","]), signature_help),
    (types.TEXT_DOCUMENT_PREPARE_RENAME, None, prepare_rename),
    (types.TEXT_DOCUMENT_RENAME, types.RenameOptions(prepare_provider=True), rename_symbol),
    (types.TEXT_DOCUMENT_FORMATTING, None, format_document),
    (types.TEXT_DOCUMENT_RANGE_FORMATTING, None, format_range),
    (types.TEXT_DOCUMENT_CODE_ACTION, types.CodeActionOptions(code_action_kinds=[types.CodeActionKind.QuickFix]), code_actions),
)
"""Method of the protocol, its options, and the function that answers it."""
