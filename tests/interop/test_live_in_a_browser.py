"""The live page in a real browser against PLCs that run: Chromium through playwright, where both are there."""

from __future__ import annotations

import re
import shutil
import tomllib
from pathlib import Path
from typing import Any

import pytest
from live_pages import state, value, watch

from fbvm.testing.course.lessons import lessons

pytestmark = pytest.mark.slow


def test_values_are_seen_written_held_and_released(live: Any) -> None:
    run = live()
    page = run.window()
    state(page, "run")
    level = watch(page, "Main.Level")
    hand = watch(page, "Main.Hand")
    value(hand, "FALSE")
    hand.get_by_role("button", name="Write the other value into").click()
    value(hand, "TRUE")
    value(level, "0")
    level.locator("input").fill("77")
    level.locator("input").press("Shift+Enter")
    level.locator(".value.forced").wait_for()
    assert page.locator(".chip.forced").count() >= 1
    level.get_by_role("button", name="End the force of").click()
    level.locator(".value:not(.forced)").wait_for()
    level.locator("input").fill("a word")
    level.locator("input").press("Enter")
    page.locator("#failure:not([hidden])").wait_for()
    assert "Main.Level" in page.locator("#failure").inner_text()
    assert page.locator("#log li").count() == 3
    assert page.title() == "fbvm live: pump" and page.locator("#source img, #source script").count() == 0
    assert run.complaints == []


def test_the_scan_is_paused_stepped_and_taken_back_by_keys(live: Any) -> None:
    run = live("--paused")
    page = run.window()
    state(page, "pause")
    level = watch(page, "Main.Level")
    value(level, "20")
    page.locator("#where").click()
    for _ in range(3):
        page.keyboard.press("s")
        page.wait_for_timeout(0)
    value(level, "23")
    page.keyboard.press("ArrowLeft")
    state(page, "past")
    value(level, "22")
    page.keyboard.press("ArrowLeft")
    value(level, "21")
    page.keyboard.press("End")
    state(page, "pause")
    value(level, "23")
    page.locator("#source tr.executed").first.wait_for()
    level.get_by_role("button", name="Which statement gave its value to").click()
    page.locator("#cause", has_text="Level := Level + 1").wait_for()
    assert run.complaints == []


def test_a_reload_comes_back_to_what_was_watched_and_two_pages_see_one_plc(live: Any) -> None:
    run = live("--paused")
    page, other = run.window(), run.window()
    watch(page, "Main.Level")
    page.reload()
    value(page.locator("#watched tr[data-name='Main.Level']"), "20")
    other_row = watch(other, "Main.Level")
    row = page.locator("#watched tr[data-name='Main.Level']")
    row.locator("input").fill("55")
    row.locator("input").press("Enter")
    value(other_row, "55")
    other.locator("#log li", has_text="Main.Level := 55").wait_for()
    assert run.complaints == []


def test_a_reload_comes_back_to_the_past_and_to_the_trend(live: Any) -> None:
    page = (run := live("--paused")).window()
    row = watch(page, "Main.Level")
    page.locator("#where").click()
    page.keyboard.press("S")
    value(row, "30")
    page.click("#exact")
    page.locator("#cursorA").fill("4")
    measured = page.locator("figure[data-name='Main.Level'] .between")
    measured.filter(has_text="A 25").wait_for()
    page.locator("#where").click()
    page.keyboard.press("ArrowLeft")
    value(row, "29")
    page.reload()
    state(page, "past")
    value(row, "29")
    measured.filter(has_text="A 25").wait_for()
    assert run.complaints == []


LADDER = """
PROGRAM Main
VAR Start : BOOL; Stop AT D5.01 : BOOL; Motor : BOOL; END_VAR
LADDER
    RUNG 1 The motor holds itself
    LD Start
    OR Motor
    ANDNOT Stop
    OUT Motor
END_LADDER
END_PROGRAM
"""


