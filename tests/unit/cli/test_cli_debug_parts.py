"""Debuggers on the command line: `fbvm dap`, the port at which they attach, what they get of PLCs that run, `fbvm step`."""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from click.testing import CliRunner
from images import counter_image
from rows import each_of

from fbvm.cli.running import dap, step
from fbvm.cli.shared.debug import door
from fbvm.cli.shared.debug.attach import NOTE, literal, open_attached
from fbvm.cli.shared.debug.worlds import DebugSources
from fbvm.code.compiler import compile_text
from fbvm.dap.target import LaunchError
from fbvm.machine.plc import Plc
from fbvm.step.commands import CommandError
from fbvm.step.world import Debugged


class Stream:
    def __init__(self, name: str, done: list[Any]) -> None:
        self.name, self.done = name, done

    def __enter__(self) -> Stream:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def receive(self) -> bytes:
        return b"in"

    def send(self, data: bytes) -> None:
        self.done.append(data)

    def end(self) -> None:
        self.done.append("end")

    def close(self) -> None:
        self.done.append(f"{self.name} closed")


class Listener:
    """Gives the streams that are named, one after the other, and is interrupted then."""

    def __init__(self, done: list[Any], *names: str) -> None:
        self.port, self._done, self._names = 4711, done, list(names)

    def accept(self) -> Stream:
        if not self._names:
            raise KeyboardInterrupt
        return Stream(self._names.pop(0), self._done)

    def close(self) -> None:
        self._done.append("listener closed")


# --- fbvm dap ---------------------------------------------------------------------------------------------------------


def test_editors_are_served_one_after_the_other(monkeypatch: pytest.MonkeyPatch) -> None:
    done: list[Any] = []
    answers = ["", "this is no message"]
    monkeypatch.setattr(dap, "Listener", lambda bind, port: done.append((bind, port)) or Listener(done, "one", "two"))

    def serving(opener: Any, read: Callable[[], bytes], write: Callable[[bytes], None]) -> str:
        assert opener is dap.open_target
        write(read() + b"out")
        return answers.pop(0)

    monkeypatch.setattr(dap, "serve", serving)
    result = CliRunner().invoke(dap.command, ["--listen", "0", "--bind", "0.0.0.0"])
    assert result.exit_code == 1, "Ctrl-C, of which the command line makes 130"
    assert result.stdout == "the debugger listens at 0.0.0.0:4711\n" and result.stderr.splitlines()[0] == "this is no message"
    assert done == [("0.0.0.0", 0), b"inout", "one closed", b"inout", "two closed", "listener closed"]


@each_of("address, where", [("4711", ("127.0.0.1", 4711)), ("plc:4711", ("plc", 4711)), (":9", ("127.0.0.1", 9))])
def test_what_runs_is_reached_and_bytes_are_passed_on(address: str, where: tuple[str, int]) -> None:
    done: list[Any] = []
    stream = Stream("stream", done)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dap, "connect", lambda host, port: done.append((host, port)) or stream)
        patch.setattr(dap, "pass_on", lambda *ways: done.append(ways))
        assert CliRunner().invoke(dap.command, ["--connect", address]).exit_code == 0
    assert done == [where, (dap._read, dap._write, stream.receive, stream.send, stream.end), "stream closed"]


def test_an_editor_is_served_over_the_standard_streams(monkeypatch: pytest.MonkeyPatch) -> None:
    served: list[Any] = []
    monkeypatch.setattr(dap, "serve", lambda *ways: served.append(ways) or "")
    assert CliRunner().invoke(dap.command, []).exit_code == 0 and served == [(dap.open_target, dap._read, dap._write)]
    monkeypatch.setattr(dap, "serve", lambda *ways: "the client is gone in the middle of a message")
    result = CliRunner().invoke(dap.command, [])
    assert (result.exit_code, result.stderr) == (2, "the client is gone in the middle of a message\n")
    result = CliRunner().invoke(dap.command, ["--listen", "0", "--connect", "1"])
    assert result.exit_code == 2 and "--listen or --connect, not both" in result.stderr


