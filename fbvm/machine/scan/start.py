"""What a start of a PLC clears and what survives it."""

from __future__ import annotations

from collections.abc import Iterable

from fbvm.base.areas import PAGE_BYTES
from fbvm.base.memory import Memory, Snapshot
from fbvm.code.image import Image

Kept = list[tuple[int, bytes]]
"""Offsets, and the bytes that are kept there."""


def retained(memory: Memory, image: Image, held: Iterable[str] = ()) -> Kept:
    """The contents of retained areas, of RETAIN variables, and of the areas named in `held`."""
    areas = [area for area in memory.areas.values() if area.retained or area.name in held]
    extents = [(area.offset, area.size_bytes) for area in areas]
    extents += [(row.offset, row.size) for row in image.retained]
    return [(offset, bytes(memory.u8[offset : offset + size])) for offset, size in extents]


def start(memory: Memory, image: Image, kept: Kept) -> None:
    """Clears all memory, writes initial values, and then what is kept."""
    memory.restore(Snapshot((None,) * (memory.size // PAGE_BYTES)))
    write(memory, image.initial)
    write(memory, kept)


def write(memory: Memory, parts: Iterable[tuple[int, bytes]]) -> None:
    """Writes bytes at offsets."""
    for offset, data in parts:
        memory.u8[offset : offset + len(data)] = data
