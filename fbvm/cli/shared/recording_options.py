"""The options of `fbvm run` about the recording of the run."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from fbvm.record.trace.writer import Depth

_FILE = click.Path(dir_okay=False, path_type=Path)


def recording_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """--trace, --journal, --verify, --html, --depth and --select."""
    for decorate in (
        click.option("--select", "selected", multiple=True, metavar="PATTERN",
                     help="What charts and pages of the recording show by default: 'Main.*.Q', D200..D299.  May be repeated."),
        click.option("--depth", type=click.Choice([depth.value for depth in Depth]), default="scans", show_default=True,
                     help="What a page of the recording carries along: scan ends, also writes, also statements."),
        click.option("--html", type=_FILE, metavar="FILE",
                     help="Write the run as one page for a browser, with every statement."),
        click.option("--verify", is_flag=True, help="Record a fingerprint of the memory at every scan."),
        click.option("--journal", type=_FILE, metavar="FILE", help="The same as --trace."),
        click.option("--trace", type=_FILE, metavar="FILE",
                     help="Record the run for `fbvm chart`, `table`, `why`, `convert` and `replay`."),
    ):
        function = decorate(function)
    return function
