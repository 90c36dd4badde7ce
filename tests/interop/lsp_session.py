"""What the client of pytest-lsp says to `fbvm lsp` as VS Code, Neovim or Emacs: python lsp_session.py PYTHON FOLDER CLIENT.

Its python is one that has pytest-lsp, PYTHON one that has fbvm.  Prints what it got as JSON."""

from __future__ import annotations

import asyncio
import json
import sys
from pathlib import Path

from lsprotocol import types
from pytest_lsp import client_capabilities, make_test_lsp_client

PUBLISHED = "textDocument/publishDiagnostics"


async def session(python: str, folder: Path, name: str) -> dict[str, object]:
    """Opens a file with a mistake, asks about it, and mends it."""
    client, file = make_test_lsp_client(), folder / "pump.st"
    text, uri = file.read_text(encoding="utf-8"), file.as_uri()
    await client.start_io(python, "-m", "fbvm", "lsp")
    said = await client.initialize_session(types.InitializeParams(
        capabilities=client_capabilities(name), root_uri=folder.as_uri(),
        workspace_folders=[types.WorkspaceFolder(folder.as_uri(), "work")]))  # fmt: skip
    found: dict[str, object] = {"encoding": said.capabilities.position_encoding}

    async def codes() -> list[object]:
        await client.wait_for_notification(PUBLISHED)
        return [each.code for each in client.diagnostics[uri]]

    client.text_document_did_open(types.DidOpenTextDocumentParams(types.TextDocumentItem(uri, "iecst", 1, text)))
    found["wrong"] = await codes()
    document, wrong = types.TextDocumentIdentifier(uri), client.diagnostics[uri][0]
    actions = await client.text_document_code_action_async(types.CodeActionParams(
        document, wrong.range, types.CodeActionContext([wrong])))  # fmt: skip
    found["fixes"] = [each.title for each in actions or []]
    at = types.Position(1, text.splitlines()[1].index("Level"))
    hover = await client.text_document_hover_async(types.HoverParams(document, at))
    found["hover"] = "INT" in str(hover.contents) if hover else False
    symbols = await client.text_document_document_symbol_async(types.DocumentSymbolParams(document))
    found["symbols"] = [each.name for each in symbols or []]
    completed = await client.text_document_completion_async(types.CompletionParams(document, wrong.range.start))
    items = completed.items if isinstance(completed, types.CompletionList) else completed or []
    found["completion"] = "Level" in {each.label for each in items}
    tokens = await client.text_document_semantic_tokens_full_async(types.SemanticTokensParams(document))
    found["tokens"] = len(tokens.data) % 5 if tokens else None
    change = types.TextDocumentContentChangePartial(wrong.range, "Level")
    client.text_document_did_change(types.DidChangeTextDocumentParams(types.VersionedTextDocumentIdentifier(2, uri), [change]))
    found["mended"] = await codes()
    await client.shutdown_session()
    await client.stop()
    return found


if __name__ == "__main__":
    print(json.dumps(asyncio.run(session(sys.argv[1], Path(sys.argv[2]), sys.argv[3]))))
