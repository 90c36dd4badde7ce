"""Work in a process of its own, which can be broken off: a compiler that is a function of C cannot, in this one."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence

from fbvm.base.children import child

DEAF = "import signal; signal.signal(signal.SIGINT, signal.SIG_IGN)\n"
"""Ctrl-C at a terminal reaches all processes there; the one that asked for the work says when it ends."""


def run_apart(program: str, data: bytes, options: Sequence[str] = ()) -> bytes | None:
    """Runs a Python program in a process of its own, with `data` as its standard input.  Returns what it writes.

    Returns None if the process cannot be started or fails, as where a system has none; an exception, such as Ctrl-C, ends it.
    `options` are those of the interpreter."""
    command = [sys.executable, *options, "-c", DEAF + program]
    try:
        with child(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
            made, _ = process.communicate(data)
    except (OSError, ValueError):
        return None
    return made if process.returncode == 0 else None
