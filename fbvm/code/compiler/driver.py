"""The compiler: sources in; an Image, or diagnostics that say why there is none, out."""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from fbvm.base.diagnostics import Diagnostic, Source, errors
from fbvm.base.dialects import dialect as named_dialect
from fbvm.base.repeats import gathered
from fbvm.base.types import Type, fold
from fbvm.check.checker import Checker
from fbvm.check.facts import Pou, Report, TaskFact
from fbvm.check.library import Libraries, LibraryError
from fbvm.check.lint.linter import lint as look_for_slips
from fbvm.check.lint.suppression import Silence, Wanted
from fbvm.check.project import Project
from fbvm.code.builder.evaluation import evaluate
from fbvm.code.compiler.follow_on_errors import FollowOnErrors
from fbvm.code.image import Image, ProgramRun, TaskRow
from fbvm.code.layout.layout import lay_out
from fbvm.code.lowering.initial_references import InitialReferences
from fbvm.code.lowering.program import Program
from fbvm.code.store import cache as image_cache
from fbvm.code.store.object_code import ObjectLibrary, library_for
from fbvm.syntax import tree
from fbvm.syntax.parser import parse
from fbvm.syntax.text import read

LONG = 50_000
"""Characters of sources from which on looking for garbage takes tenths of a second."""
_FRAMES = 20_000
"""Python frames that checking and lowering may use for the deepest tree that the parser lets through."""


Progress = Callable[[str, int, int], None]
"""Told what has been done ("read", "checked", "compiled"), how much of it, and of how much: characters, then POUs."""


def _nobody(what: str, done: int, known: int) -> None:
    """Nobody waits."""


@dataclass(frozen=True)
class Compilation:
    """What became of some sources: the image (None if there are errors) and all messages in order of place."""

    image: Image | None
    diagnostics: list[Diagnostic]

    @property
    def errors(self) -> list[Diagnostic]:
        return errors(self.diagnostics)


def compile_files(paths: Sequence[Path | str], program: str | None = None, libraries: Sequence[Path | str] = (),
                  runnable: bool = False, *, resource: str | None = None, dialect: str = "standard",
                  lint: bool = True, no_warn: Iterable[str] = (), warnings_as_errors: bool = False, cache: bool = True,
                  progress: Progress = _nobody, drawn: bool = False) -> Compilation:
    """Compile source files, or with `cache` read what became of the same ones the last time.

    `program` names the PROGRAM to run, `resource` the RESOURCE of a CONFIGURATION that has several; `libraries` are folders
    asked before the shipped ones.

    With `runnable` it is an error if there is not exactly one thing to run.  `lint` looks for what is allowed and hardly
    meant; `no_warn` are codes of warnings that are not wanted, or "all".  `dialect` says how to answer what compilers
    disagree about (`base.dialects`).  `progress` is told how far the work is.  Never raises for what files contain; a file
    that cannot be read gives a diagnostic.  With `drawn` statements of Structured Text are rungs of the image, too, where they
    can be drawn as such.  Raises ValueError for a dialect that there is not, or a code that is none of a
    warning."""
    sources: list[Source] = []
    unreadable: list[Diagnostic] = []
    for path in paths:
        source = read(Path(path), str(path))
        if isinstance(source, Source):
            sources.append(source)
        else:
            unreadable.append(source)
    silenced = sorted(no_warn)
    kept = None if unreadable or not cache else image_cache.name(
        sources, [Path(folder) for folder in libraries],
        (program, runnable, resource, dialect, lint, silenced, warnings_as_errors, drawn))
    if kept and (known := image_cache.read(kept, sources)):
        return Compilation(*known)
    with _deep(sources):
        made = compile_sources(sources, program, libraries, runnable, resource=resource, dialect=dialect, lint=lint,
                               no_warn=silenced, warnings_as_errors=warnings_as_errors, progress=progress, drawn=drawn)
        if kept and made.image:
            image_cache.write(kept, sources, made.image, made.diagnostics)
    return Compilation(None, unreadable + made.diagnostics) if unreadable else made


def compile_text(text: str, name: str = "text.st", program: str | None = None, libraries: Sequence[Path | str] = (), *,
                 resource: str | None = None, dialect: str = "standard",
                  lint: bool = True, no_warn: Iterable[str] = (),
                 warnings_as_errors: bool = False, drawn: bool = False) -> Compilation:
    """Compile one text; see `compile_files`."""
    return compile_sources([Source(name, text)], program, libraries, resource=resource, dialect=dialect, lint=lint,
                           no_warn=no_warn, warnings_as_errors=warnings_as_errors, drawn=drawn)


