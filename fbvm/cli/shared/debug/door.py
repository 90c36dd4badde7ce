"""The door through which an editor's debugger attaches to a PLC that runs (`fbvm run --debug PORT`)."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from fbvm.cli.shared import status
from fbvm.cli.shared.debug.launch import open_attached
from fbvm.cli.shared.terminal import say
from fbvm.dap.server import Connection, DebugDoor
from fbvm.dap.target import LaunchError, Target
from fbvm.machine.plc import Plc
from fbvm.net.streams import Listener
from fbvm.run import loop
from fbvm.run.running import TimedWrite
from fbvm.watch.conditions import parse_condition

NEVER_WITH = {"journal": "--journal", "trace": "--trace", "html": "--html", "rungs": "--ladder", "charts": "--sfc",
              "charted": "--chart", "lines": "--break", "watched": "--watch", "conditions": "--break-if"}  # fmt: skip
"""Options of `fbvm run` that look into scans themselves, by the names of their parameters."""
HOST = "127.0.0.1"


def run_with_door(plc: Plc, port: int, files: Sequence[Path], libraries: Sequence[Path], *, scans: int | None, for_ns: int | None,
                  until: str | None, max_ns: int | None, writes: Sequence[TimedWrite], pace: str,
                  progress: Callable[[Plc], None]) -> str:  # fmt: skip
    """Does what `loop.run` does, and lets debuggers attach meanwhile.  Ends with status 5 for a port in use."""
    try:
        listener = Listener(HOST, port)
    except OSError as error:
        say(f"the debugger cannot listen at {HOST}:{port}: {error.strerror}", err=True)
        sys.exit(status.NETWORK)
    say(f"a debugger can attach: fbvm dap --connect {listener.port}", err=True)
    door = DebugDoor(lambda: _accept(listener))
    condition = parse_condition(until, plc.find) if until else None
    last_scan = None if scans is None else plc.scans + scans
    ends = [plc.elapsed_ns + bound if bound is not None else None for bound in (for_ns, max_ns)]

    def has_to_stop(plc: Plc) -> bool:
        return door.is_called or (condition is not None and condition.holds(plc.read))

    def opened(how: str, arguments: Mapping[str, Any]) -> Target:
        if how != "attach":
            raise LaunchError("this PLC runs already: attach to it")
        return open_attached(plc, {str(path): path for path in files}, libraries, arguments)

    try:
        while True:
            for_left, max_left = (None if end is None else max(0, end - plc.elapsed_ns) for end in ends)
            reason = loop.run(plc, scans=None if last_scan is None else max(0, last_scan - plc.scans), for_ns=for_left,
                              until=has_to_stop, max_ns=max_left, pace=pace, progress=progress,
                              writes=[row for row in writes if row.at_ns >= plc.elapsed_ns])  # fmt: skip
            if reason != "until" or not door.is_called:
                return reason
            if door.serve(opened):
                return "interrupted"
            if plc.trap:
                return "trap"
    except KeyboardInterrupt:
        return "interrupted"
    finally:
        listener.close()


def _accept(listener: Listener) -> Connection:
    stream = listener.accept()

    def close() -> None:
        with suppress(OSError):
            stream.close()

    return stream.receive, stream.send, close
