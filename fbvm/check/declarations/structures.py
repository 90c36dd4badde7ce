"""The layout of a structure or a union: each member lies behind the others, or at its own relative location.

Relative locations count from the structure's start, in units of their own size: `%B2`, `%W1` and `%X2.0` begin at byte 2
(IEC 61131-3 ed. 3, table 11, features 8 and 9)."""

from __future__ import annotations

import re

from fbvm.base.digits import whole_number
from fbvm.base.types import BOOL, Field, StructType, Type, base, fold
from fbvm.check.symbols.facts import holds_block, is_block
from fbvm.check.symbols.size_limits import LARGE_SIZE
from fbvm.syntax import tree

RELATIVE = "a place in a structure is written %B2 (byte 2), %W1 (word 1) or %X2.0 (bit 0 of byte 2)"
_LOCATION = re.compile(r"%([XBWDL])([0-9]{1,9})(?:\.([0-7]))?", re.I)
_UNITS = {"X": 1, "B": 1, "W": 2, "D": 4, "L": 8}


class Members:
    """Collects members.  `shared` ones lie on each other, and the first initial value that is not all zero holds.

    With `pack` members lie at multiples of so many bytes at most, as CODESYS's attribute pack_mode has it."""

    def __init__(self, shared: bool, pack: int | None = None) -> None:
        self.shared, self.pack = shared, pack
        self.fields: dict[str, Field] = {}
        self._content = bytearray()
        self._taken: list[tuple[int, int]] = []
        """First bit and bit behind of each member."""
        self._align = 1
        self._parents: tuple[StructType, ...] = ()

    def extend(self, kind: StructType, initial: bytes) -> None:
        """Begin with the members of another structure, where they lie in that."""
        self.fields |= kind.fields
        self._parents, self._content, self._align = (kind,), bytearray(initial), kind.align
        self._taken.append((0, 8 * kind.size))

    def add(self, name: str, kind: Type, initial: bytes, location: tree.Location | None, packed: bool = False) -> str:
        """Put one more member in its place.  Returns what is wrong with it, "" if nothing.  `packed` ones are single bits."""
        align = kind.align if self.pack is None or holds_block(kind) else min(kind.align, self.pack)
        self._align = max(self._align, align)
        bit: int | None
        if location is not None:
            located = _located(name, kind, location)
            if isinstance(located, str):
                return located
            offset, bit = located
        elif packed:
            offset, bit = self._next_bit()
        else:
            offset, bit = 0 if self.shared else len(self._content) + -len(self._content) % align, None
        if offset + kind.size > LARGE_SIZE:
            return f"{name} would lie beyond the end of any structure"
        start = offset * 8 + (bit or 0)
        end = start + 1 if bit is not None else start + kind.size * 8
        if not self.shared and location is not None and any(start < above and below < end for below, above in self._taken):
            return f"{name} lies on another member"
        self._taken.append((start, end))
        self.fields[fold(name)] = Field(name, kind, offset, bit=bit)
        self._fill(offset, bit, initial)
        return ""

    @property
    def size(self) -> int:
        """Bytes in front of what is put behind the members so far; none if all share their place."""
        return 0 if self.shared else len(self._content)

    def _next_bit(self) -> tuple[int, int]:
        """Behind the bit that was put in last, or a new byte."""
        last = next(reversed(self.fields.values()), None)
        if last is None or last.bit is None or last.bit == 7 or self.shared:
            return 0 if self.shared else len(self._content), 0
        return last.offset, last.bit + 1

    def _fill(self, offset: int, bit: int | None, initial: bytes) -> None:
        content = self._content
        content += bytes(max(0, offset + len(initial) - len(content)))
        if bit is not None:
            content[offset] |= (initial[0] & 1) << bit
        elif not content[offset:offset + len(initial)].strip(b"\0"):
            content[offset:offset + len(initial)] = initial

    def structure(self, name: str) -> tuple[StructType, bytes]:
        """The type of the whole and its initial bytes."""
        self._content += bytes(-len(self._content) % self._align)
        made = StructType(name, len(self._content), self._align, self.fields, parents=self._parents)
        return made, bytes(self._content)


def _located(name: str, kind: Type, location: tree.Location) -> tuple[int, int | None] | str:
    """Offset and bit of a member with a relative location, or what is wrong with that."""
    match = _LOCATION.fullmatch(location.text)
    if match is None:
        return f"{location.text} is no place in a structure"
    offset, bit = whole_number(match[2]) * _UNITS[match[1].upper()], whole_number(match[3]) if match[3] else None
    if (bit is not None) != (match[1].upper() == "X") or bit is not None and base(kind) != BOOL:
        return f"{name} is {kind} and cannot lie at {location.text}"
    if is_block(kind) and offset % kind.align:
        return f"an instance lies at a multiple of {kind.align} bytes, not at {location.text}"
    return offset, bit
