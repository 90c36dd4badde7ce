"""The Image: everything that is needed to run, trace and draw a program, and nothing of its tree.

All code is plain data (see `operations`).
"""

from __future__ import annotations

import hashlib
import marshal
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from fbvm.base.areas import AREAS, PAGE_BYTES, SIZED_AREAS, SLOTS_OFFSET, Area, Mailbox, e_bank, with_sizes_apart
from fbvm.base.types import Field, Type
from fbvm.code.operations import HEAP, LEASED, Block

USUAL_HEAP, LARGEST_HEAP = 1 << 20, 1 << 30
"""Bytes of a heap for which nothing else is said, and of the largest."""
SAME_FOR_EQUAL = 2
"""The version of `marshal` in which equal data are equal bytes, whether or not parts of them are one object."""


DISPATCH = "DISPATCH"
"""In place of the word of a declaration: a part that executes the body which its instance has for a call."""


@dataclass(unsafe_hash=True)
class Site:
    """A place in the source: name of the file, name of the POU, line and column from 1 on.  It never changes, as a `Field`."""

    file: str
    pou: str
    line: int
    column: int

    def __str__(self) -> str:
        return f"{self.file}:{self.line}:{self.column}" + (f" in {self.pou}" if self.pou else "")


@dataclass(frozen=True)
class Body:
    """The code of one POU: its name, the word of its declaration (FUNCTION_BLOCK ...), and its operations.

    `instance_size` is the size of an instance in bytes; 0 for a function, which has a frame at a fixed place instead.  With
    `is_part` it is the code of some statements of a POU, executed for the same instance and among its frames; observations do not
    tell of its calls."""

    name: str
    kind: str
    code: Block
    instance_size: int
    is_part: bool = False


@dataclass(frozen=True)
class ProgramRun:
    """One program instance that a task runs: its path, the number of its body, the offset of the instance in the buffer."""

    name: str
    body: int
    offset: int


@dataclass(frozen=True)
class TaskRow:
    """A task.  An `interval_ns` of 0 means in every cycle; `single` is the path of the BOOL whose rising edge starts it, or "".

    The task with the smaller `priority` goes first; its programs run in the order of writing."""

    name: str
    priority: int
    interval_ns: int
    single: str
    programs: tuple[ProgramRun, ...]


@dataclass(frozen=True)
class Layout:
    """How large the parts of the flat buffer of a PLC are, and where they begin.

    `slots_size` is the number of bytes of variables, instances, frames and leases; `e_banks` names the optional banks of the
    E area that the program uses; `mailboxes` are areas that units bring.  `sized` names those of SIZED_AREAS that the program
    uses, which are there in place of I, Q and M; None where sizes of addresses share these."""

    slots_size: int
    e_banks: tuple[str, ...] = ()
    mailboxes: tuple[Mailbox, ...] = ()
    sized: tuple[str, ...] | None = None
    heap_bytes: int = 0
    """Bytes of the heap, from which __NEW takes; it comes behind everything else."""

    @cached_property
    def areas(self) -> dict[str, Area]:
        """All areas that a PLC with this image has: behind the slots what units bring, then those for sizes, then E banks."""
        areas = dict(AREAS) if self.sized is None else with_sizes_apart(AREAS, ())
        at = _page_up(SLOTS_OFFSET + self.slots_size)
        for area in (*(box.at(0) for box in self.mailboxes), *(SIZED_AREAS[name] for name in self.sized or ()),
                     *(e_bank(name, 0) for name in self.e_banks)):
            areas[area.name] = replace(area, offset=at)
            at = _page_up(at + area.size_bytes)
        return areas

    @cached_property
    def heap_at(self) -> int:
        """Where the heap begins."""
        return _page_up(max(SLOTS_OFFSET + self.slots_size, *(a.offset + a.size_bytes for a in self.areas.values())))

    @cached_property
    def size(self) -> int:
        """Bytes of the whole buffer, in whole pages."""
        return self.heap_at + _page_up(self.heap_bytes)


def _page_up(size: int) -> int:
    return (size + PAGE_BYTES - 1) // PAGE_BYTES * PAGE_BYTES


@dataclass(frozen=True)
class Retained:
    """Bytes that a warm start keeps: their offset and number, and the name by which they are found in a changed program."""

    name: str
    offset: int
    size: int


@dataclass(frozen=True)
class Objects:
    """What pointers may be moved in.

    `extents` has a row for each variable that lives as long as the program and that something refers to, for the objects
    from FIRST_OBJECT on: the offset of its first byte, and of the first behind it.

    `leases` is the number of rows in the buffer, from `leases_at` on (see LEASE_BYTES), for what ends while pointers to it are
    kept.  The object of a lease is LEASED + (row << `held_bits`) + the number under which it is held, which is another one
    each time: so a pointer of an earlier lease of the same row is found out.

    The last `heap_rows` of them are for what __NEW makes, from the one with the number `heap_row` on; `heap_at` is where the
    words lie that __NEW and __DELETE work with (see operations.HEAP)."""

    extents: tuple[tuple[int, int], ...] = ()
    leases: int = 0
    leases_at: int = 0
    heap_rows: int = 0
    heap_row: int = 0
    heap_at: int = 0

    @property
    def held_bits(self) -> int:
        """Bits for the number under which a lease is held."""
        return 23 - max(self.leases - 1, 0).bit_length()

    def is_made(self, number: int) -> bool:
        """True for the number of an object that __NEW has made."""
        return self.heap_rows > 0 and number >= LEASED + (self.heap_row << self.held_bits)


