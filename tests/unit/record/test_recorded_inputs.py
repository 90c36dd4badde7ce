"""Which scan of several gets what came from outside, and how much memory the inputs of a scan take."""

from __future__ import annotations

from typing import Any

import pytest
from images import counter_image

from fbvm.machine.plc import Plc
from fbvm.record.recording.chunks import SMALL_BYTES, ScanInputs, Times
from fbvm.record.recording.recording import Recording
from fbvm.wire.link import Peer, Received
from fbvm.wire.tap import TapEvent, TapKind

PASSED = (0, "192.168.250.1", TapEvent(TapKind.DATA, Peer("192.168.250.1", 502), Peer("192.168.250.2", 1025), True, b"12345"))


@pytest.mark.parametrize("scans", [1, 2, 5])
@pytest.mark.parametrize("told", [{"traffic": [PASSED]}, {"watch": (7, 1000)}, {"events": {0: [Received(1, b"abc")]}}])
def test_what_was_written_belongs_to_the_first_scan_and_what_was_told_to_the_last(scans: int, told: dict[str, Any]) -> None:
    plc = Plc(counter_image())
    recorded = Recording().add("plc", plc)
    plc.run(scans=10)
    chunk = recorded.chunk(0)
    recorded._put(chunk, ScanInputs(0, writes=[(4, b"x")], **told), scans)
    first = [scan for scan in chunk.inputs if scan.writes]
    [last] = [scan for scan in chunk.inputs if scan.traffic or scan.watch or scan.events]
    assert ([scan.scan for scan in first], last.scan, chunk.numbers) == ([10 - scans], 9, sorted({10 - scans, 9}))
    assert (last.traffic, last.watch, last.events) == (told.get("traffic", []), told.get("watch"), told.get("events", {}))
    assert (last is first[0]) == (scans == 1)


def test_what_units_were_told_alone_is_one_row() -> None:
    plc = Plc(counter_image())
    recorded = Recording().add("plc", plc)
    plc.run(scans=10)
    recorded._put(recorded.chunk(0), ScanInputs(0, traffic=[PASSED]), 4)
    assert recorded.chunk(0).numbers == [9]
    recorded._put(recorded.chunk(0), ScanInputs(0, writes=[(4, b"x")]), 3)
    assert recorded.chunk(0).numbers == [9, 7], "what was written alone stays with the first scan"


FULL: dict[str, Any] = {
    "writes": [(0, b"1")], "settings": {0: {}}, "events": {0: []}, "results": [(0, b"")], "refreshed": [(0, b"")],
    "traffic": [PASSED], "forces": {}, "budget": 0, "watch": (0, 0)}  # fmt: skip


def test_inputs_are_empty_without_any() -> None:
    assert ScanInputs(7).is_empty
    assert [name for name, value in FULL.items() if ScanInputs(7, **{name: value}).is_empty] == []


def test_the_size_of_inputs_counts_rows_and_bytes() -> None:
    sizes = {
        SMALL_BYTES: ScanInputs(7), SMALL_BYTES + 6: ScanInputs(7, writes=[(0, b"123"), (9, b"456")]),
        SMALL_BYTES + 3: ScanInputs(7, writes=[(0, b"1")], results=[(0, b"2")], refreshed=[(1, b"3")]),
        SMALL_BYTES + 1: ScanInputs(7, results=[(0, b"2")]), SMALL_BYTES + 2: ScanInputs(7, refreshed=[(0, b"22")]),
        4 * SMALL_BYTES + 5: ScanInputs(7, events={0: [Received(1, b"abc")], 2: [Received(1, b"de"), Received(1, b"")]}),
        2 * SMALL_BYTES + 5: ScanInputs(7, traffic=[PASSED]),
    }  # fmt: skip
    assert {expected: inputs.size_bytes for expected, inputs in sizes.items()} == {size: size for size in sizes}


MOMENTS = [0, 10, 20, 30, 31, 33, 35, 37, 100, 200, 200, 200]


def times(first: int = 5) -> Times:
    made = Times(first)
    for now_ns in MOMENTS:
        made.add(now_ns)
    return made


def test_times_in_equal_steps_are_one_row() -> None:
    made = times()
    assert made.rows(5) == [[5, 0, 10, 4], [9, 31, 2, 4], [13, 100, 100, 2], [15, 200, 0, 2]]
    assert made.rows(7) == [[7, 20, 10, 2], *made.rows(9)] and made.rows(17) == [] and made.size_bytes == 4 * 24
    assert [made.at(scan) for scan in range(5, 17)] == MOMENTS
    assert [made.regular(scan) for scan in (5, 8, 9, 14, 15)] == [(4, 10), (1, 10), (4, 2), (1, 100), (2, 0)]


def test_times_of_several_scans_at_once_join_those_before_if_their_steps_are_equal() -> None:
    for first, scans, step, rows in ((30, 3, 10, [[0, 10, 10, 5]]), (40, 3, 10, [[0, 10, 10, 2], [2, 40, 10, 3]]),
                                     (30, 3, 9, [[0, 10, 10, 2], [2, 30, 9, 3]]), (30, 1, 0, [[0, 10, 10, 3]])):  # fmt: skip
        made = Times(0)
        made.add(10)
        made.add(20)
        made.add(first, scans, step)
        assert made.rows(0) == rows and made.end == 2 + scans
    many = Times(0)
    many.add(0, 4, 5)
    many.add(20, 2, 5)
    many.add(30)
    many.add(36)
    assert many.rows(0) == [[0, 0, 5, 7], [7, 36, 0, 1]]
    one = Times(0)
    one.add(7)
    one.add(9, 3, 2)
    assert one.rows(0) == [[0, 7, 2, 4]]
    one.add(15)
    assert one.rows(0) == [[0, 7, 2, 5]]


@pytest.mark.parametrize("scan", range(5, 18))
def test_times_that_are_cut_go_on_as_if_the_rest_had_never_been(scan: int) -> None:
    made, other = times(), Times(5)
    made.cut(scan)
    for now_ns in MOMENTS[:scan - 5]:
        other.add(now_ns)
    for each in (made, other):
        each.add(300)
        each.add(310)
    assert [made.at(number) for number in range(5, made.end)] == [other.at(number) for number in range(5, other.end)]
    assert made.end == other.end == min(scan, 17) + 2
