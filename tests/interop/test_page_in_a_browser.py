"""The page of a run in a real browser, without network: Chromium through playwright, where both are there."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest
from page_rig import NUMBERS

from fbvm.code.compiler import compile_files, compile_text
from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.net.peers import ModbusPeer
from fbvm.record.page import columns
from fbvm.record.page import data as data_module
from fbvm.record.page.data import PageData, page_data
from fbvm.record.page.page import page
from fbvm.record.recording.recording import Recording
from fbvm.record.recording.scans import RecordedScans
from fbvm.record.trace.reader import Trace
from fbvm.record.trace.recorder import signals_at
from fbvm.record.trace.scan_source import ScanSource
from fbvm.record.trace.writer import Depth, TraceWriter, source_lines
from fbvm.units.etn21.unit import Etn21
from fbvm.watch.paths import Place
from fbvm.wire.link import Peer

pytestmark = pytest.mark.slow
HOUSE = Path(__file__).resolve().parents[2]
Opener = Callable[[PageData], Any]
SCANS = 40
SENDING = 4
"""The scan in which the demo sends its first request."""


@pytest.fixture(scope="module")
def trace() -> Trace:
    path = HOUSE / "examples" / "demo.st"
    image = compile_files([path], runnable=True).image
    assert image is not None
    plc, network, peer, file = Plc(image), LoopNetwork(), ModbusPeer(), io.BytesIO()
    peer.server.holding_registers[0] = 1000
    network.place(Peer("192.168.250.1", 502), peer)
    plc.attach(Etn21(0, "192.168.250.21"), network)
    writer = TraceWriter(plc, file, Depth.STATEMENTS, (), source_lines(image, {str(path): path.read_text(encoding="utf-8")}))
    plc.run(scans=SCANS)
    writer.close()
    return Trace(io.BytesIO(file.getvalue()))


def recorded_scans(text: str, scans: int) -> RecordedScans:
    """A run of a program that was recorded in memory."""
    image = compile_text(text).image
    assert image is not None
    plc = Plc(image)
    recorded = Recording().add("run", plc)
    plc.run(scans=scans)
    return RecordedScans(recorded, {})


@pytest.fixture(scope="module")
def url(trace: Trace, tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("page") / "run.html"
    path.write_text(page(page_data(trace, title="<demo> & more")), encoding="utf-8")
    return path.as_uri()


def opened(browser: Any, url: str, **settings: Any) -> Any:
    """The page in a window of its own, offline; whatever it complains about fails the test."""
    context = browser.new_context(offline=True, **{"viewport": {"width": 1300, "height": 850}, **settings})
    made = context.new_page()
    made.complaints = []
    made.on("pageerror", lambda error: made.complaints.append(str(error)))
    made.on("console", lambda message: made.complaints.append(message.text) if message.type == "error" else None)
    made.on("request", lambda request: made.complaints.append(request.url) if not request.url.startswith("file:") else None)
    made.goto(url)
    made.wait_for_function("document.getElementById('where').textContent.startsWith('scan')")
    return made


@pytest.fixture
def shown(browser: Any, url: str) -> Iterator[Any]:
    made = opened(browser, url)
    yield made
    assert made.complaints == []
    made.context.close()


@pytest.fixture
def made_page(browser: Any, tmp_path: Path) -> Iterator[Opener]:
    """Opens a page of some data."""
    made = []

    def open_page(data: PageData) -> Any:
        path = tmp_path / f"{len(made)}.html"
        path.write_text(page(data), encoding="utf-8")
        made.append(opened(browser, path.as_uri()))
        return made[-1]

    yield open_page
    for one in made:
        assert one.complaints == []
        one.context.close()


def where(shown: Any) -> str:
    """What stands in the heading after the next picture."""
    shown.evaluate("() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    text: str = shown.inner_text("#where")
    return text


def press(shown: Any, *keys: str) -> str:
    for key in keys:
        shown.keyboard.press(key)
    return where(shown)


def test_it_says_what_it_shows(shown: Any) -> None:
    assert shown.title() == "<demo> & more"
    assert where(shown) == "scan 0, 0 ms"


def test_keys_move_the_cursor(shown: Any) -> None:
    assert press(shown, "ArrowRight", "ArrowRight") == "scan 2, 20 ms"
    assert press(shown, "ArrowLeft") == "scan 1, 10 ms"
    assert press(shown, "Shift+ArrowRight") == "scan 11, 110 ms"
    assert press(shown, "End") == f"scan {SCANS - 1}, {SCANS - 1}0 ms"
    assert press(shown, "ArrowRight", "ArrowRight") == f"scan {SCANS - 1}, {SCANS - 1}0 ms"
    assert press(shown, "Home", "ArrowLeft") == "scan 0, 0 ms"


def labels_of(shown: Any) -> dict[str, str]:
    """The values beside the names, when all have been written."""
    shown.wait_for_function("window.fbvm.written()")
    rows = shown.eval_on_selector_all(".label", "rows => rows.map(row => [row.title, row.children[1].textContent])")
    return {title.partition(": ")[0]: text for title, text in rows}


def shown_at(source: ScanSource, scan: int, names: Iterable[str]) -> dict[str, str]:
    """The same values as Python writes them."""
    moment, made = source.at(scan), {}
    for name in names:
        place = source.find(name)
        assert isinstance(place, Place)
        [signal], value = signals_at(place, {}, source.meanings), source.names.read(moment.read, place)
        made[name] = str(value).upper() if isinstance(value, bool) else signal.display(value)
    return made


def test_numbers_are_written_as_everywhere(made_page: Opener, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(columns, "BLOCK_SCANS", 7)
    source = recorded_scans(NUMBERS, 40)
    shown = made_page(page_data(source))
    for scan in (0, 1, 6, 7, 8, 29, 39):
        where(shown)
        shown.evaluate(f"window.fbvm.move({{scan: {scan}}})")
        assert where(shown).startswith(f"scan {scan},")
        labels = labels_of(shown)
        assert {"Main.r", "Main.lr", "Main.lw", "Main.t", "Main.text"} <= set(labels)
        assert labels == shown_at(source, scan, labels)


REALS = ["0.0", "-0.0", "0.1", "1.0", "1E-4", "1E-5", "123456.79", "1E15", "1E16", "1.5E20", "-2.5E-7", "16777217.0", "3.4E38",
         "1E-40"]  # fmt: skip


def test_numbers_with_fractions(made_page: Opener) -> None:
    cases = "\n".join(f"{at}: r := REAL#{text}; lr := LREAL#{text};" for at, text in enumerate(REALS))
    source = recorded_scans(f"""PROGRAM Main VAR n : INT := -1; r : REAL; lr : LREAL; zero : LREAL; t : TIME; d : LTIME; END_VAR
        n := n + 1; t := T#-1d2h3m4s5ms * n; d := LTIME#1ns * n;
        CASE n OF {cases} {len(REALS)}: r := LREAL_TO_REAL(1.0 / zero); lr := -1.0 / zero;
        {len(REALS) + 1}: lr := zero / zero; r := LREAL_TO_REAL(lr); END_CASE END_PROGRAM""", len(REALS) + 2)
    shown = made_page(page_data(source))
    for scan in source.scans:
        assert where(shown).startswith(f"scan {scan},")
        labels = labels_of(shown)
        assert labels == shown_at(source, scan, labels)
        press(shown, "ArrowRight")


def test_a_page_says_of_which_scans_it_has_the_inside(made_page: Opener, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(data_module, "MOST_ROWS", 200)
    data = page_data(recorded_scans(NUMBERS, 100))
    (_, first_end), (last_begin, _) = data.head["windows"]
    shown = made_page(data)
    assert shown.locator("#rows tbody tr").count() > 3
    shown.evaluate("window.fbvm.move({scan: 50})")
    where(shown)
    text = shown.inner_text("#rows tbody")
    assert "not on the page" in text and f"scans 0 to {first_end}" in text and f"scans {last_begin} to 99" in text
    shown.click("#rows button.window >> nth=1")
    assert where(shown).startswith(f"scan {last_begin},")
    assert shown.locator("#rows tbody tr").count() > 3
    press(shown, "Home", "0")
    assert press(shown, "ArrowDown").startswith("scan 0, 0 ms, step 1")


LIT = """([y]) => {
    const canvas = document.getElementById('canvas'), left = document.getElementById('labels').offsetWidth + 12;
    const {data} = canvas.getContext('2d').getImageData(left, y, canvas.width - left, 1);
    const colour = at => data.slice(4 * at, 4 * at + 3).join();
    return Array.from({length: data.length / 4}, (_, at) => at).filter(at => colour(at) !== colour(0));
}"""
"""The dots of a line of the chart that have another colour than its first one."""


def test_a_long_run_is_drawn_from_what_its_blocks_hold(made_page: Opener, monkeypatch: pytest.MonkeyPatch) -> None:
    """All of 20,000 scans in view: a bit that was ON in one scan only is seen, and found by the key for its next change."""
    monkeypatch.setattr(columns, "BLOCK_SCANS", 1000)
    source = recorded_scans("""PROGRAM Main VAR n : DINT; rare, never : BOOL; END_VAR
        n := n + 1; rare := n = 12346; END_PROGRAM""", 20_000)
    shown = made_page(page_data(source, ["Main.rare", "Main.never", "Main.n"]))
    press(shown, "0")
    shown.wait_for_function("window.fbvm.written()")
    rare, never = (shown.evaluate(LIT, [38 + row * 26 + 12]) for row in (0, 1))
    wide = shown.evaluate("document.getElementById('canvas').width - document.getElementById('labels').offsetWidth")
    marks = set(rare) - set(never)  # both have the lines of the grid
    assert marks and all(abs(at + 12 - 12345 / 20_000 * wide) < 4 for at in marks)
    press(shown, "Home")
    assert press(shown, "n").startswith("scan 12345,")
    assert press(shown, "n").startswith("scan 12346,")
    assert press(shown, "p").startswith("scan 12345,")
    assert press(shown, "p").startswith("scan 12345,")


def test_values_are_those_of_the_trace(shown: Any, trace: Trace) -> None:
    for scan in (0, SENDING, 9, SCANS - 1):
        shown.evaluate(f"location.hash = '#{scan}'")
        shown.reload()
        assert where(shown).startswith(f"scan {scan},")
        labels = labels_of(shown)
        assert len(labels) > 100
        assert labels == shown_at(trace, scan, labels)


def test_a_scan_that_is_written_into_the_address_is_shown(shown: Any) -> None:
    press(shown, "ArrowRight")
    shown.evaluate("location.hash = '#7'")
    shown.wait_for_timeout(300)  # behind that the page has written its own scan there
    assert (where(shown), shown.evaluate("location.hash")) == ("scan 7, 70 ms", "#7")
    assert press(shown, "ArrowRight").startswith("scan 8,")
    shown.wait_for_function("location.hash == '#8'")


def test_steps_inside_a_scan(shown: Any) -> None:
    press(shown, "ArrowRight")
    assert press(shown, "ArrowDown").startswith("scan 1, 10 ms, step 1 of ")
    assert shown.inner_text("#rows tr.now").strip() == "inputs"
    press(shown, "ArrowDown")
    assert "→" in shown.inner_text("#rows tr.now td.changes")
    assert press(shown, "ArrowUp", "ArrowUp").startswith("scan 0, 0 ms, step ")
    shown.check("#every")
    where(shown)
    assert shown.locator("#rows tbody tr").count() > 50


def test_a_pinned_variable_has_a_column(shown: Any) -> None:
    shown.click(".label[title='Main.Step'] .pin")
    for _ in range(SENDING):
        shown.keyboard.press("ArrowRight")
    where(shown)
    assert shown.inner_text("#rows th:nth-child(2)") == "Main.Step"
    cells = shown.locator("#rows td:nth-child(2)").all_inner_texts()
    assert (cells[0], cells[-1]) == ("Connecting", "Reading")


def test_the_next_change_of_a_variable(shown: Any) -> None:
    shown.click(".label[title='Main.Step'] button")
    assert press(shown, "n").startswith(f"scan {SENDING},")
    assert press(shown, "n", "p").startswith(f"scan {SENDING},")
    assert press(shown, "p").startswith(f"scan {SENDING},")


def test_the_units_words_bit_by_bit(shown: Any) -> None:
    for _ in range(SENDING):
        shown.keyboard.press("ArrowRight")
    where(shown)
    word = shown.locator("[data-word='CIO 1519']")
    assert word.locator(".bits .on").all_inner_texts() == ["3"]
    assert "Send Request Switch" in word.inner_text()
    assert "ESTABLISHED" in shown.inner_text("[data-word='D30009']")
    shown.click("#areas [data-area=D]")
    press(shown, "End")
    assert "03E8" in shown.inner_text("#words")
    shown.uncheck("#hex")
    where(shown)
    assert "1000" in shown.inner_text("#words")


def test_frames_are_taken_apart_and_lead_to_their_scan(shown: Any) -> None:
    rows = shown.locator("#passed li")
    assert "03 read holding registers, address 0, quantity 10" in rows.nth(2).inner_text()
    assert "00 01 00 00 00 06 01 03 00 00 00 0A" in rows.nth(2).inner_text()
    rows.nth(2).locator("button").click()
    assert where(shown).startswith(f"scan {SENDING},")


def test_the_filter_and_only_what_changes(shown: Any) -> None:
    press(shown, "/")
    shown.keyboard.type("main done")
    where(shown)
    assert shown.eval_on_selector_all(".label", "rows => rows.map(row => row.title)") == ["Main.Done"]
    shown.fill("#filter", "")
    everything = len(labels_of(shown))
    shown.check("#moving")
    shown.wait_for_function("window.fbvm.written()")
    assert 0 < shown.locator(".label").count() <= everything


def test_pointer_wheel_and_zoom(shown: Any) -> None:
    box = shown.locator("#canvas").bounding_box()
    left = shown.evaluate("document.getElementById('labels').offsetWidth")
    shown.mouse.click(box["x"] + left + (box["width"] - left) * 0.5, box["y"] + 60)
    middle = int(where(shown).split()[1].rstrip(","))
    assert SCANS * 0.4 < middle < SCANS * 0.6
    press(shown, "+", "+")
    shown.mouse.click(box["x"] + left + 5, box["y"] + 60)
    assert int(where(shown).split()[1].rstrip(",")) > 5
    press(shown, "0")
    shown.mouse.click(box["x"] + left + 2, box["y"] + 60)
    assert where(shown).startswith("scan 0,")


def test_the_keys_are_listed(shown: Any) -> None:
    press(shown, "?")
    assert shown.locator("#help").is_visible()
    shown.keyboard.press("Escape")
    assert not shown.locator("#help").is_visible()


LADDER = """
PROGRAM Main
LADDER
RUNG 1 Seal-in
    LD 0.00
    OR 100.00
    OUT 100.00
