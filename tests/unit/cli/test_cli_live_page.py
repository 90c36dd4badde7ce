"""A run under a page: what is served and told, another future, a changed program, debuggers, the files whose change matters."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import click
import pytest
from rows import each_of

from fbvm.cli.running import live
from fbvm.cli.shared.live import origins, page
from fbvm.cli.shared.live.origins import BuiltOrigin, FileOrigin, ProjectOrigin
from fbvm.cli.shared.live.page import PageOptions
from fbvm.code.compiler import compile_files
from fbvm.live.workbench import Workbench
from fbvm.machine.plc import Plc
from fbvm.record.recording.file_reader import RecordingFile
from fbvm.run.interactive import Control
from fbvm.run.plant import ENDLESS
from fbvm.run.running import Running

COUNTER = """PROGRAM Main
VAR n : INT; END_VAR
VAR RETAIN kept : INT; END_VAR
    n := n + 1;
    kept := kept + 2;
END_PROGRAM
"""
PROJECT = """
run = {for = "1s"}
[plc.pump]
sources = ["a.st"]
watch = ["Main.n"]
[plc.tank]
sources = ["a.st"]
cycle = "20ms"
"""


class Host:
    """Stands in for what serves pages."""

    made: list[Host]
    address = "http://127.0.0.1:8123/#token=secret"

    def __init__(self, bench: Workbench, bind: str, port: int, *, tick: Callable[[], None], frames: tuple[str, ...]) -> None:
        self.workbench, self.given, self.tick = bench, (bind, port, frames), tick
        self.shown: list[Workbench] = []
        self.is_closed = False
        self.made.append(self)

    def show(self, bench: Workbench) -> None:
        self.workbench = bench
        self.shown.append(bench)

    def close(self) -> None:
        self.is_closed = True


@pytest.fixture(autouse=True)
def verb() -> Iterator[None]:
    """The options of the command line, of which there are none."""
    with click.Context(click.Command("live")):
        yield


Step = Callable[[Host, list[Running], Control], None]


@pytest.fixture
def served(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., Host]:
    """Serves a page whose run is done by some steps, one each time that PLCs are run; the last one ends it."""
    monkeypatch.chdir(tmp_path)
    Path("a.st").write_text(COUNTER, encoding="utf-8")
    monkeypatch.setattr(Host, "made", [], raising=False)
    monkeypatch.setattr("fbvm.live.host.LiveHost", Host)

    def serve(origin: Any, *steps: Step, options: PageOptions | None = None, control: Control | None = None, **more: Any) -> Host:
        left = list(steps)

        def run(runs: list[Running], control: Control, host: Host, *, until: Callable[[], bool] | None) -> None:
            left.pop(0)(host, runs, control)

        monkeypatch.setattr(page, "run_interactive", run)
        built = page.serve_page(origin, control or Control(), options or PageOptions(), **more)
        assert not left
        host = Host.made[-1]
        assert {name: seen.plc for name, seen in built.plcs.items()} == {
            name: seen.plc for name, seen in host.workbench.plcs.items()}, "what ran last"
        return host

    return serve


def file_origin(**more: Any) -> FileOrigin:
    image = compile_files([Path("a.st")], runnable=True).image
    return FileOrigin([Path("a.st")], (), image, live._wiring(10_000_000, "loop", (), ()),
                      lambda plc: Running(plc, scans=ENDLESS), **more)


@pytest.mark.slow
def test_another_future_and_a_changed_program_begin_under_the_same_page(served: Callable[..., Host], tmp_path: Path,
                                                                        capsys: pytest.CaptureFixture[str]) -> None:
    origin = file_origin(options={"program": "Main"}, repeatable=True)
    plcs: list[Plc] = []

    def first(host: Host, runs: list[Running], control: Control) -> None:
        bench = host.workbench
        assert list(bench.plcs) == ["a"] and bench.can_branch and bench.futures == () and bench.make_test is not None
        assert bench.groups is not None and bench.changes is not None and bench.pictures is None and bench.lesson is None
        assert not bench.read_only and bench.writable is None
        plcs.append(runs[0].plc)
        for scans in (4, 6):
            runs[0].plc.run(scans=scans)
            fields = {"plc": "a", "name": "Main.n", "value": "50"}
            bench.do("write", fields)
            bench.orders.append(SimpleNamespace(action="write", fields=fields, scans={"a": runs[0].plc.scans}))  # type: ignore[arg-type]
        control.has_ended, bench.branch_at = True, ("a", 6)

    def second(host: Host, runs: list[Running], control: Control) -> None:
        bench = host.workbench
        assert host.shown == [bench] and bench.can_branch
        [future] = bench.futures
        assert future.name == "future 1, up to scan 9" and future.plcs["a"].plc is plcs[0]
        assert runs[0].plc is not plcs[0] and runs[0].plc is bench.plcs["a"].plc
        assert (runs[0].plc.scans, runs[0].plc.read("Main.n"), runs[0].plc.read("Main.kept")) == (6, 52, 12)
        assert [order.scans["a"] for order in bench.orders] == [4]
        assert (control.has_ended, control.is_paused) == (False, True)
        plcs.append(runs[0].plc)
        runs[0].plc.run(scans=1)
        Path("a.st").write_text(COUNTER.replace("n + 1", "n + 10"), encoding="utf-8")
        assert origin.mistakes() == []
        control.has_ended = bench.wants_restart = True

    def third(host: Host, runs: list[Running], control: Control) -> None:
        bench = host.workbench
        assert host.shown[1:] == [bench] and not bench.can_branch and not control.has_ended
        runs[0].plc.run(scans=1)
        assert (runs[0].plc.read("Main.n"), runs[0].plc.read("Main.kept")) == (10, 16)
        assert [(act.what, act.name, act.value) for act in bench.acts if act.what == "keep"] == [("keep", "Main.kept", 14)]
        plcs.append(runs[0].plc)

    host = served(origin, first, second, third, recording={"trace": tmp_path / "t.fbtrace", "verify": True})
    assert host.is_closed and host.given == ("127.0.0.1", 0, ())
    assert capsys.readouterr() == ("http://127.0.0.1:8123/#token=secret\n", "")
    with RecordingFile.open(tmp_path / "t.fbtrace") as recording:
        assert list(recording) == ["a", "a#2", "a#3"]
        assert [len(recording[name].scans) for name in recording] == [10, 7, 1]


@pytest.mark.slow
def test_the_plcs_of_a_project_are_repeated_by_one_test_and_have_the_pictures_of_the_project(
        served: Callable[..., Host]) -> None:  # fmt: skip
    Path("fbvm.toml").write_text(PROJECT, encoding="utf-8")
    origin = origins.project_origin(Path("fbvm.toml"), None, lambda run: run)
    assert [str(file) for file in origin.files] == ["fbvm.toml", "a.st", "a.st"] and origin.groups_file == Path("watch.toml")

    def first(host: Host, runs: list[Running], control: Control) -> None:
        bench = host.workbench
        assert list(bench.plcs) == ["pump", "tank"] and [run.plc.cycle_ns for run in runs] == [10_000_000, 20_000_000]
        assert [list(one.watch) for one in bench.plcs.values()] == [["Main.n"], []]
        assert bench.pictures is not None and bench.can_branch and not bench.plcs["pump"].ended()
        for run in runs:
            run.plc.run(scans=2)
        bench.write("tank", "Main.n", "7")
        made = bench.make_test
        assert made is not None and "tank" in made(bench.acts, bench.plcs["tank"], [])
        runs[0].reason = "time"
        assert [one.ended() for one in bench.plcs.values()] == [True, False]

    served(origin, first)


@pytest.mark.slow
def test_plcs_that_are_not_begun_again_have_neither_changes_nor_futures(served: Callable[..., Host]) -> None:
    ticks: list[str] = []

    def first(host: Host, runs: list[Running], control: Control) -> None:
        bench = host.workbench
        assert (bench.changes, bench.pictures, bench.groups, bench.can_branch, bench.make_test) == (None, None, None, False, None)
        assert bench.read_only and bench.writable == ["Main.n"] and bench.lesson is lesson
        host.tick()

    lesson = cast(Any, SimpleNamespace())
    origin = BuiltOrigin(file_origin().build())
    assert (origin.matters([Path("a.st")]), origin.programs(), origin.mistakes()) == (False, [], [])
    host = served(origin, first, options=PageOptions("0.0.0.0", 8000, True, ("main.n",), ("vscode-webview:",)),
                  tick=lambda: ticks.append("tick"), lesson=lesson)
    assert host.given == ("0.0.0.0", 8000, ("vscode-webview:",)) and ticks == ["tick"]
    with pytest.raises(click.UsageError, match="--allow-write: Main has no m"):
        served(origin, options=PageOptions(writable=("Main.m",)))


@pytest.mark.slow
def test_who_may_reach_a_page_is_warned_of_and_a_port_that_is_taken_ends_the_verb(
        served: Callable[..., Host], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:  # fmt: skip
    closed: list[str] = []
    built = file_origin().build()
    built.close = lambda: closed.append("closed")
    served(BuiltOrigin(built), lambda *_: None, options=PageOptions("0.0.0.0"))
    assert capsys.readouterr().err == ("--bind 0.0.0.0: who reaches this address and has the token can write into the PLC; "
                                       "nothing is encrypted\n")

    def taken(*_: Any, **__: Any) -> None:
        raise OSError(98, "Address already in use")

    monkeypatch.setattr("fbvm.live.host.LiveHost", taken)
    with pytest.raises(SystemExit) as ended:
        served(BuiltOrigin(built), options=PageOptions(port=8000))
    assert ended.value.code == 5 and closed == ["closed"] * 2
    assert capsys.readouterr().err == "127.0.0.1:8000 cannot be used for the page: Address already in use\n"


# --- debuggers --------------------------------------------------------------------------------------------------------


class Port:
    """Stands in for the port of debuggers."""

    def __init__(self, *answers: bool | type[BaseException]) -> None:
        self.answers, self.is_called, self.is_closed = list(answers), False, False
        self.debugged: list[Any] = []
        self.look: Callable[[], bool] | None = None

    def serve(self, debugged: Callable[[], list[Any]], meanwhile: Callable[[], bool]) -> bool:
        self.debugged = debugged()
        self.held = Host.made[-1].workbench.held_by
        self.is_called, self.look, answer = False, meanwhile, self.answers.pop(0)
        if not isinstance(answer, bool):
            raise answer
        return answer

    def close(self) -> None:
        self.is_closed = True


@pytest.mark.slow
@each_of("answers, has_ended, runs, held", [
    ((False, True), False, 2, "a debugger"), ((KeyboardInterrupt,), False, 1, "a debugger"), ((), True, 1, ""),
    ((False,), False, 2, ""),
])
def test_a_debugger_has_the_plcs_until_it_leaves_or_ends_them(
        served: Callable[..., Host], answers: Any, has_ended: bool, runs: int, held: str) -> None:  # fmt: skip
    port, origin = Port(*answers), file_origin()
    resumed: list[str] = []
    looked: list[Host] = []

    def first(host: Host, runs: list[Running], control: Control) -> None:
        port.is_called, control.has_ended = len(port.answers) > 0 or has_ended, has_ended

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(page, "DebugPort", lambda number, sources: [port, resumed.append(f"{number} {sorted(sources.paths)}")][0])
        patch.setattr(page, "let_look_on", lambda host: looked.append(host))
        patch.setattr(Running, "resume", lambda run: resumed.append("resumed"))
        host = served(origin, *[first] * runs, options=PageOptions(debug_port=0))
        assert port.look is None or port.look() is False
    assert port.is_closed and host.is_closed and host.workbench.held_by == held
    assert resumed[0] == "0 ['a.st']" and resumed[1:] == ["resumed"] * (runs - 1)
    if answers:
        [debugged] = port.debugged
        assert (debugged.name, port.held, looked) == ("a", "a debugger", [host])


# --- where PLCs come from ---------------------------------------------------------------------------------------------


def test_files_that_change_make_another_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.st").write_text(COUNTER, encoding="utf-8")
    origin = FileOrigin([Path("a.st")], [Path("lib")], None, cast(Any, None), cast(Any, None),
                        {"program": "Main", "resource": None, "dialect": "codesys"})
    assert origin.matters([Path("a.st")]) and not origin.matters([])
    [program] = origin.programs()
    assert (program.program, program.resource, program.dialect, list(program.libraries)) == (
        "Main", None, "codesys", [Path("lib")])
    assert list(program.sources()) == [Path("a.st")]


@pytest.mark.slow
def test_what_matters_of_the_file_of_a_project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.st").write_text(COUNTER, encoding="utf-8")
    file = Path("fbvm.toml")
    file.write_text(PROJECT, encoding="utf-8")
    origin = ProjectOrigin(file, None, lambda run: run)
    assert [str(each) for each in origin.files] == ["fbvm.toml"]
    assert origin.matters([file]) and not origin.matters([]), "what was never read matters"
    assert origin.mistakes() == [] and origin.project is not None
    assert not origin.matters([file]) and origin.matters([Path("a.st")]) and origin.matters([Path("a.st"), file])
    programs = origin.programs()
    assert [list(cast(Any, program).sources()) for program in programs] == [[Path("a.st")]] * 2
    file.write_text(PROJECT + "# nothing else\n", encoding="utf-8")
    assert not origin.matters([file]) and origin.pictures() == ()
    file.write_text(PROJECT.replace("20ms", "30ms"), encoding="utf-8")
    assert origin.matters([file])
    file.write_text("[plc.a]\n", encoding="utf-8")
    assert origin.matters([file]) and [each.code for each in origin.mistakes()] == ["P0104"]  # type: ignore[comparison-overlap]
    assert [each.code for each in cast(Any, origin.programs())] == ["P0104"]
    assert [each.code for each in cast(Any, origin.pictures())] == ["P0104"]
    assert origin.project.plcs[1].cycle_ns == 20_000_000, "what was read last without errors"


@pytest.mark.slow
def test_a_project_with_errors_is_told_and_not_begun(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                                     capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.st").write_text(COUNTER.replace("n + 1", "m + 1"), encoding="utf-8")
    Path("fbvm.toml").write_text(PROJECT, encoding="utf-8")
    with pytest.raises(SystemExit) as ended:
        origins.project_origin(Path("fbvm.toml"), None, lambda run: run)
    assert ended.value.code == 3
    assert "S0201: m is not declared" in capsys.readouterr().err
    origin = FileOrigin([Path("a.st")], (), None, cast(Any, None), cast(Any, None))
    assert [each.code for each in origin.mistakes()] == ["S0201"] and origin.image is None


def test_a_network_that_cannot_be_used_is_told_when_the_project_is_built(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    Path("a.st").write_text(COUNTER, encoding="utf-8")
    Path("fbvm.toml").write_text(PROJECT, encoding="utf-8")

    def refuse(*given: Any, **more: Any) -> Any:
        raise OSError(98, "Address already in use")

    monkeypatch.setattr(origins, "Plant", refuse)
    origin = ProjectOrigin(Path("fbvm.toml"), None, lambda run: run)
    assert origin.mistakes() == [] and origin.project is not None
    with pytest.raises(SystemExit) as ended:
        origin.build()
    assert ended.value.code == 5
    assert capsys.readouterr().err == "the network cannot be used: Address already in use\n"


def test_what_is_wrong_inside_a_file_of_another_tool_is_a_mistake(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.xml").write_text("<project xmlns='http://www.plcopen.org/xml/tc6_0201'><types>", encoding="utf-8")
    origin = FileOrigin([Path("a.xml")], (), None, cast(Any, None), cast(Any, None))
    assert [each.code[0] for each in origin.mistakes()] == ["X"] and origin.image is None
    [program] = origin.programs()
    assert program.libraries == () and list(program.sources()) == []
