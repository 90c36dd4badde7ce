"""`fbvm serve` in parts: what it puts together, and with which status it ends; its network, recording, page and debugger."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack, nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import click
import pytest
from click.testing import CliRunner, Result
from images import counter_image
from rows import each_of

from fbvm.cli.running import serve
from fbvm.cli.shared.fins import ENDPOINT, FinsDoor
from fbvm.cli.shared.run_recording import RunRecording
from fbvm.machine.plc import Plc
from fbvm.net.notices import NoticeKind
from fbvm.run.plant import ENDLESS
from fbvm.wire.link import Peer

HERE = Peer("127.0.0.1", 1502)


@pytest.fixture
def plc() -> Plc:
    return Plc(counter_image())


# --- the verb ---------------------------------------------------------------------------------------------------------


class Serving:
    """Stands in for everything that the verb puts together, and notes it."""

    def __init__(self, plc: Plc, start: str = "", served: tuple[str, bool] = ("", True), saved: bool = True) -> None:
        self.plc, self.calls = plc, list[Any]()
        self.runtime: object = None
        """The unit of a runtime of OpenPLC that the program brings."""
        self.network = SimpleNamespace(close=lambda: self.calls.append("closed"), tap=None)
        self._start, self._served, self._saved = start, served, saved

    def __call__(self, *arguments: str) -> Result:
        note = self.calls.append
        unit = SimpleNamespace(name="unit")
        recorded = RunRecording()

        def start(plc: Plc, network: Any, signals: Any, fins: Any) -> str:
            note(("start", plc is self.plc, network is self.network, fins))
            return self._start

        def served(plc: Plc, reason: str, signals: Any, debugging: Any, image: Any, record: Any) -> tuple[str, bool]:
            note(("serve", reason, debugging, image, record == recorded.tick))
            return self._served

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(serve.Signals, "installed", lambda signals: nullcontext(note("signals")))
            patch.setattr(serve, "_shipped", lambda settings: note(("settings", settings)) or self.plc)
            patch.setattr(serve, "_own", lambda files, program, libraries, allowed, settings:
                          note(("own", files, set(allowed), settings)) or (self.plc, self.runtime))  # fmt: skip
            patch.setattr(serve, "_load", lambda plc, image: note(("load", image)))
            patch.setattr(serve, "_network", lambda *given: note(("network", *given)) or self.network)
            patch.setattr(serve, "usual_units", lambda names, fins: note(("units", fins)) or [unit])
            patch.setattr(Plc, "attach", lambda plc, one, network: note(
                ("attach", "runtime" if one is self.runtime else one is unit, network is self.network)))
            patch.setattr(serve, "try_fins", lambda network, door: note(("fins", network is self.network, door)))
            patch.setattr(serve, "_start", start)
            patch.setattr(serve, "_serve", served)
            patch.setattr(serve, "_serve_page", lambda plc, files, libraries, signals, image, recordings:
                          note(("page", files, image, recordings)))  # fmt: skip
            patch.setattr(serve, "_save", lambda plc, image: note(("save", image)) or self._saved)
            patch.setattr(serve, "_recording", lambda stack, *given: note(("record", given[-1])) or recorded)
            patch.setattr(serve, "_debug_port", lambda stack, plc, number, files, libraries: f"port {number}")
            patch.setattr(serve, "check_live_installed", lambda: note("live"))
            return CliRunner().invoke(serve.command, arguments)


USUAL = {"sockets": 1, "read_only": False, "fn0f": False, "full_dm": False, "idle_ns": None}
NO_FILES = {"trace": None, "journal": None, "verify": False}


def test_the_shipped_program_is_served_with_its_settings(plc: Plc) -> None:
    serving = Serving(plc)
    result = serving("--sockets", "3", "--read-only", "--idle", "5s", "--port", "0", "--no-backlog", "--watch-cycle", "70ms")
    assert (result.exit_code, result.output) == (0, "")
    assert serving.calls == [
        "signals", ("settings", USUAL | {"sockets": 3, "read_only": True, "idle_ns": 5_000_000_000}),
        ("network", "127.0.0.1", 0, False, None), ("units", None), ("attach", True, True), ("record", NO_FILES),
        ("start", True, True, None), ("serve", "", None, None, True), "closed"]
    assert plc.watch_cycle.time_ns == 70_000_000 and serving.network.tap is None and plc.watchers == []


def test_a_program_of_ones_own_with_fins_an_image_a_log_and_a_debugger(plc: Plc, tmp_path: Path) -> None:
    file, log = tmp_path / "a.st", tmp_path / "log.txt"
    file.write_text("PROGRAM Main END_PROGRAM", encoding="utf-8")
    serving = Serving(plc)
    serving.runtime = object()
    result = serving(str(file), "--fins", "--fins-node", "9", "--image", "memory.json", "--log", str(log), "--debug", "4711",
                     "--trace", "t", "--verify")
    assert (result.exit_code, result.output) == (0, "")
    door = FinsDoor(Peer("127.0.0.1", 9600), 9, "full")
    assert serving.calls == [
        "signals", ("own", (file,), {"read_only"}, USUAL), ("load", Path("memory.json")),
        ("network", "127.0.0.1", 1502, True, door), ("units", door.unit),
        ("attach", True, True), ("attach", "runtime", True), ("fins", True, door),
        ("record", {"trace": Path("t"), "journal": None, "verify": True}), ("start", True, True, door),
        ("serve", "", "port 4711", Path("memory.json"), True), "closed"]
    assert serving.network.tap is not None and len(plc.watchers) == 1 and log.exists()


@each_of("start, served, saved, status", [
    ("", ("", True), True, 0), ("", ("interrupted", True), True, 0), ("", ("trap", True), True, 4), ("", ("", False), True, 2),
    ("", ("trap", False), True, 4),
])
def test_the_status_says_whether_a_trap_has_ended_it_or_the_memory_is_lost(start: str, served: tuple[str, bool], saved: bool,
                                                                         status: int) -> None:  # fmt: skip
    plc = Plc(counter_image())
    plc.trap = cast(Any, "R0101 here") if served[0] == "trap" else None
    result = Serving(plc, start, served, saved)()
    assert (result.exit_code, result.stderr) == (status, "R0101 here\n" * (served[0] == "trap"))


@each_of("start, trap, saved, status, page", [
    ("", None, True, 0, True), ("", None, False, 2, True), ("", "R0101", True, 4, True), ("trap", "R0101", True, 4, False),
])
def test_under_a_page_the_memory_is_saved_at_the_end(start: str, trap: str | None, saved: bool, status: int, page: bool) -> None:
    plc = Plc(counter_image())
    plc.trap = cast(Any, trap)
    serving = Serving(plc, start, saved=saved)
    assert serving("--live", "--image", "m.json").exit_code == status
    assert serving.calls[0] == "live" and serving.calls[-2:] == [("save", Path("m.json")), "closed"]
    assert (("page", (), Path("m.json"), NO_FILES) in serving.calls) == page
    assert not any(call[0] in ("serve", "record") for call in serving.calls)


# --- parts ------------------------------------------------------------------------------------------------------------


@each_of("fails", [False, True])
def test_the_first_door_is_where_it_is_to_be(fails: bool, capsys: pytest.CaptureFixture[str]) -> None:
    done: list[Any] = []

    class Network:
        def __init__(self, rows: Any, host: str, *, door: Peer, backlog: bool) -> None:
            done.append((rows, host, door, backlog))

        def try_door(self, door: Peer) -> None:
            done.append(door)
            if fails:
                raise OSError(98, "127.0.0.1:1502 cannot be used: somebody else listens there")

        def close(self) -> None:
            done.append("closed")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(serve, "TcpNetwork", Network)
        if fails:
            with pytest.raises(SystemExit) as ended:
                serve._network("127.0.0.1", 1502, True, None)
            assert ended.value.code == 5
        else:
            assert isinstance(serve._network("127.0.0.1", 1502, True, None), Network)
    assert done == [(None, "127.0.0.1", HERE, True), HERE, *["closed"] * fails]
    assert capsys.readouterr().err == "127.0.0.1:1502 cannot be used: somebody else listens there\n" * fails


def test_with_fins_its_row_is_on_the_map(monkeypatch: pytest.MonkeyPatch) -> None:
    rows: list[Any] = []
    network = SimpleNamespace(try_door=lambda door: None)
    monkeypatch.setattr(serve, "TcpNetwork", lambda given, host, **options: rows.append((given, host)) or network)
    assert serve._network("127.0.0.1", 0, False, FinsDoor(Peer("127.0.0.2", 9600), 9, "full")) is network
    assert rows == [({ENDPOINT: ("127.0.0.2", 9600)}, "127.0.0.1")]


def test_a_recording_is_named_after_the_first_source(plc: Plc, tmp_path: Path) -> None:
    added: list[Any] = []
    one, two = tmp_path / "pump.st", tmp_path / "tank.st"
    for file in (one, two):
        file.write_text("(* nothing *)", encoding="utf-8")
    with click.Context(serve.command), pytest.MonkeyPatch.context() as patch:
        patch.setattr(RunRecording, "add", lambda self, name, plc, described: added.append((name, plc, described)))
        for files, name in (((one, two), "pump"), ((), "server")):
            with ExitStack() as stack:
                paths = {"trace": tmp_path / name, "journal": None, "verify": False}
                made = serve._recording(stack, plc, files, (), "Main", paths)
                assert made.recording is not None
                assert added[-1][:2] == (name, plc) and added[-1][2].program.program == "Main"
                assert [Path(text).name for text, _ in added[-1][2].program.sources] == (
                    ["pump.st", "tank.st"] if files else ["server.st"])
        with ExitStack() as stack:
            none = serve._recording(stack, plc, (), (), None, {"trace": None, "journal": None, "verify": False})
            assert none.recording is None and len(added) == 2


def test_the_port_of_debuggers_shows_the_sources_and_is_closed_at_the_end(plc: Plc, monkeypatch: pytest.MonkeyPatch,
                                                                         tmp_path: Path) -> None:  # fmt: skip
    made: list[Any] = []
    file = tmp_path / "a.st"
    file.write_text("(* nothing *)", encoding="utf-8")
    monkeypatch.setattr(serve, "DebugPort", lambda number, sources: SimpleNamespace(
        made=made.append((number, sources.paths)), close=lambda: made.append("closed")))
    for files, paths in (((file,), {str(file): file}), ((), {str(serve.SHIPPED): serve.SHIPPED})):
        with ExitStack() as stack:
            port = serve._debug_port(stack, plc, 4711, files, ())
            assert port is not None and made[-1] == (4711, paths)
        assert made[-1] == "closed"


def started(plc: Plc, notices: list[tuple[NoticeKind, Peer]], fins: FinsDoor | None) -> list[str]:
    """What is said at the start, when the network tells this."""
    said: list[str] = []
    network = cast(Any, SimpleNamespace(notices=SimpleNamespace(tell=None)))

    def running(plc: Plc, **bounds: Any) -> str:
        assert (bounds["max_ns"], bounds["pace"]) == (5_000_000_000, "event")
        for kind, endpoint in notices:
            network.notices.tell(SimpleNamespace(kind=kind, endpoint=endpoint, real=HERE, error="busy"))
        return "until"

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("fbvm.run.loop.run", running)
        patch.setattr(serve, "notice_teller", lambda how: lambda notice: said.append(f"{notice.kind.name} {notice.endpoint}"))
        patch.setattr(serve, "say_fins", lambda door, real: said.append(f"fins {door.node} {real}"))
        patch.setattr(serve, "say", lambda text, **style: said.append(text))
        assert serve._start(plc, network, serve.Signals(), fins) == "until"
    return said


def test_at_the_start_fins_and_the_first_door_have_their_own_words(plc: Plc) -> None:
    first, second, door = Peer("192.168.250.21", 502), Peer("192.168.250.21", 503), FinsDoor(HERE, 9, "full")
    listening, full = NoticeKind.LISTENING, NoticeKind.FULL
    assert started(plc, [(listening, ENDPOINT), (full, ENDPOINT), (listening, first), (listening, second), (full, first),
                         (listening, first), (NoticeKind.UNUSABLE, second)], door) == [
        "fins 9 127.0.0.1:1502", f"FULL {ENDPOINT}", f"LISTENING {second}", f"FULL {first}", f"UNUSABLE {second}",
        "listening on 127.0.0.1:1502"]


def test_under_a_page_signals_save_the_memory_and_end_it(plc: Plc, monkeypatch: pytest.MonkeyPatch) -> None:
    signals, served, saved = serve.Signals(), list[Any](), list[Any]()
    monkeypatch.setattr(serve, "_save", lambda plc, image: saved.append(image))

    def serve_page(origin: Any, control: Any, options: Any, recording: Any, tick: Callable[[], None]) -> None:
        served.append((origin.built, recording, control.is_paused))
        tick()
        assert saved == [] and not control.has_ended
        signals.save = True
        tick()
        assert saved == [Path("m.json")] and not signals.save and not control.has_ended
        signals.end = True
        tick()
        assert len(saved) == 1 and control.has_ended

    monkeypatch.setattr("fbvm.cli.shared.live.page.serve_page", serve_page)
    with click.Context(serve.command):
        serve._serve_page(plc, (), (), signals, Path("m.json"), {"trace": None})
    [(built, recording, is_paused)] = served
    assert list(built.plcs) == ["server"] and built.plcs["server"].plc is plc and not is_paused
    assert recording == {"trace": None} and [(run.plc, run.scans_left) for run in built.runs] == [(plc, ENDLESS)]
