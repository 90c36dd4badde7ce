"""The sources that a command line names: files, and the sources within projects and documents of other tools."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.base.files import reason
from fbvm.interchange.formats import given
from fbvm.interchange.imported import Imported
from fbvm.syntax.text import read


def within(path: Path) -> Imported | None:
    """The sources within a file of another tool; None for all others.

    The options --resource and --memory of the present command choose a PLC where the project has several, and the contents of
    its memory window.  Ends the verb with status 2 if the file cannot be read."""
    try:
        return given.within(path, *_options())
    except OSError as error:
        raise click.UsageError(f"{path} cannot be read: {reason(error)}") from None


def _options() -> tuple[str | None, bool]:
    """What --resource and --memory say."""
    context = click.get_current_context(silent=True)
    meta = context.meta if context else {}
    return meta.get("fbvm.resource"), bool(meta.get("fbvm.memory"))


def given_sources(paths: Sequence[Path]) -> dict[str, Path | str]:
    """By the name that messages use, each source of these files: its path, or its text if it stands within a project."""
    return given.sources_by_name(_found(paths))


def inputs(paths: Sequence[Path]) -> tuple[list[Path | Source], list[Diagnostic]]:
    """What the compiler takes for these files, and what is said about projects among them."""
    return given.inputs_of(_found(paths))


def _found(paths: Sequence[Path]) -> dict[Path, Imported | None]:
    return {path: within(path) for path in paths}


def families(paths: Sequence[Path]) -> list[tuple[str, str]]:
    """The family of tools that wrote each document among some files, with the reason."""
    found = map(within, paths)
    return [(made.family, made.because) for made in found if made is not None and made.because]


def sources_of(paths: Sequence[Path]) -> list[Source]:
    """The sources of these files that can be read."""
    texts = [one if isinstance(one, Source) else read(one, str(one)) for one in inputs(paths)[0]]
    return [text for text in texts if isinstance(text, Source)]
