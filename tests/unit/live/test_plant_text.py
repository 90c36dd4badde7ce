"""What was done by hand to the PLCs of a project, as a pytest that does it again."""

from __future__ import annotations

import json
import shutil
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from fbvm import Recording
from fbvm.live.plcs import LivePlc
from fbvm.live.pytest_text import plant_text
from fbvm.live.session import Session
from fbvm.live.workbench import Workbench
from fbvm.run.interactive import Control
from fbvm.run.plant import Plant
from fbvm.run.project import Project, read_project
from fbvm.testing.plant_rig import PlantRig

PAIR = Path(__file__).parents[3] / "examples" / "pair"


class Pair:
    """The example with two PLCs as its page shows it."""

    def __init__(self, folder: Path) -> None:
        shutil.copytree(PAIR, folder)
        project = read_project(folder / "fbvm.toml")
        assert isinstance(project, Project)
        self.plant = Plant(project, net="loop")
        recording = Recording()
        lives = {name: LivePlc(name, run.plc, recording.add(name, run.plc), {}) for name, run in self.plant.named_runs.items()}
        self.bench = Workbench(list(lives.values()), Control(),
                               test=partial(plant_text, file=folder / "fbvm.toml", plcs=lives))  # fmt: skip
        self.session = Session(self.bench)
        for run in self.plant.runs:
            run.begin(0)

    def ask(self, do: str, **fields: Any) -> Any:
        reply = json.loads(self.session.answer(json.dumps({"id": 1, "do": do, **fields})) or self.session.update(0) or "")
        assert "error" not in reply, reply
        return reply["ok"]

    def turn(self, turns: int) -> None:
        """As many times, the scans that are due."""
        for _ in range(turns):
            due_ns = min(run.due_ns for run in self.plant.runs)
            for run in self.plant.runs:
                if run.due_ns == due_ns:
                    run.scan(due_ns)


@pytest.mark.slow
def test_all_plcs_do_again_what_was_done_by_hand(tmp_path: Path) -> None:
    pair = Pair(tmp_path / "pair")
    pair.ask("hello")
    pair.ask("look", plc="client", names=["Main.Step", "D200", "server/D20", "server/D5000"])
    pair.ask("write", plc="server", name="D20", value="77")
    pair.turn(2)
    pair.ask("fault", kind="slow", time="200ms")
    pair.turn(20)
    pair.ask("force", plc="client", name="D300", value="5")
    pair.ask("cable", plc="server", unit="ETN21 0", plugged=False)
    pair.turn(7)
    pair.ask("cable", plc="server", unit="ETN21 0", plugged=True)
    pair.ask("mend")
    pair.turn(60)
    text = pair.ask("test", plc="client")["text"]
    assert "made['server'].plc.read('D20') == 77" in text and text.count("latency_ns") == 1 and "not repeated" not in text
    space: dict[str, Any] = {}
    exec(compile(text, "test_by_hand.py", "exec"), space)
    space["test_what_was_done_by_hand"](lambda file: PlantRig(Path(file)))
    with pytest.raises(AssertionError):
        exec(compile(text.replace("== 77", "== 78"), "test_by_hand.py", "exec"), space)
        space["test_what_was_done_by_hand"](lambda file: PlantRig(Path(file)))
