"""Pictures of one's machine: bound to values, clicked, and read again when they change."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
from browsers import Page

from fbvm.live.pictures import Pictures
from fbvm.run.project import Project, read_project

SVG = '<svg xmlns="http://www.w3.org/2000/svg"><rect id="water"/><g id="pump"/></svg>'
HEAD = '[plc.pump]\nsources = ["pump.st"]\n[[picture]]\nfile = "pump.svg"\n'
LEVEL = '[[picture.bind]]\nelement = "water"\nname = "Main.Level"\nfill = [0, 100]\n'


class Machine:
    """A page at a PLC with a picture on disk."""

    def __init__(self, folder: Path, bindings: str) -> None:
        self.folder, self._time_ns = folder, 0
        self.save("pump.svg", SVG)
        self.save("fbvm.toml", HEAD + bindings)
        (folder / "pump.st").write_text("")
        self.page = Page()
        self.page.bench.pictures = self.pictures = Pictures(folder / "fbvm.toml", self._read, self.page.bench.plcs)
        self.page.done("hello", version=1)
        self.page.done("look", plc="pump", pictures=True)

    def _read(self) -> Any:
        found = read_project(self.folder / "fbvm.toml")
        return found.pictures if isinstance(found, Project) else found

    def save(self, name: str, text: str) -> None:
        self._time_ns += 1_000_000_000
        (self.folder / name).write_text(text)
        os.utime(self.folder / name, ns=(self._time_ns, self._time_ns))

    @property
    def problems(self) -> list[str]:
        found: list[str] = self.pictures.shown[0]["problems"]
        return found


def test_a_picture_is_told_once_and_its_values_when_they_change(tmp_path: Path) -> None:
    page = Machine(tmp_path, LEVEL).page
    first = page.update()
    assert [one["title"] for one in first["pictures"]] == ["pump"]
    assert first["pictures"][0]["bindings"] == [
        {"element": "water", "name": "Main.Level", "plc": "pump", "fill": [0.0, 100.0], "key": "pump/Main.Level"}
    ]
    assert first["picture"] == {"pump/Main.Level": "20"}
    page.scan()
    second = page.update()
    assert "pictures" not in second and second["picture"] == {"pump/Main.Level": "21"}


def test_a_picture_shows_the_scan_that_is_looked_back_at(tmp_path: Path) -> None:
    page = Machine(tmp_path, LEVEL).page
    page.scan(5)
    page.control.pause()
    page.done("view", plc="pump", scan=1)
    assert page.update()["picture"] == {"pump/Main.Level": "22"}


def test_a_page_that_does_not_show_pictures_is_told_none(tmp_path: Path) -> None:
    page = Machine(tmp_path, LEVEL).page
    page.done("look", plc="pump")
    assert not {"pictures", "picture"} & set(page.update())


def test_a_drawing_and_its_table_are_read_again_when_they_change(tmp_path: Path) -> None:
    machine = Machine(tmp_path, LEVEL)
    machine.save("pump.svg", SVG.replace("rect", "circle"))
    machine.pictures.look()
    assert "<circle" in machine.pictures.shown[0]["svg"]
    machine.save("fbvm.toml", HEAD + LEVEL.replace("Level", "Pump").replace("fill = [0, 100]", 'click = "toggle"'))
    machine.pictures.look()
    assert machine.page.update()["picture"] == {"pump/Main.Pump": "FALSE"}


def test_a_button_is_held_for_one_scan_at_least_when_its_page_goes_at_once() -> None:
    page = Page()
    page.scan(3)
    assert page.done("write", plc="pump", name="Main.Pump", value="TRUE", held=True)["scan"] == 3
    page.session.end()
    page.bench.let_go()
    assert page.plc.read("Main.Pump") is True
    page.scan()
    page.bench.let_go()
    assert page.plc.read("Main.Pump") is False
    assert [act.text for act in page.bench.acts] == ["Main.Pump := TRUE", "Main.Pump := FALSE"]
    assert [(order.fields, order.scans) for order in page.bench.orders] == [
        ({"plc": "pump", "name": "Main.Pump", "value": value}, {"pump": scans}) for value, scans in (("TRUE", 3), ("FALSE", 4))
    ]
    page.session.end()
    page.bench.let_go()
    assert len(page.bench.acts) == 2


def test_only_a_bool_is_held() -> None:
    reply = Page().ask("write", plc="pump", name="Main.Level", value="5", held=True)
    assert reply["error"] == "Main.Level is INT; only a BOOL is held"


def test_a_table_with_a_mistake_leaves_the_picture_as_it_was(tmp_path: Path) -> None:
    machine = Machine(tmp_path, LEVEL)
    machine.save("fbvm.toml", HEAD + "[[picture.bind]]\n")
    machine.pictures.look()
    assert machine.page.update()["picture"] == {"pump/Main.Level": "20"}


@pytest.mark.parametrize(
    ("bindings", "said"),
    [
        (LEVEL.replace("water", "wine"), "no element with the id wine"),
        (LEVEL.replace("Main.Level", "Main.Levl"), "water: Main has no Levl"),
        (LEVEL.replace("Main.Level", "Main.Curve"), "no single value"),
        (LEVEL.replace("fill = [0, 100]", 'click = "press"'), "is INT; only a BOOL is clicked by press"),
    ],
)
def test_what_a_picture_cannot_show_is_said_on_it(tmp_path: Path, bindings: str, said: str) -> None:
    machine = Machine(tmp_path, bindings)
    assert said in machine.problems[0] and machine.pictures.places == {}


def test_a_drawing_that_is_gone_or_does_more_is_said(tmp_path: Path) -> None:
    machine = Machine(tmp_path, LEVEL)
    machine.save("pump.svg", SVG.replace("<g", "<script/><g"))
    machine.pictures.look()
    assert "<script>" in machine.problems[0]
    machine.save("pump.svg", "<html></html>")
    machine.pictures.look()
    assert len(machine.problems) == 1 and machine.problems[0].startswith("pump.svg: ") and machine.pictures.places == {}
    (tmp_path / "pump.svg").unlink()
    machine.pictures.look()
    assert machine.problems == ["pump.svg: no such file or directory"]


@pytest.mark.parametrize(
    ("bindings", "said"),
    [
        ('[[picture.bind]]\nelement = "water"\nname = "Main.Level"\n', "shows nothing"),
        (LEVEL + 'plc = "tank"\n', "there is no PLC tank"),
        (LEVEL.replace("[0, 100]", "[5, 5]"), "same number twice"),
        (LEVEL.replace("[0, 100]", '["a", 5]'), "no list of two numbers"),
        (LEVEL + "move = { from = [0, 1] }\n", "by"),
    ],
)
def test_a_mistake_in_the_table_is_a_diagnostic_of_the_project(tmp_path: Path, bindings: str, said: str) -> None:
    (tmp_path / "pump.st").write_text("")
    (tmp_path / "fbvm.toml").write_text(HEAD + bindings)
    found = read_project(tmp_path / "fbvm.toml")
    assert not isinstance(found, Project)
    assert said in f"{found[0].message} {found[0].hint}"


def test_a_picture_stays_inside_the_project(tmp_path: Path) -> None:
    (tmp_path / "fbvm.toml").write_text(HEAD.replace("pump.svg", "../pump.svg"))
    found = read_project(tmp_path / "fbvm.toml")
    assert not isinstance(found, Project) and "outside of the project" in found[0].message
    assert isinstance(read_project(tmp_path / "fbvm.toml", allow_outside=True), Project)
