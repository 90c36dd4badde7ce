"""Clients of other people that test debuggers and language servers, against `fbvm dap` and `fbvm lsp`.

FBVM_EDITOR_CLIENTS is a folder with pytest-lsp, filled by `pip install --target`, and with @vscode/debugadapter-testsupport in
`node_modules`."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow
HERE = Path(__file__).resolve().parent
CLIENTS = Path(os.environ.get("FBVM_EDITOR_CLIENTS", "/nowhere"))
NODE = shutil.which("node")
BOUND_S = 120
COUNT = "PROGRAM Main\nVAR n : INT; END_VAR\nn := n + 1;\nIF n = 500 THEN n := 0; END_IF\nEND_PROGRAM\n"
PUMP = "PROGRAM Main\nVAR Level : INT; END_VAR\n    Levl := Level + 1;\nEND_PROGRAM\n"


def printed(command: list[str], **more: str) -> dict[str, object]:
    """What a client prints."""
    done = subprocess.run(command, capture_output=True, text=True, timeout=BOUND_S, check=False, env={**os.environ, **more})
    if done.returncode == 77:
        pytest.skip("@vscode/debugadapter-testsupport is not installed")
    assert done.returncode == 0, done.stderr
    found: dict[str, object] = json.loads(done.stdout)
    return found


def test_the_debug_client_of_vs_code(tmp_path: Path) -> None:
    if NODE is None:
        pytest.skip("node is not installed")
    file = tmp_path / "count.st"
    file.write_text(COUNT, encoding="utf-8")
    with subprocess.Popen([sys.executable, "-m", "fbvm", "dap", "--listen", "0"], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        try:
            port = process.stdout.readline().rpartition(":")[2].strip()
            found = printed([NODE, str(HERE / "dap_session.js"), port, str(file)], NODE_PATH=str(CLIENTS / "node_modules"))
        finally:
            process.terminate()
    assert found == {
        "first": "1", "later": "400", "data": ["plc|D200", ["write"]], "before": "399", "frame": ["Main", 3], "locals": ["n"],
        "back": "back in scan 399, 3s990ms", "pause": "pause", "end": "entry",
        "refused": found["refused"]}  # fmt: skip
    assert "nonsense" in str(found["refused"])


@pytest.mark.parametrize("name", ["visual-studio-code", "neovim", "emacs"])
def test_the_language_client_of_pytest_lsp(tmp_path: Path, name: str) -> None:
    if not (CLIENTS / "pytest_lsp").is_dir():
        pytest.skip("pytest-lsp is not installed")
    (tmp_path / "pump.st").write_text(PUMP, encoding="utf-8")
    found = printed([sys.executable, "-c", f"import sys; sys.path.insert(0, {str(CLIENTS)!r}); sys.argv = sys.argv[1:]; "
                     "import runpy; runpy.run_path(sys.argv[0], run_name='__main__')",
                     str(HERE / "lsp_session.py"), sys.executable, str(tmp_path), name])  # fmt: skip
    assert "Write Level" in str(found.pop("fixes"))
    assert found == {"encoding": found["encoding"], "wrong": ["S0201"], "mended": [], "hover": True, "symbols": ["Main"],
                     "completion": True, "tokens": 0}  # fmt: skip
