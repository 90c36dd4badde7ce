"""Files that verbs write; an error of the host is reported as an error of usage."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click

from fbvm.base.files import reason


@contextmanager
def writing(target: Path | str) -> Iterator[None]:
    """For a `with` block that opens and writes `target`: an OSError in it ends the verb with status 2 and a message."""
    try:
        yield
    except OSError as error:
        raise click.UsageError(f"{target} cannot be written: {reason(error)}") from None
