"""The data of a page: every value of every scan, in a few kilobytes; and the picture in SVG."""

from __future__ import annotations

import io
import json
import re
import struct
from math import inf, nan
from types import SimpleNamespace
from xml.etree import ElementTree

import pytest
from page_rig import NUMBERS, ReadPage
from trace_rig import image, record, traced

from fbvm.machine.plc import Plc
from fbvm.record.draw.svg import SvgChart
from fbvm.record.page import columns, inside
from fbvm.record.page import data as module
from fbvm.record.page.cells import BIT, TEXT, Cell, cell_of
from fbvm.record.page.data import page_data
from fbvm.record.page.inside import POWER, text_of
from fbvm.record.page.page import page
from fbvm.record.recording.recording import Recording
from fbvm.record.recording.scans import RecordedScans
from fbvm.record.trace.events import NetworkEvent
from fbvm.record.trace.packets import Packet
from fbvm.record.trace.reader import Trace
from fbvm.record.trace.recorder import Signal
from fbvm.record.trace.scan_source import Follower
from fbvm.record.trace.signals import waveforms
from fbvm.record.trace.writer import Depth
from fbvm.watch.paths import Place, UnknownPlace
from fbvm.wire.link import Peer
from fbvm.wire.tap import TapEvent, TapKind


def text(trace: Trace, name: str, scan: int) -> str:
    place = trace.find(name)
    assert isinstance(place, Place)
    value = trace.at(scan).read(place)
    return str(int(value)) if isinstance(value, bool) else Signal(place, name).display(value)


@pytest.mark.slow
@pytest.mark.parametrize("depth", list(Depth))
def test_every_value_of_every_scan_is_there(depth: Depth) -> None:
    trace = traced(160, depth)
    read = ReadPage(page_data(trace))
    assert read.head["scans"] == [0, 160]
    assert read.times == [moment.now_ns for moment in trace.moments()]
    for scan in (0, 3, 7, 8, 149, 159):
        for signal in read.head["signals"]:
            place = trace.find(signal["name"])
            is_text = read.head["columns"][signal["cell"]]["code"] == "text"
            wanted = text(trace, signal["name"], scan) if is_text else trace.at(scan).read(place)
            assert read.value(signal, scan) == wanted, (signal["name"], scan)
        for address in (199, 200):
            assert read.word("D", address, scan) == trace.at(scan).read(f"D{address}")


@pytest.mark.slow
def test_values_in_blocks_are_those_of_the_trace(monkeypatch: pytest.MonkeyPatch) -> None:
    """Numbers of every size, bits and texts, over several blocks; in some of them nothing changes."""
    monkeypatch.setattr(columns, "BLOCK_SCANS", 7)
    plc = Plc(image(NUMBERS))
    recorded = Recording().add("main", plc)
    plc.run(scans=60)
    plc.write("D7", 5)
    plc.run(scans=5)
    source = RecordedScans(recorded, {})
    read = ReadPage(page_data(source))
    assert len(read.head["blocks"]) > 8 and sum(read.head["blocks"]) == 65
    for signal in read.head["signals"]:
        place = source.find(signal["name"])
        is_text = read.head["columns"][signal["cell"]]["code"] == "text"
        found = read.values(signal["name"])
        wanted = [text_of(source, Signal(place, ""), moment) if is_text else moment.read(place) for moment in source.moments()]
        assert found == wanted, signal["name"]
    assert [read.word("D", 7, scan) for scan in (0, 59, 60, 64)] == [0, 0, 5, 5]
    assert read.word("D", 8, 60) == 0


@pytest.mark.slow
@pytest.mark.parametrize("depth", [Depth.WRITES, Depth.STATEMENTS])
def test_the_rows_of_a_scan_lead_from_one_end_to_the_next(depth: Depth) -> None:
    trace = traced(20, depth)
    read = ReadPage(page_data(trace))
    names = [signal["name"] for signal in read.head["signals"]]
    for scan in range(1, 20):
        known = [text(trace, name, scan - 1) for name in names]
        for _, _, *moved in read.rows[scan]:
            assert POWER not in moved[::2]
            for number, now in zip(moved[::2], moved[1::2], strict=True):
                assert known[number] != now
                known[number] = now
        assert known == [text(trace, name, scan) for name in names]


