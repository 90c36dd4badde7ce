"""Types and style are checked by mypy and ruff, as pyproject.toml asks them."""

from __future__ import annotations

import ast
import importlib.util
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest
from house import HOUSE


def findings(*command: str) -> str:
    """What a program of this environment says about the repository; empty if it finds nothing."""
    if importlib.util.find_spec(command[0]) is None:
        pytest.skip(f"{command[0]} is not installed")
    done = subprocess.run([sys.executable, "-m", *command], cwd=HOUSE, capture_output=True, text=True, check=False)
    return done.stdout + done.stderr if done.returncode else ""


@pytest.mark.slow
def test_ruff_finds_nothing() -> None:
    assert findings("ruff", "check", "--quiet", ".") == ""


def checked_by_mypy(platform: str, *files: str) -> str:
    """Another platform makes a cache worthless: each has its own, and that of this platform is the one that `mypy` leaves."""
    cache_dir = ".mypy_cache" if platform == sys.platform else f".mypy_cache/{platform}"
    return findings("mypy", "--no-error-summary", "--platform", platform, "--cache-dir", cache_dir, *files)


@pytest.mark.slow
def test_mypy_finds_nothing() -> None:
    assert checked_by_mypy("linux") == ""


@cache
def differs_by_platform(module: str) -> bool:
    """Whether mypy's stub of a module of the standard library asks for the platform."""
    spec = importlib.util.find_spec("mypy")
    assert spec and spec.origin
    stubs = Path(spec.origin).parent / "typeshed" / "stdlib"
    places = (stubs / f"{module.replace('.', '/')}.pyi", stubs / module.replace(".", "/") / "__init__.pyi")
    return any("sys.platform" in place.read_text(encoding="utf-8") for place in places if place.is_file())


def imported(path: Path) -> set[str]:
    """The modules that a file names in its imports, wherever these stand."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return names


@pytest.mark.slow
@pytest.mark.parametrize("platform", ["win32", "darwin"])
def test_mypy_finds_nothing_on_another_platform(platform: str) -> None:
    """Types of the other modules are the same everywhere; they are read for their names (`silent`), not checked once more."""
    if importlib.util.find_spec("mypy") is None:
        pytest.skip("mypy is not installed")
    package = HOUSE / "fbvm"
    files = [str(path) for path in sorted(package.rglob("*.py")) if any(map(differs_by_platform, imported(path)))]
    assert str(package / "base" / "host.py") in files
    assert checked_by_mypy(platform, "--follow-imports", "silent", *files) == ""
