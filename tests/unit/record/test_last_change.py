"""Where the last change of a place is looked for: in which scans, in which order, and how near the answer comes."""

from __future__ import annotations

import sys
from itertools import combinations
from types import SimpleNamespace
from typing import Any

import pytest
from rows import each_of

from fbvm.code.compiler import compile_text
from fbvm.machine.plc import Plc
from fbvm.record.recording import last_change
from fbvm.record.recording.last_change import may_change, stretches
from fbvm.record.recording.recording import Recording


@each_of("first, end, found", [
    (0, 0, []), (5, 5, []), (9, 5, []), (0, 1, [(0, 1)]), (0, 32, [(0, 32)]), (0, 33, [(1, 33), (0, 1)]),
    (0, 96, [(64, 96), (0, 64)]), (0, 97, [(65, 97), (1, 65), (0, 1)]), (100, 300, [(268, 300), (204, 268), (100, 204)])])
def test_scans_are_looked_at_in_stretches_each_twice_as_long_the_latest_first(first: int, end: int,
                                                                             found: list[tuple[int, int]]) -> None:
    assert [(each.start, each.stop) for each in stretches(first, end)] == found


@pytest.mark.parametrize("window", [1, 2, 3, 100])
def test_the_last_change_is_within_a_window_of_the_answer(window: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of all ways in which a place can change in ten scans."""
    monkeypatch.setattr(last_change, "WINDOW", window)
    for count in range(4):
        for changes in combinations(range(10, 20), count):
            def first(recorded: Any, places: Any, scans: range, changes: tuple[int, ...] = changes) -> int | None:
                assert recorded == "recorded" and places == ["place"]
                return next((scan for scan in scans if scan in changes), None)

            monkeypatch.setattr(last_change, "_first_in", first)
            found = last_change._last_in("recorded", ["place"], range(10, 20))  # type: ignore[arg-type, list-item]
            if changes:
                assert found is not None and 10 <= found < 20 and 0 <= found - changes[-1] < window, changes
            else:
                assert found is None
    assert last_change._last_in("recorded", ["place"], range(10, 10)) is None  # type: ignore[arg-type, list-item]


@each_of("scans, asked, found", [
    (range(400), [(168, 200), (104, 168), (100, 104)], range(0)), (range(150, 160), [(150, 160)], range(150, 150)),
    (range(150), [(118, 150), (100, 118)], range(0)), (range(180, 400), [(180, 200)], range(180, 200)),
    (range(50), [], range(0)), (range(300, 400), [], range(300, 300))])
def test_only_scans_that_are_recorded_and_asked_for_are_looked_at(scans: range, asked: list[tuple[int, int]], found: range,
                                                                  monkeypatch: pytest.MonkeyPatch) -> None:
    """Here nothing changes but in stretches that begin at scan 180."""
    looked: list[tuple[int, int]] = []

    def last(recorded: Any, places: Any, stretch: range) -> int | None:
        looked.append((stretch.start, stretch.stop))
        return stretch.stop - 1 if stretch.start == 180 else None

    monkeypatch.setattr(last_change, "_last_in", last)
    recorded: Any = SimpleNamespace(begun=range(100, 200))
    assert (may_change(recorded, [], scans), looked) == (found, asked)


TEXT = """PROGRAM Main
VAR n, k, w : INT; b AT CIO 0.03 : BOOL; other AT CIO 0.04 : BOOL; END_VAR
    n := n + 1;
    IF n = 5 OR n = 8 THEN k := n; END_IF
    b := n = 6;
    other := NOT other;
END_PROGRAM
"""


def test_the_first_change_of_some_scans_is_found_by_running_to_it() -> None:
    image = compile_text(TEXT).image
    assert image is not None
    plc = Plc(image)
    recorded = Recording().add("plc", plc)
    for scan in range(12):
        if scan == 9:
            plc.write("Main.w", 7)
        plc.scan()
    k, b, w, n = (plc.find(f"Main.{name}") for name in ("k", "b", "w", "n"))
    rows = [([k], 0, 12, 4), ([k], 4, 12, 4), ([k], 5, 12, 7), ([k], 8, 12, None), ([k], 0, 4, None), ([k], 0, 5, 4),
            ([b], 0, 12, 5), ([b], 6, 12, 6), ([b], 7, 12, None), ([k, b], 5, 12, 5), ([n], 3, 4, 3),
            ([w], 0, 9, None)]  # fmt: skip
    for places, start, stop, scan in rows:
        found = last_change._first_in(recorded, places, range(start, stop))  # type: ignore[arg-type]
        assert found == scan, (places, start, stop)
    assert last_change._first_in(recorded, [w], range(12)) == 9  # type: ignore[list-item]
    answers = iter(([b"before"], [b"behind"]))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(last_change, "_seen", lambda memory, places: next(answers))
        found = last_change._first_in(recorded, [k], range(8, 12))  # type: ignore[list-item]
    assert found == 11, "what a unit has changed behind the last statement is of the last scan"


def test_of_a_bit_the_bit_is_looked_at_and_of_others_their_bytes() -> None:
    image = compile_text(TEXT).image
    assert image is not None
    plc = Plc(image)
    places: Any = [plc.find(f"Main.{name}") for name in ("k", "b", "other")]
    assert last_change._seen(plc.memory, places) == [b"\0\0", 0, 0]
    plc.write("Main.k", 0x0102)
    plc.write("Main.other", True)
    assert last_change._seen(plc.memory, places) == [(0x0102).to_bytes(2, sys.byteorder), 0, 1]
    narrow = compile_text("PROGRAM Main VAR s, t : SINT; f, g : BOOL; END_VAR s := t; f := g; END_PROGRAM").image
    assert narrow is not None
    plc = Plc(narrow)
    for name in ("t", "g"):
        plc.write(f"Main.{name}", 1)
    places = [plc.find("Main.s"), plc.find("Main.t"), plc.find("Main.f"), plc.find("Main.g")]
    assert last_change._seen(plc.memory, places) == [b"\0", b"\1", b"\0", b"\1"]
