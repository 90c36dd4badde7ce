"""The data of a page: every value of every scan, in a few kilobytes; and the picture in SVG."""

from __future__ import annotations

import base64
import io
import json
import re
import zlib
from typing import Any
from xml.etree import ElementTree

import pytest
from trace_rig import image, record, traced

from fbvm.machine.plc import Plc
from fbvm.record.draw.svg import SvgChart
from fbvm.record.page import data as module
from fbvm.record.page.data import page_data
from fbvm.record.page.page import page
from fbvm.record.recording.recording import Recording
from fbvm.record.recording.scans import RecordedScans
from fbvm.record.trace.packets import Packet
from fbvm.record.trace.reader import Trace
from fbvm.record.trace.recorder import Signal
from fbvm.record.trace.signals import waveforms
from fbvm.record.trace.writer import Depth
from fbvm.watch.paths import Place, UnknownPlace
from fbvm.wire.link import Peer


def value_in(changes: list[Any], scan: int) -> Any:
    """The value of the last change at or before a scan."""
    return [value for at, value in zip(changes[::2], changes[1::2], strict=True) if at <= scan][-1]


def text(trace: Trace, name: str, scan: int) -> str:
    place = trace.find(name)
    assert isinstance(place, Place)
    value = trace.at(scan).read(place)
    return str(int(value)) if isinstance(value, bool) else Signal(place, name).display(value)


@pytest.mark.slow
@pytest.mark.parametrize("depth", list(Depth))
def test_every_value_of_every_scan_is_there(depth: Depth) -> None:
    trace = traced(160, depth)
    data = page_data(trace)
    assert data["scans"] == [0, 160]
    assert len(data["times"]) == 160
    for scan in (0, 3, 7, 8, 149, 159):
        for signal in data["signals"]:
            assert value_in(signal["changes"], scan) == text(trace, signal["name"], scan), (signal["name"], scan)
        for address in (199, 200):
            changes = data["words"]["D"].get(str(address), [0, 0])
            assert value_in(changes, scan) == trace.at(scan).read(f"D{address}")


@pytest.mark.parametrize("depth", [Depth.WRITES, Depth.STATEMENTS])
def test_the_rows_of_a_scan_lead_from_one_end_to_the_next(depth: Depth) -> None:
    data = page_data(traced(20, depth))
    for scan in range(1, 20):
        known = [value_in(signal["changes"], scan - 1) for signal in data["signals"]]
        for _, _, *moved in data["rows"][str(scan)]:
            assert module.POWER not in moved[::2]
            for number, now in zip(moved[::2], moved[1::2], strict=True):
                assert known[number] != now
                known[number] = now
        assert known == [value_in(signal["changes"], scan) for signal in data["signals"]]


def test_a_row_says_which_statement_it_was() -> None:
    data = page_data(traced(20, Depth.STATEMENTS))
    pump = next(number for number, signal in enumerate(data["signals"]) if signal["name"] == "Main.Pump")
    [row] = [row for row in data["rows"]["8"] if pump in row[2::2]]
    assert data["sites"][row[0]] == ["pump.st", 17, "Pump := Delay.Q;"]
    assert data["instances"][row[1]] == "Main"
    assert data["rows"]["3"][0][0] == -1  # the button was pressed between the scans
    assert data["names"]["CIO 100.00"] == "Main.Pump"


def test_where_power_flows_in_rungs() -> None:
    text = "PROGRAM Main\nLADDER\n    LD 0.00\n    ANDNOT 0.01\n    OUT 100.00\nEND_LADDER\nEND_PROGRAM\n"
    plc = Plc(image(text))
    data = page_data(Trace(io.BytesIO(record(plc, 5, Depth.STATEMENTS))))
    flows = {scan: [(data["sites"][row[0]][1], row[3]) for row in data["rows"][scan] if row[2:3] == [module.POWER]]
             for scan in ("2", "3")}  # fmt: skip
    assert [data["pictures"][number].split("\n")[1].count('<path class="power"') for _, number in data["ladder"]["3"]] == [2]
    assert data["ladder"]["2"] == data["ladder"]["1"] != data["ladder"]["3"]
    assert len(data["pictures"]) == 2
    assert flows == {"2": [(3, "0"), (4, "1"), (5, "0")], "3": [(3, "1"), (4, "1"), (5, "1")]}


