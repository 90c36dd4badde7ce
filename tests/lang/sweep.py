"""A folder of somebody's sources: how many are read, checked, run, and do the same on every engine.

`python tests/lang/sweep.py DIR [DIALECT]` prints the counts, and the causes that kept sources from a stage.  Each file is a
program of its own; with DIALECT `auto` each gets the dialect that its signs show.  A file counts as read if it has no syntax
errors, as checked if it has no errors, as run if 50 scans with inputs at random stop at no trap, and as equal if Python and
machine code give the same values in every scan.  A file without a program that runs is compiled, and goes no further.  Sources
belong to whoever wrote them: they are never part of this repository."""

from __future__ import annotations

import sys
from pathlib import Path

if __name__ == "__main__":
    sys.path[:0] = [str(Path(__file__).parents[2]), str(Path(__file__).parents[1])]

from sweeping import BUDGET, CYCLE_NS, Sweep, cause, compare, run

from fbvm.base.diagnostics import Source
from fbvm.code.compiler import compile_sources
from fbvm.interchange.dialect_signs import guessed
from fbvm.machine.plc import Plc
from fbvm.syntax.text import read

STAGES = ("found", "read", "checked", "run", "equal")


def sweep(folder: Path, dialect: str = "auto") -> Sweep:
    """The sources below a folder."""
    made = Sweep(STAGES)
    for path in sorted(path for path in folder.rglob("*.[sS][tT]") if path.is_file()):
        name = str(path.relative_to(folder))
        made.note("found", name)
        source = read(path, name)
        if isinstance(source, Source):
            _source(made, source, guessed([], [source]).dialect if dialect == "auto" else dialect)
        else:
            made.note("read", name, cause([source]))
    return made


def _source(made: Sweep, source: Source, dialect: str) -> None:
    name = source.name
    checked = compile_sources([source], dialect=dialect, lint=False)
    unread = [error for error in checked.errors if error.code < "S0200"]
    if not made.note("read", name, cause(unread)) or not made.note("checked", name, cause(checked.errors)):
        return
    image = compile_sources([source], runnable=True, dialect=dialect, lint=False).image
    if image is None or not made.note("run", name, run(Plc(image, CYCLE_NS, budget=BUDGET))):
        return
    engines = [Plc(image, CYCLE_NS, budget=BUDGET, engine=engine) for engine in ("python", "native")]
    made.note("equal", name, compare(*engines))


if __name__ == "__main__":
    print(sweep(Path(sys.argv[1]), *sys.argv[2:3]).report())
