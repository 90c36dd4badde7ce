"""Bytes and plain data of recordings and traces, there and back, and what of them is refused, in words."""

from __future__ import annotations

import io
import struct
import zlib
from dataclasses import replace
from typing import Any

import pytest
from images import counter_image

from fbvm.base.areas import PAGE_BYTES
from fbvm.base.memory import Snapshot
from fbvm.base.types import INT, Field
from fbvm.code.image import Site
from fbvm.engine.trap import Trap
from fbvm.machine.plc import Plc
from fbvm.record.recording import keyframe_codec, plain_data
from fbvm.record.recording.chunks import Chunk, ScanInputs, Times, UnitKeyframe
from fbvm.record.recording.container import RecordingError
from fbvm.record.recording.damage import damages
from fbvm.record.recording.keyframe_codec import KeyframeReader, encode_keyframe
from fbvm.record.recording.packed import PackedSnapshot, unpacked
from fbvm.record.recording.plain_data import LARGEST, dump, load, number, parts_of, payload_of, tagged, untagged
from fbvm.record.recording.program_text import ProgramText
from fbvm.record.recording.scan_codec import StoredChunk, decode_inputs, decode_scans, encode_inputs, encode_scans
from fbvm.record.trace import format as trace_format
from fbvm.record.trace import results
from fbvm.record.trace.format import BLOCK, HEADER, Cursor, TraceError, chunks, put, read_chunk, write_chunk
from fbvm.record.trace.format import Chunk as TraceChunk
from fbvm.record.trace.symbols import SymbolError
from fbvm.units.contract import UnitState
from fbvm.wire.link import Peer, PeerClosed, Received
from fbvm.wire.tap import TapEvent, TapKind

# --- plain data -------------------------------------------------------------------------------------------------------


def test_data_with_bytes_in_it_comes_back() -> None:
    data = {"a": [1, 2.5, None, True, "ö"], "b": b"\0\xff", "c": {"bytes": "00", "more": 1}}
    assert load(dump(data)) == data and dump({"a": 1}) == b'{"a":1}'
    payload = payload_of({"a": b"1"}, [b"page", b"more"])
    found, rest = parts_of(payload)
    assert (found, bytes(rest), payload[:4]) == ({"a": b"1"}, b"pagemore", (20).to_bytes(4, "little"))
    with pytest.raises(TypeError, match="is no part of a recording"):
        dump({"a": object()})


def test_a_number_is_whole_and_within_bounds() -> None:
    assert [number(value) for value in (0, LARGEST)] == [0, LARGEST] and number(7, 7) == 7 and LARGEST == 1 << 62
    for value, most in ((-1, LARGEST), (LARGEST + 1, LARGEST), (8, 7), (True, 7), (1.0, 7), ("1", 7), (None, 7)):
        with pytest.raises(ValueError, match=f"is no number from 0 to {most}"):
            number(value, most)


STATES: list[Any] = [
    None, 1, True, 2.5, "text", b"bytes", (1, "a"), [1, [2]], {3, 1, 2}, {1: "a", "b": (2,)}, Peer("192.168.250.1", 502),
    [Received(1, b"abc"), PeerClosed(2)], {"x": {Peer("0.0.0.0", 0)}}, (), [], {}, set(),
]  # fmt: skip


@pytest.mark.parametrize("state", STATES, ids=repr)
def test_the_state_of_a_unit_comes_back(state: Any) -> None:
    found = untagged(load(dump(tagged(state))))
    assert found == state and type(found) is type(state)


def test_what_is_no_state_is_refused() -> None:
    class Peer:
        """Not the one that is meant."""

    for wrong in (object(), Peer(), [Peer()]):
        with pytest.raises(TypeError, match="is no state of a unit that can be written"):
            tagged(wrong)
    for tag in ({"nothing": []}, {"a": 1, "b": 2}, {}):
        with pytest.raises((KeyError, ValueError, TypeError)):
            untagged(tag)
    assert plain_data.LENGTH_BYTES == 4


# --- scans --------------------------------------------------------------------------------------------------------------

TAPPED = [(5, "192.168.250.21", TapEvent(kind, Peer("192.168.250.21", 1), Peer("192.168.250.1", 502), out, b"\1\2", mirrored))
          for kind, out, mirrored in ((TapKind.SYN, True, False), (TapKind.DATA, False, True))]
INPUTS: list[dict[str, Any]] = [
    {}, {"writes": [(3, b"\1\2")]}, {"results": [(0, b"")]}, {"refreshed": [(97, b"abc")]}, {"forces": {}},
    {"forces": {"Main.a": True}}, {"budget": 0}, {"budget": 500}, {"settings": {1: {"link": False}}},
    {"events": {0: [Received(1, b"abc")], 2: []}}, {"traffic": TAPPED}, {"watch": (0, 7)},
    {"writes": [(0, b"1")], "budget": 3, "watch": (1, 2), "traffic": TAPPED[:1]},
]  # fmt: skip


