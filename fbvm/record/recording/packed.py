"""Memories of keyframes, packed: what differs from those of an earlier keyframe, compressed."""

from __future__ import annotations

import zlib

from fbvm.base.areas import PAGE_BYTES
from fbvm.base.memory import Snapshot

LEVEL = 1
"""Of compression: the fastest."""
_ZERO_PAGE = bytes(PAGE_BYTES)


class PackedSnapshot(Snapshot):
    """A snapshot that keeps what differs from `base`, an unpacked snapshot of a memory of the same size: of a page in which a few
    variables have changed some bytes.  `pages` makes all of them again."""

    base: Snapshot
    _numbers: tuple[int, ...]
    _packed: bytes

    def __init__(self, snapshot: Snapshot, base: Snapshot) -> None:
        pairs = enumerate(zip(snapshot.pages, base.pages, strict=True))
        changed = {number: _xor(new or _ZERO_PAGE, old or _ZERO_PAGE) for number, (new, old) in pairs
                   if new is not old and new != old}  # fmt: skip
        vars(self).update(base=base, _numbers=tuple(changed), _packed=zlib.compress(b"".join(changed.values()), LEVEL))

    @property
    def pages(self) -> tuple[bytes | None, ...]:
        """The pages, None for a page of zeros."""
        pages, content = list(self.base.pages), zlib.decompress(self._packed)
        for at, number in enumerate(self._numbers):
            page = _xor(content[at * PAGE_BYTES : (at + 1) * PAGE_BYTES], pages[number] or _ZERO_PAGE)
            pages[number] = None if page == _ZERO_PAGE else page
        return tuple(pages)

    @property
    def size_bytes(self) -> int:
        """How many bytes it takes beside its base."""
        return len(self._packed) + 8 * len(self._numbers)


def unpacked(snapshot: Snapshot) -> Snapshot:
    """The snapshot with its pages."""
    return Snapshot(snapshot.pages) if isinstance(snapshot, PackedSnapshot) else snapshot


def _xor(one: bytes, other: bytes) -> bytes:
    return (int.from_bytes(one, "little") ^ int.from_bytes(other, "little")).to_bytes(PAGE_BYTES, "little")
