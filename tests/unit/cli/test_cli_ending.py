"""How the process of the command line ends when it is asked to, and the language server."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import click
import pytest
from rows import each_of

from fbvm.cli.editors import lsp
from fbvm.cli.shared import ending

needs_signals = pytest.mark.skipif(sys.platform == "win32", reason="no SIGTERM to react to")


class Ended(BaseException):
    """Stands in for the end of the process."""


@pytest.fixture
def exits(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[Any]]:
    done: list[Any] = []

    def leave(code: int) -> None:
        done.append(code)
        raise Ended

    monkeypatch.setattr(os, "_exit", leave)
    monkeypatch.setattr(ending, "ignore", lambda numbers: done.append("ignored"))
    monkeypatch.setattr(ending.atexit, "_run_exitfuncs", lambda: done.append("at exit"), raising=False)
    monkeypatch.setattr(sys, "unraisablehook", sys.unraisablehook)
    monkeypatch.setattr(ending, "_is_process", False)
    before = {number: signal.getsignal(number) for number in ending.ending_signals()}
    yield done
    for number, handle in before.items():
        signal.signal(number, handle)


@each_of("error, done, said", [
    (KeyboardInterrupt(), ["ignored", "at exit", 130, "ignored"], "interrupted\n"),
    (SystemExit(130), ["ignored", "at exit", 130, "ignored"], ""),
])
def test_a_process_that_was_interrupted_ends_with_its_status(error: BaseException, done: list[Any], said: str, exits: list[Any],
                                                            capsys: pytest.CaptureFixture[str]) -> None:  # fmt: skip
    def verb() -> None:
        raise error

    exits.clear()
    with pytest.raises(Ended):
        ending.run_process(verb)
    assert exits == done and capsys.readouterr().err == said and ending._is_process


@needs_signals
def test_a_process_that_is_asked_to_end_before_it_has_begun_says_so(exits: list[Any], monkeypatch: pytest.MonkeyPatch,
                                                                    capsys: pytest.CaptureFixture[str]) -> None:  # fmt: skip
    handle = signal.signal

    def answered_at_once(number: signal.Signals, call: Any) -> Any:
        before = handle(number, call)
        signal.raise_signal(number)
        return before

    monkeypatch.setattr(signal, "signal", answered_at_once)
    monkeypatch.setattr(ending, "_asked", signal.SIGINT)
    with pytest.raises(Ended):
        ending.run_process(lambda: exits.append("begun"))
    monkeypatch.undo()
    assert exits == ["ignored", "at exit", 143, "ignored"] and capsys.readouterr().err == "terminated\n"


@each_of("error, code", [(None, None), (SystemExit(3), 3), (SystemExit(0), 0)])
def test_a_process_that_ends_by_itself_keeps_its_status(error: BaseException | None, code: int | None, exits: list[Any]) -> None:
    def verb() -> None:
        if error:
            raise error

    exits.clear()
    with pytest.raises(SystemExit) as ended:
        ending.run_process(verb)
    assert ended.value.code == code and exits == ["ignored"]


def test_ctrl_c_that_python_could_not_let_through_comes_again(exits: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[Any] = []
    hook = told.append
    monkeypatch.setattr(sys, "unraisablehook", hook)
    monkeypatch.setattr(ending.threading, "Timer", lambda *given: SimpleNamespace(start=lambda: told.append(given)))
    with pytest.raises(SystemExit):
        ending.run_process(lambda: None)
    other = SimpleNamespace(exc_value=ValueError("x"))
    sys.unraisablehook(cast(Any, other))
    sys.unraisablehook(cast(Any, SimpleNamespace(exc_value=KeyboardInterrupt())))
    assert told == [other, (0.01, ending.interrupt, [ending.threading.get_ident()])]


@each_of("is_process", [True, False])
def test_imports_are_broken_off_at_once_where_nothing_else_is_done(is_process: bool, exits: list[Any],
                                                                   capsys: pytest.CaptureFixture[str]) -> None:
    exits.clear()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ending, "_is_process", is_process)
        with pytest.raises(Ended if is_process else KeyboardInterrupt), ending.loading():
            signal.raise_signal(signal.SIGINT)
    assert exits == [130] * is_process and capsys.readouterr().err == "interrupted\n" * is_process


def test_signals_that_are_ignored_stay_so(exits: list[Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ending, "_asked", signal.SIGINT)
    assert (ending.exit_status(), ending.sentence(), ending.by_other_than_ctrl_c()) == (130, "interrupted", False)
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        with pytest.raises(KeyboardInterrupt):
            ending._pass_on(signal.SIGTERM, None)
    finally:
        signal.signal(signal.SIGINT, before)
    assert (ending.exit_status(), ending.sentence(), ending.by_other_than_ctrl_c()) == (143, "terminated", True)


def test_the_language_server_speaks_over_a_copy_of_the_output(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    served: list[Any] = []
    wrong: list[Exception] = []

    class Server:
        def __init__(self, version: str) -> None:
            served.append(version)

        def start_io(self, stdout: Any) -> None:
            served.append(stdout)
            stdout.write(b"message")
            if wrong:
                raise wrong[0]

    threshold = gc.get_threshold()
    monkeypatch.setitem(sys.modules, "fbvm.lsp.features", SimpleNamespace(server=Server))
    try:
        with (tmp_path / "out").open("w") as file:
            monkeypatch.setattr(sys, "stdout", file)
            with pytest.raises(SystemExit) as ended:
                lsp.command.callback(stdio=True)  # type: ignore[misc]
            assert ended.value.code == 0 and served[1].closed and not file.closed and gc.get_threshold() == (50_000, 20, 1_000)
            assert (tmp_path / "out").read_bytes() == b"message"
            wrong.append(OverflowError())
            with pytest.raises(click.ClickException, match="a message that is longer than any memory"):
                lsp.command.callback(stdio=False)  # type: ignore[misc]
            monkeypatch.setitem(sys.modules, "fbvm.lsp.features", None)
            with pytest.raises(click.UsageError, match=r"pygls is missing: pip install 'fbvm\[editor\]'"):
                lsp.command.callback(stdio=False)  # type: ignore[misc]
    finally:
        gc.set_threshold(*threshold)
