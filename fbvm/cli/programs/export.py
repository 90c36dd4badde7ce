"""`fbvm export`: programs to PLCopen XML, which CODESYS, Beremiz and OpenPLC Editor open, or into a project of CX-Programmer."""

from __future__ import annotations

import sys
from datetime import UTC, datetime
from pathlib import Path

import click

from fbvm.base.diagnostics import Source, errors
from fbvm.base.files import SOURCE_BYTES, read_file, write_file
from fbvm.cli.shared import status
from fbvm.cli.shared.files import writing
from fbvm.cli.shared.given_sources import inputs
from fbvm.cli.shared.paths import ExistingPath, SourcePath, sources_in
from fbvm.cli.shared.sources import report_diagnostics
from fbvm.cli.shared.terminal import say
from fbvm.interchange.cx.write.exporting import UNTRIED, export_into
from fbvm.interchange.plcopen.write.exporting import BEGINNING, export_xml
from fbvm.syntax.text import read


@click.command("export")
@click.argument("files", nargs=-1, required=True, metavar="FILE...", type=SourcePath())
@click.option("-o", "--output", "document", metavar="OUT", required=True, type=click.Path(dir_okay=False, path_type=Path),
              help="The document that is written.")
@click.option("--into", "saved", type=ExistingPath(dir_okay=False), metavar="SAVED.cxt",
              help="Write rungs, symbols and comments into a project that CX-Programmer saved (.cxt or .cxp); OUT is one, too.")
@click.option("--resource", "plc", metavar="NAME", help="With --into: the PLC, where the project has several.")
@click.option("--json", "as_json", is_flag=True, help="Print messages as one JSON object.")
def command(files: tuple[Path, ...], document: Path, saved: Path | None, plc: str | None, as_json: bool) -> None:
    """Write the files as a project in PLCopen XML (TC6 2.01), and say what it does not hold.  Of a folder, all its files that
    end in .st are taken.

    Structured Text stays as it is, LADDER .. END_LADDER and charts are drawn. With --into, what differs from the project that
    CX-Programmer saved is replaced in a copy of it, and every other byte stays. Status 3 if something is left out."""
    files = tuple(file for given in files for file in (sources_in(given) if given.is_dir() else [given]))
    if not files:
        raise click.UsageError("there is no source in this folder")
    if saved:
        _export_into(saved, files, document, plc, as_json)
        return
    latest = max(file.stat().st_mtime for file in files)
    try:
        created = datetime.fromtimestamp(int(latest), UTC).strftime("%Y-%m-%dT%H:%M:%S")
    except (ArithmeticError, ValueError, OSError):  # a time that no calendar has
        created = BEGINNING
    given, found = inputs(files)
    made = export_xml(given, document.stem, created)
    if found or made.diagnostics or as_json:
        report_diagnostics([*found, *made.diagnostics], as_json)
    if made.text is not None:
        with writing(document):
            write_file(document, made.text)
    if made.errors or errors(found):
        sys.exit(status.PROGRAM_ERRORS)


def _export_into(saved: Path, files: tuple[Path, ...], document: Path, plc: str | None, as_json: bool) -> None:
    """Writes a copy of a saved project with the rungs and symbols of the files."""
    given, found = inputs(files)
    texts = [one if isinstance(one, Source) else read(one, str(one)) for one in given]
    sources = [text for text in texts if isinstance(text, Source)]
    found += [text for text in texts if not isinstance(text, Source)]
    if found:
        report_diagnostics(found, as_json)
        sys.exit(status.PROGRAM_ERRORS)
    made = export_into(read_file(saved, SOURCE_BYTES), str(saved), sources, document.suffix.lower() == ".cxp", plc)
    if made.diagnostics or as_json:
        report_diagnostics(made.diagnostics, as_json)
    if made.data is None:
        sys.exit(status.PROGRAM_ERRORS)
    with writing(document):
        write_file(document, made.data)
    for line in made.changed if not as_json else ():
        say(line)
    if not as_json:
        say(f"{document} is written; {UNTRIED if made.changed else f'nothing differs from {saved}'}", err=True)
