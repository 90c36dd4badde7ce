"""What pages do seldom: charts with real connections, many drawings, too many questions, PLCs that are not there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from browsers import Page
from test_workbench import CHART

from fbvm.base.diagnostics import Diagnostic, Source
from fbvm.live import symbols
from fbvm.live.changes import SourceChanges
from fbvm.live.pictures import Pictures
from fbvm.live.program import MOST_DRAWN, SITES, Drawings, source_of
from fbvm.live.session import MOST_WAITING
from fbvm.run.picture_rows import Binding, Picture
from fbvm.watch.paths import UnknownPlace

pytestmark = pytest.mark.slow


def test_with_real_connections_a_chart_is_drawn_as_machine_code_has_noted_it() -> None:
    page = Page(CHART, real=True)
    page.done("hello", version=1)
    page.done("look", plc="pump", instance="Main", scan=True)
    page.update()
    page.scan(2)
    assert page.live.power is not None
    inside = page.update()["inside"]
    [[head, dark]] = inside["pictures"]
    assert (head, inside["scan"], inside["executed"]) == ("", 1, []) and "Dark" in dark and "<svg" in dark
    page.plc.write("Main.go", True)
    page.scan(2)
    for _ in range(3):
        update = page.update()
    [[_, bright]] = update["inside"]["pictures"] if "inside" in update else [[head, ""]]
    assert bright != dark
    assert page.live.view_of("Main") is not None
    assert page.live.view_of("Other.Program") is None, "a page of another program looks on"


def test_drawings_that_are_too_many_are_made_anew() -> None:
    made: dict[Any, Any] = {}
    drawings = Drawings(made)
    counts = [0]

    def draw() -> tuple[str, str]:
        counts[0] += 1
        return "", str(counts[0])

    assert [drawings.picture((1,), draw) for _ in range(2)] == [("", "1")] * 2
    made.update({(number,): ("", "") for number in range(2, MOST_DRAWN)})
    assert drawings.picture((MOST_DRAWN,), draw) == ("", "2") and len(made) == MOST_DRAWN
    assert drawings.picture((MOST_DRAWN + 1,), draw) == ("", "3") and list(made) == [(MOST_DRAWN + 1,)]


def test_the_head_of_a_long_source_is_found_in_steps() -> None:
    lines = [f"    // {number}" for number in range(3 * SITES)]
    head = ["// first", "FUNCTION Other : INT Other := 1; END_FUNCTION", "PROGRAM Main VAR n : INT; END_VAR"]
    text = "\n".join([*head, *lines, "n := n + 1;", "END_PROGRAM"])
    page = Page(text + "\n// behind\n")
    steps = source_of(page.plc.image, page.plc.memory.areas, page.live.texts, "Main")
    count = 0
    try:
        while True:
            next(steps)
            count += 1
    except StopIteration as ended:
        found = ended.value
    assert found["first"] == 3 and len(found["lines"]) == 3 * SITES + 3 and count > 3
    assert found["lines"][-1] == {"text": "END_PROGRAM", "names": []}
    assert found["lines"][-2] == {"text": "n := n + 1;", "names": ["Main.n"]}
    with pytest.raises(UnknownPlace):
        next(source_of(page.plc.image, page.plc.memory.areas, page.live.texts, "Main.n"))


def test_where_no_line_has_the_head_of_a_program_its_source_is_shown_from_the_first_on() -> None:
    text = "\n" * (2 * SITES) + "PROGRAM\n    Main\nVAR n : INT; END_VAR\n    n := n + 1;\nEND_PROGRAM\n"
    page = Page(text)
    steps, count = source_of(page.plc.image, page.plc.memory.areas, page.live.texts, "Main"), 0
    try:
        while True:
            next(steps)
            count += 1
    except StopIteration as ended:
        found = ended.value
    assert (found["first"], len(found["lines"]), found["lines"][-2:]) == (1, 2 * SITES + 5, [
        {"text": "    n := n + 1;", "names": ["Main.n"]}, {"text": "END_PROGRAM", "names": []}])  # fmt: skip
    assert count == 1 + 1 + 3 + (2 * SITES + 5) // 2, "sites, the text, rows upwards, two rows each"


def test_questions_whose_replies_are_under_way_are_so_many_at_most() -> None:
    page = Page()
    page.done("hello", version=1)
    asked = [page.session.answer(f'{{"id": {number}, "do": "search", "plc": "pump", "text": "level"}}')
             for number in range(MOST_WAITING + 3)]  # fmt: skip
    refused = [text for text in asked if text is not None and "error" in text]
    assert len([text for text in asked if text is None]) == MOST_WAITING
    assert len(refused) == 3 - sum(text is not None and "error" not in text for text in asked)
    assert all("too many questions wait for their replies" in text for text in refused)


def test_a_step_lets_the_next_scan_be_observed_where_an_instance_is_looked_at() -> None:
    for looks in (True, False):
        page = Page()
        page.done("hello", version=1)
        page.done("look", plc="pump", names=[], instance="Main" if looks else None, scan=looks)
        page.scan(1)
        page.live.wants_view = False
        page.done("step", scans=1)
        assert page.live.wants_view is looks


def test_a_search_ends_where_enough_is_found_and_rests_between_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    many = " ".join(f"v{number} : INT;" for number in range(120))
    page = Page(f"PROGRAM Main VAR {many} END_VAR v1 := 1; END_PROGRAM")

    def searched(text: str) -> tuple[int, list[str]]:
        steps, rests = symbols.search(page.plc, {"CIO 1500": "v of a unit", "CIO 1501": "other"}, lambda place: "", text), 0
        while True:
            try:
                next(steps)
            except StopIteration as ended:
                return rests, [row["name"] for row in ended.value["found"]]
            rests += 1

    assert searched("other") == (searched("nothing")[0], ["CIO 1501"])
    rests, names = searched("v")
    assert names[0] == "Main.v0" and "CIO 1500" in names and len(names) == 121 and rests == 121 // symbols.STEP == 2
    monkeypatch.setattr(symbols, "MOST_FOUND", 5)
    assert searched("v")[1] == [f"Main.v{number}" for number in range(5)]
    assert searched("D7")[1][:1] == ["D7"]


def test_what_a_picture_shows_of_a_plc_that_is_not_there_is_said(tmp_path: Path) -> None:
    (tmp_path / "a.svg").write_text('<svg xmlns="http://www.w3.org/2000/svg"><text id="a">x</text></svg>', encoding="utf-8")
    page = Page()
    rows = [Picture(tmp_path / "a.svg", "A", (Binding("a", "Main.Level", plc, text="{}"),)) for plc in ("pump", "tank")]
    pictures = Pictures(tmp_path / "fbvm.toml", lambda: rows, {"pump": page.live})
    assert [row["problems"] for row in pictures.shown] == [[], ["there is no PLC tank"]]
    assert list(pictures.places) == ["pump/Main.Level"]


def test_a_program_that_cannot_be_read_any_more_is_a_mistake_of_the_change() -> None:
    wrong = Diagnostic("P0103", Source("fbvm.toml", "x"), 0, 1, "there is no file main.st")
    changes: Any = object.__new__(SourceChanges)
    changes._programs = lambda: [wrong]
    steps = changes._steps()
    with pytest.raises(StopIteration) as ended:
        while True:
            next(steps)
    assert ended.value.value == [wrong]
