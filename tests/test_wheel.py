"""The wheel works from any folder: grammars, blocks and the example travel in it."""

from __future__ import annotations

import site
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

HOUSE = Path(__file__).resolve().parent.parent
PROGRAM = """
PROGRAM Main
VAR t : TON; c : MTCP_ETN_Connect; END_VAR
    t(IN := TRUE, PT := T#20ms);
    c();
END_PROGRAM
"""


def call(*command: str | Path, cwd: Path) -> str:
    result = subprocess.run([str(part) for part in command], cwd=cwd, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.mark.slow
def test_a_wheel_runs_in_a_fresh_environment(tmp_path: Path) -> None:
    call(sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", tmp_path / "dist", HOUSE, cwd=tmp_path)
    [wheel] = (tmp_path / "dist").glob("fbvm-*.whl")
    names = zipfile.ZipFile(wheel).namelist()
    assert not [name for name in names if name.startswith("tests")]
    assert {"fbvm/record/page/chart.js", "fbvm/_data/examples/project/.github/workflows/test.yml",
            "fbvm/_data/examples/project/.gitignore",
            "fbvm/_data/examples/lessons/12-two-plcs-one-wire/solution/program.st"} <= set(names)  # fmt: skip
    call(sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv", cwd=tmp_path)
    [packages] = (tmp_path / "venv").rglob("site-packages")
    python = tmp_path / "venv" / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    # What fbvm needs comes from the environment of the tests, fbvm itself from the wheel alone.
    (packages / "needs.pth").write_text("\n".join(site.getsitepackages()), encoding="utf-8")
    call(sys.executable, "-m", "pip", "--python", python, "install", "-q", "--no-deps", "--no-index", wheel,
         cwd=tmp_path)  # fmt: skip
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "main.st").write_text(PROGRAM, encoding="utf-8")
    found = call(python, "-c", "import fbvm; print(fbvm.__file__)", cwd=outside)
    assert Path(found.strip()).is_relative_to(tmp_path / "venv")
    assert call(python, "-m", "fbvm", "check", "main.st", cwd=outside) == ""
    shown = call(python, "-m", "fbvm", "run", "main.st", "--until", "Main.t.Q", "--max", "1s", "--show", "Main.t.ET",
                 cwd=outside)  # fmt: skip
    assert shown == "Main.t.ET = T#20ms\n"
    assert "fbvm test" in call(python, "-m", "fbvm", "new", "mine", cwd=outside)
    assert "division by zero" in call(python, "-m", "fbvm", "explain", "R0101", cwd=outside)
