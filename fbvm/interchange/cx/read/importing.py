"""Import of a project of CX-Programmer: the bytes of a file in, source files and diagnostics out."""

from __future__ import annotations

from dataclasses import dataclass

from fbvm.base.diagnostics import Diagnostic, errors
from fbvm.interchange.cx.markup import read_markup
from fbvm.interchange.cx.read.project import Plc, Reading, read_plcs
from fbvm.interchange.cx.read.sources import sources


@dataclass(frozen=True)
class ImportedProject:
    """The result of an import."""

    files: dict[str, str]
    """Source texts by file name: global symbols, each function block, each program, and which programs run."""
    diagnostics: list[Diagnostic]
    """What could not be taken over, in the order of the file."""

    @property
    def errors(self) -> list[Diagnostic]:
        """Diagnostics about parts of the program that were not taken over."""
        return errors(self.diagnostics)


def import_project(data: bytes, name: str, plc: str | None = None, encoding: str = "",
                   memory: bool = False) -> ImportedProject:
    """Import a `.cxp` or `.cxt` file.

    data: the bytes of the file.  name: what diagnostics call it.
    plc: the name of the PLC, where the project has several.
    encoding: the code page of the PC that wrote it, as Python names it; found out if not given.
    memory: take the contents of the memory window as initial values of D, H and W.

    Never raises for what the file contains."""
    text = read_markup(data, name, encoding)
    if isinstance(text, Diagnostic):
        return ImportedProject({}, [text])
    reading = Reading(text)
    found = _chosen(reading, read_plcs(text), plc)
    files = sources(reading, found, memory) if found else {}
    return ImportedProject(files, sorted(reading.diagnostics, key=Diagnostic.order))


def _chosen(reading: Reading, plcs: list[Plc], name: str | None) -> Plc | None:
    """The PLC of that name, or the only one; None after a diagnostic."""
    fitting = [one for one in plcs if name is None or one.name.casefold() == name.casefold()]
    if len(fitting) == 1:
        return fitting[0]
    names = ", ".join(one.name for one in plcs)
    if not plcs:
        reading.report("X0401", 0, "the project holds no PLC", "save the project of a PLC")
    elif fitting:
        reading.report("X0401", 0, f"the project holds several PLCs ({names})", "choose one by its name: --resource NAME")
    else:
        reading.report("X0401", 0, f"the project has no PLC {name}", f"it has {names}")
    return None
