"""How verbs end when somebody stops them."""

from __future__ import annotations

import errno
import os
import signal
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import click
import pytest
from click.testing import CliRunner
from depth import times

from fbvm.base.data import data_folder
from fbvm.base.host import handling, interrupt_held
from fbvm.cli.main import GROUP_OF, main
from fbvm.cli.shared import ending

needs_signals = pytest.mark.skipif(sys.platform == "win32", reason="no SIGTERM to react to")


@pytest.mark.slow
@needs_signals
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_peer_ends_cleanly_also_in_the_middle_of_a_connection(number: int) -> None:
    command = [sys.executable, "-m", "fbvm", "peer", "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            port = int(process.stdout.readline().rpartition(":")[2])
            with socket.create_connection(("127.0.0.1", port)):
                process.send_signal(number)
                said, wrong = process.communicate(timeout=20)
        finally:
            process.kill()
    assert (process.returncode, said, wrong) == (0, "", "")


@pytest.mark.parametrize("verb", GROUP_OF)
def test_ctrl_c_has_its_status_in_each_verb(verb: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(ctx: click.Context) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(click.Command, "invoke", lambda self, ctx: interrupted(ctx))
    arguments = [__file__] if verb in ("run", "replay", "check", "list") else []
    result = CliRunner().invoke(main, [verb, *arguments])
    assert (result.exit_code, result.stderr) == (130, "interrupted\n")


# --- all verbs, all signals -------------------------------------------------------------------------------------------

FOREVER = ["--for", "100000000s"]
DEMO = str(data_folder("examples") / "demo.st")
PEER = ["--map", "192.168.250.1:502=peer"]
VERBS: dict[str, list[list[str]]] = {
    "check": [["big.st"]], "fmt": [["big.st", "--check"]], "list": [["big.st"]], "export": [["big.st", "-o", "out.xml"]],
    "import": [["big.xml", "-o", "sources", "--force"]], "ladder": [[str(data_folder("examples") / "ladder.st")]],
    "sfc": [[str(data_folder("examples") / "sfc.st")]], "explain": [[]],
    "diff": [["big.st", str(data_folder("examples") / "ladder.st")]],
    "run": [[DEMO, *PEER, *FOREVER, "--trace", "r.fbtrace", "--journal", "r.journal", "--pcap", "r.pcapng"],
            [DEMO, *FOREVER, "--engine", "python", "--html", "r.html"], [DEMO, *FOREVER, "--net", "tcp"],
            ["big.st", *FOREVER, "--engine", "native", "--no-cache"]],
    "replay": [["long.journal"]], "step": [[DEMO]], "dap": [["--listen", "0"]], "map": [[]],
    "serve": [["--port", "0", "--image", "served"]],
    "live": [[DEMO]],
    "peer": [["--port", "0"]], "demo": [[]], "new": [["project", ]], "test": [["tests"]], "learn": [["1"]],
    "mutate": [["--tests", "tests"]],
    "campaign": [[DEMO, *PEER, "--faults", "1", "--runs", "1000000", "--for", "100s", "--jobs", "2"]],
    "fleet": [["fleet", *FOREVER, "--jobs", "2"]],
    "sweep": [[DEMO, *PEER, "--vary", "Main.Quantity=1..120", "--for", "10000s", "--jobs", "2"]],
    "chart": [["long.fbtrace"]], "table": [["long.fbtrace", "Main.Step"]], "why": [["Main.Step", "long.fbtrace"]],
    "lsp": [[]],
    "prove": [["big.st", "--always", "Main.b0.a <> 4711", "--budget", "100s", "--scans", "100000"]],
    "convert": [["long.fbtrace", "out.html"], ["long.fbtrace", "out.csv"]],
}  # fmt: skip
"""Arguments with which each verb has something to do for a while."""
GOOD_AT_THE_END = {"serve", "peer", "dap", "live", "fleet"}
"""Verbs that are ended by a signal always, which is no failure."""
MOMENTS_S = (0.0, 0.08, 0.25, 0.7)
"""How long after the process listens to signals one comes."""


def prepare(folder: Path) -> None:
    """Sources, traces, journals and tests that keep verbs busy."""
    body = "a := a + 1;\nIF a > b THEN b := a / 3; END_IF\n" * 40
    block = f"FUNCTION_BLOCK B{{0}}\nVAR a, b : DINT; END_VAR\n{body}END_FUNCTION_BLOCK\n"
    blocks = "".join(block.format(number) for number in range(40))
    instances = " ".join(f"b{number} : B{number};" for number in range(40))
    calls = " ".join(f"b{number}();" for number in range(40))
    (folder / "big.st").write_text(f"{blocks}PROGRAM Main\nVAR {instances} END_VAR\n{calls}\nEND_PROGRAM\n")
    (folder / "fleet").mkdir()
    (folder / "fleet" / "fbvm.toml").write_text('[plc.a]\nsources = ["a.st"]\ncount = 2\n')
    (folder / "fleet" / "a.st").write_text("PROGRAM Main\nEND_PROGRAM\n")
    (folder / "tests").mkdir()
    (folder / "tests" / "test_long.py").write_text("import time\n\ndef test_long():\n    time.sleep(60)\n")
    long = ["--journal", str(folder / "long.journal"), "--trace", str(folder / "long.fbtrace"), "--depth", "statements"]
    assert CliRunner().invoke(main, ["run", DEMO, *PEER, "--scans", "6000", *long]).exit_code == 0
    assert CliRunner().invoke(main, ["export", str(folder / "big.st"), "-o", str(folder / "big.xml")]).exit_code == 0


def listens(process: subprocess.Popen[bytes]) -> bool:
    """True as soon as a process has a handler of SIGTERM."""
    try:
        lines = Path(f"/proc/{process.pid}/status").read_text().splitlines()
    except OSError:
        return True
    caught = next((int(line.split()[1], 16) for line in lines if line.startswith("SigCgt")), 0)
    return bool(caught >> (signal.SIGTERM - 1) & 1)


def ended(folder: Path, arguments: list[str], number: signal.Signals, moment_s: float) -> tuple[int | None, str]:
    """The status and the messages of a verb that gets a signal; None if it has ended by itself before."""
    folder.mkdir()
    for shared in (folder.parent / "shared").iterdir():
        (folder / shared.name).symlink_to(shared)
    command = [sys.executable, "-m", "fbvm", *arguments]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, cwd=folder, stdin=pipe, stdout=subprocess.DEVNULL, stderr=pipe) as process:
        assert process.stdin is not None
        try:
            if arguments[0] == "step":
                process.stdin.write(b"run 100000s\n")
                process.stdin.flush()
            while process.poll() is None and not listens(process):
                time.sleep(0.002)
            try:
                process.wait(timeout=moment_s)
            except subprocess.TimeoutExpired:
                process.send_signal(number)
            _, said = process.communicate(timeout=30)
        finally:
            process.kill()
    return process.returncode, said.decode()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="asks /proc whether the process listens")
