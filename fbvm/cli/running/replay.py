"""`fbvm replay`: executes the run in a journal again, with other output."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from fbvm.cli.shared import journals
from fbvm.cli.shared.options import charted_names, show_option
from fbvm.cli.shared.paths import ExistingPath
from fbvm.cli.shared.run_result import RunResult
from fbvm.cli.shared.terminal import say
from fbvm.net.journal import JournalError
from fbvm.record.trace.recorder import Recorder
from fbvm.run.replay import Replay


@click.command("replay")
@click.argument("journal", type=ExistingPath(dir_okay=False))
@click.option("--library", "libraries", multiple=True, metavar="DIR",
              type=ExistingPath(file_okay=False),
              help="Where folders of libraries are now, if the journal's are gone; may be repeated.")
@click.option("--scans", type=click.IntRange(min=0), metavar="N", help="End after N scans.")
@click.option("--until", metavar="EXPRESSION", help="End when this holds after a scan: 'Main.done AND D200 > 5'.")
@show_option
@click.option("--chart", "charted", multiple=True, metavar="NAME|ADDRESS,...", help="Draw these, a column a scan.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(
    journal: Path, libraries: tuple[Path, ...], scans: int | None, until: str | None, shown: tuple[str, ...],
    charted: tuple[str, ...], as_json: bool,
) -> None:  # fmt: skip
    """Do again what `fbvm run --journal JOURNAL` did: the same program and inputs, in no time and without a network.

    Ends with 1 if the memory was not the same to the bit after some scan, or if --until never held."""
    with journals.open_journal_file(journal) as (header, entries):
        replay = Replay(header, entries, journals.program_of(header, libraries, as_json))
        try:
            places = {text: replay.plc.find(text) for text in shown}
            names = charted_names(charted)
            recorder = Recorder(replay.plc, names) if names else None
            reason = replay.run(scans=scans, until=until)
        except JournalError:
            raise
        except (LookupError, TypeError, ValueError) as error:
            raise click.UsageError(str(error)) from None
    result = RunResult(replay.plc, _reason(replay, reason, until), places, recorder, as_json, until or "")
    result.print()
    if replay.differs is not None:
        say(f"after scan {replay.differs} the memory is not what the journal says", fg="red", err=True)
    elif reason == "end" and not replay.complete:
        say(f"the journal was cut off after {replay.plc.scans} scans", fg="yellow", err=True)
    sys.exit(result.status)


def _reason(replay: Replay, reason: str, until: str | None) -> str:
    """The reason of the end in the words of `fbvm run`."""
    if reason != "end":
        return reason
    return "trap" if replay.plc.trap else "max" if until else "end"
