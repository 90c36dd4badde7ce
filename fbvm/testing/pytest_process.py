"""pytest with the plugin in a process of its own, for the commands that run tests; loads nothing that compiles or runs a PLC."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from importlib.metadata import entry_points
from pathlib import Path

from fbvm.base.children import child

PLUGIN = "fbvm.testing.plugin"


def run_pytest(arguments: Sequence[str], cwd: Path | None = None, quiet: bool = False) -> int:
    """Runs pytest with the plugin, also where fbvm is not installed; returns its exit status.

    `cwd` is the folder in which it runs, this process's by itself; `quiet` drops what it prints."""
    installed = any(entry.value == PLUGIN for entry in entry_points(group="pytest11"))
    command = [sys.executable, "-m", "pytest", *([] if installed else ["-p", PLUGIN]), *arguments]
    with child(command, cwd=cwd, stdout=subprocess.DEVNULL if quiet else None) as process:
        return process.wait()
