"""The workflow of continuous integration: every system, every Python that the package names, and the command of the README."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib

import pytest
from house import HOUSE

WORKFLOW = (HOUSE / ".github" / "workflows" / "test.yml").read_text(encoding="utf-8")
RUN = HOUSE / ".ci" / "run"


def test_every_system_and_every_python() -> None:
    (systems,), (pythons,) = (re.findall(rf"(?m)^ +{key}: \[(.+)\]$", WORKFLOW) for key in ("os", "python"))
    assert systems.split(", ") == ["ubuntu-latest", "windows-latest", "macos-latest"]
    project = tomllib.loads((HOUSE / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    named = [row.rpartition(" ")[2] for row in project["classifiers"] if re.search(r":: 3\.\d+$", row)]
    assert [python.strip('"') for python in pythons.split(", ")] == named
    assert "fail-fast: false" in WORKFLOW
    assert "shell: bash" in WORKFLOW  # which Windows has beside its own
    assert WORKFLOW.rstrip().endswith("- run: .ci/run")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="takes a stand-in for `uname` from the path")
@pytest.mark.parametrize(("system", "python", "programs"), [
    ("Linux", "python3", "bin"), ("Darwin", "python3", "bin"), ("MINGW64_NT-10.0", "python", "Scripts"),
])
def test_the_command_of_the_readme_on_each_system(system: str, python: str, programs: str) -> None:
    install = f".venv/{programs}/pip install -q -e '.[test]'"
    expected = f"{python} -m venv .venv && {install} && .venv/{programs}/python -m pytest -n auto"
    part = RUN.read_text(encoding="utf-8").partition('command="$(sed')
    script = f'uname() {{ echo {system}; }}\n{part[1]}{part[2]}'.replace('bash -euc "$command"', "")
    done = subprocess.run(["bash", "-euc", script], cwd=HOUSE, capture_output=True, text=True, check=True)
    assert done.stdout == f"+ {expected}\n"