def compile_sources(sources: Sequence[Source], program: str | None = None, libraries: Sequence[Path | str] = (),
                    runnable: bool = False, *, resource: str | None = None, dialect: str = "standard",
                    lint: bool = True, no_warn: Iterable[str] = (), warnings_as_errors: bool = False,
                    progress: Progress = _nobody, drawn: bool = False) -> Compilation:
    """Compile texts; see `compile_files`."""
    wanted, silence, report = Wanted.of(no_warn, warnings_as_errors), Silence(), Report()
    spoken = named_dialect(dialect)
    try:
        shelves = Libraries([Path(folder) for folder in libraries], preferred=spoken.libraries)
    except LibraryError as error:
        return Compilation(None, [error.diagnostic])
    with _deep(sources):
        project = Project(shelves, report, spoken)
        follow_on = FollowOnErrors()
        for source in sources:
            text, diagnostics = parse(source, partial(_read_so_far, progress, source))
            report.diagnostics += diagnostics + silence.note(source, text, spoken)
            follow_on.add(source, text, errors(diagnostics))
            project.collect(text, source)
        unread = len(report.diagnostics)
        checker = Checker(project, evaluate)
        checker.progress = partial(progress, "checked")
        checker.keeps = not libraries and not project.settings
        library = library_for(spoken) if checker.keeps else ObjectLibrary()
        checker.known = library.dependencies
        checker.check(program, resource)
        if runnable and not errors(report.diagnostics):
            _demand_program(checker, program, sources, report)
        if lint and not errors(report.diagnostics):
            look_for_slips(checker, program)
        found = report.diagnostics[:unread] + [d for d in report.diagnostics[unread:] if not follow_on.has(d)]
        diagnostics = gathered(sorted(silence.heard(found, wanted), key=Diagnostic.order))
        image = None if errors(diagnostics) else _image(checker, library, progress, drawn)
        project.let_go()
    return Compilation(image, diagnostics)


def _read_so_far(progress: Progress, source: Source, reached: int) -> None:
    progress("read", reached, len(source.text))


def _demand_program(checker: Checker, program: str | None, sources: Sequence[Source], report: Report) -> None:
    if checker.tasks or not sources:
        return
    programs = [p for p in checker.project.pous.values() if p.kind == "PROGRAM" and not p.source.library]
    node = programs[1].tree.name if len(programs) > 1 else tree.Node(0, 0)
    source = programs[1].source if len(programs) > 1 else sources[0]
    names = ", ".join(p.name for p in programs)
    if program is not None:
        message, hint = f"there is no PROGRAM {program}", f"there is {names}" if names else ""
    elif programs:
        message = f"there are several programs ({names}) and no CONFIGURATION says which to run"
        hint = "choose one with --program NAME"
    else:
        message, hint = "there is no PROGRAM to run", "blocks and functions need a PROGRAM that calls them"
    report.add("S0209", source, node, message, hint)


@contextmanager
def _deep(sources: Sequence[Source]) -> Iterator[None]:
    """Room for deep trees; the parser limits how deep they get.

    Nobody looks for garbage meanwhile: nodes and facts live until the end, and to visit them all again and again takes a
    third of the time.  What is left of a long text is an image, which lives on: it counts as old at once.  After short
    texts, of which tests compile thousands, to ask for that would take longer, and what they leave behind would stay."""
    before, collects = sys.getrecursionlimit(), gc.isenabled()
    sys.setrecursionlimit(max(before, _FRAMES))
    gc.disable()
    try:
        yield
    finally:
        sys.setrecursionlimit(before)
        if collects:
            if sum(len(source.text) for source in sources) >= LONG and not gc.get_freeze_count():
                gc.freeze()
                gc.unfreeze()
            gc.enable()


def _image(checker: Checker, library: ObjectLibrary, progress: Progress, drawn: bool) -> Image:
    placement = lay_out(checker)
    program = Program(checker, placement, drawn)
    references = InitialReferences(program, checker, placement)
    references.in_frames()
    bodies = tuple(library.body(program, checker, pou) for pou in _told(checker.bodies, partial(progress, "compiled")))
    tasks = sorted((_task(task) for task in checker.tasks), key=lambda row: row.priority)
    types: dict[str, Type] = {fold(p.type.name): p.type for p in checker.bodies if p.type is not None}
    for (_, name), entry in checker.project.types.items():
        if entry.resolved is not None:
            types.setdefault(name, entry.resolved[0])
    return Image(placement.layout, bodies, tuple(tasks), placement.symbols, (*placement.initial, *references.in_slots()),
                 tuple(placement.retained), tuple(program.sites), types, program.objects, tuple(program.rungs),
                 tuple(program.charts))


def _told(pous: Sequence[Pou], reached: Callable[[int, int], None]) -> Iterator[Pou]:
    """The POUs, and a word to the caller at each."""
    for number, pou in enumerate(pous):
        reached(number, len(pous))
        yield pou


def _task(task: TaskFact) -> TaskRow:
    runs = tuple(ProgramRun(run.name, run.pou.number, run.offset) for run in task.runs)
    return TaskRow(task.name, task.priority, task.interval_ns, task.single, runs)
