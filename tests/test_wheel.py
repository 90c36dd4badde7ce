"""Wheel and sdist work from any folder: grammars, blocks, examples and pages travel in them."""

from __future__ import annotations

import re
import site
import subprocess
import sys
import tarfile
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
FOLDERS = ("docs", "grammar", "fblib", "examples/lessons", "fbvm", "tests")
LEFT_BEHIND = {"__pycache__", ".fbvm", ".pytest_cache"}


def call(*command: str | Path, cwd: Path) -> str:
    result = subprocess.run([str(part) for part in command], cwd=cwd, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def dist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the sdist, and with the wheel that was made of it."""
    folder = tmp_path_factory.mktemp("dist")
    call(sys.executable, "-m", "build", "--no-isolation", "--outdir", folder, HOUSE, cwd=folder)
    return folder


def built(dist: Path, kind: str) -> Path:
    [path] = dist.glob(kind)
    return path


@pytest.mark.slow
def test_the_wheel_holds_what_fbvm_needs(dist: Path) -> None:
    names = zipfile.ZipFile(built(dist, "*.whl")).namelist()
    assert not [name for name in names if name.startswith(("tests", "docs"))]
    assert {"fbvm/record/page/chart.js", "fbvm/_data/examples/project/.github/workflows/test.yml",
            "fbvm/_data/examples/project/.gitignore",
            "fbvm/_data/examples/lessons/12-two-plcs-one-wire/solution/program.st"} <= set(names)  # fmt: skip


@pytest.mark.slow
def test_links_of_the_description_lead_somewhere_without_the_repository(dist: Path) -> None:
    """README.md has them relative, which a package index cannot follow."""
    with zipfile.ZipFile(built(dist, "*.whl")) as wheel:
        [name] = [name for name in wheel.namelist() if name.endswith(".dist-info/METADATA")]
        description = wheel.read(name).decode("utf-8").partition("\n\n")[2]
    links = re.findall(r"\]\(([^)]*)\)", description)
    assert len(links) > 30 and [link for link in links if not link.startswith("https://")] == []
    inside = [link.partition("/blob/main/")[2].partition("#")[0] for link in links if "/blob/main/" in link]
    assert [link for link in inside if not (HOUSE / link).exists()] == []
    assert "](docs/" in (HOUSE / "README.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_sdist_holds_what_is_kept(dist: Path) -> None:
    with tarfile.open(built(dist, "*.tar.gz")) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    pages = {"CONFORMANCE.md", "README.md", "ARCHITECTURE.md", "CHANGELOG.md", "LICENSE", "pyproject.toml"}
    kept = [path.relative_to(HOUSE).as_posix() for folder in FOLDERS for path in (HOUSE / folder).rglob("*")
            if path.is_file() and not LEFT_BEHIND & set(path.parts)]  # fmt: skip
    assert sorted({*pages, *kept} - names) == []


def contents(wheel: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


@pytest.mark.slow
def test_pip_makes_the_same_wheel_of_the_sdist(dist: Path, tmp_path: Path) -> None:
    """What the next test shows about the wheel is so for the sdist, too: pip installs the wheel that it makes of it."""
    call(sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "--no-index", "--no-build-isolation", "--wheel-dir", tmp_path,
         built(dist, "*.tar.gz"), cwd=tmp_path)  # fmt: skip
    assert contents(built(tmp_path, "*.whl")) == contents(built(dist, "*.whl"))


@pytest.mark.slow
def test_it_runs_in_a_fresh_environment(dist: Path, tmp_path: Path) -> None:
    call(sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv", cwd=tmp_path)
    [packages] = (tmp_path / "venv").rglob("site-packages")
    python = tmp_path / "venv" / ("Scripts/python.exe" if sys.platform == "win32" else "bin/python")
    # What fbvm needs comes from the environment of the tests, fbvm itself from the file alone.
    (packages / "needs.pth").write_text("\n".join(site.getsitepackages()), encoding="utf-8")
    call(sys.executable, "-m", "pip", "--python", python, "install", "-q", "--no-deps", "--no-index", "--no-compile",
         built(dist, "*.whl"), cwd=tmp_path)  # fmt: skip
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
    assert "Equal on both sides." in call(python, "-m", "fbvm", "demo", cwd=outside)