def test_every_verb_ends_at_every_signal(tmp_path: Path) -> None:
    """With the status of the signal and a sentence, without a traceback, and with whole files or none."""
    (tmp_path / "shared").mkdir()
    prepare(tmp_path / "shared")
    assert set(VERBS) == set(GROUP_OF)
    cases = [([verb, *arguments], number, moment_s)
             for row, (verb, each) in enumerate(VERBS.items()) for column, arguments in enumerate(each)
             for line, number in enumerate((signal.SIGINT, signal.SIGTERM))
             for more in range(times(1, len(MOMENTS_S)))
             for moment_s in [MOMENTS_S[(row + column + 2 * line + more) % len(MOMENTS_S)]]]  # fmt: skip
    folders = [tmp_path / str(number) for number in range(len(cases))]
    with ThreadPoolExecutor(3) as pool:
        results = list(pool.map(lambda folder, case: ended(folder, *case), folders, cases))
    wrong = []
    for folder, (arguments, number, moment_s), (status, said) in zip(folders, cases, results, strict=True):
        words = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}
        by_signal = status == 128 + number and said.splitlines()[-1:] == [words[number]]
        by_itself = status == 0 and (arguments[0] in GOOD_AT_THE_END or arguments[0] not in ("run", "step", "test"))
        parts = [path.name for path in folder.iterdir() if ".part" in path.name]
        if not (by_signal or by_itself) or "Traceback" in said or "ignored" in said or parts:
            wrong.append((arguments, number.name, moment_s, status, said, parts))
        for written, verb in (("r.fbtrace", ["chart", "r.fbtrace"]), ("r.journal", ["replay", "r.journal"])):
            if (folder / written).exists() and (folder / written).stat().st_size:
                with pytest.MonkeyPatch.context() as patch:
                    patch.chdir(folder)
                    read = CliRunner().invoke(main, verb)
                if read.exit_code not in (0, 2) or read.exit_code == 2 and "no scans yet" not in read.stderr:
                    wrong.append((verb, number.name, moment_s, read.exit_code, read.stderr, []))
    assert wrong == []


