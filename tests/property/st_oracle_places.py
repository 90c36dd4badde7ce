"""Where values of the tree walker lie when they are not simply variables: bytes that several names share, parts, pointers."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any

from st_kinds import BITS, REALS, here, limits
from st_oracle_values import raw, rounded

Place = tuple[Any, Any]
"""What holds a value, and its key there."""


@dataclass
class Shared:
    """A value in bytes that others may share, least byte first; a bit of them if it has a number."""

    content: bytearray
    kind: str
    first: int
    bit: int | None = None

    def __getitem__(self, key: object) -> Any:
        size = max(1, BITS[self.kind] // 8)
        number = int.from_bytes(self.content[self.first:self.first + size], "little")
        if self.bit is not None:
            return bool(number >> self.bit & 1)
        if self.kind == "BOOL":
            return number != 0
        if self.kind in REALS:
            form = "<f" if self.kind == "REAL" else "<d"
            return struct.unpack(form, number.to_bytes(size, "little"))[0]
        return number - (1 << BITS[self.kind]) if limits(self.kind)[0] and number >> BITS[self.kind] - 1 else number

    def __setitem__(self, key: object, value: Any) -> None:
        size = max(1, BITS[self.kind] // 8)
        if self.bit is not None:
            self.content[self.first] = self.content[self.first] & ~(1 << self.bit) | value << self.bit
            return
        number = raw(self.kind, rounded(self.kind, value)) if self.kind in REALS else int(value)
        self.content[self.first:self.first + size] = (number & (1 << 8 * size) - 1).to_bytes(size, "little")


class SharedRow:
    """An array of such values."""

    def __init__(self, content: bytearray, kind: str, first: int, count: int) -> None:
        size = max(1, BITS[kind] // 8)
        self._items = [Shared(content, kind, first + size * number) for number in range(count)]

    def __getitem__(self, key: Any) -> Any:
        return [item[0] for item in self._items] if isinstance(key, slice) else self._items[key][0]

    def __setitem__(self, key: Any, value: Any) -> None:
        if isinstance(key, slice):
            for item, one in zip(self._items, list(value), strict=True):
                item[0] = one
        else:
            self._items[key][0] = value

    def __len__(self) -> int:
        return len(self._items)

    def __iter__(self) -> Any:
        return iter(self[:])


class Union(dict[str, Any]):
    """Members that begin at the same byte."""

    def __init__(self, members: tuple[tuple[str, str], ...]) -> None:
        content = bytearray(8)
        super().__init__({name: Shared(content, here(kind), 0) for name, kind in members})

    def __getitem__(self, name: str) -> Any:
        return super().__getitem__(name)[0]

    def __setitem__(self, name: str, value: Any) -> None:
        super().__getitem__(name)[0] = value

    def items(self) -> Any:
        return [(name, self[name]) for name in self]


@dataclass
class Part:
    """Some bits of an integer or a bit string."""

    whole: Place
    kind: str
    first: int
    bits: int

    def __getitem__(self, key: object) -> Any:
        number = self.whole[0][self.whole[1]] >> self.first & (1 << self.bits) - 1
        return bool(number) if self.bits == 1 else number

    def __setitem__(self, key: object, value: Any) -> None:
        mask = (1 << self.bits) - 1 << self.first
        number = self.whole[0][self.whole[1]] & (1 << BITS[self.kind]) - 1 & ~mask | int(value) << self.first
        negative = limits(self.kind)[0] and number >> BITS[self.kind] - 1
        self.whole[0][self.whole[1]] = number - (1 << BITS[self.kind]) if negative else number


class Temporaries(dict[str, Any]):
    """Variables that end with the call."""

    ended = False


@dataclass(frozen=True)
class Pointer:
    """A variable, or an element of an array, and how many elements it was moved from there."""

    holder: Any
    key: Any
    moved: int = 0

    def place(self, more: int = 0) -> Place | None:
        """What it points to; None outside of the variable, and when that has ended."""
        steps = self.moved + more
        if isinstance(self.holder, Temporaries) and self.holder.ended:
            return None
        if isinstance(self.holder, list):
            return (self.holder, self.key + steps) if 0 <= self.key + steps < len(self.holder) else None
        return (self.holder, self.key) if steps == 0 else None


def reach_byte(place: Place, kind: str, number: int, byte: int) -> tuple[int, int | None]:
    """Size of a number or an array of numbers in bytes; and one of the bytes, which is replaced, if there is that many."""
    element = kind.split()[-1]
    each = BITS[element] // 8
    holder, key = (place[0][place[1]], number // each) if kind.startswith("ARRAY") else place
    size = each * (len(holder) if kind.startswith("ARRAY") else 1)
    if not 0 <= number < size:
        return size, None
    part = Part((holder, key), element, 8 * (number % each), 8)
    was = part[""]
    part[""] = byte
    return size, was
