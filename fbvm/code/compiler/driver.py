"""The compiler: sources in; an Image, or diagnostics that say why there is none, out.

What was compiled before is read from the user's cache; the passes over sources are only loaded if there is something to compile,
since loading them takes longer than all else that a short run does."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.code.compiler.compilation import Compilation, Progress
from fbvm.code.store import cache as image_cache
from fbvm.syntax.text import read


def _no_progress(stage: str, done: int, known: int) -> None:
    """The progress that nobody is told."""


def compile_files(paths: Sequence[Path | str | Source], program: str | None = None, libraries: Sequence[Path | str] = (),
                  runnable: bool = False, *, resource: str | None = None, dialect: str = "standard",
                  lint: bool = True, no_warn: Iterable[str] = (), warnings_as_errors: bool = False, cache: bool = True,
                  progress: Progress = _no_progress, drawn: bool = False, heap: int | None = None) -> Compilation:
    """Compile source files.

    paths: the files, of Structured Text, ladder mnemonics or charts; a `Source` is taken as it is.
    program: the name of the PROGRAM to run, where no CONFIGURATION says.
    libraries: folders of libraries that are looked into before the shipped ones.
    runnable: it is an error (S0209) if there is not exactly one thing to run.
    resource: the RESOURCE to run of a CONFIGURATION that has several.
    dialect: the name of the answers to what compilers disagree about (`base.dialects`).
    lint: warn of what is allowed and hardly meant.
    no_warn: codes of warnings that are not wanted, or "all".
    warnings_as_errors: a warning that is wanted is an error.
    cache: read the result from the user's cache folder if the same files were compiled before, and keep it there.
    progress: is called as the work goes on.
    drawn: statements of Structured Text get pictures as rungs in the image, where they can be drawn.
    heap: bytes of the heap from which __NEW takes; None for the usual 1 MiB.

    Nothing in the files raises, and none that cannot be read: there are diagnostics.  Raises ValueError for an unknown dialect,
    or for a code in `no_warn` that no warning has."""
    sources: list[Source] = []
    unreadable: list[Diagnostic] = []
    for path in paths:
        source = path if isinstance(path, Source) else read(Path(path), str(path))
        if isinstance(source, Source):
            sources.append(source)
        else:
            unreadable.append(source)
    unwanted = sorted(no_warn)
    entry = None if unreadable or not cache else image_cache.name(
        sources, [Path(folder) for folder in libraries],
        (program, runnable, resource, dialect, lint, unwanted, warnings_as_errors, drawn))
    if entry and (known := image_cache.read(entry, sources)):
        return Compilation(known[0].with_heap(heap), known[1])
    from fbvm.code.compiler.neighbours import with_neighbours
    from fbvm.code.compiler.passes import deep

    with deep(sources):
        made = compile_sources(sources, program, libraries, runnable, resource=resource, dialect=dialect, lint=lint,
                               no_warn=unwanted, warnings_as_errors=warnings_as_errors, progress=progress, drawn=drawn)
        if entry and made.image:
            image_cache.write(entry, sources, made.image, made.diagnostics)
    if made.image and not unreadable:
        return Compilation(made.image.with_heap(heap), made.diagnostics)
    files = [path for path in paths if not isinstance(path, Source)]
    return Compilation(None, unreadable + with_neighbours(made.diagnostics, files))


def compile_text(text: str, name: str = "text.st", program: str | None = None, libraries: Sequence[Path | str] = (), *,
                 resource: str | None = None, dialect: str = "standard", lint: bool = True, no_warn: Iterable[str] = (),
                 warnings_as_errors: bool = False, drawn: bool = False, heap: int | None = None) -> Compilation:
    """Compile one text; diagnostics call it `name`.  All other parameters are those of `compile_files`.

    >>> compile_text("PROGRAM Main VAR n : INT; END_VAR n := 1.5; END_PROGRAM").errors[0].code
    'S0301'"""
    return compile_sources([Source(name, text)], program, libraries, resource=resource, dialect=dialect, lint=lint,
                           no_warn=no_warn, warnings_as_errors=warnings_as_errors, drawn=drawn, heap=heap)


def compile_sources(sources: Sequence[Source], program: str | None = None, libraries: Sequence[Path | str] = (),
                    runnable: bool = False, *, resource: str | None = None, dialect: str = "standard",
                    lint: bool = True, no_warn: Iterable[str] = (), warnings_as_errors: bool = False,
                    progress: Progress = _no_progress, drawn: bool = False, heap: int | None = None) -> Compilation:
    """Compile texts, each with the name that diagnostics give it.  All other parameters are those of `compile_files`."""
    from fbvm.code.compiler.passes import run_passes

    image, diagnostics = run_passes(sources, program, [Path(folder) for folder in libraries], runnable, resource, dialect, lint,
                                    no_warn, warnings_as_errors, progress, drawn)
    return Compilation(image.with_heap(heap) if image is not None else None, diagnostics)
