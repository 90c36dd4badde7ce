"""The port at which editors' debuggers attach to PLCs that run: `--debug PORT` of `fbvm run`, `serve` and `live`."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any

from fbvm.cli.shared import status
from fbvm.cli.shared.debug.attach import open_attached
from fbvm.cli.shared.debug.worlds import DebugSources
from fbvm.cli.shared.terminal import say
from fbvm.dap.server import Connection, DebugDoor
from fbvm.dap.target import LaunchError, Target
from fbvm.net.streams import Listener
from fbvm.run.loop import run_all
from fbvm.run.running import Running
from fbvm.step.world import Debugged

HOST = "127.0.0.1"

class DebugPort:
    """Listens at a port for debuggers.  Ends with status 5 if that cannot be used."""

    def __init__(self, port: int, sources: DebugSources) -> None:
        try:
            self._listener = Listener(HOST, port)
        except OSError as error:
            say(f"the debugger cannot listen at {HOST}:{port}: {error.strerror}", err=True)
            sys.exit(status.NETWORK)
        self._sources = sources
        self._door = DebugDoor(lambda: _accept(self._listener))
        say(f"a debugger can attach: fbvm dap --connect {self._listener.port}", err=True)

    @property
    def is_called(self) -> bool:
        """True if a debugger waits."""
        return self._door.is_called

    def serve(self, debugged: Callable[[], Sequence[Debugged]], meanwhile: Callable[[], bool] | None = None) -> bool:
        """Lets the debugger that waits have the PLCs until it leaves; returns True if it wants them to end.

        `meanwhile` is called every 20 ms or so; when it returns True, the debugger is left."""

        def opened(how: str, arguments: Mapping[str, Any]) -> Target:
            if how != "attach":
                raise LaunchError("this runs already: attach to it")
            return open_attached(debugged(), self._sources.paths, self._sources.texts, arguments)

        return self._door.serve(opened, meanwhile)

    def close(self) -> None:
        """Listens no longer."""
        self._listener.close()


def run_with_port(runs: Mapping[str, Running], port: DebugPort, progress: Callable[[], None]) -> None:
    """Does what `run_all` does, and lets debuggers have the PLCs, by their names, when they attach."""
    rows = list(runs.values())
    is_resumed = False
    try:
        while any(not run.reason for run in rows):
            run_all(rows, progress, lambda: port.is_called, resumed=is_resumed)
            if not port.is_called:
                return
            wants_end = port.serve(lambda: [Debugged(name, run.plc, run.writes) for name, run in runs.items()])
            for run in rows:
                run.resume()
                run.reason = run.reason or ("interrupted" if wants_end else "")
            is_resumed = True
    except KeyboardInterrupt:
        for run in rows:
            run.reason = run.reason or "interrupted"
    finally:
        port.close()


def _accept(listener: Listener) -> Connection:
    stream = listener.accept()

    def close() -> None:
        with suppress(OSError):
            stream.close()

    return stream.receive, stream.send, close
