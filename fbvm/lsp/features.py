"""The server with all that it answers."""

from __future__ import annotations

from fbvm.lsp import appearance, editing, navigation, synchronization
from fbvm.lsp.server import Server


def server(version: str) -> Server:
    """A server that answers all that fbvm knows to answer; `version` is what it tells its client."""
    made = Server(version)
    for module in (synchronization, navigation, editing, appearance):
        for method, options, function in module.FEATURES:
            made.feature(method, options)(function)
    return made
