"""What the head of a page says: which signals in which order, which columns are kept, which scans have rows."""

from __future__ import annotations

import io
from itertools import groupby
from types import SimpleNamespace
from typing import Any

import pytest
from trace_rig import image, record, traced

from fbvm.machine.plc import Plc
from fbvm.net.loop import LoopNetwork
from fbvm.record.page import data as module
from fbvm.record.page.data import _in_order, _located, _windows, frame_rows, page_data
from fbvm.record.page.inside import Window
from fbvm.record.trace.packets import Packet
from fbvm.record.trace.reader import Trace
from fbvm.record.trace.writer import Depth
from fbvm.units.etn21.unit import Etn21
from fbvm.wire.link import Peer

DEEP = """FUNCTION_BLOCK Deep VAR t : TON; k : INT; END_VAR k := k + 1; t(IN := TRUE, PT := T#1s); END_FUNCTION_BLOCK
VAR_GLOBAL g : INT; END_VAR
PROGRAM Main VAR d : Deep; n : INT; a AT D7 : WORD; END_VAR d(); n := n + 1; a := 5; END_PROGRAM"""


@pytest.mark.slow
def test_signals_come_from_the_programs_to_what_lies_deeper() -> None:
    plc = Plc(image(DEEP))
    plc.attach(Etn21(0, "192.168.250.21"), LoopNetwork())
    trace = Trace(io.BytesIO(record(plc, 3)))
    signals = _in_order(trace)
    names = [signal.place.name if not signal.place.area else "address" for signal in signals]
    timer = [f"Main.d.t.{name}" for name in ("IN", "PT", "Q", "ET", "Running", "Start")]
    assert [name for name, _ in groupby(names)] == [
        "Main.n", "Main.a", "Main.d.k", "address", "g", *timer]
    assert list(_located(trace, signals)) == [("D7", "Main.a")]


def test_a_row_of_a_packet_is_scan_time_from_to_info_and_bytes() -> None:
    one, other = Peer("192.168.250.1", 502), Peer("192.168.250.2", 1025)
    assert frame_rows([(3, Packet(30, one, other, "said", b"\x01\xff"))]) == [
        [3, 30, "192.168.250.1:502", "192.168.250.2:1025", "said", "01ff"]]


@pytest.mark.slow
def test_of_many_signals_those_that_change_are_kept_and_those_that_were_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    trace = traced(12)
    every = [signal["name"] for signal in page_data(trace).head["signals"]]
    for few, kept in ((len(every), every), (len(every) - 1, ["Main.Start", "Main.Pump"])):
        monkeypatch.setattr(module, "FEW_SIGNALS", few)
        found = [signal["name"] for signal in page_data(trace).head["signals"]]
        assert found == every if kept is every else set(kept) < set(found) < set(every), few
    monkeypatch.setattr(module, "FEW_SIGNALS", 0)
    still = ["Main.Few", "Main.Both[1].a"]
    assert [signal["name"] for signal in page_data(trace, still).head["signals"]] == still
    pinned = page_data(trace, pinned=["Main.Few"]).head
    assert "Main.Few" in [signal["name"] for signal in pinned["signals"]] and pinned["pinned"] == ["Main.Few"]


class Told:
    """In place of what makes windows: each scan has so many rows; keeps what it was asked for."""

    def __init__(self, rows_a_scan: int) -> None:
        self.rows_a_scan, self.asked = rows_a_scan, list[tuple[range, int, bool]]()

    def window(self, scans: range, most: int, known: Any = None) -> Window:
        self.asked.append((scans, most, known is not None))
        rows = {scan: [[0]] * self.rows_a_scan for scan in scans} if self.rows_a_scan else {}
        return SimpleNamespace(scans=scans, rows=rows, count=len(scans) * self.rows_a_scan)  # type: ignore[return-value]


def windows(scans: range, rows_a_scan: int, depth: Depth = Depth.STATEMENTS) -> tuple[list[range], list[tuple[range, int, bool]]]:
    told = Told(rows_a_scan)
    found = _windows(SimpleNamespace(depth=depth), told, scans, [], [])  # type: ignore[arg-type]
    return [window.scans for window in found], told.asked


def test_scans_get_as_many_rows_as_there_is_room_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """The last four are looked at first: they tell how many rows a scan has."""
    monkeypatch.setattr(module, "MOST_ROWS", 100)
    assert windows(range(0), 10) == windows(range(9), 10, Depth.SCANS) == ([], [])
    assert windows(range(5, 9), 10) == ([range(5, 9)], [(range(5, 9), 100, False)])
    probe = (range(6, 10), 100, False)
    assert windows(range(10), 10) == ([range(10)], [probe, (range(10), 100, True)])
    assert windows(range(11), 10)[1][1:] == [(range(6, 11), 100, True), (range(5), 50, False)]
    assert windows(range(1000), 0) == ([range(50), range(950, 1000)], [
        (range(996, 1000), 100, False), (range(950, 1000), 100, True), (range(50), 100, False)])
    assert windows(range(1000), 40)[1][1:] == [(range(998, 1000), 100, True), (range(2), 20, False)]
    assert windows(range(1000), 60)[1][1:] == [(range(998, 1000), 100, True)], "there is no room for more"
