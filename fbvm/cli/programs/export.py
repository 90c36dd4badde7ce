"""`fbvm export`: programs to PLCopen XML, which CODESYS, Beremiz and OpenPLC Editor open."""

from __future__ import annotations

import sys
from datetime import UTC, datetime
from pathlib import Path

import click

from fbvm.base.files import write_file
from fbvm.cli.shared import status
from fbvm.cli.shared.files import writing
from fbvm.cli.shared.paths import SourcePath
from fbvm.cli.shared.sources import report_diagnostics
from fbvm.interchange.plcopen.write.exporting import BEGINNING, export_xml


@click.command("export")
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=SourcePath(dir_okay=False))
@click.option("-o", "--output", "document", metavar="OUT.xml", required=True, type=click.Path(dir_okay=False, path_type=Path),
              help="The document that is written.")
@click.option("--json", "as_json", is_flag=True, help="Print messages as one JSON object.")
def command(files: tuple[Path, ...], document: Path, as_json: bool) -> None:
    """Write the files as a project in PLCopen XML (TC6 2.01), and say what it does not hold.

    Structured Text stays as it is, LADDER .. END_LADDER and charts are drawn. Status 3 if something is left out."""
    latest = max(file.stat().st_mtime for file in files)
    try:
        created = datetime.fromtimestamp(int(latest), UTC).strftime("%Y-%m-%dT%H:%M:%S")
    except (ArithmeticError, ValueError, OSError):  # a time that no calendar has
        created = BEGINNING
    made = export_xml(files, document.stem, created)
    if made.diagnostics or as_json:
        report_diagnostics(made.diagnostics, as_json)
    if made.text is not None:
        with writing(document):
            write_file(document, made.text)
    if made.errors:
        sys.exit(status.PROGRAM_ERRORS)
