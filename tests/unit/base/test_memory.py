"""The flat memory: views, areas, values at any place, snapshots by page."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import pytest

from fbvm.base.areas import AREAS, PAGE_BYTES, SLOTS_OFFSET
from fbvm.base.memory import STRUCTS, Memory, changes, compare
from fbvm.code.image import Layout

SIZE = SLOTS_OFFSET + 2 * PAGE_BYTES


@pytest.fixture
def memory() -> Memory:
    return Memory(SIZE, AREAS)


def test_all_is_zero_at_first(memory: Memory) -> None:
    assert bytes(memory.u8) == bytes(SIZE)


@pytest.mark.parametrize(("machine", "value"), [
    ("b", True), ("i8", -1), ("u8", 255), ("i16", -2), ("u16", 65535), ("i32", -(2**31)), ("u32", 2**32 - 1),
    ("i64", -(2**63)), ("u64", 2**64 - 1), ("f32", 1.5), ("f64", -0.1), ("ref", 2**64 - 1),
])
@pytest.mark.parametrize("offset", [SLOTS_OFFSET, SLOTS_OFFSET + 1, SLOTS_OFFSET + 7])
def test_a_value_is_read_as_it_was_written_at_any_offset(memory: Memory, machine: str, value: Any, offset: int) -> None:
    memory.write(offset, machine, value)
    assert memory.read(offset, machine) == value
    size = STRUCTS[machine].size
    assert bytes(memory.u8[offset:offset + size]) == STRUCTS[machine].pack(value)
    if offset % size == 0:
        assert memory.views[machine][offset // size] == value


def test_a_bit_leaves_its_neighbours(memory: Memory) -> None:
    memory.u8[5000] = 0b1010_0101
    memory.write(5000, "b", True, bit=1)
    memory.write(5000, "b", False, bit=7)
    assert memory.u8[5000] == 0b0010_0111
    assert [memory.read(5000, "b", bit=bit) for bit in range(3)] == [True, True, True]
    assert memory.read(5000, "b", bit=7) is False


def test_a_text_ends_at_its_zero_and_is_cut(memory: Memory) -> None:
    memory.write(SLOTS_OFFSET, "u64", 2**64 - 1)
    memory.write_text(SLOTS_OFFSET, 4, b"abcdef")
    assert memory.read_text(SLOTS_OFFSET, 4) == b"abcd"
    assert bytes(memory.u8[SLOTS_OFFSET:SLOTS_OFFSET + 6]) == b"abcd\0\xff"
    memory.write_text(SLOTS_OFFSET, 4, b"x")
    assert memory.read_text(SLOTS_OFFSET, 4) == b"x"


@pytest.mark.parametrize("offset", [-1, SIZE - 1, SIZE, 2**40])
def test_outside_is_an_index_error(memory: Memory, offset: int) -> None:
    for use in (lambda: memory.read(offset, "u16"), lambda: memory.write(offset, "u16", 1),
                lambda: memory.read_text(offset, 5), lambda: memory.write_text(offset, 5, b"")):
        with pytest.raises(IndexError):
            use()


def test_a_value_that_does_not_fit_is_refused(memory: Memory) -> None:
    with pytest.raises(struct.error):
        memory.write(5000, "u8", 256)


def test_words_are_those_of_the_area(memory: Memory) -> None:
    words = memory.words("D")
    assert (words.format, len(words)) == ("H", 32768)
    words[100] = 0x1234
    assert bytes(memory.u8[AREAS["D"].offset + 200:AREAS["D"].offset + 202]) == b"\x34\x12"
    assert memory.words("D") is words
    assert {name: len(memory.words(name)) for name in ("CIO", "W", "TF", "M")} == {
        "CIO": 6144, "W": 512, "TF": 256, "M": 32768}


def test_an_area_that_is_not_there_is_a_key_error(memory: Memory) -> None:
    with pytest.raises(KeyError):
        memory.words("E0")


def test_e_banks_lie_behind_the_slots() -> None:
    layout = Layout(100, ("E0", "EC"))
    memory = Memory(layout.size, layout.areas)
    memory.words("EC")[32767] = 7
    memory.words("E0")[0] = 9
    assert memory.read(layout.size - 2, "u16") == 7
    assert memory.read(SLOTS_OFFSET + PAGE_BYTES, "u16") == 9


# --- snapshots ---


def test_zero_pages_cost_nothing_and_pages_are_shared(memory: Memory) -> None:
    empty = memory.snapshot()
    assert set(empty.pages) == {None}
    memory.write(5000, "u8", 1)
    memory.write(SLOTS_OFFSET, "u8", 1)
    first = memory.snapshot()
    assert sum(page is not None for page in first.pages) == 2
    memory.write(5001, "u8", 1)
    second = memory.snapshot()
    assert [a is b for a, b in zip(first.pages, second.pages, strict=True)].count(False) == 1
    memory.write(SLOTS_OFFSET, "u8", 0)
    assert memory.snapshot().pages[SLOTS_OFFSET // PAGE_BYTES] is None


def test_a_quiet_memory_gives_the_same_snapshot(memory: Memory) -> None:
    memory.write(5000, "u8", 1)
    assert memory.snapshot() is memory.snapshot()


def test_restore_brings_everything_back(memory: Memory) -> None:
    memory.words("D")[5] = 1
    before, content = memory.snapshot(), bytes(memory.u8)
    memory.words("D")[5] = 2
    memory.words("W")[0] = 3
    memory.write(SIZE - 1, "u8", 9)
    memory.restore(before)
    assert bytes(memory.u8) == content == bytes(before)
    assert memory.snapshot() is before


def test_a_fork_goes_its_own_way(memory: Memory) -> None:
    memory.words("D")[5] = 1
    other = memory.fork()
    page = AREAS["D"].offset // PAGE_BYTES
    assert other.snapshot().pages[page] is memory.snapshot().pages[page]
    other.words("D")[5] = 2
    assert (memory.words("D")[5], other.words("D")[5]) == (1, 2)


def test_compare_names_every_run_of_bytes_that_differ(memory: Memory) -> None:
    before = memory.snapshot()
    assert compare(before, before) == []
    memory.u8[100:103] = b"abc"
    memory.u8[104] = 1
    memory.u8[PAGE_BYTES * 3 - 2:PAGE_BYTES * 3 + 2] = b"wxyz"
    memory.u8[SIZE - 1] = 1
    after = memory.snapshot()
    assert compare(before, after) == compare(after, before) == [(100, 3), (104, 1), (PAGE_BYTES * 3 - 2, 4),
     (SIZE - 1, 1)]


@pytest.mark.parametrize("size", [0, -PAGE_BYTES, PAGE_BYTES + 10])
def test_a_memory_has_whole_pages(size: int) -> None:
    with pytest.raises(ValueError, match="whole pages"):
        Memory(size, {})


def test_close_ends_all_views(memory: Memory) -> None:
    words, view = memory.words("D"), memory.views["i16"]
    memory.close()
    for ended in (words, view, memory.u8):
        with pytest.raises(ValueError, match="released"):
            ended[0]
    assert memory.map.closed


def test_close_while_somebody_looks_at_a_slice(memory: Memory) -> None:
    piece = memory.words("D")[3:5]
    memory.close()
    assert list(piece) == [0, 0]


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="the host does not tell its memory in /proc")
def test_a_memory_costs_what_it_touches() -> None:
    def resident_pages() -> int:
        return int(Path("/proc/self/statm").read_text().split()[1])

    layout = Layout(4096, tuple(f"E{bank:X}" for bank in range(13)))
    before = resident_pages()
    memories = [Memory(layout.size, layout.areas) for _ in range(100)]
    for memory in memories:
        memory.words("CIO")[0] = 1
        memory.snapshot()
    assert len(memories) == 100
    assert resident_pages() - before < 100 * layout.size // PAGE_BYTES // 4


@pytest.mark.parametrize("places", [
    (0,), (1,), (0, 1, 2), (PAGE_BYTES - 1, PAGE_BYTES), (PAGE_BYTES, 2 * PAGE_BYTES - 1), (5, 7), (),
])
def test_changes_are_runs_of_bytes_with_what_is_there_now(places: tuple[int, ...]) -> None:
    old, new = bytes(2 * PAGE_BYTES), bytearray(2 * PAGE_BYTES)
    for place in places:
        new[place] = 1 + place % 200
    found = changes(old, bytes(new))
    assert [at + number for at, data in found for number in range(len(data))] == list(places)
    assert all(bytes(new[at:at + len(data)]) == data for at, data in found)
    assert len(found) == sum(place - 1 not in places or place - 1 < 0 for place in places)