def test_a_name_in_a_rung_is_watched_by_a_click_and_a_force_is_seen_wherever_it_acts(live: Any) -> None:
    page = (run := live(text=LADDER)).window()
    state(page, "run")
    page.locator("#rungs text", has_text="Start").first.click()
    row = page.locator("#watched tr[data-name='Main.Start']")
    row.locator("input").fill("TRUE")
    row.get_by_role("button", name="Hold at this value").click()
    page.locator("#rungs figcaption", has_text="Main.Start forced to TRUE").wait_for()
    page.locator("#rungs text.held", has_text="Start").wait_for()
    page.locator("#held", has_text="1 forced").wait_for()
    stop = watch(page, "Main.Stop")
    stop.locator("input").fill("TRUE")
    stop.locator("input").press("Shift+Enter")
    page.locator("#held", has_text="2 forced").wait_for()
    page.click("[data-panel=memory]")
    page.locator("#words td.forced", has_text="0002").wait_for()
    page.click("#free")
    page.locator("#held").wait_for(state="hidden")
    assert page.locator("#rungs text.held").count() == 0 and run.complaints == []


def test_a_slow_click_at_a_name_in_a_rung_is_one(live: Any) -> None:
    """The rungs are drawn anew ten times a second, but not while the button of the mouse is down."""
    page = live(text=LADDER).window()
    state(page, "run")
    page.locator("#rungs text", has_text="Start").first.click(delay=1000)
    page.locator("#watched tr[data-name='Main.Start']").wait_for(timeout=10_000)


def test_a_cable_is_pulled_and_a_fault_switched_on(live: Any) -> None:
    page = (run := live()).window()
    state(page, "run")
    page.click("[data-panel=units]")
    page.get_by_role("button", name="pull the cable").click()
    page.locator("#backplane h3", has_text="cable pulled").wait_for()
    page.click("[data-panel=network]")
    page.select_option("#kind", "slow")
    page.fill("#peer", "192.168.250.1:502")
    page.fill("#much", "30ms")
    page.click("#break")
    page.locator("#faults li", has_text="slow at 192.168.250.1:502").wait_for()
    assert run.complaints == []


def test_without_the_token_nothing_is_shown(live: Any) -> None:
    run = live()
    page = run.window(run.url.partition("#")[0])
    page.locator("#failure", has_text="The token is missing").wait_for()
    assert page.locator("#source td").count() == 0


def test_read_only_pages_only_look(live: Any) -> None:
    page = live("--read-only").window()
    level = watch(page, "Main.Level")
    assert level.get_by_role("button", name="Write once").is_disabled() and page.locator("#pause").is_disabled()


def test_what_is_typed_before_there_is_a_connection_is_searched_when_there_is_one(live: Any) -> None:
    run = live("--paused")
    page = run.window("about:blank")
    page.add_init_script("""addEventListener("DOMContentLoaded", () => {
        document.getElementById("find").value = "Main.Level";
        document.getElementById("find").dispatchEvent(new Event("input"));
    })""")
    page.goto(run.url)
    page.locator("#found button", has_text="Main.Level").wait_for(timeout=10_000)
    assert run.complaints == []


@pytest.mark.parametrize(("width", "scheme"), [(390, "light"), (1400, "dark"), (2560, "light")])
def test_no_panel_is_wider_than_the_window(live: Any, width: int, scheme: str) -> None:
    page = live().window(viewport={"width": width, "height": 900}, color_scheme=scheme)
    state(page, "run")
    for panel in ("watch", "trend", "units", "network", "memory", "acts"):
        page.click(f"[data-panel={panel}]")
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), panel


def test_every_control_has_a_name_for_screen_readers(live: Any) -> None:
    page = live().window()
    watch(page, "Main.Level")
    for panel in ("units", "network", "memory", "plant", "times"):
        page.click(f"[data-panel={panel}]")
    nameless = page.evaluate("""[...document.querySelectorAll('button, input, select')]
        .filter((one) => !(one.textContent.trim() || one.getAttribute('aria-label') || one.title || one.labels?.length))
        .map((one) => one.outerHTML)""")
    assert nameless == []


