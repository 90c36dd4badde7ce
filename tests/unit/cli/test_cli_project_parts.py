"""Lessons, pages of projects and fleets in parts: what the verbs put together, what they say, how they end."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import click
import pytest
from click.testing import CliRunner
from rows import each_of

from fbvm.campaign.fleet.shard import Shard
from fbvm.campaign.work import Mismatch, Unreachable
from fbvm.cli.main import main
from fbvm.cli.projects import fleet, learn
from fbvm.cli.running import live, project_run
from fbvm.cli.shared.live.origins import FileOrigin
from fbvm.machine.plc import Plc
from fbvm.run.plant import ENDLESS
from fbvm.run.running import Running
from fbvm.testing.course.lessons import lessons

COUNTER = "PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM\n"


@pytest.fixture
def counter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("counter.st").write_text(COUNTER, encoding="utf-8")
    return Path("counter.st")


# --- lessons ----------------------------------------------------------------------------------------------------------


def learned(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(learn.command, arguments)
    return result.exit_code, result.output


@pytest.mark.slow
def test_lessons_are_listed_with_how_far_they_are(counter: Path) -> None:
    first = lessons()[0]
    status, said = learned()
    assert status == 0 and said.splitlines()[0] == f"   1  {first.title}"
    assert said.splitlines()[-2:] == ["", "fbvm learn 1 begins with the first one"] and len(said.splitlines()) == 18
    (first.begin(Path("lessons")) / ".done").touch()
    lessons()[1].begin(Path("lessons"))
    rows = learned()[1].splitlines()
    assert rows[0] == f"   1  {first.title:<40}done" and rows[1].endswith("begun") and rows[2].endswith(lessons()[2].title)
    assert rows[9].startswith("  10  ")


def test_a_lesson_is_shown_and_its_folder_begun(counter: Path) -> None:
    status, said = learned("3", "--folder", "mine")
    assert status == 0 and said == (f"{lessons()[2].text}\nYour files are in mine/{lessons()[2].slug}.  When you are ready: "
                                    "fbvm learn 3 --check\n")
    assert (Path("mine") / lessons()[2].slug / "program.st").is_file()
    assert learned("17")[1].endswith("Error: there are lessons 1 to 16\n") and learned("17")[0] == 2
    assert learned("2", "--solution") == (0, lessons()[1].solution() + "\n")
    for option in ("--check", "--solution", "--live"):
        status, said = learned(option)
        assert status == 2 and "say which lesson: fbvm learn 1 --check" in said


@pytest.mark.slow
@each_of("number, mistake, wrong, status, said", [
    ("1", "", 0, 0, "lesson 1 is done; the next one: fbvm learn 2\n"),
    ("16", "", 0, 0, "lesson 16 is done; that was the last one\n"),
    ("15", "", 0, 0, "lesson 15 is done; the next one: fbvm learn 16\n"), ("1", "", 1, 1, ""),
    ("1", "answers.toml: no", 0, 1, "answers.toml: no\nThe program is checked when the prediction is right.\n"),
])
def test_the_program_is_checked_behind_the_prediction(number: str, mistake: str, wrong: int, status: int, said: str,
                                                      counter: Path) -> None:  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fbvm.testing.course.lessons.prediction_mistake", lambda lesson, folder: mistake)
        patch.setattr("fbvm.testing.course.lessons.check", lambda lesson, folder: wrong)
        assert learned(number, "--check") == (status, said)


@pytest.mark.slow
def test_without_pytest_nothing_is_checked(counter: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(learn, "find_spec", lambda name: None)
    monkeypatch.setattr(learn, "check_live_installed", lambda: None)
    for arguments in (("1", "--check"), ("1", "--live"), ("--class", ".")):
        assert "checks need pytest: pip install pytest" in learned(*arguments)[1]
    assert learned("1")[0] == 0 and learned("1", "--solution")[0] == 0


class Taught:
    """Serves the page of a lesson, and keeps what it was given."""

    def __init__(self) -> None:
        self.origin: Any = None

    def __call__(self, origin: Any, control: Any, options: Any, lesson: Any) -> None:
        self.origin, self.is_paused, self.lesson, self.port = origin, control.is_paused, lesson, options.port


@pytest.mark.slow
def test_a_lesson_on_a_page_asks_and_checks(counter: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    taught, first = Taught(), lessons()[0]
    monkeypatch.setattr(learn, "check_live_installed", lambda: None)
    monkeypatch.setattr("fbvm.cli.shared.live.page.serve_page", taught)
    monkeypatch.setattr("fbvm.testing.course.lessons.prediction_mistake", lambda lesson, folder, look: f"answers.toml: {look}")
    monkeypatch.setattr("fbvm.testing.course.lessons.program_mistakes", lambda lesson, folder: [lesson.slug, str(folder)])
    status, said = learned("1", "--live", "--folder", "mine")
    assert (status, said) == (0, f"Your files are in mine/{first.slug}; the page follows when you change them.\n")
    lesson = taught.lesson
    assert taught.is_paused and (lesson.title, lesson.text, lesson.solution()) == (first.title, first.text, first.solution())
    [(name, _, given)] = lesson.questions()
    assert given == "" and lesson.predict({name: "7"}) == "s executes one scan, n one statement"
    assert lesson.questions()[0][2] == "7" and lesson.check() == [first.slug, "mine"]
    assert isinstance(taught.origin, FileOrigin) and list(taught.origin.files) == [Path("mine") / first.slug / "program.st"]
    built = taught.origin.build()
    assert built.runs[0].scans_left == ENDLESS and built.runs[0].plc.cycle_ns == 10_000_000
    assert [unit.unit.name for unit in built.runs[0].plc.units] == ["ETN21 0"]
    built.close()


@pytest.mark.slow
def test_a_lesson_of_several_plcs_runs_its_project_without_end(counter: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    taught, target = Taught(), Path("mine")
    target.mkdir()
    (target / "fbvm.toml").write_text('run = {for = "1s"}\n[plc.a]\nsources = ["../counter.st"]\n'
                                      'set = [{name = "Main.n", value = 3, at = "20ms"}]\n', encoding="utf-8")
    monkeypatch.setattr("fbvm.cli.shared.live.page.serve_page", taught)
    with click.Context(learn.command) as context:
        context.meta["fbvm.allow_outside"] = True
        learn._serve_page(lessons()[0], target, target)
    built = taught.origin.build()
    assert taught.is_paused and [(run.scans_left, len(run.writes)) for run in built.runs] == [(ENDLESS, 1)]


def test_a_class_is_reported(counter: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("class").mkdir()
    results: dict[str, object] = {}
    monkeypatch.setattr("fbvm.testing.course.lessons.check_class", lambda learners, out: (out.mkdir(exist_ok=True), results)[1])
    monkeypatch.setattr("fbvm.testing.course.class_report.report", lambda results, lessons, out: f"{len(results)} learners")
    monkeypatch.setattr("fbvm.testing.course.class_report.summary", lambda results, lessons: ["learner 1", "anna ok"])
    Path("out").mkdir()
    Path("out/report.html").write_text("of another class", encoding="utf-8")
    assert "class holds no folders of learners" in learned("--class", "class", "--report", "out")[1]
    assert Path("out/report.html").read_text(encoding="utf-8") == "of another class"
    results["anna"] = {}
    assert learned("--class", "class", "--report", "out") == (0, "learner 1\nanna ok\nwritten to out/report.html\n")
    assert Path("out/report.html").read_text() == "1 learners"
    status, said = learned("--class", "class", "--report", "class/out")
    assert status == 2 and "class/out lies among the learners of class; choose another --report" in " ".join(said.split())


# --- pages of files and projects --------------------------------------------------------------------------------------


@pytest.mark.slow
def test_a_project_under_a_page(counter: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("fbvm.toml").write_text('[run]\nnet = "loop"\n[plc.a]\nsources = ["counter.st"]\n'
                                 'set = [{name = "Main.n", value = 3}]\n', encoding="utf-8")
    served: list[Any] = []
    for module in ("fbvm.cli.shared.live.page", "fbvm.cli.running.live"):
        monkeypatch.setattr(f"{module}.serve_page", lambda origin, control, options, recording: served.append(
            (origin, control, options, recording)))
    monkeypatch.setattr("fbvm.cli.running.run.check_live_installed", lambda: None)
    monkeypatch.setattr(live, "check_live_installed", lambda: None)
    made: list[Any] = []
    for module in ("fbvm.cli.shared.live.origins", "fbvm.cli.running.live"):
        monkeypatch.setattr(f"{module}.project_origin", lambda *given: made.append(given) or "origin")
    result = CliRunner().invoke(main, ["run", "--live", "--scans", "7", "--trace", "t", "--verify"])
    assert result.exit_code == 0, result.output
    assert served[0][0] == "origin" and served[0][3] == {"journal": None, "trace": Path("t"), "verify": True}
    file, net, bound, for_ns, scans = made[0]
    assert (file.name, net, bound("run"), for_ns, scans) == ("fbvm.toml", None, "run", None, 7) and not served[0][1].is_paused
    result = CliRunner().invoke(main, ["live", "--paused", "--speed", "0.5", "--read-only", "--bind", "0.0.0.0", "--port", "80",
                                       "--allow-write", "D0", "--trace", "t"])  # fmt: skip
    assert result.exit_code == 0, result.output
    assert (served[1][1].is_paused, served[1][1].speed, served[1][3]) == (True, 0.5, {"trace": Path("t")})
    options = served[1][2]
    assert (options.bind, options.port, options.read_only, options.writable, options.debug_port) == (
        "0.0.0.0", 80, True, ("D0",), None)
    file, net, bound = made[1]
    run = bound(SimpleNamespace(plc=Plc(cast(Any, _image())), writes=()))
    assert (net, run.scans_left, run.writes) == (None, ENDLESS, ())
    assert CliRunner().invoke(main, ["live", "--net", "tcp"]).exit_code == 0 and made[2][1] == "tcp"
    for more in (["--map", "1.2.3.4:502=peer"], ["--door", "1502"]):
        assert "--map and --door are for FILE" in CliRunner().invoke(main, ["live", *more]).stderr
    for more in (["--json"], ["--scan-time"], ["--debug", "0"]):
        said = " ".join(CliRunner().invoke(main, ["run", "--live", *more]).stderr.split())
        assert "--live shows it on the page: leave out --json, --scan-time and --debug" in said
    assert len(served) == 3


def _image() -> object:
    from fbvm.code.compiler import compile_text

    return compile_text(COUNTER).image


@each_of("port", [None, 4711])
def test_plcs_of_a_project_run_with_or_without_debuggers(port: int | None) -> None:
    calls: list[Any] = []
    plant = cast(Any, SimpleNamespace(runs=["run"], named_runs={"a": "run"}))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(project_run, "run_all", lambda runs, tick: calls.append((runs, tick)))
        patch.setattr("fbvm.cli.shared.debug.worlds.plant_sources", lambda given: "sources")
        patch.setattr("fbvm.cli.shared.debug.door.DebugPort", lambda number, sources: (number, sources))
        patch.setattr("fbvm.cli.shared.debug.door.run_with_port", lambda *given: calls.append(given))
        project_run._execute(plant, port, print)
    assert calls == ([(["run"], print)] if port is None else [({"a": "run"}, (4711, "sources"), print)])


@pytest.mark.slow
def test_a_debugger_of_a_project_looks_into_scans_alone(counter: Path) -> None:
    Path("fbvm.toml").write_text('[plc.a]\nsources = ["counter.st"]\n', encoding="utf-8")
    for more in ("--trace", "--journal"):
        result = CliRunner().invoke(main, ["run", "--debug", "0", more, "t"])
        assert result.exit_code == 2 and "--debug looks into scans itself: leave out --trace and --journal" in result.stderr


# --- fleets -----------------------------------------------------------------------------------------------------------

FLEET = 'run = {{net = "{net}"{more}}}\n[plc.one]\nsources = ["counter.st"]\n[plc.many]\nsources = ["counter.st"]\ncount = 3\n'


def planned_fleet(**options: Any) -> Any:
    given = {"net": None, "for_ns": None, "jobs": 2, "cluster": None, "shards": None, "doors_file": None, "json_lines": False}
    with click.Context(fleet.command), pytest.MonkeyPatch.context() as patch:
        patch.setattr("fbvm.campaign.fleet.places.here", lambda shards: ("here", shards))
        patch.setattr("fbvm.campaign.fleet.places.in_cluster", lambda client, shards: (client, shards))
        patch.setattr(fleet, "client_of", lambda address, jobs: f"{address} {jobs}")
        return fleet._places(None, given | options)


@pytest.mark.slow
def test_the_plcs_of_a_project_are_shared_by_the_parts(counter: Path) -> None:
    Path("fbvm.toml").write_text(FLEET.format(net="loop", more=', for = "2s"'), encoding="utf-8")
    where, shards = planned_fleet()
    assert where == "here" and [shard.number for shard in shards] == [0, 1]
    assert all(isinstance(shard, Shard) and shard.for_ns == 2_000_000_000 for shard in shards)
    assert [[(row.name, row.count) for row in shard.project.plcs] for shard in shards] == [
        [("one", None), ("many", 1)], [("many", 2)]]
    assert [[name for name, *_ in shard.images] for shard in shards] == [["one", "many"], ["many"]]
    assert len(planned_fleet(shards=3)[1]) == 3 and planned_fleet(for_ns=7)[1][0].for_ns == 7
    where, make = planned_fleet(cluster="local", jobs=5)
    assert where == "local 5" and len(make(4)) == 4 and len(planned_fleet(cluster="local", shards=2)[1](4)) == 2


@pytest.mark.slow
def test_a_fleet_in_memory_has_to_end_and_errors_end_the_verb(counter: Path) -> None:
    Path("fbvm.toml").write_text(FLEET.format(net="loop", more=""), encoding="utf-8")
    with pytest.raises(click.UsageError, match='say when to end, by --for or by for = "10s"'):
        planned_fleet()
    with click.Context(fleet.command):
        assert fleet._project(None, {"net": None, "for_ns": 5})[1] == 5
        project, for_ns = fleet._project(None, {"net": "tcp", "for_ns": None})
        assert (project.net, for_ns) == ("tcp", None)
    for more in (', scans = 5', ', for = "1s"'):
        Path("fbvm.toml").write_text(FLEET.format(net="loop", more=more), encoding="utf-8")
        with click.Context(fleet.command):
            fleet._project(None, {"net": None, "for_ns": None})
    Path("fbvm.toml").write_text("[plc.a]\n", encoding="utf-8")
    result = CliRunner().invoke(fleet.command, [])
    assert result.exit_code == 3 and "P0104" in result.stderr
    result = CliRunner().invoke(fleet.command, ["counter.st"])
    assert result.exit_code == 2 and "counter.st is no project: a fleet is one with a count of PLCs" in result.stderr


@each_of("error", [Unreachable("no scheduler"), Mismatch("another version")])
def test_a_fleet_that_cannot_be_placed_is_told(error: Exception) -> None:
    def fails(*_: object) -> None:
        raise error

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fleet, "_places", fails)
        result = CliRunner().invoke(fleet.command, [])
    assert (result.exit_code, result.stderr) == (5, f"{error}\n")


def test_what_runs_without_end_is_bounded_by_nothing() -> None:
    plc = Plc(cast(Any, _image()))
    run = learn._endless(Running(plc, scans=3))
    assert run.plc is plc and run.scans_left == ENDLESS


@pytest.mark.slow
def test_a_fleet_that_its_network_cannot_have_is_refused(counter: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = FLEET.format(net="loop", more=', for = "1s"') + (
        '[[plc.one.unit]]\naddress = "10.0.0.2"\n[[door]]\naddress = "10.0.0.2:502"\nbind = "127.0.0.1:0"\n'
        '[[fault]]\nerror = "ETIMEDOUT"\npeer = "10.0.0.2:502"\n')
    Path("fbvm.toml").write_text(text, encoding="utf-8")
    with click.Context(fleet.command):
        assert fleet._project(None, {"net": None, "for_ns": None})[0].net == "loop"
        with pytest.raises(SystemExit) as ended:
            fleet._project(None, {"net": "tcp", "for_ns": None})
    assert ended.value.code == 3 and "cannot be given ETIMEDOUT with real connections" in capsys.readouterr().err
