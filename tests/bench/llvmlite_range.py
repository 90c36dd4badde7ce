"""Tests machine code with the lowest and the highest llvmlite that pyproject allows: python tests/bench/llvmlite_range.py

Each end gets a virtual environment in the folder named by FBVM_ENDS (by default a temporary one), filled by pip.  Prints what
came of each; status 1 if one failed, 2 if an environment cannot be made (no network, no wheel for this Python)."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import tomllib
import venv
from pathlib import Path

HOUSE = Path(__file__).resolve().parents[2]
TESTS = ("tests/unit/engine/test_native.py", "tests/unit/engine/test_native_subset.py", "tests/unit/machine/test_breakpoints.py",
         "tests/unit/machine/test_many_scans.py", "tests/unit/engine/test_tiers.py", "tests/property/test_engines_agree.py",
         "tests/property/test_texts_agree.py")
PROGRAMS = 50
"""Programs in ST made at random that are compared besides."""


def ends() -> tuple[str, str]:
    """What pip is asked for at both ends."""
    project = tomllib.loads((HOUSE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = next(row for row in project["dependencies"] if row.startswith("llvmlite"))
    bounds = re.match(r"llvmlite>=(\d+\.\d+),<(\d+)\.(\d+);", wanted)
    assert bounds, wanted
    return f"llvmlite=={bounds[1]}.*", f"llvmlite=={bounds[2]}.{int(bounds[3]) - 1}.*"


def environment(folder: Path, wanted: str) -> Path:
    """The Python of an environment with that llvmlite."""
    place = folder / re.sub(r"\W+", "_", wanted)
    python = place / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    if not python.exists():
        venv.create(place, with_pip=True)
    others = ["lark>=1.2,<2", "click>=8.1,<9", "rich>=13.7", "prompt_toolkit>=3.0.40,<4", "pytest>=8.2", "hypothesis>=6.100"]
    subprocess.run([python, "-m", "pip", "install", "-q", wanted, *others], check=True)
    return python


def test(python: Path) -> bool:
    """True if machine code does there what it has to."""
    work = {**os.environ, "PYTHONPATH": str(HOUSE)}
    version = "import llvmlite, llvmlite.binding as b; print('llvmlite', llvmlite.__version__, 'LLVM', b.llvm_version_info)"
    subprocess.run([python, "-c", version], check=True)
    tested = subprocess.run([python, "-m", "pytest", "-q", "-p", "no:cacheprovider", *TESTS], cwd=HOUSE, env=work)
    compared = subprocess.run([python, "tests/property/st_programs.py", str(PROGRAMS)], cwd=HOUSE, env=work)
    return not tested.returncode and not compared.returncode


def main() -> int:
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(os.environ.get("FBVM_ENDS") or temporary)
        try:
            pythons = [environment(folder, wanted) for wanted in ends()]
        except (OSError, subprocess.CalledProcessError) as error:
            print(f"an environment cannot be made: {error}", file=sys.stderr)
            return 2
        passed = [test(python) for python in pythons]
    return 0 if all(passed) else 1


if __name__ == "__main__":
    sys.exit(main())
