"""How verbs end when somebody stops them."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys

import click
import pytest
from click.testing import CliRunner

from fbvm.cli.main import GROUP_OF, main

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
