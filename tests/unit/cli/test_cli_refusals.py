"""What verbs refuse in words, and what they say beside their results: launches, exports, proofs, runs, traces, streams."""

from __future__ import annotations

import io
import os
import sys
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import click
import pytest
from click.testing import CliRunner
from images import counter_image
from rows import each_of

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.cli.main import main
from fbvm.cli.programs import export, fmt, prove, prove_tests
from fbvm.cli.running import project_run, run
from fbvm.cli.shared import drawings, journals, prompt, run_recording, traces
from fbvm.cli.shared.debug import launch
from fbvm.cli.shared.options import check_live_installed, time_ns
from fbvm.cli.shared.paths import SourcePath
from fbvm.cli.shared.run_recording import RunRecording
from fbvm.cli.shared.run_result import value_text
from fbvm.dap.target import LaunchError
from fbvm.machine.plc import Plc
from fbvm.prove.encoding.execution import Refused
from fbvm.prove.encoding.terms import TimeOver
from fbvm.prove.prover import SpuriousRun

COUNTER = "PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM\n"
PROJECT = '[plc.pump]\nsources = ["counter.st"]\n[plc.tank]\nsources = ["counter.st"]\n'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("counter.st").write_text(COUNTER, encoding="utf-8")
    Path("wrong.st").write_text(COUNTER.replace("n + 1", "m + 1"), encoding="utf-8")
    Path("fbvm.toml").write_text(PROJECT, encoding="utf-8")
    Path("wrong.toml").write_text('[plc.pump]\nsources = ["wrong.st"]\n', encoding="utf-8")
    Path("empty").mkdir()
    return tmp_path


def fbvm(*arguments: str) -> Any:
    return CliRunner().invoke(main, arguments)


# --- what a debugger is to launch ---------------------------------------------------------------------------------------


@pytest.mark.slow
@each_of("given, said, more", [
    ({}, "launch has either program (a file, files or a folder), project (an fbvm.toml), test or recording", ""),
    ({"program": "counter.st", "project": "."}, "launch has either program", ""),
    ({"program": "empty"}, "there are no sources in empty", ""),
    ({"program": ["counter.st", "no.st"]}, "there is no file {folder}/no.st", ""),
    ({"program": "counter.st", "plc": "a"}, "plc: it names one of the PLCs of a project; a program is one PLC", ""),
    ({"program": "counter.st", "dialect": "klingon"}, "there is no dialect 'klingon'; there are standard, ", ""),
    ({"program": "wrong.st"}, "the program has errors", "S0201"),
    ({"program": "counter.st", "timing": "late"}, "timing is exact or real, not 'late'", ""),
    ({"program": "counter.st", "map": ["1.2.3.4:502=host:1502"]},
     "the debugger's network stays in memory: map 1.2.3.4:502=peer", ""),
    ({"program": "counter.st", "set": [{"name": "Main.n"}]},
     'a row of set is {{"name": ..., "value": ..., "at": "50ms"}}, not', ""),
    ({"program": "counter.st", "set": ["Main.n"]}, "a row of set is", ""),
    ({"program": "counter.st", "set": [{"name": "Main.n", "value": 1, "when": 2}]}, "a row of set is", ""),
    ({"program": "counter.st", "set": [{"name": "Main.m", "value": 1}]}, "Main has no m; it has n", ""),
    ({"program": "counter.st", "force": {"Main.n": "x"}}, "", ""), ({"program": "counter.st", "engine": "steam"}, "steam", ""),
    ({"project": ".", "main": "Main", "cycle": "1ms"}, "cycle, main: with a project its file says that", ""),
    ({"project": ".", "seed": 3}, "seed: with a project its file says that", ""),
    ({"project": "empty"}, "there is no fbvm.toml in {folder}/empty", ""),
    ({"project": "no.toml"}, "there is no file {folder}/no.toml", ""),
    ({"project": ".", "plc": "mixer"}, "there is no PLC mixer; there is pump, tank", ""),
    ({"project": "wrong.toml"}, "the program has errors", "S0201"), ({"program": "."}, None, ""),
    ({"recording": "counter.st"}, "", ""), ({"recording": "no.fbtrace"}, "", ""),
])
def test_what_cannot_be_launched_is_told(folder: Path, given: dict[str, Any], said: str | None, more: str) -> None:
    if said is None:
        target = launch.open_launch(given | {"cwd": str(folder)})
        assert list(target.sessions) == ["pump", "tank"]
        return
    with pytest.raises(LaunchError) as refused:
        launch.open_launch(given | {"cwd": str(folder)})
    assert said.format(folder=folder) in str(refused.value)
    assert more in refused.value.output


