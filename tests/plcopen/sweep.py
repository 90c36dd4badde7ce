"""A folder of somebody's documents in PLCopen XML: how many are imported, checked, run, and mean the same when they are exported.

`python tests/plcopen/sweep.py DIR [DIALECT]` prints the counts, and the causes that kept documents from a stage.  Without a
DIALECT, each document has that of the tool which its header names, and matiec if it names none.  A document
counts as imported if nothing of its program is lost, as checked if the sources have no errors, as run if 50 scans with inputs
at random stop at no trap, and as equal if the document that is made of the sources gives the same values in every scan; each
stage counts only documents that have reached the one before.  A document without a program that runs is compiled, and goes no
further.  Documents belong to whoever wrote them: they are never
part of this repository."""

from __future__ import annotations

import sys
from pathlib import Path

if __name__ == "__main__":
    sys.path[:0] = [str(Path(__file__).parents[2]), str(Path(__file__).parents[1])]

from sweeping import BUDGET, CYCLE_NS, Sweep, cause, compare, run

from fbvm.base.diagnostics import Source
from fbvm.code.compiler import compile_sources
from fbvm.code.image import Image
from fbvm.interchange.dialect_signs import FAMILIES
from fbvm.interchange.plcopen.read.importing import import_xml
from fbvm.interchange.plcopen.write.exporting import export_xml
from fbvm.machine.plc import Plc

STAGES = ("found", "imported", "checked", "run", "equal")


def sweep(folder: Path, dialect: str = "") -> Sweep:
    """The documents below a folder."""
    made = Sweep(STAGES)
    for path in sorted(path for path in folder.rglob("*") if path.suffix.lower() in (".xml", ".pro") and path.is_file()):
        made.note("found", path.name)
        _document(made, path, str(path.relative_to(folder)), dialect)
    return made


def _document(made: Sweep, path: Path, name: str, dialect: str) -> None:
    imported = import_xml(path, name)
    dialect = dialect or FAMILIES.get(imported.family, "matiec")
    if not made.note("imported", name, cause(imported.errors) or ("" if imported.files else "nothing is in it")):
        return
    sources = [Source(file, text) for file, text in imported.files.items()]
    checked = compile_sources(sources, dialect=dialect, lint=False)
    if not made.note("checked", name, cause(checked.errors)):
        return
    image = _runnable(sources, dialect)
    if image is None or not made.note("run", name, run(Plc(image, CYCLE_NS, budget=BUDGET))):
        return
    exported = export_xml(sources)
    if exported.text is None or exported.errors:
        made.note("equal", name, cause(exported.errors) or "no document")
        return
    back = import_xml(exported.text.encode())
    again = _runnable([Source(file, text) for file, text in back.files.items()], dialect)
    if back.errors or again is None:
        made.note("equal", name, cause(back.errors) or "what comes back has errors")
        return
    made.note("equal", name, compare(Plc(image, CYCLE_NS, budget=BUDGET), Plc(again, CYCLE_NS, budget=BUDGET)))


def _runnable(sources: list[Source], dialect: str) -> Image | None:
    """The image of a program that can be run; None if there is none."""
    return compile_sources(sources, runnable=True, dialect=dialect, lint=False).image


if __name__ == "__main__":
    print(sweep(Path(sys.argv[1]), *sys.argv[2:3]).report())
