"""Types and style are checked by mypy and ruff, as pyproject.toml asks them."""

from __future__ import annotations

import importlib.util
import subprocess
import sys

import pytest
from house import HOUSE

COMMANDS = {"mypy": [], "ruff": ["check", "--quiet", "."]}


@pytest.mark.slow
@pytest.mark.parametrize("tool", COMMANDS)
def test_nothing_is_found(tool: str) -> None:
    if importlib.util.find_spec(tool) is None:
        pytest.skip(f"{tool} is not installed")
    done = subprocess.run([sys.executable, "-m", tool, *COMMANDS[tool]], cwd=HOUSE, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
