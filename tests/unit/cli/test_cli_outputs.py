"""What verbs print beside results: pages, progress of a run, comments of operands, what does not go together."""

from __future__ import annotations

import io
import json
import socket
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import click
import pytest
from click.testing import CliRunner, Result
from rows import each_of

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.campaign.progress import INTERRUPTED, OVER
from fbvm.cli.main import main
from fbvm.cli.projects import planned_runs
from fbvm.cli.projects.shown_progress import ShownProgress
from fbvm.cli.running import dap, demo, live, peer, project_run, serve
from fbvm.cli.running import run as run_verb
from fbvm.cli.running.step import _chosen
from fbvm.cli.shared import sources
from fbvm.cli.shared.live.origins import FileOrigin
from fbvm.cli.shared.live.page import PageOptions
from fbvm.cli.shared.run_result import RunProgress
from fbvm.cli.shared.streams import give_up_output
from fbvm.cli.shared.terminal import say
from fbvm.cli.shared.traces import LAST_SCAN, ScanRange
from fbvm.code.compiler import compile_files
from fbvm.machine.plc import Plc

COUNTER = "PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM\n"


def fbvm(*arguments: str, given: str | None = None) -> Result:
    return CliRunner().invoke(main, arguments, catch_exceptions=False, input=given)


@pytest.fixture
def counter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("counter.st").write_text(COUNTER, encoding="utf-8")
    return "counter.st"


# --- pages ------------------------------------------------------------------------------------------------------------


@each_of("code, first, also", [
    ("dialects", "# Dialects", "MUX with K out of range"), (" Dialects ", "# Dialects", ""),
    ("fault", "", "latency"), ("FAULTS", "", "latency"), ("mov", "MOV(021)", ""), ("LIMIT", "", "MN"), ("ton", "", "PT"),
    ("s0301", "# S0301", "## Wrong"), ("max", "MAX(182)", "IEC 61131-3"),
])
def test_what_is_explained(code: str, first: str, also: str) -> None:
    shown = fbvm("explain", code)
    assert shown.exit_code == 0 and shown.stdout.startswith(first) and also in shown.stdout, shown.stdout[:300]


# --- progress of a run ------------------------------------------------------------------------------------------------


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def bar(monkeypatch: pytest.MonkeyPatch, terminal: io.StringIO, scans: int | None, for_ns: int | None) -> str:
    """What a run that has done 30 scans in 1.5 s shows."""
    monkeypatch.setattr(sys, "stderr", terminal)
    monkeypatch.setenv("TERM", "xterm")
    plc = cast(Plc, SimpleNamespace(scans=30, elapsed_ns=1_500_000_000))
    with RunProgress(plc, scans, for_ns) as progress:
        assert terminal.getvalue() == ""
        progress.update(plc)
        progress.update(plc)
        shown = terminal.getvalue()
    at_the_end = terminal.getvalue()[len(shown):]
    assert not shown or at_the_end.rpartition("\x1b[2K")[1:] == ("\x1b[2K", ""), f"the bar goes at the end: {at_the_end!r}"
    return shown


def test_a_run_on_a_terminal_shows_how_far_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    ends: list[tuple[int | None, int | None]] = [(40, None), (None, 6_000_000_000), (None, None)]
    with_scans, with_time, without = (bar(monkeypatch, Terminal(), *each) for each in ends)
    for shown in (with_scans, with_time, without):
        assert shown.count("30 scans, 1.5 s") == 2
    assert with_scans != with_time != without


def test_a_pipe_and_a_run_without_a_plc_show_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    assert bar(monkeypatch, io.StringIO(), 40, None) == ""
    terminal = Terminal()
    monkeypatch.setattr(sys, "stderr", terminal)
    with RunProgress(None, 40, None) as progress:
        progress.update(cast(Plc, SimpleNamespace(scans=30, elapsed_ns=0)))
    assert terminal.getvalue() == ""


def test_what_is_said_into_a_pipe_is_there_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(io.BufferedWriter(cast(Any, raw), 4096), encoding="utf-8"))
    say("listening on 127.0.0.1:1502")
    assert raw.getvalue() == b"listening on 127.0.0.1:1502\n"


