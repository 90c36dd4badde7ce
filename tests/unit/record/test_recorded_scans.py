"""Charts, tables and causes of a recording in memory are those of a trace that was written while it ran."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from trace_rig import image, press

from fbvm import Etn21, LoopNetwork, Plc, compile_files, compile_text
from fbvm.net.peers import ModbusPeer
from fbvm.record.draw.chart import draw
from fbvm.record.draw.table import ScanTable
from fbvm.record.draw.why import cause_text, why
from fbvm.record.page.data import page_data
from fbvm.record.recording.recording import Recording
from fbvm.record.recording.scans import RecordedScans
from fbvm.record.trace.reader import Trace
from fbvm.record.trace.scan_source import ScanSource
from fbvm.record.trace.signals import network_events, waveforms
from fbvm.record.trace.writer import Depth, TraceWriter
from fbvm.units.port.noc import Noc
from fbvm.watch.paths import Place
from fbvm.wire.link import Peer
from fbvm.wire.registers import server


def both(plc: Plc, scans: int, depth: Depth = Depth.STATEMENTS, *, presses: bool = True) -> tuple[RecordedScans, Trace]:
    """A run, recorded in memory and as a trace."""
    file = io.BytesIO()
    recorded, writer = Recording().add("plc", plc), TraceWriter(plc, file, depth)
    for _ in range(scans):
        if presses:
            press(plc)
        plc.scan()
        if plc.trap:
            break
    writer.close()
    return RecordedScans(recorded, {}, depth=depth), Trace(io.BytesIO(file.getvalue()))


def exchanging(path: str, unit: Etn21 | Noc) -> Plc:
    """A program whose unit talks with a server in memory."""
    made = compile_files([Path(path)]).image
    assert made is not None
    plc, network = Plc(made), LoopNetwork(3)
    network.place(Peer("192.168.250.1", 502), ModbusPeer(server()))
    plc.attach(unit, network)
    return plc


def drawings(source: ScanSource) -> list[object]:
    """What is drawn of some scans."""
    names = ["Main.Start", "Main.Pump", "D200"]
    signals = [track.signal for track in waveforms(source, names).tracks]
    table = ScanTable(source.sites, source.names, signals)
    source.follow(table, range(5, 30))
    place = source.find("Main.Pump")
    return [draw(waveforms(source, names)), table.draw(), page_data(source), source.scans,
            cause_text(source, why(source, place, 35))]  # type: ignore[arg-type]  # fmt: skip


@pytest.mark.slow
def test_drawings_are_those_of_a_trace() -> None:
    recorded, trace = both(Plc(image()), 40)
    assert drawings(recorded) == drawings(trace)


@pytest.mark.slow
def test_a_scan_that_traps_has_an_end() -> None:
    made = compile_text("PROGRAM Main VAR n : INT := 5; END_VAR n := n - 1; n := 100 / n; n := 5 - n; END_PROGRAM").image
    assert made is not None
    recorded, trace = both(Plc(made), 40, presses=False)
    assert recorded.scans == trace.scans
    assert page_data(recorded) == page_data(trace)


def test_without_what_happened_inside() -> None:
    recorded, trace = both(Plc(image()), 40, Depth.SCANS)
    assert page_data(recorded, scans=range(7, 30)) == page_data(trace, scans=range(7, 30))
    assert [moment.scans for moment in recorded.moments(range(38, 90))] == [38, 39]
    with pytest.raises(ValueError, match="scan 40 is not in the trace, which has scans 0 to 39"):
        recorded.at(40)


@pytest.mark.slow
@pytest.mark.parametrize(("path", "unit"), [("tests/bench/poll.st", Etn21(0, "192.168.250.21")), ("examples/mstr.st", Noc())])
def test_the_network_is_part_of_it(path: str, unit: Etn21 | Noc) -> None:
    recorded, trace = both(exchanging(path, unit), 30, presses=False)
    passed = network_events(recorded)
    assert passed == network_events(trace)
    assert len(passed) > 5
    assert page_data(recorded) == page_data(trace)


LONG_AGO = """PROGRAM Main
VAR
    n, kept, seen : DINT; early, late : BOOL; Given : INT; store : ARRAY[0..3] OF INT; t : TON; p : REF_TO INT;
    lamp AT CIO 100.03 : BOOL; other AT CIO 100.04 : BOOL;
END_VAR
    n := n + 1;
    p := REF(store[2]);
    IF n = 5 THEN early := TRUE; p^ := 7; END_IF;
    IF early AND n = 300 THEN late := TRUE; END_IF;
    IF n < 170 THEN kept := kept + 1; END_IF;
    IF n MOD 2 = 0 AND n < 370 THEN seen := n; seen := seen * 2; END_IF;
    lamp := late;
    other := n MOD 3 = 0;
    t(IN := late, PT := T#3s);
END_PROGRAM
"""


def test_the_scans_in_which_a_variable_may_have_changed_end_where_it_did() -> None:
    made = compile_text(LONG_AGO).image
    assert made is not None
    plc = Plc(made)
    source = RecordedScans(Recording().add("plc", plc), {})
    plc.run(scans=60)
    early, late = (source.find(f"Main.{name}") for name in ("early", "late"))
    assert isinstance(early, Place) and isinstance(late, Place)
    assert source.may_change([early], range(60)) == range(28), "the stretch with scan 4; in the 32 behind it nothing changed"
    assert source.may_change([early], range(5, 60)) == range(5, 5) == source.may_change([late], range(5, 60))
    lamp, other = (source.find(f"CIO 100.0{bit}") for bit in (3, 4))
    assert isinstance(lamp, Place) and isinstance(other, Place)
    assert source.may_change([lamp], range(60)) == range(0), "only the bit beside it changed"
    assert source.may_change([lamp, other], range(60)) == range(60)


@pytest.mark.slow
def test_causes_of_long_ago_are_those_that_a_search_of_each_scan_finds(monkeypatch: pytest.MonkeyPatch) -> None:
    """A recording is searched by breakpoints from the latest scan backwards, a trace scan by scan."""
    monkeypatch.setattr("fbvm.record.recording.last_change.WINDOW", 20)
    monkeypatch.setattr("fbvm.record.draw.why.WINDOWS", (20, 100))
    made = compile_text(LONG_AGO).image
    assert made is not None
    plc, file = Plc(made), io.BytesIO()
    recorded, writer = Recording().add("plc", plc), TraceWriter(plc, file, Depth.STATEMENTS)
    for scan in range(400):
        if scan in (100, 220):
            plc.write("Main.Given", scan)
        plc.scan()
    writer.close()
    source, trace = RecordedScans(recorded, {}), Trace(io.BytesIO(file.getvalue()))
    for name, scan in [("seen", 399), ("Given", 399), ("p^", 210), ("lamp", 399), ("t.ET", 399)]:
        place = source.find(f"Main.{name}")
        assert isinstance(place, Place)
        assert cause_text(source, why(source, place, scan)) == cause_text(trace, why(trace, place, scan)), name
    assert "since scan 220" in cause_text(source, why(source, source.find("Main.Given"), 399))  # type: ignore[arg-type]
    store = source.find("Main.store")
    assert isinstance(store, Place)
    assert (source.may_change([store], range(400)).stop - 1) - 4 in range(20)
