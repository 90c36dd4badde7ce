"""The flat memory of one PLC: one anonymous mapping, typed views over it, and snapshots that share unchanged pages.

Only pages that are written take memory.  The layout is that of the areas; variables are known to others."""

from __future__ import annotations

import contextlib
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from fbvm.base.areas import PAGE_BYTES, Area
from fbvm.base.host import anonymous_memory

WHOLE_BYTES = 255
"""Bit number of a value that fills bytes."""
OBJECT_SHIFT, OFFSET_SHIFT, OFFSET_MASK, BIT_MASK = 40, 8, (1 << 32) - 1, 255
"""Where the parts of a reference lie in its 64 bits."""
BUFFER_OBJECT = 1
"""The object that the whole buffer is."""
FORMATS = {"b": "?", "i8": "b", "u8": "B", "i16": "h", "u16": "H", "i32": "i", "u32": "I", "i64": "q", "u64": "Q",
           "f32": "f", "f64": "d", "ref": "Q"}
"""Machine types and the letters by which `struct` and memoryview know them."""
STRUCTS = {machine: struct.Struct("<" + letter) for machine, letter in FORMATS.items()}
_ZERO_PAGE = bytes(PAGE_BYTES)


def reference_to_byte(number: int) -> int:
    """The reference to the byte of that number in the buffer; one so far from NULL where no program has a variable."""
    whole = BUFFER_OBJECT << OBJECT_SHIFT | WHOLE_BYTES if number >= PAGE_BYTES else 0
    return number << OFFSET_SHIFT | whole


@dataclass(frozen=True, eq=False)
class Snapshot:
    """The contents of a memory at one moment: its pages, None for a page of zeros."""

    pages: tuple[bytes | None, ...]

    def __bytes__(self) -> bytes:
        return b"".join(page or _ZERO_PAGE for page in self.pages)


class _Views(dict[str, memoryview]):
    """Views of a whole buffer by machine type."""

    __slots__ = ("_whole",)

    def __init__(self, whole: memoryview) -> None:
        super().__init__()
        self._whole = whole

    def __missing__(self, machine: str) -> memoryview:
        view: memoryview = self._whole.cast(FORMATS[machine])  # type: ignore[call-overload]
        self[machine] = view
        return view


