"""Which scans the blocks of a recording's file have, where a PLC went back, and where blocks do not fit together."""

from __future__ import annotations

import io

import pytest

from fbvm.record.recording.container import END, KEYFRAME, PLC, SCANS, RecordingError, write_block
from fbvm.record.recording.file_blocks import PlcBlocks, find_blocks

Row = tuple[int, int, int]
"""Kind, first scan, number of scans."""


def found(*rows: Row, plcs: dict[int, PlcBlocks] | None = None) -> PlcBlocks:
    """The blocks of PLC 3, of which the rows behind its description are written."""
    file, known = io.BytesIO(), {} if plcs is None else plcs
    for kind, first, scans in (*[(PLC, 0, 0)][: not known], *rows):
        write_block(file, kind, b"{}", 3, first, scans)
    file.seek(0)
    find_blocks(file, known)
    return known[3]


def scans(blocks: PlcBlocks) -> list[tuple[int, int]]:
    return [(chunk.first, chunk.end) for chunk in blocks.chunks]


def test_scans_follow_their_keyframe() -> None:
    blocks = found((KEYFRAME, 0, 0), (SCANS, 0, 4), (SCANS, 4, 3), (KEYFRAME, 7, 0), (SCANS, 7, 5))
    assert scans(blocks) == [(0, 7), (7, 12)] and blocks.chunks.firsts == [0, 7]
    assert [len(chunk.segments) for chunk in blocks.chunks] == [2, 1] and len(blocks.keyframes) == 2
    assert [chunk.first for chunk in blocks.chunks[:1]] == [0]


@pytest.mark.parametrize(("back", "left"), [(5, [(0, 5), (5, 5)]), (7, [(0, 7), (7, 7)]), (3, [(0, 3), (3, 3)]), (0, [(0, 0)]),
                                            (12, [(0, 7), (7, 12), (12, 12)])])  # fmt: skip
def test_a_plc_that_was_put_back_has_what_it_did_then(back: int, left: list[tuple[int, int]]) -> None:
    blocks = found((KEYFRAME, 0, 0), (SCANS, 0, 7), (KEYFRAME, 7, 0), (SCANS, 7, 5), (KEYFRAME, back, 0))
    assert scans(blocks) == left
    assert [chunk.cut for chunk in blocks.chunks][:1] == [back if 0 < back < 7 else None]


def test_scans_before_a_gap_are_forgotten() -> None:
    blocks = found((KEYFRAME, 0, 0), (SCANS, 0, 7), (KEYFRAME, 20, 0), (SCANS, 20, 2))
    assert scans(blocks) == [(20, 22)] and blocks.chunks.firsts == [20]


def test_a_file_has_an_end_until_it_goes_on() -> None:
    blocks = found((KEYFRAME, 0, 0), (SCANS, 0, 2), (END, 0, 0))
    assert blocks.end is not None
    assert found((KEYFRAME, 2, 0), plcs={3: blocks}).end is None


@pytest.mark.parametrize("rows", [
    [(SCANS, 0, 3)], [(KEYFRAME, 0, 0), (SCANS, 1, 3)], [(KEYFRAME, 0, 0), (SCANS, 0, 0)],
    [(KEYFRAME, 0, 0), (SCANS, 0, 3), (SCANS, 4, 1)], [(PLC, 0, 0)],
])  # fmt: skip
def test_blocks_that_do_not_fit_together_are_refused(rows: list[Row]) -> None:
    with pytest.raises(RecordingError, match=r"damaged at byte [0-9]+: (what belongs before it is missing|a second PLC)"):
        found(*rows)


def test_blocks_of_an_unknown_plc_are_refused() -> None:
    file = io.BytesIO()
    write_block(file, KEYFRAME, b"{}", 5, 0, 0)
    file.seek(0)
    with pytest.raises(RecordingError, match="what belongs before it is missing"):
        find_blocks(file, {})
