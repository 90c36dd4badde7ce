"""The debugger as editors start it: over stdin and stdout, and over a connection."""

from __future__ import annotations

import errno
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import pytest

from fbvm.cli.running.dap import open_target
from fbvm.dap.framing import Framer, FramingError, encode
from fbvm.dap.server import DebugDoor, pass_on, serve, serve_until_ended
from fbvm.dap.target import LaunchError, Target
from fbvm.net.streams import Listener, connect

Message = dict[str, Any]
TEXT = "PROGRAM Main\nVAR n : INT; END_VAR\nn := n + 1;\nIF n = 500 THEN n := 0; END_IF\nEND_PROGRAM\n"
FBVM = [sys.executable, "-m", "fbvm"]


class Wire:
    """A client over bytes; `transcript` has what passed."""

    def __init__(self, read: Callable[[], bytes], write: Callable[[bytes], object]) -> None:
        self._read, self._write, self._framer = read, write, Framer()
        self._waiting: Iterator[Message] = iter(())
        self._sequence = 0

    def send(self, command: str, **arguments: Any) -> None:
        self._sequence += 1
        self._write(encode({"seq": self._sequence, "type": "request", "command": command, "arguments": arguments}))

    def next(self) -> Message:
        while True:
            for message in self._waiting:
                return message
            data = self._read()
            assert data, "the adapter has gone"
            self._waiting = self._framer.feed(data)

    def until(self, name: str) -> Message:
        """The next message that is an event or the answer to a command of that name."""
        while True:
            message = self.next()
            if name in (message.get("event"), message.get("command")):
                assert message.get("success", True), message
                return message


def a_session(wire: Wire, file: Path) -> None:
    wire.send("initialize", adapterID="fbvm")
    wire.until("initialized")
    wire.send("launch", program=str(file))
    wire.send("setBreakpoints", source={"path": str(file)}, breakpoints=[{"line": 4, "condition": "n = 400"}])
    assert wire.until("setBreakpoints")["body"]["breakpoints"][0]["verified"]
    wire.send("configurationDone")
    assert wire.until("stopped")["body"]["reason"] == "breakpoint"
    for _ in range(2):
        wire.send("stepBack", threadId=1)
        assert wire.until("stopped")["body"]["reason"] == "step"
    wire.send("evaluate", expression="Main.n")
    assert wire.until("evaluate")["body"]["result"] == "399"
    wire.send("setBreakpoints", source={"path": str(file)}, breakpoints=[])
    wire.send("continue", threadId=1)
    wire.until("continue")
    wire.send("pause", threadId=1)
    assert wire.until("stopped")["body"]["reason"] == "pause"
    wire.send("disconnect")
    wire.until("disconnect")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "count.st"
    path.write_text(TEXT, encoding="utf-8")
    return path


