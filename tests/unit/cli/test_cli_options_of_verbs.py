"""The options and arguments of each verb, as a kept text: what they are called, what they take, and what holds without them.

`FBVM_REWRITE=1 pytest` of this file writes `options_of_verbs.txt` anew: read the difference."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from fbvm.cli.main import main

KEPT = Path(__file__).with_name("options_of_verbs.txt")
NOTHING = (None, False, (), [])


def shown(parameter: click.Parameter) -> str:
    """One line: names, what is taken, how often, the default."""
    kind = parameter.type
    choices = f" {'|'.join(map(str, kind.choices))}" if isinstance(kind, click.Choice) else ""
    if isinstance(kind, click.IntRange | click.FloatRange):
        choices = f" {kind.min} to {kind.max}" + " without the least" * kind.min_open + " without the greatest" * kind.max_open
    words = ["/".join([*parameter.opts, *parameter.secondary_opts]), kind.name.lower() + choices]
    words += ["required"] * parameter.required + ["several"] * (getattr(parameter, "multiple", False) or parameter.nargs < 0)
    words += ["flag"] * getattr(parameter, "is_flag", False) + ["hidden"] * getattr(parameter, "hidden", False)
    words += [f"takes {parameter.nargs}"] * (parameter.nargs > 1)
    default = parameter.default
    if callable(default):
        words += ["worked out"]
    elif default not in NOTHING and "UNSET" not in repr(default):
        words += [f"default {default.as_posix() if isinstance(default, Path) else default!r}"]
    return ", ".join(words)


def lines() -> Iterator[str]:
    with click.Context(main) as context:
        for name in main.list_commands(context):
            command = main.get_command(context, name)
            assert command is not None
            yield f"# {name}"
            yield from (shown(parameter) for parameter in command.params)
            yield ""


@pytest.mark.slow
def test_verbs_take_what_is_listed() -> None:
    made = "\n".join(lines())
    if os.environ.get("FBVM_REWRITE"):
        KEPT.write_text(made, encoding="utf-8")
    assert made == KEPT.read_text(encoding="utf-8")
