"""What the command line and the plugin of pytest load before they do anything: nothing that is not needed, since that is
most of the time of a short run."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

LOADED = """
import sys
from fbvm.cli.main import main
try:
    main(sys.argv[1:], standalone_mode=False)
finally:
    print(*({"rich", "lark", "llvmlite", "fbvm.check.checker", "fbvm.interchange.markup", "fbvm.dap", "fbvm.live", "fbvm.engine",
             "fbvm.machine.plc", "fbvm.run", "fbvm.net"} & set(sys.modules)))
"""


USED = {"fbvm.engine", "fbvm.machine.plc", "fbvm.run", "fbvm.net"}
"""What a run needs whose program asks nothing of a unit."""


@pytest.mark.slow
@pytest.mark.parametrize(("words", "needed"), [
    (["check", "main.st"], set()), (["fmt", "--check", "main.st"], set()), (["explain", "S0201"], set()),
    (["test", "--version"], set()),
    (["list", "main.st"], {"fbvm.engine"}), (["run", "main.st", "--scans", "3", "--engine", "python"], USED),
])  # fmt: skip
def test_a_verb_loads_what_it_needs(
        words: list[str], needed: set[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = "PROGRAM Main\nVAR\n    d : TON;\nEND_VAR\n    d(IN := TRUE, PT := T#1s);\nEND_PROGRAM\n"
    (tmp_path / "main.st").write_text(text, encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[3]))
    ran = [subprocess.run([sys.executable, "-c", LOADED, *words], cwd=tmp_path, capture_output=True, text=True) for _ in range(2)]
    assert [one.returncode for one in ran] == [0, 0], ran[0].stderr
    assert set(ran[1].stdout.splitlines()[-1].split()) == needed


@pytest.mark.slow
def test_a_session_of_pytest_without_plc_code_loads_no_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "test_sum.py").write_text("def test_sum():\n    assert 1 + 1 == 2\n", encoding="utf-8")
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[3]))
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    program = """
import sys
import pytest
status = pytest.main(["-q", "-p", "fbvm.testing.plugin", "-p", "no:cacheprovider"])
print(status.value, *sorted({"fbvm.testing.plugin", "fbvm.machine.plc", "fbvm.check", "fbvm.syntax", "lark"} & set(sys.modules)))
"""
    ran = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True)
    assert ran.stdout.splitlines()[-1] == "0 fbvm.testing.plugin", ran.stderr