class Memory:
    """A buffer of `size` bytes (whole pages), all zeros at first, and the areas in it.

    `views` are writable memoryviews by machine type, each over the whole buffer (item i lies at i * its size), made when somebody
    asks for them.  Values are little-endian.  Reading and writing outside the buffer raises IndexError.  `areas` must not be
    changed."""

    def __init__(self, size: int, areas: Mapping[str, Area]) -> None:
        if size <= 0 or size % PAGE_BYTES:
            raise ValueError(f"a memory has whole pages of {PAGE_BYTES} bytes; {size} bytes are none")
        self.size = size
        self.areas = areas
        self.map = anonymous_memory(size)
        self.u8 = memoryview(self.map)
        self.views: Mapping[str, memoryview] = _Views(self.u8)
        self._words: dict[str, memoryview] = {}
        self._last: Snapshot | None = None

    def words(self, area: str) -> memoryview:
        """The words of an area as a writable memoryview of format "H".  Raises KeyError if there is no such area."""
        view = self._words.get(area)
        if view is None:
            row = self.areas[area]
            view = self._words[area] = self.views["u16"][row.offset // 2:(row.offset + row.size_bytes) // 2]
        return view

    def read(self, offset: int, machine: str, bit: int = WHOLE_BYTES) -> int | float | bool:
        """The value of a machine type at any offset; of BOOL, the byte or the `bit` that is named."""
        self._check(offset, STRUCTS[machine].size)
        if bit != WHOLE_BYTES:
            return self.u8[offset] >> bit & 1 == 1
        value: int | float | bool = STRUCTS[machine].unpack_from(self.map, offset)[0]
        return value

    def write(self, offset: int, machine: str, value: Any, bit: int = WHOLE_BYTES) -> None:
        """Write a value where `read` finds it.  Raises struct.error for a value that the type cannot hold."""
        self._check(offset, STRUCTS[machine].size)
        if bit != WHOLE_BYTES:
            self.u8[offset] = self.u8[offset] & ~(1 << bit) | bool(value) << bit
        else:
            STRUCTS[machine].pack_into(self.map, offset, value)

    def read_text(self, offset: int, capacity: int) -> bytes:
        """The bytes of a STRING[capacity] up to its ending 0."""
        self._check(offset, capacity)
        return self.map[offset:offset + capacity].partition(b"\0")[0]

    def write_text(self, offset: int, capacity: int, text: bytes) -> None:
        """Write a STRING[capacity], cut to its capacity, and its ending 0."""
        self._check(offset, capacity + 1)
        text = text[:capacity] + b"\0"
        self.map[offset:offset + len(text)] = text

    def _check(self, offset: int, size: int) -> None:
        if offset < 0 or offset + size > self.size:
            raise IndexError(f"{size} bytes at {offset} are not in a memory of {self.size}")

    def snapshot(self) -> Snapshot:
        """The contents now.  Pages without changes are shared with the last snapshot that was taken or restored."""
        last = self._last.pages if self._last else (None,) * (self.size // PAGE_BYTES)
        pages: list[bytes | None] = []
        for number, known in enumerate(last):
            page = self.map[number * PAGE_BYTES:(number + 1) * PAGE_BYTES]
            pages.append(known if page == (known or _ZERO_PAGE) else None if page == _ZERO_PAGE else page)
        if self._last is None or any(new is not old for new, old in zip(pages, last, strict=True)):
            self._last = Snapshot(tuple(pages))
        return self._last

    def restore(self, snapshot: Snapshot) -> None:
        """Bring back the contents of a snapshot of a memory of this size; pages that are the same are not written."""
        for number, page in enumerate(snapshot.pages):
            page = page or _ZERO_PAGE
            at = slice(number * PAGE_BYTES, (number + 1) * PAGE_BYTES)
            if self.map[at] != page:
                self.map[at] = page
        self._last = snapshot

    def fork(self) -> Memory:
        """Another memory with the same areas and contents, which shares its first snapshot's pages with this one."""
        other = Memory(self.size, self.areas)
        other.restore(self.snapshot())
        return other

    def close(self) -> None:
        """Frees the buffer.  Views of the buffer cannot be used afterwards."""
        for view in (*self._words.values(), *self.views.values(), self.u8):
            view.release()
        with contextlib.suppress(BufferError):  # a slice is still in use: the mapping ends with it
            self.map.close()


def compare(a: Snapshot, b: Snapshot) -> list[tuple[int, int]]:
    """The differences of two snapshots of one size: (offset, length) of each run of bytes, from low to high."""
    runs: list[tuple[int, int]] = []
    for number, (left, right) in enumerate(zip(a.pages, b.pages, strict=True)):
        if left is not right:
            _differences(left or _ZERO_PAGE, right or _ZERO_PAGE, number * PAGE_BYTES, runs)
    return runs


def changes(old: bytes, new: bytes) -> list[tuple[int, bytes]]:
    """What has changed between two contents of a memory: (offset, new bytes) of each run of bytes, from low to high."""
    runs: list[tuple[int, int]] = []
    for at in range(0, len(old), PAGE_BYTES):
        _differences(old[at:at + PAGE_BYTES], new[at:at + PAGE_BYTES], at, runs)
    return [(at, new[at:at + size]) for at, size in runs]


def _differences(left: bytes, right: bytes, at: int, runs: list[tuple[int, int]]) -> None:
    """Append the runs of one piece: halves that are equal are not looked at byte by byte."""
    if left == right:
        return
    if len(left) > 1:
        half = len(left) // 2
        _differences(left[:half], right[:half], at, runs)
        _differences(left[half:], right[half:], at + half, runs)
    elif runs and sum(runs[-1]) == at:
        runs[-1] = (runs[-1][0], runs[-1][1] + 1)
    else:
        runs.append((at, 1))
