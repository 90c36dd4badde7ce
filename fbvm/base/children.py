"""A process that this one starts and that never outlives it, at whatever moment Ctrl-C comes."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any

from fbvm.base.host import interrupt_held


@contextmanager
def child(command: Sequence[str], **options: Any) -> Iterator[subprocess.Popen[Any]]:
    """A process with the options of `subprocess.Popen`.  Where it still runs at the end of the `with` block, it is ended.

    Ctrl-C that comes while the process is being started waits until it is known here: else nobody would end it.
    Raises OSError if it cannot be started."""
    process = None
    try:
        with interrupt_held():
            process = subprocess.Popen(command, **options)
        yield process
    finally:
        if process is not None:
            process.kill()
            process.wait()
            for pipe in (process.stdin, process.stdout, process.stderr):
                if pipe:
                    with suppress(OSError):  # what is left in its buffer has no reader
                        pipe.close()
