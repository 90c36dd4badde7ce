"""Sources that change on disk while their program runs."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
from browsers import Page

from fbvm.code.compiler import compile_files
from fbvm.live.changes import ProgramFiles, SourceChanges

GOOD = "PROGRAM Main VAR n : INT; END_VAR\nn := n + 1;\nEND_PROGRAM\n"


class Edited:
    """A file with a program, and what is known about its changes."""

    def __init__(self, file: Path) -> None:
        self.file, self._time_ns = file, 0
        self.save(GOOD)
        self.changes = SourceChanges([file], lambda: [ProgramFiles(lambda: [file])],
                                     lambda: compile_files([file], runnable=True).errors)  # fmt: skip

    def save(self, text: str) -> None:
        self.file.write_text(text)
        self._time_ns += 1_000_000_000
        os.utime(self.file, ns=(self._time_ns, self._time_ns))

    def state(self) -> dict[str, Any] | None:
        """What is told after two looks and a whole check."""
        self.changes.look()
        self.changes.look()
        for _ in range(1000):
            self.changes.step()
        return self.changes.state


@pytest.fixture
def edited(tmp_path: Path) -> Edited:
    return Edited(tmp_path / "pump.st")


def test_a_file_that_is_as_it_was_tells_nothing(edited: Edited) -> None:
    assert edited.state() is None


def test_a_changed_program_can_be_begun(edited: Edited) -> None:
    edited.save(GOOD.replace("n + 1", "n + 2"))
    edited.changes.look()
    edited.changes.look()
    assert edited.changes.state == {"files": ["pump.st"], "ready": False, "mistakes": []} and not edited.changes.compile()
    assert edited.state() == {"files": ["pump.st"], "ready": True, "mistakes": []}
    assert edited.changes.compile()


def test_a_file_that_is_still_written_waits_until_it_stays(edited: Edited) -> None:
    edited.save(GOOD + "(* ")
    edited.changes.look()
    assert edited.changes.state is None
    edited.save(GOOD + "(* more *)")
    edited.changes.look()
    assert edited.changes.state is None
    assert edited.state() == {"files": ["pump.st"], "ready": True, "mistakes": []}


def test_errors_are_told_with_their_lines_and_the_program_cannot_be_begun(edited: Edited) -> None:
    edited.save(GOOD.replace("n := n + 1;", "n := m + 1;"))
    state = edited.state()
    assert state is not None and not state["ready"]
    assert [(row["file"], row["line"], row["text"]) for row in state["mistakes"]] == [("pump.st", 2, "n := m + 1;")]
    assert "m" in state["mistakes"][0]["message"] and not edited.changes.compile()


def test_what_only_a_whole_compilation_finds_refuses_the_restart(edited: Edited) -> None:
    edited.save("FUNCTION f : INT\nf := 1;\nEND_FUNCTION\n")
    edited.state()
    assert not edited.changes.compile()
    assert edited.changes.state is not None and edited.changes.state["mistakes"][0]["code"] == "S0209"


def test_a_file_that_is_gone_is_an_error_and_one_that_comes_back_is_none(edited: Edited) -> None:
    edited.file.unlink()
    state = edited.state()
    assert state is not None and not state["ready"] and len(state["mistakes"]) == 1
    edited._time_ns = 0
    edited.save(GOOD)
    assert edited.state() is None


def test_pages_are_told_and_a_restart_ends_the_run(edited: Edited) -> None:
    page = Page(changes=edited.changes)
    page.done("hello", version=1)
    assert page.update()["change"] is None
    edited.save(GOOD + "\n")
    edited.state()
    assert page.update()["change"]["ready"]
    page.done("restart")
    assert page.bench.wants_restart and page.control.has_ended


def test_a_page_that_may_only_look_does_not_restart(edited: Edited) -> None:
    page = Page(changes=edited.changes, read_only=True)
    assert "only look" in page.ask("restart")["error"]


def test_so_many_mistakes_are_told_and_no_more(edited: Edited) -> None:
    rows = [f"n := missing{number};" for number in range(60)]
    edited.save("\n".join(["PROGRAM Main VAR n : INT; END_VAR", *rows, "END_PROGRAM\n"]))
    state = edited.state()
    assert state is not None and [row["line"] for row in state["mistakes"]] == list(range(2, 52)) and not state["ready"]
