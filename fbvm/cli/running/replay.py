"""`fbvm replay`: executes a recorded run again, with other output."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import click

from fbvm.base.files import reason
from fbvm.cli.shared import journals
from fbvm.cli.shared.options import charted_names, show_option
from fbvm.cli.shared.paths import ExistingPath
from fbvm.cli.shared.run_result import RunResult
from fbvm.cli.shared.terminal import named, say
from fbvm.cli.shared.traces import chosen_plc, is_recording, open_recording, trace_options
from fbvm.net.journal import JournalError
from fbvm.record.recording.container import RecordingError
from fbvm.record.recording.journal_replay import Replay
from fbvm.record.recording.repeated_run import RepeatedRecording, RepeatedRun
from fbvm.record.trace.recorder import Recorder


@dataclass(frozen=True)
class Asked:
    """The options about the output."""

    scans: int | None
    until: str | None
    shown: tuple[str, ...]
    charted: tuple[str, ...]
    as_json: bool


@click.command("replay")
@click.argument("path", metavar="RECORDING", type=ExistingPath(dir_okay=False))
@trace_options
@click.option("--scans", type=click.IntRange(min=0), metavar="N", help="End after N scans.")
@click.option("--until", metavar="EXPRESSION", help="End when this holds after a scan: 'Main.done AND D200 > 5'.")
@show_option
@click.option("--chart", "charted", multiple=True, metavar="NAME|ADDRESS,...", help="Draw these, a column a scan.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def command(
    path: Path, libraries: tuple[Path, ...], plc: str | None, scans: int | None, until: str | None, shown: tuple[str, ...],
    charted: tuple[str, ...], as_json: bool,
) -> None:  # fmt: skip
    """Do again what `fbvm run --trace RECORDING` did: the same program and inputs, in no time and without a network.

    The memory is compared where the recording has its fingerprint: every few milliseconds of computing, with `--verify`
    behind every scan.  Ends with 1 if it was not the same to the bit, or if --until never held.  A journal of fbvm 0.1 is done
    again, too."""
    asked = Asked(scans, until, shown, charted, as_json)
    try:
        known = is_recording(path)
    except OSError as error:
        raise click.UsageError(f"{named(path)} cannot be read: {reason(error)}") from None
    if known:
        with open_recording(path, libraries) as recording:
            status = _repeat(lambda: RepeatedRecording(chosen_plc(recording, plc)), asked)
    else:
        with journals.open_journal_file(path) as (header, entries):
            status = _repeat(lambda: Replay(header, entries, journals.program_of(header, libraries, as_json)), asked)
    sys.exit(status)


def _repeat(make: Callable[[], RepeatedRun], asked: Asked) -> int:
    """Does a run again and prints its result; returns the exit status."""
    repeated = make()
    try:
        places = {text: repeated.plc.find(text) for text in asked.shown}
        names = charted_names(asked.charted)
        recorder = Recorder(repeated.plc, names) if names else None
        ended = repeated.run(scans=asked.scans, until=asked.until)
    except (JournalError, RecordingError):
        raise
    except (LookupError, TypeError, ValueError) as error:
        raise click.UsageError(str(error)) from None
    reason = _reason(repeated, ended, asked.until)
    result = RunResult(repeated.plc, reason, places, recorder, asked.as_json, asked.until or "")
    result.print()
    if repeated.differs is not None:
        say(f"after scan {repeated.differs} the memory is not what was recorded", fg="red", err=True)
    elif ended == "end" and not repeated.complete:
        say(f"the recording was cut off after {repeated.plc.scans} scans", fg="yellow", err=True)
    elif reason == "end" and not (asked.shown or asked.charted or asked.as_json):
        say(f"{repeated.plc.scans:,} scans were done again: the memory is what was recorded")
    return result.status


def _reason(repeated: RepeatedRun, reason: str, until: str | None) -> str:
    """The reason of the end in the words of `fbvm run`."""
    if reason != "end":
        return reason
    return "trap" if repeated.plc.trap else "max" if until else "end"
