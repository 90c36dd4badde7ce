"""What seldom happens in a campaign: errors of projects, crashes between writes, proofs of equality, tests that are none."""

from __future__ import annotations

import errno
import io
import os
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, cast

import pytest

from fbvm import Plc, compile_text
from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.campaign.axes import axis_from_text
from fbvm.campaign.execution import Execution, Result, Wrong, _with_line
from fbvm.campaign.fleet import shard as fleet
from fbvm.campaign.items import bench as items_bench
from fbvm.campaign.items.bench import ItemsBench
from fbvm.campaign.items.execution import ItemsExecution, NoTests, _Session
from fbvm.campaign.judge import NEVER, UNTIL, Failure, Judge, Seen
from fbvm.campaign.mutation import session, trial
from fbvm.campaign.mutation.equivalence import proof_of_equality
from fbvm.campaign.mutation.mutants import Change, Mutant
from fbvm.campaign.mutation.session import NotPossible
from fbvm.campaign.mutation.trial import Bench, Equality
from fbvm.campaign.plan import Axis, Judging, Plan
from fbvm.campaign.plan_file import Written, read_plan_file, with_about
from fbvm.campaign.planning import Unfit, _located, images_of, plan_of, program_project
from fbvm.campaign.runs import Outcome
from fbvm.campaign.shrinking import Shrunk
from fbvm.campaign.store import Store, write_parquet
from fbvm.campaign.variants import Cut, Variant
from fbvm.campaign.work import Batch, Shrinking
from fbvm.campaign.work import Bench as RunBench
from fbvm.run.project import Project

MS = 1_000_000
NOTHING = Project(Source("fbvm.toml", ""), "loop", 0, None, None, (), (), frozenset(), (), ())
TEXT = "PROGRAM Main\nVAR n, Limit : INT := 5; END_VAR\nn := n + 1;\nEND_PROGRAM\n"


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> tuple[Project, Any]:
    path = tmp_path_factory.mktemp("program") / "part.st"
    path.write_text(TEXT)
    project = program_project([path], Written().about, path.parent)
    return project, images_of(project)[0]


def plan(program: tuple[Project, Any], **about: Any) -> Plan:
    return plan_of(with_about(Written(), **{"for": 60 * MS, **about}), *program)


# --- runs of programs ---------------------------------------------------------------------------------------------------


def test_sources_that_are_not_there_and_names_of_plcs_that_are_none_are_told(tmp_path: Path) -> None:
    with pytest.raises(Unfit, match=r"^there is no file .*nothing\.st"):
        program_project([tmp_path / "nothing.st"], Written().about, tmp_path)
    axis = axis_from_text("pump.Main.n=1")
    assert _located(axis, ["pump", "tank"]) == replace(axis, plc="pump", path="Main.n")
    assert _located(axis, ["tank"]) == replace(axis, plc="tank"), "with one PLC its name may be left out"
    with pytest.raises(Unfit, match=r"^pump\.Main\.n begins with the name of no PLC; there is a, b$"):
        _located(axis, ["a", "b"])
    cycle = Axis("tank.cycle", "cycle", (1,), "tank")
    assert _located(cycle, ["pump", "tank"]) == cycle and _located(replace(cycle, plc=""), ["pump"]).plc == ""


def test_a_project_with_errors_is_not_executed(monkeypatch: pytest.MonkeyPatch) -> None:
    wrong = [Diagnostic("P0103", Source("a.toml", "x"), 0, 1, text) for text in ("first", "second")]
    monkeypatch.setattr("fbvm.campaign.execution.Plant", lambda *about, **more: SimpleNamespace(diagnostics=wrong))
    with pytest.raises(Wrong, match=r"(?s)first.*second") as raised:
        Execution(Plan(NOTHING), {}).result(Variant(0, 0, ()))
    assert raised.value.diagnostics == wrong


@pytest.mark.slow
def test_a_cut_of_a_plc_that_has_ended_does_nothing(program: tuple[Project, Any]) -> None:
    made = plan(program, show=("Main.n",))
    bench = RunBench.of(made, program[1])
    bench.prepare(0)
    execution = bench.execution()
    assert isinstance(execution, Execution)
    run = SimpleNamespace(reason="max", plc=SimpleNamespace(warm_start=lambda: pytest.fail("it was started")), due_ns=5)
    execution._cut(Cut("plc", 0, MS), run, "plc", Variant(0, 0, ()))  # type: ignore[arg-type]
    assert run.due_ns == 5
    assert bench.limited(Batch((0,)), 1) == [execution.result(bench.variant(0))]