@dataclass(frozen=True)
class RungPicture:
    """A rung as it was written, for those who draw it: the number of its body, its site, its number in the body, its comment,
    and its steps.  A step is the site that observations of it name, prefix, mnemonic and operands."""

    body: int
    site: int
    number: int
    comment: str
    steps: tuple[tuple[int, str, str, tuple[str, ...]], ...]
    is_text: bool = False
    """True for a statement of Structured Text that is drawn as a rung; `comment` says why if it has no steps."""
    section: str = ""
    """The section that begins with it, "" if none does."""


@dataclass(frozen=True)
class SfcPicture:
    """A sequential function chart as it was written, for those who draw it: the number of its body, the site at which
    each call of it begins, its steps and its transitions.

    A step is its name, whether it is an initial one, the offset of its flag in an instance, and for each association
    (qualifier with time, action, indicators).  A transition is the site that observations of it name, its name, its priority
    (0 for none), the numbers of the steps in front of and behind it, and its condition."""

    body: int
    site: int
    steps: tuple[tuple[str, bool, int, tuple[tuple[str, str, str], ...]], ...]
    transitions: tuple[tuple[int, str, int, tuple[int, ...], tuple[int, ...], str], ...]


@dataclass(frozen=True)
class Image:
    """A compiled program: plain data without a tree or a file, of which any number of PLCs can be made (`Plc(image)`).

    `fbvm list` prints one; rows of one tuple name rows of another by their number."""

    layout: Layout
    """How many bytes of memory the program needs, and which areas it uses."""
    bodies: tuple[Body, ...]
    """The operations of each POU that is called, with the size of its instances in bytes."""
    tasks: tuple[TaskRow, ...]
    """The tasks with their intervals in nanoseconds and the programs that each runs."""
    symbols: dict[str, Field]
    """Programs and global variables by folded name; their offsets count from the start of the buffer.  Members are found through
    their types."""
    initial: tuple[tuple[int, bytes], ...]
    """Offsets and the bytes to write there at power-on, over a buffer of zeros."""
    retained: tuple[Retained, ...]
    """What keeps its value through a warm start."""
    sites: tuple[Site, ...]
    """The places in sources (file, POU, line, column) that statements and traps name by number."""
    types: dict[str, Type] = field(default_factory=dict)
    """Derived types and blocks by folded name."""
    objects: Objects = field(default_factory=Objects)
    """The variables that references may point to, with their extents."""
    rungs: tuple[RungPicture, ...] = ()
    """The rungs of ladder as they are drawn."""
    charts: tuple[SfcPicture, ...] = ()
    """The sequential function charts as they are drawn."""
    frames: dict[str, dict[str, Field]] = field(default_factory=dict)
    """Variables of functions and temporary variables, by the folded names of POU and variable; their offsets count from the
    start of the buffer.  Their values are there while the POU is executed."""
    counters: int = 0
    """Counters beside the memory that its code counts in; see `fbvm.engine.counted`."""
    marks: int = 0
    """Bytes beside the memory in which its code notes power; see `fbvm.engine.powered`."""

    @cached_property
    def fingerprint(self) -> str:
        """A hash in hexadecimal of all that decides what the program does, its layout included: another program has another."""
        around = repr((self.layout, self.tasks, self.initial, self.retained, self.objects)).encode()
        digest = hashlib.sha256(b"%d:" % len(around) + around)
        for body in self.bodies:
            content = _plain_bytes((body.name, body.code, body.instance_size))
            digest.update(b"%d:" % len(content) + content)
        return digest.hexdigest()[:32]

    def with_e_banks(self, banks: Iterable[str]) -> Image:
        """The image for a PLC that has these banks of the E area, too.  They follow its own, so no other offset changes."""
        missing = tuple(name for name in banks if name not in self.layout.e_banks)
        return self._laid_out(replace(self.layout, e_banks=(*self.layout.e_banks, *missing))) if missing else self

    def with_heap(self, size: int | None) -> Image:
        """The image for a PLC whose heap has so many bytes: as much as __NEW can take at the same time.

        The same image for None, and if the program has no __NEW.  Raises ValueError for a size that no heap has."""
        if size is None or not self.objects.heap_rows:
            return self
        if not 0 <= size <= LARGEST_HEAP:
            raise ValueError(f"a heap has 0 to {LARGEST_HEAP} bytes, not {size}")
        return self._laid_out(replace(self.layout, heap_bytes=size // 8 * 8))

    def _laid_out(self, layout: Layout) -> Image:
        """The image with another layout; the program finds its heap by the words that say where that is."""
        if not self.objects.heap_rows:
            return replace(self, layout=layout)
        at = self.objects.heap_at + HEAP["start"]
        bounds = b"".join(edge.to_bytes(4, "little") for edge in (layout.heap_at, layout.heap_at + layout.heap_bytes))
        return replace(self, layout=layout, initial=(*(row for row in self.initial if row[0] != at), (at, bounds)))


def _plain_bytes(data: Any) -> bytes:
    """Plain data as bytes that other data does not have: by `marshal`, or where data are nested too deep for that, flattened."""
    try:
        return marshal.dumps(data, SAME_FOR_EQUAL)
    except ValueError:
        left, found = [data], []
        while left:
            item = left.pop()
            found.append(f"({len(item)}" if isinstance(item, tuple) else repr(item))
            left += item if isinstance(item, tuple) else ()
        return "\n".join(found).encode("utf-8", "surrogatepass")