@pytest.mark.parametrize("inputs", INPUTS, ids=lambda inputs: " ".join(inputs) or "none")
def test_inputs_of_a_scan_come_back(inputs: dict[str, Any]) -> None:
    made = ScanInputs(7, **inputs)
    data = encode_inputs(made)
    assert set(data) == {"scan", *(name for name in inputs if inputs[name] or name in ("forces", "budget", "watch"))}
    assert decode_inputs(load(dump(data)), 100) == made


def test_bytes_outside_the_memory_are_refused() -> None:
    row = encode_inputs(ScanInputs(7, writes=[(98, b"ab")]))
    assert decode_inputs(row, 100).writes == [(98, b"ab")]
    with pytest.raises(ValueError, match="2 bytes at 98 are outside the memory"):
        decode_inputs(row, 99)


ROWS = [[5, 100, 10, 4], [9, 200, 0, 1]]


def test_scans_come_back_with_their_times() -> None:
    inputs = [ScanInputs(6, budget=3), ScanInputs(9, watch=(1, 2))]
    for memories in ((), (1, 2, 3, 4, 5)):
        found = decode_scans(encode_scans(ROWS, inputs, True, 77, memories), 5, 5)
        assert (found.first, found.times.rows(5), found.numbers, found.machine, found.memory) == (5, ROWS, [6, 9], True, 77)
        assert list(found.memories) == list(memories) and [decode_inputs(row, 9) for row in found.inputs] == inputs
    assert decode_scans(encode_scans([[0, 0, 0, 1]], [], False, 0, ()), 0, 1).machine is False


WRONG = {
    "scan 5 where 4 should be": (ROWS, [], (), 4, 5), "5 scans where 4 should be": ([[5, 0, 0, 4], [9, 0, 0, 1]], [], (), 5, 4),
    "5 scans where 6 should be": (ROWS, [], (), 5, 6), "5 scans where 5 should be": (ROWS, [], (1, 2), 5, 5),
    "inputs that belong to no scan": (ROWS, [4], (), 5, 5), "inputs that belong to no scan, or": (ROWS, [10], (), 5, 5),
    "or are not in their order": (ROWS, [7, 6], (), 5, 5), "or are not in their order$": (ROWS, [7, 7], (), 5, 5),
    "is no number from 0 to 5": ([[5, 0, 0, 6]], [], (), 5, 5),
}  # fmt: skip


@pytest.mark.parametrize("said", WRONG)
def test_scans_that_do_not_fit_are_refused(said: str) -> None:
    rows, inputs, memories, first, scans = WRONG[said]
    payload = encode_scans(rows, [ScanInputs(scan, budget=1) for scan in inputs], False, 0, memories)
    with pytest.raises(ValueError, match=said):
        decode_scans(payload, first, scans)


def stored(plc: Plc) -> StoredChunk:
    return StoredChunk(plc.snapshot(), [], 10, False, plc.memory.size)


def test_segments_follow_one_another_and_time_never_runs_backwards() -> None:
    plc = Plc(counter_image())
    plc.run(scans=5)
    chunk = stored(plc)
    now_ns = plc.snapshot().now_ns
    for first, rows, machine in ((5, [[5, now_ns, 10, 2]], False), (7, [[7, now_ns + 10, 0, 1]], True),
                                 (8, [[8, now_ns + 10, 5, 2]], False)):  # fmt: skip
        chunk.add_segment(decode_scans(encode_scans(rows, [ScanInputs(first, budget=first)], machine, 0, ()), first, rows[0][3]))
        assert chunk.machine is (first >= 7)
    assert chunk.numbers == [5, 7, 8] and chunk.times.end == 10 and chunk.inputs_of(7) == ScanInputs(7, budget=7)
    assert [chunk.times.at(scan) - now_ns for scan in range(5, 10)] == [0, 10, 10, 10, 15]
    for late in (now_ns + 14, now_ns - 1):
        with pytest.raises(ValueError, match="time runs backwards"):
            chunk.add_segment(decode_scans(encode_scans([[10, late, 0, 1]], [], False, 0, ()), 10, 1))
    with pytest.raises(ValueError, match="time runs backwards"):
        stored(plc).add_segment(decode_scans(encode_scans([[5, now_ns - 1, 0, 1]], [], False, 0, ()), 5, 1))
    assert (chunk.next_with_inputs(6), chunk.next_with_inputs(9), chunk.inputs_of(6)) == (7, None, None)
    chunk.cut(8)
    assert (chunk.numbers, chunk.times.end, len(chunk.inputs)) == ([5, 7], 8, 2) and isinstance(chunk.times, Times)


