"""`fbvm` in processes that begin where its modules are imported, which takes most of the time of a start.

They are forks of one process that has done nothing but import them; where a host cannot fork, they import them anew."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from types import TracebackType
from typing import Self

IMPORTED = ["fbvm.__main__", "fbvm.cli.main", "fbvm.cli.running.live", "fbvm.cli.running.peer", "fbvm.cli.running.run",
            "fbvm.cli.running.serve", "fbvm.cli.shared.live.origins", "fbvm.cli.shared.live.page", "fbvm.live.host",
            "fbvm.live.pytest_text", "fbvm.engine.native.engine", "llvmlite.binding",
            "pymodbus.server", "pymodbus.simulator"]  # fmt: skip
START = multiprocessing.get_context("forkserver" if "forkserver" in multiprocessing.get_all_start_methods() else "spawn")
if START.get_start_method() == "forkserver":
    START.set_forkserver_preload(IMPORTED)


def _main(arguments: list[str], folder: str, *outputs: Connection) -> None:
    for number, output in enumerate(outputs, 1):
        os.dup2(output.fileno(), number)
        output.close()
    sys.stdout, sys.stderr = (os.fdopen(number, "w", encoding="utf-8", closefd=False) for number in (1, 2))
    sys.argv = ["fbvm", *arguments]
    os.chdir(folder)
    from fbvm.__main__ import main

    main()


class Forked:
    """What `subprocess.Popen` has, of `python -m fbvm` with these arguments; both of its outputs are text in pipes."""

    def __init__(self, arguments: Sequence[str], cwd: Path | None = None) -> None:
        readers, writers = zip(START.Pipe(duplex=False), START.Pipe(duplex=False), strict=True)
        self._process = START.Process(target=_main, args=(list(arguments), str(cwd or Path.cwd()), *writers))
        self._process.start()
        assert self._process.pid is not None
        self.pid = self._process.pid
        for writer in writers:
            writer.close()  # so that the outputs have an end
        self.stdout, self.stderr = (os.fdopen(os.dup(reader.fileno()), encoding="utf-8") for reader in readers)
        for reader in readers:
            reader.close()

    @property
    def returncode(self) -> int | None:
        return self._process.exitcode

    def poll(self) -> int | None:
        return self._process.exitcode

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            os.kill(self.pid, number)

    def terminate(self) -> None:
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)

    def wait(self, timeout: float | None = None) -> int:
        self._process.join(timeout)
        if self.returncode is None:
            raise subprocess.TimeoutExpired("fbvm", timeout or 0)
        return self.returncode

    def communicate(self, timeout: float | None = None) -> tuple[str, str]:
        """All that is left of both outputs, which must fit into their pipes; they are closed behind it, as Popen does."""
        self.wait(timeout)
        with self.stdout, self.stderr:
            return self.stdout.read(), self.stderr.read()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, wrong: BaseException | None, trace: TracebackType | None) -> None:
        self.stdout.close()
        self.stderr.close()
        self.wait()