@pytest.mark.slow
def test_a_row_says_which_statement_it_was() -> None:
    read = ReadPage(page_data(traced(20, Depth.STATEMENTS)))
    pump = next(number for number, signal in enumerate(read.head["signals"]) if signal["name"] == "Main.Pump")
    [row] = [row for row in read.rows[8] if pump in row[2::2]]
    assert read.head["sites"][row[0]] == ["pump.st", 17, "Pump := Delay.Q;"]
    assert read.head["instances"][row[1]] == "Main"
    assert read.rows[3][0][0] == -1  # the button was pressed between the scans
    assert read.head["names"]["CIO 100.00"] == "Main.Pump"


def test_where_power_flows_in_rungs() -> None:
    text = "PROGRAM Main\nLADDER\n    LD 0.00\n    ANDNOT 0.01\n    OUT 100.00\nEND_LADDER\nEND_PROGRAM\n"
    plc = Plc(image(text))
    read = ReadPage(page_data(Trace(io.BytesIO(record(plc, 5, Depth.STATEMENTS)))))
    flows = {scan: [(read.head["sites"][row[0]][1], row[3]) for row in read.rows[scan] if row[2:3] == [POWER]]
             for scan in (2, 3)}  # fmt: skip
    assert [read.pictures[number].split("\n")[1].count('<path class="power"') for _, number in read.ladder[3]] == [2]
    assert read.ladder[2] == read.ladder[1] != read.ladder[3]
    assert len(read.pictures) == 2
    assert flows == {2: [(3, "0"), (4, "1"), (5, "0")], 3: [(3, "1"), (4, "1"), (5, "1")]}


@pytest.mark.slow
def test_charts_are_drawn_as_they_were_in_each_scan() -> None:
    text = """PROGRAM Main VAR x : BOOL; END_VAR INITIAL_STEP a: END_STEP
        TRANSITION FROM a TO b := TRUE; END_TRANSITION STEP b: x(N); END_STEP END_PROGRAM"""
    read = ReadPage(page_data(Trace(io.BytesIO(record(Plc(image(text)), 4, Depth.STATEMENTS)))))
    drawn = {scan: read.pictures[number].splitlines() for scan, ((_, number),) in read.ladder.items()}
    assert {lines[0] for lines in drawn.values()} == {"PROGRAM Main"}
    assert not [signal["name"] for signal in read.head["signals"] if "$" in signal["name"]]
    steps = {scan: re.findall(r">(●)?</text><text[^>]*> (\w)<", lines[1]) for scan, lines in drawn.items()}
    assert [steps[scan] for scan in range(4)] == [[("●", "a")], *[[("●", "b")]] * 3]
    assert [lines[1].count('<path class="power"') for lines in drawn.values()] == [0, 1, 1, 1]
    assert "→ TRUE" in "\n".join(drawn[1]) and drawn[2] == drawn[3] and len(read.pictures) == 3


@pytest.mark.slow
def test_names_and_scans_choose() -> None:
    head = page_data(traced(100), ["Main.Pump", "D200"], range(10, 20)).head
    assert [signal["name"] for signal in head["signals"]] == ["Main.Pump", "D200"]
    assert head["scans"] == [10, 10]
    assert page_data(traced(10), prefix="Main.", pinned=["Main.Pump"]).head["pinned"] == ["Pump"]
    with pytest.raises(UnknownPlace):
        page_data(traced(3), ["Main.Nobody"])


@pytest.mark.slow
def test_of_too_much_there_are_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    """At the end, at the beginning, around the change of a variable that somebody asked about, and where it is wanted."""
    monkeypatch.setattr(module, "MOST_ROWS", 400)
    trace = traced(160, Depth.STATEMENTS)
    read = ReadPage(page_data(trace, pinned=["Main.Pump"], inside=[range(60, 64)]))
    windows = [range(first, last + 1) for first, last in read.head["windows"]]
    assert sorted(read.rows) == [scan for window in windows for scan in window]
    assert {0, 7, 8, 9, 60, 61, 62, 63, 150, 151, 152, 159} <= set(read.rows)
    assert not {30, 100, 140} & set(read.rows)
    assert sum(map(len, read.rows.values())) <= 400
    assert read.values("Main.Pump") == [8 <= scan < 150 for scan in range(160)]
    for scan in (60, 150):  # the first row of a window starts from what was before it
        moved = {read.head["signals"][row[at]]["name"] for row in read.rows[scan] for at in range(2, len(row), 2)}
        assert ("Main.Pump" in moved) == (scan == 150)