@each_of("error, said", [(OSError(111, "Connection refused"), "Connection refused"), (OSError("no such host"), "no such host")])
def test_a_network_that_cannot_be_used_is_told(error: OSError, said: str) -> None:
    def fails(*_: object) -> None:
        raise error

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(dap, "connect", fails)
        patch.setattr(dap, "Listener", fails)
        for option in ("--connect", "--listen"):
            result = CliRunner().invoke(dap.command, [option, "4711"])
            assert (result.exit_code, result.stderr) == (5, f"the network cannot be used: {said}\n")


def test_bytes_are_read_from_the_descriptor_and_written_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []
    monkeypatch.setattr(os, "read", lambda number, most: asked.append((number, most)) or b"some")
    assert dap._read() == b"some" and asked == [(0, 65536)]
    raw = io.BytesIO()
    monkeypatch.setattr("sys.stdout", SimpleNamespace(buffer=io.BufferedWriter(cast(Any, raw), 4096)))
    dap._write(b"message")
    assert raw.getvalue() == b"message"


def test_a_debugger_that_is_not_connected_launches(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dap, "open_launch", lambda arguments: ("target", arguments))
    assert dap.open_target("launch", {"program": "a.st"}) == cast(Any, ("target", {"program": "a.st"}))
    with pytest.raises(LaunchError, match="attach: start `fbvm dap --connect PORT` as the adapter of a program that runs"):
        dap.open_target("attach", {})


# --- the port of debuggers --------------------------------------------------------------------------------------------


def test_a_debugger_that_attaches_gets_the_plcs_of_now(monkeypatch: pytest.MonkeyPatch,
                                                       capsys: pytest.CaptureFixture[str]) -> None:  # fmt: skip
    done: list[Any] = []
    serving: list[Any] = []
    listener = Listener(done, "one")

    class Door:
        is_called = True

        def __init__(self, accept: Callable[[], Any]) -> None:
            self.accept = accept

        def serve(self, opened: Any, meanwhile: Any) -> bool:
            serving.append((self, opened, meanwhile))
            return True

    monkeypatch.setattr(door, "Listener", lambda host, port: done.append((host, port)) or listener)
    monkeypatch.setattr(door, "DebugDoor", Door)
    monkeypatch.setattr(door, "open_attached", lambda *given: given)
    port = door.DebugPort(0, DebugSources({"a.st": Path("a.st")}, {"a.st": "text"}))
    assert capsys.readouterr().err == "a debugger can attach: fbvm dap --connect 4711\n" and done == [("127.0.0.1", 0)]

    def look() -> bool:
        return False

    assert port.is_called and port.serve(lambda: [cast(Any, "plc")], look) is True
    [(made, opened, meanwhile)] = serving
    assert opened("attach", {"plc": "a"}) == (["plc"], {"a.st": Path("a.st")}, {"a.st": "text"}, {"plc": "a"})
    assert meanwhile is look
    with pytest.raises(LaunchError, match="this runs already: attach to it"):
        opened("launch", {})
    receive, send, close = made.accept()
    send(b"out")
    close()
    assert receive() == b"in" and done[1:] == [b"out", "one closed"]
    port.close()
    assert done[-1] == "listener closed"


