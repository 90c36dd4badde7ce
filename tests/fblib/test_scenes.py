"""The scenes of examples/: several makers' PLCs on one network, in memory, with faults, and over real TCP."""

from __future__ import annotations

from pathlib import Path
from shutil import copytree

import pytest

from fbvm.base.diagnostics import errors
from fbvm.net.faults import KINDS, Fault
from fbvm.run import run_all
from fbvm.run.plant import Plant
from fbvm.run.project import Project, read_project
from fbvm.wire.link import Peer

SCENES = Path(__file__).resolve().parents[2] / "examples"
SECOND_NS = 1_000_000_000
TANK = Peer("192.168.250.23", 502)


def scene(name: str, net: str = "loop", fault: Fault | None = None, max_s: int = 30,
          folder: Path = SCENES) -> dict[str, dict[str, object]]:
    """What is watched of each PLC when the scene has ended."""
    project = read_project(folder / name / "fbvm.toml")
    assert isinstance(project, Project)
    plant = Plant(project, net=net, for_ns=max_s * SECOND_NS)
    assert not errors(plant.diagnostics)
    if fault:
        plant.network.faults.append(fault)  # type: ignore[union-attr]
    panel = next(kind for kind in plant.kinds if kind.row.name == "panel").runs[0]

    def end() -> None:
        """As Ctrl-C does, once the panel has what it waits for: the other PLCs would go on to the end of the time."""
        if panel.reason:
            raise KeyboardInterrupt

    run_all(plant.runs, end)
    assert panel.reason == "until"
    values = {kind.row.name: dict(kind.values(kind.runs[0])) for kind in plant.kinds}
    plant.close()
    return values


@pytest.mark.slow
def test_a_panel_fills_the_tank() -> None:
    values = scene("tank")
    assert values["panel"] == {"Main.Set_Point": 800, "Main.Level": 800}
    assert values["tank"]["Main.Holding[0]"] == 800


@pytest.mark.slow
def test_three_plcs_in_a_row() -> None:
    values = scene("row")
    assert values["panel"] == {"Main.Level": 704}
    assert values["gateway"] == {"Main.Wanted": 700, "Main.Level": 704, "Main.Failures": 0}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["slow", "cut", "joined", "unsteady"])
def test_the_row_on_a_bad_network(kind: str) -> None:
    assert scene("row", fault=KINDS[kind])["gateway"]["Main.Level"] == 704


@pytest.mark.slow
def test_the_row_when_the_tank_is_away_for_two_seconds() -> None:
    away = Fault(TANK, reset=True, error="EHOSTUNREACH", from_ns=3 * SECOND_NS, until_ns=5 * SECOND_NS)
    values = scene("row", fault=away)
    assert values["gateway"]["Main.Level"] == 704
    failures = values["gateway"]["Main.Failures"]
    assert isinstance(failures, int) and failures > 1


@pytest.mark.slow
def test_the_row_over_real_tcp(tmp_path: Path) -> None:
    """The tank scans five times as often, and so fills in two seconds."""
    for name in ("row", "tank"):
        copytree(SCENES / name, tmp_path / name)
    project = tmp_path / "row" / "fbvm.toml"
    text = project.read_text(encoding="utf-8")
    assert text.count('cycle = "100ms"') == 1
    project.write_text(text.replace('cycle = "100ms"', 'cycle = "20ms"'), encoding="utf-8")
    values = scene("row", net="tcp", max_s=15, folder=tmp_path)
    assert values["panel"] == {"Main.Level": 704}
    assert values["gateway"]["Main.Failures"] == 0


@pytest.mark.slow
def test_two_omron_plcs() -> None:
    project = read_project(SCENES / "pair" / "fbvm.toml")
    assert isinstance(project, Project)
    plant = Plant(project, for_ns=30 * SECOND_NS)
    run_all(plant.runs)
    server, client = ({**kind.values(kind.runs[0])} for kind in plant.kinds)
    assert server == {"D4999..D5003": [10, 11, 21, 31, 41], "W491..W495": [0, 3, 3, 0, 0]}
    assert (client["D200..D203"], client["Main.Error_Code"]) == ([10, 20, 30, 40], 0)
    plant.close()
