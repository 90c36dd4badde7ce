"""How a text looks: colours by what names are, folding, words above programs, addresses behind names."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from lsprotocol import types

from fbvm.analysis.outline import folds, lenses
from fbvm.analysis.tokens import MODIFIERS, TYPES, address_hints, tokens
from fbvm.lsp.navigation import file_of
from fbvm.lsp.server import Server

LEGEND = types.SemanticTokensLegend(list(TYPES), list(MODIFIERS))
_FOLDS = {"comment": types.FoldingRangeKind.Comment, "region": types.FoldingRangeKind.Region}
_TITLES = {"run": "Run", "debug": "Debug", "chart": "Chart", "test": "Test", "debug test": "Debug test"}


async def semantic_tokens(server: Server, params: types.SemanticTokensParams) -> types.SemanticTokens:
    known = await server.ready(params.text_document.uri)
    data: list[int] = []
    if known is None:
        return types.SemanticTokens(data)
    project, file = known
    positions = server.positions(file.source)
    line = column = 0
    for token in tokens(project.program, file):
        place = positions.range(token.start, token.end)
        if place.start.line != line:
            column = 0
        bits = sum(1 << MODIFIERS.index(each) for each in token.modifiers)
        data += [place.start.line - line, place.start.character - column, place.end.character - place.start.character,
                 TYPES.index(token.type), bits]
        line, column = place.start.line, place.start.character
    return types.SemanticTokens(data)


def folding_ranges(server: Server, params: types.FoldingRangeParams) -> list[types.FoldingRange]:
    file = file_of(server, params.text_document.uri)
    return [types.FoldingRange(each.first, each.last, kind=_FOLDS.get(each.kind))
            for each in (folds(file) if file is not None else ())]


def code_lenses(server: Server, params: types.CodeLensParams) -> list[types.CodeLens]:
    file = file_of(server, params.text_document.uri)
    if file is None:
        return []
    positions = server.positions(file.source)
    return [types.CodeLens(positions.range(each.start, each.end), types.Command(
        _TITLES[each.command], f"fbvm.{each.command.replace(' t', 'T')}", arguments=[params.text_document.uri, each.name]))
        for each in lenses(file)]


async def inlay_hints(server: Server, params: types.InlayHintParams) -> list[types.InlayHint]:
    known = await server.ready(params.text_document.uri)
    if known is None:
        return []
    project, file = known
    positions = server.positions(file.source)
    start, end = positions.offset(params.range.start), positions.offset(params.range.end)
    return [types.InlayHint(positions.position(each.at), each.text, padding_left=True)
            for each in address_hints(project.program, file, start, end)]


FEATURES: tuple[tuple[str, Any, Callable[..., Any]], ...] = (
    (types.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL, LEGEND, semantic_tokens),
    (types.TEXT_DOCUMENT_FOLDING_RANGE, None, folding_ranges),
    (types.TEXT_DOCUMENT_CODE_LENS, types.CodeLensOptions(), code_lenses),
    (types.TEXT_DOCUMENT_INLAY_HINT, None, inlay_hints),
)
"""Method of the protocol, its options, and the function that answers it."""
