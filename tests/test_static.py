"""Types and style are checked by mypy and ruff, as pyproject.toml asks them."""

from __future__ import annotations

import importlib.util
import subprocess
import sys

import pytest
from house import HOUSE

COMMANDS = [("ruff", "check", "--quiet", "."),
            *(("mypy", "--platform", platform, "--cache-dir", f".mypy_cache/{platform}")
              for platform in ("linux", "win32", "darwin"))]  # fmt: skip
"""Each platform has a cache of its own: another platform makes a cache worthless."""


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: "-".join(command[:3]))
def test_nothing_is_found(command: tuple[str, ...]) -> None:
    if importlib.util.find_spec(command[0]) is None:
        pytest.skip(f"{command[0]} is not installed")
    done = subprocess.run([sys.executable, "-m", *command], cwd=HOUSE, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