# --- keyframes ----------------------------------------------------------------------------------------------------------


class Foreign:
    """A unit of a class that fbvm does not know."""

    name, address = "mine", "10.0.0.9"


@pytest.mark.parametrize("kept", [None, UnitState(None, {"a": 1}), UnitState(Snapshot((None, bytes([7]) * PAGE_BYTES)), (2,))])
def test_a_keyframe_comes_back_with_all_that_it_has(kept: UnitState | None) -> None:
    plc = Plc(counter_image())
    plc.force("A200.11", True)
    plc.run(scans=3)
    state = plc.snapshot()
    object.__setattr__(state, "trap", Trap("R0102", Site("a.st", "Main", 4, 5), (9, "x"), "index 9", 12))
    chunk = Chunk(state, [UnitKeyframe(Foreign(), kept)], 5000, True)  # type: ignore[arg-type]
    reader = KeyframeReader(plc.memory.size, plc.image)
    found = reader.chunk(encode_keyframe(chunk), lambda at: pytest.fail("it has no base"))
    assert bytes(found.state.memory) == bytes(state.memory)
    assert replace(found.state, memory=state.memory) == state and (found.budget, found.follows, found.first) == (5000, True, 3)
    [unit] = found.units
    assert (unit.unit.name, unit.unit.address) == ("mine", "10.0.0.9")
    assert (unit.state and (unit.state.other, unit.state.memory and bytes(unit.state.memory))) == (
        kept and (kept.other, kept.memory and bytes(kept.memory)))
    assert KeyframeReader(plc.memory.size, None).chunk(encode_keyframe(chunk), lambda at: ()).state.forces == {}


def test_a_keyframe_beside_a_base_has_its_changed_pages_only() -> None:
    plc = Plc(counter_image())
    plc.write("D9000", 5)
    plc.scan()
    first = Chunk(plc.snapshot(), [], 1, False)
    plc.scan()
    second = Chunk(plc.snapshot(), [], 1, True)
    reader = KeyframeReader(plc.memory.size, plc.image)
    base, whole = encode_keyframe(first), encode_keyframe(second)
    beside = encode_keyframe(second, reader.base(base), 99)
    assert len(beside) <= len(whole) - PAGE_BYTES + 2
    asked: list[int] = []

    def base_of(at: int) -> list[Snapshot]:
        asked.append(at)
        return reader.base(base)

    assert bytes(reader.chunk(beside, base_of).state.memory) == bytes(second.state.memory) and asked == [99]
    with pytest.raises(ValueError, match="a base that has a base"):
        reader.base(beside)
    with pytest.raises(ValueError, match="its base has other memories"):
        reader.chunk(beside, lambda at: [*reader.base(base), *reader.base(base)])
    with pytest.raises(ValueError, match="pages of memory"):
        KeyframeReader(plc.memory.size + PAGE_BYTES, plc.image).chunk(whole, base_of)
    with pytest.raises(ValueError, match="a page of memory is missing"):
        reader.chunk(whole[:-1], base_of)
    assert keyframe_codec.MOST_PAGES == 1 << 17


def test_a_packed_snapshot_has_its_pages_again() -> None:
    zero, one, two = None, bytes([1]) * PAGE_BYTES, bytes([2]) * PAGE_BYTES
    base = Snapshot((zero, one, one, two, zero))
    for pages in ((zero, one, one, two, zero), (two, zero, two, two, one), (bytes(PAGE_BYTES), one, bytes(one), two, zero)):
        packed = PackedSnapshot(Snapshot(pages), base)
        wanted = tuple(None if page == bytes(PAGE_BYTES) else page for page in pages)
        assert packed.pages == unpacked(packed).pages == wanted and type(unpacked(packed)) is Snapshot
        changed = sum(new != old for new, old in zip(pages, base.pages, strict=True))
        assert packed.size_bytes - len(packed._packed) == 8 * changed
    assert unpacked(base) is base


# --- traces -------------------------------------------------------------------------------------------------------------


