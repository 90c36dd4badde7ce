"""Ways of the command that are seldom gone: output that breaks, files that cannot be read, packages that are missing."""

from __future__ import annotations

import asyncio
import os
import sys
from contextlib import nullcontext
from importlib import import_module
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any, ClassVar, NoReturn

import click
import pytest
from click.testing import CliRunner
from rows import each_of

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.campaign.execution import Wrong
from fbvm.cli.main import main
from fbvm.cli.programs import check
from fbvm.cli.projects import fleet, planned_runs, runs_of_tests, shown_progress
from fbvm.cli.projects import test as test_verb
from fbvm.cli.recordings import why
from fbvm.cli.running import peer, step
from fbvm.cli.shared import given_sources, status, streams
from fbvm.cli.shared.debug import launch
from fbvm.cli.shared.live import origins
from fbvm.interchange.formats import given
from fbvm.interchange.imported import Imported
from fbvm.record.trace.writer import Depth

MAIN: ModuleType = sys.modules["fbvm.cli.main"]
COUNTER = "PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM\n"


def raising(error: BaseException) -> Any:
    def fail(*arguments: Any, **options: Any) -> NoReturn:
        raise error

    return fail


@pytest.fixture
def counter(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("counter.st").write_text(COUNTER, encoding="utf-8")
    return Path("counter.st")


# --- how a command ends -----------------------------------------------------------------------------------------------------


@each_of("method, error, ended, gives_up", [
    ("make_context", KeyboardInterrupt(), status.INTERRUPTED, False), ("invoke", KeyboardInterrupt(), status.INTERRUPTED, False),
    ("invoke", BrokenPipeError(), status.OUTPUT_CLOSED, True),
])  # fmt: skip
def test_what_breaks_a_verb_ends_it(method: str, error: BaseException, ended: int, gives_up: bool) -> None:
    given_up: list[bool] = []
    context = click.Context(main)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(MAIN, "give_up_output", lambda: given_up.append(True))
        patch.setattr(click.Group, method, raising(error))
        with pytest.raises(SystemExit) as end:
            main.invoke(context) if method == "invoke" else main.make_context("fbvm", [])
    assert (end.value.code, given_up) == (ended, [True] * gives_up)


@each_of("error, ended, said", [
    (BrokenPipeError(), status.OUTPUT_CLOSED, ""), (OSError(28, "No space left on device"), status.USAGE,
                                                    "the output cannot be written: no space left on device\n"),
    (OSError(13, "Permission denied", "x.st"), status.USAGE, "x.st cannot be used: permission denied\n"),
])  # fmt: skip
def test_what_breaks_the_output_ends_the_command(error: OSError, ended: int, said: str) -> None:
    given_up: list[bool] = []
    told: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(MAIN, "give_up_output", lambda: given_up.append(True))
        patch.setattr(MAIN, "say", lambda text, err=False: told.append(text + "\n" * err))
        patch.setattr(click.Group, "main", raising(error))
        with pytest.raises(SystemExit) as end:
            main._run()
    assert (end.value.code, given_up, "".join(told).lower()) == (ended, [True], said.lower())


def test_output_that_is_given_up_goes_nowhere(monkeypatch: pytest.MonkeyPatch) -> None:
    done: list[tuple[Any, ...]] = []
    monkeypatch.setattr(streams, "os", SimpleNamespace(
        devnull=os.devnull, O_WRONLY=os.O_WRONLY, open=lambda *given: done.append(("open", *given)) or 7,
        dup2=lambda *given: done.append(("dup2", *given)), close=lambda *given: done.append(("close", *given))))  # fmt: skip
    monkeypatch.setattr(sys, "stdout", SimpleNamespace(fileno=lambda: 1))
    streams.give_up_output()
    assert done == [("open", os.devnull, os.O_WRONLY), ("dup2", 7, 1), ("close", 7)]


def test_only_what_is_written_is_put_into_ascii() -> None:
    error = UnicodeDecodeError("ascii", b"\xff", 0, 1, "no letter")
    with pytest.raises(UnicodeDecodeError):
        streams._in_ascii(error)
    assert streams._in_ascii(UnicodeEncodeError("ascii", "a\u2502\u00fcb", 1, 3, "no letter")) == ("|?", 3)


# --- what is missing --------------------------------------------------------------------------------------------------------


def test_a_file_of_another_tool_that_cannot_be_read_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(given, "within", raising(OSError(5, "Input/output error")))
    with pytest.raises(click.UsageError, match=r"^a\.xml cannot be read: .*[Ii]nput/output error"):
        given_sources.within(Path("a.xml"))
    monkeypatch.setattr(launch, "inputs", raising(OSError(5, "Input/output error")))
    monkeypatch.setattr(launch, "_sources", lambda given, folder: [])
    with pytest.raises(launch.LaunchError, match=r"^a project cannot be read: .*[Ii]nput/output error"):
        launch._program({"program": "a.xml"}, Path())


def test_without_pytest_there_are_no_tests(counter: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(test_verb, "find_spec", lambda name: None)
    result = CliRunner().invoke(test_verb.command, [])
    assert (result.exit_code, "tests need pytest: pip install pytest" in result.output) == (status.USAGE, True)
    monkeypatch.setattr(runs_of_tests, "find_spec", lambda name: None)
    Path("test_counter.py").write_text("def test_it():\n    pass\n", encoding="utf-8")
    result = CliRunner().invoke(main, ["campaign", "test_counter.py", "--runs", "1"])
    assert (result.exit_code, "tests need pytest: pip install pytest" in result.output) == (status.USAGE, True)


# --- what is said -----------------------------------------------------------------------------------------------------------


@each_of("code, switch", [("S0290", True), ("S0301", False)])
def test_a_page_of_a_warning_says_how_to_switch_it_off(code: str, switch: bool) -> None:
    shown = CliRunner().invoke(main, ["explain", code]).output
    wanted = f"Switch it off in a text with {{warning disable {code}}} .. {{warning restore {code}}}"
    assert (wanted in shown, f"`fbvm check --no-warn {code}`" in shown) == (switch, switch)


@each_of("length, is_terminal, said", [
    (check.LONG, True, ["checking counter.st"]), (check.LONG - 1, True, []), (check.LONG, False, []),
    (None, True, ["checking there"]),
])  # fmt: skip
def test_a_long_check_shows_its_progress_on_a_terminal(counter: Path, length: int | None, is_terminal: bool,
                                                       said: list[str]) -> None:  # fmt: skip
    shown: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fbvm.cli.shared.progress.show_progress", lambda what: shown.append(what) or nullcontext())
        patch.setattr(sys, "stderr", SimpleNamespace(isatty=lambda: is_terminal))
        counter.write_text(" " * (length or 0), encoding="utf-8")
        Path("there").mkdir(exist_ok=True)
        with check._progress((counter if length is not None else Path("there"),)) as progress:
            assert progress is None or progress("parsing", 1, 2) is None  # type: ignore[func-returns-value]
    assert shown == said


@pytest.mark.parametrize("is_terminal", [True, False])
def test_where_the_page_of_a_campaign_lies_is_said_on_a_terminal(monkeypatch: pytest.MonkeyPatch, is_terminal: bool) -> None:
    said: list[str] = []
    monkeypatch.setattr(shown_progress, "say", lambda text, err=False: said.append(text + " to stderr" * err))
    monkeypatch.setattr(sys, "stderr", SimpleNamespace(isatty=lambda: is_terminal))
    outcome: Any = SimpleNamespace(plan=SimpleNamespace(count=3), results={})
    shown_progress.ShownProgress(outcome, Path("x/progress.html"), False)
    assert said == ["progress: x/progress.html to stderr"] * is_terminal


WRONG = Wrong([Diagnostic("S0301", Source("counter.st", COUNTER), 0, 7, "the value is wrong")])


@pytest.mark.slow
@each_of("arguments, conducts", [
    (["sweep", "counter.st", "--vary", "Main.n=1,2", "--for", "1s"], "fbvm.campaign.runs.conduct"),
    (["campaign", "counter.st", "--runs", "2", "--for", "1s"], "fbvm.cli.projects.campaign._conduct"),
])  # fmt: skip
def test_runs_of_what_is_wrong_end_with_what_is_said_about_it(counter: Path, arguments: list[str], conducts: str) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(conducts, raising(WRONG))
        result = CliRunner().invoke(main, arguments)
    assert (result.exit_code, "S0301: the value is wrong" in result.output) == (status.PROGRAM_ERRORS, True), result.output


def test_a_project_with_mistakes_is_not_planned(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(planned_runs, "project_argument", lambda files: Path("fbvm.toml"))
    monkeypatch.setattr(planned_runs, "read_given_project", lambda file: WRONG.diagnostics)
    with pytest.raises(SystemExit) as end:
        planned_runs._project([], None, SimpleNamespace())  # type: ignore[arg-type]
    assert end.value.code == status.PROGRAM_ERRORS


# --- a peer -------------------------------------------------------------------------------------------------------------------


class Server:
    """Stands for the server of pymodbus."""

    made: ClassVar[list[tuple[Any, ...]]] = []
    listens = True

    def __init__(self, device: Any, *, address: tuple[str, int], trace_packet: Any) -> None:
        self.made.append((address, trace_packet))
        name = SimpleNamespace(getsockname=lambda: ("127.0.0.1", 15021, 0, 0))
        self.transport = SimpleNamespace(sockets=[name])
        self.serving = asyncio.get_running_loop().create_future()
        self.serving.set_result(None)

    async def listen(self) -> bool:
        return self.listens

    async def shutdown(self) -> None:
        self.made.append(("shut down",))


@pytest.mark.slow
@each_of("listens, trace", [(True, True), (True, False), (False, False)])
def test_a_peer_says_where_it_listens_and_is_shut_down(listens: bool, trace: bool) -> None:
    server = pytest.importorskip("pymodbus.server")
    said: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(server, "ModbusTcpServer", Server)
        patch.setattr(Server, "made", [])
        patch.setattr(Server, "listens", listens)
        patch.setattr(peer, "say", said.append)
        patch.setattr(peer, "device", lambda: None)
        if listens:
            asyncio.run(peer._serve("127.0.0.1", 0, trace))
        else:
            with pytest.raises(OSError, match="pymodbus says no more"):
                asyncio.run(peer._serve("127.0.0.1", 0, trace))
        assert Server.made == [(("127.0.0.1", 0), peer._trace if trace else None), *[("shut down",)] * listens]
    assert said == [f"{peer.LISTENING}127.0.0.1:15021"] * listens


@each_of("error, ended", [
    (KeyboardInterrupt(), status.GOOD), (asyncio.CancelledError(), status.GOOD), (OSError(), status.NETWORK), (None, 0),
])  # fmt: skip
def test_how_a_peer_ends(error: BaseException | None, ended: int) -> None:
    pytest.importorskip("pymodbus.server")
    warned: list[Any] = []
    asked: list[tuple[Any, ...]] = []

    def serve(*given: Any) -> Any:
        asked.append(given)

    def run(coroutine: Any) -> None:
        if error is not None:
            raise error

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(peer, "warn_if_reachable", warned.append)
        patch.setattr(peer, "_serve", serve)
        patch.setattr(peer, "asyncio", SimpleNamespace(run=run, CancelledError=asyncio.CancelledError))
        patch.setattr(peer, "_unusable", lambda host, port: sys.exit(status.NETWORK))
        result = CliRunner().invoke(peer.command, ["--port", "15021", "--bind", "0.0.0.0", "--trace"])
        assert CliRunner().invoke(peer.command, []).exit_code == ended
    assert result.exit_code == ended
    assert asked == [("0.0.0.0", 15021, True), ("127.0.0.1", 15020, False)]
    assert warned == [peer.Peer("0.0.0.0", 15021), peer.Peer("127.0.0.1", 15020)]


# --- recordings, fleets and projects -----------------------------------------------------------------------------------------


def test_a_recording_without_scans_says_so(counter: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    Path("x.trace").write_bytes(b"")
    empty = SimpleNamespace(depth=Depth.STATEMENTS, find=lambda name: SimpleNamespace(), scans=[])
    for module in (why, step):
        monkeypatch.setattr(module, "open_trace", lambda *given: nullcontext(empty))
    monkeypatch.setattr(why, "Place", SimpleNamespace)
    monkeypatch.setattr(step, "FileScans", SimpleNamespace)
    result = CliRunner().invoke(why.command, ["Main.n", "x.trace"])
    assert (result.exit_code, "the trace has no scans yet" in result.output) == (status.USAGE, True)
    with click.Context(step.command), pytest.raises(click.UsageError, match=r"^x\.trace has no scans yet$"):
        step._past(Path("x.trace"), None, [], [])


class Enough(Exception):
    """What matters has happened."""


def test_what_is_said_of_the_programs_of_a_fleet_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[Diagnostic] = []
    monkeypatch.setattr(fleet, "_project", lambda file, options: (None, None))
    monkeypatch.setattr(fleet, "_check_shards", lambda project, shards: None)
    monkeypatch.setattr(fleet, "show_diagnostic", shown.append)
    monkeypatch.setattr("fbvm.campaign.planning.images_of", lambda project: ([], WRONG.diagnostics))
    monkeypatch.setattr("fbvm.campaign.work.packed", raising(Enough()))
    with pytest.raises(Enough):
        fleet._places(None, {"shards": 2, "doors_file": None})
    assert shown == WRONG.diagnostics


def test_what_is_said_of_a_project_on_a_page_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[Any] = []
    plant = SimpleNamespace(diagnostics=WRONG.diagnostics, missing_units=lambda: ["unit 3 is missing"], doors=["door"])
    monkeypatch.setattr(origins, "Plant", lambda project, **options: shown.append((project, options)) or plant)
    monkeypatch.setattr(origins, "show_diagnostic", shown.append)
    monkeypatch.setattr(origins, "say", lambda text, **options: shown.append((text, options)))
    monkeypatch.setattr(origins, "say_doors", raising(Enough()))
    project: Any = object()
    origin = origins.ProjectOrigin(Path("fbvm.toml"), "loop", lambda run: run, 5, 7)
    origin.project = project
    with pytest.raises(Enough):
        origin.build()
    assert shown == [(project, {"net": "loop", "for_ns": 5, "scans": 7}), *WRONG.diagnostics,
                     ("unit 3 is missing", {"fg": "yellow", "err": True})]  # fmt: skip


@each_of("name, files, made", [
    ("a.exp", {"A.st": "text"}, ["A.st"]), ("a.lib", {}, []), ("a.lib", {"A.st": "text"}, ["A.st", "library.toml"]),
    ("a.LIB", {"A.st": "text"}, ["A.st", "library.toml"]),
])  # fmt: skip
def test_only_a_library_of_codesys_becomes_a_folder_of_a_library(tmp_path: Path, name: str, files: dict[str, str],
                                                                made: list[str]) -> None:  # fmt: skip
    verb = import_module("fbvm.cli.programs.import")
    (tmp_path / name).write_bytes(b"content")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(verb, "is_cx_project", lambda file: False)
        patch.setattr(verb, "is_export", lambda data: data == b"content")
        patch.setattr(verb, "import_codesys2", lambda data, name: Imported(files, []))
        patch.setattr(verb, "library_description", lambda imported, title: f"title = {title}")
        found = verb._imported(tmp_path / name, None, None, None, None)
    assert sorted(found.files) == made
    assert found.files.get("library.toml") in (None, "title = a")


def test_verbs_on_programs_say_that_no_file_is_given() -> None:
    verbs = ("ladder", "list", "prove", "sfc")
    told = {verb: CliRunner().invoke(main, [verb]) for verb in verbs}
    missing = "Error: Missing argument 'FILE...'."
    assert {verb: (made.exit_code, missing in made.output) for verb, made in told.items()} == dict.fromkeys(verbs, (2, True))
