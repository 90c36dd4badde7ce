"""Rows of a chart alone: numbers where there is room, what stands at the right, scans that are left out, the ruler."""

from __future__ import annotations

import pytest
from images import counter_image

from fbvm.machine.plc import Plc
from fbvm.record.draw import chart as module
from fbvm.record.draw.chart import _columns, _numbers, _ruler, chart, draw
from fbvm.record.trace.recorder import Recorder, Track

NUMBERS = {
    "0 0 0": ("0  ", True), "12 12 7": ("12|7", True), "12 7": ("||7", False), "1 2 3": ("1||3", False),
    "123 123 4 4": ("| |4", False), "123 123 123 4": ("123|4", True), "1 1 12345": ("1 |12345", True),
    "1 1 - 1 1": ("1 ~  ", True), "1 - 2 2": ("1~|2", True), "100 - 100 2": ("100|2", True), "- 1": ("~|1", True),
    "5 6 6 6": ("5|6 ", True), "10 6": ("||6", False), "1 10 10 2": ("1| |2", False), "1 10 10 10 2": ("1|10|2", True),
}  # fmt: skip


def test_numbers_stand_where_they_begin_if_there_is_room() -> None:
    """A number and the `|` in front of it fit into the columns up to the next one; `-` is a gap."""
    assert {row: _numbers([None if text == "-" else text for text in row.split()]) for row in NUMBERS} == NUMBERS


def test_the_ruler_has_the_first_scan_every_tenth_and_the_one_behind_a_gap() -> None:
    assert _ruler(range(7, 33)) == "7  10        20        30"
    assert _ruler([8, 9, 10, 11]) == "8 10" and _ruler([9, 10, 11]) == "9" and _ruler([1, None, 45, 46]) == "1 45"
    assert _ruler([99, None, 105, 106]) == "99" and _ruler([9, None, 105]) == "9 105" and _ruler(range(95, 102)) == "95   100"


def track(*changes: int) -> Track:
    plc = Plc(counter_image())
    [made] = Recorder(plc, ["D0"]).tracks
    made.changes = [(scan, scan) for scan in changes]
    return made


def test_longer_stretches_without_changes_are_left_out_but_for_their_ends() -> None:
    quiet = module.QUIET_SCANS
    assert (quiet, _columns(range(12), [track(0)])) == (12, [*range(12)])
    assert _columns(range(13), [track(0)]) == [0, 1, 2, 3, 4, 5, None, 8, 9, 10, 11, 12]
    assert _columns(range(30), [track(0, 3), track(0, 16)]) == [*range(3), 3, 4, 5, 6, 7, 8, None, 11, 12, 13, 14, 15,
                                                                16, 17, 18, 19, 20, 21, None, 25, 26, 27, 28, 29]  # fmt: skip


def test_values_without_room_are_listed_up_to_twelve() -> None:
    plc = Plc(counter_image())
    recorder = Recorder(plc, ["D200", "Main.done"])
    plc.run(scans=13)
    assert draw(recorder, recorder.tracks[:1]) == (
        "D200  1||||||||||||13   = 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, ... (13 values)")
    lines = str(draw(recorder, width=0)).splitlines()
    assert len(lines) == 2, "a chart is twenty columns wide at least"
    recorder = Recorder(plc, [("D200", "executions")])
    plc.run(scans=30)
    blocks = str(draw(recorder, width=6 + 20 + 13)).split("\n\n")
    assert [block.partition("= ")[2].split(",")[0] for block in blocks] == ["14", "34"] and len(blocks) == 2
    assert blocks[1].endswith("43   executions\n") and draw(recorder, []) == ""


def test_a_chart_leaves_nothing_at_the_plc() -> None:
    plc = Plc(counter_image())
    chart(plc, scans=2)
    with pytest.raises(AssertionError, match=r"D5 = 1 does not hold after 3 scans\nD5  0"):
        chart(plc, signals=["D5"], until="D5 = 1", max_scans=3)
    assert plc.watchers == [] and plc.scans == 5
    assert chart(plc, scans=2, signals=["D5"], until="D5 = 1") == "D5  0", "so many scans were asked for"


def test_without_signals_those_that_moved_since_the_beginning_are_drawn() -> None:
    """`done` is TRUE already."""
    plc = Plc(counter_image())
    plc.run(scans=20)
    assert [line.split()[0] for line in chart(plc, scans=1).splitlines()] == ["Main.n", "Main.kept", "Main.started"]
