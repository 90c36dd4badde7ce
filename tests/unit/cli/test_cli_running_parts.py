"""Parts of the verbs that run until somebody ends them: signals, memory images, networks, what pymodbus serves."""

from __future__ import annotations

import signal
import sys
from contextlib import ExitStack
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import click
import pytest
from click.testing import CliRunner
from images import counter_image
from rows import each_of

from fbvm.cli.running import live, peer, run, serve
from fbvm.cli.shared.debug import launch
from fbvm.cli.shared.files import OutputError
from fbvm.cli.shared.live import page
from fbvm.cli.shared.run_result import RunResult
from fbvm.machine.plc import Plc
from fbvm.net.notices import Notice, NoticeKind
from fbvm.wire import registers
from fbvm.wire.link import Peer


@pytest.fixture
def plc() -> Plc:
    return Plc(counter_image())


# --- signals ----------------------------------------------------------------------------------------------------------


@pytest.mark.skipif(not hasattr(signal, "SIGUSR1"), reason="there is no such signal here")
def test_a_signal_sets_a_flag_and_the_handlers_go_again() -> None:
    signals, before = serve.Signals(), signal.getsignal(signal.SIGTERM)
    with signals.installed():
        signal.raise_signal(signal.SIGUSR1)
        assert (signals.save, signals.end, signals.is_heard) == (True, False, True)
        signals.save = False
        assert not signals.is_heard
        signal.raise_signal(signal.SIGTERM)
    assert (signals.save, signals.end, signals.is_heard) == (False, True, True)
    assert signal.getsignal(signal.SIGTERM) is before


# --- images -----------------------------------------------------------------------------------------------------------


def test_the_memory_is_saved_where_it_is_to_be_and_loaded_again(plc: Plc, tmp_path: Path,
                                                                capsys: pytest.CaptureFixture[str]) -> None:
    image = tmp_path / "memory.toml"
    serve._load(plc, image)
    assert serve._save(plc, None) and not list(tmp_path.iterdir())
    plc.write("D5", 77)
    plc.write("CIO 3", 78)
    assert serve._save(plc, image)
    other = Plc(counter_image())
    serve._load(other, image)
    assert (other.read("D5"), other.read("CIO 3")) == (77, 78)
    assert capsys.readouterr().err == ""
    assert not serve._save(plc, tmp_path / "no" / "memory.toml")
    assert "memory.toml cannot be written: " in capsys.readouterr().err


def test_an_image_that_is_none_is_refused(plc: Plc, tmp_path: Path) -> None:
    image = tmp_path / "memory.toml"
    image.write_bytes(b"\xff\xfe nothing")
    with pytest.raises(click.UsageError, match=r"memory\.toml"):
        serve._load(plc, image)


def test_a_log_is_a_file_that_grows_or_the_output(tmp_path: Path) -> None:
    log = tmp_path / "log.txt"
    log.write_text("before\n", encoding="utf-8")
    with ExitStack() as stack:
        assert serve._opened(stack, Path("-")) is sys.stdout
        file = serve._opened(stack, log)
        file.write("now\n")
    assert log.read_text(encoding="utf-8") == "before\nnow\n" and not sys.stdout.closed


# --- serving ----------------------------------------------------------------------------------------------------------


