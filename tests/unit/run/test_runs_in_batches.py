"""When a run may be scanned together with others, and what of a project file its PLCs have."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from images import counter_image
from rows import each_of

from fbvm.base.areas import NEVER
from fbvm.machine.plc import Plc
from fbvm.run import loop, run_all, running
from fbvm.run.plant import Plant
from fbvm.run.project import Project, read_project
from fbvm.run.running import CYCLIC, EVENT, Running, TimedWrite

MS = 1_000_000


@each_of(("settings", "enters"), [
    ({"scans": 9}, True), ({"scans": 2}, True), ({"scans": 1}, False), ({"scans": 9, "writes": True}, False),
    ({"scans": 9, "pace": EVENT}, False), ({"scans": 9, "reason": "interrupted"}, False), ({"scans": 9, "place": None}, False),
    ({"for_ns": 50 * MS}, True), ({"for_ns": 10 * MS}, True),
])  # fmt: skip
def test_a_run_is_scanned_with_others_if_nothing_is_wanted_behind_its_next_scans(settings: dict[str, Any], enters: bool) -> None:
    plc = Plc(counter_image())
    place = settings.get("place", SimpleNamespace(until_ns=NEVER))
    rows = [TimedWrite(plc.find("D5"), 1, 500 * MS)] if settings.get("writes") else []
    run = Running(plc, scans=settings.get("scans"), for_ns=settings.get("for_ns"), writes=rows,
                  pace=settings.get("pace", CYCLIC))  # fmt: skip
    run.begin(1000 * MS)
    run.reason = settings.get("reason", "")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(running, "place_of", lambda plc: place)
        entered = run.enter_batch()
    assert (entered is not None) is enters
    if entered is not None:
        assert (entered.run, entered.place, entered.behind_ns) == (run, place, 1000 * MS)
        last_ns = settings.get("for_ns", entered.until_ns - 990 * MS) - 10 * MS
        assert entered.until_ns == last_ns + 1000 * MS, "behind its last scan it looks whether it has ended"


@pytest.mark.parametrize(("resumed", "due_ns"), [(True, [20 * MS, 50 * MS]), (False, [50 * MS, 50 * MS])])
def test_runs_that_go_on_begin_where_each_plc_stands_and_others_where_the_latest_does(resumed: bool, due_ns: list[int]) -> None:
    runs = []
    for scans in (2, 5):
        plc = Plc(counter_image())
        plc.run(scans=scans)
        runs.append(Running(plc, scans=9, pace=EVENT))
    loop._begin_in_virtual_time(runs, resumed, False)
    assert [run.due_ns for run in runs] == due_ns and {(run.pace, run.alone) for run in runs} == {(CYCLIC, False)}


@pytest.mark.slow
def test_the_plcs_of_a_project_have_the_cycle_the_watch_cycle_and_the_phase_of_their_row(tmp_path: Path) -> None:
    (tmp_path / "main.st").write_text("PROGRAM Main VAR n : INT; END_VAR n := n + 1; END_PROGRAM", encoding="utf-8")
    (tmp_path / "fbvm.toml").write_text(
        '[plc.a]\nsources = ["main.st"]\ncycle = "8ms"\nwatch_cycle = "20ms"\ncount = 3\n'
        'set = [{ name = "Main.n", value = 5, at = "8ms" }]\nwatch = ["Main.n", "D0..D1"]\n', encoding="utf-8")
    project = read_project(tmp_path / "fbvm.toml")
    assert isinstance(project, Project)
    plant = Plant(project, scans=3)
    assert list(plant.named_runs) == ["a[1]", "a[2]", "a[3]"]
    assert [(run.plc.cycle_ns, run.plc.watch_cycle.time_ns, run.phase_ns) for run in plant.runs] == [
        (8 * MS, 20 * MS, 0), (8 * MS, 20 * MS, 2 * MS), (8 * MS, 20 * MS, 5 * MS)]
    run_all(plant.runs)
    assert [plant.kinds[0].values(run) for run in plant.runs] == [{"Main.n": 7, "D0..D1": [0, 0]}] * 3
    assert [run.reason for run in plant.runs] == ["scans"] * 3
    plant.close()


@each_of(("alone", "many", "scans", "asked"), [(True, True, 9, [9]), (True, False, 1, [9]), (False, True, 1, [])])
def test_many_scans_of_a_run_that_is_alone_are_no_burst(alone: bool, many: bool, scans: int, asked: list[int]) -> None:
    found: list[int] = []
    run = Running(Plc(counter_image()), scans=9)
    run.begin(1000 * MS)
    run.alone = alone

    def scan_many(plc: Plc, most: int) -> bool:
        found.append(most)
        for _ in range(most if many else 0):
            plc.scan()
        return many

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Plc, "scan_many", scan_many)
        assert run.scan(1000 * MS) == [] and (run.plc.scans, found) == (scans, asked)
    assert bool(run.reason) is (scans == 9)
    assert run.due_ns == 1000 * MS + scans * run.plc.cycle_ns
