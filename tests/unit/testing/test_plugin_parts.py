"""Parts of the test plugin without a session: what workers hand over, summaries, cells of a class, golden folders, changes."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
from images import counter_image
from rows import each_of

from fbvm.machine.plc import Plc
from fbvm.record.trace.recorder import Recorder
from fbvm.testing import coverage_plugin, golden, warning_plugin
from fbvm.testing.course.class_report import _cell
from fbvm.testing.course.lessons import Lesson, Result
from fbvm.testing.coverage_plugin import CoveragePlugin
from fbvm.testing.rig import Rig
from fbvm.testing.warning_plugin import WarningPlugin

TEXT = "FUNCTION_BLOCK Lamp\nVAR_INPUT on : BOOL; END_VAR\nVAR_OUTPUT q : BOOL; END_VAR\n    q := on;\nEND_FUNCTION_BLOCK\n"


class Reporter:
    """Takes what a summary writes."""

    def __init__(self) -> None:
        self.said: list[str] = []

    def section(self, title: str) -> None:
        self.said.append(f"== {title}")

    def line(self, text: str) -> None:
        self.said.append(text)


def config(**options: str) -> Any:
    return SimpleNamespace(rootpath=Path.cwd(), getoption=lambda name: options.get(name, []), getini=lambda name: [])


def test_without_coverage_the_summary_says_so() -> None:
    plugin, reporter = CoveragePlugin(config()), Reporter()
    plugin.pytest_terminal_summary(cast(Any, reporter))
    assert reporter.said == ["== coverage of PLC code", "nothing was executed"]


def test_a_worker_hands_over_its_coverage_and_its_warnings() -> None:
    plugins: list[tuple[Any, str]] = [(CoveragePlugin(config()), coverage_plugin.NAME),
                                      (WarningPlugin(config()), warning_plugin.NAME)]
    for plugin, name in plugins:
        worker, alone = SimpleNamespace(workeroutput={}), SimpleNamespace()
        plugin.pytest_sessionfinish(cast(Any, SimpleNamespace(config=worker)))
        plugin.pytest_sessionfinish(cast(Any, SimpleNamespace(config=alone)))
        assert list(worker.workeroutput) == [name] and not hasattr(alone, "workeroutput")


def test_warnings_of_all_workers_are_told_once_in_order() -> None:
    plugin, reporter = WarningPlugin(config()), Reporter()
    plugin.pytest_terminal_summary(cast(Any, reporter))
    assert reporter.said == []
    for rows in (["b"], ["a", "b"]):
        plugin.pytest_testnodedown(SimpleNamespace(workeroutput={warning_plugin.NAME: rows}), None)
    plugin.pytest_testnodedown(SimpleNamespace(), None)
    plugin.pytest_terminal_summary(cast(Any, reporter))
    assert reporter.said == ["== warnings of PLC code", "a", "b"]


@each_of("result, cell", [
    (None, '<td class="none">-'), (Result(True, 3, 3), '<td class="good">✓ 3/3'), (Result(False, 3, 3), '<td class="good">✗ 3/3'),
    (Result(True, 2, 3, [("t", "w")]), '<td class="bad"><a href="#Ann-4">✓ 2/3</a>'),
    (Result(False, 3, 3, [("t", "w")]), '<td class="bad"><a href="#Ann-4">✗ 3/3</a>'),
    (Result(True, 3, 3, [("t", "w")]), '<td class="good"><a href="#Ann-4">✓ 3/3</a>'),
])
def test_the_cell_of_a_learner_and_a_lesson(result: Result | None, cell: str) -> None:
    assert _cell("Ann", cast(Lesson, SimpleNamespace(number=4)), result) == cell


@each_of("prediction, passed, complete", [(True, 2, True), (False, 2, False), (True, 1, False), (False, 1, False)])
def test_a_lesson_is_complete_with_its_prediction_and_all_checks(prediction: bool, passed: int, complete: bool) -> None:
    assert Result(prediction, passed, 2).is_complete is complete


def test_golden_files_stand_in_a_folder_that_may_be_there(tmp_path: Path) -> None:
    plc = Plc(counter_image())
    recorder = Recorder(plc, ["D0"])
    plc.scan()
    for name in ("a/b/one.txt", "a/b/two.txt"):
        golden.check(tmp_path / name, recorder, True)  # type: ignore[arg-type]
        golden.check(tmp_path / name, recorder, False)  # type: ignore[arg-type]


@pytest.mark.slow
@each_of("what, pin, out", [
    ("lamp.st::Lamp", "on", "q"), ("lamp.st", "on", "q"), ("TON", "IN", "Q"), ("lamp.st::lamp", "on", "q"),
])
def test_how_a_rig_is_named(what: str, pin: str, out: str, tmp_path: Path) -> None:
    (tmp_path / "lamp.st").write_text(TEXT)
    rig = Rig.of(what, folders=[tmp_path])
    rig.scan(**{pin: True})
    assert getattr(rig, out) is True