class Served:
    """Stands in for the loop: each run ends as it is told, and signals come as they are told."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, signals: serve.Signals, *ends: tuple[str, str]) -> None:
        self.saved: list[object] = []
        self._ends = list(ends)
        self._signals = signals

        def run_all(runs: list[Any], record: Any, until: Any) -> None:
            assert not until()
            reason, heard = self._ends.pop(0)
            if heard == "log":
                raise OutputError(Path("log"), OSError("full"))
            runs[0].reason = reason
            self._signals.save, self._signals.end = heard == "save", heard == "end"
            assert until() == (heard in ("save", "end"))

        monkeypatch.setattr("fbvm.run.loop.run_all", run_all)
        monkeypatch.setattr(serve, "_save", lambda plc, image: self.saved.append(image) or image != Path("bad"))  # type: ignore[func-returns-value]


@each_of("ends, image, reason, saves, good", [
    ([("", "save"), ("", "save"), ("interrupted", "end")], "image", "interrupted", 3, True),
    ([("trap", "")], "image", "trap", 1, True), ([("", ""), ("", "end")], "image", "", 1, True),
    ([("", "end")], "bad", "", 1, False), ([("", "save"), ("trap", "")], "bad", "trap", 2, False),
])
def test_the_memory_is_saved_when_a_signal_asks_and_at_the_end(plc: Plc, ends: list[tuple[str, str]], image: str, reason: str,
                                                              saves: int, good: bool) -> None:  # fmt: skip
    with pytest.MonkeyPatch.context() as patch:
        signals = serve.Signals()
        served = Served(patch, signals, *ends)
        assert serve._serve(plc, "", signals, None, Path(image), lambda: None) == (reason, good)
        assert served.saved == [Path(image)] * saves and not signals.save


@each_of("wants_end, heard, runs", [(True, [""], 1), (False, ["", "end"], 2)])
def test_a_debugger_that_wants_the_end_has_it(plc: Plc, wants_end: bool, heard: list[str], runs: int) -> None:
    served: list[str] = []

    def serving(debugged: Any, meanwhile: Any) -> bool:
        served.extend(each.name for each in debugged())
        assert meanwhile() == signals.end
        return wants_end

    with pytest.MonkeyPatch.context() as patch:
        stand_in = Served(patch, signals := serve.Signals(), *[("", each) for each in heard])
        debugging = cast(Any, SimpleNamespace(is_called=False, serve=serving))
        assert serve._serve(plc, "", signals, debugging, Path("image"), lambda: None) == ("", True)
    assert served == ["plc"] * runs and stand_in.saved == [Path("image")] and signals.end


@each_of("is_called", [False, True])
def test_scans_stand_still_for_a_debugger_that_calls(plc: Plc, is_called: bool) -> None:
    asked: list[bool] = []

    def run_all(runs: list[Any], record: Any, until: Any) -> None:
        asked.append(until())

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fbvm.run.loop.run_all", run_all)
        debugging = cast(Any, SimpleNamespace(is_called=is_called, serve=lambda debugged, meanwhile: True))
        serve._serve(plc, "", serve.Signals(), debugging, None, lambda: None)
    assert asked == [is_called]


def test_a_run_that_a_trap_has_ended_at_the_start_is_not_begun(plc: Plc, monkeypatch: pytest.MonkeyPatch) -> None:
    served = Served(monkeypatch, signals := serve.Signals())
    assert serve._serve(plc, "trap", signals, None, None, lambda: None) == ("trap", True)
    signals.end = True
    assert serve._serve(plc, "", signals, None, None, lambda: None) == ("", True) and served.saved == []


def test_the_memory_is_saved_before_a_full_disk_is_told(plc: Plc, monkeypatch: pytest.MonkeyPatch) -> None:
    served = Served(monkeypatch, signals := serve.Signals(), ("", "log"))
    with pytest.raises(OutputError):
        serve._serve(plc, "", signals, None, Path("image"), lambda: None)
    assert served.saved == [Path("image")]


UNIT, REAL = Peer("192.168.250.1", 502), Peer("127.0.0.1", 1502)


@each_of("notices, ended, said, errors", [
    ([], "max", "", "no unit waits for callers; the program runs all the same\n"),
    ([], "trap", "", ""),
    ([NoticeKind.LISTENING], "until", "listening on 127.0.0.1:1502\n", ""),
])
def test_where_a_plc_listens_is_said_at_the_start(plc: Plc, notices: list[NoticeKind], ended: str, said: str,
                                                  errors: str) -> None:
    told: dict[str, list[str]] = {"out": [], "err": []}
    network = cast(Any, SimpleNamespace(notices=SimpleNamespace(tell=None)))

    def running(plc: Plc, until: Any, **bounds: Any) -> str:
        assert not until(plc)
        for kind in notices:
            network.notices.tell(SimpleNamespace(kind=kind, endpoint=UNIT, real=REAL, error=""))
        assert until(plc) == bool(notices)
        return ended

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fbvm.run.loop.run", running)
        patch.setattr(serve, "say", lambda text, err=False, **style: told["err" if err else "out"].append(f"{text}\n"))
        assert serve._start(plc, network, serve.Signals(), None) == ended
    assert ("".join(told["out"]), "".join(told["err"])) == (said, errors)


def test_a_port_that_cannot_be_used_ends_the_start(plc: Plc, monkeypatch: pytest.MonkeyPatch,
                                                   capsys: pytest.CaptureFixture[str]) -> None:
    network = cast(Any, SimpleNamespace(notices=SimpleNamespace(tell=None)))

    def running(plc: Plc, **bounds: Any) -> str:
        network.notices.tell(cast(Notice, SimpleNamespace(kind=NoticeKind.UNUSABLE, endpoint=UNIT, real=REAL, error="busy")))
        return "until"

    monkeypatch.setattr("fbvm.run.loop.run", running)
    with pytest.raises(SystemExit) as ended:
        serve._start(plc, network, serve.Signals(), None)
    assert ended.value.code == 5
    assert capsys.readouterr().err == "127.0.0.1:1502 cannot be used: busy\n"


# --- pages ------------------------------------------------------------------------------------------------------------


def wired(wire: Any, module: Any, monkeypatch: pytest.MonkeyPatch) -> tuple[Any, list[Any]]:
    """What makes the PLC of a page, with its units; the network is a stand-in.  Returns the PLC and the calls."""
    calls: list[Any] = []
    network = SimpleNamespace(close=lambda: calls.append("closed"))
    unit = SimpleNamespace(name="unit")
    monkeypatch.setattr(module, "build_network", lambda *given: calls.append(given[0]) or network)  # type: ignore[func-returns-value]
    monkeypatch.setattr(module, "usual_units", lambda *given: [unit])
    monkeypatch.setattr(module, "try_doors", lambda plc, of, mappings, doors: calls.append((of is network, mappings, doors)))
    monkeypatch.setattr(Plc, "attach", lambda plc, attached, to: calls.append((attached is unit, to is network)))
    plc, close = wire(counter_image())
    close()
    return plc, calls


def test_a_page_of_files_has_the_usual_units_on_the_network_that_was_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    plc, calls = wired(live._wiring(7_000_000, "tcp", cast(Any, ("map",)), cast(Any, ("door",))), live, monkeypatch)
    assert plc.cycle_ns == 7_000_000
    assert calls == ["tcp", (True, True), (True, ("map",), ("door",)), "closed"]


def test_a_run_under_a_page_has_the_options_of_a_run(monkeypatch: pytest.MonkeyPatch) -> None:
    served: list[Any] = []
    monkeypatch.setattr("fbvm.cli.shared.live.page.serve_page", lambda origin, control, options, recording: served.append(
        (origin, recording)))
    options: dict[str, Any] = {
        "net": "tcp", "mappings": ("map",), "seed": 3, "bind": "127.0.0.1", "doors": ("door",), "engine": "python",
        "watch_ns": 50_000_000, "timing": "exact", "scans": 5, "for_ns": None, "until": None, "max_ns": None, "lines": (),
        "watched": (), "conditions": (), "settings": [], "journal": None, "trace": Path("t"), "verify": True}
    with click.Context(click.Command("run")):
        run._run_live(counter_image(), 5_000_000, (), files=(Path("a.st"),), program=None, libraries=(), **options)
    [(origin, recording)] = served
    assert recording == {"journal": None, "trace": Path("t"), "verify": True}
    plc, calls = wired(origin.wire, run, monkeypatch)
    assert (plc.cycle_ns, plc.watch_cycle.time_ns, plc.engine_choice) == (5_000_000, 50_000_000, "python")
    assert calls == ["tcp", (True, True), (True, ("map",), ("door",)), "closed"]
    running = origin.bound(plc)
    plc.run(scans=5)
    assert running.plc is plc
    with click.Context(click.Command("run")):
        wrong = options | {"lines": ("nowhere",)}
        run._run_live(counter_image(), 1, (), files=(Path("a.st"),), program=None, libraries=(), **wrong)
    with pytest.raises(click.UsageError, match="nowhere"):
        served[1][0].bound(plc)


@each_of("options, said", [
    (["--frame", "nonsense"], "--frame nonsense: write a scheme or an origin"), (["--frame", "vscode-webview:"], ""),
    (["--frame", "http://127.0.0.1:8080"], ""), (["--debug", "0", "--trace", "t"], "--debug looks into scans itself"),
    (["--debug", "0"], ""), (["--trace", "t"], ""),
    (["--door", "1502", "--net", "loop"], "leave memory: add --net tcp"),
])
def test_options_of_a_page_that_do_not_go_together(options: list[str], said: str, tmp_path: Path) -> None:
    file, served = tmp_path / "a.st", []
    file.write_text("PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM", encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(live, "check_live_installed", lambda: None)
        patch.setattr(live, "serve_page", lambda origin, control, options, recording: served.append(options))
        result = CliRunner().invoke(live.command, [str(file), *options])
    assert (result.exit_code, len(served)) == ((2, 0) if said else (0, 1)), result.output
    assert said in result.output
    assert not served or served[0].frames == tuple(options[1:]) * ("--frame" in options)


@each_of("reason, ended", [("", False), ("trap", False), ("scans", True), ("until", True), ("interrupted", True)])
def test_what_a_page_takes_for_ended(reason: str, ended: bool) -> None:
    assert page._has_ended(cast(Any, SimpleNamespace(reason=reason))) is ended


# --- what a debugger and an import are given -----------------------------------------------------------------------------


def test_a_folder_with_a_project_file_and_the_file_itself_are_projects(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "plant").mkdir()
    (tmp_path / "plant" / "fbvm.toml").write_text("", encoding="utf-8")
    assert [launch._is_project(tmp_path / name) for name in ("empty", "plant", "plant/fbvm.toml", "none", "a.st")] == [
        False, True, True, False, False]


def test_the_name_of_an_encoding_is_taken_in_any_spelling() -> None:
    verb = import_module("fbvm.cli.programs.import")
    assert [verb._encoding(name) for name in ("", "CP932", "UTF8")] == ["", "cp932", "utf-8"]
    with pytest.raises(click.BadParameter, match="cp9321 is no encoding"):
        verb._encoding("cp9321")


@pytest.mark.parametrize("scan_time", [True, False])
def test_how_long_scans_took_is_no_part_of_the_result(plc: Plc, scan_time: bool, capsys: pytest.CaptureFixture[str]) -> None:
    plc.scan_times.note(0, 1_000_000)
    result = RunResult(plc, "scans", {}, None, False, "", scan_time)
    result.print()
    assert capsys.readouterr() == ("", f"{plc.scan_times}\n" if scan_time else "")
    plc.lateness.note(0, 5)
    result.print()
    assert capsys.readouterr().err == (f"{plc.scan_times}\n{plc.lateness}\n" if scan_time else "")


# --- the peer ---------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_peer_holds_what_its_page_says() -> None:
    pytest.importorskip("pymodbus")
    device = peer.device()
    assert device.id == 0
    assert [block[0].values for block in device.simdata] == [
        registers.coils(), registers.discrete_inputs(), registers.holding_registers(), registers.input_registers()]
    assert [block[0].datatype.name for block in device.simdata] == ["BITS", "BITS", "REGISTERS", "REGISTERS"]
    assert [block[0].address for block in device.simdata] == [0] * 4


def test_the_peer_shows_the_bytes_of_both_directions(capsys: pytest.CaptureFixture[str]) -> None:
    assert peer._trace(True, b"\x00\xab") == b"\x00\xab" and peer._trace(False, b"\x01") == b"\x01"
    assert peer._trace(True, b"") == b""
    assert capsys.readouterr().out == "-> 00 AB\n<- 01\n"
