"""The example clients of the live protocol's page, run as they stand there against a PLC that runs."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow
PAGE = Path(__file__).parents[2] / "docs" / "reference" / "live-protocol.md"
COUNTS = "PROGRAM Main VAR Level : INT; END_VAR Level := Level + 1; END_PROGRAM"
LINES = 3
"""Updates that a client prints before it is ended."""


@pytest.fixture
def address(tmp_path: Path) -> Iterator[list[str]]:
    """Port and token of a page, as its address prints them."""
    (tmp_path / "pump.st").write_text(COUNTS)
    command = [sys.executable, "-m", "fbvm", "live", str(tmp_path / "pump.st")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as run:
        assert run.stdout is not None
        found = next((match for line in run.stdout if (match := re.match(r"http://127\.0\.0\.1:(\d+)/#token=(\S+)", line))), None)
        assert found is not None
        yield list(found.groups())
        run.terminate()


def example(language: str, file: Path) -> Path:
    """The example of the page in this language, as a file."""
    [text] = re.findall(rf"```{language}\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)
    file.write_text(text, encoding="utf-8")
    return file


def levels(command: list[str]) -> list[int]:
    """The values of Main.Level that a client prints first."""
    seen: list[int] = []
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as client:
        assert client.stdout is not None and client.stderr is not None
        for line in client.stdout:
            seen += [int(value) for value in re.findall(r"'Main\.Level': '(\d+)'", line)]
            if len(seen) >= LINES:
                break
        client.terminate()
        assert len(seen) >= LINES, client.stderr.read()
    return seen


def test_the_client_in_python_sees_values(address: list[str], tmp_path: Path) -> None:
    seen = levels([sys.executable, "-u", str(example("python", tmp_path / "watch_level.py")), *address])
    assert seen == sorted(set(seen))


def test_the_client_in_javascript_sees_values(address: list[str], tmp_path: Path) -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    version = int(subprocess.run([node, "--version"], capture_output=True, text=True, check=True).stdout[1:].partition(".")[0])
    if version < 20:
        pytest.skip(f"node {version} has no WebSocket")
    option = ["--experimental-websocket"] * (version < 22)
    seen = levels([node, *option, str(example("js", tmp_path / "watch_level.js")), *address])
    assert seen == sorted(set(seen))