def test_charts_are_drawn_as_they_were_in_each_scan() -> None:
    text = """PROGRAM Main VAR x : BOOL; END_VAR INITIAL_STEP a: END_STEP
        TRANSITION FROM a TO b := TRUE; END_TRANSITION STEP b: x(N); END_STEP END_PROGRAM"""
    data = page_data(Trace(io.BytesIO(record(Plc(image(text)), 4, Depth.STATEMENTS))))
    drawn = {scan: data["pictures"][number].splitlines() for scan, ((_, number),) in data["ladder"].items()}
    assert {lines[0] for lines in drawn.values()} == {"PROGRAM Main"}
    assert not [signal["name"] for signal in data["signals"] if "$" in signal["name"]]
    steps = {scan: re.findall(r">(●)?</text><text[^>]*> (\w)<", lines[1]) for scan, lines in drawn.items()}
    assert [steps[scan] for scan in "0123"] == [[("●", "a")], *[[("●", "b")]] * 3]
    assert [lines[1].count('<path class="power"') for lines in drawn.values()] == [0, 1, 1, 1]
    assert "→ TRUE" in "\n".join(drawn["1"]) and drawn["2"] == drawn["3"] and len(data["pictures"]) == 3


@pytest.mark.slow
def test_names_and_scans_choose() -> None:
    data = page_data(traced(100), ["Main.Pump", "D200"], range(10, 20))
    assert [signal["name"] for signal in data["signals"]] == ["Main.Pump", "D200"]
    assert data["scans"] == [10, 10]
    assert page_data(traced(10), prefix="Main.", pinned=["Main.Pump"])["pinned"] == ["Pump"]
    with pytest.raises(UnknownPlace):
        page_data(traced(3), ["Main.Nobody"])


@pytest.mark.slow
def test_of_too_much_the_latest_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_ROWS", 100)
    rows = page_data(traced(60, Depth.STATEMENTS))["rows"]
    assert "59" in rows and "0" not in rows
    assert sum(map(len, rows.values())) <= 100


def test_a_trace_without_scans_and_one_with_a_late_beginning() -> None:
    assert page_data(traced(0))["scans"] == [0, 0]
    plc = Plc(image())
    plc.run(scans=7)
    assert page_data(Trace(io.BytesIO(record(plc, 5))))["scans"] == [7, 5]


def test_the_page_holds_everything_and_asks_for_nothing() -> None:
    data = page_data(traced(30, Depth.STATEMENTS), title="a <run> & {{data}}")
    made = page(data)
    assert "<title>a &lt;run&gt; &amp; " in made
    assert not re.search(r"https?://|src=|@import|url\(", made)
    found = re.search(r'id="data">([^<]*)<', made)
    assert found
    assert json.loads(zlib.decompress(base64.b64decode(found[1]))) == json.loads(json.dumps(data))


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


@pytest.mark.slow
def test_a_long_run_stays_a_picture() -> None:
    svg = drawn(traced(3000), "CIO 0.00")
    assert float(svg.get("width", 0)) < 2000


def test_a_scan_with_very_many_statements_is_shown_in_part(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scan 2 of 5 passes its loop a hundred times; its first rows are there, its end, and all of the other scans."""
    monkeypatch.setattr(module, "MOST_IN_SCAN", 60)
    monkeypatch.setattr(module, "FIRST_IN_SCAN", 20)
    compiled = image("PROGRAM Main\nVAR n, i, last, sum : INT; END_VAR\nn := n + 1;\nlast := SEL(n = 3, 2, 100);\n"
                     "FOR i := 1 TO last DO sum := sum + i; END_FOR;\nEND_PROGRAM\n")  # fmt: skip
    plc = Plc(compiled, engine="python")
    recorded = Recording().add("main", plc)
    plc.run(scans=5)
    data = page_data(RecordedScans(recorded, {}))
    rows = {int(scan): len(found) for scan, found in data["rows"].items()}
    assert rows[2] <= 21
    assert {scan for scan, count in rows.items() if count > 1} == {0, 1, 2, 3, 4}
    changes = next(signal["changes"] for signal in data["signals"] if signal["name"] == "Main.sum")
    assert value_in(changes, 2) == "5056"
    assert value_in(changes, 4) == "5062"
