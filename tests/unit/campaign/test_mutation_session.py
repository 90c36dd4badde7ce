"""A session of mutation testing in parts: which sources and lines, how many processes, which limits, what is counted."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from rows import each_of

from fbvm.base.diagnostics import Source
from fbvm.campaign.mutation import session
from fbvm.campaign.mutation.mutants import EQUAL, INVALID, KILLED, SURVIVED, TIMED_OUT, Change, Mutant, Tried
from fbvm.campaign.mutation.session import NotPossible, Outcome, Settings
from fbvm.campaign.mutation.trial import AsItIs, Bench, Equality
from fbvm.campaign.processes import Crashed, Late

S = 1_000_000_000
BLOCK = "FUNCTION_BLOCK {}\nVAR a : BOOL; END_VAR\n    a := TRUE;\n\n    a := FALSE;\nEND_FUNCTION_BLOCK\n"


def mutant(number: int) -> Mutant:
    return Mutant(number, "a.st", 1, Change("CRO", 0, 1, "x", "A"))


# --- which mutants ----------------------------------------------------------------------------------------------------


def test_sources_are_those_of_the_project_that_are_no_tests(tmp_path: Path) -> None:
    for name in ("b.st", "a/Upper.ST", "a/deep/c.st", "test_b.st", "a/test_c.st", "tests/d.st", "a/tests/e.st", "contest_b.st",
                 "a/tests.st", "x.py", "st"):  # fmt: skip
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("", encoding="utf-8")
    assert sorted(session.sources_of(tmp_path)) == ["a/Upper.ST", "a/deep/c.st", "a/tests.st", "b.st", "contest_b.st"]


def test_mutants_are_numbered_over_all_sources_in_the_order_of_the_texts() -> None:
    sources = [Source("b.st", BLOCK.format("B") + "VAR_GLOBAL g : INT; END_VAR\n"), Source("a.st", BLOCK.format("A"))]
    found = session.mutants_of(sources)
    assert [each.number for each in found] == list(range(1, len(found) + 1))
    places = [(each.file, each.line, each.change.pou) for each in found]
    assert list(dict.fromkeys(places)) == [("b.st", 3, "B"), ("b.st", 5, "B"), ("a.st", 3, "A"), ("a.st", 5, "A")]
    changed = session.mutants_of(sources, {"b.st": {5}, "a.st": {1, 3}})
    assert [each.number for each in changed] == list(range(1, len(changed) + 1))
    assert list(dict.fromkeys((each.file, each.line) for each in changed)) == [("b.st", 5), ("a.st", 3)]
    assert session.mutants_of(sources, {}) == []


@each_of("most, count", [(0, 0), (1, 1), (5, 5), (9, 9), (10, 9)])
def test_a_sample_is_the_same_with_the_same_seed_and_in_order(most: int, count: int) -> None:
    mutants = [mutant(number) for number in range(1, 10)]
    drawn = session.sample(mutants, most, 7)
    assert len(drawn) == count and drawn == session.sample(mutants, most, 7)
    assert [each.number for each in drawn] == sorted({each.number for each in drawn})


class Git:
    """Stands in for git: what was asked, and an answer for each file."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, fails: str = "", **answers: str) -> None:
        self.asked: list[tuple[str, ...]] = []
        self.fails, self.answers = fails, answers
        monkeypatch.setattr(session.subprocess, "run", self.run)

    def run(self, command: Sequence[str], *, cwd: Path, capture_output: bool, encoding: str, check: bool) -> Any:
        assert (cwd, capture_output, encoding, check) == (Path("plant"), True, "utf-8", False)
        self.asked.append(tuple(command))
        failed = self.fails in command
        return SimpleNamespace(returncode=int(failed), stdout=self.answers.get(command[-1], ""), stderr=" fatal: no\n")


