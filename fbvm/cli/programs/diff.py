"""`fbvm diff`: what differs between two versions of a program, rungs side by side."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from fbvm.base.diagnostics import Diagnostic, Source, errors
from fbvm.cli.shared import status
from fbvm.cli.shared.given_sources import inputs
from fbvm.cli.shared.paths import SourcePath
from fbvm.cli.shared.run_result import chart_width
from fbvm.cli.shared.sources import report_diagnostics
from fbvm.cli.shared.terminal import say
from fbvm.interchange.contents import Contents, contents
from fbvm.record.draw.difference import differences
from fbvm.syntax.text import read


@click.command("diff")
@click.argument("old", metavar="OLD", type=SourcePath())
@click.argument("new", metavar="NEW", type=SourcePath())
@click.option("-q", "--quiet", is_flag=True, help="Print nothing; the exit status tells.")
@click.option("--width", type=click.IntRange(min=24), help="Columns of text; the terminal's if not given.")
def command(old: Path, new: Path, quiet: bool, width: int | None) -> None:
    """Show what differs between two versions of a program: symbols, and rungs added, removed and changed, drawn side by side.

    OLD and NEW are each a source file, a folder of sources, or a project of CX-Programmer (.cxp, .cxt). Status 0 if nothing
    differs, 1 if something does."""
    found = list(differences(_contents(old), _contents(new), width or chart_width()))
    for one in found if not quiet else ():
        say(f"{one.where}: {one.what}", bold=True)
        for line in one.lines:
            say(line)
        say()
    if found:
        sys.exit(status.FAILED)


def _contents(path: Path) -> Contents:
    """What a file or folder holds.  Ends the verb with status 3 if it cannot be read."""
    given, found = inputs(sorted(path.rglob("*.st")) if path.is_dir() else [path])
    texts = [one if isinstance(one, Source) else read(one, str(one)) for one in given]
    wrong = errors([*found, *(text for text in texts if isinstance(text, Diagnostic))])
    made = contents(text for text in texts if isinstance(text, Source))
    wrong += made.diagnostics
    if wrong:
        report_diagnostics(wrong, False)
        sys.exit(status.PROGRAM_ERRORS)
    return made
