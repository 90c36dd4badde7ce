"""What a plant cannot be made of: sources that cannot be read, engines that are not there; told at their places."""

from __future__ import annotations

from pathlib import Path

import pytest

from fbvm.run import plant as module
from fbvm.run.plant import Plant
from fbvm.run.project import Project, read_project

COUNTER = "PROGRAM Main\nVAR n : INT; END_VAR\n    n := n + 1;\nEND_PROGRAM\n"
TEXT = '[plc.a]\nsources = ["main.st"]\nengine = "native"\n[plc.b]\nsources = ["main.st"]\n'


def plant(folder: Path) -> Plant:
    (folder / "main.st").write_text(COUNTER, encoding="utf-8")
    (folder / "fbvm.toml").write_text(TEXT, encoding="utf-8")
    found = read_project(folder / "fbvm.toml")
    assert isinstance(found, Project)
    return Plant(found)


def told(made: Plant) -> list[tuple[str, int, str]]:
    return [(each.code, each.source.place(each.start)[0], each.message) for each in made.diagnostics]


def test_a_project_of_another_tool_that_cannot_be_read_is_told_at_its_row(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(sources: object, resource: str | None) -> object:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(module, "inputs", refused)
    made = plant(tmp_path)
    assert told(made) == [("P0103", line, f"plc.{name}.sources: a project cannot be read: permission denied")
                          for name, line in (("a", 2), ("b", 5))]  # fmt: skip
    assert made.runs == []


def test_an_engine_that_cannot_be_had_is_told_at_its_row(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    make = module.Plc

    def made_of(image: object, cycle_ns: int, engine: str) -> object:
        if engine == "native":
            raise ValueError("machine code needs llvmlite")
        return make(image, cycle_ns, engine=engine)  # type: ignore[arg-type]

    monkeypatch.setattr(module, "Plc", made_of)
    made = plant(tmp_path)
    assert told(made) == [("P0103", 3, "machine code needs llvmlite")]
    assert [len(kind.runs) for kind in made.kinds] == [0, 1]
