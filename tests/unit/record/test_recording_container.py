"""The blocks of a recording's file, byte by byte: what is written, what ends the file, what is refused."""

from __future__ import annotations

import io
import struct
import zlib

import pytest

from fbvm.record.recording import container
from fbvm.record.recording.container import (
    END,
    KEYFRAME,
    MOST_SCANS,
    PLC,
    SCANS,
    START,
    BlockHead,
    RecordingError,
    heads,
    read_block,
    write_block,
)

HEAD = struct.Struct("<BIIHQI")
"""Kind, size, checksum, PLC, first scan, scans: 23 bytes."""


def written(*blocks: tuple[int, bytes, int, int, int]) -> io.BytesIO:
    file = io.BytesIO()
    for kind, payload, plc, first, scans in blocks:
        before = file.tell()
        assert write_block(file, kind, payload, plc, first, scans) == file.tell() - before
    file.seek(0)
    return file


def test_a_block_is_its_head_and_its_payload_packed() -> None:
    data = written((SCANS, b"payload", 3, 1 << 40, 7)).getvalue()
    kind, size, check, plc, first, scans = HEAD.unpack(data[:23])
    assert (kind, size, plc, first, scans) == (SCANS, len(data) - 23, 3, 1 << 40, 7)
    assert zlib.decompress(data[23:]) == b"payload"
    assert check == zlib.crc32(struct.pack("<BHQI", SCANS, 3, 1 << 40, 7), zlib.crc32(data[23:]))
    assert (START, PLC, KEYFRAME, SCANS, END) == (1, 2, 3, 4, 5)


def test_the_heads_are_those_of_the_whole_blocks_and_the_file_stands_behind_the_last_one() -> None:
    file = written((START, b"{}", 0, 0, 0), (PLC, b"{..}", 1, 2, 3), (END, b"", 4, 5, MOST_SCANS))
    whole = file.getvalue()
    found = list(heads(file))
    ends = [*(head.at for head in found[1:]), len(whole)]
    assert found == [BlockHead(START, 0, 0, 0, 0), BlockHead(PLC, ends[0], 1, 2, 3), BlockHead(END, ends[1], 4, 5, MOST_SCANS)]
    assert file.tell() == len(whole) and [read_block(file, head) for head in found] == [b"{}", b"{..}", b""]
    for cut in range(len(whole)):
        part = io.BytesIO(whole[:cut])
        count = sum(end <= cut for end in ends)
        assert list(heads(part)) == found[:count] and part.tell() == [0, *ends][count], cut
    file.seek(ends[0])
    assert list(heads(file)) == found[1:]


@pytest.mark.parametrize(("kind", "scans"), [(0, 0), (6, 0), (SCANS, MOST_SCANS + 1), (6, MOST_SCANS + 1)])
def test_where_no_block_begins_the_file_is_damaged(kind: int, scans: int) -> None:
    file = written((START, b"{}", 0, 0, 0))
    at = len(file.getvalue())
    file = io.BytesIO(file.getvalue() + HEAD.pack(kind, 0, 0, 0, 0, scans))
    found = heads(file)
    assert next(found).kind == START
    with pytest.raises(RecordingError, match=f"^the file is damaged at byte {at}$"):
        next(found)


def damaged(change: bytes, at: int) -> bytes:
    data = bytearray(written((SCANS, b"some payload", 3, 10, 7)).getvalue())
    data[at:at + len(change)] = change
    return bytes(data)


CHANGES = {"kind": (b"\3", 0), "checksum": (b"\0\0", 5), "PLC": (b"\4", 9), "first scan": (b"\x0b", 11), "scans": (b"\x08", 19),
           "payload": (b"\0", 30)}  # fmt: skip


@pytest.mark.parametrize("what", CHANGES)
def test_a_block_that_is_not_as_it_was_written_is_refused(what: str) -> None:
    """Also one whose head is consistent with what the file said before, and one that is another than was asked for."""
    file = io.BytesIO(damaged(*CHANGES[what]))
    [head] = heads(file)
    with pytest.raises(RecordingError, match="the block at byte 0 is damaged"):
        read_block(file, head)
    file = written((SCANS, b"some payload", 3, 10, 7))
    [good] = heads(file)
    assert read_block(file, good) == b"some payload"
    for other in (good._replace(kind=KEYFRAME), good._replace(plc=4), good._replace(first=11), good._replace(scans=8)):
        with pytest.raises(RecordingError, match="the block at byte 0 is damaged"):
            read_block(file, other)


def test_a_payload_that_is_no_packed_one_is_damaged() -> None:
    packed = b"no deflate stream"
    check = zlib.crc32(struct.pack("<BHQI", SCANS, 0, 0, 0), zlib.crc32(packed))
    with pytest.raises(RecordingError, match="the block at byte 0 is damaged"):
        read_block(io.BytesIO(HEAD.pack(SCANS, len(packed), check, 0, 0, 0) + packed), BlockHead(SCANS, 0, 0, 0, 0))
    cut = zlib.compress(bytes(1000))[:-2]
    check = zlib.crc32(struct.pack("<BHQI", SCANS, 0, 0, 0), zlib.crc32(cut))
    with pytest.raises(RecordingError, match="the block at byte 0 does not end, or is too large"):
        read_block(io.BytesIO(HEAD.pack(SCANS, len(cut), check, 0, 0, 0) + cut), BlockHead(SCANS, 0, 0, 0, 0))


def test_a_payload_may_be_as_large_as_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    file = written((SCANS, bytes(5000), 0, 0, 0))
    [head] = heads(file)
    size = len(file.getvalue()) - 23
    for limit, said in ((5000, ""), (4999, "does not end, or is too large"), (size, "does not end, or is too large"),
                        (size - 1, "at byte 0 is too large")):  # fmt: skip
        monkeypatch.setattr(container, "LARGEST_BYTES", limit)
        if said:
            with pytest.raises(RecordingError, match=said):
                read_block(file, head)
        else:
            assert read_block(file, head) == bytes(5000)


def test_what_is_json_may_be_as_large_as_a_limit_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(container, "LARGEST_JSON_BYTES", 4999)
    refused = []
    for kind in (START, PLC, KEYFRAME, SCANS, END):
        file = written((kind, bytes(5000), 0, 0, 0))
        try:
            read_block(file, next(heads(file)))
        except RecordingError as error:
            assert "does not end, or is too large" in str(error)
            refused.append(kind)
    assert refused == [START, PLC, END]
