"""`fbvm import`: programs from PLCopen XML, as CODESYS, Beremiz and OpenPLC Editor write it, from CX-Programmer and from
CODESYS 2.3."""

from __future__ import annotations

import codecs
import sys
from dataclasses import replace
from pathlib import Path

import click

from fbvm.base.files import SOURCE_BYTES, read_file, write_file
from fbvm.cli.shared import status
from fbvm.cli.shared.files import in_the_way, writing
from fbvm.cli.shared.paths import ExistingPath
from fbvm.cli.shared.sources import report_diagnostics
from fbvm.cli.shared.terminal import say
from fbvm.interchange.codesys2 import is_binary, is_export
from fbvm.interchange.codesys2.importing import import_codesys2, library_description
from fbvm.interchange.cx.read.importing import import_project
from fbvm.interchange.dialect_signs import FAMILIES
from fbvm.interchange.formats.given import PROJECT_SUFFIXES, TWINCAT_SUFFIXES, is_cx_project
from fbvm.interchange.imported import Imported
from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.interchange.plcopen.read.producer import ORDERS


@click.command("import")
@click.argument("file", metavar="FILE", type=ExistingPath(dir_okay=False))
@click.option("-o", "--output", "folder", metavar="DIR", required=True, type=click.Path(file_okay=False, path_type=Path),
              help="Where the sources go, a POU a file; made if it is not there.")
@click.option("--force", is_flag=True, help="Write over files that are there.")
@click.option("--resource", "plc", metavar="NAME", help="The PLC, where a project of CX-Programmer has several.")
@click.option("--encoding", metavar="NAME", default="", help="The code page of the PC that wrote a .cxp or .cxt, such as cp932; "
              "found out if not given.")
@click.option("--memory", is_flag=True, help="Of a .cxp or .cxt, take the contents of D, H, W and E as initial values.")
@click.option("--order", type=click.Choice(list(ORDERS)), help="Of PLCopen XML, in which order "
              "drawings are evaluated; without it, as the tool that wrote the document does it. `network`: producers in front of "
              "consumers; `beremiz1`, `document`, `position`: as generators of Beremiz and OpenPLC Editor; `ids`: by number.")
@click.option("--json", "as_json", is_flag=True, help="Print messages as one JSON object.")
def command(file: Path, folder: Path, force: bool, plc: str | None, encoding: str, memory: bool, order: str | None,
            as_json: bool) -> None:
    """Make sources of a project in PLCopen XML, of CX-Programmer (.cxp, .cxt) or of CODESYS 2.3 (.exp, .pro, .lib), and say what
    could not be taken over. Sources of a .lib get a library.toml: `--library DIR` then finds its blocks by name.

    Ladder becomes LADDER .. END_LADDER where mnemonics say exactly what was drawn, else statements; diagrams of function
    blocks become statements in the order of their evaluation. Status 3 if the program lacks something now."""
    if file.suffix.lower() in (*PROJECT_SUFFIXES, *TWINCAT_SUFFIXES):
        raise click.UsageError(f"{file} needs no import: `fbvm check {file}` and all other verbs on programs take TwinCAT's "
                               "files as they are")  # fmt: skip
    made = _imported(file, order or "", plc, encoding, memory)
    if not force and (there := in_the_way({folder / name: text for name, text in made.files.items()})):
        raise click.UsageError(f"{there[0]} is there already; --force writes over it")
    if made.diagnostics or as_json:
        report_diagnostics(made.diagnostics, as_json)
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        for name, text in made.files.items():
            if (folder / name).is_symlink():
                (folder / name).unlink()  # the file goes into the folder, not where a link leads
            write_file(folder / name, text)
    for name in made.files if not as_json else ():
        say(str(folder / name))
    if not as_json and made.family in FAMILIES:
        say(f"these sources are written for --dialect {FAMILIES[made.family]}: {made.because}", err=True)
    if made.errors:
        sys.exit(status.PROGRAM_ERRORS)


def _imported(file: Path, order: str, plc: str | None, encoding: str, memory: bool) -> Imported:
    """The sources within a file, by its kind."""
    if is_cx_project(file):
        return import_project(read_file(file, SOURCE_BYTES), str(file), plc, _encoding(encoding), memory)
    data = read_file(file, SOURCE_BYTES) if file.is_file() else b""
    if not is_export(data) and not is_binary(data):
        return import_xml(file, order=order)
    made = import_codesys2(data, str(file))
    if file.suffix.lower() != ".lib" or not made.files:
        return made
    return replace(made, files=made.files | {"library.toml": library_description(made, file.stem)})


def _encoding(name: str) -> str:
    """The name of an encoding.  Raises BadParameter for one that there is not."""
    try:
        return codecs.lookup(name).name if name else ""
    except LookupError:
        raise click.BadParameter(f"{name} is no encoding; write cp1252, cp932, cp949 or utf-8", param_hint="--encoding") from None