@pytest.mark.slow
def test_a_trace_without_scans_and_one_with_a_late_beginning() -> None:
    assert page_data(traced(0)).head["scans"] == [0, 0]
    plc = Plc(image())
    plc.run(scans=7)
    assert page_data(Trace(io.BytesIO(record(plc, 5)))).head["scans"] == [7, 5]


@pytest.mark.slow
def test_the_page_holds_everything_and_asks_for_nothing() -> None:
    data = page_data(traced(30, Depth.STATEMENTS), title="a <run> & {{data}}")
    made = page(data)
    assert "<title>a &lt;run&gt; &amp; " in made
    assert not re.search(r"https?://|src=|@import|url\(", made)
    read = ReadPage.of_html(made)
    assert read.head == json.loads(json.dumps(data.head))
    assert read.columns == ReadPage(data).columns
    assert read.rows[29] == ReadPage(data).rows[29] != []


# --- SVG --------------------------------------------------------------------------------------------------------------

SPACE = "{http://www.w3.org/2000/svg}"


def drawn(trace: Trace, *names: str, passed: tuple[tuple[int, Packet], ...] = ()) -> ElementTree.Element:
    return ElementTree.fromstring(SvgChart(waveforms(trace, names), passed, "a <run>").text())


def test_bits_are_bars_and_numbers_steps() -> None:
    svg = drawn(traced(20), "CIO 0.00", "Main.Starts.CV", "Main.Mode")
    [bar] = [row for row in svg.iter(f"{SPACE}rect") if row.get("class") == "on"]
    step = 1000 / 20
    assert float(bar.get("width", 0)) == pytest.approx(min(40.0, step) * 17, abs=0.1)
    texts = [row.text for row in svg.iter(f"{SPACE}text")]
    assert {"CIO0.00", "Main.Starts.CV", "0", "1", "Low", "High", "scan", "time"} <= set(texts)
    assert svg.findtext(f"{SPACE}title") == "a <run>"


def test_frames_are_arrows() -> None:
    unit, server = Peer("192.168.250.21", 1), Peer("192.168.250.1", 502)
    passed = ((3, Packet(0, unit, server, "asks & waits")), (4, Packet(0, server, unit, "answers")),
              (99, Packet(0, unit, server, "behind the end")))  # fmt: skip
    svg = drawn(traced(20), "D200", passed=passed)
    arrows = [row for row in svg.iter(f"{SPACE}path") if row.get("class") in ("in", "out")]
    assert [(row.get("class"), row.findtext(f"{SPACE}title")) for row in arrows] == [
        ("out", "scan 3: 192.168.250.21:1 -> 192.168.250.1:502  asks & waits"),
        ("in", "scan 4: 192.168.250.1:502 -> 192.168.250.21:1  answers"),
    ]
    assert float(svg.get("height", 0)) > float(drawn(traced(20), "D200").get("height", 0)), "they have a row of their own"


@pytest.mark.slow
def test_a_long_run_stays_a_picture() -> None:
    svg = drawn(traced(3000), "CIO 0.00")
    assert float(svg.get("width", 0)) < 2000


