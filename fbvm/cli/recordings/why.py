"""`fbvm why`: which statement gave a variable its value, and what led to that."""

from __future__ import annotations

from pathlib import Path

import click

from fbvm.cli.shared.paths import ExistingPath
from fbvm.cli.shared.terminal import say
from fbvm.cli.shared.traces import SUFFIX, open_trace, trace_options
from fbvm.record.draw.why import DEEPEST, cause_text, why
from fbvm.record.trace.writer import Depth
from fbvm.watch.paths import Place


@click.command("why")
@click.argument("name", metavar="NAME|ADDRESS")
@click.argument("path", metavar="[TRACE]", required=False, type=ExistingPath(dir_okay=False))
@trace_options
@click.option("--scan", type=click.IntRange(min=0), metavar="N", help="At the end of this scan; the last one if not given.")
@click.option("--deep", type=click.IntRange(min=0), default=DEEPEST, show_default=True, metavar="N",
              help="Causes of causes to look for.")
def command(name: str, path: Path | None, scan: int | None, deep: int, plc: str | None, libraries: tuple[Path, ...]) -> None:
    """Say why a variable has its value: the statement that gave it, what it had read, and so on back through scans.

    The search goes back to the first scan that was recorded.  The TRACE may be left out where the folder has only one."""
    with open_trace(path or _only_trace(), plc, libraries, Depth.STATEMENTS) as trace:
        if trace.depth is not Depth.STATEMENTS:
            raise click.UsageError("the trace does not hold what statements read; it was made of a table, or without --depth")
        place = trace.find(name)
        if not isinstance(place, Place):
            raise click.UsageError(f"{name} is a range; name one place")
        if not trace.scans:
            raise click.UsageError("the trace has no scans yet")
        try:
            say(cause_text(trace, why(trace, place, trace.scans[-1] if scan is None else scan, deep)))
        except ValueError as error:
            raise click.UsageError(str(error)) from None


def _only_trace() -> Path:
    found = sorted(Path().glob(f"*{SUFFIX}"))
    if len(found) != 1:
        held = f"there are {', '.join(map(str, found))}" if found else "there is none here"
        raise click.UsageError(f"name a trace; {held}")
    return found[0]
