"""Which project is meant where sources may stand, and what may be said beside one."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import click
from click.core import ParameterSource


def project_argument(files: tuple[Path, ...]) -> Path | None:
    """The project file that the arguments of `fbvm run` mean: a .toml file, a folder that has one, or nothing at all,
    which is the folder where one is.  None if they are sources, for which nothing of projects is loaded."""
    if len(files) > 1 or (files and not files[0].is_dir() and files[0].suffix != ".toml"):
        return None
    from fbvm.run.project import FILE, project_file

    where = files[0] if files else Path()
    if (found := project_file(where)) is None:
        raise click.UsageError(f"there is no {FILE} in {where.resolve()}; give a FILE, or a folder with a project")
    return found


def check_project_options(context: click.Context, allowed: Mapping[str, str]) -> None:
    """Refuse what may not be said beside a project; `allowed` are the names of parameters and of their options."""
    given = {name for name in context.params if context.get_parameter_source(name) is not ParameterSource.DEFAULT}
    given |= {option for option in ("resource", "dialect") if context.meta.get(f"fbvm.{option}") is not None}
    wrong = [parameter.opts[0] for parameter in context.command.params
             if parameter.name in given - set(allowed) - {"files"}]
    if wrong:
        raise click.UsageError(f"{', '.join(wrong)}: what a project does stands in its file; beside it there are "
                               f"{', '.join(allowed.values())}")  # fmt: skip
