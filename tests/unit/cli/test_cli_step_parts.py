"""`fbvm step` in parts: which PLC it stands in, what a script and a prompt print and how they end, what of a trace it takes."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click
import pytest
from click.testing import CliRunner
from rows import each_of

from fbvm.cli.shared import status
from fbvm.step.commands import CommandError, ExpectationError

step = import_module("fbvm.cli.running.step")


class Said:
    """Commands that print their line twice; some fail, one ends it."""

    def __init__(self) -> None:
        self.ended, self.ran = False, list[str]()

    def run(self, line: str) -> Iterator[str]:
        self.ran.append(line.strip())
        yield f" >{line.strip()}"
        if line.strip() in ("wrong", "false"):
            raise (ExpectationError if line.strip() == "false" else CommandError)(f"it is {line.strip()}")
        self.ended = line.strip() == "quit"
        yield "more"

    def stop(self) -> Iterator[str]:
        yield from ("scan 0", "stands")


@each_of("script, ran, out, err, ends", [
    ("a\n", ["a"], "> a\n >a\nmore\n", "", None),
    ("  a  \n\n // b\n\t\nc", ["a", "c"], "> a\n >a\nmore\n> c\n >c\nmore\n", "", None),
    ("a\nquit\nb\n", ["a", "quit"], "> a\n >a\nmore\n> quit\n >quit\nmore\n", "", None), ("", [], "", "", None),
    ("wrong\nb\n", ["wrong"], "> wrong\n >wrong\n", "it is wrong\n", status.USAGE),
    ("false\nb\n", ["false"], "> false\n >false\n", "it is false\n", status.FAILED)])
def test_a_script_is_executed_line_by_line_until_one_fails(script: str, ran: list[str], out: str, err: str,
                                                           ends: int | None) -> None:  # fmt: skip
    made, printed = Said(), {False: "", True: ""}

    def say(text: str, err: bool = False, **style: Any) -> None:
        printed[err] += f"{text}\n"

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(step, "say", say)
        patch.setattr(step.sys, "stdin", io.StringIO(script))
        if ends is None:
            step._script(made)
        else:
            with pytest.raises(SystemExit) as ended:
                step._script(made)
            assert ended.value.code == ends
    assert (made.ran, printed) == (ran, {False: out, True: err})


@each_of("most, lines, good", [(5, ["abcd\n", "efgh\n"], True), (5, ["abcde\n"], False), (5, ["abcde"], True),
                               (5, ["abcdef"], False), (5, [], True)])
def test_a_line_of_a_script_has_a_longest_length(most: int, lines: list[str], good: bool) -> None:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(step, "SCRIPT_LINE_CHARACTERS", most)
        patch.setattr(step.sys, "stdin", io.StringIO("".join(lines)))
        if good:
            assert list(step._script_lines()) == lines
        else:
            with pytest.raises(click.UsageError, match="a line of the standard input has more than 5 characters"):
                list(step._script_lines())


def test_a_standard_input_that_cannot_be_read_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(most: int) -> str:
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(step.sys, "stdin", SimpleNamespace(readline=fails))
    with pytest.raises(click.UsageError, match="the standard input cannot be read: input/output error"):
        list(step._script_lines())


def test_at_the_prompt_a_mistake_is_told_in_red_and_quit_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    made, printed = Said(), list[Any]()
    monkeypatch.setattr(step, "say", lambda text, **style: printed.append((text, style)))
    monkeypatch.setattr(step, "prompt_lines", lambda commands: iter(["a", "wrong", "false", "quit", "never"]))
    monkeypatch.setattr(step.sys, "stdin", SimpleNamespace(isatty=lambda: True))
    step._prompt(made)
    bold, plain, red = {"bold": True}, {"bold": None}, {"fg": "red"}
    assert printed == [("scan 0", bold), ("stands", plain), (" >a", bold), ("more", plain), (" >wrong", bold),
                       ("it is wrong", red), (" >false", bold), ("it is false", red), (" >quit", bold), ("more", plain)]
    assert made.ran == ["a", "wrong", "false", "quit"]


def test_from_a_pipe_it_begins_with_where_it_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    made, printed = Said(), list[str]()
    monkeypatch.setattr(step, "say", lambda text, **style: printed.append(text))
    monkeypatch.setattr(step.sys, "stdin", io.StringIO("a\n"))
    step._prompt(made)
    assert printed == ["scan 0", "stands", "> a", " >a", "more"]


# --- a trace ----------------------------------------------------------------------------------------------------------


class Scans:
    """Stands in for a recording of so many scans."""

    def __init__(self, count: int) -> None:
        self.scans, self.texts = range(count), {}


def stepped(monkeypatch: pytest.MonkeyPatch, scans: int, *arguments: str) -> tuple[Any, list[Any]]:
    """The verb on a trace; returns its result and what it was asked."""
    asked: list[Any] = []

    @contextmanager
    def opened(*given: Any) -> Iterator[Scans]:
        asked.append(given)
        yield Scans(scans)

    class Watching(Said):
        def __init__(self, session: Any, report: Any, latest: Any) -> None:
            super().__init__()
            asked.append(latest())

        def run(self, line: str) -> Iterator[str]:
            asked.append(line)
            return super().run(line.removeprefix("watch "))

    session = SimpleNamespace(here=SimpleNamespace(scan=1500), source_plc=SimpleNamespace(image=None))
    for name, made in (("open_trace", opened), ("is_recording", lambda path: True), ("FileScans", Scans), ("Commands", Watching),
                       ("PastSession", lambda source: session), ("StopReport", lambda *given: None),
                       ("source_texts", lambda *given: {}), ("packets", lambda source, scans: [(1, scans)]),
                       ("_prompt", lambda commands: asked.append("prompt"))):  # fmt: skip
        monkeypatch.setattr(step, name, made)
    Path("a.fbtrace").touch()
    return CliRunner().invoke(step.command, ["a.fbtrace", *arguments]), asked


@pytest.mark.parametrize(("arguments", "said"), [
    (["--set", "D0=1"], "--set"), (["--cycle", "10ms", "--seed", "0"], "--cycle, --seed"), (["--timing", "exact"], "--timing"),
    (["--map", "1.2.3.4:502=peer", "--plc", "a"], "--map")])
def test_what_has_happened_already_is_not_changed(arguments: list[str], said: str, tmp_path: Path,
                                                  monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    result, asked = stepped(monkeypatch, 5, *arguments)
    assert (result.exit_code, asked) == (2, [])
    wanted = f"{said}: a trace has happened already; beside it there are --plc, --library, --watch"
    assert wanted in " ".join(result.stderr.split())


def test_a_trace_is_stepped_through_with_its_last_thousand_scans_of_packets(tmp_path: Path,
                                                                            monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    result, asked = stepped(monkeypatch, 5, "--plc", "a", "--watch", "D0", "--watch", "D1 IF D2 > 0")
    assert (result.exit_code, result.output) == (0, "")
    assert asked == [(Path("a.fbtrace"), "a", (), step.Depth.STATEMENTS), [range(500, 1501)], "watch D0", "watch D1 IF D2 > 0",
                     "prompt"]
    result, asked = stepped(monkeypatch, 5, "--watch", "wrong")
    assert result.exit_code == 2 and "it is wrong" in result.stderr and asked[-1] == "watch wrong"
    result, asked = stepped(monkeypatch, 0)
    assert result.exit_code == 2 and "a.fbtrace has no scans yet" in result.stderr and len(asked) == 1
