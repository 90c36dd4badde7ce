"""The argument PROJECT of verbs that take sources or a project, and the options that may be given with a project."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.core import ParameterSource

from fbvm.base.diagnostics import Diagnostic
from fbvm.base.files import resolved

if TYPE_CHECKING:
    from fbvm.run.project import Project


def _keep_in_context(context: click.Context, parameter: click.Parameter, value: bool) -> None:
    context.meta["fbvm.allow_outside"] = value


allow_outside_option = click.option(
    "--allow-outside", is_flag=True, expose_value=False, callback=_keep_in_context,
    help="Of a project: take sources and libraries that are not in its folder, too.")  # fmt: skip


def read_given_project(file: Path) -> Project | list[Diagnostic]:
    """The project of a file, as `read_project` returns it, with what --allow-outside says."""
    from fbvm.run.project import read_project

    return read_project(file, allow_outside=bool(click.get_current_context().meta.get("fbvm.allow_outside")))


def project_argument(files: tuple[Path, ...]) -> Path | None:
    """The project file that the arguments of a verb name: a .toml file, a folder with an fbvm.toml, or, without arguments, the
    current folder.  None if the arguments are sources.  Raises UsageError for a folder without a project."""
    if len(files) > 1 or (files and not files[0].is_dir() and files[0].suffix != ".toml"):
        return None
    from fbvm.run.project import FILE, project_file

    where = files[0] if files else Path()
    if (found := project_file(where)) is None:
        raise click.UsageError(f"there is no {FILE} in {resolved(where)}; give a FILE, or a folder with a project or "
                               "with sources (. is this one)")  # fmt: skip
    return found


def check_project_options(context: click.Context, allowed: Mapping[str, str]) -> None:
    """Raises UsageError for an option that cannot be given with a project.

    `allowed` are the options that can, by the names of their parameters."""
    given = {name for name in context.params if context.get_parameter_source(name) is not ParameterSource.DEFAULT}
    given |= {option for option in ("resource", "dialect", "heap") if context.meta.get(f"fbvm.{option}") is not None}
    wrong = [parameter.opts[0] for parameter in context.command.params
             if parameter.name in given - set(allowed) - {"files"}]
    if wrong:
        raise click.UsageError(f"{', '.join(wrong)}: what a project does stands in its file; beside it there are "
                               f"{', '.join(allowed.values())}")  # fmt: skip
