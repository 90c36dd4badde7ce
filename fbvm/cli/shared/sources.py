"""The options about sources, their compilation, and diagnostics on the terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click

from fbvm.base import cache
from fbvm.base.diagnostics import Diagnostic, errors
from fbvm.base.dialects import DIALECTS
from fbvm.cli.shared import status
from fbvm.cli.shared.given_sources import families, inputs, sources_of
from fbvm.cli.shared.paths import LibraryFolder, SourcePath, taken_folders
from fbvm.cli.shared.terminal import say, say_json
from fbvm.code.compiler import compile_files
from fbvm.code.image import LARGEST_HEAP, Image
from fbvm.interchange.dialect_signs import guessed
from fbvm.interchange.formats.given import usual_dialect

AUTO = "auto"
"""The dialect that is chosen by what the files show."""


def source_arguments(function: Callable[..., Any]) -> Callable[..., Any]:
    """FILE..., --program, --resource, --dialect, --heap, --library and --no-cache, which all verbs on programs share."""
    files = click.argument("files", nargs=-1, required=True, metavar="FILE...",
                           type=SourcePath(), callback=taken_folders)  # fmt: skip
    return source_options(files(function))


def _switch_cache_off(context: click.Context, parameter: click.Parameter, wanted: bool) -> None:
    if wanted:
        cache.switch(False)
        context.call_on_close(lambda: cache.switch(True))


def _keep_in_context(context: click.Context, parameter: click.Parameter, value: str | bool | int | None) -> None:
    context.meta[f"fbvm.{parameter.name}"] = value


def compile_options(files: Sequence[Path]) -> dict[str, Any]:
    """The options --resource, --dialect and --heap of the present command, as keyword arguments of the compiler.

    Without --dialect files of TwinCAT, and PLCopen XML whose header names the tool, have that of the tool; `--dialect auto` looks
    at the files, and says on stderr what it chose and why."""
    meta = click.get_current_context().meta
    given = {name: meta[f"fbvm.{name}"] for name in ("resource", "dialect", "heap") if meta.get(f"fbvm.{name}") is not None}
    given.setdefault("dialect", usual_dialect(files))
    if given["dialect"] == AUTO:
        chosen = guessed(families(files), sources_of(files))
        meta["fbvm.dialect"] = given["dialect"] = chosen.dialect
        say(f"dialect {chosen.dialect}: {chosen.because}", err=True)
    return given


def source_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """--program, --resource, --memory, --dialect, --heap, --library and --no-cache."""
    for decorate in (
        click.option("--library", "libraries", multiple=True, metavar="DIR", type=LibraryFolder(),
                     help="A folder of libraries of your own, besides those that fbvm brings; may be repeated."),
        click.option("--no-cache", is_flag=True, expose_value=False, callback=_switch_cache_off,
                     help="Compile anew, prove anew, and keep nothing of it on disk."),
        click.option("--memory", is_flag=True, expose_value=False, callback=_keep_in_context,
                     help="Take the memory window of a project of CX-Programmer as initial values of D, H, W and E."),
        click.option("--heap", type=click.IntRange(0, LARGEST_HEAP), metavar="BYTES", expose_value=False,
                     callback=_keep_in_context, help="How much memory __NEW can take at the same time.  Without it: 1 MiB."),
        click.option("--resource", metavar="NAME", expose_value=False, callback=_keep_in_context,
                     help="The RESOURCE that the PLC is, where a CONFIGURATION has several."),
        click.option("--dialect", type=click.Choice([*DIALECTS, AUTO]), expose_value=False, callback=_keep_in_context,
                     help="How to answer what compilers disagree about; `fbvm explain dialects` says which answers, `auto` looks "
                     "for signs in the files and says which it takes.  Without it: that of the tool for files of TwinCAT, and "
                     "for PLCopen XML whose header names one; else standard."),
        click.option("--program", metavar="NAME", help="The PROGRAM to run where no CONFIGURATION says it."),
    ):  # fmt: skip
        function = decorate(function)
    return function


def compile_or_exit(
    files: Sequence[Path], program: str | None, libraries: Sequence[Path], *, runnable: bool, as_json: bool = False,
    drawn: bool = False,
) -> Image:
    """Compiles files to an image and prints warnings; prints errors and ends the verb with status 3 if there are any.

    With `runnable` it is an error if the files do not say which program to run; with `drawn` statements of Structured Text
    have rungs."""
    given, found = inputs(files)
    if errors(found):
        report_diagnostics(found, as_json)
        sys.exit(status.PROGRAM_ERRORS)
    for diagnostic in found:
        show_diagnostic(diagnostic)
    compilation = compile_files(given, program=program, libraries=libraries, runnable=runnable, lint=False, drawn=drawn,
                                **compile_options(files))
    if compilation.image is None:
        report_diagnostics(compilation.diagnostics, as_json)
        sys.exit(status.PROGRAM_ERRORS)
    for diagnostic in compilation.diagnostics:
        show_diagnostic(diagnostic)
    return compilation.image


def report_diagnostics(diagnostics: Sequence[Diagnostic], as_json: bool) -> None:
    """Prints diagnostics: as text with a summary on stderr, or, with `as_json`, as one object on stdout."""
    if as_json:
        say_json({"diagnostics": [diagnostic.as_dict() for diagnostic in diagnostics]}, indent=2)
        return
    for diagnostic in diagnostics:
        show_diagnostic(diagnostic)
    wrong = len(errors(diagnostics))
    counts = [f"{count} {what}{'s' * (count > 1)}" for count, what in ((wrong, "error"), (len(diagnostics) - wrong, "warning"))
              if count]
    if counts:
        say(f"{' and '.join(counts)}; `fbvm explain CODE` says more about each", bold=True, err=True)


def show_diagnostic(diagnostic: Diagnostic) -> None:
    """Prints one diagnostic on stderr, its first line in colour on a terminal."""
    first, _, rest = diagnostic.render().partition("\n")
    say(first, fg="red" if diagnostic.severity == "error" else "yellow", err=True)
    if rest:
        say(rest, err=True)