@pytest.mark.slow
def test_a_project_with_errors_in_its_file_is_not_launched(folder: Path) -> None:
    Path("fbvm.toml").write_text("[plc.a]\n", encoding="utf-8")
    with pytest.raises(LaunchError, match=r"fbvm\.toml has errors"):
        launch.open_launch({"project": ".", "cwd": str(folder)})


@pytest.mark.slow
def test_what_is_launched_is_forced_written_and_bounded(folder: Path) -> None:
    given = {"program": "counter.st", "cwd": str(folder), "cycle": "20ms", "for": "50ms", "scans": 9, "stopOnEntry": True,
             "set": [{"name": "Main.n", "value": 40, "at": "20ms"}], "force": {"D5": 7}}  # fmt: skip
    target = launch.open_launch(given)
    session = target.sessions["plc"]
    assert (target.until_scan, target.stop_on_entry) == (3, True) and session.plc.cycle_ns == 20_000_000
    assert session.plc.read("D5") == 7 and launch.open_launch(given | {"scans": 2}).until_scan == 2
    assert launch.open_launch({"program": "counter.st", "cwd": str(folder)}).until_scan is None
    chosen = launch.open_launch({"project": "fbvm.toml", "plc": "tank", "cwd": str(folder), "scans": 4,
                                 "set": [{"name": "Main.n", "value": 30}]})  # fmt: skip
    assert list(chosen.sessions) == ["tank", "pump"] and chosen.until_scan == 4
    chosen.sessions["tank"].scan(1)
    assert [chosen.sessions[name].plc.read("Main.n") for name in ("tank", "pump")] == [31, 0]


