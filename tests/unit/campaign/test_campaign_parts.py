"""Parts of campaigns alone: runs of a small program in this process, groups of failures, what is put together of results."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from fbvm import Plc, compile_text
from fbvm.base.diagnostics import Source
from fbvm.campaign import project_copies, runs
from fbvm.campaign.axes import axis_from_text
from fbvm.campaign.execution import Execution, Result
from fbvm.campaign.groups import grouped, in_common
from fbvm.campaign.items.watched import Violated, Watched
from fbvm.campaign.judge import NEVER, TRAP, UNTIL, WITHIN, Failure
from fbvm.campaign.mutation import session
from fbvm.campaign.mutation.equivalence import _renamed
from fbvm.campaign.mutation.mutants import EQUAL, KILLED, SURVIVED, TIMED_OUT, Change, Mutant
from fbvm.campaign.mutation.session import NotPossible, Outcome, Settings
from fbvm.campaign.mutation.trial import AsItIs, Equality
from fbvm.campaign.plan import Axis, Judging, Plan, Response
from fbvm.campaign.plan_file import Written, read_plan_file, with_about
from fbvm.campaign.planning import Unfit, images_of, plan_of, program_project, unfit_conditions
from fbvm.campaign.processes import Crashed, Late
from fbvm.campaign.project_copies import TooLarge, copy_project, files_of, pack_project, unpack_project
from fbvm.campaign.store import _kind
from fbvm.campaign.variants import Cut, Variant
from fbvm.campaign.work import Batch, Bench, Mismatch
from fbvm.run.project import Project
from fbvm.run.varied import VariedRun
from fbvm.watch.values import parse_time_ns

MS = 1_000_000
TEXT = """PROGRAM Main
VAR n, Limit : INT := 5; a : ARRAY[1..8] OF INT; Busy, Done, Up : BOOL; Step : INT := 1; END_VAR
VAR RETAIN Kept : INT; END_VAR
    n := n + Step;
    Kept := Kept + 1;
    a[n - 5] := n;
    Busy := n = 8;
    Up := n > Limit;
    Done := n > 10;