DIFF = """diff --git a/a b/a
@@ -1 +1 @@ FUNCTION_BLOCK A
-x
+y
@@ -3,0 +4,3 @@ END_VAR
+1
@@ -10,2 +12,0 @@
-gone
@@ -20,2 +20,1 @@
+ @@ -1 +99 @@
"""


def test_the_lines_that_differ_from_a_revision_are_those_of_the_new_text(monkeypatch: pytest.MonkeyPatch) -> None:
    git = Git(monkeypatch, fails="never", a=DIFF)
    assert session.changed_lines(Path("plant"), "HEAD~1", ["a", "b"]) == {"a": {1, 4, 5, 6, 20}, "b": set()}
    diff = ("git", "diff", "--no-color", "--no-ext-diff", "-U0", "--end-of-options", "HEAD~1", "--")
    assert git.asked == [("git", "rev-parse", "--git-dir"),
                         ("git", "rev-parse", "--verify", "--quiet", "--end-of-options", "HEAD~1^{commit}"),
                         (*diff, "a"), (*diff, "b")]


@each_of("fails, said", [
    ("--git-dir", "git: fatal: no"), ("--verify", "--since old: the repository has no such revision"),
    ("diff", "git: fatal: no")])
def test_what_git_refuses_is_told(fails: str, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    Git(monkeypatch, fails)
    with pytest.raises(NotPossible) as error:
        session.changed_lines(Path("plant"), "old", ["a"])
    assert str(error.value) == said


# --- what came of them ------------------------------------------------------------------------------------------------


@each_of("results, score", [
    ([], 1.0), ([KILLED], 1.0), ([SURVIVED], 0.0), ([EQUAL, INVALID], 1.0), ([KILLED, SURVIVED, EQUAL, INVALID], 0.5),
    ([TIMED_OUT, KILLED, KILLED, SURVIVED], 0.75)])
def test_the_score_is_the_part_of_those_that_count(results: list[str], score: float) -> None:
    outcome = Outcome(9, {number: Tried(mutant(number), result) for number, result in reversed(list(enumerate(results, 1)))})
    assert outcome.score == score and [each.result for each in outcome.rows] == results
    assert outcome.counts == {result: results.count(result) for result in set(results)}


class Workers:
    """Who tries mutants: what was asked and for how long at most; all mutants survive, and none is proved equal."""

    def __init__(self, plain: Any = (0, "")) -> None:
        self.plain, self.asked = plain, list[tuple[list[Any], int]]()

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *raised: object) -> None:
        self.asked.append((["left"], 0))

    def results(self, tasks: Iterable[Any], limit_ns: int) -> Iterator[tuple[Any, Any]]:
        tasks = list(tasks)
        self.asked.append((tasks, limit_ns))
        for task in tasks:
            yield task, self.plain if isinstance(task, AsItIs) else "" if isinstance(task, Equality) else (SURVIVED, "")


@each_of("usual_s, limit_s, budget_s, limits_s", [
    (0, 0, 5, [600, 10, 10]), (1, 0, 5, [600, 10, 10]), (2, 0, 5, [600, 20, 10]), (2, 7, 3, [600, 7, 8]),
    (1, 0, 0, [600, 10, 5])])
