"""The passes of the compiler, one after the other: parse, check, lint, lay out, lower."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from fbvm.base.diagnostics import Diagnostic, Source, errors
from fbvm.base.dialects import dialect as named_dialect
from fbvm.base.repeats import gathered
from fbvm.base.types import Type, fold
from fbvm.check.checker import Checker
from fbvm.check.lint.linter import lint as lint_program
from fbvm.check.lint.suppression import Suppressions, Wanted
from fbvm.check.symbols.config_facts import TaskFact
from fbvm.check.symbols.facts import Pou
from fbvm.check.symbols.library import Libraries, LibraryError
from fbvm.check.symbols.report import Report
from fbvm.check.symbols.symbol_table import SymbolTable
from fbvm.code.builder.evaluation import evaluate
from fbvm.code.compiler.compilation import LONG, Progress
from fbvm.code.compiler.follow_on_errors import FollowOnErrors
from fbvm.code.compiler.initial_references import InitialReferences
from fbvm.code.image import USUAL_HEAP, Image, ProgramRun, TaskRow
from fbvm.code.layout.instance_paths import InstancePaths
from fbvm.code.layout.layout import lay_out
from fbvm.code.lowering.program import Program
from fbvm.code.recursion import room
from fbvm.code.store.object_code import ObjectLibrary, library_for
from fbvm.syntax import tree
from fbvm.syntax.parser import parse


def run_passes(sources: Sequence[Source], program: str | None, libraries: Sequence[Path], runnable: bool, resource: str | None,
               dialect: str, lint: bool, no_warn: Iterable[str], warnings_as_errors: bool, progress: Progress,
               drawn: bool) -> tuple[Image | None, list[Diagnostic]]:  # fmt: skip
    """The image of some sources, None if there are errors, and the sorted diagnostics; see `driver.compile_files`."""
    wanted, suppressions, report = Wanted.of(no_warn, warnings_as_errors), Suppressions(), Report()
    answers = named_dialect(dialect)
    try:
        searched = Libraries(libraries, preferred=answers.libraries)
    except LibraryError as error:
        return None, [error.diagnostic]
    with deep(sources):
        project = SymbolTable(searched, report, answers)
        follow_on = FollowOnErrors()
        for source in sources:
            text, diagnostics = parse(source, partial(_parsed, progress, source))
            report.diagnostics += diagnostics + suppressions.add(source, text, answers)
            follow_on.add(source, text, errors(diagnostics))
            project.collect(text, source)
        before_check = len(report.diagnostics)
        shared = not libraries and not project.config_sections
        library = library_for(answers) if shared else ObjectLibrary()
        checker = Checker(project, evaluate, library.dependencies if shared else None, partial(progress, "checked"))
        checker.check(program, resource)
        if runnable and not errors(report.diagnostics):
            _check_runnable(checker, program, sources, report)
        if lint and not errors(report.diagnostics):
            lint_program(checker, program)
        found = report.diagnostics[:before_check] + [d for d in report.diagnostics[before_check:] if not follow_on.has(d)]
        diagnostics = gathered(sorted(suppressions.apply(found, wanted), key=Diagnostic.order))
        image = None if errors(diagnostics) else _image(checker, library, progress, drawn)
        project.let_go()
    return image, diagnostics


def _parsed(progress: Progress, source: Source, reached: int) -> None:
    """Report how many characters of a source are parsed."""
    progress("read", reached, len(source.text))


def _check_runnable(checker: Checker, program: str | None, sources: Sequence[Source], report: Report) -> None:
    """Report S0209 unless there is exactly one thing to run."""
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
def deep(sources: Sequence[Source]) -> Iterator[None]:
    """Allow the recursion that deep trees need (the parser limits how deep they get), and stop the garbage collector.

    Nodes and facts live until the end; to visit them all again and again would take a third of the time.  After a long text
    the image, which lives on, is made old at once, so that the next collection does not visit it.  After short ones, of which
    tests compile thousands, that would cost more than it saves."""
    collects = gc.isenabled()
    gc.disable()
    try:
        with room():
            yield
    finally:
        if collects:
            if sum(len(source.text) for source in sources) >= LONG and not gc.get_freeze_count():
                gc.freeze()
                gc.unfreeze()
            gc.enable()


def _image(checker: Checker, library: ObjectLibrary, progress: Progress, drawn: bool) -> Image:
    """The image of a program that was checked without an error."""
    placement = lay_out(checker)
    program = Program(checker, placement, drawn)
    references = InitialReferences(program, checker, placement)
    references.in_frames()
    bodies = tuple(library.body(program, checker, pou) for pou in _reported(checker.bodies, partial(progress, "compiled")))
    tasks = sorted((_task(task) for task in checker.tasks), key=lambda row: row.priority)
    types: dict[str, Type] = {fold(p.type.name): p.type for p in checker.bodies if p.type is not None}
    for (_, name), entry in checker.project.types.items():
        if entry.resolved is not None:
            types.setdefault(name, entry.resolved[0])
    initial = (*placement.initial, *references.in_slots(), *InstancePaths(checker).rows())
    return Image(placement.layout, (*bodies, *program.parts), tuple(tasks), placement.symbols, initial,
                 tuple(placement.retained), tuple(program.sites), types, program.objects, tuple(program.rungs),
                 tuple(program.charts), frames=placement.frames).with_heap(USUAL_HEAP)


def _reported(pous: Sequence[Pou], progress: Callable[[int, int], None]) -> Iterator[Pou]:
    """The POUs; `progress` is called in front of each."""
    for number, pou in enumerate(pous):
        progress(number, len(pous))
        yield pou


def _task(task: TaskFact) -> TaskRow:
    runs = tuple(ProgramRun(run.name, run.pou.number, run.offset) for run in task.runs)
    return TaskRow(task.name, task.priority, task.interval_ns, task.single, runs)