@pytest.mark.slow
def test_a_failure_whose_places_no_statement_has_changed_has_no_line() -> None:
    image = compile_text(TEXT).image
    assert image is not None
    plc = Plc(image)
    from fbvm.record.recording.recording import Recording

    recording = Recording()
    recording.add("plc", plc)
    plc.run(scans=3)
    failure = Failure(NEVER, "Main.Limit = 5", "plc", 2, 20 * MS)
    assert _with_line(Seen(failure, {"plc": (2, [plc.find("Main.Limit")])}), recording) == failure  # type: ignore[list-item]
    with_line = _with_line(Seen(failure, {"plc": (2, [plc.find("Main.n")])}), recording)  # type: ignore[list-item]
    assert (with_line.line, with_line.pou) == (3, "Main")


def test_a_plc_that_has_not_come_to_its_end_fails() -> None:
    image = compile_text(TEXT).image
    assert image is not None
    plc = Plc(image)
    plc.run(scans=4)
    for reason, failed in (("max", True), ("until", False), ("", False)):
        runs: Mapping[str, Any] = {"pump": SimpleNamespace(plc=plc, reason=reason)}
        found = Judge(Judging(), runs, True).ended()
        assert found == (Failure(UNTIL, "pump has not come to its end", "pump", 3, 30 * MS) if failed else None)


def test_of_a_file_that_cannot_be_read_the_reason_is_told(tmp_path: Path) -> None:
    found = read_plan_file(tmp_path / "nothing.toml")
    assert isinstance(found, list) and len(found) == 1 and "nothing.toml" in found[0].render()


@pytest.mark.slow
def test_a_store_goes_on_behind_the_last_whole_line(tmp_path: Path) -> None:
    results = [Result(number, 5, MS, 7, None, (number,)) for number in range(3)]
    store = Store(tmp_path, "mark")
    store.add(results[:2])
    store.close()
    path = tmp_path / "results.jsonl"
    whole = path.read_bytes()
    for damage in (b'{"number": 2, "sc', b'{"number": 2}\n{"number": 3}\n', b"[]\n", b"nothing\n"):
        path.write_bytes(whole + damage)
        store = Store(tmp_path, "mark")
        assert store.known == results[:2]
        store.add(results[2:])
        store.close()
        assert path.read_bytes() == whole + path.read_bytes()[len(whole):] and path.read_bytes().count(b"\n") == 4
    fresh = Store(tmp_path, "mark", fresh=True)
    assert fresh.known == []
    fresh.close()


def test_a_store_on_a_full_disk_says_so_once(tmp_path: Path) -> None:
    class Full(io.RawIOBase):
        def writable(self) -> bool:
            return True

        def write(self, data: Any, /) -> int:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    store, full = Store(tmp_path, "mark"), Full()
    store._file.close()
    store._file = cast(Any, io.BufferedWriter(full))
    with pytest.raises(OSError, match="No space"):
        store.add([Result(0, 5, MS, 7, None, ())])
    store.close()
    assert full.closed