def test_tests_may_take_ten_times_as_long_with_a_mutant_and_ten_seconds_at_least(
        usual_s: int, limit_s: int, budget_s: int, limits_s: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session, "stopwatch", lambda: lambda: usual_s * S)
    workers, outcome, mutants = Workers(), Outcome(2), [mutant(1), mutant(2)]
    settings = Settings(limit_ns=limit_s * S, budget_ns=budget_s * S, cycle_ns=77)
    session._try_all(workers, mutants, settings, outcome, lambda outcome: None)  # type: ignore[arg-type]
    equal = [Equality(each, 77, budget_s * S) for each in mutants] if budget_s else []
    assert [tasks for tasks, _ in workers.asked] == [[AsItIs()], mutants, equal]
    assert [limit_ns // S for _, limit_ns in workers.asked] == limits_s


@each_of("plain, said", [
    (Late(), "the tests do not end, without any mutant"), (Crashed("by SIGKILL"), "the tests do not end, without any mutant"),
    ((5, ""), "there are no tests: fbvm test runs test_*.py and programs in test_*.st"),
    ((1, "test_b"), "the tests fail without any mutant: test_b; fbvm test shows why"),
    ((2, ""), "the tests fail without any mutant; fbvm test shows why")])
def test_why_no_mutant_can_be_tried(plain: Any, said: str) -> None:
    workers = Workers(plain)
    with pytest.raises(NotPossible) as error:
        session._try_all(workers, [mutant(1)], Settings(), Outcome(1), lambda outcome: None)  # type: ignore[arg-type]
    assert str(error.value) == said and len(workers.asked) == 1


class Copies:
    """Stands in for processes and for the copies of a project."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.copied: list[tuple[Path, Path]] = []
        self.pools: list[tuple[int, Bench]] = []
        self.workers = Workers()

        class Pool:
            def __class_getitem__(cls, kinds: Any) -> Any:
                return self.pool

        monkeypatch.setattr(session, "Pool", Pool)
        monkeypatch.setattr(session, "copy_project", lambda source, target: self.copied.append((source, target)))

    def pool(self, jobs: int, prepare: Any, work: Any) -> Workers:
        assert prepare.__self__ == work.__self__ and (prepare.__name__, work.__name__) == ("prepare", "work")
        self.pools.append((jobs, prepare.__self__))
        assert Path(prepare.__self__.folders[0]).parent.parent.is_dir()
        return self.workers


@each_of("jobs, mutants, processes", [(1, 3, 1), (2, 3, 2), (3, 3, 3), (4, 3, 3), (2, 0, 1), (0, 3, 1)])
def test_each_process_has_a_copy_and_there_are_no_more_than_mutants(jobs: int, mutants: int, processes: int, tmp_path: Path,
                                                                   monkeypatch: pytest.MonkeyPatch) -> None:
    copies, folder = Copies(monkeypatch), tmp_path / "plant"
    for name in ("src/a.st", "src/b.st", "c.st"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("", encoding="utf-8")
    outcome, sources = Outcome(mutants), [Source("src/a.st", "text of a")]
    session.try_mutants(folder, [mutant(number) for number in range(mutants)], sources, Settings(jobs, ("-x",), S), outcome)
    [(count, bench)] = copies.pools
    place = Path(bench.folders[0]).parent.parent
    assert count == processes and bench.folders == tuple(str(place / f"copy{number}" / "plant") for number in range(processes))
    assert copies.copied == [(folder, Path(each)) for each in bench.folders] and place.name.startswith("fbvm-mutate-")
    assert (bench.texts, bench.arguments, sorted(bench.libraries)) == ({"src/a.st": "text of a"}, ("-x",), [".", "src"])
    assert len(outcome.tried) == mutants and copies.workers.asked[-1][0] == ["left"] and not place.exists()


def test_a_cluster_is_sent_the_packed_project_and_nothing_is_copied(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    copies, workers, sent, told = Copies(monkeypatch), Workers(), list[Any](), list[int]()
    monkeypatch.setattr(session, "pack_project", lambda folder: f"packed {folder.name}")
    monkeypatch.setattr(session, "Shipped", lambda *given: given)
    outcome = Outcome(2)
    session.try_mutants(tmp_path, [mutant(1), mutant(2)], [Source("a.st", "text")], Settings(4, budget_ns=0), outcome,
                        lambda outcome: told.append(len(outcome.tried)), lambda shipped: sent.append(shipped) or workers)
    assert sent == [(Bench((), {"a.st": "text"}, (), ()), tmp_path.name, f"packed {tmp_path.name}")]
    assert (copies.pools, copies.copied, told, len(outcome.tried)) == ([], [], [1, 2], 2)
    assert workers.asked[-1] == (["left"], 0)