END_PROGRAM
"""


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> tuple[Project, Any]:
    path = tmp_path_factory.mktemp("program") / "part.st"
    path.write_text(TEXT)
    project = program_project([path], Written().about, path.parent)
    return project, images_of(project)[0]


def plan(program: tuple[Project, Any], **about: Any) -> Plan:
    rules = {name: about.pop(name) for name in ("axes", "responses", "cuts") if name in about}
    return plan_of(replace(with_about(Written(), **{"for": 60 * MS, **about}), **rules), *program)


def result_of(program: tuple[Project, Any], number: int = 0, cuts: tuple[Cut, ...] = (), **about: Any) -> Result:
    made = plan(program, **about)
    bench = Bench.of(made, program[1])
    return Execution(made, program[1]).result(replace(bench.variant(number), cuts=cuts))


def test_a_run_ends_with_its_time_and_shows_values(program: tuple[Project, Any]) -> None:
    result = result_of(program, show=("Main.n", "Main.Up"))
    assert (result.scans, result.time_ns, result.failure, result.shown) == (6, 60 * MS, None, (11, True))
    assert result_of(program, number=1, axes=(axis_from_text("Main.Limit=5,20"),), show=("Main.Up",)).shown == (False,)


def test_checksums_are_alike_for_the_same_memory_only(program: tuple[Project, Any]) -> None:
    one, other = axis_from_text("Main.Limit=5,20"), axis_from_text("Main.Limit=5,5")
    found = [result_of(program, number, axes=(axis,)).memory for axis in (one, other) for number in (0, 1)]
    assert found[0] == found[2] == found[3] != found[1]


def test_a_cycle_and_a_later_beginning_are_varied(program: tuple[Project, Any]) -> None:
    assert result_of(program, axes=(axis_from_text("cycle=20ms"),)).scans == 3
    assert result_of(program, axes=(axis_from_text("phase=25ms"),)).scans == 4
    assert result_of(program, axes=(axis_from_text("plc.cycle=T#20ms"),)).scans == 3


def failure(result: Result) -> tuple[str, str, int, int, int]:
    found = result.failure
    assert found is not None
    return found.kind, found.plc, found.scan, found.now_ns, found.line


def test_a_failure_has_its_scan_and_the_statement_that_brought_it(program: tuple[Project, Any]) -> None:
    assert failure(result_of(program, never=("Main.Busy",))) == (NEVER, "plc", 2, 20 * MS, 7)
    assert failure(result_of(program, always=("Main.n < 9",)))[2:] == (3, 30 * MS, 4)
    trapped = result_of(program, axes=(axis_from_text("Main.Step=5"),))
    assert failure(trapped) == (TRAP, "plc", 1, 10 * MS, 6) and trapped.failure and trapped.failure.code == "R0102"
    late = result_of(program, responses=(Response("Main.Busy", "Main.n > 20", 15 * MS),))
    assert failure(late) == (WITHIN, "plc", 4, 40 * MS, 7)
    assert result_of(program, responses=(Response("Main.Busy", "Main.Done", 35 * MS),)).failure is None
    assert failure(result_of(program, until="Main.n = 20"))[:3] == (UNTIL, "plc", 5)


def test_a_run_ends_where_its_until_holds(program: tuple[Project, Any]) -> None:
    result = result_of(program, until="Main.Busy")
    assert (result.scans, result.failure) == (3, None)


@pytest.mark.parametrize("cold", [False, True])
def test_behind_a_power_cut_a_plc_begins_anew(program: tuple[Project, Any], cold: bool) -> None:
    """It scans at 0, 10 and 20 ms, is off from 25 to 35 ms, and scans at 35, 45 and 55 ms."""
    cut = Cut("plc", 25 * MS, 10 * MS, cold)
    result = result_of(program, cuts=(cut,), show=("Main.n", "Main.Kept", "Main.Limit"), axes=(axis_from_text("Main.Limit=9"),))
    assert (result.failure, result.shown) == (None, (8, 3 if cold else 6, 9))


def test_a_bench_refuses_other_programs_and_versions(program: tuple[Project, Any]) -> None:
    bench = Bench.of(plan(program), program[1])
    with pytest.raises(Mismatch, match=r"not 0\.0"):
        replace(bench, version="0.0", mark="a").execution()
    with pytest.raises(Mismatch, match="plc has arrived as another program"):
        replace(bench, images=tuple((name, "other", data) for name, _, data in bench.images), mark="b").execution()
    assert [result.number for result in bench.work(0, Batch((3, 1)))] == [3, 1]  # type: ignore[union-attr]
    bench.close()


@pytest.mark.parametrize(("about", "said"), [
    ({"never": ("Main.none",)}, "none"), ({"axes": (axis_from_text("Main.Limit=40000"),)}, "40000"), ({"for": None}, "how long"),
    ({"axes": (axis_from_text("Main.nobody=1"),)}, "nobody"), ({"axes": (axis_from_text("other.cycle=10ms"),)}, "no PLC other"),
    ({"runs": 10**9}, "1,000,000,000 runs are too many"),
])  # fmt: skip
def test_a_plan_that_does_not_fit_is_refused(program: tuple[Project, Any], about: dict[str, Any], said: str) -> None:
    with pytest.raises(Unfit, match=said):
        plan(program, **about)


def test_a_plan_that_judges_nothing_but_traps_is_told(program: tuple[Project, Any]) -> None:
    judged: list[dict[str, Any]] = [
        {"never": ("Main.Busy",)}, {"always": ("Main.Up",)}, {"until": "Main.Busy"},
        {"responses": (Response("Main.Busy", "Main.Done", MS),)}]  # fmt: skip
    assert [list(unfit_conditions(plan(program, **about))) for about in judged] == [[]] * 4
    assert [said[:15] for said in unfit_conditions(plan(program))] == ["only traps fail"]


class Ends:
    """An executor in whose hands some runs end their process."""

    count = 1

    def __init__(self, *bad: int) -> None:
        self.bad, self.asked = set(bad), list[tuple[int, ...]]()

    def done(self, tasks: Iterable[Any]) -> Iterator[tuple[Any, Any]]:
        for task in tasks:
            self.asked.append(task.numbers)
            ends = self.bad & set(task.numbers)
            yield task, Crashed("by SIGKILL") if ends else [Result(number) for number in task.numbers]


def test_of_a_batch_that_has_ended_its_process_each_run_is_tried_alone() -> None:
    executor, taken = Ends(3), list[Result]()
    runs._execute(executor, range(6), 2, taken.extend)  # type: ignore[arg-type]
    assert executor.asked == [(0, 1), (2, 3), (4, 5), (2,), (3,)]
    assert [(result.number, result.failure is None) for result in taken] == [
        (0, True), (1, True), (4, True), (5, True), (2, True), (3, False)]  # fmt: skip


def test_a_mutant_has_the_line_in_which_its_change_begins() -> None:
    found = session.mutants_of([Source("b.st", "FUNCTION_BLOCK B\nVAR a : INT; END_VAR\n\n    a := 1;\nEND_FUNCTION_BLOCK\n")])
    assert found and {each.line for each in found} == {4} and [each.number for each in found] == [*range(1, len(found) + 1)]
    only = session.mutants_of([Source("b.st", BLOCKS)], {"b.st": {2}})
    assert {each.change.pou for each in only} == {"Sum"} and session.mutants_of([Source("b.st", BLOCKS)], {"c.st": {1}}) == []
    assert session.sample(only, 2, 5) == session.sample(only, 2, 5) and len(session.sample(only, 2, 5)) == 2
    assert session.sample(only, 99, 5) == only


def test_a_parameter_of_a_file_is_written_at_power_on_unless_it_says_when(tmp_path: Path) -> None:
    file = tmp_path / "campaign.toml"
    file.write_text('[campaign]\nruns = 3\n[[vary]]\nname = "Main.a"\nvalues = [1, 2]\n[[vary]]\nname = "Main.b"\nfrom = 1\n'
                    'to = 7\nstep = 3\nat = "5ms"\n[[vary]]\nsetting = "cycle"\nplc = "pump"\nvalues = ["10ms"]\n')  # fmt: skip
    written = read_plan_file(file)
    assert isinstance(written, Written), written
    assert [(axis.name, axis.at_ns, axis.values, axis.plc) for axis in written.axes] == [
        ("Main.a", 0, (1, 2), ""), ("Main.b", 5 * MS, (1, 4, 7), ""), ("pump.cycle", 0, (10 * MS,), "pump")]
    assert written.about["runs"] == 3 and written.about["seed"] == 0 and written.judging == Judging()


# --- axes -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("written", "values"), [
    ("Main.Limit=1..4", (1, 2, 3, 4)), ("Main.Limit=1..8/3", (1, 4, 7)), ("Main.r=0.5..1.0/0.25", (0.5, 0.75, 1.0)),
    ("Main.t=T#10ms..T#30ms/10ms", ("T#10ms", "T#20ms", "T#30ms")), ("Main.t=T#1ms..T#3ms", ("T#1ms", "T#2ms", "T#3ms")),
    ("cycle=10ms,T#20ms", (10 * MS, 20 * MS)), ("phase=0ms..2ms", (0, MS, 2 * MS)), ("timing=exact,real", ("exact", "real")),
    ("Main.Limit=7..7", (7,)),
])  # fmt: skip
def test_an_axis_has_these_values(written: str, values: tuple[object, ...]) -> None:
    found = axis_from_text(written).values
    assert [parse_time_ns(each) if isinstance(each, str) and "#" in each else each for each in found] == [
        parse_time_ns(each) if isinstance(each, str) and "#" in each else each for each in values]


def test_an_axis_is_named_by_what_it_varies() -> None:
    found = [axis_from_text(written) for written in ("Main.Limit=1", "cycle=10ms", "pump.cycle=10ms")]
    assert [(axis.name, axis.what, axis.plc, axis.path) for axis in found] == [
        ("Main.Limit", "value", "", "Main.Limit"), ("cycle", "cycle", "", ""), ("pump.cycle", "cycle", "pump", "")]


def test_the_type_of_a_column_is_that_of_its_values() -> None:
    values = ((1, 2), (1, 2.5), (1.5,), (1, "T#1s"), ("TRUE",), (True,))
    kinds = [_kind(Axis("a", "value", each, "", "a", 0)) for each in values]
    assert kinds == [int, float, float, str, str, str]
    assert _kind(Axis("cycle", "cycle", (10, 20), "", "", 0)) is str


# --- groups -----------------------------------------------------------------------------------------------------------


def test_failures_of_one_kind_and_place_are_a_group_the_largest_first() -> None:
    up, down = Failure(NEVER, "Main.Up", line=3), Failure(NEVER, "Main.Down", line=4)
    results = {number: Result(number, failure=found) for number, found in enumerate([up, None, down, down, up, down, None])}
    groups = grouped(results)
    assert [(group.failure, group.numbers, group.first) for group in groups] == [(down, [2, 3, 5], 2), (up, [0, 4], 0)]


def test_what_all_runs_of_a_group_have_and_others_have_not(program: tuple[Project, Any]) -> None:
    made = plan(program, axes=(axis_from_text("Main.Limit=1,2,3"), axis_from_text("Main.Step=1,2")))
    failed = Failure(NEVER, "Main.Up")
    odd = grouped({number: Result(number, failure=failed) for number in (1, 3, 5)})[0]
    assert in_common(made, odd, range(6)) == ["Main.Step = 2"]
    assert in_common(made, odd, (1, 3, 5)) == []
    first = grouped({number: Result(number, failure=failed) for number in (0, 1)})[0]
    assert in_common(made, first, range(6)) == ["Main.Limit = 1"]


# --- mutants ----------------------------------------------------------------------------------------------------------

BLOCKS = """FUNCTION_BLOCK Twin VAR_INPUT a : INT; END_VAR VAR_OUTPUT b : INT; END_VAR b := a + 1; END_FUNCTION_BLOCK
FUNCTION Sum : INT VAR_INPUT a : INT; END_VAR Sum := a; sum := Sum + 1; END_FUNCTION
PROGRAM Main ; END_PROGRAM
"""


def mutant(number: int, old: str, new: str, pou: str) -> Mutant:
    start = BLOCKS.index(old)
    return Mutant(number, "blocks.st", 1, Change("X", start, start + len(old), new, pou))


def test_a_changed_block_stands_beside_the_other_under_another_name() -> None:
    assert _renamed(mutant(1, "b := a + 1", "b := a - 1", "Twin"), BLOCKS) == (
        "FUNCTION_BLOCK Twin_as_changed VAR_INPUT a : INT; END_VAR VAR_OUTPUT b : INT; END_VAR b := a - 1; END_FUNCTION_BLOCK\n")
    assert _renamed(mutant(1, "Sum + 1", "Sum + 22", "Sum"), BLOCKS) == (
        "FUNCTION Sum_as_changed : INT VAR_INPUT a : INT; END_VAR Sum_as_changed := a; Sum_as_changed := Sum_as_changed + 22; "
        "END_FUNCTION\n")
    assert _renamed(mutant(1, "Main ;", "Main ;;", "Main"), BLOCKS) is None


class Answers:
    """Who answers tasks with what is written down, and keeps the limits that were set."""

    def __init__(self, **answers: Any) -> None:
        self.answers = answers
        self.limits: list[int] = []

    def results(self, tasks: Iterable[Any], limit_ns: int) -> Iterator[tuple[Any, Any]]:
        self.limits.append(limit_ns)
        for task in tasks:
            key = "plain" if isinstance(task, AsItIs) else f"equal{task.mutant.number}" if isinstance(task, Equality) else \
                f"tried{task.number}"  # fmt: skip
            yield task, self.answers[key]


def test_what_came_of_mutants_is_entered_and_survivors_are_proved_equal() -> None:
    mutants = [mutant(number, "a + 1", "a", "Twin") for number in range(1, 6)]
    workers = Answers(plain=(0, ""), tried1=(KILLED, "test_a"), tried2=Late(), tried3=Crashed("by SIGKILL"),
                      tried4=(SURVIVED, ""), tried5=(SURVIVED, ""), equal4="proved by induction", equal5="")  # fmt: skip
    outcome, told = Outcome(len(mutants)), list[int]()
    settings = Settings(budget_ns=1000 * MS)
    session._try_all(workers, mutants, settings, outcome, lambda seen: told.append(len(seen.tried)))  # type: ignore[arg-type]
    assert [(number, tried.result, tried.by) for number, tried in outcome.tried.items()] == [
        (1, KILLED, "test_a"), (2, TIMED_OUT, "the tests did not end"), (3, KILLED, "the process of the tests ended"),
        (4, EQUAL, "proved by induction"), (5, SURVIVED, "")]  # fmt: skip
    assert told == [1, 2, 3, 4, 5, 5, 5]
    assert workers.limits[1] >= session.LEAST_LIMIT_NS and workers.limits[2] == 1000 * MS + session.PROOF_SLACK_NS


@pytest.mark.parametrize(("plain", "said"), [
    (Late(), "the tests do not end"), ((5, ""), "there are no tests"), ((1, "test_b"), "without any mutant: test_b; fbvm test"),
    ((2, ""), "without any mutant; fbvm test"),
])  # fmt: skip
def test_tests_that_are_not_good_without_a_mutant_say_nothing(plain: Any, said: str) -> None:
    with pytest.raises(NotPossible, match=said):
        session._usual_limit(Answers(plain=plain))  # type: ignore[arg-type]


# --- tests of a folder ------------------------------------------------------------------------------------------------


def watched_plc() -> Any:
    """A PLC of a test whose only variable is Main.Up."""
    image = compile_text("PROGRAM Main VAR Up : BOOL; END_VAR ; END_PROGRAM").image
    assert image is not None
    plc = Plc(image)
    return SimpleNamespace(name="", plc=plc, find=plc.find)


def test_conditions_are_judged_once_all_their_variables_are_there() -> None:
    watched, varied = Watched(Judging(never=("Main.Up",))), watched_plc()
    run: VariedRun = SimpleNamespace(plcs=[])  # type: ignore[assignment]
    watched(run, 0)
    assert watched.judge is None
    other = Watched(Judging(never=("Main.Nobody",)))
    run.plcs.append(varied)
    other(run, 0)
    assert other.judge is None and "Nobody" in other.why
    varied.plc.scan()
    watched(run, varied.plc.now_ns)
    assert watched.judge is not None and watched.why == ""
    varied.plc.write("Main.Up", True)
    varied.plc.scan()
    with pytest.raises(Violated, match=r"Main\.Up behind scan 1 of plc") as raised:
        watched(run, varied.plc.now_ns)
    assert (raised.value.failure.kind, raised.value.failure.plc, raised.value.failure.scan) == (NEVER, "plc", 1)


def test_a_project_is_copied_without_what_is_no_part_of_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("a.st", "tests/test_a.py", ".git/config", "venv/x", "own/pyvenv.cfg", "own/deep/y", "build/z", "pyvenv.cfg"):
        path = tmp_path / "p" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(name)
    kept = ["a.st", "pyvenv.cfg", "tests/test_a.py"]
    assert [path.as_posix() for path in files_of(tmp_path / "p")] == kept
    copy_project(tmp_path / "p", tmp_path / "copy")
    unpack_project(pack_project(tmp_path / "p"), tmp_path / "unpacked" / "deep")
    for folder in ("copy", "unpacked/deep"):
        there = [path for path in (tmp_path / folder).rglob("*") if path.is_file()]
        found = sorted(path.relative_to(tmp_path / folder).as_posix() for path in there)
        assert found == kept and (tmp_path / folder / "tests/test_a.py").read_text() == "tests/test_a.py"
    assert pack_project(tmp_path / "p") == pack_project(tmp_path / "copy")
    monkeypatch.setattr(project_copies, "MOST_BYTES", 20)
    with pytest.raises(TooLarge):
        pack_project(tmp_path / "p")


def test_a_project_without_files_is_an_empty_folder(tmp_path: Path) -> None:
    (tmp_path / "p").mkdir()
    copy_project(tmp_path / "p", tmp_path / "deep" / "copy")
    unpack_project(pack_project(tmp_path / "p"), tmp_path / "deep" / "unpacked")
    assert [[*(tmp_path / "deep" / name).iterdir()] for name in ("copy", "unpacked")] == [[], []]
    for make in (lambda folder: copy_project(tmp_path / "p", folder), lambda folder: unpack_project(b"", folder)):
        with pytest.raises(FileExistsError):
            make(tmp_path / "deep")


def test_a_variant_names_the_value_of_an_axis(program: tuple[Project, Any]) -> None:
    made = plan(program, axes=(axis_from_text("Main.Limit=1,2,3"), axis_from_text("Main.Step=1,2")))
    assert [Variant(0, 0, (2, 1)).value(made, at) for at in (0, 1)] == [3, 2] and made.combinations == 6