RUNG 2
    LD 0.01
    OUT 100.01
END_LADDER
END_PROGRAM
"""


def lit(made: Any) -> int:
    """How much of the rungs shows power."""
    drawn = made.locator("#ladder path.power").evaluate_all("paths => paths.map(path => path.getTotalLength())")
    return round(sum(drawn))


def test_rungs_are_drawn_with_their_power(browser: Any, tmp_path: Path) -> None:
    image = compile_text(LADDER).image
    assert image is not None
    plc, file = Plc(image), io.BytesIO()
    writer = TraceWriter(plc, file, Depth.STATEMENTS)
    plc.run(scans=3)
    plc.write("CIO 0.00", True)
    plc.run(scans=3)
    writer.close()
    (tmp_path / "rungs.html").write_text(page(page_data(Trace(io.BytesIO(file.getvalue())))), encoding="utf-8")
    made = opened(browser, (tmp_path / "rungs.html").as_uri())
    assert made.locator("#ladder pre").count() == 2
    assert "Seal-in" in made.locator("#ladder pre").first.inner_text()
    assert made.locator("#ladder pre svg.rung").count() == 2
    still = lit(made)
    for _ in range(4):
        made.keyboard.press("ArrowRight")
    where(made)
    assert lit(made) > still > 0
    made.uncheck("#power")
    where(made)
    assert made.locator("#ladder pre").count() == 0
    assert made.complaints == []
    made.context.close()


def test_light_and_dark(browser: Any, url: str) -> None:
    colours = []
    for scheme in ("light", "dark"):
        made = opened(browser, url, color_scheme=scheme)
        where(made)
        painted = "[...document.getElementById('canvas').getContext('2d').getImageData(5, 5, 1, 1).data].join()"
        colours.append((made.evaluate("getComputedStyle(document.body).backgroundColor"), made.evaluate(painted)))
        made.context.close()
    assert colours[0][0] != colours[1][0]
    assert colours[0][1] != colours[1][1]


def test_on_a_phone(browser: Any, url: str) -> None:
    made = opened(browser, url, viewport={"width": 390, "height": 800}, is_mobile=True, has_touch=True)
    where(made)
    assert made.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert made.locator("#scan").is_visible() and not made.locator("#memory").is_visible()
    made.tap("[data-panel=memory]")
    where(made)
    assert made.locator("#memory").is_visible() and not made.locator("#scan").is_visible()
    made.tap("[data-move=on]")
    assert where(made) == "scan 1, 10 ms"
    assert made.complaints == []
    made.context.close()
