"""Mutants of a project against its tests, by processes."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from fbvm.campaign.mutation.session import changed_lines
from fbvm.campaign.processes import LATE, Crashed, Pool
from fbvm.campaign.project_copies import pack_project
from fbvm.campaign.shipped import Shipped
from fbvm.cli.main import main

pytestmark = pytest.mark.slow

LEVEL = """FUNCTION_BLOCK Level
VAR_INPUT Pulse : BOOL; END_VAR
VAR_OUTPUT Number : INT; END_VAR
    IF Pulse THEN Number := Number + 1; END_IF;
    IF Number > 5 THEN Number := 5; END_IF;
END_FUNCTION_BLOCK
"""
TEST = """def test_five(fb):
    level = fb("src/Level.st")
    level.run("100ms", Pulse=True)
    assert level.Number == 5
"""


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, text in {"src/Level.st": LEVEL, "tests/test_level.py": TEST, "pytest.ini": "[pytest]\n"}.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def mutated(*arguments: str) -> tuple[int, Any]:
    result = CliRunner().invoke(main, ["mutate", "--json", *arguments])
    return result.exit_code, json.loads(result.stdout) if result.stdout else result.stderr


def contents(folder: Path) -> dict[str, str]:
    return {str(path.relative_to(folder)): path.read_text() for path in folder.rglob("*") if path.is_file()}


def test_survivors_are_told_equal_ones_do_not_count_and_the_folder_stays(project: Path) -> None:
    before = contents(project)
    status, found = mutated("--jobs", "2", "--budget", "60s")
    assert contents(project) == before
    results = {(each["operator"], each["diff"].split("\n+")[-1].strip()): each["result"] for each in found["mutants"]}
    assert status == 1
    assert results["ARO", "IF Pulse THEN Number := Number - 1; END_IF;"] == "killed"
    assert results["CRO", "IF Pulse THEN Number := Number + 2; END_IF;"] == "survived"
    assert results["ROR", "IF Number >= 5 THEN Number := 5; END_IF;"] == "equal"
    assert found["tried"] == found["known"] == len(found["mutants"])
    _, drawn = mutated("--jobs", "1", "--budget", "60s", "--sample", "3")
    assert [found["mutants"][each["number"] - 1] for each in drawn["mutants"]] == drawn["mutants"]


def test_tests_that_fail_already_say_nothing_about_mutants(project: Path) -> None:
    (project / "tests" / "test_level.py").write_text("def test_wrong():\n    assert False\n")
    status, said = mutated("--sample", "1")
    assert status == 2
    assert "the tests fail without any mutant: tests/test_level.py::test_wrong" in said


def test_only_lines_that_have_changed_since_a_revision(project: Path) -> None:
    def git(*words: str) -> None:
        subprocess.run(["git", "-c", "user.name=a", "-c", "user.email=a@b", *words], check=True, capture_output=True, cwd=project)

    git("init")
    git("add", ".")
    git("commit", "-m", "first")
    (project / "src" / "Level.st").write_text(LEVEL.replace("> 5", "> 6").replace("    IF Pulse", "\n    IF Pulse"))
    assert changed_lines(project, "HEAD", ["src/Level.st"]) == {"src/Level.st": {4, 6}}
    status, said = mutated("--since", "nosuch")
    assert (status, "--since nosuch: the repository has no such revision" in said) == (2, True)


def test_a_test_that_is_not_there_is_told_before_anything_is_tried(project: Path) -> None:
    status, said = mutated("--tests", "tests/nothing.py::x")
    assert (status, "--tests tests/nothing.py::x: there is no tests/nothing.py in this folder" in said) == (2, True)


def _nothing(number: int) -> None:
    pass


def _work(number: int, task: str) -> str:
    if task == "ends":
        os._exit(3)
    while task == "stays":
        pass
    return task.upper()


def test_a_task_that_ends_its_process_or_never_ends_is_told_and_the_others_are_done() -> None:
    with Pool[str, str](2, _nothing, _work) as pool:
        found = dict(pool.results(["a", "ends", "b", "stays", "c"], 3_000_000_000))
    assert found == {"a": "A", "b": "B", "c": "C", "ends": Crashed("with status 3"), "stays": LATE}


def test_a_cluster_finds_what_processes_find(project: Path) -> None:
    pytest.importorskip("distributed", reason="the extra cluster is not installed")
    chosen = ("--budget", "0s", "--sample", "4", "--seed", "1", "--jobs", "1")
    here, there = mutated(*chosen), mutated(*chosen, "--cluster", "local")
    assert here == there
    assert here[1]["counts"]["killed"] and here[1]["counts"]["survived"]


class Stays:
    """A bench of tasks that say in which folder they are, or never end."""

    folder = ""

    def in_folders(self, folders: Sequence[str]) -> Stays:
        self.folder = folders[0]
        return self

    def prepare(self, number: int) -> None:
        os.chdir(self.folder)

    def work(self, number: int, task: str) -> str:
        return f"{Path.cwd().name} {Path(task).read_text()}" if task != "stays" else _work(number, task)


def test_what_hangs_in_a_copy_that_has_travelled_is_ended(project: Path) -> None:
    (project / "a.txt").write_text("here")
    shipped = Shipped(Stays(), "plant", pack_project(project))
    try:
        assert [shipped.limited("a.txt", 60_000_000_000), shipped.limited("stays", 1_000_000)] == ["plant here", LATE]
    finally:
        shipped.close()