@pytest.mark.slow
def test_over_stdin_and_stdout(file: Path) -> None:
    with subprocess.Popen([*FBVM, "dap"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0) as process:
        assert process.stdin and process.stdout
        output, pipe = process.stdout, process.stdin
        a_session(Wire(lambda: output.read(65536), pipe.write), file)
        assert process.wait(timeout=20) == 0 and output.read() == b""


@pytest.mark.slow
@pytest.mark.parametrize("looks", [False, True])
def test_in_this_process(file: Path, looks: bool) -> None:
    asked, answers = SimpleQueue[bytes](), SimpleQueue[bytes]()
    told: list[tuple[str, bool]] = []
    counts = [0]

    def meanwhile() -> bool:
        counts[0] += 1
        return False

    serving = threading.Thread(target=lambda: told.append(serve_until_ended(
        open_target, asked.get, answers.put, meanwhile if looks else None)))  # fmt: skip
    serving.start()
    wire = Wire(lambda: answers.get(timeout=20), asked.put)
    while looks and counts[0] < 3:  # it looks as long as nobody asks for anything
        time.sleep(0.005)
    a_session(wire, file)
    asked.put(b"")
    serving.join(20)
    assert told == [("", False)] and not serving.is_alive()


@pytest.mark.slow
def test_over_a_connection_and_through_connect(file: Path) -> None:
    with subprocess.Popen([*FBVM, "dap", "--listen", "0"], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout
        port = int(process.stdout.readline().rpartition(":")[2])
        try:
            with connect("127.0.0.1", port) as stream:
                a_session(Wire(stream.receive, stream.send), file)
            with subprocess.Popen([*FBVM, "dap", "--connect", str(port)], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                  bufsize=0) as bridge:  # fmt: skip
                assert bridge.stdin and bridge.stdout
                output, pipe = bridge.stdout, bridge.stdin
                a_session(Wire(lambda: output.read(65536), pipe.write), file)
                pipe.close()
                assert bridge.wait(timeout=20) == 0
        finally:
            process.terminate()


@pytest.mark.slow
def test_garbage_ends_the_adapter_with_a_sentence_and_nothing_on_stdout() -> None:
    head = b"Content-Length: "
    for data in (b"hello\r\n\r\n", head + b"x\r\n\r\n", head + b"5\r\n\r\n{bad}", head + b"99\r\n\r\n{"):
        done = subprocess.run([*FBVM, "dap"], input=data, capture_output=True, timeout=30)
        assert done.stdout == b"" and done.returncode == 2 and b"Traceback" not in done.stderr and done.stderr.strip()


def nothing(how: str, arguments: object) -> Target:
    raise LaunchError("nothing")


def served(*pieces: bytes) -> tuple[str, list[Message]]:
    """What the server says of some bytes, and what it answers."""
    waiting, sent = [*pieces, b""], bytearray()
    said = serve(nothing, lambda: waiting.pop(0), sent.extend)
    return said, list(Framer().feed(bytes(sent)))


def test_a_door_at_which_nobody_waits_ends_nothing() -> None:
    def accept() -> Any:
        raise OSError

    door = DebugDoor(accept)
    assert not door.is_called and door.serve(nothing) is False


def test_messages_may_come_in_any_pieces() -> None:
    whole = encode({"seq": 1, "type": "request", "command": "initialize", "arguments": {"adapterID": "ü"}})
    for cut in range(1, len(whole), 7):
        said, answers = served(whole[:cut], whole[cut:])
        assert said == "" and [row["seq"] for row in answers] == [1, 2]


def test_a_client_that_goes_in_the_middle_of_a_message_is_told_of() -> None:
    assert served(b"Content-Length: 10\r\n\r\n{")[0] == "the client is gone in the middle of a message"
    assert served()[0] == ""


@pytest.mark.parametrize("data", [b"x" * 5000, b"Content-Length: 99999999999\r\n\r\n", b"A: b\r\n\r\n", b"\r\n\r\n",
                                  b"Content-Length: 2\r\n\r\n[]", b"Content-Length: 5000\r\n\r\n" + b"9" * 5000])  # fmt: skip
def test_bytes_that_are_no_messages_are_refused(data: bytes) -> None:
    with pytest.raises(FramingError):
        list(Framer().feed(data))
    assert served(data)[0]


def attached(wire: Wire, file: Path) -> None:
    """A session with a PLC that runs."""
    wire.send("initialize", adapterID="fbvm")
    wire.until("initialized")
    wire.send("attach")
    wire.send("setBreakpoints", source={"path": str(file)}, breakpoints=[{"line": 4, "condition": "n MOD 20 = 0"}])
    wire.send("configurationDone")
    assert wire.until("process")["body"]["startMethod"] == "attach"
    assert wire.until("stopped")["body"]["reason"] == "breakpoint"
    wire.send("setExpression", expression="Main.n", value="7")
    assert wire.until("setExpression")["body"]["value"] == "7"
    for _ in range(3):
        wire.send("next", threadId=1)
        wire.until("stopped")
    for _ in range(2):
        wire.send("fbvm/stepBackScan", threadId=1)
        wire.until("stopped")
    wire.send("setExpression", expression="Main.n", value="1")
    while (answer := wire.next()).get("command") != "setExpression":
        pass
    assert not answer["success"] and "real connections do not travel in time" in answer["message"]
    wire.send("disconnect", terminateDebuggee=True)
    wire.until("disconnect")


@contextmanager
def with_port(*arguments: str) -> Iterator[tuple[subprocess.Popen[str], int]]:
    """A verb with --debug in a process of its own, and its port; it ends by itself, without a traceback."""
    command = [*FBVM, *arguments, "--debug", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr
        said = ""
        while "--connect" not in said:
            said = process.stderr.readline()
        try:
            yield process, int(said.split()[-1])
            assert process.wait(timeout=30) in (0, 130)
        finally:
            process.kill()
        assert "Traceback" not in process.stderr.read()


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [["run", "--net", "loop"], ["run", "--net", "tcp"], ["live"], ["live", "--net", "tcp"]],
                         ids=" ".join)  # fmt: skip
def test_attached_to_a_plc_that_runs(file: Path, arguments: list[str]) -> None:
    if arguments[0] == "live":
        pytest.importorskip("websockets")
    with with_port(*arguments, str(file)) as (_, port), connect("127.0.0.1", port) as stream:
        attached(Wire(stream.receive, stream.send), file)


@pytest.mark.slow
@pytest.mark.parametrize("net", ["loop", "tcp"])
def test_attached_to_all_plcs_of_a_project_and_again_when_it_went_on(file: Path, net: str) -> None:
    (file.parent / "other.st").write_text(TEXT, encoding="utf-8")
    project = file.parent / "fbvm.toml"
    project.write_text('[plc.one]\nsources = ["count.st"]\n[plc.two]\nsources = ["other.st"]\ncycle = "20ms"\n', encoding="utf-8")
    with with_port("run", str(file.parent), "--net", net) as (_, port):
        scans = []
        for last in (False, True):
            with connect("127.0.0.1", port) as stream:
                wire = Wire(stream.receive, stream.send)
                wire.send("initialize", adapterID="fbvm")
                wire.send("attach", plc="two", stopOnEntry=True)
                wire.send("configurationDone")
                wire.until("stopped")
                wire.send("threads")
                names = [row["name"].split(" ")[0] for row in wire.until("threads")["body"]["threads"]]
                assert names == ["two", "one"]
                wire.send("fbvm/stepScan", scans=5, threadId=1)
                wire.until("stopped")
                wire.send("evaluate", expression="Main.n")
                scans.append(int(wire.until("evaluate")["body"]["result"]))
                wire.send("disconnect", terminateDebuggee=last)
                wire.until("disconnect")
        assert scans[0] != scans[1]


@pytest.mark.slow
def test_attached_to_a_server() -> None:
    with with_port("serve", "--port", "0") as (_, port), connect("127.0.0.1", port) as stream:
        wire = Wire(stream.receive, stream.send)
        wire.send("initialize", adapterID="fbvm")
        wire.send("attach")
        wire.send("setFunctionBreakpoints", breakpoints=[{"name": "Main"}])
        wire.send("configurationDone")
        assert wire.until("stopped")["body"]["reason"] == "breakpoint"
        wire.send("evaluate", expression="Main.Server.Sockets")
        assert wire.until("evaluate")["body"]["result"] == "1"
        wire.send("setFunctionBreakpoints", breakpoints=[])
        wire.send("continue", threadId=1)
        wire.until("continue")
        wire.send("disconnect", terminateDebuggee=True)
        wire.until("disconnect")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="sends SIGTERM")
def test_a_server_ends_at_a_signal_while_a_debugger_has_it() -> None:
    with with_port("serve", "--port", "0") as (process, port), connect("127.0.0.1", port) as stream:
        wire = Wire(stream.receive, stream.send)
        wire.send("initialize", adapterID="fbvm")
        wire.send("attach", stopOnEntry=True)
        wire.send("configurationDone")
        wire.until("stopped")
        process.terminate()


def test_a_bridge_whose_editor_is_gone_ends_though_its_connection_is_ended_first() -> None:
    ended = threading.Event()

    def receive() -> bytes:
        assert ended.wait(20)
        raise OSError(errno.EBADF, "Bad file descriptor")

    written = bytearray()
    pass_on(lambda: b"", written.extend, receive, written.extend, ended.set)
    assert written == b""


def test_a_bridge_tells_of_a_connection_that_breaks_while_its_editor_is_there() -> None:
    gone = threading.Event()

    def read() -> bytes:
        gone.wait(20)
        return b""

    def receive() -> bytes:
        raise ConnectionResetError(errno.ECONNRESET, "reset")

    try:
        with pytest.raises(ConnectionResetError):
            pass_on(read, bytearray().extend, receive, bytearray().extend, gone.set)
    finally:
        gone.set()


def test_a_stream_that_is_ended_gives_its_last_bytes_and_then_the_end() -> None:
    listener = Listener("127.0.0.1", 0)
    try:
        with connect("127.0.0.1", listener.port) as stream, listener.accept() as other:
            other.send(b"last")
            assert stream.receive() == b"last"
            stream.end()
            assert stream.receive() == b"" and other.receive() == b""
            stream.end()
    finally:
        listener.close()