def test_an_output_that_nobody_reads_any_more_takes_all_that_comes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", io.StringIO())
    give_up_output()
    assert sys.stdout.name == "/dev/null" or sys.stdout.name == "nul"
    sys.stdout.write("gone")
    sys.stdout.close()


# --- arguments --------------------------------------------------------------------------------------------------------


@each_of("text, first, behind", [
    ("41", 41, 42), ("10..60", 10, 61), ("10..", 10, LAST_SCAN + 1), ("..5", 0, 6), ("..", 0, LAST_SCAN + 1), ("7..7", 7, 8),
    ("9" * 40, LAST_SCAN, LAST_SCAN + 1), ("5.." + "9" * 40, 5, LAST_SCAN + 1),
])
def test_scans_of_a_recording(text: str, first: int, behind: int) -> None:
    assert ScanRange().convert(text, None, None) == range(first, behind)
    assert ScanRange().convert(range(2, 5), None, None) == range(2, 5)


@each_of("text, said", [
    ("x", "'x' is not scans such as 41 or 10..60"), ("1..x", "'1..x' is not scans such as 41 or 10..60"),
    ("5..4", "'5..4' has no scan in it"), ("-1", "'-1' has no scan in it"), ("-3..4", "'-3..4' has no scan in it"),
])
def test_texts_that_are_no_scans(text: str, said: str) -> None:
    with pytest.raises(click.BadParameter) as raised:
        ScanRange().convert(text, None, None)
    assert raised.value.message == said


@each_of("names, name, chosen", [
    (["a"], None, "a"), (["a"], "a", "a"), (["a", "b"], "b", "b"),
    (["a", "b"], None, "there are several PLCs; say which by --plc NAME; there is a, b"),
    (["a"], "c", "there is no PLC c; there is a"), (["a", "b"], "c", "there is no PLC c; there is a, b"),
])
def test_which_plc_is_stepped(names: list[str], name: str | None, chosen: str) -> None:
    try:
        assert _chosen(names, name) == chosen
    except click.UsageError as error:
        assert error.message == chosen


@each_of("arguments, said", [
    (("run", "--live", "--scans", "1", "--chart", "Main.n"), "--live shows it on the page: leave out --chart"),
    (("run", "--live", "--scan-time", "--ladder", "1"), "--live shows it on the page: leave out --ladder, --scan-time"),
    (("run", "--debug", "0", "--break", "Main"), "--debug looks into scans itself: leave out --break"),
    (("run", "--scans", "1", "--bind", "0.0.0.0"), "--bind leaves memory: add --net tcp"),
    (("run", "--scans", "1", "--bind", "here"), "--bind here is not an IPv4 address of this computer"),
    (("run", "--scans", "1", "--map", "1.2.3.4:5=peer", "--map", "1.2.3.4:5=peer"), "1.2.3.4:5 is mapped twice"),
    (("run", "--scans", "1", "--net", "tcp", "--door", "0", "--door", "1"), "several doors: say of each which it is"),
    (("run", "--scans", "1", "--net", "loop", "--door", "0"), "--door leaves memory: add --net tcp"),
    (("run", "--scans", "1", "--select", "Main.*"), "--select chooses what --trace keeps, which is not given"),
    (("step", "--map", "1.2.3.4:502=localhost:1502"), "stepping stays in memory: --map 1.2.3.4:502=peer"),
    (("step", "--set", "Main.n=1@10ms"), "here values are written before the first scan only; leave out @10ms"),
    (("step", "--set", "Main.m=1"), "Main has no m; it has n"), (("step", "--watch", "Main.m"), "Main has no m; it has n"),
    (("step", "--cycle", "0s"), "0s is not a time that can pass"),
    (("serve", "--live", "--debug", "0"), "--live and --debug both look into scans: give one of them"),
    (("serve", "--sockets", "2", "--fn0f"), "--sockets, --fn0f: said to the shipped server program"),
    (("serve", "--fins", "--read-only", "--idle", "5s"), "--idle: said to the shipped server program"),
])
def test_what_does_not_go_together(counter: str, arguments: tuple[str, ...], said: str) -> None:
    result = fbvm(arguments[0], counter, *arguments[1:])
    assert result.exit_code == 2 and said in " ".join(result.stderr.split()), result.output