def test_a_parquet_file_has_numbers_where_all_values_are(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By a stand-in for pyarrow that keeps what it is given."""
    written: list[tuple[Any, Any]] = []
    arrow, parquet = ModuleType("pyarrow"), ModuleType("pyarrow.parquet")
    vars(arrow).update(int64=lambda: "int", float64=lambda: "float", string=lambda: "str", table=dict, parquet=parquet,
                       array=lambda cells, kind: (kind, cells))  # fmt: skip
    vars(parquet).update(write_table=lambda table, path: written.append((table, path)))
    monkeypatch.setitem(sys.modules, "pyarrow", arrow)
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", parquet)
    axes = (axis_from_text("Main.n=1,2"), axis_from_text("Main.r=0.5,1.0"), Axis("cycle", "cycle", (10 * MS,)))
    outcome = Outcome(Plan(NOTHING, axes=axes, shown=("Main.a",)))
    outcome.add([Result(0, 9, 90 * MS, 7, Failure(NEVER, "x", "plc", 3, 1_500_000, "", "f.st", "P", 4), (True,)),
                 Result(1, 5, 50 * MS, 7, None, ())])  # fmt: skip
    write_parquet(tmp_path / "a.parquet", outcome)
    [(table, path)] = written
    assert path == tmp_path / "a.parquet"
    assert {name: kind for name, (kind, _) in table.items()} == {
        "run": "int", "seed": "int", "Main.n": "int", "Main.r": "float", "cycle": "str", "faults": "str", "power": "str",
        "result": "str", "failed": "str", "plc": "str", "scan": "int", "time_ms": "float", "code": "str", "file": "str",
        "line": "int", "scans": "int", "Main.a": None}
    cells = {name: table[name][1] for name in table}
    assert {name: cells[name] for name in cells if cells[name] != ["", ""] and name not in ("seed", "faults", "power")} == {
        "run": [0, 1], "Main.n": [1, 1], "Main.r": [0.5, 1.0], "cycle": ["10ms", "10ms"], "result": ["never", "good"],
        "scan": [3, None], "time_ms": [1.5, 50.0], "line": [4, None], "Main.a": [True, None], "failed": ["x", None],
        "plc": ["plc", None], "code": [None, None], "file": ["f.st", None], "scans": [9, 5]}


# --- mutants ------------------------------------------------------------------------------------------------------------

BLOCK = ("FUNCTION_BLOCK B\nVAR_INPUT a : INT; END_VAR\nVAR_OUTPUT b : INT; END_VAR\n    b := a + 1;\nEND_FUNCTION_BLOCK\n"
         "PROGRAM Main ; END_PROGRAM\n")


def mutant(old: str, new: str, pou: str = "B") -> Mutant:
    start = BLOCK.index(old)
    return Mutant(1, "b.st", 4, Change("X", start, start + len(old), new, pou))


@pytest.mark.slow
def test_a_mutant_with_the_same_outputs_is_proved_equal() -> None:
    pytest.importorskip("bitwuzla", reason="the extra prove is not installed")
    budget_ns = 30_000 * MS

    def proof(changed: Mutant) -> str:
        return proof_of_equality(changed, BLOCK, [], 10 * MS, budget_ns)

    assert proof(mutant("a + 1", "1 + a")).startswith("proved ") and proof(mutant("a + 1", "a + 2")) == ""
    assert proof(mutant("Main ;", "Main ;;", "Main")) == "", "PROGRAMs are not compared"
    assert proof(mutant("a + 1", "a + nothing")) == "" and proof(mutant("VAR_OUTPUT b", "VAR_OUTPUT c")) == ""


def test_a_proof_is_asked_with_the_text_of_the_file_and_the_libraries(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[Any, ...]] = []
    monkeypatch.setattr(trial, "proof_of_equality", lambda *about: asked.append(about) or "proved")
    changed = mutant("a + 1", "1 + a")
    assert Bench(("f",), {"b.st": BLOCK}, (), ("lib",)).work(0, Equality(changed, 10, 20)) == "proved"
    assert asked == [(changed, BLOCK, [Path("lib").absolute()], 10, 20)]


def test_tests_of_a_mutant_end_with_the_first_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []

    def run_pytest(arguments: list[str], plugins: list[Any]) -> int:
        asked.append(arguments)
        plugins[0].failed = "a::b"
        return 1

    monkeypatch.setattr(trial, "run_pytest", run_pytest)
    assert trial.run_tests(("tests", "-k", "x")) == (1, "a::b") and asked == [["-x", "tests", "-k", "x"]]


def test_what_cannot_be_read_or_asked_of_git_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(NotPossible, match=r"nothing\.st"):
        session.read_source(tmp_path, "nothing.st")
    (tmp_path / "a.st").write_text("x")
    assert session.read_source(tmp_path, "a.st").text == "x"

    def missing(*words: Any, **about: Any) -> Any:
        raise FileNotFoundError("no git here")

    monkeypatch.setattr(session.subprocess, "run", missing)
    with pytest.raises(NotPossible, match=r"^git cannot be started: no git here$"):
        session._git(["git", "diff"], tmp_path)


# --- tests --------------------------------------------------------------------------------------------------------------


def test_a_bench_of_tests_hands_runs_to_their_execution(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    class Recorded:
        report = "said"

        def __init__(self, plan: Plan, folder: str) -> None:
            assert folder == "copy"

        def results(self, variants: list[Variant]) -> list[Result]:
            return [Result(variant.number) for variant in variants]

        def within(self, body: Any) -> Any:
            return body("session")

        def recorded(self, variant: Variant, path: Path) -> tuple[Result, list[Path]]:
            return Result(variant.number, 99), [path]

    monkeypatch.setattr(items_bench, "ItemsExecution", Recorded)
    monkeypatch.setattr(items_bench, "shrink", lambda session, variant, result: Shrunk(variant, result, 3) if session else None)
    monkeypatch.setattr(items_bench.sys, "dont_write_bytecode", False)
    (tmp_path / "a.st").write_text("x")
    made = ItemsBench.of(Plan(NOTHING, runs=9), tmp_path)
    bench = made.in_folders(["copy", "other"])
    bench.prepare(0)
    assert items_bench.sys.dont_write_bytecode and bench.ends_processes
    assert (bench.mark, bench.batch_ns) == (made.mark, 8000 * MS)
    assert bench.work(0, Batch((3, 1))) == [Result(3), Result(1)]
    shrunk = bench.work(0, Shrinking(Result(4)))
    assert isinstance(shrunk, Shrunk) and (shrunk.variant.number, shrunk.tries) == (4, 3)
    assert items_bench._recorded(bench, tmp_path, 0, bench.variant(5)) == (Result(5, 99), "said")
    (tmp_path / "a.md").write_text("no test reads it")
    assert ItemsBench.of(Plan(NOTHING, runs=9), tmp_path).mark == made.mark
    (tmp_path / "b.TOML").write_text("y")
    other = ItemsBench.of(Plan(NOTHING, runs=9), tmp_path)
    assert len({made.mark, other.mark, ItemsBench.of(Plan(NOTHING, runs=8), tmp_path).mark}) == 3


@pytest.mark.parametrize(("status", "said", "why"), [
    (5, "", "no test is there"), (2, "usage: wrong", "usage: wrong"), (3, "", "pytest ended with status 3")])
def test_a_session_without_runs_says_why(status: int, said: str, why: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def run_pytest(arguments: list[str], plugins: list[Any], explained: bool) -> int:
        print(said)
        assert (arguments, explained) == (["tests/a.py"], False)
        return status

    monkeypatch.setattr("fbvm.campaign.items.execution.run_pytest", run_pytest)
    with pytest.raises(NoTests, match=f"^tests/a.py: {why}$"):
        ItemsExecution(Plan(NOTHING, tests=("tests/a.py",)), ".").results([])


def test_a_session_keeps_the_error_that_ended_it() -> None:
    def wrong(session: Any) -> None:
        raise ValueError("wrong")

    own = _Session(Plan(NOTHING), wrong)
    empty: Any = SimpleNamespace(items=[])
    assert own.pytest_runtestloop(empty) is True and own.error is None and own.session is None
    assert own.pytest_runtestloop(SimpleNamespace(items=[1])) is True and repr(own.error) == "ValueError('wrong')"  # type: ignore[arg-type]
    other = _Session(Plan(NOTHING), wrong)
    other.pytest_collectreport(SimpleNamespace(failed=False, nodeid="a", longreprtext=""))  # type: ignore[arg-type]
    assert other.error is None
    other.pytest_collectreport(SimpleNamespace(failed=True, nodeid="a.py", longreprtext=" E  no module \n"))  # type: ignore[arg-type]
    assert str(other.error) == "a.py: E  no module"
    assert other.pytest_runtestloop(SimpleNamespace(items=[1])) is True and str(other.error) == "a.py: E  no module"  # type: ignore[arg-type]


def test_a_part_of_a_fleet_whose_project_is_wrong_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    source = Source("fbvm.toml", "x")
    wrong = [Diagnostic("P0103", source, 0, 1, "first"), Diagnostic("P0103", source, 0, 1, "second")]
    monkeypatch.setattr(fleet, "Plant", lambda *about, **more: SimpleNamespace(diagnostics=wrong))
    monkeypatch.setattr(fleet, "unpacked", lambda images, version: {})
    sent: list[Any] = []
    fleet.run_shard(fleet.Shard(3, NOTHING, (), "v"), SimpleNamespace(send=sent.append))
    [figures] = sent
    assert (figures.number, figures.state) == (3, fleet.FAILED) and "first" in figures.message and "second" in figures.message
