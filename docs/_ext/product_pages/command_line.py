"""The page of the command line: a section for each verb, made of the click commands themselves."""

from __future__ import annotations

import inspect
import re

import click

from fbvm.cli import main as entry
from fbvm.cli.shared import status
from product_pages.markdown import code, fence, page, table

NAME = "reference/command-line"


def pages() -> dict[str, str]:
    """The page of all verbs, in the order of `fbvm --help`."""
    group = entry.main
    context = click.Context(group, info_name="fbvm")
    parts = [
        "# Command line",
        "This page is made of the commands themselves: `fbvm COMMAND --help` says the same in a terminal.",
        fence(_usage(group, context), "console"),
        _options(group, context),
        "## Exit status", table(("status", "meaning"), [(number, meaning) for number, meaning in statuses().items()]),
    ]  # fmt: skip
    for heading, verbs in entry.VERB_GROUPS.values():
        rows = [(f"[{code(verb)}](#fbvm-{verb})", said) for verb, said in verbs.items()]
        parts += [f"## {heading}", table(("command", ""), rows)]
        for verb in verbs:
            command = group.get_command(context, verb)
            assert command is not None
            parts += _verb(command, click.Context(command, info_name=verb, parent=context), verb)
    return {NAME: page(*parts)}


def statuses() -> dict[int, str]:
    """Every exit status and what it says; 0 is none of the constants."""
    said = re.findall(r"(\d+) ([^,.:]+)", (inspect.getdoc(entry) or "").partition("Exit status:")[2])
    found = {int(number): " ".join(meaning.split()) for number, meaning in said}
    known = {value for name, value in vars(status).items() if name.isupper()}
    assert known <= set(found), "the docstring of fbvm.cli.main lacks a status"
    return found


def _verb(command: click.Command, context: click.Context, verb: str) -> list[str]:
    said = inspect.cleandoc(command.help or "").replace("\b\n", "")
    arguments = [parameter for parameter in command.params if isinstance(parameter, click.Argument)]
    taken = [_argument(parameter, context) for parameter in arguments]
    return [f"(fbvm-{verb})=\n### fbvm {verb}", fence(_usage(command, context), "console"), said,
            table(("argument", ""), taken) if taken else "", _options(command, context)]  # fmt: skip


def _usage(command: click.Command, context: click.Context) -> str:
    return f"{context.command_path} {' '.join(command.collect_usage_pieces(context))}".strip()


def _argument(parameter: click.Argument, context: click.Context) -> tuple[str, str]:
    how_many = "any number" if parameter.nargs == -1 else "one"
    return code(parameter.make_metavar(context)), f"{how_many}, may be left out" if not parameter.required else how_many


def _options(command: click.Command, context: click.Context) -> str:
    rows = []
    for parameter in command.get_params(context):
        if isinstance(parameter, click.Option) and not parameter.hidden and (record := parameter.get_help_record(context)):
            written, said = record
            rows.append((code(written), f"{said}{_default(parameter, context, said)}"))
    return table(("option", ""), rows)


def _default(parameter: click.Option, context: click.Context, said: str) -> str:
    """The value of an option that is not given, where it has one and its help does not say it."""
    value = parameter.get_default(context)
    if value in (None, False, True, (), "") or "default" in said or not isinstance(value, str | int | float):
        return ""
    return f" Without it: {code(value)}."
