"""Import of a project of CX-Programmer: the bytes of a file in, source files and diagnostics out."""

from __future__ import annotations

from fbvm.base.diagnostics import Diagnostic
from fbvm.interchange.cx.markup import read_markup
from fbvm.interchange.cx.read.places import places
from fbvm.interchange.cx.read.project import Plc, Reading, read_plcs
from fbvm.interchange.cx.read.sources import sources
from fbvm.interchange.imported import Imported


def import_project(data: bytes, name: str, plc: str | None = None, encoding: str = "",
                   memory: bool = False) -> Imported:
    """Import a `.cxp` or `.cxt` file.

    data: the bytes of the file.  name: what diagnostics call it.
    plc: the name of the PLC, where the project has several.
    encoding: the code page of the PC that wrote it, as Python names it; found out if not given.
    memory: take the contents of the memory window as initial values of D, H and W.

    Never raises for what the file contains."""
    text = read_markup(data, name, encoding)
    if isinstance(text, Diagnostic):
        return Imported({}, [text])
    reading = Reading(text)
    found = _chosen(reading, read_plcs(text), plc)
    files, origins = sources(reading, found, memory) if found else ({}, {})
    return Imported(files, sorted(reading.diagnostics, key=Diagnostic.order), is_text=not text.compressed,
                    find_places=lambda: {file: places(files[file], origin, text) for file, origin in origins.items()})


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