@pytest.mark.slow
@needs_signals
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_language_server_ends_at_a_signal_while_its_editor_says_nothing(number: signal.Signals) -> None:
    text = b'{"jsonrpc":"2.0","id":1,"method":"initialize","params":{"processId":null,"rootUri":null,"capabilities":{}}}'
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-m", "fbvm", "lsp"], stdin=pipe, stdout=pipe, stderr=pipe) as process:
        try:
            assert process.stdin and process.stdout and process.stderr
            process.stdin.write(b"Content-Length: %d\r\n\r\n%s" % (len(text), text))
            process.stdin.flush()
            length = int(process.stdout.readline().split(b":")[1])
            while process.stdout.readline().strip():
                pass
            assert len(process.stdout.read(length)) == length
            time.sleep(0.3)  # the server listens again
            process.send_signal(number)
            assert process.wait(timeout=20) == 128 + number
            assert process.stderr.read().decode().splitlines()[-1:] == [
                "interrupted" if number == signal.SIGINT else "terminated"]  # fmt: skip
        finally:
            process.kill()


def test_other_signals_do_what_ctrl_c_does(monkeypatch: pytest.MonkeyPatch) -> None:
    def terminated(ctx: click.Context) -> None:
        signal.raise_signal(signal.SIGTERM)

    monkeypatch.setattr(click.Command, "invoke", lambda self, ctx: terminated(ctx))
    result = CliRunner().invoke(main, ["explain"])
    assert (result.exit_code, result.stderr) == (143, "terminated\n")
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_what_is_held_is_not_left_half_done() -> None:
    done = []
    with pytest.raises(KeyboardInterrupt), interrupt_held():
        signal.raise_signal(signal.SIGINT)
        done.append(1)
    assert done == [1]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@needs_signals
def test_sigterm_is_named_also_while_the_signals_are_being_taken_over_one_by_one(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """`loading` takes SIGINT before SIGTERM: between the two SIGTERM is passed on as a Ctrl-C to it."""
    ended: list[int] = []
    monkeypatch.setattr(ending.os, "_exit", ended.append)
    with ending.heard(), handling([signal.SIGINT], ending._end_at_once):
        signal.raise_signal(signal.SIGTERM)
    assert (ended, capsys.readouterr().err) == ([143], "terminated\n")


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="the system has no SIGHUP")
@pytest.mark.parametrize("interrupts", [True, False])
def test_a_verb_whose_terminal_has_gone_ends_with_the_status_of_that(interrupts: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing can be written to it, neither what the verb prints at the end nor that it has gone."""
    def gone(*_: object, **__: object) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    def hung_up(ctx: click.Context) -> None:
        try:
            signal.raise_signal(signal.SIGHUP)
        finally:
            if not interrupts:
                gone()  # takes the place of the KeyboardInterrupt

    monkeypatch.setattr(click.Group, "invoke", lambda self, ctx: hung_up(ctx))
    monkeypatch.setattr("fbvm.cli.main.say", gone)
    monkeypatch.setattr("fbvm.cli.main.give_up_output", lambda: None)
    with pytest.raises(SystemExit) as end:
        main.main(["list"])
    assert end.value.code == 128 + signal.SIGHUP
