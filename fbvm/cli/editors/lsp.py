"""`fbvm lsp`: the language server."""

from __future__ import annotations

import gc
import os
import sys

import click

import fbvm
from fbvm.cli.shared import status
from fbvm.cli.shared.ending import loading
from fbvm.cli.shared.files import check_free_files

COLLECTED = (50_000, 20, 1_000)
"""New objects after which Python looks for garbage, and how rarely it looks at old ones, of which a program has many: that
would hold up a key for tenths of a second.  The server looks at all of them when nobody types."""

OWN_FILES = 6
"""Files and sockets that the server has open for itself."""


@click.command("lsp")
@click.option("--stdio", is_flag=True, help="Speak over the standard input and output, which is what it does anyway.")
def command(stdio: bool) -> None:
    """Tell an editor about Structured Text, ladder, charts and fbvm.toml, by the Language Server Protocol over standard input
    and output: mistakes while one types, hover, completion, renaming and so on.

    An editor starts it; `docs/howto` has the lines of configuration for some.  It needs the extra `editor`."""
    check_free_files(OWN_FILES)
    try:
        with loading():
            from fbvm.lsp.features import server
    except ImportError:
        raise click.UsageError("pygls is missing: pip install 'fbvm[editor]'") from None
    gc.set_threshold(*COLLECTED)
    with os.fdopen(os.dup(sys.stdout.fileno()), "wb") as output:  # the server closes it at its end
        try:
            server(fbvm.__version__).start_io(stdout=output)
        except (OverflowError, MemoryError):
            raise click.ClickException("the editor has begun a message that is longer than any memory") from None
    sys.exit(status.GOOD)