def test_a_script_of_steps_ends_at_its_first_mistake(counter: str) -> None:
    script = "// a comment\n\nscan\nprint Main.n\nexpect Main.n = 2\nprint Main.n\n"
    result = fbvm("step", counter, given=script)
    assert result.exit_code == 1 and "> expect Main.n = 2" in result.stdout and result.stdout.count("> print Main.n") == 1
    assert "// a comment" not in result.stdout
    result = fbvm("step", counter, given="jump\nscan\n")
    assert result.exit_code == 2 and "> scan" not in result.stdout and result.stderr
    result = fbvm("step", counter, "--set", "Main.n=41", given="scan\nprint Main.n\nquit\nscan\n")
    assert result.exit_code == 0 and "42" in result.stdout and result.stdout.count("> scan") == 1


def test_comments_of_operands_stand_below_a_rung(counter: str) -> None:
    text = """PROGRAM Main
VAR
    Start AT W0.00 : BOOL; // the green button
    Lamp AT W1.00 : BOOL;  // on the panel
    Bare : BOOL;
END_VAR
LADDER
SECTION Lamps
LD Start
AND Bare
OUT Lamp
END_LADDER
END_PROGRAM
"""
    Path("rungs.st").write_text(text, encoding="utf-8")
    shown = fbvm("ladder", "--comments", "rungs.st").stdout.splitlines()
    assert "SECTION Lamps" in shown
    assert [line.split() for line in shown if "button" in line or "panel" in line] == [
        ["Start", "W0.00", "the", "green", "button"], ["Lamp", "W1.00", "on", "the", "panel"]]


# --- what cannot be used ----------------------------------------------------------------------------------------------


def test_a_demo_without_a_network_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused() -> object:
        raise OSError("no port is free")

    monkeypatch.setattr(demo, "own_server", refused)
    result = fbvm("demo", "--server", "own")
    assert (result.exit_code, result.stdout) == (5, "The network cannot be used: no port is free\n")


def test_a_project_whose_network_cannot_be_used_has_status_5(counter: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object, **__: object) -> object:
        raise OSError(98, "Address already in use")

    Path("fbvm.toml").write_text("[plc.a]\nsources = ['counter.st']\n", encoding="utf-8")
    monkeypatch.setattr(project_run, "Plant", refused)
    result = fbvm("run", "--scans", "1")
    assert (result.exit_code, result.stderr) == (5, "the network cannot be used: Address already in use\n")