def test_a_thousand_signals_are_watched(live: Any) -> None:
    text = """PROGRAM Main VAR a : ARRAY[1..1000] OF INT; i : INT; END_VAR
        FOR i := 1 TO 1000 DO a[i] := a[i] + 1; END_FOR END_PROGRAM"""
    page = (run := live("--speed", "100", text=text)).window()
    state(page, "run")
    row = watch(page, "Main.a")
    row.get_by_role("button", name="Show the parts of").click()
    page.locator("#watched tr").nth(500).wait_for()
    page.locator("#where", has_text=re.compile(r"scan \d{4,}")).wait_for()
    assert run.complaints == []


def test_a_structure_is_opened_kept_in_a_group_and_measured(live: Any) -> None:
    text = """TYPE Valve : STRUCT Open : BOOL; Ways : ARRAY[1..2] OF INT; END_STRUCT END_TYPE
        PROGRAM Main VAR v : Valve; END_VAR v.Ways[2] := v.Ways[2] + 3; END_PROGRAM"""
    page = (run := live("--paused", text=text)).window()
    watch(page, "Main.v").get_by_role("button", name="Show the parts of Main.v").click()
    page.get_by_role("button", name="Show the parts of Main.v.Ways").click()
    row = page.locator("#watched tr[data-name='Main.v.Ways[2]']")
    page.fill("#groupName", "valve")
    page.click("#keepGroup")
    page.locator("#group option", has_text="valve").wait_for(state="attached")
    assert "pump/Main.v" in run.file.with_name("pump.watch.toml").read_text()
    page.locator("#where").click()
    page.keyboard.press("S")
    value(row, "30")
    page.click("#exact")
    page.locator("#cursorA").fill("2")
    page.locator("#cursorB").fill("6")
    page.locator("figure[data-name='Main.v.Ways[2]'] .between", has_text="A 9  B 21, B − A 12").wait_for()
    page.locator("#measured", has_text="B − A: 4 scans, 40.000 ms").wait_for()
    page.reload()
    row.wait_for()
    page.select_option("#group", "valve")
    page.click("#ungroup")
    page.locator("#group option", has_text="valve").wait_for(state="detached")
    assert run.complaints == []


PROJECT = Path(__file__).parents[2] / "examples" / "pair"


def test_all_plcs_of_a_project_stand_side_by_side(live: Any, tmp_path: Path) -> None:
    shutil.copytree(PROJECT, tmp_path / "pair")
    page = (run := live(str(tmp_path / "pair"))).window()
    state(page, "run")
    cards = page.locator("#plcs .card")
    cards.nth(1).wait_for()
    page.locator("#plan text", has_text="frames").first.wait_for()
    page.click("[data-panel=watch]" if page.locator("#watch.shown").count() == 0 else "#find")
    first, second = (card.locator("button").inner_text() for card in cards.all())
    page.fill("#find", f"{second}/Main.")
    page.locator("#found button").first.click()
    page.locator("#watched tr .value", has_text=re.compile(".")).first.wait_for()
    cards.nth(1).locator("button").click(delay=500)  # longer than updates are apart, and the panel is drawn anew at each
    page.wait_for_function("name => document.getElementById('plc').value === name", arg=second)
    assert first != second and run.complaints == []


KEPT = "PROGRAM Main VAR RETAIN n : INT; END_VAR VAR m : INT; END_VAR\nn := n + 1;\nm := m + 1;\nEND_PROGRAM\n"


