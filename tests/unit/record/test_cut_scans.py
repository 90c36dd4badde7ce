"""Scans with very many statements: a trace has the first ones and the end, and says so."""

from __future__ import annotations

import io

import pytest

from fbvm import Depth, Trace, TraceWriter
from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.record.draw.table import NOT_RECORDED, ScanTable
from fbvm.record.draw.why import cause_text, why
from fbvm.record.trace.events import Cut, Event, Statement
from fbvm.record.trace.recorder import Signal
from fbvm.record.trace.writer import START

LOOP = """PROGRAM Main
VAR n, i, a, b : INT; END_VAR
n := n + 1;
FOR i := 1 TO 100 * n DO
    a := a + 1;
END_FOR;
b := a;
END_PROGRAM
"""
"""100 passes in the first scan, 200 in the second, and so on."""
ENDLESS = "PROGRAM Main VAR a, b : DINT; END_VAR b := 5; WHILE TRUE DO a := a + 1; END_WHILE; END_PROGRAM"


class Events:
    """A follower that keeps the events of each scan."""

    def __init__(self) -> None:
        self.by_scan: dict[int, list[Event]] = {}

    def phase(self, moment: object, phase: object) -> None:
        """Nothing is kept of phases."""

    def event(self, moment: Trace | Plc, event: Event) -> None:
        self.by_scan.setdefault(moment.scans, []).append(event)  # type: ignore[arg-type]


def recorded(
    text: str, scans: int, most: int, monkeypatch: pytest.MonkeyPatch, depth: Depth = Depth.STATEMENTS
) -> tuple[Plc, Trace]:
    """A PLC after some scans, and their trace with about `most` events a scan."""
    monkeypatch.setattr("fbvm.record.trace.writer.MOST_EVENTS", most)
    made = compile_text(text).image
    assert made is not None
    plc, file = Plc(made), io.BytesIO()
    writer = TraceWriter(plc, file, depth)
    plc.run(scans=scans)
    writer.close()
    file.seek(0)
    return plc, Trace(file)


def test_of_a_long_loop_the_first_statements_are_recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    _, trace = recorded(LOOP, 3, 1200, monkeypatch)
    events = Events()
    trace.follow(events)  # type: ignore[arg-type]
    statements = {scan: sum(isinstance(event, Statement) for event in seen) for scan, seen in events.by_scan.items()}
    assert statements[0] == 103
    assert 103 < statements[1] == statements[2] < 203
    assert [sum(isinstance(event, Cut) for event in seen) for seen in events.by_scan.values()] == [0, 1, 1]
    assert all(isinstance(events.by_scan[scan][-1], Cut) for scan in (1, 2))


@pytest.mark.parametrize("depth", list(Depth))
def test_the_end_of_each_scan_is_that_of_a_run_that_nobody_looks_at(depth: Depth, monkeypatch: pytest.MonkeyPatch) -> None:
    plc, trace = recorded(LOOP, 4, 500, monkeypatch, depth)
    plain = Plc(plc.image)
    for scan in range(4):
        plain.scan()
        assert bytes(trace.at(scan).memory.u8[START:]) == bytes(plain.memory.u8[START:])
    assert bytes(plc.memory.u8) == bytes(plain.memory.u8)


@pytest.mark.slow
def test_an_endless_loop_ends_in_its_trap(monkeypatch: pytest.MonkeyPatch) -> None:
    plc, trace = recorded(ENDLESS, 1, 1000, monkeypatch)
    assert plc.trap and plc.trap.code == "R0104"
    plain = Plc(plc.image)
    plain.scan()
    assert trace.at(0).read("Main.a") == plain.read("Main.a") == plc.read("Main.a")


@pytest.mark.slow
def test_table_and_why_say_what_is_not_recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    _, trace = recorded(LOOP, 2, 1200, monkeypatch)
    place = {name: trace.find(f"Main.{name}") for name in "nab"}
    table = ScanTable(trace.sites, trace.names, [Signal(place["b"], "Main.b")])
    trace.follow(table)
    assert [row.label for row in table.bands[0].rows] == ["inputs", "text.st:7"]
    assert [row.label for row in table.bands[1].rows] == ["inputs", NOT_RECORDED]
    assert table.bands[1].rows[-1].values == [300]
    said = "by a statement that is not recorded: there were too many in this scan"
    assert cause_text(trace, why(trace, place["b"], 1)) == f"Main.b = 300 since scan 1 (10ms), {said}"
    assert cause_text(trace, why(trace, place["b"], 0)).startswith("Main.b = 100 since scan 0 (0s), by text.st:7 in Main")
    assert cause_text(trace, why(trace, place["n"], 1)).startswith("Main.n = 2 since scan 1 (10ms), by text.st:3 in Main")


@pytest.mark.slow
def test_why_of_a_long_loop_keeps_the_last_read_of_each_variable() -> None:
    """The condition of a loop is read at each pass: its last value is told, once."""
    made = compile_text("PROGRAM Main\nVAR i, s : DINT; END_VAR\ni := 0; s := 0;\nWHILE i < 500 DO\n    i := i + 1;\n"
                        "    s := s + i;\nEND_WHILE;\nEND_PROGRAM").image
    assert made is not None
    plc, file = Plc(made), io.BytesIO()
    writer = TraceWriter(plc, file, Depth.STATEMENTS)
    plc.run(scans=1)
    writer.close()
    file.seek(0)
    trace = Trace(file)
    lines = cause_text(trace, why(trace, trace.find("Main.s"), 0, 1)).splitlines()  # type: ignore[arg-type]
    assert [line.partition(" since")[0] for line in lines] == ["Main.s = 125250", "├ Main.s = 124750", "└ Main.i = 500"]
