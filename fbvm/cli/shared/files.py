"""Files that verbs write: what the host does not let be written is a mistake of usage."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click


@contextmanager
def writing(target: Path | str) -> Iterator[None]:
    """Around all that opens and writes `target`: ends with status 2 and what the host says, if it says no."""
    try:
        yield
    except OSError as error:
        raise click.UsageError(f"{target} cannot be written: {(error.strerror or str(error)).lower()}") from None
