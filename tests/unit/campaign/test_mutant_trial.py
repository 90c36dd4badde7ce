"""What a process does with one mutant in its copy of the project, and what it leaves there."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from fbvm.campaign.mutation import trial
from fbvm.campaign.mutation.mutants import EQUAL, INVALID, KILLED, SURVIVED, Change, Mutant
from fbvm.campaign.mutation.trial import AsItIs, Bench

TEXT = "FUNCTION_BLOCK B\nVAR_INPUT a : INT; END_VAR\nVAR_OUTPUT b : INT; END_VAR\n    b := a + 1;\nEND_FUNCTION_BLOCK\n"


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Bench:
    """A bench with one copy of a project, prepared; what it changes of the process is put back by the test."""
    (tmp_path / "copy").mkdir()
    monkeypatch.setenv("FBVM_CACHE", "elsewhere")
    monkeypatch.setattr(trial.sys, "dont_write_bytecode", False)
    monkeypatch.chdir(tmp_path)
    made = Bench((), {"b.st": TEXT}, ("tests", "-k", "x"), (".",)).in_folders([str(tmp_path / "copy")])
    made.prepare(0)
    return made


def mutant(old: str, new: str) -> Mutant:
    start = TEXT.index(old)
    return Mutant(1, "b.st", 4, Change("X", start, start + len(old), new, "B"))


def test_a_copy_is_made_whole_again_and_has_its_own_cache(bench: Bench, tmp_path: Path) -> None:
    assert Path.cwd() == tmp_path / "copy" and Path("b.st").read_text() == TEXT and trial.sys.dont_write_bytecode
    assert Path(trial.os.environ["FBVM_CACHE"]) == tmp_path / "cache"
    Path("b.st").write_text("left by a mutant")
    bench.prepare(0)
    assert Path("b.st").read_text() == TEXT


def test_a_mutant_is_in_the_file_while_its_tests_run_and_gone_afterwards(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[str, tuple[str, ...]]] = []
    answers = iter([(1, "test_b.py::test_b"), (0, ""), (2, "")])

    def run(arguments: Sequence[str]) -> tuple[int, str]:
        seen.append((Path("b.st").read_text(), tuple(arguments)))
        return next(answers)

    monkeypatch.setattr(trial, "run_tests", run)
    changed = mutant("a + 1", "a - 1")
    assert [bench.work(0, changed) for _ in range(3)] == [(KILLED, "test_b.py::test_b"), (SURVIVED, ""), (KILLED, "")]
    assert seen == [(TEXT.replace("a + 1", "a - 1"), ("tests", "-k", "x"))] * 3 and Path("b.st").read_text() == TEXT
    answers = iter([(5, "")])
    assert bench.work(0, AsItIs()) == (5, "") and seen[-1] == (TEXT, ("tests", "-k", "x"))


def test_an_equal_mutant_and_one_that_is_no_program_are_not_tried(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trial, "run_tests", lambda arguments: pytest.fail("tests were run"))
    assert bench.work(0, mutant("a + 1", "(a) + 1")) == (EQUAL, "the compiled program is the same")
    result, why = bench.work(0, mutant("a + 1", "a + TRUE"))
    assert result == INVALID and "b.st:4:" in why and "\n" not in why
    assert Path("b.st").read_text() == TEXT


def test_a_mutant_of_a_block_that_cannot_be_compiled_alone_is_tried(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """It may be whole together with what its tests give it."""
    monkeypatch.setattr(trial, "run_tests", lambda arguments: (0, ""))
    broken = Bench(bench.folders, {"b.st": TEXT.replace("a + 1", "other(1)")}, (), ())
    broken.prepare(0)
    at = broken.texts["b.st"].index("(1)") + 1
    assert broken.work(0, Mutant(1, "b.st", 4, Change("X", at, at + 1, "2", "B"))) == (SURVIVED, "")


def test_what_fails_while_a_mutant_is_there_leaves_the_file_as_it_was(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError), trial._written(tmp_path / "a.st", "changed", "before"):
        assert (tmp_path / "a.st").read_text() == "changed"
        raise RuntimeError
    assert (tmp_path / "a.st").read_text() == "before"


def test_the_first_test_or_file_that_fails_is_told() -> None:
    first = trial._First()
    for failed, name in ((False, "a"), (True, "b"), (True, "c")):
        first.pytest_runtest_logreport(report(failed, name))
        assert first.failed == ("b" if name != "a" else "")
    other = trial._First()
    for failed, name in ((False, "a.py"), (True, "b.py"), (True, "c.py")):
        other.pytest_collectreport(report(failed, name))
    assert other.failed == "b.py"


def report(failed: bool, name: str) -> pytest.TestReport:
    made = pytest.TestReport(name, ("a", 1, "a"), {}, "failed" if failed else "passed", None, "call")
    assert made.failed is failed
    return made