def test_a_launch_without_timing_seed_and_engine_is_exact_with_seed_0(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[tuple[Any, ...]] = []

    def noted(*arguments: Any) -> Any:
        made.append(arguments[1:2] + arguments[3:5] + arguments[6:7])
        raise LaunchError("noted")

    monkeypatch.setattr(launch, "program_world", noted)
    for more in ({}, {"cycle": "10ms", "timing": "exact", "seed": 0, "engine": "auto"}, {"timing": "real", "seed": 7}):
        with pytest.raises(LaunchError, match="noted"):
            launch.open_launch({"program": "counter.st", "cwd": str(folder)} | more)
    assert made == [(10_000_000, "exact", 0, "auto")] * 2 + [(10_000_000, "real", 7, "auto")]


def test_recordings_that_cannot_be_executed_are_noted(monkeypatch: pytest.MonkeyPatch) -> None:
    closed: list[bool] = []

    class Recorded(dict[str, Any]):
        def close(self) -> None:
            closed.append(True)

    made = Recorded(a=SimpleNamespace(program="it has errors now"), b=SimpleNamespace(program="its library is gone"))
    monkeypatch.setattr(launch.RecordingFile, "open", lambda path, libraries: made)
    with pytest.raises(LaunchError, match=r"t\.fbtrace has no scan that can be executed again") as refused:
        launch._recording(Path("t.fbtrace"), ())
    assert closed == [True] and "a: it has errors now\nb: its library is gone" in refused.value.output
    monkeypatch.setattr("fbvm.cli.shared.debug.recorded_item.record_item",
                        lambda node, folder: SimpleNamespace(recordings={}, output="1 passed"))
    with pytest.raises(LaunchError, match=r"test_a\.py::test_b has no rig that did a scan"):
        launch._test("test_a.py::test_b", Path())


# --- programs -----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_what_is_exported(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    result = fbvm("export", "empty", "-o", "out.xml")
    assert result.exit_code == 2 and "there is no source in this folder" in result.stderr
    exported: list[Any] = []
    made = SimpleNamespace(diagnostics=[], text="<project/>", errors=[])
    monkeypatch.setattr(export, "export_xml", lambda given, name, created: exported.append((given, name, created)) or made)
    os.utime("counter.st", (86_400, 86_400))
    assert fbvm("export", "counter.st", "-o", "out.xml").exit_code == 0 and Path("out.xml").read_text() == "<project/>"
    monkeypatch.setattr(export, "datetime", SimpleNamespace(fromtimestamp=lambda *_: 1 / 0))
    assert fbvm("export", "counter.st", "-o", "out.xml").exit_code == 0
    assert exported == [([Path("counter.st")], "out", "1970-01-02T00:00:00"), ([Path("counter.st")], "out", export.BEGINNING)]
    Path("broken.st").write_bytes(b"\xff\xfe\x00")
    Path("saved.cxt").write_text("nothing")
    result = fbvm("export", "broken.st", "-o", "out.cxt", "--into", "saved.cxt")
    assert result.exit_code == 3 and "broken.st" in result.stderr and not Path("out.cxt").exists()


@each_of("error, status, said", [
    (Refused("an index has no bounds"), 3, "never a: an index has no bounds\n"),
    (Refused("texts", 1), 3, "b.st:2:3 in Main: never a: texts\n"), (SpuriousRun("the run does not repeat"), 4,
                                                                     "never a: the run does not repeat\n"),
])
def test_questions_that_cannot_be_answered_end_the_verb(error: Exception, status: int, said: str) -> None:
    shown: list[str] = []
    image = cast(Any, SimpleNamespace(sites=["a.st:1:1 in Main", "b.st:2:3 in Main"]))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(prove_tests, "say", lambda text, **style: shown.append(f"{text}\n"))
        with pytest.raises(SystemExit) as ended, prove_tests.answering(image, "never a"):
            raise error
    assert (ended.value.code, "".join(shown)) == (status, said)


@pytest.mark.slow
def test_a_scan_with_too_many_ways_and_a_pair_with_errors(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def over(*_: object) -> None:
        raise TimeOver

    monkeypatch.setattr(prove_tests, "cover", over)
    result = fbvm("prove", "counter.st", "--tests", "test_x.py")
    assert result.exit_code == 2 and "the time is over: one scan has too many ways" in result.stderr
    functions = "FUNCTION F : INT VAR_INPUT a : INT; END_VAR F := {}; END_FUNCTION\n"
    Path("two.st").write_text(functions.format("a") + functions.format("b").replace("F ", "G ").replace("F:", "G:"))
    result = fbvm("prove", "two.st", "--equal", "F", "G")
    assert result.exit_code == 3 and "S0201" in result.stderr
    with pytest.raises(click.BadParameter):
        prove._cycle("5ms..1ms")
    assert prove._cycle("5ms..50ms") == (5_000_000, 50_000_000) and prove._cycle("7ms")[0] == 7_000_000


# --- runs ---------------------------------------------------------------------------------------------------------------


def test_a_run_with_a_port_lets_debuggers_attach(monkeypatch: pytest.MonkeyPatch) -> None:
    calls: list[Any] = []
    plc = Plc(counter_image())
    running = cast(Any, SimpleNamespace(plc=plc))
    monkeypatch.setattr(run.loop, "run_all", lambda runs, tick: calls.append((runs, tick)))
    run._execute(running, None, (), (), print)
    monkeypatch.setattr("fbvm.cli.shared.debug.door.DebugPort", lambda number, sources: (number, dict(sources.paths)))
    monkeypatch.setattr("fbvm.cli.shared.debug.door.run_with_port", lambda *given: calls.append(given))
    run._execute(running, 4711, (), (), print)
    assert calls == [([running], print), ({"plc": running}, (4711, {}), print)]
    with pytest.raises(click.UsageError, match="steam"):
        run._plc(counter_image(), 1, "steam")


@pytest.mark.slow
def test_of_a_project_missing_units_and_delays_are_told(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(project_run.Plant, "missing_units", lambda plant: ["pump has no unit in slot 7"])
    add = project_run.Lateness.add

    def late(self: Any, other: Any) -> None:
        add(self, other)
        self.note(0, 5)

    monkeypatch.setattr(project_run.Lateness, "add", late)
    result = fbvm("run", "--scans", "2", "--scan-time")
    first, *rest = result.stderr.splitlines()
    assert first == "pump has no unit in slot 7" and [line.split(":")[0] for line in rest] == ["pump", "pump", "tank", "tank"]
    assert "late" in rest[1]


@pytest.mark.slow
def test_a_run_under_a_page_is_not_run_alone(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    served: list[Any] = []
    monkeypatch.setattr(run, "check_live_installed", lambda: None)
    monkeypatch.setattr(run, "_run_live", lambda image, cycle_ns, banks, **options: served.append((cycle_ns, options["files"])))
    result = fbvm("run", "counter.st", "--live", "--cycle", "5ms")
    assert (result.exit_code, result.output, served) == (0, "", [(5_000_000, (Path("counter.st"),))])


# --- recordings ---------------------------------------------------------------------------------------------------------


def test_what_is_recorded_goes_into_the_file_once_in_ten_ticks() -> None:
    flushed: list[int] = []
    recorded = RunRecording(cast(Any, SimpleNamespace(flush=lambda: flushed.append(ticks))))
    for ticks in range(1, 25):  # noqa: B007
        recorded.tick()
    assert flushed == [10, 20]
    RunRecording().tick()


@each_of("scans, only_last, shown, said", [
    (range(1000), True, range(600, 1000), "r.html holds scans 600 to 999 only: the run was interrupted\n"),
    (range(1000), False, None, ""), (range(400), True, None, ""), (range(100, 450), True, None, ""),
    (range(401), True, range(1, 401), "r.html holds scans 1 to 400 only: the run was interrupted\n"),
])
def test_the_page_of_a_run_that_was_interrupted_has_its_last_scans(scans: range, only_last: bool, shown: range | None, said: str,
                                                                   ) -> None:  # fmt: skip
    made: list[Any] = []
    words: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(run_recording, "RecordedScans",
                      lambda recorded, lines: SimpleNamespace(scans=scans, about=(recorded, lines)))
        patch.setattr("fbvm.record.page.data.page_data", lambda source, scans, title: (source.about, scans, title))
        patch.setattr("fbvm.record.page.page.page", lambda data: made.append(data) or "page")
        patch.setattr(run_recording, "write_file", lambda path, text: made.append((path, text)))
        patch.setattr(run_recording, "say", lambda text, **style: words.append(f"{text}\n"))
        run_recording.write_page(RunRecording(cast(Any, {"a": "plc", "b": "other"}), only_last), Path("r.html"), {"lines": {}})
    assert made == [(("plc", {"lines": {}}), shown, "r"), (Path("r.html"), "page")] and "".join(words) == said


def test_a_recording_that_cannot_be_read_is_told(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object, **__: object) -> None:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(traces.RecordingFile, "open", fails)
    with pytest.raises(click.UsageError, match=r"t\.fbtrace cannot be read: input/output error|Input/output error"), \
            traces.open_recording(Path("t.fbtrace")):
        pass
    with pytest.raises(click.UsageError, match=r"no\.journal cannot be read: "), journals.open_journal_file(Path("no.journal")):
        pass


@each_of("names, name, said", [
    ([], None, "the recording has no PLC yet"), (["a", "b"], None, "choose a PLC with --plc NAME; the recording has a, b"),
    (["a"], "c", "choose a PLC with --plc NAME; the recording has a"), (["a"], None, ""), (["a", "b"], "b", ""), (["a"], "a", ""),
])
def test_which_plc_of_a_recording_is_meant(names: list[str], name: str | None, said: str) -> None:
    recording = cast(Any, {each: f"PLC {each}" for each in names})
    if said:
        with pytest.raises(Exception, match=said):
            traces.chosen_plc(recording, name)
    else:
        assert traces.chosen_plc(recording, name) == cast(Any, f"PLC {name or names[0]}")


@each_of("scans, asked, said", [
    ([], None, "the trace has no scans yet"), (range(3, 9), range(20, 30), "the trace has scans 3 to 8"), (range(3, 9), None, ""),
])
def test_scans_that_a_trace_does_not_have(scans: Any, asked: range | None, said: str) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(traces, "some_scans", lambda trace, scans: scans is None and len(trace.scans) > 0)
        trace = cast(Any, SimpleNamespace(scans=scans))
        if said:
            with pytest.raises(click.UsageError, match=f"^{said}$"):
                traces.require_scans(trace, asked)
        else:
            traces.require_scans(trace, asked)


def test_a_warning_of_a_recording_comes_behind_its_output(monkeypatch: pytest.MonkeyPatch,
                                                          capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(traces, "open_recording", lambda path, libraries: nullcontext({"a": "plc"}))
    monkeypatch.setattr(traces, "FileScans", lambda plc, depth: SimpleNamespace(warning=f"{plc} by another version", depth=depth))
    with traces._recorded(Path("t"), None, (), None) as source:
        assert source.depth is None and capsys.readouterr().err == ""
    assert capsys.readouterr().err == "plc by another version\n"


# --- options and streams ------------------------------------------------------------------------------------------------


def test_options_that_cannot_be_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(click.BadParameter, match="is not a time that can pass"):
        time_ns("-5ms")
    assert time_ns("5ms") == 5_000_000
    monkeypatch.setattr("fbvm.cli.shared.options.find_spec", lambda name: None)
    with pytest.raises(click.UsageError, match=r"the live page needs websockets: pip install 'fbvm\[live\]'"):
        check_live_installed()
    assert value_text(cast(Any, None), 5) == ""
    assert SourcePath().name


def test_a_text_from_a_pipe_is_shown_on_a_terminal_and_written_to_a_pipe(monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[str] = []
    text = "PROGRAM Main\nEND_PROGRAM\n"
    monkeypatch.setattr(fmt, "_read", lambda path: (Source("stdin", text), text.encode()))
    monkeypatch.setattr(fmt, "say_exactly", shown.append)
    for is_terminal in (True, False):
        raw = io.BytesIO()
        monkeypatch.setattr(sys, "stdout", SimpleNamespace(isatty=lambda is_terminal=is_terminal: is_terminal, buffer=raw))
        assert fmt._one(fmt.STREAM, False, False, None) is False
        assert raw.getvalue() == b"PROGRAM Main\nEND_PROGRAM\n" * (not is_terminal)
    assert shown == ["PROGRAM Main\nEND_PROGRAM\n"]


def test_another_signal_than_ctrl_c_ends_the_prompt(monkeypatch: pytest.MonkeyPatch) -> None:
    class Asking:
        def __init__(self, **_: object) -> None:
            return

        def prompt(self, text: str) -> str:
            assert text == "7:2> "
            raise KeyboardInterrupt

    monkeypatch.setattr(prompt, "PromptSession", Asking)
    monkeypatch.setattr(prompt, "_history", lambda: None)
    monkeypatch.setattr(prompt, "by_other_than_ctrl_c", lambda: True)
    commands = cast(Any, SimpleNamespace(session=SimpleNamespace(here=SimpleNamespace(scan=7, step=2))))
    with pytest.raises(KeyboardInterrupt):
        list(prompt.prompt_lines(commands))


def test_warnings_of_a_program_that_runs_are_shown(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from fbvm.cli.shared import sources

    warned = Diagnostic("S0290", Source("a.st", "x"), 0, 1, "never used")
    monkeypatch.setattr(sources, "compile_files",
                        lambda *_, **__: SimpleNamespace(image="image", diagnostics=[warned], errors=[]))
    with click.Context(click.Command("run")):
        assert sources.compile_or_exit((Path("counter.st"),), None, (), runnable=True) == cast(Any, "image")


def test_comments_of_operands_are_those_of_their_declarations() -> None:
    def declared(comment: str) -> Any:
        return SimpleNamespace(comment=comment)

    own = SimpleNamespace(declared={"start": declared("the green button"), "both": declared("own"), "bare": declared("")})
    known = cast(Any, SimpleNamespace(
        blocks={"other": SimpleNamespace(declared={"lamp": declared("of another block")})}, programs={"main": own},
        symbols={"lamp": (None, declared("on the panel")), "both": (None, declared("global"))}, addresses={"W9.00": "spare"}))
    addresses = {"Start": "W0.00", "Lamp": "W1.00", "W1.00": "Lamp", "Both": "D5"}
    operands = ("Start", "Bare", "Lamp", "W1.00", "W9.00", "W7.00", "IN:=Both", "Q=>Start", "5")
    rung = cast(Any, SimpleNamespace(steps=[(0, "", "LD", (each,)) for each in operands]))
    shown = drawings.comment_lines(rung, "Main", lambda name: addresses.get(name, ""), known)
    assert shown == ["  Start  W0.00  the green button", "  Lamp   W1.00  on the panel", "  W9.00         spare",
                     "  Both   D5     own"]
    assert drawings.comment_lines(rung, "Nobody", lambda name: "", cast(Any, SimpleNamespace(
        blocks={}, programs={}, symbols={}, addresses={}))) == []


@pytest.mark.slow
def test_sources_with_errors_are_not_compared(folder: Path) -> None:
    Path("broken.st").write_text("PROGRAM Main\nLADDER\nLD (\nEND_LADDER\n", encoding="utf-8")
    for pair in (("broken.st", "counter.st"), ("counter.st", "broken.st")):
        result = fbvm("diff", *pair)
        assert result.exit_code == 3 and "broken.st" in result.stderr, result.output
    same = fbvm("diff", "counter.st", "counter.st")
    assert (same.exit_code, same.output) == (0, "")


# --- projects and campaigns ---------------------------------------------------------------------------------------------


@each_of("name, said", [
    ("!x", "'!x' cannot be the name of a project; use letters, digits, - and _"),
    (" x", "' x' cannot be the name of a project; use"),
    ("con", "'con' cannot be the name of a project: Windows has no folder of this name"), ("full", "full is there already"),
    ("counter.st", "counter.st is there already"), ("empty", ""), ("deep/my pump.1", ""),
])
def test_which_project_is_made(folder: Path, name: str, said: str) -> None:
    (folder / "full" / "inside").mkdir(parents=True, exist_ok=True)
    made = fbvm("new", name)
    assert made.exit_code == (2 if said else 0) and said in made.output
    assert (folder / name / "src" / "pump.st").is_file() == (not said)
    if not said:
        assert "src/pump.st                 a function block" in made.output


@pytest.mark.slow
@each_of("arguments, status, said", [
    (("fleet", "wrong.toml", "--for", "1s"), 3, "wrong.st:1:40: error S0201: m is not declared"),
    (("campaign", "wrong.toml", "--runs", "2"), 3, "wrong.st:1:40: error S0201: m is not declared"),
    (("sweep", "wrong.toml", "--for", "1s", "--vary", "Main.n=1,2"), 3, "wrong.st:1:40: error S0201: m is not declared"),
    (("campaign", "planned.toml"), 2, "planned.toml runs the project none.toml, which is not there"),
])
def test_programs_with_errors_and_projects_that_are_gone_are_told_before_runs_begin(
        folder: Path, arguments: tuple[str, ...], status: int, said: str) -> None:  # fmt: skip
    (folder / "planned.toml").write_text('[campaign]\nproject = "none.toml"\n', encoding="utf-8")
    told = fbvm(*arguments)
    assert (told.exit_code, said in told.output) == (status, True), told.output
