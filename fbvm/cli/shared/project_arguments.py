"""The argument PROJECT of verbs that take sources or a project, and the options that may be given with a project."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import click
from click.core import ParameterSource


def project_argument(files: tuple[Path, ...]) -> Path | None:
    """The project file that the arguments of a verb name: a .toml file, a folder with an fbvm.toml, or, without arguments, the
    current folder.  None if the arguments are sources.  Raises UsageError for a folder without a project."""
    if len(files) > 1 or (files and not files[0].is_dir() and files[0].suffix != ".toml"):
        return None
    from fbvm.run.project import FILE, project_file

    where = files[0] if files else Path()
    if (found := project_file(where)) is None:
        raise click.UsageError(f"there is no {FILE} in {where.resolve()}; give a FILE, or a folder with a project")
    return found


def check_project_options(context: click.Context, allowed: Mapping[str, str]) -> None:
    """Raises UsageError for an option that cannot be given with a project.

    `allowed` are the options that can, by the names of their parameters."""
    given = {name for name in context.params if context.get_parameter_source(name) is not ParameterSource.DEFAULT}
    given |= {option for option in ("resource", "dialect") if context.meta.get(f"fbvm.{option}") is not None}
    wrong = [parameter.opts[0] for parameter in context.command.params
             if parameter.name in given - set(allowed) - {"files"}]
    if wrong:
        raise click.UsageError(f"{', '.join(wrong)}: what a project does stands in its file; beside it there are "
                               f"{', '.join(allowed.values())}")  # fmt: skip
