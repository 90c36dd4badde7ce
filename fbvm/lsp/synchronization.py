"""How the server learns of texts: files that are opened, changed, closed, and written by others."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from lsprotocol import types

from fbvm.lsp.projects import path_of
from fbvm.lsp.server import Server

WATCHED = ("**/*.st", "**/fbvm.toml", "**/*.{TcPOU,TcDUT,TcTLEO,TcGVL,TcIO,TcTTO,plcproj,tsproj,cxp,cxt}")
"""Files whose changes on disk the editor tells of."""


def initialize(server: Server, params: types.InitializeParams) -> None:
    """Take the settings that come with the first message."""
    server.configure(params.initialization_options or {})


def initialized(server: Server, params: types.InitializedParams) -> None:
    """Ask the editor to watch files, if it can."""
    workspace = server.client_capabilities.workspace
    watches = workspace.did_change_watched_files if workspace is not None else None
    if watches is not None and watches.dynamic_registration:
        options = types.DidChangeWatchedFilesRegistrationOptions([types.FileSystemWatcher(shape) for shape in WATCHED])
        server.client_register_capability(types.RegistrationParams(
            [types.Registration("fbvm-files", types.WORKSPACE_DID_CHANGE_WATCHED_FILES, options)]))


def did_open(server: Server, params: types.DidOpenTextDocumentParams) -> None:
    server.opened(params.text_document.uri)


def did_change(server: Server, params: types.DidChangeTextDocumentParams) -> None:
    server.text_changed(params.text_document.uri)


def did_close(server: Server, params: types.DidCloseTextDocumentParams) -> None:
    server.closed(params.text_document.uri)


def did_change_watched_files(server: Server, params: types.DidChangeWatchedFilesParams) -> None:
    for change in params.changes:
        server.disk_changed(path_of(change.uri))


def did_change_configuration(server: Server, params: types.DidChangeConfigurationParams) -> None:
    server.configure(params.settings)
    server.project_file_changed(None)


FEATURES: tuple[tuple[str, Any, Callable[..., Any]], ...] = (
    (types.INITIALIZE, None, initialize),
    (types.INITIALIZED, None, initialized),
    (types.TEXT_DOCUMENT_DID_OPEN, None, did_open),
    (types.TEXT_DOCUMENT_DID_CHANGE, None, did_change),
    (types.TEXT_DOCUMENT_DID_CLOSE, None, did_close),
    (types.WORKSPACE_DID_CHANGE_WATCHED_FILES, None, did_change_watched_files),
    (types.WORKSPACE_DID_CHANGE_CONFIGURATION, None, did_change_configuration),
)
"""Method of the protocol, its options, and the function that answers it."""