def test_chunks_of_a_trace_are_found_up_to_where_it_was_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    file = io.BytesIO()
    sizes = [write_chunk(file, HEADER, b"{}"), write_chunk(file, BLOCK, bytes(3000), 5, 7)]
    whole = file.getvalue()
    assert sum(sizes) == len(whole)
    found = [TraceChunk(HEADER, 0, 0, 0), TraceChunk(BLOCK, sizes[0], 5, 7)]
    for cut in range(len(whole) + 1):
        part = io.BytesIO(whole[:cut])
        count = (cut >= sizes[0]) + (cut >= len(whole))
        assert list(chunks(part)) == found[:count] and part.tell() == [0, sizes[0], len(whole)][count]
    assert [read_chunk(file, at) for at in (0, sizes[0])] == [b"{}", bytes(3000)]
    packed = sizes[1] - 21
    large = "does not end, or is too large"
    for name, limit, said in (("LARGEST_BYTES", packed - 1, "too large"), ("LARGEST_BYTES", 2999, large),
                              ("LARGEST_BYTES", 3000, ""), ("LARGEST_HEADER_BYTES", 0, "")):  # fmt: skip
        with monkeypatch.context() as patch:
            patch.setattr(trace_format, name, limit)
            if said:
                with pytest.raises(TraceError, match=f"the chunk at byte {sizes[0]} .*{said}"):
                    read_chunk(file, sizes[0])
            else:
                assert read_chunk(file, sizes[0]) == bytes(3000)
    with monkeypatch.context() as patch:
        patch.setattr(trace_format, "LARGEST_HEADER_BYTES", 1)
        with pytest.raises(TraceError, match="the chunk at byte 0 does not end, or is too large"):
            read_chunk(file, 0)
    head = struct.pack("<BIIQI", BLOCK, 3, zlib.crc32(b"abd"), 0, 1)
    with pytest.raises(TraceError, match="the chunk at byte 0 is damaged"):
        read_chunk(io.BytesIO(head + b"abc"), 0)


NUMBERS = {0: "00", 1: "01", 0x7F: "7f", 0x80: "8001", 0x3FFF: "ff7f", 0x4000: "808001", 1 << 62: "808080808080808040"}


def test_numbers_have_seven_bits_a_byte_the_lowest_first() -> None:
    for value, text in NUMBERS.items():
        out = bytearray()
        put(out, value, value)
        assert out.hex() == 2 * text
        cursor = Cursor(bytes(out))
        assert (cursor.number(), cursor.more, cursor.number(), cursor.more) == (value, True, value, False)
    with pytest.raises(IndexError):
        Cursor(b"\x80").number()
    assert Cursor(b"\x80" * 20 + b"\1").number() == 1 << 140
    with pytest.raises(IndexError, match="a number is too large"):
        Cursor(b"\x80" * 21 + b"\1").number()


def test_bytes_end_with_the_block() -> None:
    cursor = Cursor(b"abc")
    assert (cursor.bytes(2), cursor.bytes(0), cursor.bytes(1), cursor.more) == (b"ab", b"", b"c", False)
    with pytest.raises(IndexError, match="the block ends too early"):
        cursor.bytes(1)


def test_results_of_bodies_come_back() -> None:
    made = {0: [Field("F", INT, 4, "RESULT"), Field("out", INT, 6, "VAR_OUTPUT")], 12: [Field("M", INT, 8, "RESULT")]}
    found = results.from_data(results.to_data(made))
    assert {body: [(field.name, field.offset, field.kind) for field in fields] for body, fields in found.items()} == {
        body: [(field.name, field.offset, field.kind) for field in fields] for body, fields in made.items()}
    wrong = results.symbols.to_data({"a": Field("no number", INT, 4)})
    with pytest.raises(SymbolError, match="no result: no number"):
        results.from_data(wrong)


# --- errors -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("error", "said"), [
    (ValueError("x"), "it is damaged: x"), (KeyError("x"), "it is damaged: 'x'"), (struct.error("x"), "it is damaged: x"),
    (RecursionError("x"), "it is damaged: it is nested too deeply"), (RecordingError("already said"), "^already said$"),
])  # fmt: skip
def test_what_damaged_data_raise_is_one_sentence(error: Exception, said: str) -> None:
    with pytest.raises(RecordingError, match=said), damages("it is damaged"):
        raise error


def test_other_errors_stay_what_they_are() -> None:
    with pytest.raises(OSError, match="full"), damages("it is damaged"):
        raise OSError("full")
    with damages("it is damaged"):
        pass


@pytest.mark.slow
def test_the_text_of_a_program_comes_back_and_says_why_it_cannot_be_compiled() -> None:
    text = ProgramText((("a.st", "PROGRAM Main n := 1; END_PROGRAM"),), ("lib",), (), "Main", "r", "codesys", True, ("E0",))
    assert ProgramText.of(load(dump(text.as_data()))) == text
    plain = ProgramText((("a.st", "x"),))
    assert ProgramText.of(load(dump(plain.as_data()))) == plain and plain.texts == {"a.st": "x"}
    assert ProgramText().compiled() == "it holds no sources of the program; from Python, hand over its image"
    assert text.compiled() == "the program needs the library folder lib; say where it is now with --library"
    wrong = ProgramText((("a.st", "PROGRAM Main n := 1; END_PROGRAM"),))
    assert str(wrong.compiled()).startswith("the program does not compile here: S0201 ")
    found = ProgramText((("a.st", "PROGRAM Main ; END_PROGRAM"),), dialect="nothing").compiled()
    assert isinstance(found, str) and "nothing" in found
