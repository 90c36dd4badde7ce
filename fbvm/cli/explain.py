"""`fbvm explain`: the page of a diagnostic."""

from __future__ import annotations

from importlib.resources import files

import click

from fbvm.base.codes import CODES


@click.command("explain")
@click.argument("code", metavar="CODE", required=False)
def command(code: str | None) -> None:
    """Print the page of a diagnostic: a wrong program, the reason, the mend.  Without CODE: the list of all codes."""
    if code is None:
        for row in CODES.values():
            click.echo(f"{row.code}  {row.severity:<7}  {row.title}")
        return
    row_or_none = CODES.get(code.upper())
    if row_or_none is None:
        near = [known for known in CODES if known[:3] == code.upper()[:3]]
        hint = f"; there are {near[0]} to {near[-1]}" if near else "; `fbvm explain` alone lists all"
        raise click.UsageError(f"there is no diagnostic {code}{hint}")
    click.echo(page(row_or_none.code))


def page(code: str) -> str:
    """The page of a code.  Raises FileNotFoundError if it has none."""
    return (files("fbvm.base") / "pages" / f"{code}.md").read_text(encoding="utf-8").rstrip("\n")