@pytest.mark.slow
def test_a_scan_with_very_many_statements_is_shown_in_part(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scan 2 of 5 passes its loop a hundred times; its first rows are there, its end, and all of the other scans."""
    monkeypatch.setattr(inside, "MOST_IN_SCAN", 60)
    monkeypatch.setattr(inside, "FIRST_IN_SCAN", 20)
    compiled = image("PROGRAM Main\nVAR n, i, last, sum : INT; END_VAR\nn := n + 1;\nlast := SEL(n = 3, 2, 100);\n"
                     "FOR i := 1 TO last DO sum := sum + i; END_FOR;\nEND_PROGRAM\n")  # fmt: skip
    plc = Plc(compiled, engine="python")
    recorded = Recording().add("main", plc)
    plc.run(scans=5)
    read = ReadPage(page_data(RecordedScans(recorded, {})))
    rows = {scan: len(found) for scan, found in read.rows.items()}
    assert rows[2] <= 21
    assert {scan for scan, count in rows.items() if count > 1} == {0, 1, 2, 3, 4}
    assert read.rows[2][-1] == [-3, -1, 1, "101", 3, "5056"]
    assert read.rows[3][:3] == [[-1, -1], [0, 0, 0, "4"], [1, 0, 2, "2"]], "what scan 3 has changed is not told before it"
    values = read.values("Main.sum")
    assert values[2] == 5056
    assert values[4] == 5062


def test_a_long_scan_in_front_of_a_window_is_left_at_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its rows are not shown, so the window begins with its own first scan."""
    monkeypatch.setattr(inside, "MOST_IN_SCAN", 60)
    plc = Plc(image("PROGRAM Main\nVAR i, k, n : INT; END_VAR\nn := n + 1;\n"
                    "FOR i := 1 TO SEL(n = 3, 2, 100) DO k := i; END_FOR;\nEND_PROGRAM\n"), engine="python")  # fmt: skip
    recorded, followed = Recording().add("main", plc), []

    class Source(RecordedScans):
        def follow(self, follower: Follower, scans: range | None = None) -> None:
            followed.append(scans)
            super().follow(follower, scans)

    plc.run(scans=5)
    source = Source(recorded, {})
    window = inside.Insides(source, []).window(range(3, 5), 1000)
    assert list(window.rows) == [3, 4]
    assert followed == [range(2, 5), range(3, 5)]


def test_of_a_scan_that_is_shown_in_part_the_end_is_told_and_the_next_begins_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inside, "MOST_IN_SCAN", 20)
    monkeypatch.setattr(inside, "FIRST_IN_SCAN", 2)
    plc = Plc(image("PROGRAM Main\nVAR i, n, sum : INT; END_VAR\nn := n + 1;\n"
                    "FOR i := 1 TO SEL(n = 3, 2, 30) DO sum := sum + 1; END_FOR;\nEND_PROGRAM\n"), engine="python")  # fmt: skip
    recorded = Recording().add("main", plc)
    plc.run(scans=5)
    source = RecordedScans(recorded, {})
    shown = [Signal(place, name) for name in ("n", "sum") if isinstance(place := plc.find(f"Main.{name}"), Place)]
    window = inside.Insides(source, shown).window(range(1, 5), 1000)
    phases = {scan: [(where, moved) for where, _, *moved in rows if where < 0] for scan, rows in window.rows.items()}
    assert phases == {1: [(-1, [])], 2: [(-1, []), (-3, [1, "34"])], 3: [(-1, [])], 4: [(-1, [])]}
    assert [moved for _, _, *moved in window.rows[3] if moved] == [[0, "4"], [1, "35"], [1, "36"]]


def test_packets_are_told_in_parts_with_their_first_and_last_scan(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "FRAMES_A_PART", 2)
    ends = module._Ends(None)  # type: ignore[arg-type]
    unit, peer = Peer("192.168.250.21", 502), Peer("10.0.0.1", 1024)
    for scan in (3, 4, 7):
        moment = SimpleNamespace(scans=scan)
        ends.event(moment, NetworkEvent(1, TapEvent(TapKind.SYN, unit, peer, True)))  # type: ignore[arg-type]
    ends.end()
    assert ends.frames == [[3, 4, 2], [7, 7, 1]]
    assert len(ends.parts) == 2 and ends.own == "192.168.250.21:502"


def test_a_text_is_read_again_where_any_of_its_bytes_changed() -> None:
    texts = columns.Texts(Cell(TEXT, columns.LINE - 1, signal=7, size=2), "first")
    asked: list[int] = []

    def text(signal: int, moment: object) -> str:
        asked.append(signal)
        return f"text {len(asked)}"

    for moved in ({2}, {0}, {1}):
        texts.add(None, moved, text)  # type: ignore[arg-type]
    assert asked == [7, 7]
    assert list(texts.values) == [0, 1, 2]


def test_numbers_are_columns_and_what_is_behind_a_reference_is_text() -> None:
    plc = Plc(image(NUMBERS))

    def code(name: str) -> str:
        place = plc.find(name)
        assert isinstance(place, Place)
        return cell_of(Signal(place, ""), 0).code

    found = {name: code(f"Main.{name}") for name in ("n", "dw", "low", "r", "text", "day", "p", "p^")}
    assert found == {"n": "i16", "dw": "u32", "low": BIT, "r": "f32", "text": TEXT, "day": TEXT, "p": TEXT, "p^": TEXT}


def test_the_ends_of_a_column_are_of_numbers_that_are_some() -> None:
    def extremes(*values: float) -> tuple[float, float]:
        return columns._extremes(struct.pack(f"<{len(values)}d", *values), "f64")

    assert extremes(nan, 1.5, inf, -2.0) == (-2.0, 1.5)
    assert extremes(nan, -inf) == (0.0, 0.0)
    assert extremes(3.0, 1.0, 2.0) == (1.0, 3.0)