def test_a_file_that_changes_is_begun_again_with_what_is_retained(live: Any) -> None:
    page = (run := live("--paused", text=KEPT)).window()
    watch(page, "Main.n")
    page.locator("#where").click()
    page.keyboard.press("S")
    value(page.locator("#watched tr[data-name='Main.n']"), "10")
    run.file.write_text(KEPT.replace("n + 1;", "n + k;"))
    page.locator("#mistakes td", has_text="n := n + k;").wait_for()
    page.locator("#source .mistake").first.wait_for()
    assert page.locator("#restart").is_hidden()
    page.keyboard.press("s")
    value(page.locator("#watched tr[data-name='Main.n']"), "11")
    run.file.write_text(KEPT.replace("VAR m : INT;", "VAR first, m : INT;").replace("n + 1;", "n + 100;"))
    page.locator("#restart").click()
    page.locator("#change").wait_for(state="hidden")
    value(page.locator("#watched tr[data-name='Main.n']"), "11")
    page.keyboard.press("s")
    value(page.locator("#watched tr[data-name='Main.n']"), "111")
    page.locator("#log li", has_text="restart with the changed pump.st; 1 retained").wait_for()
    assert run.complaints == []


@pytest.mark.parametrize(("verb", "options"), [("run", ["--live"]), ("serve", ["--port", "0", "--live"]), ("demo", ["--live"])])
def test_other_verbs_open_the_page_on_what_they_run(live: Any, verb: str, options: list[str]) -> None:
    page = (run := live(*options, verb=verb)).window()
    state(page, "pause" if verb == "demo" else "run")
    if verb == "demo":
        page.click("#run")
        row = watch(page, "Main.Done")
        value(row, "TRUE")
    page.locator("#source tr").nth(3).wait_for()
    assert run.complaints == []


def test_a_run_with_an_end_stays_on_its_page(live: Any) -> None:
    page = live("--live", "--scans", "25", verb="run").window()
    state(page, "ended")
    page.locator("#where", has_text="scan 24,").wait_for()


CONVEYOR = Path(__file__).parents[2] / "examples" / "conveyor"


def test_a_picture_moves_with_the_machine_and_its_buttons_are_pressed(live: Any, tmp_path: Path) -> None:
    shutil.copytree(CONVEYOR, tmp_path / "machine")
    program = tmp_path / "machine" / "conveyor.st"
    program.write_text(program.read_text().replace("STEP   : REAL := 4.0;", "STEP   : REAL := 0.4;"))  # under way for 50 s
    page = (run := live(str(tmp_path / "machine"))).window()
    state(page, "run")
    motor, box = page.locator("#m-motor"), page.locator("#m-box")
    page.locator("#m-box[style*='visible']").wait_for()
    page.locator("#m-start").focus()
    page.keyboard.press("Enter")  # however short, a scan sees it
    page.locator("#m-motor[style*='rgb(27, 127, 77)']").wait_for()
    before = box.bounding_box()["x"]
    page.wait_for_function("x => document.querySelector('#m-box').getBoundingClientRect().x > x + 20", arg=before)
    page.locator("#m-stop").click()
    page.locator("#m-motor[style*='rgb(138, 145, 156)']").wait_for()
    assert motor.count() == 1
    drawing = tmp_path / "machine" / "conveyor.svg"
    more = "<text id='new' x='9' y='20'>changed</text><script>0</script></svg>"
    drawing.write_text(drawing.read_text().replace("</svg>", more))
    page.locator("#m-new").wait_for()
    page.locator("#wrong", has_text="left out, since it does more than draw: <script>").wait_for()
    assert page.locator("#change").is_hidden()
    assert run.complaints == []


def test_a_button_of_a_picture_stays_held_while_the_page_looks_at_more(live: Any, tmp_path: Path) -> None:
    shutil.copytree(CONVEYOR, tmp_path / "machine")
    drawing = tmp_path / "machine" / "conveyor.svg"
    page = (run := live(str(tmp_path / "machine"))).window()
    start = watch(page, "Main.Start")
    page.locator("#m-start").evaluate("element => { element.first = true; }")
    page.locator("#m-start").focus()
    page.keyboard.down("Enter")
    value(start, "TRUE")
    page.locator("[data-panel=memory]").evaluate("button => button.click()")  # as the mouse does, and the focus stays
    page.locator("#memory td").first.wait_for()
    assert page.locator("#m-start").evaluate("element => element.first")
    value(start, "TRUE")
    page.keyboard.up("Enter")
    value(start, "FALSE")
    page.locator("#m-start").focus()
    page.keyboard.down("Enter")
    value(start, "TRUE")
    drawing.write_text(drawing.read_text().replace("</svg>", "<text id='new' x='9' y='20'>changed</text></svg>"))
    page.locator("#m-new").wait_for()
    value(start, "FALSE")
    assert run.complaints == []