@pytest.mark.slow
def test_the_page_is_only_asked_for_where_it_is_wanted(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing() -> None:
        raise click.UsageError("the page is not installed")

    for module in (serve, run_verb, demo):
        monkeypatch.setattr(module, "check_live_installed", missing)
    for arguments in (("serve", "--bind", "nobody"), ("run", "no.st"), ("run", "counter.st", "--scans", "x")):
        assert "not installed" not in fbvm(*arguments).stderr
    for arguments in (("serve", "--live", "--bind", "nobody"), ("demo", "--live")):
        result = fbvm(*arguments)
        assert result.exit_code == 2 and "the page is not installed" in result.stderr


@pytest.mark.slow
def test_tests_are_looked_for_of_a_program_only(counter: str) -> None:
    Path("two.st").write_text("FUNCTION F : INT\n    F := 1;\nEND_FUNCTION\n", encoding="utf-8")
    result = fbvm("prove", "two.st", "--tests", "test_two.py")
    assert result.exit_code == 3 and "S0209" in result.stderr


def test_a_peer_says_that_its_port_cannot_be_used_also_if_the_host_would_give_it(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        peer._unusable("127.0.0.1", 0)
    assert ended.value.code == 5 and capsys.readouterr().err == "127.0.0.1:0 cannot be used\n"


def test_a_peer_says_who_has_its_port(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(SystemExit) as ended:
            peer._unusable("127.0.0.1", port)
    assert (ended.value.code, capsys.readouterr().err) == (
        5, f"127.0.0.1:{port} cannot be used: somebody else listens there\n")


@pytest.mark.slow
def test_the_server_of_the_demo_ends_with_it() -> None:
    with demo.own_server() as server:
        assert server.port > 0
    assert server.process.poll() is not None  # type: ignore[attr-defined]


def test_an_adapter_that_is_told_something_wrong_ends_with_status_2(capsys: pytest.CaptureFixture[str]) -> None:
    dap._report("")
    with pytest.raises(SystemExit) as ended:
        dap._report("this is no message")
    assert ended.value.code == 2 and capsys.readouterr().err == "this is no message\n"
    for address in ("here", "here:", "127.0.0.1:x", ":-1"):
        with pytest.raises(click.UsageError, match=r"is no \[HOST:\]PORT"):
            dap._connected(address)


def test_what_is_said_of_a_document_comes_before_its_program(counter: str, monkeypatch: pytest.MonkeyPatch) -> None:
    source = Source("doc.xml", "<project/>")
    warned, wrong = Diagnostic("S0290", source, 0, 1, "left out"), Diagnostic("S0101", source, 0, 1, "no document")
    found: list[Diagnostic] = [warned]
    monkeypatch.setattr(sources, "inputs", lambda files: (list(files), found))
    result = fbvm("run", counter, "--scans", "2", "--show", "Main.n")
    assert (result.exit_code, result.stdout) == (0, "Main.n = 2\n") and "doc.xml:1:1: warning S0290: left out" in result.stderr
    found.append(wrong)
    result = fbvm("run", counter, "--scans", "2")
    assert result.exit_code == 3 and "1 error and 1 warning; `fbvm explain CODE`" in result.stderr
    told = json.loads(fbvm("run", counter, "--scans", "2", "--json").stdout)["diagnostics"]
    assert [each["code"] for each in told] == ["S0290", "S0101"]


# --- pages ------------------------------------------------------------------------------------------------------------


@each_of("done, state", [(0, INTERRUPTED), (1, INTERRUPTED), (2, OVER)])
def test_the_page_of_a_campaign_says_whether_it_is_over(tmp_path: Path, done: int, state: str) -> None:
    result = SimpleNamespace(number=0, failure=None, variant=None, time_ns=0)
    outcome = SimpleNamespace(plan=SimpleNamespace(count=2), results=dict.fromkeys(range(done), result))
    shown = ShownProgress(cast(Any, outcome), tmp_path / "progress.html", False)
    shown.end({})
    assert shown._progress.state == state
    assert state in (tmp_path / "progress.html").read_text(encoding="utf-8")


def test_a_page_of_files_keeps_its_groups_beside_the_first(counter: str) -> None:
    origin = FileOrigin([Path("a/pump.st"), Path("b/tank.st")], (), None, cast(Any, None), cast(Any, None))
    assert origin.groups_file == Path("a/pump.watch.toml") and list(origin.files) == [Path("a/pump.st"), Path("b/tank.st")]
    image = compile_files([counter], runnable=True).image
    assert image is not None
    plc, close = live._wiring(5_000_000, "loop", (), ())(image)
    plc.run(scans=3)
    assert (plc.read("Main.n"), plc.cycle_ns, [unit.unit.name for unit in plc.units]) == (3, 5_000_000, ["ETN21 0"])
    close()


def test_a_run_under_a_page_has_the_page_that_the_verb_for_pages_has() -> None:
    usual = {parameter.name: parameter.default for parameter in live.command.params}
    options = PageOptions()
    assert (options.bind, options.port) == (usual["bind"], usual["port"]) and not options.read_only
    assert tuple(options.writable) == tuple(options.frames) == () and options.debug_port is None


@each_of("names, chosen", [
    ([], "campaign.toml"), (["."], "campaign.toml"), (["sub"], None), (["sub/runs.toml"], "sub/runs.toml"), (["fbvm.toml"], None),
    (["counter.st"], None), ([".", "sub"], None), (["campaign.toml"], "campaign.toml"),
])
def test_which_file_says_what_a_campaign_does(counter: str, names: list[str], chosen: str | None) -> None:
    Path("sub").mkdir(exist_ok=True)
    for name in ("campaign.toml", "sub/runs.toml", "fbvm.toml"):
        Path(name).write_text("", encoding="utf-8")
    found = planned_runs._plan_file([Path(name) for name in names], "campaign.toml", lambda path: path.name != "fbvm.toml")
    assert (found and found.as_posix()) == chosen
