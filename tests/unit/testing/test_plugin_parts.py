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
from fbvm.testing import plugin as testing_plugin
from fbvm.testing.course.class_report import _cell
from fbvm.testing.course.lessons import Lesson, Result
from fbvm.testing.coverage_plugin import CoveragePlugin
from fbvm.testing.plant_rig import PlantRig, project_near
from fbvm.testing.rig import Rig, Trapped
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


def test_warnings_of_a_file_stand_in_the_order_of_its_lines() -> None:
    plugin, reporter = WarningPlugin(config()), Reporter()
    rows = ["a.st:10:1: w", "a.st:3:108: w", "a.st:3:49: w", "a.st:9:1: w"]
    plugin.pytest_testnodedown(SimpleNamespace(workeroutput={warning_plugin.NAME: rows}), None)
    plugin.pytest_terminal_summary(cast(Any, reporter))
    assert reporter.said[1:] == ["a.st:3:49: w", "a.st:3:108: w", "a.st:9:1: w", "a.st:10:1: w"]


@each_of("result, cell", [
    (None, '<td class="none">-'), (Result(True, 3, 3), '<td class="good">✓ 3/3'), (Result(False, 3, 3), '<td class="bad">✗ 3/3'),
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


TRAPPED = ("scan", "run", "until", "plant scan", "plant run", "plant until")
"""Where a program stops at a trap."""


@pytest.mark.slow
def test_what_pytest_shows_of_a_failure_ends_in_the_test_itself(tmp_path: Path) -> None:
    """Every function of the plugin between the test and what is wrong hides its frame."""
    (tmp_path / "lamp.st").write_text(TEXT.replace("q : BOOL;", "q : BOOL; n : INT;").replace("q := on;", "n := 1 / n;"))
    (tmp_path / "fbvm.toml").write_text('[plc.a]\nsources = ["main.st"]\n')
    (tmp_path / "main.st").write_text("PROGRAM Main VAR n : INT; END_VAR n := 1 / n; END_PROGRAM\n")

    def rig() -> Rig:
        return Rig.of("lamp.st::Lamp", folders=[tmp_path])

    def plant() -> PlantRig:
        return PlantRig(tmp_path / "fbvm.toml")

    wrong: dict[str, Any] = {
        "scan": lambda: rig().scan(), "run": lambda: rig().run("1s"), "until": lambda: rig().until("q", max="1s"),
        "write": lambda: rig().write(nobody=1), "set": lambda: setattr(rig(), "n", "x"), "item": lambda: rig()["nobody"],
        "set item": lambda: rig().__setitem__("on", "x"), "force": lambda: rig().force(nobody=1),
        "of": lambda: Rig.of("lamp.st::Nobody", folders=[tmp_path]), "file": lambda: Rig.of("none.st", folders=[tmp_path]),
        "golden": lambda: golden.check(tmp_path / "none.txt", cast(Any, Recorder(Plc(counter_image()), ["D0"])), False),
        "project": lambda: project_near([tmp_path], "none.toml"), "plant": lambda: PlantRig(tmp_path / "none.toml"),
        "plant scan": lambda: plant().scan(), "plant run": lambda: plant().run("1s"),
        "plant until": lambda: plant().until("a.Main.n = 5", max="1s"),
    }  # fmt: skip
    shown = {}
    for name, call in wrong.items():
        with pytest.raises(Exception) as raised:
            call()
        frames = [(entry.path.name, entry.locals) for entry in raised.traceback if "/fbvm/testing/" in entry.path.as_posix()]
        assert frames and (raised.type is Trapped) is (name in TRAPPED), name
        if visible := [file for file, local in frames if not local.get("__tracebackhide__")]:
            shown[name] = visible
    assert shown == {}


@pytest.mark.slow
def test_the_trace_of_a_test_is_written_into_a_folder_that_is_made_when_the_test_has_ended(tmp_path: Path) -> None:
    (tmp_path / "Lamp.st").write_text(TEXT, encoding="utf-8")
    rigs, ends = [Rig.of("Lamp.st::Lamp", folders=[tmp_path]) for _ in range(2)], list[Any]()
    folder = tmp_path / "deep" / "traces"
    request = SimpleNamespace(
        config=SimpleNamespace(pluginmanager=SimpleNamespace(has_plugin=lambda name: False),
                               getoption=lambda name: str(folder) if name == "fbvm_traces" else ""),
        node=SimpleNamespace(nodeid="tests/test_a.py::test_b[1]", stash={testing_plugin.RIGS: rigs}),
        addfinalizer=ends.append)  # fmt: skip
    for rig in rigs:
        testing_plugin._instrument(cast(Any, request), rig)
        rig.scan(on=True)
    for end in ends:
        end()
    assert sorted(path.name for path in folder.iterdir()) == [f"tests.test_a.test_b[1].{number}.fbtrace" for number in (0, 1)]
