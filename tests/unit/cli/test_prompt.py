"""The prompt of `fbvm step`: lines, completion, history, and what Ctrl-C and the end of input do."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from prompt_toolkit.application import create_app_session
from prompt_toolkit.completion import CompleteEvent
from prompt_toolkit.document import Document
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput

from fbvm.cli.shared.prompt import HISTORY, Completions, prompt_lines
from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.step.commands import Commands
from fbvm.step.session import Session
from fbvm.step.stop_report import StopReport

TEXT = "PROGRAM Main\nVAR Count : INT; Delay : TON; END_VAR\n    Count := Count + 1;\n    Delay();\nEND_PROGRAM\n"
CONTROL_C, CONTROL_D = "\x03", "\x04"


def commands() -> Commands:
    image = compile_text(TEXT).image
    assert image is not None
    session = Session.of(lambda: Plc(image))
    return Commands(session, StopReport(session, {}))


def typed(text: str) -> list[str]:
    """The lines that come of some keys."""
    with create_pipe_input() as keys, create_app_session(input=keys, output=DummyOutput()):
        keys.send_text(text + CONTROL_D)
        return list(prompt_lines(commands()))


@pytest.fixture(autouse=True)
def own_history(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("FBVM_CACHE", str(tmp_path))
    return tmp_path / HISTORY


@pytest.mark.slow
def test_lines_until_the_end_of_input() -> None:
    assert typed("step\rprint Main.Count\r") == ["step", "print Main.Count"]


@pytest.mark.slow
def test_control_c_takes_back_a_line() -> None:
    assert typed(f"print Main{CONTROL_C}scan\r") == ["scan"]


@pytest.mark.slow
def test_what_was_typed_is_kept(own_history: Path) -> None:
    assert typed("scan 3\r") == ["scan 3"]
    assert "scan 3" in own_history.read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="rights are others there")
def test_what_was_typed_is_for_its_user_alone(own_history: Path) -> None:
    typed("scan 3\r")
    assert own_history.stat().st_mode & 0o777 == 0o600


@pytest.mark.slow
def test_without_a_place_for_it_there_is_no_history(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("FBVM_CACHE", str(tmp_path / "file" / "in"))
    assert typed("scan\r") == ["scan"]


def test_completion_takes_the_word_before_the_cursor() -> None:
    document = Document("print Main.De")
    [found] = Completions(commands()).get_completions(document, CompleteEvent())
    assert (found.text, found.start_position) == ("Main.Delay", -len("Main.De"))