def test_a_breakpoint_is_set_beside_a_line_and_left_by_statements(live: Any) -> None:
    page = (run := live()).window()
    state(page, "run")
    row = watch(page, "Main.Level")
    page.locator("#source tr", has_text="Level := Level + 1;").locator("td.line").click()
    state(page, "halt")
    page.locator("#source tr.halted.breakpoint", has_text="Level := Level + 1;").wait_for()
    before = int(row.locator(".value").inner_text())
    page.locator("#where").click()
    page.keyboard.press("n")
    value(row, str(before + 1))
    page.locator("#halt", has_text="at the end of Main").or_(page.locator("#halt", has_text="stands before")).wait_for()
    page.get_by_role("button", name="Remove the breakpoint").click()
    page.locator("#breaks li").wait_for(state="detached")
    page.keyboard.press("r")
    state(page, "run")
    assert page.locator("#source tr.halted").count() == 0
    assert run.complaints == []


def test_a_new_future_begins_in_the_past_and_the_old_one_is_kept(live: Any) -> None:
    page = (run := live("--paused")).window()
    row = watch(page, "Main.Level")
    page.locator("#where").click()
    page.keyboard.press("S")
    value(row, "30")
    page.keyboard.press("Shift+ArrowLeft")
    value(row, "21")
    page.keyboard.press("ArrowRight")
    value(row, "22")
    page.click("#branch")
    state(page, "pause")
    value(row, "22")
    row.locator("input").fill("50")
    row.locator("input").press("Enter")
    page.locator("#where").click()
    page.keyboard.press("s")
    value(row, "51")
    page.select_option("#future", "0")
    state(page, "past")
    page.locator("#slider").fill("9")
    value(row, "30")
    page.click("#now")
    value(row, "51")
    assert run.complaints == []


def test_frames_are_saved_and_a_word_says_who_wrote_it(live: Any) -> None:
    page = (run := live()).window()
    state(page, "run")
    page.click("[data-panel=network]")
    with page.expect_download() as saved:
        page.click("#pcapng")
    assert Path(saved.value.path()).read_bytes()[:4] == bytes.fromhex("0a0d0d0a")
    page.click("[data-panel=memory]")
    page.fill("#first", "10")  # the press takes the focus from the field, and words are drawn while the button is down
    page.locator("#words button", has_text="005A").first.click(delay=500)
    page.locator("#reason:not([hidden])").wait_for()
    page.click("[data-panel=times]")
    page.locator("#histogram rect").first.wait_for()
    assert run.complaints == []


@pytest.mark.parametrize("number", [15, 16])
def test_a_lesson_is_solved_on_its_page(live: Any, number: int, tmp_path: Path) -> None:
    lesson = lessons()[number - 1]
    page = (run := live(str(number), "--live", "--folder", str(tmp_path / "mine"), verb="learn")).window()
    state(page, "pause")
    answers = tomllib.loads((lesson.folder / "solution" / "answers.toml").read_text(encoding="utf-8"))
    if number == 15:
        page.fill(f"#questions input[name={next(iter(answers))}]", "7654")
        page.locator("#prediction").get_by_role("button").click()
        page.locator("#feedback", has_text="is still empty").wait_for()
    for name, right in answers.items():
        page.fill(f"#questions input[name={name}]", str(right).lower() if isinstance(right, bool) else str(right))
    page.locator("#prediction").get_by_role("button").click()
    page.locator("#feedback.good", has_text="That is what it does").wait_for()
    shutil.copyfile(lesson.folder / "solution" / "program.st", tmp_path / "mine" / lesson.slug / "program.st")
    page.click("#check")
    page.locator("#feedback.good", has_text="Done").wait_for()
    assert run.complaints == []
