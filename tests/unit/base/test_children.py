"""A process ends with the `with` block that has started it, whatever comes in between."""

from __future__ import annotations

import signal
import subprocess
import sys
from typing import Any

import pytest

from fbvm.base.children import child
from fbvm.testing.pytest_process import run_pytest

WAITING = [sys.executable, "-S", "-c", "input()"]


def test_ctrl_c_while_a_process_is_being_started_leaves_none_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    """Python hears the signal when the process is there and `Popen` has not returned yet, so that nobody knows the process."""
    made = []
    popen = subprocess.Popen

    def interrupted(*arguments: Any, **options: Any) -> subprocess.Popen[bytes]:
        made.append(popen(WAITING, stdin=subprocess.PIPE))
        signal.raise_signal(signal.SIGINT)
        return made[-1]

    monkeypatch.setattr(subprocess, "Popen", interrupted)
    for start in (lambda: child(WAITING).__enter__(), lambda: run_pytest(["--version"])):
        with pytest.raises(KeyboardInterrupt):
            start()
        assert made[-1].returncode is not None, "it goes on for ever"
    assert len(made) == 2


def test_what_is_left_in_a_pipe_is_no_error() -> None:
    with child(WAITING, stdin=subprocess.PIPE) as process:
        process.stdin.write(b"x" * 10)
        process.kill()
        process.wait()
    assert process.stdin.closed


def test_a_program_that_is_not_there_is_an_error_of_the_system() -> None:
    with pytest.raises(OSError, match="no-such-program"), child(["no-such-program"]):
        pass