def test_a_port_that_somebody_has_ends_the_verb(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    def taken(host: str, port: int) -> None:
        raise OSError(98, "Address already in use")

    monkeypatch.setattr(door, "Listener", taken)
    with pytest.raises(SystemExit) as ended:
        door.DebugPort(4711, DebugSources({}, {}))
    assert ended.value.code == 5
    assert capsys.readouterr().err == "the debugger cannot listen at 127.0.0.1:4711: Address already in use\n"


class Called:
    """A port at which debuggers call as they are told: after each of these runs, and what they want then."""

    def __init__(self, *wants_end: bool | None) -> None:
        self.answers, self.is_called, self.debugged, self.is_closed = list(wants_end), False, list[Any](), False

    def serve(self, debugged: Callable[[], list[Debugged]]) -> bool:
        self.debugged.append([(each.name, each.writes) for each in debugged()])
        self.is_called = False
        return bool(self.answers.pop(0))

    def close(self) -> None:
        self.is_closed = True


@each_of("calls, reasons, resumed, ended", [
    ((), ["", ""], [False], ["", ""]), ((True,), ["", "trap"], [False], ["interrupted", "trap"]),
    ((False,), ["", "trap"], [False, True], ["", "trap"]), ((False, True), ["", ""], [False, True], ["interrupted"] * 2),
    ((None,), ["", "time"], [False], ["interrupted", "time"]), ((True,), ["time", "time"], [], ["time", "time"]),
])
def test_debuggers_may_call_while_plcs_run(calls: tuple[bool | None, ...], reasons: list[str], resumed: list[bool],
                                           ended: list[str]) -> None:  # fmt: skip
    port, passes, back = Called(*calls), list[Any](), list[str]()
    rows = {name: cast(Any, SimpleNamespace(plc=name, writes=(name,), reason=reason, resume=lambda name=name: back.append(name)))
            for name, reason in zip("ab", reasons, strict=True)}  # fmt: skip

    def run_all(runs: list[Any], progress: Any, until: Callable[[], bool], *, resumed: bool) -> None:
        passes.append(resumed)
        assert runs == [*rows.values()] and progress is print and until() is port.is_called
        if port.answers[:1] == [None]:
            raise KeyboardInterrupt
        port.is_called = bool(port.answers)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(door, "run_all", run_all)
        door.run_with_port(rows, cast(Any, port), print)
    assert passes == resumed and [run.reason for run in rows.values()] == ended and port.is_closed
    served = len(calls) * (None not in calls) * bool(passes)
    assert port.debugged == [[("a", ("a",)), ("b", ("b",))]] * served and back == ["a", "b"] * served


@pytest.fixture
def plants() -> list[Debugged]:
    image = compile_text("PROGRAM Main VAR n : INT; b : BOOL; END_VAR n := n + 1; END_PROGRAM").image
    assert image is not None
    return [Debugged(name, Plc(image)) for name in ("pump", "tank")]


def test_forces_of_a_debugger_go_with_it_and_those_of_others_stay(plants: list[Debugged]) -> None:
    pump, tank = (each.plc for each in plants)
    tank.force("Main.b", True)
    target = open_attached(plants, {}, {}, {"plc": "tank", "force": {"Main.n": 41, "Main.b": False}, "stopOnEntry": True})
    assert list(target.sessions) == ["tank", "pump"] and target.stop_on_entry and target.notes == [NOTE]
    assert set(tank.forces) == {"Main.n", "Main.b"} and not pump.forces
    assert (tank.read("Main.n"), tank.read("Main.b")) == (41, False)
    target.sessions["pump"].act(lambda plc: plc.force("Main.b", True))
    target.close()
    assert set(tank.forces) == {"Main.b"} and set(pump.forces) == set()
    kept = open_attached(plants, {}, {}, {"force": {"Main.n": 5}, "keepForces": True})
    assert list(kept.sessions) == ["pump", "tank"] and not kept.stop_on_entry
    kept.close()
    assert set(pump.forces) == {"Main.n"}


@each_of("force", [{"Main.m": 1}, {"Main.n": 40000}, {"Main.b": 7}, {"Main.n": "x"}])
def test_a_force_that_does_not_fit_is_refused(force: dict[str, object]) -> None:
    plc = Plc(counter_image())
    with pytest.raises(LaunchError):
        open_attached([Debugged("plc", plc)], {}, {}, {"force": force})


def test_values_of_json_are_written_as_programs_write_them() -> None:
    assert [literal(value) for value in (True, False, 5, 1.5, "T#2s", "yes")] == ["TRUE", "FALSE", "5", "1.5", "T#2s", "yes"]


# --- fbvm step --------------------------------------------------------------------------------------------------------


class Commands:
    """Commands of a session: what they say, and which is wrong."""

    def __init__(self) -> None:
        self.ended, self.done = False, list[str]()

    def stop(self) -> list[str]:
        return ["scan 0", " > 3 | n := n + 1;", "n = 0"]

    def run(self, line: str) -> list[str]:
        self.done.append(line)
        self.ended = line == "quit"
        if line == "jump":
            raise CommandError("there is no command jump")
        return [f"done: {line}"]


@each_of("lines, done", [(["scan", "jump", "scan", "quit", "scan"], ["scan", "jump", "scan", "quit"]), (["scan"], ["scan"])])
def test_what_is_typed_is_executed_until_the_end(lines: list[str], done: list[str]) -> None:
    commands, said = Commands(), list[tuple[str, dict[str, Any]]]()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(step, "prompt_lines", lambda given: iter(lines))
        patch.setattr(step, "say", lambda text, **style: said.append((text, style)))
        patch.setattr("sys.stdin", SimpleNamespace(isatty=lambda: True))
        step._prompt(cast(Any, commands))
    assert commands.done == done
    assert said[:4] == [("scan 0", {"bold": True}), (" > 3 | n := n + 1;", {"bold": True}), ("n = 0", {"bold": None}),
                        ("done: scan", {"bold": None})]  # fmt: skip
    assert [text for text, style in said if style.get("fg") == "red"] == ["there is no command jump"] * ("jump" in lines)


@each_of("is_terminal", [True, False])
def test_a_terminal_is_asked_and_a_pipe_is_read(is_terminal: bool) -> None:
    called: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(step, "_interact", lambda commands: called.append("interact"))
        patch.setattr(step, "_script", lambda commands: called.append("script"))
        patch.setattr("sys.stdin", SimpleNamespace(isatty=lambda: is_terminal))
        step._prompt(cast(Any, Commands()))
    assert called == ["interact" if is_terminal else "script"]


@pytest.mark.slow
def test_a_program_that_cannot_run_is_not_stepped(tmp_path: Path) -> None:
    file = tmp_path / "none.st"
    file.write_text("FUNCTION F : INT F := 1; END_FUNCTION", encoding="utf-8")
    result = CliRunner().invoke(step.command, [str(file)], input="")
    assert result.exit_code == 3 and "S0209" in result.stderr
    (tmp_path / "fbvm.toml").write_text("[plc.a]\n", encoding="utf-8")
    result = CliRunner().invoke(step.command, [str(tmp_path)], input="")
    assert result.exit_code == 3 and "P0104" in result.stderr
    (tmp_path / "fbvm.toml").write_text('[plc.a]\nsources = ["none.st"]\n', encoding="utf-8")
    result = CliRunner().invoke(step.command, [str(tmp_path)], input="")
    assert result.exit_code == 3 and "S0209" in result.stderr


def test_what_is_given_with_a_trace_is_about_its_past(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    given: list[Any] = []
    monkeypatch.setattr(step, "is_recording", lambda path: path.suffix == ".fbtrace")
    monkeypatch.setattr(step, "_past", lambda *what: given.append(what))
    trace = tmp_path / "t.fbtrace"
    trace.write_bytes(b"FBVMREC")
    assert CliRunner().invoke(step.command, [str(trace), "--plc", "a", "--watch", "D0"]).exit_code == 0
    assert given == [(trace, "a", (), ("D0",))]
    monkeypatch.undo()
    monkeypatch.setattr(step, "is_recording", lambda path: True)
    result = CliRunner().invoke(step.command, [str(trace), "--seed", "3", "--set", "Main.n=1"])
    assert result.exit_code == 2 and "a trace has happened already" in result.stderr
    assert "--set, --seed: a trace" in " ".join(result.stderr.split())


def test_a_write_behind_the_first_scan_is_refused() -> None:
    with pytest.raises(ValueError, match="here values are written before the first scan only"):
        step._write(cast(Any, None), cast(Any, SimpleNamespace(time="10ms")))
